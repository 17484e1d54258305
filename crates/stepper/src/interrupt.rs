//! The body of the step interrupt, shared by board and simulator.

use crate::{
    Early, Interval, LineStart, MotorMask, Power, Segment, Shared, StepPort, Stepper, Ticks,
};
use heapless::spsc::Consumer;

/// The step interrupt's state between calls.
#[derive(Debug)]
pub struct StepInterrupt<const MOTORS: usize> {
    stepper: Stepper<MOTORS>,
    /// The motors that step at the next call.
    due: MotorMask,
    /// The power from the next call on.
    power: Power,
    /// Added to the position of a motor by each of its steps: 1 or -1.
    sign: [i32; MOTORS],
}

/// Counts from one call to the next while a stop empties the queue: long enough for the main loop
/// to go on, short enough for 16 segments to be gone within 100 µs at 84 MHz.
const DRAIN_INTERVAL: Ticks = Ticks(500);

impl<const MOTORS: usize> Default for StepInterrupt<MOTORS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const MOTORS: usize> StepInterrupt<MOTORS> {
    /// Makes the state of a machine at rest.
    pub const fn new() -> Self {
        Self {
            stepper: Stepper::new(),
            due: MotorMask::NONE,
            power: Power::OFF,
            sign: [1; MOTORS],
        }
    }

    /// Returns how many of the next calls of [`on_timer`] will change no pin and take no segment.
    /// They are calls for smoothing ticks, which are most of all calls while motors are slow. One
    /// [`StepInterrupt::pass`] does the work of all of them, or of some.
    ///
    /// For simulators, while nobody else has access to `shared`.
    pub fn quiet_calls(&self, shared: &Shared<MOTORS>) -> u32 {
        let changes_nothing = self.due.is_empty() && self.power == self.stepper.power();
        if changes_nothing && !shared.is_restricted() {
            self.stepper.quiet_ticks()
        } else {
            0
        }
    }

    /// Returns the shortest and the longest of the waits that the next `calls` quiet calls would
    /// ask for.
    pub fn waits(&self, calls: u32) -> [Interval; 2] {
        self.stepper.intervals(calls)
    }

    /// Does the work of `calls` of the [`StepInterrupt::quiet_calls`]: at least one, and so few
    /// that their waits add up to less than 2³² counts. Arms no timer. `segments` tells the power
    /// after these calls. Returns the time from the first of these calls to the last one, and the
    /// wait that the last one asks for.
    pub fn pass(&mut self, calls: u32, segments: &Consumer<'_, Segment<MOTORS>>) -> [Ticks; 2] {
        let to_last = self.stepper.pass(calls.saturating_sub(1));
        self.stepper.take_tick(self.power);
        find_power(self, segments);
        self.due = self.stepper.trace();
        [to_last, self.stepper.wait()]
    }
}

/// The result of [`StepInterrupt::glide`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Glide<const MOTORS: usize> {
    /// The time from the first of the calls to the last one, and the wait that the last one asks
    /// for.
    pub waits: [Ticks; 2],
    /// The steps of each motor.
    pub steps: [u32; MOTORS],
}

impl<const MOTORS: usize> StepInterrupt<MOTORS> {
    /// Returns true if motion is stopped, a motor locked or the laser held off, or was until now.
    pub fn is_restricted(&self, shared: &Shared<MOTORS>) -> bool {
        shared.is_restricted()
    }

    /// Does the work of `calls` of [`on_timer`] that take no segment: at least one, and at most as
    /// many as ticks are left in the segment. Counts the steps, and puts nothing out on pins: the
    /// power changes with the next segment. Arms no timer.
    ///
    /// For simulators that ask for times only, while nothing restricts motion.
    pub fn glide(
        &mut self,
        calls: u32,
        segments: &Consumer<'_, Segment<MOTORS>>,
        shared: &Shared<MOTORS>,
    ) -> Glide<MOTORS> {
        let (to_last, mut steps) = self.stepper.glide(calls.saturating_sub(1));
        for (motor, steps) in steps.iter_mut().enumerate() {
            *steps += u32::from(self.due.contains(motor));
        }
        shared.count_many(&steps, &self.sign);
        self.stepper.take_tick(self.power);
        find_power(self, segments);
        self.due = self.stepper.trace();
        Glide {
            waits: [to_last, self.stepper.wait()],
            steps,
        }
    }
}

