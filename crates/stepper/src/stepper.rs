//! Bresenham's tracer over the dominant motor, timed by linear intervals.

use crate::{
    Early, Interval, IntervalChange, LineStart, MotorMask, OutputChange, Power, PowerChange,
    Segment, Ticks, MAX_SMOOTHING_LEVEL,
};

/// One tick of the step timer: its steps and power, and the wait before it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tick {
    /// Time from the tick before (or from the start out of rest) to this tick.
    pub wait: Ticks,
    /// The motors that step at this tick; none at most smoothing ticks.
    pub step: MotorMask,
    /// The motors that turn in the negative direction.
    pub direction: MotorMask,
    /// The power to put out during `wait`, up to this tick.
    pub power: Power,
    /// The outputs that change at the start of `wait`.
    pub outputs: OutputChange,
}

/// The answer of [`Stepper::tick`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Progress {
    /// The next tick.
    Tick(Tick),
    /// Motion has come to rest as planned; put this power out from now on.
    Rest(Power),
    /// The segments ran out in the middle of motion.
    Underrun,
}

/// This bit is set in negative numbers (modulo 2³²) and in no others, because the tracer counts to
/// less than 2³⁰.
const SIGN: u32 = 30;

/// Turns segments into ticks.
///
/// Lives in the step interrupt. `MOTORS` is 1 to [`MAX_MOTORS`](crate::MAX_MOTORS).
#[derive(Clone, Debug)]
pub struct Stepper<const MOTORS: usize> {
    /// The distance of each motor from its next step, less 1: the motor steps when this falls below
    /// 0.
    left: [u32; MOTORS],
    /// The distance by which a tick advances each motor.
    increment: [u32; MOTORS],
    /// The distance from one step to the next: sixteen times the line's step events.
    full: u32,
    /// The time by which motors other than the dominant one step early.
    early: Early,
    /// Ticks that the segment still has; none if 0 or less.
    ticks_left: i32,
    /// Bits of the next [`Interval`].
    interval: u64,
    interval_change: IntervalChange,
    /// The fraction of a timer count that is left over from the waits so far, in 2⁻³² counts.
    fraction: u32,
    power: Power,
    power_change: PowerChange,
    direction: MotorMask,
    at_rest: Option<Power>,
    steps: [u32; MOTORS],
}

impl<const MOTORS: usize> Default for Stepper<MOTORS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const MOTORS: usize> Stepper<MOTORS> {
    /// Makes a stepper at rest.
    pub const fn new() -> Self {
        Self {
            left: [0; MOTORS],
            increment: [0; MOTORS],
            full: 1,
            early: Early::NOT,
            ticks_left: 0,
            interval: 0,
            interval_change: IntervalChange::ZERO,
            fraction: 0,
            power: Power::OFF,
            power_change: PowerChange::ZERO,
            direction: MotorMask::NONE,
            at_rest: Some(Power::OFF),
            steps: [0; MOTORS],
        }
    }

    /// Produces the next tick, taking a segment from `next` if the last one is used up.
    ///
    /// For tests and traces. The step interrupt does the same work in pieces, without a `Tick`.
    /// Bounded: its only loops are over the motors.
    pub fn tick(&mut self, next: impl FnOnce() -> Option<Segment<MOTORS>>) -> Progress {
        let mut outputs = OutputChange::NONE;
        let power = self.next_power(|| None);
        if !self.take_tick(power) {
            let Some(segment) = next() else {
                return self.run_out().map_or(Progress::Underrun, Progress::Rest);
            };
            if let Some(line) = &segment.line {
                self.begin(line, segment.early);
            }
            outputs = segment.outputs;
            self.load(&segment);
        }
        Progress::Tick(Tick {
            wait: self.wait(),
            step: self.trace(),
            direction: self.direction,
            power: self.power,
            outputs,
        })
    }

    /// Takes one more tick of the segment; `power` is the power up to this tick. Returns whether
    /// there was one: if not, another segment has to be loaded.
    #[inline]
    pub(crate) fn take_tick(&mut self, power: Power) -> bool {
        self.ticks_left = self.ticks_left.wrapping_sub(1);
        if self.ticks_left < 0 {
            return false;
        }
        self.power = power;
        true
    }

