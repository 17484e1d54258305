//! Pieces of a few steps are joined into one move.
//!
//! ```text
//!      .  .  .  x--x
//!      .  x--x  .  .
//!      x--.  .  .  .
//! ```
//!
//! A piece of 2.5 steps, rounded to whole steps, is off its direction by up to 0.3 rad. A row of
//! such pieces is longer than the straight line, and each piece has the rate and the acceleration
//! of its own direction. At 80 steps/mm pieces of 0.01 mm take up to a fifth longer than the line.
//! A move of 32 steps has nearly the right direction.
//!
//! The joined move ends where its last piece ends, and makes the same steps of each motor. It
//! passes the end of each piece with every motor within a step of its place there. (Places are
//! compared at the same number of steps from the start, counted over all motors.) So the end of
//! each piece allows a range for the share of each motor in all steps. Pieces are joined while the
//! share of each motor is within its range, and, on a smooth curve, while the pieces stay near the
//! joined move (see `joined`).

use super::joined::Joined;
use crate::real::{max, min};

/// A move that is shorter than this many of the coarsest steps is joined to the next one. The
/// direction of a longer move is off by 1/32 (rad) at most, and its length by half the square of
/// 1/32, a share of 1/2000.
pub(crate) const STEPS: u32 = 32;

/// While all motors together make fewer steps than this, pieces are joined wherever their centre
/// is, because they give no direction at all. The ends are still passed within a step.
const FEWEST: f32 = 0.5 * STEPS as f32;

/// Pieces of a smooth curve with more steps are joined while their centre is this near to the
/// joined move: the square of a share of `STEPS` of the coarsest steps. The centre is then within a
/// sixth of a step, and the sagitta within a quarter of one.
const NEAR2: f32 = 1.0 / (6 * STEPS * 6 * STEPS) as f32;

/// The last queued move, while it has too few steps to give a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Short<const AXES: usize, const MOTORS: usize> {
    motors: [Motor; MOTORS],
    /// Steps of all motors, without signs.
    steps: f32,
    pub(crate) pieces: Joined<AXES>,
}

/// A motor's part of the move.
#[derive(Clone, Copy, Debug)]
struct Motor {
    /// The steps of the motor, with sign.
    steps: i32,
    /// The smallest share in all steps for which the ends of all pieces are passed within a step.
    smallest: f32,
    /// The largest such share.
    largest: f32,
}

impl<const AXES: usize, const MOTORS: usize> Short<AXES, MOTORS> {
    /// A short move by `delta` steps with the vector `way`, mm.
    pub(crate) fn new(delta: &[i32; MOTORS], way: [f32; AXES]) -> Self {
        Self {
            pieces: Joined::new(way),
            steps: count(delta),
            motors: delta.map(|steps| Motor {
                steps,
                smallest: -1.0,
                largest: 1.0,
            }),
        }
    }

    /// This move joined with one more short piece by `delta` steps with the vector `way`, mm;
    /// `None` if one move cannot stand for both. `short2` is the square of the length of
    /// [`STEPS`] of the coarsest steps, mm².
    pub(crate) fn joined(
        &self,
        delta: &[i32; MOTORS],
        way: &[f32; AXES],
        short2: f32,
    ) -> Option<Self> {
        let mut whole = *self;
        whole.pieces = self.pieces.with(way);
        whole.steps += count(delta);
        if whole.steps >= FEWEST && !whole.pieces.are_near(NEAR2 * short2) {
            return None;
        }
        let mut motors = whole.motors.iter_mut().zip(delta);
        let joins = motors.all(|(motor, more)| motor.lengthen(*more, self.steps, whole.steps));
        joins.then_some(whole)
    }

    /// Steps of each motor, with signs.
    pub(crate) fn delta(&self) -> [i32; MOTORS] {
        self.motors.map(|motor| motor.steps)
    }

    /// Steps of the dominant motor.
    pub(crate) fn events(&self) -> u32 {
        let motors = self.motors.iter();
        motors.fold(0, |most, motor| most.max(motor.steps.unsigned_abs()))
    }
}

/// Steps of all motors, without signs.
fn count<const MOTORS: usize>(delta: &[i32; MOTORS]) -> f32 {
    delta
        .iter()
        .fold(0.0, |sum, steps| sum + (*steps as f32).abs())
}

impl Motor {
    /// Adds `more` steps of this motor. All motors made `done` steps so far, and `all` steps with
    /// the new piece. Returns whether the motor still passes the ends of all pieces within a step,
    /// and does not turn back.
    fn lengthen(&mut self, more: i32, done: f32, all: f32) -> bool {
        let end = self.steps as f32;
        self.smallest = max(self.smallest, (end - 1.0) / done);
        self.largest = min(self.largest, (end + 1.0) / done);
        let Some(steps) = self.steps.checked_add(more) else {
            return false;
        };
        let share = steps as f32 / all;
        let turns_back = i64::from(self.steps) * i64::from(more) < 0;
        self.steps = steps;
        !turns_back && share >= self.smallest && share <= self.largest
    }
}

