//! Steps, limits along the line, room, the time that waits, overrides.

use super::*;
use crate::config::SLOWEST;
use crate::reference::{pixels, queue, to, Rig, RigQueue};
use crate::{
    Cartesian, CoreXy, CornerRule, Curve, Feed, Ganged, MoveKind, MovePower, Queue, StepsPerMm,
    NANOS_PER_MM,
};
use leadscrew_stepper::OutputChange;
use proptest::prelude::*;

fn config() -> Config<2> {
    Config {
        max_rate: [100.0, 50.0],
        acceleration: [500.0, 200.0],
        ..Config::default()
    }
}

fn cartesian() -> Planner<'static, Cartesian, 2, 2> {
    Planner::new(config(), Cartesian, queue::<_, 2, 8>(), pixels::<1>()).unwrap()
}

/// A running move that has to slow down for all that is not planned.
fn too_fast() -> Whereabouts {
    Whereabouts {
        v2: f32::INFINITY,
        steps: 0,
        way: 0.0,
        at_start: false,
    }
}

#[test]
fn a_move_of_less_than_half_a_step_is_nothing() {
    let mut planner = cartesian();
    assert_eq!(planner.push(&to(0.0019, 0.0, 10.0)), Ok(Pushed::TooShort));
    assert!(planner.is_empty());
    assert_eq!(planner.push(&to(0.002, 0.0, 10.0)), Ok(Pushed::Queued));
    assert_eq!(planner.position(), [1, 0]);
}

#[test]
fn a_full_queue_and_a_target_out_of_reach_change_nothing() {
    let mut planner = cartesian();
    assert_eq!(planner.push(&to(9e6, 0.0, 10.0)), Err(PushError::TooFar));
    for k in 1..=8 {
        assert_eq!(
            planner.push(&to(f64::from(k), 0.0, 10.0)),
            Ok(Pushed::Queued)
        );
    }
    assert_eq!(planner.push(&to(9.0, 0.0, 10.0)), Err(PushError::Full));
    assert_eq!(planner.position(), [2000, 0]);
    planner.clear();
    assert_eq!(planner.room(), 8);
}

#[test]
fn fewer_moves_than_there_is_room_for_can_be_used() {
    let mut planner = Planner::<_, 2, 2>::new(
        Config {
            moves: 2,
            ..config()
        },
        Cartesian,
        queue::<_, 2, 8>(),
        pixels::<1>(),
    )
    .unwrap();
    planner.push(&to(1.0, 0.0, 10.0)).unwrap();
    planner.push(&to(2.0, 0.0, 10.0)).unwrap();
    assert_eq!(planner.push(&to(3.0, 0.0, 10.0)), Err(PushError::Full));
}

/// Move `k` of a row of teeth along X: each move is 0.3 mm along X, and seven of them are a tooth
/// that is 0.3 mm high.
fn zigzag(k: u32) -> Move<2> {
    let (x, side) = (f64::from(k) * 0.3, f64::from(k % 7) * 0.05);
    to(x, side, 80.0)
}

#[test]
fn moves_are_planned_alike_in_few_blocks_and_in_many() {
    let (mut small, mut usual) = (Queue::<2, 2, 64, 2>::new(), Queue::<2, 2, 64>::new());
    let mut small = Planner::new(config(), Cartesian, &mut small, pixels::<1>()).unwrap();
    let mut usual = Planner::new(config(), Cartesian, &mut usual, pixels::<1>()).unwrap();
    let mut pushed = 0;
    for started in 0..300 {
        while pushed < 300 && small.room() > 0 {
            pushed += 1;
            assert_eq!(small.push(&zigzag(pushed)), usual.push(&zigzag(pushed)));
        }
        let one = small.start_next().map(|of| (of.length, of.rate));
        assert_eq!(one, usual.start_next().map(|of| (of.length, of.rate)));
        assert_eq!(
            small.outlook(too_fast),
            usual.outlook(too_fast),
            "{started}"
        );
        small.finish();
        usual.finish();
    }
}

fn planned(
    planner: &Planner<'_, Cartesian, 2, 2>,
    of: &Move<2>,
    delta: [i32; 2],
) -> PlannedMove<2, 2> {
    let mut planned = PlannedMove::new(of, delta);
    let events = delta[0].max(delta[1]) as u32;
    planner.plan(&mut planned, of, events, || None);
    planned
}

#[test]
fn limits_along_a_diagonal_are_those_of_the_weakest_axis() {
    let planned = planned(&cartesian(), &to(3.0, 4.0, 1e3), [750, 1000]);
    assert!((planned.length - 5.0).abs() < 1e-5);
    assert!((planned.rate - 62.5).abs() < 1e-3);
    assert!((planned.acceleration - 250.0).abs() < 1e-3);
}

