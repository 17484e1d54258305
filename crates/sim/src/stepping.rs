//! The step interrupts in simulated time: the same [`on_timer`] as on the board, and the ends of
//! pulses.

use crate::board::{SimBoard, PARTS};
use crate::clock::{Cycle, CYCLES_PER_COUNT};
use crate::cost::Costs;
use crate::load::Cpu;
use crate::observer::{Observer, Taken};
use crate::trouble::LateReason;
use heapless::spsc::Consumer;
use leadscrew_stepper::{on_timer, start, Interval, Segment, Shared, StepInterrupt};

/// The state of the step interrupt.
pub(crate) struct Stepping<'a, const MOTORS: usize> {
    interrupt: StepInterrupt<MOTORS>,
    segments: Consumer<'a, Segment<MOTORS>>,
    shared: &'a Shared<MOTORS>,
    costs: Costs,
    /// Ticks that remain in the segment under way; their interrupts take no new segment.
    ticks_left: u16,
    /// Parts of a dominant step in each tick of the segment that is being taken.
    next_parts: Option<u64>,
    underruns: u32,
    /// True if the next interrupt is the first one after a rest.
    at_rest: bool,
    /// The segment under way ends at rest.
    ends: bool,
    /// Segments are passed at once, without steps on pins.
    glides: bool,
}

/// The reason why [`Stepping::run`] returned.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Ran {
    /// Nothing more is due up to the horizon.
    Horizon,
    /// The interrupt that began at this instant took a segment, brought motion to rest, or moved a
    /// switch.
    Wake(Cycle),
}

impl<'a, const MOTORS: usize> Stepping<'a, MOTORS> {
    pub(crate) fn new(
        segments: Consumer<'a, Segment<MOTORS>>,
        shared: &'a Shared<MOTORS>,
        costs: Costs,
    ) -> Self {
        Self {
            interrupt: StepInterrupt::new(),
            segments,
            shared,
            costs,
            ticks_left: 0,
            next_parts: None,
            underruns: 0,
            at_rest: true,
            ends: false,
            glides: false,
        }
    }

    /// From now on passes over the steps of a segment, if no switch is near: only times count.
    pub(crate) fn glide(&mut self) {
        self.glides = true;
    }

    /// Returns true if only times count.
    pub(crate) fn glides(&self) -> bool {
        self.glides
    }

    /// Handles the timer's interrupts that are due up to `horizon`, the earliest first. Returns
    /// early after an interrupt that wakes the main loop. Only the main loop and the switch
    /// interrupts can stop motion, and they run between two calls.
    #[inline]
    pub(crate) fn run<O: Observer>(
        &mut self,
        board: &mut SimBoard<O, MOTORS>,
        cpu: &mut Cpu,
        horizon: Cycle,
    ) -> Ran {
        if self.shared.is_stopped() {
            // Motion was stopped: from now on each interrupt throws away its tick and one segment.
            self.ticks_left = 0;
            board.parts_per_tick = None;
        }
        while board.timer_due() <= horizon {
            if board.pulse_due() == Cycle::NEVER {
                match self.glides {
                    true => self.pass_segment(board, cpu, horizon),
                    false => self.pass_quiet(board, cpu, horizon),
                }
                if board.step_due() > horizon {
                    break;
                }
            }
            let step_start = cpu.tick_start(board.step_due());
            // A tick comes first. No tick interrupts the end of a pulse before its edge, because
            // the next tick is due at least a pulse and 1 µs later (`StepTiming`).
            let pulse_start = match board.pulse_due() {
                Cycle::NEVER => Cycle::NEVER,
                due => cpu.pulse_end_start(due),
            };
            if pulse_start < step_start {
                board.end_pulse(pulse_start + u64::from(self.costs.pulse_edge));
                cpu.charge_pulse_end(pulse_start, self.costs.pulse_end);
            } else if self.step(board, cpu, step_start) || board.switches_moved {
                return Ran::Wake(step_start);
            }
        }
        Ran::Horizon
    }

    /// Handles a step interrupt. Returns whether it took a segment or came to rest.
    #[inline]
    fn step<O: Observer>(
        &mut self,
        board: &mut SimBoard<O, MOTORS>,
        cpu: &mut Cpu,
        at: Cycle,
    ) -> bool {
        let takes = self.ticks_left == 0;
        let cycles = if takes {
            self.look_ahead(board, at)
        } else {
            self.ticks_left -= 1;
            self.costs.step
        };
        board.begin_step_interrupt(at, cycles);
        let (interrupt, segments) = (&mut self.interrupt, &mut self.segments);
        if self.at_rest {
            start(interrupt, segments, self.shared, board);
        }
        let events = board.counts.step_events;
        on_timer(interrupt, segments, self.shared, board);
        cpu.charge_tick(at, cycles);
        if board.counts.step_events != events && board.pulse_due() == Cycle::NEVER {
            cpu.charge_pulses(at, u64::from(self.costs.pulse_end)); // no pin tells its end
        }
        if takes {
            self.taken(board, at);
        }
        takes
    }

