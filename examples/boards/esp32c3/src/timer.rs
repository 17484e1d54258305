//! The chip's system timer: a count of 52 bits, of which the HAL makes microseconds. Its first alarm
//! is the step timer's. A software interrupt makes the step interrupt come at once.

use esp_hal::{
    interrupt::{software::SoftwareInterrupt, InterruptHandler},
    peripherals::{FROM_CPU_INTR0, SYSTIMER},
    time::Duration,
    timer::{systimer::SystemTimer, OneShotTimer},
    Blocking,
};
use leadscrew::{Alarm, Instant};
use static_cell::StaticCell;

/// The counts in a second.
pub(crate) const HZ: u32 = 1_000_000;

type Pend = SoftwareInterrupt<'static, 0>;

/// Starts the step timer, whose interrupt calls `step`. Returns it, and what makes its interrupt come
/// at once. Called once.
pub(crate) fn start(
    timer: SYSTIMER<'static>,
    pend: FROM_CPU_INTR0<'static>,
    step: InterruptHandler,
) -> (StepTimer, &'static Pend) {
    static PEND: StaticCell<Pend> = StaticCell::new();
    let pend = PEND.init(SoftwareInterrupt::new(pend));
    pend.set_interrupt_handler(step);
    let mut alarm = OneShotTimer::new(SystemTimer::new(timer).alarm0);
    alarm.set_interrupt_handler(step);
    alarm.listen();
    (StepTimer { alarm, pend }, pend)
}

/// The time for the machine. Called by the main loop.
pub(crate) fn now() -> Instant {
    Instant::from_ticks(
        esp_hal::time::Instant::now()
            .duration_since_epoch()
            .as_micros(),
    )
}

/// The step timer.
pub(crate) struct StepTimer {
    alarm: OneShotTimer<'static, Blocking>,
    pend: &'static Pend,
}

impl Alarm for StepTimer {
    fn count(&self) -> u32 {
        now().ticks() as u32
    }

    fn ring_at(&mut self, at: u32) {
        self.silence();
        match u64::try_from(at.wrapping_sub(self.count()).cast_signed()) {
            // The HAL counts from the instant at which it is called, a microsecond later at most.
            Ok(left @ 1..) if self.alarm.schedule(Duration::from_micros(left)).is_ok() => {}
            _ => self.pend.raise(),
        }
    }

    fn silence(&mut self) {
        self.alarm.stop();
        self.alarm.clear_interrupt();
        self.pend.reset();
    }
}
