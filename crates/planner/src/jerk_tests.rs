//! Whole jobs under a jerk limit.

use crate::reference::{job_time, polyline, to, Rig, RigQueue};
use crate::{Config, CornerRule, Move, Overrides};
use proptest::prelude::*;
use std::vec::Vec;

fn config(acceleration: f32, jerk: f32) -> Config<2> {
    Config {
        max_rate: [80.0; 2],
        acceleration: [acceleration; 2],
        jerk,
        corner_rule: CornerRule::Grbl, // the rule of the model
        ..Config::default()
    }
}

/// Points of a polyline in steps of 4 µm, from the origin.
fn points() -> impl Strategy<Value = Vec<[i32; 2]>> {
    let leg = (1i32..6).prop_flat_map(|size| {
        let most = 4i32.pow(size as u32);
        [-most..=most, -most..=most]
    });
    prop::collection::vec(leg, 1..40).prop_map(|legs| {
        let mut at = [0, 0];
        let sums = legs.iter().map(|leg| {
            at = [at[0] + leg[0], at[1] + leg[1]];
            at
        });
        std::iter::once([0, 0]).chain(sums).collect()
    })
}

/// Speed and acceleration along the path at the end of the segments handed out, mm/s and mm/s².
fn motion(rig: &Rig<'_>) -> (f64, f64) {
    let segmenter = &rig.segmenter;
    (segmenter.speed().into(), segmenter.acceleration().into())
}

proptest! {
    /// With holds, resumes and overrides thrown in anywhere.
    #[test]
    fn the_acceleration_never_changes_faster_than_the_jerk(
        points in points(), acceleration in 50.0f32..5000.0, seconds in 0.003f32..0.3, feed in 1.0f32..100.0,
        events in prop::collection::vec((1usize..40, 0u8..6), 1..30),
    ) {
        let jerk = acceleration / seconds;
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(config(acceleration, jerk), &mut queue);
        for point in polyline(&points, feed) {
            rig.planner.push(&point).unwrap();
        }
        let mut events = events.into_iter();
        let (mut wait, mut event) = events.next().unwrap();
        let (mut before, mut at) = (motion(&rig), rig.player.now);
        loop {
            let mut segment = rig.step();
            while !rig.segmenter.at_step() {
                segment = rig.step();
                // A segment takes a millisecond at most: rounding adds less than a tenth of a
                // microsecond.
                prop_assert!(segment.is_none_or(|segment| segment.duration() <= 84_008), "{:?}", segment);
            }
            let (now, elapsed) = (motion(&rig), (rig.player.now - at) as f64 / 84e6);
            let change = (now.1 - before.1).abs();
            // If the profile begins or ends within a step, the acceleration changes in less than
            // the step's time.
            let slack = 1e-2 * f64::from(acceleration);
            prop_assert!(change <= f64::from(jerk) * elapsed * 1.01 + slack, "{:?} {:?} in {} s", before, now, elapsed);
            let gained = (now.0 - before.0).abs();
            // Along a diagonal both axes share it.
            let most = 1.4143 * f64::from(acceleration) * elapsed * 1.001 + 1e-4 * (now.0 + before.0);
            prop_assert!(gained <= most, "{:?} {:?} in {} s", before, now, elapsed);
            (before, at) = (now, rig.player.now);
            if rig.segmenter.is_held() {
                prop_assert_eq!(rig.segmenter.speed(), 0.0);
                rig.segmenter.resume();
            } else if let Some(segment) = segment {
                // A plan that changes at the end of a stop may touch rest and go on.
                prop_assert!(segment.at_rest.is_none() || rig.segmenter.speed() <= 0.0);
            } else {
                break;
            }
            wait -= 1;
            if wait == 0 {
                match event {
                    0 | 1 => rig.segmenter.hold(),
                    2 => rig.segmenter.resume(),
                    feed => rig.planner.set_overrides(Overrides { feed: 40 * feed - 60, rapid: 100 }).unwrap(),
                }
                (wait, event) = events.next().unwrap_or((usize::MAX, 0));
            }
        }
        prop_assert_eq!(rig.player.position, *points.last().unwrap());
        prop_assert!(rig.planner.is_empty());
    }

    #[test]
    fn a_jerk_beyond_reach_costs_little_time(points in points(), acceleration in 50.0f32..1000.0, feed in 1.0f32..100.0) {
        let config = config(acceleration, 1e9);
        let seconds = Rig::new(config, &mut RigQueue::new()).run(&polyline(&points, feed));
        let ideal = job_time(&config, &points, f64::from(feed));
        // A ramp over many moves has the least acceleration of them.
        prop_assert!(seconds >= 0.98 * ideal - 1e-3 && seconds <= 1.12 * ideal + 1e-3, "{} {}", seconds, ideal);
    }
}

