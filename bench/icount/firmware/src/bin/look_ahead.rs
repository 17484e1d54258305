//! Planning one line by the rule that keeps all limits, and the worst that planning can come to.
//!
//! Regions 0 to 4: a move of a spiral pushed into a queue of 1024 that is kept full, at the settings of [`SETTINGS`]. Region
//! 5: a move that takes the place of all 1023 before it in the look-ahead. Region 6: a change of overrides with 1024 moves
//! queued; region 7: each of the calls that carry it through the queue.
#![no_std]
#![no_main]

use core::hint::black_box;
use icount_firmware::{count, done};
use leadscrew_planner::{
    Cartesian, Config, Coordinate, Feed, Move, MoveKind, MovePower, Overrides, Planner, PushError,
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

#[inline(never)]
fn set_overrides(planner: &mut ThePlanner<'_>, feed: u8) {
    planner.set_overrides(Overrides { feed, rapid: 100 });
}

#[inline(never)]
fn renew(planner: &mut ThePlanner<'_>) -> bool {
    planner.renew()
}

/// Fills the queue with short moves at full speed, each of which bounds the ones before it a little more, then turns back.
fn worst(planner: &mut ThePlanner<'_>) {
    planner.configure(Config {
        max_rate: [5000.0 / 60.0; 3],
        acceleration: [10.0; 3],
        ..Config::default()
    });
    planner.set_position([0; 3]);
    for index in 1..planner.capacity() {
        let x = index as f32 * 0.05;
        assert!(push(planner, &feed(x, 0.0, 0.0, 80.0)) == Ok(Pushed::Queued));
    }
    let back = feed(0.0, 0.0, 0.0, 80.0);
    assert!(count::<5, _>(|| push(planner, black_box(&back))) == Ok(Pushed::Queued));
    count::<6, _>(|| set_overrides(planner, black_box(50)));
    while count::<7, _>(|| renew(planner)) {}
    planner.clear();
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut queue = Queue::<3, 1024>::new();
    let mut planner = ThePlanner::new(Config::default(), Cartesian, &mut queue);
    let planner = black_box(&mut planner);
    let [mid, slow, fast_slow, fast, far] = SETTINGS;
    plan_a_spiral::<0>(planner, mid);
    plan_a_spiral::<1>(planner, slow);
    plan_a_spiral::<2>(planner, fast_slow);
    plan_a_spiral::<3>(planner, fast);
    plan_a_spiral::<4>(planner, far);
    worst(planner);
    done()
}
