//! Any value of any field of the public structs: it is refused in words, or motion comes to its end
//! with all steps.

use crate::reference::{to, Rig, RigQueue};
use crate::{
    Config, Curve, Feed, Move, MovePower, OverrideError, Overrides, PushError, StepsPerMm,
};
use leadscrew_stepper::{Power, Ticks};
use std::format;
use std::string::{String, ToString};
use std::vec::Vec;

/// Numbers, and what is none.
const FLOATS: [f32; 15] = [
    f32::NAN,
    f32::NEG_INFINITY,
    f32::MIN,
    -5.0,
    -1e-30,
    -0.0,
    0.0,
    f32::MIN_POSITIVE,
    1e-12,
    1e-6,
    0.002,
    50.0,
    1e10,
    f32::MAX,
    f32::INFINITY,
];

const WHOLE: [u32; 7] = [0, 1, 999_999, 1_000_000, 84_000_000, 1 << 31, u32::MAX];

/// With the slowest values motion takes years: it is followed for this many segments.
const FOLLOWED: usize = 3_000;

/// A curve, a corner, and a way back.
fn moves() -> Vec<Move<2>> {
    let ends = [
        (0.5, 0.0),
        (1.0, 0.04),
        (1.5, 0.12),
        (2.0, 0.24),
        (2.0, -0.3),
        (0.0, 0.0),
    ];
    ends.map(|(x, y)| to(x, y, 10.0)).into()
}

/// Returns why the moves are refused; otherwise follows their motion.
fn refusal(config: Config<2>, moves: &[Move<2>]) -> Option<String> {
    let (mut queue, mut pixels) = (
        crate::Queue::<2, 2, 16>::new(),
        crate::PixelQueue::<16>::new(),
    );
    let made = crate::Planner::new(config, crate::Cartesian, &mut queue, &mut pixels);
    if let Err(error) = made {
        return Some(error.to_string());
    }
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config, &mut queue);
    for next in moves {
        match rig.planner.push(next) {
            Err(error @ PushError::Invalid(_)) => return Some(error.to_string()),
            Ok(_) | Err(PushError::TooFar | PushError::Full) => {}
        }
    }
    for _ in 0..FOLLOWED {
        if rig.step().is_none() {
            assert!(rig.planner.is_empty());
            assert_eq!(rig.segmenter.speed(), 0.0);
            assert_eq!(rig.player.position, rig.planner.position());
            return None;
        }
    }
    None
}

fn is_above_zero(value: f32) -> bool {
    (1e-12..=1e10).contains(&value)
}

fn is_zero_or_more(value: f32) -> bool {
    (0.0..=1e10).contains(&value)
}

fn is_feed(value: f32) -> bool {
    value > 0.0 && value <= f32::MAX
}