#[test]
fn a_move_from_rest_to_rest_takes_the_time_of_the_formula() {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config(1000.0, 10_000.0), &mut queue);
    let seconds = rig.run(&[to(100.0, 0.0, 50.0)]);
    // The acceleration is not reached: a ramp lasts 2·√(v/jerk), at half the speed in the mean.
    let ramp = 2.0 * (50.0f64 / 10_000.0).sqrt();
    let due = 2.0 * ramp + (100.0 - 50.0 * ramp) / 50.0;
    assert!((seconds - due).abs() < 1e-3, "{seconds} {due}");
}

/// A circle of 20 mm in lines of 0.2 mm, at 50 mm/s, by the default rule.
fn circle() -> (Vec<Move<2>>, Config<2>) {
    const RADIUS: f64 = 20.0;
    let moves = (1..=628).map(|line| {
        let angle = core::f64::consts::TAU * f64::from(line) / 628.0;
        let mm = [RADIUS * angle.sin(), RADIUS * (1.0 - angle.cos())];
        let [x, y] = mm.map(|mm| (mm * 1e3).round() / 1e3);
        to(x, y, 50.0)
    });
    let config = Config {
        corner_rule: CornerRule::Limits,
        ..config(500.0, 5000.0)
    };
    (moves.collect(), config)
}

#[test]
fn a_circle_in_short_lines_takes_the_time_of_a_line_of_its_length() {
    let (moves, config) = circle();
    let seconds = Rig::new(config, &mut RigQueue::new()).run(&moves);
    // From rest to 50 mm/s in 0.2 s, at half the speed in the mean, and back.
    let line = 40.0 * core::f64::consts::PI / 50.0 + 0.2;
    assert!(seconds < 1.02 * line, "{seconds} {line}");
}

/// The way along the lines after each step of a line's longer axis: the time in seconds, and mm.
fn ways(moves: &[Move<2>], config: Config<2>) -> Vec<(f64, f64)> {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config, &mut queue);
    for of in moves {
        rig.planner.push(of).unwrap();
    }
    let ends = moves
        .iter()
        .map(|of| of.target.map(|mm| (f64::from(mm.to_mm()) * 250.0).round()));
    let starts = std::iter::once([0.0; 2]).chain(ends.clone());
    let mut lines = starts
        .zip(ends)
        .map(|(from, to)| [to[0] - from[0], to[1] - from[1]]);
    let (mut ways, mut begun) = (std::vec![(0.0, 0.0)], 0.0);
    let (mut line, mut steps) = (lines.next().unwrap(), 0.0);
    while let Some(segment) = rig.segmenter.next(&mut rig.planner) {
        for timed in rig.player.play(&segment) {
            let longer = usize::from(line[1].abs() > line[0].abs());
            if !timed.tick.step.contains(longer) {
                continue;
            }
            let length = line[0].hypot(line[1]) / 250.0;
            steps += 1.0;
            let at = timed.at as f64 / f64::from(config.timer_hz);
            ways.push((at, begun + length * steps / line[longer].abs()));
            if steps >= line[longer].abs() {
                (begun, steps) = (begun + length, 0.0);
                line = lines.next().unwrap_or_default();
            }
        }
    }
    ways
}

/// The third difference of the way is at most the jerk times the cube of the time between places,
/// apart from a step for each of eight places.
#[test]
fn the_jerk_is_kept_across_short_lines_on_the_step_edges() {
    const BETWEEN: f64 = 0.02;
    const STEPS: f64 = 8.0 * 0.004;
    let (moves, config) = circle();
    let ways = ways(&moves, config);
    let place = |time: f64| {
        let after = ways.partition_point(|(at, _)| *at <= time);
        after.checked_sub(1).map_or(0.0, |last| ways[last].1)
    };
    let end = ways.last().unwrap().0;
    let starts = (0..)
        .map(|k| 0.002 * f64::from(k))
        .take_while(|start| *start < end);
    let most = starts.fold(0.0, |most: f64, start| {
        let [a, b, c, d] = [0.0, 1.0, 2.0, 3.0].map(|k| place(start + k * BETWEEN));
        most.max((d - 3.0 * c + 3.0 * b - a).abs())
    });
    let allowed = 5000.0 * BETWEEN.powi(3);
    assert!(most <= allowed + STEPS, "{most} {allowed}");
    assert!(most > 0.9 * allowed, "{most} {allowed}");
}
