//! No limit is broken: random programs, each planned move, ramp and corner against the settings in exact arithmetic.
//!
//! A profile's speeds and accelerations are `f32`: each is a rational number, and so are steps/mm and the settings. Only
//! junction deviation has roots in it; it is compared in `f64`, a thousand times finer than the margin that the
//! planner keeps.
//!
//! 1000 programs each time; as a campaign:
//! `PROPTEST_CASES=100000 cargo test --release -p leadscrew-planner limits_tests -- --nocapture`.

use crate::config::Limits;
use crate::reference::{to, Rig, RigQueue};
use crate::{
    Arc, Config, Coordinate, CornerRule, Curve, Feed, Move, MoveKind, Overrides, Profile,
    StepsPerMm, Trapezoid, NANOS_PER_MM,
};
use core::f64::consts::TAU;
use num_rational::BigRational;
use num_traits::ToPrimitive;
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestRng, TestRunner};
use std::vec::Vec;
use std::{format, println, string::String, vec};

/// A part of a program, from where the last one ended.
#[derive(Clone, Debug)]
enum Part {
    /// mm.
    Line { x: f64, y: f64 },
    /// A G2 or G3: where it begins on its circle (radians), radius (mm), turned through.
    Arc { from: f64, radius: f64, turn: f64 },
    /// A circle as CAM cuts it, points rounded to 3 decimals: besides, the length of a piece.
    Cut {
        from: f64,
        radius: f64,
        turn: f64,
        piece: f64,
    },
    /// A line in pieces.
    CutLine { angle: f64, length: f64, piece: f64 },
}

/// What comes in between, after so many segments.
#[derive(Clone, Copy, Debug)]
enum Event {
    Hold,
    Resume,
    Feed(u8),
    Rapid(u8),
    /// A hold, and at its rest all that is left is forgotten.
    Cancel,
}

#[derive(Clone, Debug)]
pub(crate) struct Program {
    parts: Vec<(Part, f32, MoveKind)>,
    events: Vec<(usize, Event)>,
    rates: [f32; 2],
    accelerations: [f32; 2],
    pub(crate) steps_per_mm: [i64; 2],
    rule: CornerRule,
}

fn part() -> impl Strategy<Value = Part> {
    let angle = || 0.0..TAU;
    let turn = || prop_oneof![0.3..TAU, -TAU..-0.3];
    prop_oneof![
        3 => (-2.0f64..2.0, angle()).prop_map(|(size, angle)| {
            let length = 10f64.powf(size);
            Part::Line { x: length * angle.cos(), y: length * angle.sin() }
        }),
        1 => (-50.0f64..50.0).prop_map(|x| Part::Line { x, y: 0.0 }),
        2 => (angle(), -0.5f64..1.2, turn()).prop_map(|(from, size, turn)| Part::Arc { from, radius: 10f64.powf(size), turn }),
        2 => (angle(), 0.0f64..1.5, turn(), 0.02f64..0.3).prop_map(|(from, size, turn, piece)| {
            let radius = 10f64.powf(size);
            // As near to the circle as the chords of an arc: farther away, corners are corners.
            Part::Cut { from, radius, turn, piece: piece.min((8.0 * 0.002 * radius).sqrt()) }
        }),
        1 => (angle(), 0.1f64..2.0, 0.01f64..0.1).prop_map(|(angle, length, piece)| Part::CutLine { angle, length, piece }),
    ]
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        2 => Just(Event::Hold),
        3 => Just(Event::Resume),
        3 => (10u8..=200).prop_map(Event::Feed),
        1 => prop::sample::select(vec![25u8, 50, 100]).prop_map(Event::Rapid),
        1 => Just(Event::Cancel),
    ]
}

