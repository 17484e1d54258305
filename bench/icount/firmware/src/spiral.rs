//! A spiral of short moves, planned into a queue of 1024 that is kept full.

use crate::count;
use core::hint::black_box;
use leadscrew_planner::{
    Cartesian, Config, Coordinate, CornerRule, Feed, Move, MoveKind, MovePower, Planner, PushError,
    Pushed, Segmenter, THREE_DECIMALS,
};
use leadscrew_stepper::{OutputChange, Segment};

/// Rates in mm/min and accelerations in mm/s² at which a spiral is planned.
pub const SETTINGS: [(u16, u16); 5] = [
    (2000, 200),
    (500, 10),
    (5000, 200),
    (5000, 1000),
    (5000, 10),
];

/// The planner of a machine of three axes.
pub type ThePlanner<'q> = Planner<'q, Cartesian, 3, 3>;

/// Queues a move: the counted code.
#[inline(never)]
pub fn push(planner: &mut ThePlanner<'_>, of: &Move<3>) -> Result<Pushed, PushError> {
    planner.push(of)
}

/// Makes the next segment: the counted code.
#[inline(never)]
pub fn prepare(
    segmenter: &mut Segmenter<3, 3>,
    planner: &mut ThePlanner<'_>,
) -> Option<Segment<3>> {
    segmenter.next(planner)
}

/// Returns a feed move to a place (mm) at `speed` mm/s.
pub fn feed(x: f32, y: f32, z: f32, speed: f32) -> Move<3> {
    Move {
        target: [x, y, z].map(|mm| Coordinate::from_mm(mm).unwrap()),
        feed: Feed::PerMinute(speed),
        power: MovePower::Off,
        curve: None,
        rounding: THREE_DECIMALS,
        outputs: OutputChange::NONE,
        line_number: None,
        kind: MoveKind::Feed,
    }
}

/// The moves of a spiral. Each point is the one before it, turned by 0.03 rad and moved out by 0.05
/// %. The chords are 0.1 to 0.3 mm long.
fn spiral() -> impl Iterator<Item = Move<3>> {
    let (cosine, sine) = (0.999_550_03_f32 * 1.0005, 0.029_995_5_f32 * 1.0005);
    let mut at = (3.0_f32, 0.0_f32);
    core::iter::from_fn(move || {
        at = (at.0 * cosine - at.1 * sine, at.0 * sine + at.1 * cosine);
        Some(feed(at.0, at.1, 0.0, 2000.0 / 60.0))
    })
}

/// Keeps the queue full with a spiral at F2000, planned by `corner_rule`.
pub fn plan_a_spiral<const REGION: u8>(
    planner: &mut ThePlanner<'_>,
    corner_rule: CornerRule,
    (rate, acceleration): (u16, u16),
) {
    planner
        .configure(Config {
            max_rate: [f32::from(rate) / 60.0; 3],
            acceleration: [f32::from(acceleration); 3],
            corner_rule,
            ..Config::default()
        })
        .unwrap();
    planner.set_position([0; 3]);
    let mut segmenter = Segmenter::new();
    for of in spiral().take(planner.capacity()) {
        assert!(push(planner, &of) == Ok(Pushed::Queued));
    }
    for of in spiral().skip(planner.capacity()).take(1024) {
        while !planner.has_room() {
            assert!(prepare(&mut segmenter, planner).is_some());
        }
        assert!(count::<REGION, _>(|| push(planner, black_box(&of))) == Ok(Pushed::Queued));
    }
    while prepare(&mut segmenter, planner).is_some() {}
}