#[cfg(test)]
mod tests {
    use crate::reference::{to, Rig, RigQueue};
    use crate::{Config, CornerRule, Curve, Feed, Move, MoveKind};
    use proptest::prelude::*;
    use std::vec::Vec;

    /// A move to a place in steps, at 250 steps/mm.
    fn at(x: i32, y: i32) -> Move<2> {
        to(f64::from(x) * 0.004, f64::from(y) * 0.004, 5.0)
    }

    /// Returns how many moves the planner makes of them.
    fn planned(config: Config<2>, pieces: &[Move<2>]) -> usize {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(config, &mut queue);
        for piece in pieces {
            rig.planner.push(piece).unwrap();
        }
        rig.planner.len()
    }

    #[test]
    fn pieces_of_three_steps_are_moves_of_thirty_three() {
        let pieces: Vec<_> = (1..=22).map(|k| at(3 * k, 0)).collect();
        assert_eq!(planned(Config::default(), &pieces), 2);
        let grbl = Config {
            corner_rule: CornerRule::Grbl,
            ..Config::default()
        };
        assert_eq!(planned(grbl, &pieces), 22);
    }

    #[test]
    fn a_step_beside_a_jagged_line_is_on_it_and_two_are_not() {
        let moves = |end| planned(Config::default(), &[at(8, 0), end]);
        assert_eq!(moves(at(9, 1)), 1);
        assert_eq!(moves(at(10, 2)), 2);
        assert_eq!(moves(at(6, 0)), 2);
        assert_eq!(moves(at(8, 8)), 2);
    }

    /// At the places at which the pieces meet, they are half a step beside the line, or an eighth.
    #[test]
    fn a_smooth_curve_stays_within_a_quarter_of_a_step() {
        let moves = |end| planned(Config::default(), &[at(8, 0), end]);
        assert_eq!(moves(at(16, 1)), 2);
        let fine = Config {
            steps_per_mm: [crate::StepsPerMm::from_nanos(1_000_000_000_000); 2],
            ..Config::default()
        };
        let places = |y| [to(0.008, 0.0, 5.0), to(0.016, y, 5.0)];
        assert_eq!(planned(fine, &places(0.0)), 1);
        assert_eq!(planned(fine, &places(0.000_25)), 1);
        assert_eq!(planned(fine, &places(0.001)), 2);
    }

    #[test]
    fn what_is_long_or_differs_in_more_than_its_place_is_a_move_of_its_own() {
        let next = at(16, 0);
        let curve = Curve {
            radius: 50.0,
            acceleration: 10.0,
        };
        for other in [
            at(40, 0),
            Move {
                feed: Feed::PerMinute(4.0),
                ..next
            },
            Move {
                feed: Feed::InverseTime(10.0),
                ..next
            },
            Move {
                kind: MoveKind::Jog,
                ..next
            },
            Move {
                line_number: Some(7),
                ..next
            },
            Move {
                curve: Some(curve),
                ..next
            },
        ] {
            let moves = planned(Config::default(), &[at(8, 0), other]);
            assert_eq!(moves, 2, "{other:?}");
        }
    }

    proptest! {
        /// The motors make each step that was asked for and no other, and come within a step of
        /// the end of each piece.
        #[test]
        fn joined_pieces_lead_by_their_ends(pieces in prop::collection::vec((-1i32..5, -1i32..5), 1..60)) {
            let mut place = [0, 0];
            let ends: Vec<[i32; 2]> = pieces.iter().map(|(x, y)| {
                place = [place[0] + x, place[1] + y];
                place
            }).collect();
            let mut queue = RigQueue::new();
            let mut rig = Rig::new(Config::default(), &mut queue);
            for [x, y] in &ends {
                rig.planner.push(&at(*x, *y)).unwrap();
            }
            let mut path = Vec::from([[0, 0]]);
            let mut steps = 0;
            while let Some(segment) = rig.segmenter.next(&mut rig.planner) {
                let mut position = rig.player.position;
                for timed in rig.player.play(&segment) {
                    for (motor, position) in position.iter_mut().enumerate() {
                        let made = i32::from(timed.tick.step.contains(motor));
                        *position += if timed.tick.direction.contains(motor) { -made } else { made };
                        steps += made;
                    }
                    path.push(position);
                }
            }
            prop_assert_eq!(rig.player.position, place);
            prop_assert_eq!(steps, pieces.iter().map(|(x, y)| x.abs() + y.abs()).sum::<i32>());
            for end in ends {
                let near = |place: &[i32; 2]| (place[0] - end[0]).abs() <= 1 && (place[1] - end[1]).abs() <= 1;
                prop_assert!(path.iter().any(near), "{:?}", end);
            }
        }
    }
}
