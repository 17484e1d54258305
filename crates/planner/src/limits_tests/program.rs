//! Random programs of lines, arcs, curves and lines in pieces, with events in between.

use crate::reference::to;
use crate::{
    Arc, Config, Coordinate, CornerRule, Curve, Feed, Move, MoveKind, StepsPerMm, NANOS_PER_MM,
};
use core::f64::consts::TAU;
use proptest::prelude::*;
use std::vec;
use std::vec::Vec;

/// A part of a program. It begins where the part before it ended. Lengths in mm, angles in radians.
#[derive(Clone, Debug)]
pub(super) enum Part {
    /// A straight line by `x` and `y`.
    Line { x: f64, y: f64 },
    /// A G2 or G3: the angle on its circle at its beginning (radians), its radius (mm), and the
    /// angle of the turn (radians).
    Arc { from: f64, radius: f64, turn: f64 },
    /// A circle as CAM cuts it, with points rounded to 3 decimals: as an arc, with the length of a
    /// piece.
    Cut {
        from: f64,
        radius: f64,
        turn: f64,
        piece: f64,
    },
    /// A line in pieces.
    CutLine { angle: f64, length: f64, piece: f64 },
}

/// The events in between, each after a number of segments.
#[derive(Clone, Copy, Debug)]
pub(super) enum Event {
    Hold,
    Resume,
    Feed(u8),
    Rapid(u8),
    /// A hold. When it has come to rest, all queued motion is forgotten.
    Cancel,
}

#[derive(Clone, Debug)]
pub(crate) struct Program {
    pub(super) parts: Vec<(Part, f32, MoveKind)>,
    pub(super) events: Vec<(usize, Event)>,
    pub(super) rates: [f32; 2],
    pub(super) accelerations: [f32; 2],
    pub(crate) steps_per_mm: [i64; 2],
    pub(super) rule: CornerRule,
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
            // Pieces stay as near to the circle as the chords of an arc: farther away, their
            // corners are corners.
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

/// A circle that is cut into pieces, and the place of one piece on it. Lengths in mm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Circle {
    radius: f64,
    /// The length of the curve before the piece.
    before: f64,
    /// The length of the curve after the piece.
    after: f64,
}

impl Circle {
    /// The greatest error of points that are rounded to three decimals, mm.
    const ROUNDING: f64 = 0.0005;

    /// The two pieces as one.
    pub(super) fn joined(self, next: Self) -> Option<Self> {
        let Self { radius, before, .. } = self;
        (radius == next.radius).then_some(Self {
            radius,
            before,
            after: next.after,
        })
    }

    /// The curvature at both ends of a piece of this length, 1/mm, or 0 if the curve itself
    /// ends. Points are rounded, and the path may pass them at the same distance on the other side.
    /// So over the distance to the nearer end of the curve the path may be that much straighter
    /// than the circle.
    pub(super) fn ends(self, length: f64) -> [f64; 2] {
        let at = |way: f64| (1.0 / self.radius - 8.0 * Self::ROUNDING / (way * way)).max(0.0);
        let (before, after) = (self.before, self.after);
        [
            at(before.min(after + length)),
            at(after.min(before + length)),
        ]
    }
}

/// A move, and the circle that it was cut from.
pub(crate) struct Cut {
    pub(crate) of: Move<2>,
    /// True if a part of the program begins with it.
    pub(crate) is_first: bool,
    pub(super) circle: Option<Circle>,
}

impl Cut {
    /// A line that is a part by itself.
    pub(crate) fn line(of: Move<2>) -> Self {
        Self {
            of,
            is_first: true,
            circle: None,
        }
    }
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
        let of = |[x, y]: [f64; 2]| Move {
            feed: if kind == MoveKind::Rapid {
                Feed::Rapid
            } else {
                Feed::PerMinute(feed)
            },
            kind,
            ..to(rounded(x), rounded(y), feed)
        };
        let cut = |point, circle| Cut {
            of: of(point),
            is_first: false,
            circle,
        };
        let line = |end: [f64; 2], pieces: usize| {
            let share = |k: usize| k as f64 / pieces as f64;
            let point = |k| [0, 1].map(|i| at[i] + (end[i] - at[i]) * share(k));
            let cuts = (1..=pieces).map(|k| cut(point(k), None));
            (cuts.collect(), end)
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
                let angle = |k: usize| from + turn * k as f64 / pieces as f64;
                let point = |k| on_circle(at, from, radius, angle(k));
                let piece = radius * turn.abs() / pieces as f64;
                let circle = |k| Circle {
                    radius,
                    before: (k - 1) as f64 * piece,
                    after: (pieces - k) as f64 * piece,
                };
                let cuts = (1..=pieces).map(|k| cut(point(k), Some(circle(k))));
                (cuts.collect(), point(pieces))
            }
            Part::Arc { from, radius, turn } => {
                let end = on_circle(at, from, radius, from + turn);
                (self.arc(at, [from, radius, turn], &of(end)), end)
            }
        }
    }

    /// The chords of an arc as the machine makes them.
    fn arc(&self, at: [f64; 2], [from, radius, turn]: [f64; 3], last: &Move<2>) -> Vec<Cut> {
        let mm = |x: f64| Coordinate::from_nanos((rounded(x) * 1e9).round() as i64);
        let offset = [-radius * from.cos(), -radius * from.sin()].map(mm);
        let (start, end) = (at.map(mm), last.target);
        let chords = Arc::new(start, end, offset, (0, 1), turn < 0.0, 0.002).unwrap();
        let curve = Curve {
            radius: chords.radius(),
            acceleration: self.accelerations[0].min(self.accelerations[1]),
        };
        let cut = |target| Cut {
            of: Move {
                target,
                curve: Some(curve),
                ..*last
            },
            is_first: false,
            circle: None,
        };
        chords.map(cut).collect()
    }
}

/// Rounds to three decimals.
fn rounded(x: f64) -> f64 {
    (x * 1000.0).round() / 1000.0
}

/// The point at `angle` on the circle on which `at` is the point at `from`.
fn on_circle(at: [f64; 2], from: f64, radius: f64, angle: f64) -> [f64; 2] {
    [
        at[0] + radius * (angle.cos() - from.cos()),
        at[1] + radius * (angle.sin() - from.sin()),
    ]
}
