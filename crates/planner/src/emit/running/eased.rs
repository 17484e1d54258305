//! The running move under a jerk limit: its ramps may go on in later moves.

use super::{round_up, Goal, Running};
use crate::ahead::waypoints::{Waypoint, Waypoints};
use crate::real::{max, sqrt};
use crate::space::axis_limits::Whereabouts;
use crate::speed::plan::Plan;
use crate::speed::ramp::half_a_step;
use crate::{Kinematics, Planner, Profile, SCurve};

impl<const MOTORS: usize> Running<MOTORS> {
    /// Acceleration along the path here, mm/s².
    #[cfg(test)]
    pub(crate) fn acceleration(&self) -> f32 {
        self.profile.motion(self.here).1 / self.steps_per_mm
    }

    /// The profile from here on: to a waypoint, or the shortest stop. Where neither can be reached,
    /// the profile in force.
    pub(crate) fn eased<K, const AXES: usize>(
        &self,
        goal: Goal,
        planner: &Planner<'_, K, AXES, MOTORS>,
    ) -> Profile
    where
        K: Kinematics<AXES, MOTORS>,
    {
        let jerk = planner.config().jerk * self.steps_per_mm;
        let curve = match goal {
            Goal::End => None,
            Goal::Stop => self.eased_stop(planner, jerk),
        };
        let curve = curve.or_else(|| self.to_waypoint(planner, jerk));
        curve.map_or(self.profile, Profile::SCurve)
    }

    /// The profile to a waypoint.
    ///
    /// After an override the nominal speeds ahead may be lower than can be reached, or so high that
    /// less acceleration is left. Then motion goes on no faster than now.
    fn to_waypoint<K, const AXES: usize>(
        &self,
        planner: &Planner<'_, K, AXES, MOTORS>,
        jerk: f32,
    ) -> Option<SCurve>
    where
        K: Kinematics<AXES, MOTORS>,
    {
        let at = self.at_top(jerk);
        self.fastest_of(&planner.waypoints(at, None), jerk)
            .or_else(|| self.fastest_of(&planner.waypoints(at, Some(sqrt(at.v2))), jerk))
    }

    /// The profile to the first waypoint whose speed can be reached; or to the first waypoint of
    /// all, at a lower speed there, if the move ends faster with it.
    fn fastest_of(&self, ahead: &Waypoints, jerk: f32) -> Option<SCurve> {
        /// The room that waypoints leave below a limit.
        const OVER: f32 = 1.0001;
        let (_, under_way) = self.profile.motion(self.here);
        let mut best: Option<SCurve> = None;
        for (index, to) in ahead.iter().enumerate() {
            let plan = self.plan_to(to);
            let reached = SCurve::reaches(&plan, under_way, jerk);
            if !reached && index > 0 {
                continue;
            }
            let most = max(to.limit * self.steps_per_mm, plan.cruise) * OVER;
            let curve = SCurve::new(&plan, under_way, jerk).filter(|curve| curve.fastest() <= most);
            let faster = |curve: &SCurve| best.is_none_or(|best| best.exit_v2() < curve.exit_v2());
            if let Some(curve) = curve.filter(faster) {
                best = Some(curve);
            }
            if reached && curve.is_some() {
                break;
            }
        }
        best
    }

    /// The place of motion, with the highest speed of a stop that begins there.
    fn at_top(&self, jerk: f32) -> Whereabouts {
        let (speed, under_way) = self.profile.motion(self.here);
        let top = (speed + 0.5 * max(under_way, 0.0) * under_way / jerk) / self.steps_per_mm;
        Whereabouts {
            v2: top * top,
            ..self.whereabouts()
        }
    }

    /// The plan to a waypoint.
    fn plan_to(&self, to: &Waypoint) -> Plan {
        /// A waypoint at the move's end is known to much less than this, steps.
        const SAME: f32 = 0.01;
        let per_mm = self.steps_per_mm;
        let beyond = to.way * per_mm - self.here.before(self.events);
        let exit = to.speed * per_mm;
        Plan {
            beyond: if beyond > SAME { beyond } else { 0.0 },
            cruise: to.fastest * per_mm,
            exit_v2: exit * exit,
            ..self.plan_from_here(to.acceleration * per_mm)
        }
    }

    /// The shortest stop. It ends on a whole step. Its length is rounded up to the whole step.
    ///
    /// A stop within a single step is made as fast as possible: at a speed near 0 the step would
    /// never end.
    fn eased_stop<K, const AXES: usize>(
        &self,
        planner: &Planner<'_, K, AXES, MOTORS>,
        jerk: f32,
    ) -> Option<SCurve>
    where
        K: Kinematics<AXES, MOTORS>,
    {
        let per_mm = self.steps_per_mm;
        let (speed, under_way) = self.profile.motion(self.here);
        let at = self.at_top(jerk);
        let ahead = planner.waypoints(at, Some(sqrt(at.v2)));
        let (acceleration, steps) = ahead.iter().find_map(|to| {
            let acceleration = to.acceleration * per_mm;
            let steps = SCurve::stop(speed, under_way, acceleration, jerk);
            (steps <= to.way * per_mm).then_some((acceleration, steps))
        })?;
        let left = self.here.before(self.events);
        let whole = round_up(steps + self.here.part()).max(1);
        let plan = Plan {
            end: (self.here.step() + whole).min(self.events),
            beyond: max(steps - left, 0.0),
            cruise: max(speed, half_a_step(jerk)),
            exit_v2: 0.0,
            ..self.plan_from_here(acceleration)
        };
        SCurve::new(&plan, under_way, jerk)
    }

    /// A plan to the end of the move.
    fn plan_from_here(&self, acceleration: f32) -> Plan {
        let (speed, _) = self.profile.motion(self.here);
        Plan {
            start: self.here,
            end: self.events,
            beyond: 0.0,
            entry_v2: speed * speed,
            cruise: speed,
            exit_v2: 0.0,
            up: acceleration,
            down: acceleration,
        }
    }
}
