//! Planning one line by the rule that keeps all limits, and the worst cases of planning.
//!
//! Regions 0 to 4: a move of a spiral is pushed into a queue of 1024 that is kept full, at the
//! settings of [`SETTINGS`]. Region 5: a move that replaces all 1023 moves before it in the
//! look-ahead. Region 6: a change of overrides with 1024 moves queued. Region 7: each of the calls
//! that carry this change through the queue.
#![no_std]
#![no_main]

use core::hint::black_box;
use icount_firmware::spiral::{feed, plan_a_spiral, push, ThePlanner, SETTINGS};
use icount_firmware::{count, done};
use leadscrew_planner::{Cartesian, Config, CornerRule, Overrides, PixelQueue, Pushed, Queue};

#[inline(never)]
fn set_overrides(planner: &mut ThePlanner<'_>, feed: u8) {
    planner.set_overrides(Overrides { feed, rapid: 100 });
}

#[inline(never)]
fn renew(planner: &mut ThePlanner<'_>) -> bool {
    planner.renew()
}

/// Fills the queue with short moves at full speed, each of which limits the ones before it a little
/// more, and then reverses.
fn worst(planner: &mut ThePlanner<'_>) {
    planner
        .configure(Config {
            max_rate: [5000.0 / 60.0; 3],
            acceleration: [10.0; 3],
            ..Config::default()
        })
        .unwrap();
    planner.set_position([0; 3]);
    for index in 1..planner.capacity() {
        let x = index as f32 * 0.15; // longer than the pieces that are joined to the move before
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
    let (mut queue, mut pixels) = (Queue::<3, 3, 1024>::new(), PixelQueue::<1>::new());
    let mut planner =
        ThePlanner::new(Config::default(), Cartesian, &mut queue, &mut pixels).unwrap();
    let planner = black_box(&mut planner);
    let [mid, slow, fast_slow, fast, far] = SETTINGS;
    plan_a_spiral::<0>(planner, CornerRule::Limits, mid);
    plan_a_spiral::<1>(planner, CornerRule::Limits, slow);
    plan_a_spiral::<2>(planner, CornerRule::Limits, fast_slow);
    plan_a_spiral::<3>(planner, CornerRule::Limits, fast);
    plan_a_spiral::<4>(planner, CornerRule::Limits, far);
    worst(planner);
    done()
}
