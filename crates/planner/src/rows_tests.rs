//! Rows of pixels on the motors: each border of a pixel lies at the same step as if each pixel were
//! a move.
//!
//! A row's pixels end on one line in steps. There all motors have made exactly the steps of a whole
//! number of pixels, so nothing is left to be rounded; within a pixel, motors other than the
//! dominant one have half a step to go from either border, as in a move of its own.

use crate::reference::{to, Interruption, Rig, RigQueue};
use crate::{Config, Coordinate, Move, MovePower};
use fixed::types::U1F31;
use leadscrew_stepper::Power;
use proptest::prelude::*;
use std::vec::Vec;

/// A row: the way of a pixel in steps, and for each pixel how many times as long it is, and its
/// power in 2⁻²².
type Row = ([i32; 2], Vec<(i32, u32)>);

/// A pixel that the motors should make: steps from the end of the last pixel, and its power.
struct Due {
    delta: [i32; 2],
    power: Power,
}

impl Due {
    fn dominant(&self) -> usize {
        usize::from(self.delta[1].abs() > self.delta[0].abs())
    }
}

fn rows() -> impl Strategy<Value = Vec<Row>> {
    let way = prop::array::uniform2(-9i32..=9).prop_filter("a way", |way| *way != [0, 0]);
    let pixels = prop::collection::vec((1i32..12, 0u32..=1 << 22), 1..25);
    prop::collection::vec((way, pixels), 1..6)
}

fn pixels(rows: &[Row]) -> Vec<Due> {
    let pixels = rows.iter().flat_map(|(way, pixels)| {
        pixels.iter().map(|(size, power)| Due {
            delta: way.map(|steps| steps * size),
            power: Power::from_share(U1F31::from_bits(power << 9)),
        })
    });
    pixels.collect()
}

fn moves(pixels: &[Due]) -> Vec<Move<2>> {
    let mut at = [0; 2];
    let moves = pixels.iter().map(|pixel| {
        at = [0, 1].map(|axis| at[axis] + pixel.delta[axis]);
        Move {
            target: at.map(|steps| Coordinate::near(steps as f32 * 0.004)),
            power: MovePower::Constant { power: pixel.power },
            ..to(0.0, 0.0, 120.0)
        }
    });
    moves.collect()
}

/// Runs the pixels. Checks the motors at each border, and the power of each dominant step. Returns
/// how many planned moves there were.
fn run(
    config: Config<2>,
    pixels: &[Due],
    interruptions: &[Interruption],
) -> Result<usize, TestCaseError> {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config, &mut queue);
    for next in moves(pixels) {
        rig.planner.push(&next).unwrap();
    }
    let planned = rig.planner.len();
    let (mut at, mut border) = ([0; 2], [0; 2]);
    let mut left = pixels.iter();
    let mut pixel = left.next();
    let (mut made, mut segments) = (0, 0);
    loop {
        let Some(segment) = rig.segmenter.next(&mut rig.planner) else {
            if !rig.segmenter.is_held() {
                break;
            }
            rig.segmenter.resume();
            continue;
        };
        for timed in rig.player.play(&segment) {
            let due = pixel.expect("no step beyond the last pixel");
            for (motor, at) in at.iter_mut().enumerate() {
                let sign = if timed.tick.direction.contains(motor) {
                    -1
                } else {
                    1
                };
                *at += sign * i32::from(timed.tick.step.contains(motor));
            }
            if timed.tick.step.contains(due.dominant()) {
                // The last step of a hold takes long, and has less power.
                let faded = rig.segmenter.is_held() && timed.tick.power < due.power;
                prop_assert!(faded || timed.tick.power == due.power);
                made += 1;
            }
            if made == due.delta[due.dominant()].abs() {
                border = [0, 1].map(|axis| border[axis] + due.delta[axis]);
                prop_assert_eq!(at, border);
                (pixel, made) = (left.next(), 0);
            }
        }
        segments += 1;
        rig.interrupt(interruptions, segments);
    }
    prop_assert!(pixel.is_none() && rig.planner.is_empty());
    Ok(planned)
}

proptest! {
    #![proptest_config(crate::reference::times(300))]

    #[test]
    fn each_border_lies_at_the_step_at_which_moves_of_their_own_would_have_it(
        rows in rows(), acceleration in 100.0f32..20_000.0, rate in 5.0f32..500.0,
        interruptions in prop::collection::vec((1usize..100, prop::option::of(10u8..=200)), 0..6),
    ) {
        let pixels = pixels(&rows);
        let merged = Config {
            max_rate: [rate; 2],
            acceleration: [acceleration; 2],
            pixels: usize::MAX,
            ..Config::default()
        };
        let one_by_one = Config { pixels: 0, ..merged };
        prop_assert!(run(merged, &pixels, &interruptions)? <= rows.len());
        prop_assert_eq!(run(one_by_one, &pixels, &interruptions)?, pixels.len());
    }
}
