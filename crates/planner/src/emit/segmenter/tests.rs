use crate::reference::{corners, job_time, polyline, to, Rig, RigQueue};
use crate::{Config, CornerRule, Move, MoveKind, MovePower, Overrides, Profile, Trapezoid};
use leadscrew_stepper::Power;
use proptest::prelude::*;
use std::vec::Vec;

fn config(rate: f32, acceleration: f32) -> Config<2> {
    Config {
        max_rate: [rate; 2],
        acceleration: [acceleration; 2],
        corner_rule: CornerRule::Grbl,
        ..Config::default()
    }
}

/// Sums differences into points, from the origin.
fn path(legs: &[[i32; 2]]) -> Vec<[i32; 2]> {
    let mut at = [0, 0];
    let sums = legs.iter().map(|leg| {
        at = [at[0] + leg[0], at[1] + leg[1]];
        at
    });
    std::iter::once([0, 0]).chain(sums).collect()
}

fn leg() -> impl Strategy<Value = [i32; 2]> {
    (1i32..6).prop_flat_map(|size| {
        let most = 4i32.pow(size as u32);
        [-most..=most, -most..=most]
    })
}

fn legs() -> impl Strategy<Value = Vec<[i32; 2]>> {
    prop::collection::vec(leg(), 1..60)
}

#[test]
fn a_square_takes_the_time_that_the_textbook_says() {
    let points = path(&[[5000, 0], [0, 5000], [-5000, 0], [0, -5000]]);
    let config = config(50.0, 500.0);
    let seconds = Rig::new(config, &mut RigQueue::new()).run(&polyline(&points, 40.0));
    let ideal = job_time(&config, &points, f64::from(40.0f32));
    assert!((seconds / ideal - 1.0).abs() < 1e-5, "{seconds} {ideal}");
}

#[test]
fn a_hold_at_rest_holds_at_once_and_nothing_moves() {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config(50.0, 500.0), &mut queue);
    rig.planner.push(&to(1.0, 0.0, 40.0)).unwrap();
    rig.segmenter.hold();
    assert!(rig.segmenter.is_held());
    assert_eq!(rig.step(), None);
    rig.segmenter.resume();
    assert!(rig.step().is_some());
}

#[test]
fn a_hold_stops_in_the_distance_that_acceleration_allows() {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config(50.0, 500.0), &mut queue);
    rig.planner.push(&to(100.0, 0.0, 50.0)).unwrap();
    while rig.player.position[0] < 10_000 {
        rig.step();
    }
    let from = rig.player.position[0];
    rig.segmenter.hold();
    while rig.step().is_some() {}
    assert!(rig.segmenter.is_held());
    // The way to stop is 50² / (2·500) mm at 250 steps/mm.
    assert_eq!(rig.player.position[0] - from, 625);
}

#[test]
fn a_raised_override_acts_on_the_running_move() {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config(100.0, 500.0), &mut queue);
    rig.planner.push(&to(100.0, 0.0, 20.0)).unwrap();
    while rig.player.position[0] < 5000 {
        rig.step();
    }
    assert_eq!(rig.segmenter.speed(), 20.0);
    rig.planner
        .set_overrides(Overrides {
            feed: 200,
            rapid: 100,
        })
        .unwrap();
    rig.step();
    assert!(rig.segmenter.speed() > 20.0);
    while rig.player.position[0] < 10_000 {
        rig.step();
    }
    assert_eq!(rig.segmenter.speed(), 40.0);
    rig.planner
        .set_overrides(Overrides {
            feed: 50,
            rapid: 100,
        })
        .unwrap();
    while rig.player.position[0] < 15_000 {
        rig.step();
    }
    assert_eq!(rig.segmenter.speed(), 10.0);
    while rig.step().is_some() {}
    assert_eq!(rig.player.position, [25_000, 0]);
}

#[test]
fn power_follows_the_speed_of_every_step() {
    let power = MovePower::Dynamic { power: Power::FULL };
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config(100.0, 500.0), &mut queue);
    rig.planner
        .push(&Move {
            power,
            ..to(20.0, 7.0, 80.0)
        })
        .unwrap();
    let (mut energy, mut steps, mut last) = (0.0, 0u32, None);
    while let Some(segment) = rig.segmenter.next(&mut rig.planner) {
        let mut before = rig.player.now;
        for timed in rig.player.play(&segment) {
            energy +=
                f64::from(timed.tick.power.share().to_num::<f32>()) * (timed.at - before) as f64;
            before = timed.at;
            if timed.tick.step.contains(0) {
                // Full power at 80 mm/s along the path.
                let due = 84e6 / (80.0 * 5000.0 / 20f64.hypot(7.0));
                assert!(
                    (energy / due - 1.0).abs() < 0.01,
                    "step {steps}: {}",
                    energy / due
                );
                (energy, steps) = (0.0, steps + 1);
            }
        }
        last = segment.at_rest;
    }
    assert_eq!(last, Some(Power::OFF));
    assert_eq!(steps, 5000);
}