pub(crate) fn program() -> impl Strategy<Value = Program> {
    let kind = prop::sample::select(vec![
        MoveKind::Feed,
        MoveKind::Feed,
        MoveKind::Rapid,
        MoveKind::Jog,
    ]);
    let parts = prop::collection::vec((part(), 1.0f32..300.0, kind), 1..5);
    let events = prop::collection::vec((1usize..150, event()), 0..12);
    let limits = (
        prop::array::uniform2(5.0f32..300.0),
        prop::array::uniform2(10.0f32..5000.0),
    );
    let scale = prop::array::uniform2(prop_oneof![Just(250i64), 80i64..1000]);
    let rule = prop::sample::select(vec![
        CornerRule::Limits,
        CornerRule::Limits,
        CornerRule::Grbl,
    ]);
    (parts, events, limits, scale, rule).prop_map(
        |(parts, events, (rates, accelerations), steps_per_mm, rule)| Program {
            parts,
            events,
            rates,
            accelerations,
            steps_per_mm,
            rule,
        },
    )
}

/// A move, and the circle that it was cut from: radius, length of the arc, mm.
pub(crate) struct Cut {
    pub(crate) of: Move<2>,
    /// Whether a part of the program begins with it.
    pub(crate) is_first: bool,
    circle: Option<[f64; 2]>,
}

impl Program {
    pub(crate) fn config(&self) -> Config<2> {
        Config {
            max_rate: self.rates,
            acceleration: self.accelerations,
            steps_per_mm: self
                .steps_per_mm
                .map(|steps| StepsPerMm::from_nanos(steps * NANOS_PER_MM)),
            corner_rule: self.rule,
            ..Config::default()
        }
    }

    pub(crate) fn moves(&self) -> Vec<Cut> {
        let mut at = [0.0, 0.0];
        let mut moves = Vec::new();
        for (part, feed, kind) in &self.parts {
            let (mut cuts, end) = self.cut(part, at, *feed, *kind);
            if let Some(first) = cuts.first_mut() {
                first.is_first = true;
            }
            moves.extend(cuts);
            at = end;
        }
        moves
    }

    fn cut(&self, part: &Part, at: [f64; 2], feed: f32, kind: MoveKind) -> (Vec<Cut>, [f64; 2]) {
        let rounded = |x: f64| (x * 1000.0).round() / 1000.0;
        let of = |[x, y]: [f64; 2]| Move {
            feed: if kind == MoveKind::Rapid {
                Feed::Rapid
            } else {
                Feed::PerMinute(feed)
            },
            kind,
            ..to(rounded(x), rounded(y), feed)
        };
        let line = |end: [f64; 2], pieces: usize| {
            let share = |k: usize| k as f64 / pieces as f64;
            let point = |k| [0, 1].map(|i| at[i] + (end[i] - at[i]) * share(k));
            let cuts = (1..=pieces).map(|k| Cut {
                of: of(point(k)),
                is_first: false,
                circle: None,
            });
            (cuts.collect(), end)
        };
        let on_circle = |from: f64, radius: f64, angle: f64| {
            [
                at[0] + radius * (angle.cos() - from.cos()),
                at[1] + radius * (angle.sin() - from.sin()),
            ]
        };
        match *part {
            Part::Line { x, y } => line([at[0] + x, at[1] + y], 1),
            Part::CutLine {
                angle,
                length,
                piece,
            } => {
                let end = [at[0] + length * angle.cos(), at[1] + length * angle.sin()];
                line(end, (length / piece).ceil() as usize)
            }
            Part::Cut {
                from,
                radius,
                turn,
                piece,
            } => {
                let pieces = ((radius * turn.abs() / piece).ceil() as usize).min(240);
                let point =
                    |k: usize| on_circle(from, radius, from + turn * k as f64 / pieces as f64);
                let cuts = (1..=pieces).map(|k| Cut {
                    of: of(point(k)),
                    is_first: false,
                    circle: Some([radius, radius * turn.abs()]),
                });
                (cuts.collect(), point(pieces))
            }
            Part::Arc { from, radius, turn } => {
                let mm = |x: f64| Coordinate::from_nanos((rounded(x) * 1e9).round() as i64);
                let (end, centre) = (
                    on_circle(from, radius, from + turn),
                    on_circle(from, 0.0, 0.0),
                );
                let offset = [-radius * from.cos(), -radius * from.sin()].map(mm);
                let chords = Arc::new(
                    centre.map(mm),
                    end.map(mm),
                    offset,
                    (0, 1),
                    turn < 0.0,
                    0.002,
                );
                let curve = Curve {
                    radius: chords.radius(),
                    acceleration: self.accelerations[0].min(self.accelerations[1]),
                };
                let cuts = chords.map(|target| Cut {
                    of: Move {
                        target,
                        curve: Some(curve),
                        ..of(end)
                    },
                    is_first: false,
                    circle: None,
                });
                (cuts.collect(), end)
            }
        }
    }
}