/// Makes the steps that are due and changes the power with them, then prepares the next tick.
///
/// Returns `true` if this tick looked for a segment: it took longer than others, and there is room
/// for a segment, or motion has ended. Then wake a main loop that sleeps. Returns `false` after all
/// other ticks, which leave nothing to do for the main loop.
///
/// Called from the step interrupt. Steps and power come first, so that they have no more jitter
/// than the interrupt's entry. Bounded: its only loops are over the motors. Inlined in every
/// caller: a call would have to save registers.
#[inline(always)]
pub fn on_timer<P: StepPort, const MOTORS: usize>(
    interrupt: &mut StepInterrupt<MOTORS>,
    segments: &mut Consumer<'_, Segment<MOTORS>>,
    shared: &Shared<MOTORS>,
    port: &mut P,
) -> bool {
    if shared.is_restricted() {
        if let Restricted::Stopped = restricted(interrupt, segments, shared, port) {
            return true;
        }
    } else {
        make_steps(interrupt, shared, port);
    }
    if interrupt.stepper.take_tick(interrupt.power) {
        find_power(interrupt, segments);
        port.arm(interrupt.stepper.wait());
        interrupt.due = interrupt.stepper.trace();
        // Not `make_up`: an image that inlines less calls it, which takes 12 cycles of each tick.
        if port.make_up() {
            shared.count_late();
        }
        false
    } else {
        next_segment(interrupt, segments, shared, port);
        true
    }
}

/// Prepares the start out of rest: puts out the power of the first segment. The first [`on_timer`]
/// has to follow at once; it puts out the directions.
///
/// Called by whoever starts the timer, while no tick can come.
pub fn start<P: StepPort, const MOTORS: usize>(
    interrupt: &mut StepInterrupt<MOTORS>,
    segments: &Consumer<'_, Segment<MOTORS>>,
    shared: &Shared<MOTORS>,
    port: &mut P,
) {
    let first = segments.peek().filter(|_| !shared.is_stopped());
    interrupt.power = first.map_or(Power::OFF, |first| first.power);
    interrupt.stepper.start(interrupt.power);
    put_out(interrupt.power, shared, port);
}

/// Makes the steps of a tick that is not restricted: the pins first, then the count.
fn make_steps<P: StepPort, const MOTORS: usize>(
    interrupt: &StepInterrupt<MOTORS>,
    shared: &Shared<MOTORS>,
    port: &mut P,
) {
    if !interrupt.due.is_empty() {
        port.step(interrupt.due);
    }
    if interrupt.power != interrupt.stepper.power() {
        port.set_power(interrupt.power);
    }
    shared.count(interrupt.due, &interrupt.sign);
}

/// The result of [`restricted`].
enum Restricted {
    /// Motion goes on.
    Moves,
    /// A stop: the tick and one segment were thrown away.
    Stopped,
}

/// Does the work of [`make_steps`] while motion is stopped, a motor is locked or the laser is held
/// off, or when one of these has just ended.
#[cold]
#[inline(never)]
fn restricted<P: StepPort, const MOTORS: usize>(
    interrupt: &mut StepInterrupt<MOTORS>,
    segments: &mut Consumer<'_, Segment<MOTORS>>,
    shared: &Shared<MOTORS>,
    port: &mut P,
) -> Restricted {
    shared.refresh_restricted();
    if shared.is_stopped() {
        stop(interrupt, segments, shared, port);
        return Restricted::Stopped;
    }
    let free = shared.free(interrupt.due);
    if !free.is_empty() {
        port.step(free);
        shared.count(free, &interrupt.sign);
    }
    put_out(interrupt.power, shared, port);
    Restricted::Moves
}

