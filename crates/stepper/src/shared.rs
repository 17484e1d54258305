//! All that crosses between the step interrupt and everybody else, besides the segment queue.
//!
//! Each word has one writer, so that plain loads and stores are enough (no compare-and-swap, which
//! a Cortex-M0 lacks):
//!
//! | word | written by | read by |
//! |---|---|---|
//! | stop, laser off, motor lock | main loop and switch interrupts (store only) | step interrupt, first thing |
//! | position, running, counters | step interrupt | anybody |
//!
//! `running` has two writers that never meet: the main loop sets it before it starts the timer, the
//! interrupt clears it as it stops the timer.

use crate::MotorMask;
use core::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, AtomicU8, Ordering};

/// Words shared by the step interrupt, the switch interrupts and the main loop.
#[derive(Debug)]
pub struct Shared<const MOTORS: usize> {
    stop: AtomicBool,
    laser_off: AtomicBool,
    motor_lock: AtomicU8,
    running: AtomicBool,
    underruns: AtomicU32,
    late_ticks: AtomicU32,
    position: [AtomicI32; MOTORS],
}

impl<const MOTORS: usize> Default for Shared<MOTORS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const MOTORS: usize> Shared<MOTORS> {
    /// Makes the words of a machine at rest at position 0, nothing locked.
    pub const fn new() -> Self {
        Self {
            stop: AtomicBool::new(false),
            laser_off: AtomicBool::new(false),
            motor_lock: AtomicU8::new(0),
            running: AtomicBool::new(false),
            underruns: AtomicU32::new(0),
            late_ticks: AtomicU32::new(0),
            position: [const { AtomicI32::new(0) }; MOTORS],
        }
    }

    /// Stops stepping before the next step (`true`), or allows it again (`false`). Any context.
    ///
    /// While stopped, the step interrupt throws away one segment a call until the queue is empty and then
    /// rests; the laser is off.
    pub fn set_stop(&self, stop: bool) {
        self.stop.store(stop, Ordering::Release);
    }

    /// Whether stepping is stopped. Any context.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Acquire)
    }

    /// Holds the laser off, whatever later ticks ask for (`true`), or releases it. Any context.
    pub fn set_laser_off(&self, off: bool) {
        self.laser_off.store(off, Ordering::Release);
    }

    /// Whether the laser is held off. Any context.
    pub fn is_laser_off(&self) -> bool {
        self.laser_off.load(Ordering::Acquire)
    }

    /// Keeps the motors of `lock` from stepping: their pulses are neither made nor counted. Any context.
    pub fn set_motor_lock(&self, lock: MotorMask) {
        self.motor_lock.store(lock.bits(), Ordering::Release);
    }

    /// The motors that are kept from stepping. Any context.
    pub fn motor_lock(&self) -> MotorMask {
        MotorMask::from_bits(self.motor_lock.load(Ordering::Acquire))
    }

    /// Whether the step timer runs. Any context.
    pub fn is_running(&self) -> bool {
        self.running.load(Ordering::Acquire)
    }

    /// Notes that the step timer is being started. Main loop only, before the timer is started.
    pub fn set_running(&self) {
        self.running.store(true, Ordering::Release);
    }

    /// How often segments ran out in the middle of motion, since power-up. Any context.
    pub fn underruns(&self) -> u32 {
        self.underruns.load(Ordering::Relaxed)
    }

    /// How often a tick was due before the one ahead of it had been dealt with, since power-up. Any context.
    pub fn late_ticks(&self) -> u32 {
        self.late_ticks.load(Ordering::Relaxed)
    }

    /// Steps made by each motor since power-up, positive less negative. Any context.
    ///
    /// While the motors run each number is right by itself; one step may come between two of them.
    pub fn position(&self) -> [i32; MOTORS] {
        core::array::from_fn(|motor| match self.position.get(motor) {
            Some(count) => count.load(Ordering::Relaxed),
            None => 0,
        })
    }

    /// Declares the present position to be `steps`. Main loop only, with the motors at rest (homing).
    pub fn set_position(&self, steps: [i32; MOTORS]) {
        for (count, value) in self.position.iter().zip(steps) {
            count.store(value, Ordering::Relaxed);
        }
    }

    /// Counts one step of each motor in `stepped`. Step interrupt only.
    pub(crate) fn count(&self, stepped: MotorMask, negative: MotorMask) {
        for (motor, count) in self.position.iter().enumerate() {
            let up = i32::from(stepped.bits() >> motor & 1);
            let sign = 1 - 2 * i32::from(negative.bits() >> motor & 1);
            count.store(
                count.load(Ordering::Relaxed).wrapping_add(up * sign),
                Ordering::Relaxed,
            );
        }
    }

    /// Notes that the timer rests. Step interrupt only.
    pub(crate) fn rest(&self) {
        self.running.store(false, Ordering::Release);
    }

    /// Counts an underrun. Step interrupt only.
    pub(crate) fn count_underrun(&self) {
        self.underruns
            .store(self.underruns().wrapping_add(1), Ordering::Relaxed);
    }

    /// Counts a late tick. Step interrupt only.
    pub(crate) fn count_late(&self) {
        self.late_ticks
            .store(self.late_ticks().wrapping_add(1), Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_counted_up_and_down() {
        let shared = Shared::<3>::new();
        shared.count(MotorMask::from_bits(0b011), MotorMask::from_bits(0b010));
        shared.count(MotorMask::from_bits(0b110), MotorMask::from_bits(0b010));
        assert_eq!(shared.position(), [1, -2, 1]);
    }

    #[test]
    fn position_wraps_instead_of_panicking() {
        let shared = Shared::<1>::new();
        shared.set_position([i32::MAX]);
        shared.count(MotorMask::only(0), MotorMask::NONE);
        assert_eq!(shared.position(), [i32::MIN]);
    }
}