/// The largest share of each limit that was made use of.
#[derive(Clone, Copy, Debug, Default)]
struct Worst {
    rate: f64,
    acceleration: f64,
    arc: f64,
    corner: f64,
    curve: f64,
    jump: f64,
}

impl Worst {
    fn and(self, other: Self) -> Self {
        Self {
            rate: self.rate.max(other.rate),
            acceleration: self.acceleration.max(other.acceleration),
            arc: self.arc.max(other.arc),
            corner: self.corner.max(other.corner),
            curve: self.curve.max(other.curve),
            jump: self.jump.max(other.jump),
        }
    }
}

fn exact(x: f32) -> BigRational {
    BigRational::from_float(x).expect("a number")
}

fn whole(x: i64) -> BigRational {
    BigRational::from_integer(x.into())
}

fn float(x: &BigRational) -> f64 {
    x.to_f64().expect("a number")
}

/// By how much more than its acceleration a profile changes the squared speed from its start to its end, as a share of
/// that: what rounding makes of speeds.
fn joint(profile: &Trapezoid) -> f64 {
    let (entry, exit) = (exact(profile.entry_v2()), exact(profile.exit_v2()));
    let [up, down] = profile.accelerations().map(|a| exact(a.abs()));
    let length = whole(i64::from(profile.end() - profile.start()));
    let change = if entry > exit {
        &entry - &exit
    } else {
        &exit - &entry
    };
    let more = change - whole(2) * up.max(down) * length;
    let most = exact(profile.entry_v2().max(profile.exit_v2()).max(1.0));
    float(&(more / most)).max(0.0)
}

/// A move that runs, with its geometry.
struct Leg {
    /// mm of each axis in a step of the dominant motor.
    share: [BigRational; 2],
    /// mm.
    length: f64,
    u: [f64; 2],
    curve: Option<Curve>,
    circle: Option<[f64; 2]>,
}

impl Leg {
    fn new(cut: &Cut, delta: [i32; 2], scale: [i64; 2]) -> Self {
        let events = i64::from(delta[0].abs().max(delta[1].abs()));
        let mm = [0, 1].map(|i| f64::from(delta[i]) / scale[i] as f64);
        let length = mm[0].hypot(mm[1]);
        Self {
            share: [0, 1].map(|i| whole(delta[i].abs().into()) / whole(scale[i]) / whole(events)),
            length,
            u: mm.map(|mm| mm / length),
            curve: cut.of.curve,
            circle: cut.circle,
        }
    }

    /// Path in a step, squared, mm².
    fn step2(&self) -> BigRational {
        self.share.iter().map(|share| share * share).sum()
    }

    fn v2(&self, steps_v2: f32) -> f64 {
        f64::from(steps_v2) * float(&self.step2())
    }