/// Puts out `power`, or keeps the laser off.
// A call takes some 10 cycles of each tick in an image that inlines less.
#[inline(always)]
fn put_out<P: StepPort, const MOTORS: usize>(power: Power, shared: &Shared<MOTORS>, port: &mut P) {
    let off = shared.is_laser_off();
    port.set_power(if off { Power::OFF } else { power });
}

/// Makes the tick that was armed come at once if its instant has passed meanwhile.
fn make_up<P: StepPort, const MOTORS: usize>(shared: &Shared<MOTORS>, port: &mut P) {
    if port.make_up() {
        shared.count_late();
    }
}

/// Finds the power that begins with the tick that was taken.
fn find_power<const MOTORS: usize>(
    interrupt: &mut StepInterrupt<MOTORS>,
    segments: &Consumer<'_, Segment<MOTORS>>,
) {
    let next = || segments.peek().map(|next| next.power);
    interrupt.power = interrupt.stepper.next_power(next);
}

/// Begins the next segment and asks for its first tick; comes to rest if there is none.
fn next_segment<P: StepPort, const MOTORS: usize>(
    interrupt: &mut StepInterrupt<MOTORS>,
    segments: &mut Consumer<'_, Segment<MOTORS>>,
    shared: &Shared<MOTORS>,
    port: &mut P,
) {
    let Some(segment) = segments.peek() else {
        return run_out(interrupt, shared, port);
    };
    let turns = match &segment.line {
        Some(start) => begin(interrupt, start, segment.early, port),
        None => false,
    };
    interrupt.stepper.load(segment);
    let least = if turns {
        shared.direction_wait()
    } else {
        Ticks(0)
    };
    // If `least` makes the tick later, all following ticks are later by the same time.
    port.arm(interrupt.stepper.wait().max(least));
    if segment.power != interrupt.power {
        // The tick before this one looked for the next power when this segment was not there yet.
        put_out(segment.power, shared, port);
    }
    port.change_outputs(segment.outputs);
    segments.dequeue();
    interrupt.due = interrupt.stepper.trace();
    find_power(interrupt, segments);
    make_up(shared, port);
}

/// Begins a line. Puts out the line's directions if a motor reverses. Returns whether one does.
fn begin<P: StepPort, const MOTORS: usize>(
    interrupt: &mut StepInterrupt<MOTORS>,
    start: &LineStart<MOTORS>,
    early: Early,
    port: &mut P,
) -> bool {
    let turns = interrupt.stepper.begin(start, early);
    if turns {
        let negative = start.line().direction();
        for (motor, sign) in interrupt.sign.iter_mut().enumerate() {
            *sign = if negative.contains(motor) { -1 } else { 1 };
        }
        port.set_direction(negative);
    }
    turns
}

/// Comes to rest, as planned or by an underrun, because there is no further segment.
#[cold]
#[inline(never)]
fn run_out<P: StepPort, const MOTORS: usize>(
    interrupt: &mut StepInterrupt<MOTORS>,
    shared: &Shared<MOTORS>,
    port: &mut P,
) {
    interrupt.due = MotorMask::NONE;
    let planned = interrupt.stepper.run_out();
    if planned.is_none() {
        shared.count_underrun();
    }
    rest(planned.unwrap_or(Power::OFF), shared, port);
}

/// Throws away the tick under way and one segment; rests once none is left.
#[cold]
#[inline(never)]
fn stop<P: StepPort, const MOTORS: usize>(
    interrupt: &mut StepInterrupt<MOTORS>,
    segments: &mut Consumer<'_, Segment<MOTORS>>,
    shared: &Shared<MOTORS>,
    port: &mut P,
) {
    interrupt.due = MotorMask::NONE;
    interrupt.power = Power::OFF;
    interrupt.stepper.abort();
    match segments.dequeue() {
        Some(_) => {
            port.set_power(Power::OFF);
            port.arm(DRAIN_INTERVAL);
            port.make_up();
        }
        None => rest(Power::OFF, shared, port),
    }
}

