//! Planning one line, and the preparation of segments.
//!
//! Region 0: a move of a spiral pushed into a queue of 1024 that is kept full, by Grbl's corner rule at 2000 mm/min and
//! 200 mm/s²; regions 2 to 5: at the other settings of [`SETTINGS`]. Region 1: a segment of 1 ms in cruise at 20 kHz, of
//! a line with three axes: [`EVENTS`] step events.
#![no_std]
#![no_main]

use core::hint::black_box;
use icount_firmware::{count, done};
use leadscrew_planner::{
    Cartesian, Config, Coordinate, CornerRule, Feed, Move, MoveKind, MovePower, Planner, PushError,
    Pushed, Queue, Segmenter,
};
use leadscrew_stepper::{Outputs, Segment};

/// Rates in mm/min and accelerations in mm/s² at which a spiral is planned.
const SETTINGS: [(u16, u16); 5] = [
    (2000, 200),
    (500, 10),
    (5000, 200),
    (5000, 1000),
    (5000, 10),
];

type ThePlanner<'q> = Planner<'q, Cartesian, 3, 3>;

/// Step events that a segment of the second measurement covers: 1 ms at 20 kHz.
const EVENTS: u16 = 20;
/// Speed of that line, mm/s: a little above 20 kHz at 250 steps/mm, so that a millisecond holds 20 whole steps.
const CRUISE: f32 = 80.4;

#[inline(never)]
fn push(planner: &mut ThePlanner<'_>, of: &Move<3>) -> Result<Pushed, PushError> {
    planner.push(of)
}

#[inline(never)]
fn prepare(segmenter: &mut Segmenter<3, 3>, planner: &mut ThePlanner<'_>) -> Option<Segment<3>> {
    segmenter.next(planner)
}

fn feed(x: f32, y: f32, z: f32, speed: f32) -> Move<3> {
    Move {
        target: [x, y, z].map(Coordinate::from_mm),
        feed: Feed::PerMinute(speed),
        power: MovePower::Off,
        curve: None,
        outputs: Outputs(0),
        line_number: None,
        kind: MoveKind::Feed,
    }
}

/// Points of a spiral: each is the one before it, turned by 0.03 rad and 0.05 % farther out. Chords of 0.1 to 0.3 mm.
fn spiral() -> impl Iterator<Item = Move<3>> {
    let (cosine, sine) = (0.999_550_03_f32 * 1.0005, 0.029_995_5_f32 * 1.0005);
    let mut at = (3.0_f32, 0.0_f32);
    core::iter::from_fn(move || {
        at = (at.0 * cosine - at.1 * sine, at.0 * sine + at.1 * cosine);
        Some(feed(at.0, at.1, 0.0, 2000.0 / 60.0))
    })
}

/// Keeps the queue full with a spiral at F2000.
fn plan_a_spiral<const REGION: u8>(planner: &mut ThePlanner<'_>, (rate, acceleration): (u16, u16)) {
    planner.configure(Config {
        max_rate: [f32::from(rate) / 60.0; 3],
        acceleration: [f32::from(acceleration); 3],
        corner_rule: CornerRule::Grbl,
        ..Config::default()
    });
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

/// Prepares the segments of a long line once it has reached its speed.
fn cruise(planner: &mut ThePlanner<'_>) {
    planner.configure(Config {
        max_rate: [CRUISE; 3],
        acceleration: [1000.0; 3],
        ..Config::default()
    });
    planner.set_position([0; 3]);
    // The speed along the path with which the dominant axis is at `CRUISE`.
    let length = libm::sqrtf(1.0 + 0.81 + 0.64);
    let line = feed(200.0, 180.0, 160.0, CRUISE * length);
    assert!(push(planner, &line) == Ok(Pushed::Queued));
    let mut segmenter = Segmenter::new();
    for _ in 0..400 {
        assert!(prepare(&mut segmenter, planner).is_some());
    }
    for _ in 0..1000 {
        let segment = count::<1, _>(|| prepare(&mut segmenter, planner));
        let events = segment.map(|segment| segment.ticks.get() >> segment.smoothing.level());
        assert_eq!(events, Some(EVENTS));
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut queue = Queue::<3, 1024>::new();
    let mut planner = ThePlanner::new(Config::default(), Cartesian, &mut queue);
    let planner = black_box(&mut planner);
    let [mid, slow, fast_slow, fast, far] = SETTINGS;
    plan_a_spiral::<0>(planner, mid);
    plan_a_spiral::<2>(planner, slow);
    plan_a_spiral::<3>(planner, fast_slow);
    plan_a_spiral::<4>(planner, fast);
    plan_a_spiral::<5>(planner, far);
    cruise(planner);
    done()
}