#[test]
fn the_slowest_step_is_waited_for_in_eight_ticks() {
    let mut slow = config(50.0, 500.0);
    slow.steps_per_mm = [crate::StepsPerMm::from_nanos(200_000_000); 2]; // one step in 5 mm
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(slow, &mut queue);
    let seconds = rig.run(&[to(50.0, 0.0, 1e-3)]);
    // Grbl's slowest feed, 1 mm/min.
    assert!((seconds / 3000.0 - 1.0).abs() < 1e-3, "{seconds}");
}

/// Checks rates and accelerations of a profile. `share`: mm of each axis in a step of the
/// dominant motor.
fn check_profile(
    profile: &Trapezoid,
    share: [f64; 2],
    limits: &Config<2>,
) -> Result<(), TestCaseError> {
    for (axis, share) in share.iter().enumerate() {
        let rate = f64::from(profile.cruise()) * share / f64::from(limits.max_rate[axis]);
        prop_assert!(rate <= 1.000_001, "rate {}", rate);
        // A ramp may make up for the rounding of the squared speed that it begins with.
        let start = profile.start();
        let length = start.exact_before(profile.end());
        for a in profile.accelerations() {
            let a = f64::from(a.abs());
            let rounding = 2e-6 * f64::from(profile.entry_v2()) / (2.0 * a * length);
            let ratio = a * share / f64::from(limits.acceleration[axis]);
            prop_assert!(ratio <= 1.000_001 + rounding, "acceleration {}", ratio);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(crate::reference::times(200))]

    /// The exact model looks ahead without limit; so does the planner as long as the queue
    /// holds the whole job. The times agree to 0.1 %.
    #[test]
    fn a_job_takes_the_time_of_the_exact_model(legs in legs(), rate in 5.0f32..200.0, acceleration in 10.0f32..5000.0, feed in 1.0f32..300.0) {
        let config = config(rate, acceleration);
        let points = path(&legs);
        let seconds = Rig::new(config, &mut RigQueue::new()).run(&polyline(&points, feed));
        let ideal = job_time(&config, &points, f64::from(feed));
        prop_assert!((seconds - ideal).abs() <= 1e-3 * ideal, "{} {}", seconds, ideal);
    }

    /// Checks rates, accelerations and the steps themselves, with holds and overrides anywhere
    /// in between.
    #[test]
    fn nothing_is_lost_and_no_limit_broken_whatever_comes_between(
        legs in legs(), acceleration in 50.0f32..5000.0, feed in 1.0f32..100.0,
        events in prop::collection::vec((1usize..40, 0u8..6), 1..30),
    ) {
        let mut limits = config(80.0, acceleration);
        limits.max_rate[1] = 60.0;
        limits.acceleration[1] = 0.7 * acceleration;
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(limits, &mut queue);
        let points = path(&legs);
        let corners = corners(&limits, &points);
        let (mut moves_begun, mut share) = (0, [0.0; 2]);
        for point in polyline(&points, feed) {
            rig.planner.push(&point).unwrap();
        }
        let mut events = events.into_iter();
        let (mut wait, mut event) = events.next().unwrap();
        loop {
            let segment = rig.step();
            prop_assert!(segment.is_none_or(|segment| segment.duration() <= 84_008), "{:?}", segment);
            if let Some(line) = segment.and_then(|segment| segment.line) {
                let line = line.line();
                moves_begun += 1;
                // mm of each axis in a step of the dominant motor
                share = line.steps().map(|n| 0.004 * f64::from(n) / f64::from(line.step_events().get()));
            }
            if let Some((Profile::Trapezoid(profile), _)) = rig.segmenter.profile() {
                check_profile(profile, share, &limits)?;
            } else if let Some(corner) = corners.get(moves_begun) {
                let v2 = f64::from(rig.segmenter.speed()).powi(2);
                // Near a reversal the sum of two f32 unit vectors is uncertain by that much.
                prop_assert!(v2 <= corner * 1.000_1, "corner {} {}", v2, corner);
            }
            if rig.segmenter.is_held() {
                prop_assert_eq!(rig.segmenter.speed(), 0.0);
                rig.segmenter.resume();
            } else if let Some(segment) = segment {
                prop_assert_eq!(segment.at_rest.is_some(), rig.segmenter.speed() <= 0.0);
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

    /// A hold stops within a line, and another line comes. Then the rest of the first line goes
    /// on to the same end.
    #[test]
    fn parking_between_hold_and_resume_loses_no_step(x in 1000i32..9000, y in -9000i32..9000, pause in 1usize..60) {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(config(80.0, 500.0), &mut queue);
        rig.planner.push(&polyline(&[[x, y]], 60.0)[0]).unwrap();
        for _ in 0..pause { rig.step(); }
        rig.segmenter.hold();
        while rig.step().is_some() {}
        let mut parking_queue = RigQueue::new();
        let mut parking = Rig::new(config(80.0, 500.0), &mut parking_queue);
        parking.planner.push(&Move { kind: MoveKind::System, ..to(1.0, 2.0, 10.0) }).unwrap();
        let held = rig.player.position;
        while let Some(segment) = parking.step() { rig.player.play(&segment); }
        let parked = rig.player.position;
        rig.segmenter.renew_line();
        rig.segmenter.resume();
        while rig.step().is_some() {}
        let end = [0, 1].map(|m| rig.player.position[m] - parked[m] + held[m]);
        prop_assert_eq!(end, [x, y]);
    }
}