fn rest<P: StepPort, const MOTORS: usize>(power: Power, shared: &Shared<MOTORS>, port: &mut P) {
    let allowed = if shared.is_laser_off() {
        Power::OFF
    } else {
        power
    };
    port.set_power(allowed);
    port.rest();
    shared.rest();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{IntervalChange, OutputChange, PowerChange, PowerScale};
    use crate::{Line, Smoothing};
    use core::num::NonZeroU16;
    use heapless::spsc::Queue;

    extern crate std;
    use std::vec::Vec;

    #[derive(Default)]
    struct Bench {
        pulses: [u32; 2],
        /// Each power that was set, in percent.
        powers: Vec<u32>,
        power: Power,
        direction: MotorMask,
        armed: Option<Ticks>,
        /// All waits.
        waits: Vec<u32>,
    }

    impl StepPort for Bench {
        fn step(&mut self, motors: MotorMask) {
            assert!(!motors.is_empty());
            for (motor, pulses) in self.pulses.iter_mut().enumerate() {
                *pulses += u32::from(motors.contains(motor));
            }
        }
        fn set_direction(&mut self, negative: MotorMask) {
            self.direction = negative;
        }
        fn set_power(&mut self, power: Power) {
            self.power = power;
            self.powers.push(power.level(PowerScale::new(100)));
        }
        fn change_outputs(&mut self, _: OutputChange) {}
        fn arm(&mut self, wait: Ticks) {
            self.armed = Some(wait);
            self.waits.push(wait.0);
        }
        fn make_up(&mut self) -> bool {
            false
        }
        fn rest(&mut self) {
            self.armed = None;
        }
    }

    fn line(delta: [i32; 2], at_rest: Option<Power>) -> Segment<2> {
        let line = Line::new(delta).unwrap();
        let early = Early::half_a_tick(Smoothing::None);
        Segment {
            line: Some(LineStart::new(line, early)),
            ticks: NonZeroU16::new(line.step_events().get() as u16).unwrap(),
            smoothing: Smoothing::None,
            motors: MotorMask::ALL,
            ends_event: true,
            early,
            interval: Interval::from_num(1000),
            interval_change: IntervalChange::ZERO,
            power: Power::FULL,
            power_change: PowerChange::ZERO,
            outputs: OutputChange::NONE,
            at_rest,
        }
    }

    /// Calls the interrupt until the timer rests; `meddle` is called before each call with its
    /// number.
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
            if calls == 0 {
                start(&mut interrupt, &consumer, shared, &mut port);
            }
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
    fn the_first_tick_after_a_change_of_direction_waits_for_the_drivers() {
        let shared = Shared::new();
        shared.set_direction_wait(Ticks(5000));
        let moves = [
            line([2, 1], None),
            line([2, -1], None),
            line([2, -1], Some(Power::OFF)),
        ];
        let (port, _) = run(&moves, &shared, |_| ());
        assert_eq!(port.waits, [1000, 1000, 5000, 1000, 1000, 1000]);
        shared.set_direction_wait(Ticks(10));
        let (port, _) = run(&moves, &shared, |_| ());
        assert_eq!(port.waits, [1000; 6]);
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
    fn a_start_that_is_stopped_makes_nothing_but_the_queue_empty() {
        let shared = Shared::new();
        shared.set_stop(true);
        let mut queue: Queue<Segment<2>, 8> = Queue::new();
        let (mut producer, mut consumer) = queue.split();
        producer.enqueue(line([9, 0], Some(Power::FULL))).unwrap();
        let (mut interrupt, mut port) = (StepInterrupt::new(), Bench::default());
        shared.set_running();
        start(&mut interrupt, &consumer, &shared, &mut port);
        while shared.is_running() {
            on_timer(&mut interrupt, &mut consumer, &shared, &mut port);
        }
        assert_eq!((port.pulses, port.power), ([0, 0], Power::OFF));
        assert!(!port.powers.contains(&100));
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
    fn the_laser_comes_back_at_the_next_tick_once_it_is_released() {
        for held in 0..8 {
            let shared = Shared::new();
            let (port, calls) = run(&[line([9, 0], Some(Power::OFF))], &shared, |call| {
                if call == held || call == held + 1 {
                    shared.set_laser_off(call == held);
                }
            });
            assert_eq!(calls, 10);
            // The power of the first segment first. Nothing while it does not change. Off while
            // held, then full once more; 0 with the last step and at rest.
            let mut expected = Vec::new();
            expected.push(if held > 0 { 100 } else { 0 });
            expected.extend([0, 100, 0, 0]);
            assert_eq!(port.powers, expected, "held at call {held}");
        }
    }

    #[test]
    fn a_power_that_changes_is_set_at_every_tick_and_a_steady_one_once() {
        let steady = line([4, 0], None);
        let rising = Segment {
            power: Power::OFF,
            power_change: PowerChange::from_num(0.25),
            ..line([4, 0], Some(Power::OFF))
        };
        let (port, _) = run(&[steady, rising], &Shared::new(), |_| ());
        assert_eq!(port.powers, [100, 0, 25, 50, 75, 0, 0]);
    }

    #[test]
    fn power_changes_right_after_the_step_that_it_changes_with() {
        struct Order(Vec<(char, u32)>);
        impl StepPort for Order {
            fn step(&mut self, motors: MotorMask) {
                self.0.push(('s', u32::from(motors.bits())));
            }
            fn set_power(&mut self, power: Power) {
                self.0.push(('p', power.level(PowerScale::new(100))));
            }
            fn set_direction(&mut self, _: MotorMask) {}
            fn change_outputs(&mut self, _: OutputChange) {}
            fn arm(&mut self, wait: Ticks) {
                self.0.push(('a', wait.0));
            }
            fn make_up(&mut self) -> bool {
                false
            }
            fn rest(&mut self) {}
        }
        let mut queue: Queue<Segment<2>, 4> = Queue::new();
        let (mut producer, mut consumer) = queue.split();
        let dark = Segment {
            power: Power::OFF,
            ..line([1, 0], None)
        };
        for pixel in [line([2, 0], None), dark, line([1, 0], Some(Power::OFF))] {
            producer.enqueue(pixel).unwrap();
        }
        let (mut interrupt, mut port, shared) =
            (StepInterrupt::new(), Order(Vec::new()), Shared::new());
        shared.set_running();
        start(&mut interrupt, &consumer, &shared, &mut port);
        for _ in 0..4 {
            on_timer(&mut interrupt, &mut consumer, &shared, &mut port);
        }
        let expected = [
            [('p', 100), ('a', 1000)].as_slice(),
            &[('s', 1), ('a', 1000)],
            &[('s', 1), ('p', 0), ('a', 1000)],
            &[('s', 1), ('p', 100), ('a', 1000)],
        ];
        assert_eq!(port.0, expected.concat());
    }

    #[test]
    fn a_tick_at_which_no_motor_steps_makes_no_pulse() {
        let segment = Segment {
            ticks: NonZeroU16::new(12).unwrap(),
            smoothing: Smoothing::Fourfold,
            motors: MotorMask::ALL,
            ends_event: true,
            early: Early::half_a_tick(Smoothing::Fourfold),
            ..line([3, 1], Some(Power::OFF))
        };
        let (port, calls) = run(&[segment], &Shared::new(), |_| ());
        assert_eq!(port.pulses, [3, 1]);
        assert_eq!(calls, 13);
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
