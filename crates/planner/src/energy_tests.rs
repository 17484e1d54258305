//! Energy on the path: under M4 each step gets the programmed energy for a millimetre, from the
//! first out of rest to the last.

use crate::reference::{to, Interruption, Rig, RigQueue};
use crate::{Config, Move, MovePower};
use fixed::types::U1F31;
use leadscrew_stepper::Power;
use proptest::prelude::*;
use std::vec::Vec;

/// Power below this share is not checked. Pixels keep their power in units of 2⁻²² (see `pixel`),
/// of which this is 200; one level of the board's PWM is more.
const FLOOR: f64 = 4.8e-5;

/// Shorter intervals, timer counts, are not checked: rounding to whole counts alone is a hundredth
/// of them.
const SHORTEST: u64 = 100;

/// A straight line of a program: steps, share of full power, feed in mm/s.
#[derive(Clone, Copy, Debug)]
struct Leg {
    steps: [i32; 2],
    share: f64,
    feed: f32,
}

impl Leg {
    fn dominant(&self) -> usize {
        usize::from(self.steps[1].abs() > self.steps[0].abs())
    }

    fn events(&self) -> u32 {
        self.steps[self.dominant()].unsigned_abs()
    }

    /// Timer counts of full power that a step is to get.
    fn due(&self) -> f64 {
        let [x, y] = self.steps.map(|steps| f64::from(steps) * 0.004);
        self.share * x.hypot(y) / f64::from(self.events()) / f64::from(self.feed) * 84e6
    }
}

fn moves(legs: &[Leg]) -> Vec<Move<2>> {
    let mut at = [0.0; 2];
    let moves = legs.iter().map(|leg| {
        at = [0, 1].map(|axis| at[axis] + f64::from(leg.steps[axis]) * 0.004);
        let power = Power::from_share(U1F31::from_num(leg.share));
        Move {
            power: MovePower::Dynamic { power },
            ..to(at[0], at[1], leg.feed)
        }
    });
    moves.collect()
}

/// Runs `legs`. Returns the largest relative error of the energy of a step, and where it was.
fn worst_error(
    config: Config<2>,
    legs: &[Leg],
    interruptions: &[Interruption],
) -> (f64, Option<(usize, u32, f64)>) {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config, &mut queue);
    for next in moves(legs) {
        rig.planner.push(&next).unwrap();
    }
    // If motion is faster than programmed the power may reach full, in all or a part of a
    // segment, and follow no further.
    let faster = interruptions.iter().any(|(_, feed)| *feed > Some(100));
    let most = if faster { 0.8 } else { 1.1 };
    let mut worst = (0.0, None);
    let mut legs = legs.iter().copied().enumerate();
    let (mut index, mut leg) = legs.next().unwrap();
    let (mut made, mut energy, mut interval, mut full) = (0, 0.0, 0, false);
    let mut segments = 0;
    loop {
        let Some(segment) = rig.segmenter.next(&mut rig.planner) else {
            if !rig.segmenter.is_held() {
                break;
            }
            rig.segmenter.resume();
            continue;
        };
        let mut from = rig.player.now;
        for timed in rig.player.play(&segment) {
            let share = f64::from(timed.tick.power.share().to_num::<f32>());
            energy += share * (timed.at - from) as f64;
            full |= share > 0.999_999;
            interval += timed.at - from;
            from = timed.at;
            if !timed.tick.step.contains(leg.dominant()) {
                continue;
            }
            // A slow step has several powers, and the first may be all that there is.
            let clipped = faster && full || leg.due() >= most * interval as f64;
            if !clipped && interval >= SHORTEST && leg.due() / interval as f64 > FLOOR {
                let error = energy / leg.due() - 1.0;
                if error.abs() > f64::abs(worst.0) {
                    worst = (error, Some((index, made, interval as f64)));
                }
            }
            (made, energy, interval, full) = (made + 1, 0.0, 0, false);
            if made == leg.events() {
                made = 0;
                (index, leg) = legs.next().unwrap_or((index, leg));
            }
        }
        segments += 1;
        rig.interrupt(interruptions, segments);
    }
    worst
}

fn config(acceleration: f32) -> Config<2> {
    Config {
        max_rate: [400.0; 2],
        acceleration: [acceleration; 2],
        pixels: usize::MAX,
        ..Config::default()
    }
}

fn leg() -> impl Strategy<Value = Leg> {
    let size = 0u32..5;
    let share = prop_oneof![Just(1.0), 0.0f64..1.0, 0.001f64..0.02];
    (size, -1.0f64..1.0, -1.0f64..1.0, share, 0.0f32..2.6, 0u8..3).prop_map(
        |(size, x, y, share, feed, straight)| {
            let most = f64::from(6u32.pow(size)) + 1.0;
            let y = if straight == 0 { y } else { 0.0 };
            let mut steps = [x, y].map(|way| (way * most) as i32);
            if steps == [0, 0] {
                steps = [1, 0];
            }
            Leg {
                steps,
                share,
                feed: 10f32.powf(feed),
            }
        },
    )
}

/// Rows in one direction, whose pixels may be merged, as well as moves in all directions.
fn program() -> impl Strategy<Value = Vec<Leg>> {
    let row = (leg(), prop::collection::vec(0.0f64..1.0, 1..20)).prop_map(|(leg, shares)| {
        let pixel = |share| Leg { share, ..leg };
        shares.into_iter().map(pixel).collect::<Vec<_>>()
    });
    prop::collection::vec(row, 1..8).prop_map(|rows| rows.concat())
}

proptest! {
    #![proptest_config(crate::reference::times(500))]

    #[test]
    fn each_step_of_each_line_gets_its_energy_within_a_hundredth(
        legs in program(), acceleration in 1.0f32..4.3,
        interruptions in prop::collection::vec((1usize..200, prop::option::of(10u8..=200)), 0..6),
    ) {
        let (error, at) = worst_error(config(10f32.powf(acceleration)), &legs, &interruptions);
        prop_assert!(error.abs() < 0.01, "{} at {:?}", error, at);
    }
}