#[test]
fn limits_apply_to_axes_where_belts_cross() {
    let mut planner =
        Planner::<_, 2, 2>::new(config(), CoreXy, queue::<_, 2, 8>(), pixels::<1>()).unwrap();
    planner.push(&to(0.0, 4.0, 1e3)).unwrap();
    assert_eq!(planner.position(), [1000, -1000]);
    let running = *planner.start_next().unwrap();
    assert!((running.rate - 50.0).abs() < 1e-4);
    assert!((running.acceleration - 200.0).abs() < 1e-3);
    assert!((running.length - 4.0).abs() < 1e-5);
}

#[test]
fn no_motor_steps_faster_than_the_board_where_belts_cross() {
    let config = Config {
        max_rate: [2000.0; 2],
        shortest_tick: leadscrew_stepper::Ticks(840), // 100 kHz at 84 MHz
        ..config()
    };
    let mut queue = Queue::<2, 2, 8>::new();
    let mut planner = Planner::new(config, CoreXy, &mut queue, pixels::<1>()).unwrap();
    // 500 steps/mm of one motor along the diagonal, 250 along an axis.
    for (x, y, rate) in [(4.0, 4.0, 282.84), (8.0, 4.0, 400.0)] {
        planner.push(&to(x, y, 1e4)).unwrap();
        let found = planner.newest().unwrap().rate;
        assert!((found - rate).abs() < 0.01, "{found}");
    }
}

#[test]
fn a_second_motor_has_the_steps_of_the_first_and_changes_no_limit() {
    let config = Config {
        steps_per_mm: [100, 80].map(|steps| StepsPerMm::from_nanos(steps * NANOS_PER_MM)),
        ..config()
    };
    let mut ganged = Planner::<_, 2, 3>::new(
        config,
        Ganged { axis_of: [1] },
        queue::<_, 3, 8>(),
        pixels::<1>(),
    )
    .unwrap();
    let mut single =
        Planner::<_, 2, 2>::new(config, Cartesian, queue::<_, 2, 8>(), pixels::<1>()).unwrap();
    for (x, y) in [(3.0, 4.0), (-1.0, 0.3), (7.0, 7.0)] {
        ganged.push(&to(x, y, 80.0)).unwrap();
        single.push(&to(x, y, 80.0)).unwrap();
        let [x, y] = single.position();
        assert_eq!(ganged.position(), [x, y, y]);
        let (ganged, single) = (ganged.outlook(too_fast), single.outlook(too_fast));
        assert_eq!(ganged, single);
    }
    let (ganged, single) = (ganged.start_next().unwrap(), single.start_next().unwrap());
    assert_eq!(ganged.length, single.length);
    assert_eq!(ganged.rate, single.rate);
    assert_eq!(ganged.acceleration, single.acceleration);
}

#[test]
fn counts_of_a_second_motor_are_brought_to_those_of_the_first() {
    let planner = Planner::<_, 2, 3>::new(
        config(),
        Ganged { axis_of: [0] },
        queue::<_, 3, 8>(),
        pixels::<1>(),
    )
    .unwrap();
    assert_eq!(planner.ganged([5, 6, 9]), [5, 6, 5]);
    assert_eq!(cartesian().ganged([5, 6]), [5, 6]);
}

#[test]
fn overrides_scale_their_own_kind_only_and_never_beyond_the_rate() {
    let mut planner = cartesian();
    planner
        .set_overrides(Overrides {
            feed: 200,
            rapid: 25,
        })
        .unwrap();
    let nominal = |feed: f32, kind| {
        let of = Move {
            kind,
            ..to(1.0, 0.0, feed)
        };
        planner.nominal(&planned(&planner, &of, [250, 0]))
    };
    assert_eq!(nominal(10.0, MoveKind::Feed), 20.0);
    assert!((nominal(80.0, MoveKind::Feed) - 100.0).abs() < 1e-3);
    assert_eq!(nominal(80.0, MoveKind::Rapid), 20.0);
    assert_eq!(nominal(10.0, MoveKind::Jog), 10.0);
    assert_eq!(nominal(0.0, MoveKind::System), SLOWEST);
}

#[test]
fn inverse_time_is_along_the_path() {
    let planner = cartesian();
    let of = Move {
        feed: Feed::InverseTime(2.0),
        ..to(3.0, 4.0, 0.0)
    };
    let planned = planned(&planner, &of, [750, 1000]);
    assert!((planned.feed - 10.0).abs() < 1e-5);
}

/// The highest squared speed at which the third one of eight chords of a circle may begin, mm²/s².
fn on_a_circle(corner_rule: CornerRule) -> f32 {
    let mut planner = cartesian();
    planner
        .configure(Config {
            corner_rule,
            ..config()
        })
        .unwrap();
    for k in 1..=8 {
        let angle = 0.1 * f64::from(k) - 0.2;
        let chord = Move {
            curve: Some(Curve {
                radius: 5.0,
                acceleration: 200.0,
            }),
            ..to(5.0 * angle.sin() + 1.0, 5.0 - 5.0 * angle.cos(), 50.0)
        };
        planner.push(&chord).unwrap();
    }
    let _first = planner.start_next();
    planner.outlook(too_fast);
    let _second = planner.start_next();
    planner.outlook(too_fast);
    planner.unit().v2(planner.queue().next().unwrap().corner)
}