    /// Returns how many of the next ticks of the segment keep the power, up to and including the
    /// first tick that may step a motor. After the segment's last tick the power may change.
    pub(crate) fn quiet_ticks(&self) -> u32 {
        if self.power_change != PowerChange::ZERO {
            return 0;
        }
        let in_segment = u32::try_from(self.ticks_left).unwrap_or(0);
        let motors = self.left.iter().zip(&self.increment);
        motors.fold(in_segment, |least, (left, increment)| {
            let is_due = left >> SIGN & 1 == 1;
            let to_step = if is_due {
                0
            } else {
                left.checked_div(*increment).unwrap_or(u32::MAX - 1)
            };
            least.min(to_step + 1)
        })
    }

    /// The shortest and the longest interval before the next `count` ticks of the segment.
    pub(crate) fn intervals(&self, count: u32) -> [Interval; 2] {
        let further = i64::from(count.saturating_sub(1));
        let change = self.interval_change.to_bits().wrapping_mul(further);
        let first = Interval::from_bits(self.interval);
        let last = first.wrapping_add_signed(IntervalChange::from_bits(change));
        [first.min(last), first.max(last)]
    }

    /// Takes `count` ticks that step no motor. Returns how long they take, `p·n + d·n(n−1)/2`
    /// counts: fewer than 2³².
    pub(crate) fn pass(&mut self, count: u32) -> Ticks {
        self.ticks_left = self.ticks_left.wrapping_sub(count.cast_signed());
        for (left, increment) in self.left.iter_mut().zip(&self.increment) {
            *left = left.wrapping_sub(increment.wrapping_mul(count));
        }
        let ticks = u64::from(count);
        let pairs = ticks * ticks.saturating_sub(1) / 2;
        let change = self.interval_change.to_bits().cast_unsigned();
        let due = u64::from(self.fraction)
            .wrapping_add(self.interval.wrapping_mul(ticks))
            .wrapping_add(change.wrapping_mul(pairs));
        self.interval = self.interval.wrapping_add(change.wrapping_mul(ticks));
        self.fraction = due as u32;
        Ticks((due >> 32) as u32)
    }

    /// As [`Stepper::pass`], for ticks that may step motors. Returns how often each motor steps, too.
    pub(crate) fn glide(&mut self, count: u32) -> (Ticks, [u32; MOTORS]) {
        let mut steps = [0; MOTORS];
        for (steps, (left, increment)) in
            steps.iter_mut().zip(self.left.iter().zip(&self.increment))
        {
            if *increment == 0 {
                continue;
            }
            let way = i64::from(*increment) * i64::from(count) - i64::from(left.cast_signed());
            let way = u64::try_from(way).unwrap_or(0);
            let whole = way.div_ceil(u64::from(self.full.max(1)));
            *steps = count.min(u32::try_from(whole).unwrap_or(count));
        }
        let took = self.pass(count);
        for (left, steps) in self.left.iter_mut().zip(steps) {
            *left = left.wrapping_add(self.full.wrapping_mul(steps));
        }
        (took, steps)
    }

    /// Begins a line; `early` is the earliness in its first segment. Returns whether a motor
    /// reverses.
    #[inline]
    pub(crate) fn begin(&mut self, start: &LineStart<MOTORS>, early: Early) -> bool {
        let line = start.line();
        let turns = line.direction() != self.direction;
        self.full = line.step_events().get() << MAX_SMOOTHING_LEVEL;
        self.direction = line.direction();
        self.steps = *line.steps();
        self.early = early.in_whole_events();
        self.left = *start.left();
        turns
    }

    /// Makes the motors other than the dominant one step as early as `early` says, which is without
    /// the flag of a part. If they step earlier than before, a motor may be due already. It then
    /// steps at the next tick.
    #[cold]
    #[inline(never)]
    fn change_early(&mut self, early: Early) {
        let events = self.full >> MAX_SMOOTHING_LEVEL;
        for (left, steps) in self.left.iter_mut().zip(self.steps) {
            if steps != events {
                let later = self.early.of(steps).wrapping_sub(early.of(steps));
                *left = left.wrapping_add(later);
            }
        }
        self.early = early;
    }

    /// Begins a segment (its line, if it has one, has begun already) and takes its first tick.
    #[inline]
    pub(crate) fn load(&mut self, segment: &Segment<MOTORS>) {
        let shift = MAX_SMOOTHING_LEVEL - segment.smoothing.level();
        let mut increment = self.steps.map(|steps| steps << shift);
        // `early` of a part has a flag that `self.early` never has. So one comparison is enough for
        // most segments.
        if segment.early != self.early {
            let early = segment.early.in_whole_events();
            if early != self.early {
                self.change_early(early);
            }
            if segment.early.is_of_a_part() {
                keep_only(segment.motors, &mut increment);
            }
        }
        self.increment = increment;
        self.ticks_left = i32::from(segment.ticks.get()) - 1;
        self.interval = segment.interval.to_bits();
        self.interval_change = segment.interval_change;
        self.power = segment.power;
        self.power_change = segment.power_change;
        self.at_rest = segment.at_rest;
    }

