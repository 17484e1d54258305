//! The body of the step interrupt, shared by board and simulator.

use crate::{Power, Progress, Segment, Shared, StepPort, Stepper, Tick, Ticks};
use heapless::spsc::Consumer;

/// What the step interrupt keeps between calls.
#[derive(Debug, Default)]
pub struct StepInterrupt<const MOTORS: usize> {
    stepper: Stepper<MOTORS>,
    /// The tick that is due at the next call; `None` where that call starts out of rest.
    due: Option<Tick>,
}

/// Counts from one call to the next while a stop empties the queue: long enough for the main loop to go
/// on, short enough for 16 segments to be gone within 100 µs at 84 MHz.
const DRAIN_INTERVAL: Ticks = Ticks(500);

impl<const MOTORS: usize> StepInterrupt<MOTORS> {
    /// Makes the state of a machine at rest.
    pub const fn new() -> Self {
        Self {
            stepper: Stepper::new(),
            due: None,
        }
    }
}

/// Makes the steps that are due, then prepares the next tick.
///
/// Called from the step interrupt (and once by whoever starts the timer out of rest, in its place).
/// The steps come first, so that their jitter is that of the interrupt's entry. Bounded: no loop but
/// those over the motors.
#[inline]
pub fn on_timer<P: StepPort, const MOTORS: usize>(
    interrupt: &mut StepInterrupt<MOTORS>,
    segments: &mut Consumer<'_, Segment<MOTORS>>,
    shared: &Shared<MOTORS>,
    port: &mut P,
) {
    if shared.is_stopped() {
        return stop(interrupt, segments, shared, port);
    }
    if let Some(tick) = interrupt.due.take() {
        let step = tick.step.without(shared.motor_lock());
        port.step(step);
        shared.count(step, tick.direction);
    }
    match interrupt.stepper.tick(|| segments.dequeue()) {
        Progress::Tick(tick) => prepare(interrupt, tick, shared, port),
        Progress::Rest(power) => rest(power, shared, port),
        Progress::Underrun => {
            shared.count_underrun();
            rest(Power::OFF, shared, port);
        }
    }
}

#[inline]
fn prepare<P: StepPort, const MOTORS: usize>(
    interrupt: &mut StepInterrupt<MOTORS>,
    tick: Tick,
    shared: &Shared<MOTORS>,
    port: &mut P,
) {
    interrupt.due = Some(tick);
    port.set_direction(tick.direction);
    port.set_power(allowed(tick.power, shared));
    port.set_outputs(tick.outputs);
    if port.arm(tick.wait) {
        shared.count_late();
    }
}

fn rest<P: StepPort, const MOTORS: usize>(power: Power, shared: &Shared<MOTORS>, port: &mut P) {
    port.set_power(allowed(power, shared));
    port.rest();
    shared.rest();
}

/// Throws away the tick under way and one segment; rests once none is left.
fn stop<P: StepPort, const MOTORS: usize>(
    interrupt: &mut StepInterrupt<MOTORS>,
    segments: &mut Consumer<'_, Segment<MOTORS>>,
    shared: &Shared<MOTORS>,
    port: &mut P,
) {
    interrupt.due = None;
    interrupt.stepper.abort();
    match segments.dequeue() {
        Some(_) => {
            port.set_power(Power::OFF);
            port.arm(DRAIN_INTERVAL);
        }
        None => rest(Power::OFF, shared, port),
    }
}

