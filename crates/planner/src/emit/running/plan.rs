//! The profile of the running move: to its end, or to the shortest stop.

use super::{Running, Timing};
use crate::emit::fit::bits;
use crate::real::{divide_twice, max, min, sqrt};
use crate::speed::profile::{Plan, ROUNDING};
use crate::SCurve;

/// The next task of the running move.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Aim {
    pub(crate) goal: Goal,
    /// Steps of the dominant motor from the end of the part that runs to the move's end.
    pub(crate) steps_after: u32,
    /// Squared speed at which the part may end so that all later limits can be kept, mm²/s².
    pub(crate) exit_v2: f32,
    /// Limit of the corner at the part's end alone, squared, mm²/s².
    pub(crate) corner_v2: f32,
    /// Speed to cruise at, mm/s.
    pub(crate) nominal: f32,
    /// Accelerations along the path, mm/s²: where the speed rises, where it falls, and for a stop
    /// that begins at once.
    pub(crate) up: f32,
    pub(crate) down: f32,
    pub(crate) stop: f32,
    /// Limit of the jerk along the path, mm/s³; 0 for none.
    pub(crate) jerk: f32,
}

/// How far to go.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Goal {
    /// To the end of the move.
    End,
    /// To rest as soon as possible. Where the move is too short for that, the stop goes on in the
    /// next move.
    Stop,
}

/// The input of a profile: steps of the dominant motor, steps/s.
struct Path {
    end: u32,
    cruise: f32,
    exit_v2: f32,
    /// Accelerations, steps/s².
    up: f32,
    down: f32,
    /// The share of the accelerations that is used, above 0, at most 1; of the jerk the square of
    /// this share is used. The distance becomes 1/share times as long.
    share: f32,
}

impl<const MOTORS: usize> Running<MOTORS> {
    /// Makes the profile from here on.
    pub(crate) fn plan(&mut self, aim: Aim, timing: Timing) {
        let entry_v2 = self.profile.speed_v2(self.progress.here());
        let path = match aim.goal {
            Goal::End => self.to_end(aim),
            Goal::Stop => self.stop(entry_v2, aim),
        };
        let plan = Plan {
            start: self.progress.here(),
            end: path.end,
            entry_v2,
            cruise: path.cruise,
            exit_v2: path.exit_v2,
            up: path.up * path.share,
            down: path.down * path.share,
        };
        let jerk = aim.jerk * self.steps_per_mm * path.share * path.share;
        self.profile.change(&plan, jerk);
        let (interval, rest) = divide_twice(timing.hz, self.profile.cruise());
        self.cruise_interval = bits(interval).saturating_add_signed(if rest < 0.0 {
            -(bits(-rest) as i64)
        } else {
            bits(rest) as i64
        });
    }

    /// The way to the end of the part that runs.
    ///
    /// The speed at the end of braking is only as exact as the high speed before it. The planned
    /// exit speed is exact. It is used where the two differ by no more than rounding; otherwise the
    /// difference would add up from move to move.
    ///
    /// Where an override asks for a lower speed than can still be reached, the corner's own limit
    /// bounds the exit speed: the corner was planned for it.
    #[inline(never)] // twice: in firmware it is not worth a copy
    fn to_end(&self, aim: Aim) -> Path {
        let per_mm = self.steps_per_mm;
        let [exit_v2, corner_v2] = [aim.exit_v2, aim.corner_v2].map(|v2| v2 * per_mm * per_mm);
        let entry_v2 = self.profile.speed_v2(self.progress.here());
        let end = self.events - aim.steps_after;
        let left = self.progress.here().before(end);
        let down = aim.down * per_mm;
        let slowest = entry_v2 - 2.0 * down * left;
        let missed = aim.jerk <= 0.0 && slowest - exit_v2 > ROUNDING * entry_v2;
        let exit_v2 = if missed { slowest } else { exit_v2 };
        Path {
            end,
            cruise: aim.nominal * per_mm,
            exit_v2: min(exit_v2, corner_v2),
            up: aim.up * per_mm,
            down,
            share: 1.0,
        }
    }

    /// The shortest stop that ends on a whole step. It begins at once. Its length is rounded up to
    /// the whole step, which makes the stop gentler.
    ///
    /// A stop within a single step is made as fast as possible: at a speed near 0 the step would
    /// take without end.
    fn stop(&self, entry_v2: f32, aim: Aim) -> Path {
        let (distance, left) = (
            self.stop_distance(entry_v2, aim),
            self.events - self.progress.done,
        );
        let down = aim.stop * self.steps_per_mm;
        let steps = round_up(distance + self.progress.way).max(1);
        if steps > left && aim.exit_v2 > 0.0 {
            let path = self.to_end(aim);
            let slowest = entry_v2 - 2.0 * down * self.progress.here().before(path.end);
            return Path {
                cruise: sqrt(entry_v2),
                exit_v2: min(path.exit_v2, max(slowest, 0.0)),
                down: max(path.down, down),
                ..path
            };
        }
        let stop = Path {
            end: self.progress.done + steps.min(left),
            cruise: sqrt(entry_v2),
            exit_v2: 0.0,
            up: aim.up * self.steps_per_mm,
            down,
            share: 1.0,
        };
        let (_, changing) = self.profile.motion(self.progress.here());
        if steps == 1 {
            let cruise = aim.nominal * self.steps_per_mm;
            Path { cruise, ..stop }
        } else if steps > left || changing != 0.0 {
            stop
        } else {
            let share = distance / (steps as f32 - self.progress.way) * (1.0 + ROUNDING);
            Path {
                share: min(share, 1.0),
                ..stop
            }
        }
    }

    /// The length of the shortest stop, steps; in general not a whole number.
    fn stop_distance(&self, entry_v2: f32, aim: Aim) -> f32 {
        let [jerk, down] = [aim.jerk, aim.stop].map(|per_mm| per_mm * self.steps_per_mm);
        if jerk > 0.0 {
            let (speed, acceleration) = self.profile.motion(self.progress.here());
            return SCurve::stop(speed, acceleration, down, jerk);
        }
        entry_v2 / (2.0 * down) * (1.0 - 0.5 * ROUNDING)
    }
}

/// The next whole number of steps.
fn round_up(steps: f32) -> u32 {
    let whole = steps as u32;
    whole.saturating_add(u32::from(steps > whole as f32))
}
