//! The places ahead that bound the speed under a jerk limit.
//!
//! A ramp takes the acceleration from 0 back to 0, and may span many moves. It ends at a
//! *waypoint*: a place where motion has to be slower than at any place before it, or has to rest.
//!
//! ```text
//!   limit ____        _______       ____
//!             |______|       |_____|    |      each place where the limit falls below all limits
//!                                       |      before it is a waypoint
//!   ----------1--------------2----------3
//! ```
//!
//! From each waypoint on, motion that begins with no acceleration reaches the next one in time. So
//! motion that can reach any waypoint keeps all later limits.

use crate::moves::PlannedMove;
use crate::real::{min, sqrt};
use crate::space::axis_limits::Whereabouts;
use crate::speed::ramp::{length, Limits};
use crate::speed::s_curve::furthest;
use crate::{Kinematics, Planner};
use heapless::Vec;

/// A place ahead. Units: mm, mm/s, mm/s².
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Waypoint {
    /// The way to it from the place of motion.
    pub(crate) way: f32,
    /// The speed there, with no acceleration.
    pub(crate) speed: f32,
    /// The speed on the way, by nominal speeds too.
    pub(crate) fastest: f32,
    /// The limit of the speed on the way by corners, curvature and rates alone.
    pub(crate) limit: f32,
    /// The acceleration on the way.
    pub(crate) acceleration: f32,
}

/// The waypoints, the nearest first. If there are more, motion has to be able to rest at the last.
pub(crate) type Waypoints = Vec<Waypoint, 8>;

/// How many moves are looked at. Motion has to be able to rest at the end of the last. Each takes
/// some 250 instructions of the F407 in one `Machine::poll`.
pub(crate) const MOVES: usize = 40;

/// The share of a limit that is used. The rest is for rounding.
const ROOM: f32 = 1.0 - 2e-4;

/// The limit of a curve changes from move to move. It is rounded down to four bits, which takes 6 %
/// off the speed at most, so that few places become waypoints.
fn coarse(v2: f32) -> f32 {
    f32::from_bits(v2.to_bits() & !0x000f_ffff)
}

impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// The waypoints from the place `at` in the running move on. `nominal` (mm/s) takes the place
    /// of the nominal speeds of all moves.
    ///
    /// The acceleration that a curve leaves for ramps depends on the speed. So the speed is followed
    /// from `at` on: with the acceleration left so far, motion reaches each place at `reached_v2`.
    pub(crate) fn waypoints(&self, at: Whereabouts, nominal: Option<f32>) -> Waypoints {
        let (axis_limits, queue) = (self.axis_limits(), self.queue());
        let mut found = Waypoints::new();
        let mut here = Waypoint {
            way: 0.0,
            speed: 0.0,
            fastest: nominal.unwrap_or_else(|| self.running_nominal()),
            limit: f32::INFINITY,
            acceleration: f32::INFINITY,
        };
        let mut reached_v2 = at.v2;
        let mut before: Option<&PlannedMove<AXES, MOTORS>> = None;
        for index in 0..MOVES {
            let Some(planned) = queue.planned(index) else {
                break;
            };
            let nominal = nominal.unwrap_or_else(|| self.nominal(planned));
            let top = min(min(here.fastest, nominal), planned.rate);
            let border = axis_limits.border(
                before.unwrap_or(planned),
                planned,
                min(top * top, reached_v2),
            );
            let limit = match before {
                Some(_) => sqrt(min(coarse(border.curve_v2), border.corner_v2) * ROOM),
                None => f32::INFINITY,
            };
            let slower = min(top, limit);
            here.acceleration = min(here.acceleration, border.left[0]);
            let waypoint = Waypoint {
                speed: slower,
                ..here
            };
            if before.is_some() && slower < here.fastest && found.push(waypoint).is_err() {
                break;
            }
            here.fastest = slower;
            here.limit = min(here.limit, min(limit, planned.rate));
            here.acceleration = min(here.acceleration, border.left[1]);
            let length = match before {
                None => at.steps_to(0) / planned.steps_per_mm(),
                Some(_) => planned.length,
            };
            here.way += length;
            reached_v2 = min(reached_v2, slower * slower) + 2.0 * here.acceleration * length;
            before = Some(planned);
        }
        if found.push(here).is_err() {
            if let Some(last) = found.last_mut() {
                last.speed = 0.0;
            }
        }
        self.bound(&mut found);
        found
    }

    /// Lowers the speed at each waypoint so that the next one can be reached.
    fn bound(&self, waypoints: &mut Waypoints) {
        let jerk = self.config().jerk;
        let mut next: Option<Waypoint> = None;
        for of in waypoints.iter_mut().rev() {
            if let Some(next) = next {
                let limits = Limits {
                    acceleration: next.acceleration,
                    jerk,
                };
                let fits = |speed| length(speed, next.speed, limits) <= next.way - of.way;
                if !fits(of.speed) {
                    of.speed = furthest(next.speed, of.speed, &fits);
                }
            }
            next = Some(*of);
        }
    }
}
