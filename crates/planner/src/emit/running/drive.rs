//! A move under way: its place in steps, and its profile.
//!
//! The plan drives through the moves. Without a jerk limit the segments follow at once; with one
//! they follow the mean of the plan's last places.

use crate::moves::PlannedMove;
use crate::planner::Outlook;
use crate::real::{max, min, sqrt};
use crate::space::axis_limits::{Course, Whereabouts};
use crate::speed::plan::{Place, Plan};
use crate::speed::profile::ROUNDING;
use crate::{Kinematics, Planner, Trapezoid};

/// A place in a planned move. The profile from there on is kept beside it.
#[derive(Clone, Debug)]
pub(crate) struct Drive {
    /// Steps of the dominant motor in the whole move.
    pub(crate) events: u32,
    /// Steps of the dominant motor per mm of path.
    pub(super) steps_per_mm: f32,
    /// Acceleration along the path if the path is straight, steps/s².
    pub(super) acceleration: f32,
    /// The place that is reached.
    pub(crate) here: Place,
    /// The outlook that the profile was made from.
    pub(crate) outlook: Option<Outlook>,
}

impl Drive {
    /// The start of `planned`, which has `events` steps of the dominant motor.
    pub(crate) fn new<const AXES: usize, const MOTORS: usize>(
        planned: &PlannedMove<AXES, MOTORS>,
        events: u32,
    ) -> Self {
        let steps_per_mm = events as f32 / planned.length;
        Self {
            events,
            steps_per_mm,
            acceleration: planned.acceleration * steps_per_mm,
            here: Place::at(0),
            outlook: None,
        }
    }

    /// A profile of the whole move, from the squared speed `entry_v2` (mm²/s²) to rest, with the
    /// speed `rate` (mm/s).
    pub(crate) fn begun(&self, rate: f32, entry_v2: f32) -> Trapezoid {
        Trapezoid::new(&Plan {
            start: Place::at(0),
            end: self.events,
            entry_v2: entry_v2 * self.steps_per_mm * self.steps_per_mm,
            cruise: rate * self.steps_per_mm,
            exit_v2: 0.0,
            up: self.acceleration,
            down: self.acceleration,
        })
    }

    /// Speed and remaining length, for the planner.
    pub(crate) fn whereabouts(&self, profile: &Trapezoid) -> Whereabouts {
        Whereabouts {
            v2: profile.speed_v2_at(self.here) / (self.steps_per_mm * self.steps_per_mm),
            steps: self.events - self.here.step(),
            way: self.here.part(),
            at_start: self.at_start(),
        }
    }

    /// Returns true if the move has not begun.
    fn at_start(&self) -> bool {
        self.here == Place::at(0)
    }

    /// Returns true if the end of the move is reached.
    pub(crate) fn at_end(&self) -> bool {
        self.here.step() >= self.events
    }

    /// A squared speed in mm²/s², from steps²/s².
    pub(crate) fn mm2(&self, v2: f32) -> f32 {
        v2 / (self.steps_per_mm * self.steps_per_mm)
    }

    /// The way from the move's start, in a unit of which the move has `length`; a step has
    /// `per_step`, in units of 2⁻³², rounded down.
    pub(crate) fn way(&self, length: u64, per_step: u64) -> u64 {
        if self.at_end() {
            return length;
        }
        let way = u128::from(self.here.units()) * u128::from(per_step);
        (way >> 64) as u64
    }
}

/// The next task of the running move.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Aim {
    pub(crate) goal: Goal,
    /// Steps of the dominant motor from the end of the part of the move that runs to the move's end
    /// (see [`Course`]).
    pub(crate) steps_after: u32,
    /// Squared speed at which the part may end so that all later limits can be kept, mm²/s².
    pub(crate) exit_v2: f32,
    /// Limit of the corner at the part's end alone, squared, mm²/s².
    pub(crate) corner_v2: f32,
    /// Speed to cruise at, mm/s.
    pub(crate) nominal: f32,
    /// Accelerations along the path, mm/s²: while the speed rises, while it falls, and for a stop
    /// that begins at once.
    pub(crate) up: f32,
    pub(crate) down: f32,
    pub(crate) stop: f32,
    /// Steps from the end of the way on which a stop may use `stop` to the move's end.
    pub(crate) stop_after: u32,
}

impl Aim {
    /// The next task of the move that `planner` runs.
    pub(crate) fn new<K, const AXES: usize, const MOTORS: usize>(
        goal: Goal,
        planner: &Planner<'_, K, AXES, MOTORS>,
        course: &Course,
    ) -> Self
    where
        K: Kinematics<AXES, MOTORS>,
    {
        Self {
            goal,
            steps_after: course.steps_after,
            exit_v2: course.exit_v2,
            corner_v2: if course.steps_after > 0 {
                f32::INFINITY
            } else {
                planner.corner_v2()
            },
            nominal: min(planner.running_nominal(), sqrt(course.top_v2)),
            up: course.up,
            down: course.down,
            stop: course.stop,
            stop_after: if planner.is_eased() {
                course.steps_after
            } else {
                0
            },
        }
    }
}

