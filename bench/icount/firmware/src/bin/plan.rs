//! Planning one line, and the preparation of segments.
//!
//! Region 0: a move of a spiral is pushed into a queue of 1024 that is kept full, by Grbl's corner
//! rule at 2000 mm/min and 200 mm/s². Regions 2 to 5: the same at the other settings of
//! [`SETTINGS`]. Region 1: a segment of 1 ms at a constant 20 kHz, from a line with three axes,
//! with [`EVENTS`] step events.
#![no_std]
#![no_main]

use core::hint::black_box;
use icount_firmware::spiral::{feed, plan_a_spiral, prepare, push, ThePlanner, SETTINGS};
use icount_firmware::{count, done};
use leadscrew_planner::{Cartesian, Config, CornerRule, PixelQueue, Pushed, Queue, Segmenter};

/// The step events of the segment in region 1: 1 ms at 20 kHz.
const EVENTS: u32 = 20;
/// The speed of its line, mm/s: a little above 20 kHz at 250 steps/mm, so that a millisecond holds
/// 20 whole steps.
const CRUISE: f32 = 80.4;

/// Prepares the segments of a long line once it has reached its speed.
fn cruise(planner: &mut ThePlanner<'_>) {
    planner
        .configure(Config {
            max_rate: [CRUISE; 3],
            acceleration: [1000.0; 3],
            ..Config::default()
        })
        .unwrap();
    planner.set_position([0; 3]);
    // The speed along the path at which the dominant axis moves at `CRUISE`.
    let length = libm::sqrtf(1.0 + 0.81 + 0.64);
    let line = feed(200.0, 180.0, 160.0, CRUISE * length);
    assert!(push(planner, &line) == Ok(Pushed::Queued));
    let mut segmenter = Segmenter::new();
    for _ in 0..400 {
        assert!(prepare(&mut segmenter, planner).is_some());
    }
    for _ in 0..1000 {
        let segment = count::<1, _>(|| prepare(&mut segmenter, planner));
        let events = segment.map(|segment| segment.step_events());
        assert_eq!(events, Some(EVENTS));
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let (mut queue, mut pixels) = (Queue::<3, 3, 1024>::new(), PixelQueue::<1>::new());
    let mut planner =
        ThePlanner::new(Config::default(), Cartesian, &mut queue, &mut pixels).unwrap();
    let planner = black_box(&mut planner);
    let [mid, slow, fast_slow, fast, far] = SETTINGS;
    plan_a_spiral::<0>(planner, CornerRule::Grbl, mid);
    plan_a_spiral::<2>(planner, CornerRule::Grbl, slow);
    plan_a_spiral::<3>(planner, CornerRule::Grbl, fast_slow);
    plan_a_spiral::<4>(planner, CornerRule::Grbl, fast);
    plan_a_spiral::<5>(planner, CornerRule::Grbl, far);
    cruise(planner);
    done()
}