    /// Passes over the coming step interrupts that change nothing, up to `horizon`, with the same
    /// result as [`Stepping::step`]. Does nothing if the CPU is busy or an interrupt is late,
    /// because then interrupts delay each other.
    #[inline]
    fn pass_quiet<O: Observer>(
        &mut self,
        board: &mut SimBoard<O, MOTORS>,
        cpu: &mut Cpu,
        horizon: Cycle,
    ) {
        let due = board.step_due();
        if !cpu.is_free(due) || board.is_late() {
            return;
        }
        let quiet = self.interrupt.quiet_calls(self.shared);
        if quiet == 0 {
            return;
        }
        let [shortest, longest] = self.interrupt.waits(quiet).map(cycles_of);
        if shortest < u64::from(self.costs.step_armed) {
            return;
        }
        // The longest wait is rounded up, so that no tick due after the horizon is passed over.
        let every = longest + CYCLES_PER_COUNT;
        let calls = u64::from(quiet - 1).min((horizon - due) / every) as u32 + 1;
        self.ticks_left -= calls as u16;
        let waits = self.interrupt.pass(calls, &self.segments);
        board.pass_ticks(calls, waits);
        let last = due + u64::from(waits[0].0) * CYCLES_PER_COUNT;
        cpu.charge_ticks([due, last], calls, self.costs.step);
    }

    /// Passes over the rest of the segment up to `horizon`: the motors move, but no pin does. The
    /// first step of all and the last step before a rest are made on pins, since times are measured
    /// from and to them.
    #[inline]
    fn pass_segment<O: Observer>(
        &mut self,
        board: &mut SimBoard<O, MOTORS>,
        cpu: &mut Cpu,
        horizon: Cycle,
    ) {
        let (due, left) = (board.step_due(), u32::from(self.ticks_left));
        let is_free = cpu.tick_start(due) == due && !board.is_late();
        let is_plain = !self.ends && !self.shared.is_stopped() && board.has_stepped();
        if left == 0 || !is_free || !is_plain || self.interrupt.is_restricted(self.shared) {
            return;
        }
        let [shortest, longest] = self.interrupt.waits(left).map(cycles_of);
        if shortest < u64::from(self.costs.step_armed) || !board.plant.is_free_for(left) {
            return;
        }
        let every = longest + CYCLES_PER_COUNT;
        let calls = u64::from(left - 1).min((horizon - due) / every) as u32 + 1;
        self.ticks_left -= calls as u16;
        let glide = self.interrupt.glide(calls, &self.segments, self.shared);
        let events = board.glide(calls, &glide);
        let last = due + u64::from(glide.waits[0].0) * CYCLES_PER_COUNT;
        cpu.charge_ticks([due, last], calls, self.costs.step);
        cpu.delay(due, u64::from(calls) * u64::from(self.costs.step));
        cpu.charge_pulses(due, events * u64::from(self.costs.pulse_end));
    }

    /// Looks at the segment that the step interrupt is about to take. Returns the cycles that this
    /// tick takes.
    #[inline(never)]
    fn look_ahead<O: Observer>(&mut self, board: &mut SimBoard<O, MOTORS>, at: Cycle) -> u32 {
        let next = self.segments.peek().filter(|_| !self.shared.is_stopped());
        let taken = next.map(taken);
        board.observer.segment_taken(at, taken.as_ref());
        self.ends = next.is_none_or(|segment| segment.at_rest.is_some());
        board.glides = self.glides && !self.ends && board.has_stepped();
        (self.ticks_left, self.next_parts) = match next {
            Some(segment) => (segment.ticks.get() - 1, Some(parts_per_tick(segment))),
            None => (0, None),
        };
        match next {
            Some(Segment { line: Some(_), .. }) => self.costs.load_line,
            Some(_) => self.costs.load,
            None => self.costs.run_out,
        }
    }

    /// Notes that a segment was taken, or that motion came to rest because there was none.
    #[inline(never)]
    fn taken<O: Observer>(&mut self, board: &mut SimBoard<O, MOTORS>, at: Cycle) {
        self.at_rest = !self.shared.is_running();
        board.parts_per_tick = self.next_parts;
        if self.shared.underruns() != self.underruns {
            self.underruns = self.shared.underruns();
            board.note_late(at, LateReason::Underrun);
        }
    }
}

/// CPU cycles of an interval, rounded down to whole counts of the timer.
fn cycles_of(interval: Interval) -> u64 {
    (interval.to_bits() >> 32) * CYCLES_PER_COUNT
}