    /// The settings against one profile.
    fn check(&self, profile: &Trapezoid, limits: &Config<2>) -> Result<Worst, String> {
        let mut worst = Worst {
            jump: joint(profile),
            ..Worst::default()
        };
        let [up, down] = profile.accelerations().map(|a| exact(a.abs()));
        let a = up.max(down);
        for (axis, share) in self.share.iter().enumerate() {
            let rate = exact(profile.cruise()) * share / exact(limits.max_rate[axis]);
            let acceleration = &a * share / exact(limits.acceleration[axis]);
            if rate > whole(1) || acceleration > whole(1) {
                return Err(format!(
                    "axis {axis}: rate {} acceleration {}",
                    float(&rate),
                    float(&acceleration)
                ));
            }
            worst.rate = worst.rate.max(float(&rate));
            worst.acceleration = worst.acceleration.max(float(&acceleration));
        }
        if limits.corner_rule == CornerRule::Limits {
            if let Some(curve) = self.curve {
                let v2 = exact(profile.cruise()) * exact(profile.cruise()) * self.step2();
                let pull = v2 / exact(curve.radius);
                let total2 = &pull * &pull + &a * &a * self.step2();
                let limit = exact(limits.acceleration[0]).min(exact(limits.acceleration[1]));
                let share2 = total2 / (&limit * &limit);
                if share2 > whole(1) {
                    return Err(format!("arc: {}", float(&share2).sqrt()));
                }
                worst.arc = float(&share2).sqrt();
            }
            if let Some([radius, length]) = self.circle {
                // Less than a window, and it is a corner.
                let stroke = (f64::from(Limits::new(limits).tolerance) * radius).sqrt();
                if length < 8.0 * stroke {
                    return Ok(worst);
                }
                let pull = self.v2(profile.cruise() * profile.cruise()) / radius;
                worst.curve = pull / f64::from(limits.acceleration[0].min(limits.acceleration[1]));
                if worst.curve > 1.0 {
                    return Err(format!("curve: {}", worst.curve));
                }
            }
        }
        Ok(worst)
    }

    /// Whether it is too long to be a part of a stroke.
    fn stands_alone(&self, limits: &Config<2>) -> bool {
        let [rate2, a] = [
            limits
                .max_rate
                .iter()
                .map(|rate| f64::from(rate * rate))
                .sum(),
            f64::from(limits.acceleration[0].min(limits.acceleration[1])),
        ];
        let tolerance = f64::from(Limits::new(limits).tolerance);
        limits.corner_rule == CornerRule::Grbl
            || self.curve.is_some()
            || self.length * self.length > 4.01 * tolerance * rate2 / a
    }
}

/// Junction deviation between two legs, by the book.
fn corner_v2(before: &Leg, after: &Leg, limits: &Config<2>) -> f64 {
    let [x0, y0] = before.u;
    let [x1, y1] = after.u;
    let (dot, cross) = (x0 * x1 + y0 * y1, x0 * y1 - y0 * x1);
    if dot > 0.999_999 {
        return f64::INFINITY;
    }
    // 1 + dot, and 1 − dot, each without cancellation
    let (plus, minus) = if dot < 0.0 {
        (cross * cross / (1.0 - dot), 1.0 - dot)
    } else {
        (1.0 + dot, cross * cross / (1.0 + dot))
    };
    if plus < 1e-6 {
        return 0.0;
    }
    let (s, change) = ((plus / 2.0).sqrt(), (2.0 * minus).sqrt());
    let a = (0..2)
        .map(|i| f64::from(limits.acceleration[i]) * change / (after.u[i] - before.u[i]).abs())
        .fold(f64::INFINITY, f64::min);
    a * f64::from(limits.junction_deviation) * s * (1.0 + s) / (minus / 2.0)
}

