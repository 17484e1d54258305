//! A simulator that skips quiet ticks makes the same steps at the same times as one that makes
//! every call.

extern crate std;
use crate::{
    on_timer, start, Early, Interval, IntervalChange, Line, LineStart, MotorMask, OutputChange,
    Power, PowerChange, Segment, Shared, Smoothing, StepInterrupt, StepPort, Ticks,
};
use core::num::NonZeroU16;
use heapless::spsc::Queue;
use proptest::prelude::*;
use std::vec::Vec;

const LEVELS: [Smoothing; 5] = [
    Smoothing::None,
    Smoothing::Twofold,
    Smoothing::Fourfold,
    Smoothing::Eightfold,
    Smoothing::Sixteenfold,
];

/// The changes of the pins, each with the timer's counts before the call that made it.
#[derive(Default, PartialEq, Debug)]
struct Pins {
    counts: u64,
    edges: Vec<(u64, u8, Power)>,
    rests: bool,
}

impl Pins {
    fn edge(&mut self, motors: u8, power: Power) {
        self.edges.push((self.counts, motors, power));
    }
}

impl StepPort for Pins {
    fn step(&mut self, motors: MotorMask) {
        self.edge(motors.bits(), Power::OFF);
    }
    fn set_direction(&mut self, _: MotorMask) {}
    fn set_power(&mut self, power: Power) {
        self.edge(0, power);
    }
    fn change_outputs(&mut self, _: OutputChange) {}
    fn arm(&mut self, wait: Ticks) {
        self.counts += u64::from(wait.0);
    }
    fn make_up(&mut self) -> bool {
        false
    }
    fn rest(&mut self) {
        self.rests = true;
    }
}

/// Makes the segments of one line; each cut has step events, a smoothing, and whether power rises.
fn segments(delta: [i32; 3], cuts: &[(u16, usize, bool)], change: i32) -> Vec<Segment<3>> {
    let Ok(line) = Line::new(delta) else {
        return Vec::new();
    };
    let mut left = line.step_events().get() as u16;
    let mut first = Some(line);
    let mut all = Vec::new();
    for (events, level, rises) in cuts.iter().cycle() {
        let events = (*events).min(left);
        let early = Early::half_a_tick(LEVELS[*level]);
        left -= events;
        all.push(Segment {
            line: first.take().map(|line| LineStart::new(line, early)),
            ticks: NonZeroU16::new(events << level).unwrap(),
            smoothing: LEVELS[*level],
            motors: MotorMask::ALL,
            ends_event: true,
            early,
            interval: Interval::from_num(3000.3),
            interval_change: IntervalChange::from_bits(i64::from(change)),
            power: if *rises { Power::OFF } else { Power::FULL },
            power_change: if *rises {
                PowerChange::from_bits(1 << 16)
            } else {
                PowerChange::ZERO
            },
            outputs: OutputChange::NONE,
            at_rest: (left == 0).then_some(Power::OFF),
        });
        if left == 0 {
            return all;
        }
    }
    all
}

/// Runs the segments to rest; returns the pins, and how many calls were skipped. At most `most`
/// calls are skipped at a time.
fn run(segments: &[Segment<3>], most: u32) -> (Pins, u32) {
    let mut queue: Queue<Segment<3>, 512> = Queue::new();
    let (mut producer, mut consumer) = queue.split();
    for segment in segments {
        producer.enqueue(*segment).unwrap();
    }
    let (mut interrupt, shared, mut pins, mut passed) =
        (StepInterrupt::new(), Shared::new(), Pins::default(), 0);
    shared.set_running();
    start(&mut interrupt, &consumer, &shared, &mut pins);
    while !pins.rests {
        let quiet = interrupt.quiet_calls(&shared).min(most);
        if quiet > 0 {
            let [shortest, longest] = interrupt.waits(quiet);
            let [to_last, wait] = interrupt.pass(quiet, &consumer);
            let whole = u64::from(to_last.0) + u64::from(wait.0);
            assert!(whole >= u64::from(shortest.to_num::<u32>()) * u64::from(quiet));
            assert!(whole <= (u64::from(longest.to_num::<u32>()) + 1) * u64::from(quiet));
            pins.counts += whole;
            passed += quiet;
            continue;
        }
        on_timer(&mut interrupt, &mut consumer, &shared, &mut pins);
    }
    (pins, passed)
}

proptest! {
    #[test]
    fn passing_over_quiet_ticks_changes_no_edge_and_no_wait(
        delta in prop::array::uniform3(-200i32..200),
        cuts in prop::collection::vec((1u16..60, 0usize..5, prop::bool::weighted(0.2)), 1..20),
        change in prop_oneof![-1_000_000i32..1_000_000, Just(i32::MAX), Just(i32::MIN)],
        most in prop_oneof![1u32..20, Just(u32::MAX)],
    ) {
        let segments = segments(delta, &cuts, change);
        prop_assume!(!segments.is_empty());
        prop_assert_eq!(run(&segments, most).0, run(&segments, 0).0);
    }
}

#[test]
fn of_sixteen_ticks_a_step_fifteen_are_passed_over() {
    let segments = segments([100, 0, 0], &[(100, 4, false)], 0);
    let (_, passed) = run(&segments, u32::MAX);
    assert_eq!(passed, 1500);
}
