//! No limit is broken. Random programs are planned; each planned move, ramp and corner is compared
//! with the settings in exact arithmetic.
//!
//! A profile's speeds and accelerations are `f32`; each of them is a rational number, and so are
//! steps/mm and the settings. Only junction deviation has roots in it; it is compared in `f64`,
//! whose error is a thousandth of the margin that the planner keeps.
//!
//! A run has 1000 programs. For a campaign:

mod leg;
mod program;
mod short_lines;

use crate::reference::{runner, to, Rig, RigQueue};
use crate::{
    Config, CornerRule, MoveKind, Overrides, Profile, StepsPerMm, Trapezoid, NANOS_PER_MM,
};
use leg::Worst;
use program::{Event, Part};
use proptest::test_runner::TestCaseError;
use std::vec::Vec;
use std::{format, println, string::String, vec};

pub(crate) use leg::{corner_v2, Leg};
pub(crate) use program::{program, Cut, Program};

/// Queues all moves of a program. Returns the leg that the program asked for with each move; joined
/// moves are one leg.
fn push(program: &Program, rig: &mut Rig<'_>) -> Vec<Leg> {
    let mut legs: Vec<Leg> = Vec::new();
    for cut in &program.moves() {
        while rig.planner.is_renewing() {
            rig.planner.renew();
        }
        let (before, queued) = (rig.planner.position(), rig.planner.len());
        rig.planner.push(&cut.of).expect("room");
        let after = rig.planner.position();
        let delta = [0, 1].map(|i| after[i] - before[i]);
        match legs.last_mut() {
            _ if delta == [0, 0] => {}
            Some(last) if rig.planner.len() == queued => {
                last.joined(cut, delta, program.steps_per_mm);
            }
            _ => legs.push(Leg::new(cut, delta, program.steps_per_mm)),
        }
    }
    legs
}

/// Holds, resumes or changes an override.
fn handle(event: Event, rig: &mut Rig<'_>) {
    let overrides = rig.planner.overrides();
    match event {
        Event::Hold | Event::Cancel => rig.segmenter.hold(),
        Event::Resume => rig.segmenter.resume(),
        Event::Feed(feed) => rig
            .planner
            .set_overrides(Overrides { feed, ..overrides })
            .unwrap(),
        Event::Rapid(rapid) => rig
            .planner
            .set_overrides(Overrides { rapid, ..overrides })
            .unwrap(),
    }
}

/// The share of the corner's squared speed at which two moves meet. It is 0 inside a curve in
/// pieces, which has no corner.
fn check_corner(rig: &Rig<'_>, legs: &[Leg], limits: &Config<2>) -> Result<f64, String> {
    let [leg, next] = legs else {
        return Ok(0.0);
    };
    let v2 = f64::from(rig.segmenter.speed()).powi(2);
    if rig.planner.is_empty() || !leg.stands_alone(limits) || !next.stands_alone(limits) {
        return Ok(0.0);
    }
    let corner = corner_v2(leg, next, limits);
    if v2 > corner {
        return Err(format!("corner: {v2} instead of {corner}"));
    }
    let counts = v2 > 0.0 && corner < f64::INFINITY;
    Ok(if counts { v2 / corner } else { 0.0 })
}

/// The difference between the squared speed at the start of a profile and the one that the profile
/// before it had there.
fn jump(before: &Trapezoid, profile: &Trapezoid) -> f64 {
    let (was, is) = (before.speed_v2(profile.start()), profile.entry_v2());
    f64::from((was - is).abs()) / f64::from(is.max(1.0))
}

/// Checks that a move ends no faster than the next may begin: otherwise the plan cannot be kept.
fn check_end(rig: &Rig<'_>, leg: &Leg, profile: &Trapezoid) -> Result<(), String> {
    let next = rig.planner.queue().next();
    let most = next.map_or(0.0, |next| f64::from(rig.planner.unit().v2(next.entry)));
    let ends = leg.v2(profile.exit_v2());
    match ends <= most * (1.0 + 1e-5) + 1e-6 {
        true => Ok(()),
        false => Err(format!("end: {ends} instead of {most}")),
    }
}