#[test]
fn a_number_of_the_configuration_is_in_its_range_or_refused_by_name() {
    type Field = (&'static str, fn(&mut Config<2>, f32), fn(f32) -> bool);
    let fields: [Field; 9] = [
        ("rate", |of, x| of.max_rate[0] = x, is_above_zero),
        ("rate", |of, x| of.max_rate[1] = x, is_above_zero),
        (
            "acceleration",
            |of, x| of.acceleration[0] = x,
            is_above_zero,
        ),
        (
            "acceleration",
            |of, x| of.acceleration[1] = x,
            is_above_zero,
        ),
        ("jerk", |of, x| of.jerk = x, is_zero_or_more),
        ("resonance", |of, x| of.resonance = x, is_zero_or_more),
        (
            "deviation",
            |of, x| of.junction_deviation = x,
            is_zero_or_more,
        ),
        ("tolerance", |of, x| of.arc_tolerance = x, is_above_zero),
        // A tick of the default timing is longer than a microsecond.
        ("segment", |of, x| of.longest_segment = x, |_| false),
    ];
    for (name, set, allows) in fields {
        for value in FLOATS {
            let mut config = Config::default();
            set(&mut config, value);
            let refused = refusal(config, &moves());
            assert_eq!(
                refused.is_none(),
                allows(value),
                "{name} {value}: {refused:?}"
            );
            assert!(refused.is_none_or(|text| text.contains(name)), "{name}");
        }
    }
}

#[test]
fn a_whole_number_of_the_configuration_is_in_its_range_or_refused_by_name() {
    type Field = (&'static str, fn(&mut Config<2>, u32), fn(u32) -> bool);
    let fields: [Field; 5] = [
        ("timer", |of, x| of.timer_hz = x, |x| x >= 1_000_000),
        (
            "tick",
            |of, x| of.shortest_tick = Ticks(x),
            |x| (1..=84_000).contains(&x),
        ),
        ("move", |of, x| of.moves = x as usize, |x| x > 0),
        ("pixels", |of, x| of.pixels = x as usize, |_| true),
        (
            "steps/mm",
            |of, x| of.steps_per_mm[1] = StepsPerMm::from_nanos(i64::from(x.cast_signed())),
            |x| x.cast_signed() > 0,
        ),
    ];
    for (name, set, allows) in fields {
        for value in WHOLE {
            let mut config = Config::default();
            set(&mut config, value);
            let refused = refusal(config, &moves());
            assert_eq!(
                refused.is_none(),
                allows(value),
                "{name} {value}: {refused:?}"
            );
            assert!(refused.is_none_or(|text| text.contains(name)), "{name}");
        }
    }
}

#[test]
fn a_number_of_a_move_is_in_its_range_or_refused_by_name() {
    type Field = (&'static str, fn(&mut Move<2>, f32), fn(f32) -> bool);
    let fields: [Field; 5] = [
        ("feed", |of, x| of.feed = Feed::PerMinute(x), is_feed),
        ("feed", |of, x| of.feed = Feed::InverseTime(x), is_feed),
        ("rounding", |of, x| of.rounding = x, is_zero_or_more),
        (
            "arc",
            |of, radius| {
                of.curve = Some(Curve {
                    radius,
                    acceleration: 10.0,
                })
            },
            is_above_zero,
        ),
        (
            "arc",
            |of, acceleration| {
                of.curve = Some(Curve {
                    radius: 5.0,
                    acceleration,
                })
            },
            is_above_zero,
        ),
    ];
    let power = Power::FULL;
    for (name, set, allows) in fields {
        for value in FLOATS {
            for power in [MovePower::Off, MovePower::Dynamic { power }] {
                let mut moves = moves();
                for of in &mut moves {
                    of.power = power;
                    set(of, value);
                }
                let refused = refusal(Config::default(), &moves);
                assert_eq!(
                    refused.is_none(),
                    allows(value),
                    "{name} {value}: {refused:?}"
                );
                assert!(refused.is_none_or(|text| text.contains(name)), "{name}");
            }
        }
    }
}

#[test]
fn a_refused_move_changes_nothing() {
    let run = |between: Option<f32>| {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(Config::default(), &mut queue);
        for next in moves() {
            if let Some(rounding) = between {
                let bad = Move {
                    rounding,
                    ..to(9.0, 9.0, 3.0)
                };
                assert!(rig.planner.push(&bad).is_err());
            }
            rig.planner.push(&next).unwrap();
        }
        let mut segments = Vec::new();
        while let Some(segment) = rig.step() {
            segments.push(format!("{segment:?}"));
        }
        segments
    };
    assert!(run(Some(f32::NAN)) == run(None));
}

#[test]
fn overrides_out_of_their_ranges_are_refused_and_those_in_force_stay() {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(Config::default(), &mut queue);
    for feed in 0..=u8::MAX {
        for rapid in [0, 1, 25, 50, 100, 101, u8::MAX] {
            let (overrides, before) = (Overrides { feed, rapid }, rig.planner.overrides());
            let set = rig.planner.set_overrides(overrides);
            let is_valid = (1..=200).contains(&feed) && (1..=100).contains(&rapid);
            assert_eq!(set, if is_valid { Ok(()) } else { Err(OverrideError) });
            let expected = if is_valid { overrides } else { before };
            assert_eq!(rig.planner.overrides(), expected);
        }
    }
}