#[test]
fn an_arc_bounds_the_speed_unless_grbls_rule_is_in_force() {
    // Across the path, along Y at its lowest place: 200 mm/s² on a radius of 5 mm.
    let kept = on_a_circle(CornerRule::Limits);
    assert!((kept / 1000.0 - 1.0).abs() < 0.01, "{kept}");
    let grbl = on_a_circle(CornerRule::Grbl);
    assert!(grbl > 1500.0, "{grbl}");
}

#[test]
fn an_override_that_is_taken_back_leaves_the_plan_as_it_was() {
    let mut planner = cartesian();
    for k in 1..8 {
        planner
            .push(&to(f64::from(k), f64::from(k % 2), 10.0))
            .unwrap();
    }
    planner.start_next();
    let before = planner.outlook(too_fast);
    planner
        .set_overrides(Overrides {
            feed: 10,
            rapid: 100,
        })
        .unwrap();
    assert!(planner.outlook(too_fast).exit < before.exit);
    planner.set_overrides(Overrides::default()).unwrap();
    assert_eq!(planner.outlook(too_fast).exit, before.exit);
    assert_ne!(planner.outlook(too_fast), before);
}

proptest! {
    /// Compares the position after any program with rational arithmetic (half away from zero), with
    /// odd scales.
    #[test]
    fn the_end_of_the_queue_is_where_exact_arithmetic_says(
        moves in prop::collection::vec((-1_000_000_000_000i64..1_000_000_000_000, -900_000_000_000i64..900_000_000_000), 1..8),
        scale in 1i64..2_000_000_000_000,
    ) {
        let config = Config { steps_per_mm: [StepsPerMm::from_nanos(scale); 2], ..config() };
        let mut planner = Planner::<_, 2, 2>::new(config, Cartesian, queue::<_, 2, 8>(), pixels::<1>()).unwrap();
        for (x, y) in moves {
            let of = Move { target: [x, y].map(Coordinate::from_nanos), power: MovePower::Off, outputs: OutputChange::NONE, ..to(0.0, 0.0, 1.0) };
            planner.push(&of).unwrap();
            let steps = [x, y].map(|nanos| {
                let product = i128::from(nanos) * i128::from(scale);
                let one = i128::from(NANOS_PER_MM) * i128::from(NANOS_PER_MM);
                ((product.abs() + one / 2) / one * product.signum()) as i32
            });
            prop_assert_eq!(planner.position(), steps);
        }
    }
}

/// The sum from the queue itself, one move after the other, µs.
fn counted(rig: &Rig<'_>) -> u64 {
    let waiting = rig.planner.len() - usize::from(rig.planner.queue.running().is_some());
    let moves = rig.planner.queue.latest().take(waiting);
    moves
        .map(|of| u64::from(rig.planner.backlog.micros(of)))
        .sum()
}

proptest! {
    #![proptest_config(crate::reference::times(60))]

    /// The sum stays right, whatever moves are merged, joined and started.
    #[test]
    fn the_sum_is_that_of_the_moves_that_wait(
        points in prop::collection::vec((-2.0f64..2.0, 0.001f64..2.0, 1u8..4, 0.5f32..900.0), 1..80),
        plays in prop::collection::vec(0usize..6, 80), pixels in (0usize..2).prop_map(|rows| 64 * rows),
    ) {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(Config { pixels, ..Config::default() }, &mut queue);
        let mut x = 0.0;
        for ((y, step, level, feed), plays) in points.into_iter().zip(plays) {
            x += step;
            let mut next = to(x, if level == 1 { 0.0 } else { y }, feed);
            let power = leadscrew_stepper::Power::from_share(fixed::types::U1F31::from_num(f64::from(level) / 4.0));
            next.power = MovePower::Constant { power };
            rig.planner.push(&next).unwrap();
            (0..plays).for_each(|_| { rig.step(); });
            prop_assert_eq!(rig.planner.waiting_micros(), counted(&rig));
        }
        while rig.step().is_some() {}
        prop_assert_eq!(rig.planner.waiting_micros(), 0);
    }
}

#[test]
fn a_millimetre_at_ten_millimetres_a_second_takes_a_tenth_of_a_second() {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(
        Config {
            max_rate: [100.0; 2],
            ..Config::default()
        },
        &mut queue,
    );
    for k in 1..=3 {
        rig.planner.push(&to(f64::from(k), 0.0, 10.0)).unwrap();
    }
    let waits = rig.planner.waiting_micros();
    assert!((299_990..=300_000).contains(&waits), "{waits}");
    rig.step();
    let waits = rig.planner.waiting_micros();
    assert!((199_990..=200_000).contains(&waits), "{waits}");
    rig.planner.clear();
    assert_eq!(rig.planner.waiting_micros(), 0);
}