#[inline]
fn allowed<const MOTORS: usize>(power: Power, shared: &Shared<MOTORS>) -> Power {
    if shared.is_laser_off() {
        Power::OFF
    } else {
        power
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Interval, IntervalChange, Line, MotorMask, Outputs, PowerChange, Smoothing};
    use core::num::NonZeroU16;
    use heapless::spsc::Queue;

    #[derive(Default)]
    struct Bench {
        pulses: [u32; 2],
        power: Power,
        direction: MotorMask,
        armed: Option<Ticks>,
    }

    impl StepPort for Bench {
        fn step(&mut self, motors: MotorMask) {
            for (motor, pulses) in self.pulses.iter_mut().enumerate() {
                *pulses += u32::from(motors.contains(motor));
            }
        }
        fn set_direction(&mut self, negative: MotorMask) {
            self.direction = negative;
        }
        fn set_power(&mut self, power: Power) {
            self.power = power;
        }
        fn set_outputs(&mut self, _: Outputs) {}
        fn arm(&mut self, wait: Ticks) -> bool {
            self.armed = Some(wait);
            false
        }
        fn rest(&mut self) {
            self.armed = None;
        }
    }

    fn line(delta: [i32; 2], at_rest: Option<Power>) -> Segment<2> {
        let line = Line::new(delta).unwrap();
        Segment {
            line: Some(line),
            ticks: NonZeroU16::new(line.step_events().get() as u16).unwrap(),
            smoothing: Smoothing::None,
            interval: Interval::from_num(1000),
            interval_change: IntervalChange::ZERO,
            power: Power::FULL,
            power_change: PowerChange::ZERO,
            outputs: Outputs(0),
            at_rest,
        }
    }

    /// Calls the interrupt until the timer rests; `meddle` is called before each call with its number.
    fn run(
        segments: &[Segment<2>],
        shared: &Shared<2>,
        mut meddle: impl FnMut(u32),
    ) -> (Bench, u32) {
        let mut queue: Queue<Segment<2>, 8> = Queue::new();
        let (mut producer, mut consumer) = queue.split();
        for segment in segments {
            producer.enqueue(*segment).unwrap();
        }
        let (mut interrupt, mut port, mut calls) = (StepInterrupt::new(), Bench::default(), 0);
        shared.set_running();
        while shared.is_running() {
            meddle(calls);
            on_timer(&mut interrupt, &mut consumer, shared, &mut port);
            calls += 1;
        }
        (port, calls)
    }

    #[test]
    fn every_pulse_is_counted_in_its_direction() {
        let shared = Shared::new();
        let moves = [line([5, -3], None), line([-2, 1], Some(Power::OFF))];
        let (port, calls) = run(&moves, &shared, |_| ());
        assert_eq!(port.pulses, [7, 4]);
        assert_eq!(shared.position(), [3, -2]);
        assert_eq!(calls, 8); // one to start, one a tick
        assert_eq!(port.armed, None);
    }

    #[test]
    fn a_locked_motor_is_neither_stepped_nor_counted() {
        let shared = Shared::new();
        shared.set_motor_lock(MotorMask::only(1));
        let (port, _) = run(&[line([5, 5], Some(Power::OFF))], &shared, |_| ());
        assert_eq!(port.pulses, [5, 0]);
        assert_eq!(shared.position(), [5, 0]);
    }

    #[test]
    fn a_stop_makes_no_further_step_and_empties_the_queue() {
        let shared = Shared::new();
        let moves = [line([100, 0], None), line([100, 0], Some(Power::OFF))];
        let (port, calls) = run(&moves, &shared, |call| {
            if call == 11 {
                shared.set_stop(true);
            }
        });
        assert_eq!(port.pulses, [10, 0]);
        assert_eq!(shared.position(), [10, 0]);
        assert_eq!(port.power, Power::OFF);
        assert!(calls < 16);
        assert_eq!(shared.underruns(), 0);
    }

    #[test]
    fn the_laser_stays_off_through_later_ticks_once_it_is_held_off() {
        let shared = Shared::new();
        let (port, _) = run(&[line([9, 0], Some(Power::FULL))], &shared, |call| {
            shared.set_laser_off(call >= 5);
        });
        assert_eq!(port.power, Power::OFF);
        assert_eq!(port.pulses, [9, 0]);
    }

    #[test]
    fn power_stays_on_at_rest_where_the_segment_says_so() {
        let (port, _) = run(&[line([3, 0], Some(Power::FULL))], &Shared::new(), |_| ());
        assert_eq!(port.power, Power::FULL);
    }

    #[test]
    fn an_underrun_is_counted_and_switches_the_laser_off() {
        let shared = Shared::new();
        let (port, _) = run(&[line([3, 0], None)], &shared, |_| ());
        assert_eq!(shared.underruns(), 1);
        assert_eq!(port.power, Power::OFF);
    }
}