/// Runs a program with a planner that has `settings`, and checks it against `limits`.
fn run(program: &Program, settings: Config<2>, limits: &Config<2>) -> Result<Worst, String> {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(settings, &mut queue);
    let mut worst = Worst::default();
    let mut events = program.events.iter().copied();
    let mut event = events.next();
    let (mut cancelling, mut undisturbed) = (false, true);
    let legs = push(program, &mut rig);
    let mut begun = 0;
    let mut last: Option<(Trapezoid, usize)> = None;
    while let Some(segment) = rig.segmenter.next(&mut rig.planner) {
        begun += usize::from(segment.line.is_some());
        if let Some((Profile::Trapezoid(profile), _)) = rig.segmenter.profile() {
            if last.as_ref().is_none_or(|(last, _)| last != profile) {
                worst = worst.and(legs[begun - 1].check(profile, limits)?);
                if undisturbed && legs[begun - 1].ends_with(profile) {
                    check_end(&rig, &legs[begun - 1], profile)?;
                }
                if let Some((before, _)) = last.filter(|(_, of)| *of == begun) {
                    worst.jump = worst.jump.max(jump(&before, profile));
                }
            }
            last = Some((*profile, begun));
        } else {
            let here = &legs[begun - 1..(begun + 1).min(legs.len())];
            worst.corner = worst.corner.max(check_corner(&rig, here, limits)?);
        }
        match &mut event {
            Some((0, what)) => {
                undisturbed = false;
                handle(*what, &mut rig);
                cancelling |= matches!(what, Event::Cancel);
                event = events.next();
            }
            Some((wait, _)) => *wait -= 1,
            None => {}
        }
        if rig.segmenter.is_held() {
            if cancelling {
                break;
            }
            rig.segmenter.resume();
        }
    }
    if rig.segmenter.speed() > 0.0 {
        return Err(String::from("ends in motion"));
    }
    Ok(worst)
}

/// The largest shares over many programs; fails at the first one that breaks a limit.
fn campaign(cases: u32, plant: impl Fn(&mut Config<2>)) -> Result<Worst, String> {
    let worst = core::cell::Cell::new(Worst::default());
    let result = runner(cases).run(&program(), |program| {
        let limits = program.config();
        let mut settings = limits;
        plant(&mut settings);
        let of = run(&program, settings, &limits).map_err(TestCaseError::fail)?;
        worst.set(worst.get().and(of));
        Ok(())
    });
    result
        .map(|()| worst.get())
        .map_err(|error| format!("{error}"))
}

/// A line is cut into pieces of 0.01 mm, which are planned as they come. It ends at rest and takes
/// at most 1 % longer than the line in one move.
#[test]
fn a_line_in_short_pieces_ends_at_rest_and_as_soon_as_one_move_does() {
    for angle in [0.1f64, 0.3, 0.5, 0.8, 1.1] {
        let config = Config {
            max_rate: [2000.0 / 60.0; 2],
            acceleration: [200.0; 2],
            steps_per_mm: [StepsPerMm::from_nanos(4000 * NANOS_PER_MM); 2],
            ..Config::default()
        };
        let at = |length: f64| {
            let mm = [length * angle.cos(), length * angle.sin()].map(|x| (x * 1e3).round() / 1e3);
            to(mm[0], mm[1], 30.0)
        };
        let pieces: Vec<_> = (1..=4000).map(|k| at(f64::from(k) * 0.01)).collect();
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(config, &mut queue);
        let cut = rig.run(&pieces);
        assert_eq!(rig.segmenter.speed(), 0.0, "at {angle}");
        let whole = Rig::new(config, &mut RigQueue::new()).run(&[at(40.0)]);
        assert!(cut / whole < 1.01, "at {angle}: {cut} {whole}");
    }
}

