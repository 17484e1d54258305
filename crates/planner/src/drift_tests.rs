//! Nothing drifts: after any number of steps, holds and overrides the motors stand at the places
//! that exact arithmetic gives.
//!
//! A run makes a few holds. For a campaign:

use crate::reference::{to, Rig, RigQueue};
use crate::{Config, CornerRule, Move, Overrides, StepsPerMm, NANOS_PER_MM};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use std::vec::Vec;
use std::{println, vec};

/// The number of holds outside campaigns.
const FEW: u64 = 500;

/// Odd scales, 10⁻⁹ steps/mm: most targets lie between two steps.
const SCALES: [i64; 2] = [80_370_000_000, 250_123_000_000];

/// Some moves from rest to rest, and the events in between.
#[derive(Clone, Debug)]
struct Round {
    rates: [f32; 2],
    accelerations: [f32; 2],
    jerk: f32,
    rule: CornerRule,
    moves: Vec<Move<2>>,
    /// The events: after a number of segments a hold (`None`) or a feed override in per cent.
    events: Vec<(usize, Option<u8>)>,
}

fn round() -> impl Strategy<Value = Round> {
    let feed = (0.0f32..2.5).prop_map(|power| 10f32.powf(power));
    let near = (-1.0f64..1.0, -1.0f64..1.0, -2.0f64..2.0);
    let of = (near, feed).prop_map(|((x, y, size), feed)| {
        let mm = [x, y].map(|x| (x * 10f64.powf(size) * 1e4).round() / 1e4);
        to(mm[0], mm[1], feed)
    });
    let event = (1usize..200, prop::option::weighted(0.3, 10u8..=200));
    (
        prop::array::uniform2(20.0f32..300.0),
        prop::array::uniform2(50.0f32..5000.0),
        prop_oneof![3 => Just(0.0f32), 1 => 1e3f32..1e5],
        prop::sample::select(vec![CornerRule::Limits, CornerRule::Grbl]),
        prop::collection::vec(of, 1..40),
        prop::collection::vec(event, 1..30),
    )
        .prop_map(|(rates, accelerations, jerk, rule, moves, events)| Round {
            rates,
            accelerations,
            jerk,
            rule,
            moves,
            events,
        })
}

/// The amount of motion so far.
#[derive(Default, Debug)]
struct Made {
    steps: u64,
    holds: u64,
    rounds: u64,
}

/// The place of a target in steps: rounded half away from zero.
fn exact(target: i64, scale: i64) -> i32 {
    let product = i128::from(target) * i128::from(scale);
    let one = i128::from(NANOS_PER_MM) * i128::from(NANOS_PER_MM);
    ((product.abs() + one / 2) / one * product.signum()) as i32
}

impl Made {
    /// Runs a round until it has come to rest, with its holds and overrides.
    fn play(&mut self, rig: &mut Rig<'_>, round: &Round) {
        let mut moves = round.moves.iter().peekable();
        let mut events = round.events.iter().copied();
        let mut event = events.next();
        loop {
            while let Some(next) = moves.next_if(|_| rig.planner.has_room()) {
                rig.planner.push(next).expect("room");
            }
            if rig.segmenter.is_held() {
                rig.segmenter.resume();
                self.holds += 1;
            }
            let Some(segment) = rig.segmenter.next(&mut rig.planner) else {
                if rig.segmenter.is_held() || moves.peek().is_some() {
                    continue;
                }
                break;
            };
            let ticks = rig.player.play(&segment);
            let steps = ticks
                .iter()
                .map(|timed| timed.tick.step.bits().count_ones());
            self.steps += steps.map(u64::from).sum::<u64>();
            event = match event {
                Some((0, what)) => {
                    match what {
                        None => rig.segmenter.hold(),
                        Some(feed) => rig
                            .planner
                            .set_overrides(Overrides { feed, rapid: 100 })
                            .unwrap(),
                    }
                    events.next()
                }
                Some((wait, what)) => Some((wait - 1, what)),
                None => None,
            };
        }
        self.rounds += 1;
    }
}

#[test]
fn steps_and_holds_without_number_end_where_exact_arithmetic_says() {
    let asked = std::env::var("HOLDS").ok();
    let holds = asked.map_or(FEW, |holds| holds.parse().expect("a number"));
    let mut random = TestRunner::deterministic();
    let mut queue = RigQueue::new();
    let scales = SCALES.map(StepsPerMm::from_nanos);
    let config = Config {
        steps_per_mm: scales,
        ..Config::default()
    };
    let mut rig = Rig::new(config, &mut queue);
    let mut made = Made::default();
    while made.holds < holds {
        let next = round().new_tree(&mut random).expect("a round").current();
        rig.planner
            .configure(Config {
                max_rate: next.rates,
                acceleration: next.accelerations,
                jerk: next.jerk,
                corner_rule: next.rule,
                ..config
            })
            .unwrap();
        made.play(&mut rig, &next);
        let last = next.moves.last().expect("one move").target;
        let due = [0, 1].map(|axis| exact(last[axis].nanos(), SCALES[axis]));
        assert_eq!(rig.player.position, due, "after {made:?}");
        assert_eq!(rig.planner.position(), due);
    }
    println!("{made:?}: each round ends where exact arithmetic says");
    assert!(made.steps > 1000 * holds, "{made:?}");
}