/// Runs a program as a planner with `settings` does, and checks it against `limits`.
fn run(program: &Program, settings: Config<2>, limits: &Config<2>) -> Result<Worst, String> {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(settings, &mut queue);
    let mut worst = Worst::default();
    let mut events = program.events.iter().copied();
    let mut event = events.next();
    let mut cancelling = false;
    let all = program.moves();
    let mut legs: Vec<Leg> = Vec::new();
    let mut queued = all.iter().filter_map(|cut| {
        let before = rig.planner.position();
        while rig.planner.is_renewing() {
            rig.planner.renew();
        }
        rig.planner.push(&cut.of).expect("room");
        let after = rig.planner.position();
        let delta = [0, 1].map(|i| after[i] - before[i]);
        (delta != [0, 0]).then(|| Leg::new(cut, delta, program.steps_per_mm))
    });
    legs.extend(queued.by_ref());
    drop(queued);
    let mut begun = 0;
    let mut last: Option<(Trapezoid, usize)> = None;
    while let Some(segment) = rig.segmenter.next(&mut rig.planner) {
        begun += usize::from(segment.line.is_some());
        let leg = &legs[begun - 1];
        if let Some((Profile::Trapezoid(profile), _)) = rig.segmenter.profile() {
            if last.as_ref().is_none_or(|(last, _)| last != profile) {
                worst = worst.and(leg.check(profile, limits)?);
                // A profile goes on with the speed that the last one had there.
                if let Some((before, _)) = last.filter(|(_, of)| *of == begun) {
                    let start = profile.start();
                    let (was, is) = (before.speed_v2(start, 0.0), profile.entry_v2());
                    worst.jump = worst
                        .jump
                        .max(f64::from((was - is).abs()) / f64::from(is.max(1.0)));
                }
            }
            last = Some((*profile, begun));
        } else if let Some(next) = legs.get(begun).filter(|_| !rig.planner.is_empty()) {
            let v2 = f64::from(rig.segmenter.speed()).powi(2);
            if leg.stands_alone(limits) && next.stands_alone(limits) {
                let corner = corner_v2(leg, next, limits);
                if v2 > corner {
                    return Err(format!("corner: {v2} instead of {corner}"));
                }
                if v2 > 0.0 && corner < f64::INFINITY {
                    worst.corner = worst.corner.max(v2 / corner);
                }
            }
        }
        match &mut event {
            Some((0, what)) => {
                let overrides = rig.planner.overrides();
                match *what {
                    Event::Hold => rig.segmenter.hold(),
                    Event::Resume => rig.segmenter.resume(),
                    Event::Feed(feed) => rig.planner.set_overrides(Overrides { feed, ..overrides }),
                    Event::Rapid(rapid) => {
                        rig.planner.set_overrides(Overrides { rapid, ..overrides })
                    }
                    Event::Cancel => {
                        rig.segmenter.hold();
                        cancelling = true;
                    }
                }
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
    let config = ProptestConfig {
        cases,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    // The same programs each time, but for campaigns.
    let mut runner = if cases > 1000 {
        TestRunner::new(config)
    } else {
        let rng = TestRng::deterministic_rng(config.rng_algorithm);
        TestRunner::new_with_rng(config, rng)
    };
    let worst = core::cell::Cell::new(Worst::default());
    let result = runner.run(&program(), |program| {
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

fn cases() -> u32 {
    let asked = std::env::var("PROPTEST_CASES").ok();
    asked.and_then(|cases| cases.parse().ok()).unwrap_or(1000)
}

/// A line cut into 0.01 mm, planned as it comes: at rest at its end, in the time that the queue allows.
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

/// The same at 83 mm/s, for which the queue is too short, and at coarse steps: at rest at the end.
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
    let worst = campaign(cases(), |_| ()).unwrap_or_else(|error| panic!("{error}"));
    println!(
        "{} programs, largest shares of the limits: {worst:?}",
        cases()
    );
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

/// From rest there is no stroke before the first one that it could stray from.
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
    assert!(worst.is_ok_and(|worst| worst.curve < 0.8));
}

/// No stroke ends with the last pieces of a path; there a strong axis could double its speed within one of them.
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
    let worst = run(&program, program.config(), &program.config());
    assert!(
        worst.as_ref().is_ok_and(|worst| worst.curve < 1.0),
        "{worst:?}"
    );
}

/// The override asks for less than can be reached any more; what can be is only as exact as the high speed before.
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