/// The same at 80 mm/s, for which the queue is too short, and at coarse steps (250 steps/mm).
#[test]
fn motion_that_outruns_a_short_queue_ends_at_rest() {
    for angle in [0.1f64, 0.3, 0.5, 0.8, 1.1] {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(
            Config {
                max_rate: [5000.0 / 60.0; 2],
                acceleration: [200.0; 2],
                ..Config::default()
            },
            &mut queue,
        );
        let at = |k: u32| {
            let length = f64::from(k) * 0.01;
            let mm = [length * angle.cos(), length * angle.sin()].map(|x| (x * 1e3).round() / 1e3);
            to(mm[0], mm[1], 80.0)
        };
        let moves: Vec<_> = (1..=6000).map(at).collect();
        rig.run(&moves);
        assert_eq!(rig.segmenter.speed(), 0.0, "at {angle}");
    }
}

#[test]
fn no_program_breaks_a_limit() {
    let worst = campaign(1000, |_| ()).unwrap_or_else(|error| panic!("{error}"));
    println!("largest shares of the limits: {worst:?}");
    assert!(
        worst.acceleration > 0.9999,
        "limits are made use of: {worst:?}"
    );
    assert!(worst.jump < 4e-6, "{worst:?}");
}

#[test]
fn a_limit_that_is_broken_by_two_per_cent_is_found() {
    type Plant = fn(&mut Config<2>);
    let faults: [(&str, Plant); 4] = [
        ("acceleration of x", |config| config.acceleration[0] *= 1.02),
        ("acceleration of y", |config| config.acceleration[1] *= 1.02),
        ("rate of x", |config| config.max_rate[0] *= 1.02),
        ("junction deviation", |config| {
            config.junction_deviation *= 1.02
        }),
    ];
    for (what, plant) in faults {
        assert!(campaign(1000, plant).is_err(), "{what}");
    }
}

/// No limit is broken, and the acceleration across curves is within the setting.
fn keeps_its_curves(program: &Program) {
    let worst = run(program, program.config(), &program.config());
    assert!(worst.is_ok(), "{worst:?}");
}

/// If the path turns at the end of a piece that hardly moves one axis, that axis leaves nothing
/// for braking at high speed. The piece has to end slower than its limits allow; otherwise the
/// machine reaches the end of the program at 19 mm/s.
#[test]
fn a_short_line_after_an_arc_ends_at_rest() {
    let arc = Part::Arc {
        from: 2.277_384_977,
        radius: 1.554_066_805,
        turn: 5.667_873_87,
    };
    let line = Part::Line {
        x: -0.010_065_243,
        y: 0.002_628_08,
    };
    let program = Program {
        parts: vec![
            (arc, 201.01265, MoveKind::Feed),
            (line, 20.641766, MoveKind::Feed),
        ],
        events: Vec::new(),
        rates: [188.61331, 5.0],
        accelerations: [3127.288, 265.71805],
        steps_per_mm: [250, 250],
        rule: CornerRule::Limits,
    };
    let worst = run(&program, program.config(), &program.config());
    assert!(worst.is_ok(), "{worst:?}");
}

/// Before a start from rest there is no path. The curvature is bounded nevertheless.
#[test]
fn a_curve_that_begins_at_rest_is_a_curve_from_its_first_piece_on() {
    let curve = Part::Cut {
        from: 4.708,
        radius: 1.0,
        turn: 3.57,
        piece: 0.0565,
    };
    let program = Program {
        parts: vec![(curve, 1.0, MoveKind::Rapid)],
        events: Vec::new(),
        rates: [143.0, 265.0],
        accelerations: [2297.0, 10.0],
        steps_per_mm: [250, 250],
        rule: CornerRule::Limits,
    };
    let worst = run(&program, program.config(), &program.config());
    assert!(worst.is_ok(), "{worst:?}");
}