/// The part of a dominant motor's step that one tick of `segment` makes, in [`PARTS`]. If a step
/// is split over segments, the whole step counts in the last of them.
fn parts_per_tick<const MOTORS: usize>(segment: &Segment<MOTORS>) -> u64 {
    if segment.ends_event {
        PARTS >> segment.smoothing.level()
    } else {
        0
    }
}

/// Full power in the units of a power's bits.
const FULL_POWER: f64 = (1u32 << 31) as f64;

/// A segment as observers see it.
fn taken<const MOTORS: usize>(segment: &Segment<MOTORS>) -> Taken<'_> {
    let ticks = segment.ticks.get();
    let first = f64::from(segment.power.share().to_bits());
    let rise = f64::from(segment.power_change.to_bits()) * f64::from(ticks - 1);
    Taken {
        line: segment
            .line
            .as_ref()
            .map(|start| start.line().steps().as_slice()),
        step_events: segment.step_events(),
        ends_event: segment.ends_event,
        power: [first / FULL_POWER, (first + rise) / FULL_POWER],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contacts::Contacts;
    use crate::link::Links;
    use crate::observer::StepEvent;
    use crate::output_pins::OutputPins;
    use crate::plant::Plant;
    use heapless::spsc::Queue;
    use leadscrew_machine::board::{Board, Instant, PortConfig};
    use leadscrew_stepper::{
        Early, IntervalChange, Line, LineStart, MotorMask, OutputChange, Power, PowerChange,
        Smoothing,
    };
    use std::num::NonZeroU16;

    #[derive(Default)]
    struct Edges(Vec<(u64, u8, u8)>);

    impl Observer for Edges {
        fn step(&mut self, event: &StepEvent) {
            self.0
                .push((event.cycle.0, event.motors.bits(), event.negative.bits()));
        }
    }

    /// A segment that makes a whole line with `counts` of the timer per tick.
    fn line(delta: [i32; 2], smoothing: Smoothing, counts: u32, at_rest: bool) -> Segment<2> {
        let line = Line::new(delta).unwrap();
        let ticks = line.step_events().get() << smoothing.level();
        let early = Early::half_a_tick(smoothing);
        Segment {
            line: Some(LineStart::new(line, early)),
            ticks: NonZeroU16::new(ticks as u16).unwrap(),
            smoothing,
            motors: MotorMask::ALL,
            ends_event: true,
            early,
            interval: Interval::from_num(counts),
            interval_change: IntervalChange::ZERO,
            power: Power::OFF,
            power_change: PowerChange::ZERO,
            outputs: OutputChange::NONE,
            at_rest: at_rest.then_some(Power::OFF),
        }
    }

    /// The last instant before [`Cycle::NEVER`].
    const FOREVER: Cycle = Cycle(Cycle::NEVER.0 - 1);

    struct Bench {
        board: SimBoard<Edges, 2>,
        cpu: Cpu,
        shared: Shared<2>,
    }

    /// Runs `segments` to rest with pulses of `pulse_us`; calls `taken` after each segment that was
    /// taken.
    fn run(pulse_us: u8, segments: &[Segment<2>], taken: impl FnMut()) -> Bench {
        run_until(FOREVER, pulse_us, segments, taken)
    }

    /// As [`run`], up to `horizon`.
    fn run_until(
        horizon: Cycle,
        pulse_us: u8,
        segments: &[Segment<2>],
        mut taken: impl FnMut(),
    ) -> Bench {
        let costs = Costs::F407;
        let mut queue: Queue<Segment<2>, 17> = Queue::new();
        let (mut producer, consumer) = queue.split();
        segments
            .iter()
            .for_each(|segment| producer.enqueue(*segment).unwrap());
        let shared = Shared::new();
        let mut cpu = Cpu::new();
        let mut board = SimBoard::new(
            costs,
            Links::new(&[]),
            Plant::new(),
            Contacts::default(),
            OutputPins::default(),
            Edges::default(),
        );
        let mut stepping = Stepping::new(consumer, &shared, costs);
        board.begin_poll(Cycle(10_000));
        board.configure(&PortConfig {
            pulse_us,
            ..PortConfig::default()
        });
        shared.set_running();
        board.start_stepping(Instant::from_ticks(0));
        while let Ran::Wake(_) = stepping.run(&mut board, &mut cpu, horizon) {
            taken();
        }
        Bench { board, cpu, shared }
    }

    #[test]
    fn edges_come_on_the_timers_schedule_with_a_constant_lag() {
        let steps = [line([3, 1], Smoothing::None, 4200, true)];
        let bench = run(10, &steps, || ());
        let first = 10_000 + 4200 * CYCLES_PER_COUNT + u64::from(Costs::F407.step_edge);
        // Y's step is due between two ticks and is made at the earlier one.
        assert_eq!(
            bench.board.observer.0,
            [(first, 3, 0), (first + 8400, 1, 0), (first + 16_800, 1, 0)]
        );
        assert!(bench.board.late.is_empty() && bench.board.violations.is_empty());
    }

    #[test]
    fn a_pulse_has_at_least_its_width_and_the_direction_changes_after_it() {
        let there_and_back = [
            line([2, 0], Smoothing::None, 4200, false),
            line([-2, 0], Smoothing::None, 4200, true),
        ];
        let bench = run(10, &there_and_back, || ());
        let pulse = bench.board.plant.shortest_pulse().unwrap();
        assert!((1680..1680 + 100).contains(&pulse), "{pulse}");
        let setup = bench.board.plant.shortest_setup().unwrap();
        assert!((8400 - 2000..8400 - 1680).contains(&setup), "{setup}");
        assert!(bench.board.violations.is_empty());
        assert_eq!(bench.board.plant.position(), [0, 0]);
    }

    #[test]
    fn steps_of_the_dominant_motor_are_told_from_smoothing_ticks() {
        let bench = run(10, &[line([10, 3], Smoothing::Fourfold, 2000, true)], || ());
        let counts = bench.board.counts;
        assert_eq!(counts.dominant_parts, 10 * PARTS);
        assert_eq!(counts.step_events + counts.smoothing_ticks(), 40);
        assert_eq!(counts.step_events, 12); // Y's second step falls on one of X's
    }

    #[test]
    fn no_tick_that_is_due_after_the_horizon_is_made() {
        let steps = [line([10, 3], Smoothing::Fourfold, 2000, true)];
        for horizon in (10_000..150_000).step_by(700) {
            let bench = run_until(Cycle(horizon), 10, &steps, || ());
            let due = |(edge, ..): &(u64, u8, u8)| edge - u64::from(Costs::F407.step_edge);
            let last = bench.board.observer.0.last().map_or(0, due);
            assert!(last <= horizon, "{last} {horizon}");
        }
    }

    #[test]
    fn a_tick_that_is_due_before_its_segment_is_loaded_is_late_and_finds_the_pin_still_high() {
        let counts = (Costs::F407.load_line - 20) / CYCLES_PER_COUNT as u32;
        let bench = run(
            1,
            &[line([9, 0], Smoothing::None, counts, false); 10],
            || (),
        );
        assert_eq!(bench.shared.late_ticks(), 10);
        assert_eq!(bench.board.late.count(), 11); // each line, and the end of all segments
        assert_eq!(bench.shared.position(), [90, 0]);
        // The end of the pulse waits until the load has ended; the late tick does not wait. The
        // first segment starts out of rest.
        assert_eq!(bench.board.plant.position(), [81, 0]);
        assert_eq!(bench.board.violations.count(), 9);
    }

    #[test]
    fn ticks_too_close_for_the_cpu_are_late_and_leave_pulses_no_time_to_end() {
        let counts = (Costs::F407.step_armed - 20) / CYCLES_PER_COUNT as u32;
        let bench = run(1, &[line([100, 0], Smoothing::None, counts, true)], || ());
        assert_eq!(bench.board.late.count(), 100);
        assert_eq!(bench.shared.late_ticks(), 100);
        assert_eq!(bench.shared.position(), [100, 0]);
        assert!(bench.board.plant.position()[0] < 100);
        assert!(!bench.board.violations.is_empty());
        assert!(bench.cpu.load(bench.board.last_rest).mean > 0.5);
    }

    #[test]
    fn a_pulse_that_is_still_high_loses_the_next_step_and_that_is_a_violation() {
        let bench = run(10, &[line([4, 0], Smoothing::None, 420, true)], || ());
        assert_eq!(bench.shared.position(), [4, 0]);
        assert_eq!(bench.board.plant.position(), [1, 0]);
        assert_eq!(bench.board.violations.count(), 3);
    }

    #[test]
    fn segments_that_run_out_in_motion_are_recorded_as_late() {
        let bench = run(10, &[line([5, 0], Smoothing::None, 4200, false)], || ());
        let reasons: Vec<_> = bench
            .board
            .late
            .first()
            .iter()
            .map(|late| late.reason)
            .collect();
        assert_eq!(reasons, [LateReason::Underrun]);
    }

    #[test]
    fn the_main_loop_hears_of_each_segment_taken_and_of_rest() {
        let mut heard = 0;
        let two = [
            line([5, 0], Smoothing::None, 4200, false),
            line([5, 0], Smoothing::None, 4200, true),
        ];
        run(10, &two, || heard += 1);
        assert_eq!(heard, 3);
    }
}
