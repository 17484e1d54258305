//! The profile of the running move: to its end, or to the shortest stop.

use super::{Aim, Goal, Running, Timing};
use crate::fit::bits;
use crate::profile::{Plan, ROUNDING};
use crate::real::{divide_twice, least, most, sqrt};
use crate::{Profile, SCurve};

impl<const MOTORS: usize> Running<MOTORS> {
    /// Makes the profile from here on.
    pub(crate) fn plan(&mut self, aim: Aim, timing: Timing) {
        let entry_v2 = self.profile.speed_v2(self.done);
        let (end, cruise, exit_v2) = match aim.goal {
            Goal::End => self.to_end(aim),
            Goal::Stop => self.stop(entry_v2, aim),
        };
        let plan = Plan {
            start: self.done,
            end,
            entry_v2,
            cruise,
            exit_v2,
            acceleration: self.acceleration,
        };
        self.profile = Profile::new(&plan, aim.jerk * self.steps_per_mm, &self.profile);
        let (interval, rest) = divide_twice(timing.hz, self.profile.cruise());
        self.cruise_interval = bits(interval).saturating_add_signed(if rest < 0.0 {
            -(bits(-rest) as i64)
        } else {
            bits(rest) as i64
        });
    }

    /// End, cruise speed and squared exit speed on the way to the end of the move.
    ///
    /// What braking from a high speed gets to is only as exact as the high speed; the plan's exit speed is exact and
    /// has the last word: else the difference would add up from move to move.
    ///
    /// Where an override asks for less than can be reached any more, the corner has it: it was planned for.
    fn to_end(&self, aim: Aim) -> (u32, f32, f32) {
        let per_mm = self.steps_per_mm;
        let [exit_v2, corner_v2] = [aim.exit_v2, aim.corner_v2].map(|v2| v2 * per_mm * per_mm);
        let entry_v2 = self.profile.speed_v2(self.done);
        let left = (self.events - self.done) as f32;
        let slowest = entry_v2 - 2.0 * self.acceleration * left;
        let missed = aim.jerk <= 0.0 && slowest - exit_v2 > ROUNDING * entry_v2;
        let exit_v2 = if missed { slowest } else { exit_v2 };
        (self.events, aim.nominal * per_mm, least(exit_v2, corner_v2))
    }

    /// End, cruise speed and squared exit speed of the shortest stop on a whole step.
    ///
    /// A single step is made as fast as can be: at a speed near 0 it would take for ever.
    fn stop(&self, entry_v2: f32, aim: Aim) -> (u32, f32, f32) {
        let steps = self.stop_steps(entry_v2, aim.jerk).max(1);
        let left = self.events - self.done;
        if steps > left && aim.exit_v2 > 0.0 {
            let (end, _, exit_v2) = self.to_end(aim);
            let slowest = most(entry_v2 - 2.0 * self.acceleration * left as f32, 0.0);
            return (end, sqrt(entry_v2), least(exit_v2, slowest));
        }
        let fastest = if steps == 1 {
            aim.nominal * self.steps_per_mm
        } else {
            sqrt(entry_v2)
        };
        (self.done + steps.min(left), fastest, 0.0)
    }

    /// Whole steps of the shortest stop.
    fn stop_steps(&self, entry_v2: f32, jerk: f32) -> u32 {
        const ROUNDING: f32 = 1e-6;
        let jerk = jerk * self.steps_per_mm;
        if jerk > 0.0 {
            let (speed, acceleration) = self.profile.motion(self.done);
            return SCurve::stop(speed, acceleration, self.acceleration, jerk);
        }
        let whole = entry_v2 / (2.0 * self.acceleration) * (1.0 - ROUNDING);
        (whole as u32).saturating_add(u32::from(whole > (whole as u32) as f32))
    }
}