/// The curvature bounds the last pieces of a path, too; otherwise a strong axis could double its
/// speed within one of them.
#[test]
fn a_curve_that_ends_at_rest_is_a_curve_up_to_its_last_piece() {
    let cut = |from, turn| Part::Cut {
        from,
        radius: 1.0,
        turn,
        piece: 0.02,
    };
    let program = Program {
        parts: vec![
            (cut(0.0, -0.3), 1.0, MoveKind::Feed),
            (cut(3.262_475, -3.311_922), 234.0, MoveKind::Feed),
        ],
        events: Vec::new(),
        rates: [5.0; 2],
        accelerations: [10.0, 4822.3374],
        steps_per_mm: [250; 2],
        rule: CornerRule::Limits,
    };
    keeps_its_curves(&program);
}

/// The axis along the line is strong, the axis across it is weak. If the first pieces of the curve
/// were taken for the end of the line, the weak axis would exceed its acceleration.
#[test]
fn a_curve_that_begins_at_a_corner_of_a_line_in_pieces_is_a_curve_from_its_first_piece_on() {
    type Found = ([f64; 2], [f64; 4], [f32; 2], [i64; 2]);
    let found: [Found; 2] = [
        (
            [6.095_092_7, 1.849_096_9],
            [1.589_505_2, 6.362_182, -0.971_387_9, 0.02],
            [2066.0017, 10.0],
            [250, 250],
        ),
        (
            [3.119_270_2, 0.505_889_4],
            [5.019_083_7, 1.0, -4.731_495, 0.126_491_1],
            [4578.2104, 10.0],
            [80, 250],
        ),
    ];
    for ([angle, length], [from, radius, turn, piece], accelerations, steps_per_mm) in found {
        let line = Part::CutLine {
            angle,
            length,
            piece: 0.01,
        };
        let curve = Part::Cut {
            from,
            radius,
            turn,
            piece,
        };
        let parts = [line, curve].map(|part| (part, 250.0, MoveKind::Feed));
        let program = Program {
            parts: parts.into(),
            events: Vec::new(),
            rates: [249.62157, 72.408356],
            accelerations,
            steps_per_mm,
            rule: CornerRule::Limits,
        };
        keeps_its_curves(&program);
    }
}

/// At 99 steps/mm a few pieces turn by a third more or less than the circle: they are no corners.
#[test]
fn corners_that_rounding_makes_of_a_curve_leave_it_a_curve() {
    let curve = Part::Cut {
        from: 4.881_049_678,
        radius: 1.574_474_142,
        turn: -2.861_684_034,
        piece: 0.158_718_576,
    };
    let program = Program {
        parts: vec![(curve, 185.46501, MoveKind::Feed)],
        events: Vec::new(),
        rates: [245.41988, 5.0],
        accelerations: [4516.8696, 10.0],
        steps_per_mm: [250, 99],
        rule: CornerRule::Limits,
    };
    keeps_its_curves(&program);
}

/// The override asks for a lower speed than can still be reached. The speed that can be reached is
/// only as exact as the high speed before.
#[test]
fn an_override_on_the_way_down_to_a_corner_leaves_the_corner_its_limit() {
    let line = |x, y| Part::Line { x, y };
    let program = Program {
        parts: vec![
            (line(18.513_798, 13.930_845), 243.32104, MoveKind::Feed),
            (line(-48.765_215, 0.0), 29.168034, MoveKind::Feed),
        ],
        events: vec![(106, Event::Feed(10))],
        rates: [225.08354, 266.23572],
        accelerations: [3476.111, 1865.888],
        steps_per_mm: [250, 454],
        rule: CornerRule::Limits,
    };
    let worst = run(&program, program.config(), &program.config());
    assert!(worst.is_ok(), "{worst:?}");
}