    /// Begins motion out of rest; the caller has put out `power`.
    pub(crate) fn start(&mut self, power: Power) {
        self.power = power;
    }

    /// The power up to the tick that was taken last.
    #[inline]
    pub(crate) fn power(&self) -> Power {
        self.power
    }

    /// The power from the last tick that was taken on. Within a segment it is the power of the
    /// segment. At the end of a segment it is the power of the `next` segment, or, if motion
    /// ends, the power at rest. It stays as it is while the next segment is missing.
    // A call takes 7 cycles of each tick in an image that inlines less.
    #[inline(always)]
    pub(crate) fn next_power(&self, next: impl FnOnce() -> Option<Power>) -> Power {
        if self.ticks_left > 0 {
            self.power.changed_by(self.power_change)
        } else {
            next().or(self.at_rest).unwrap_or(self.power)
        }
    }

    /// The whole counts to wait for the tick that was taken; the fraction is carried on. Called
    /// once for each tick.
    #[inline]
    pub(crate) fn wait(&mut self) -> Ticks {
        let due = self.interval.wrapping_add(u64::from(self.fraction));
        self.interval = Interval::from_bits(self.interval)
            .wrapping_add_signed(self.interval_change)
            .to_bits();
        self.fraction = due as u32;
        Ticks((due >> 32) as u32)
    }

    /// The power at rest, if motion was planned to end here; `None` after an underrun.
    pub(crate) fn run_out(&mut self) -> Option<Power> {
        self.fraction = 0;
        let planned = self.at_rest;
        if planned.is_none() {
            self.abort();
        }
        planned
    }

    /// Forgets the segment under way; the next tick begins a new one.
    ///
    /// Called from the step interrupt after a stop.
    pub fn abort(&mut self) {
        self.ticks_left = 0;
        self.at_rest = Some(Power::OFF);
        self.power = Power::OFF;
    }

    /// The motors that step at the tick that was taken. Called once for each tick.
    #[inline]
    pub(crate) fn trace(&mut self) -> MotorMask {
        let mut step = 0u32;
        // The last motor first: its bit is moved up as the bits of the others follow.
        for (left, increment) in self.left.iter_mut().zip(&self.increment).rev() {
            let next = left.wrapping_sub(*increment);
            // 1 if `next` is negative and the motor steps. A multiplication takes fewer
            // instructions than a branch.
            let steps = next >> SIGN & 1;
            *left = next.wrapping_add(self.full.wrapping_mul(steps));
            step = step << 1 | steps;
        }
        MotorMask::from_bits(step as u8)
    }
}