/// The place to which motion goes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Goal {
    /// To the end of the move.
    End,
    /// To rest as soon as possible. If the move is too short for that, the stop goes on in the
    /// next move.
    Stop,
}

/// The input of a profile. Units: steps of the dominant motor, steps/s.
struct Path {
    end: u32,
    cruise: f32,
    exit_v2: f32,
    /// Accelerations, steps/s².
    up: f32,
    down: f32,
    /// The share of the accelerations that is used, above 0, at most 1. The distance becomes
    /// 1/share times as long.
    share: f32,
}

impl Drive {
    /// The profile from here on.
    ///
    /// A move may become the first one of a curve while it runs. Then the curve's acceleration
    /// across the path may leave too little for braking to the speed at its end. The profile in
    /// force stays if it ends no faster than what such braking reaches.
    pub(crate) fn planned(&self, profile: &Trapezoid, aim: Aim) -> Trapezoid {
        let entry_v2 = profile.speed_v2_at(self.here);
        let path = match aim.goal {
            Goal::End => self.to_end(entry_v2, aim),
            Goal::Stop => self.stop(entry_v2, aim),
        };
        let ends_no_faster = profile.end() == path.end && profile.exit_v2() <= path.exit_v2;
        if ends_no_faster && !self.at_start() && self.missed(entry_v2, aim).is_some() {
            return *profile;
        }
        let plan = Plan {
            start: self.here,
            end: path.end,
            entry_v2,
            cruise: path.cruise,
            exit_v2: path.exit_v2,
            up: path.up * path.share,
            down: path.down * path.share,
        };
        Trapezoid::new(&plan)
    }

    /// The way to the end of the part that runs.
    ///
    /// Braking ends at a computed speed that is only as exact as the high speed before it. The
    /// planned exit speed is exact. If the two speeds differ by no more than rounding, the
    /// planned one is used, so that rounding does not add up from move to move.
    ///
    /// An override may ask for a lower exit speed than can still be reached. Then the corner's own
    /// limit bounds the exit speed: the plan before the override kept that limit.
    fn to_end(&self, entry_v2: f32, aim: Aim) -> Path {
        let per_mm = self.steps_per_mm;
        let [exit_v2, corner_v2] = [aim.exit_v2, aim.corner_v2].map(|v2| v2 * per_mm * per_mm);
        Path {
            end: self.events - aim.steps_after,
            cruise: aim.nominal * per_mm,
            exit_v2: min(self.missed(entry_v2, aim).unwrap_or(exit_v2), corner_v2),
            up: aim.up * per_mm,
            down: aim.down * per_mm,
            share: 1.0,
        }
    }

    /// The squared speed (steps²/s²) at which braking from here on ends, if that is faster than
    /// the exit speed by more than rounding.
    fn missed(&self, entry_v2: f32, aim: Aim) -> Option<f32> {
        let per_mm = self.steps_per_mm;
        let left = self.here.before(self.events - aim.steps_after);
        let slowest = entry_v2 - 2.0 * aim.down * per_mm * left;
        let excess = slowest - aim.exit_v2 * per_mm * per_mm;
        (excess > ROUNDING * entry_v2).then_some(slowest)
    }

    /// The shortest stop that ends on a whole step. It begins at once. Its length is rounded up to
    /// the whole step, which makes the stop gentler.
    ///
    /// A stop within a single step is made as fast as possible: at a speed near 0 the step would
    /// never end.
    fn stop(&self, entry_v2: f32, aim: Aim) -> Path {
        let down = aim.stop * self.steps_per_mm;
        let left = self.events - aim.stop_after - self.here.step();
        let distance = entry_v2 / (2.0 * down) * (1.0 - 0.5 * ROUNDING);
        let steps = round_up(distance + self.here.part()).max(1);
        if steps > left && aim.exit_v2 > 0.0 {
            let path = self.to_end(entry_v2, aim);
            let slowest = entry_v2 - 2.0 * down * self.here.before(path.end);
            return Path {
                cruise: sqrt(entry_v2),
                exit_v2: min(path.exit_v2, max(slowest, 0.0)),
                down: max(path.down, down),
                ..path
            };
        }
        let stop = Path {
            end: self.here.step() + steps.min(left).max(1),
            cruise: sqrt(entry_v2),
            exit_v2: 0.0,
            up: aim.up * self.steps_per_mm,
            down,
            share: 1.0,
        };
        if steps == 1 {
            let cruise = aim.nominal * self.steps_per_mm;
            Path { cruise, ..stop }
        } else if steps > left {
            stop
        } else {
            let share = distance / self.here.before(stop.end) * (1.0 + ROUNDING);
            Path {
                share: min(share, 1.0),
                ..stop
            }
        }
    }
}

/// The next whole number of steps.
fn round_up(steps: f32) -> u32 {
    let whole = steps as u32;
    whole.saturating_add(u32::from(steps > whole as f32))
}