/// In a part of a step event only the motors of that part advance.
fn keep_only<const MOTORS: usize>(motors: MotorMask, increment: &mut [u32; MOTORS]) {
    for (motor, increment) in increment.iter_mut().enumerate() {
        if !motors.contains(motor) {
            *increment = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Line, PowerScale, Smoothing};
    use core::num::NonZeroU16;
    use proptest::prelude::*;

    fn segment(
        line: Option<Line<3>>,
        ticks: u16,
        smoothing: Smoothing,
        at_rest: Option<Power>,
    ) -> Segment<3> {
        let early = Early::half_a_tick(smoothing);
        Segment {
            line: line.map(|line| LineStart::new(line, early)),
            ticks: NonZeroU16::new(ticks).unwrap(),
            smoothing,
            motors: MotorMask::ALL,
            ends_event: true,
            early,
            interval: Interval::from_num(100),
            interval_change: IntervalChange::ZERO,
            power: Power::OFF,
            power_change: PowerChange::ZERO,
            outputs: OutputChange::NONE,
            at_rest,
        }
    }

    /// Runs all of `segments`; returns their ticks and how they ended.
    fn run(stepper: &mut Stepper<3>, segments: &[Segment<3>]) -> (Vec<Tick>, Progress) {
        let mut queue = segments.iter().copied();
        let mut ticks = Vec::new();
        loop {
            match stepper.tick(|| queue.next()) {
                Progress::Tick(tick) => ticks.push(tick),
                end => return (ticks, end),
            }
        }
    }

    extern crate std;
    use std::vec::Vec;

    #[test]
    fn a_motor_with_as_many_steps_as_the_dominant_one_steps_with_it() {
        let line = Line::new([4, -4, 1]).unwrap();
        let seg = segment(Some(line), 16, Smoothing::Fourfold, Some(Power::OFF));
        let (ticks, _) = run(&mut Stepper::new(), &[seg]);
        for (k, tick) in ticks.iter().enumerate() {
            let whole = (k + 1) % 4 == 0;
            assert_eq!(tick.step.contains(0), whole);
            assert_eq!(tick.step.contains(1), whole);
        }
    }

    #[test]
    fn a_glide_makes_the_steps_of_single_ticks_in_their_time() {
        for (delta, smoothing, change) in [
            ([100, 37, -5], Smoothing::None, 0.3),
            ([100, 99, 1], Smoothing::Fourfold, -0.01),
            ([3, 2, 0], Smoothing::Fourfold, 0.0),
        ] {
            let line = Line::new(delta).unwrap();
            let ticks = (delta[0] as u16) << smoothing.level();
            let mut seg = segment(Some(line), ticks, smoothing, Some(Power::OFF));
            seg.interval_change = IntervalChange::from_num(change);
            let mut begun = Stepper::new();
            begun.tick(|| Some(seg));
            for count in 0..u32::from(ticks) {
                let (mut many, mut single) = (begun.clone(), begun.clone());
                let (took, steps) = many.glide(count);
                let (mut waits, mut made) = (0, [0; 3]);
                for _ in 0..count {
                    let Progress::Tick(tick) = single.tick(|| None) else {
                        panic!("no tick {count}");
                    };
                    waits += tick.wait.0;
                    for (motor, made) in made.iter_mut().enumerate() {
                        *made += u32::from(tick.step.contains(motor));
                    }
                }
                assert_eq!((took.0, steps), (waits, made), "{delta:?} {count}");
                assert_eq!(std::format!("{many:?}"), std::format!("{single:?}"));
            }
        }
    }

    #[test]
    fn a_lone_step_of_a_minor_motor_comes_in_the_middle_of_the_line() {
        let line = Line::new([100, 1, 0]).unwrap();
        let seg = segment(Some(line), 100, Smoothing::None, Some(Power::OFF));
        let (ticks, _) = run(&mut Stepper::new(), &[seg]);
        let at = ticks.iter().position(|t| t.step.contains(1)).unwrap();
        assert_eq!(at + 1, 50);
    }

    #[test]
    fn in_a_step_event_in_parts_each_motor_comes_on_in_one_of_them() {
        let line = Line::new([4, 3, 2]).unwrap();
        let part = |line: Option<Line<3>>, motors: u8, ends_event, early: Early| Segment {
            line: line.map(|line| LineStart::new(line, early)),
            motors: MotorMask::from_bits(motors),
            ends_event,
            early: early.of_a_part(),
            ..segment(line, 1, Smoothing::None, None)
        };
        let mut stepper = Stepper::new();
        let mut steps = |seg| {
            run(&mut stepper, &[seg])
                .0
                .iter()
                .map(|t| t.step.bits())
                .collect::<Vec<_>>()
        };
        // Y is due at 0.67 of the first step event, Z at its end.
        assert_eq!(steps(part(Some(line), 0b010, false, Early::NOT)), [0b010]);
        assert_eq!(steps(part(None, 0b101, true, Early::NOT)), [0b101]);
        // Y is due at the end of the second step event. In the fourth it is due after a third: half
        // a step event earlier, it steps with the third.
        let early = Early::half_a_tick(Smoothing::None);
        assert_eq!(steps(part(None, 0b111, true, early)), [0b011]);
        assert_eq!(
            steps(segment(None, 2, Smoothing::None, None)),
            [0b111, 0b001]
        );
    }

    #[test]
    fn power_and_outputs_go_out_with_their_tick_and_rest_ends_the_motion() {
        let line = Line::new([3, 0, 0]).unwrap();
        let mut seg = segment(Some(line), 3, Smoothing::None, Some(Power::FULL));
        seg.power_change = PowerChange::from_num(0.25);
        seg.outputs = OutputChange::of(2, true);
        let (ticks, end) = run(&mut Stepper::new(), &[seg]);
        let levels: Vec<u32> = ticks
            .iter()
            .map(|t| t.power.level(PowerScale::new(100)))
            .collect();
        assert_eq!(levels, [0, 25, 50]);
        let changes: Vec<_> = ticks.iter().map(|t| t.outputs.set).collect();
        assert_eq!(changes, [0b100, 0, 0]);
        assert_eq!(end, Progress::Rest(Power::FULL));
    }

    #[test]
    fn segments_that_run_out_in_motion_are_an_underrun_once() {
        let line = Line::new([3, 0, 0]).unwrap();
        let mut stepper = Stepper::new();
        let (_, end) = run(
            &mut stepper,
            &[segment(Some(line), 2, Smoothing::None, None)],
        );
        assert_eq!(end, Progress::Underrun);
        assert_eq!(stepper.tick(|| None), Progress::Rest(Power::OFF));
    }

    #[test]
    fn fractions_of_a_count_are_carried_from_tick_to_tick() {
        let line = Line::new([1000, 0, 0]).unwrap();
        let mut seg = segment(Some(line), 1000, Smoothing::None, Some(Power::OFF));
        seg.interval = Interval::from_bits((100 << 32) + (1 << 30)); // 100.25 counts
        let (ticks, _) = run(&mut Stepper::new(), &[seg]);
        let total: u32 = ticks.iter().map(|t| t.wait.0).sum();
        assert_eq!(total, 100_250);
    }

    proptest! {
        /// Compares with exact division: after k step events each motor has made the whole number
        /// of steps nearest to its share half a tick later, whatever the smoothing was in between.
        #[test]
        fn the_tracer_agrees_with_exact_division(
            x in -300i32..300, y in -300i32..300, z in -300i32..300,
            cuts in prop::collection::vec((1u16..40, 0usize..5), 1..30),
        ) {
            let Ok(line) = Line::new([x, y, z]) else { return Ok(()) };
            let events = line.step_events().get() as u16;
            let levels = [
                Smoothing::None, Smoothing::Twofold, Smoothing::Fourfold, Smoothing::Eightfold, Smoothing::Sixteenfold,
            ];
            let mut stepper = Stepper::<3>::new();
            let (mut taken, mut due) = ([0u32; 3], [0u32; 3]);
            let (mut done, mut first, mut prepared) = (0u16, Some(line), 0);
            let mut cuts = cuts.into_iter().cycle();
            while done < events {
                let (n, wanted) = cuts.next().unwrap();
                let n = n.min(events - done);
                let level = prepared.max(wanted);
                let mut seg = segment(first.take(), n << level, levels[level], Some(Power::OFF));
                (seg.early, prepared) = (Early::half_a_tick(levels[wanted]), wanted);
                for (k, tick) in (1..).zip(run(&mut stepper, &[seg]).0) {
                    prop_assert_eq!(tick.direction, line.direction());
                    for (m, t) in taken.iter_mut().enumerate() {
                        *t += u32::from(tick.step.contains(m));
                        // In sixteenths of a step event.
                        let now = (u32::from(done) << 4) + (k << (4 - level));
                        let steps = line.steps()[m];
                        let full = 16 * u32::from(events);
                        let ahead = if steps == u32::from(events) {
                            0
                        } else {
                            full / 2 + (steps << (4 - wanted)) / 2
                        };
                        // A step that came early, in a coarser segment, is not made again.
                        due[m] = due[m].max((steps * now + ahead) / full);
                        prop_assert_eq!(*t, due[m], "motor {} tick {}", m, k);
                    }
                }
                done += n;
            }
            prop_assert_eq!(&taken, line.steps());
        }

        /// Compares with the closed form p·k + d·k(k−1)/2.
        #[test]
        fn tick_k_comes_when_the_formula_says(p in 50_000u64..1<<40, d in -1000i64..1000, n in 1u16..300) {
            let line = Line::new([300, 0, 0]).unwrap();
            let mut seg = segment(Some(line), n, Smoothing::None, Some(Power::OFF));
            seg.interval = Interval::from_bits(p << 8);
            seg.interval_change = IntervalChange::from_bits(d);
            let (ticks, _) = run(&mut Stepper::new(), &[seg]);
            let mut sum = 0u128;
            for (k, tick) in (1i128..).zip(&ticks) {
                sum += u128::from(tick.wait.0);
                let exact = i128::from(p << 8) * k + i128::from(d) * (k * (k - 1) / 2);
                prop_assert_eq!(sum as i128, exact >> 32);
            }
        }
    }
}
