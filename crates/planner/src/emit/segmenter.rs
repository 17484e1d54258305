//! Planned moves in, step segments out; feed hold and resume.
//!
//! ```text
//!             hold                    rest reached
//!    Going ----------> Stopping ------------------> Held
//!      ^ \__ at rest ______|________________________^ |
//!      |      resume       |                          |
//!      +-------------------+--------------------------+
//! ```
//!
//! Each call hands out a segment of at most `Config::longest_segment`; a step event that takes
//! longer is handed out in spans. Before each segment the planner is asked again how fast the
//! running move may end (the queue may have grown) and whether nominal speeds have changed
//! (overrides). If an answer has changed, the profile is made anew from the place and the speed
//! reached. So every change takes effect after the segments handed out.

use crate::emit::fit::Carry;
use crate::emit::running::{Aim, Goal, Running, Timing};
use crate::planner::Outlook;
use crate::real::{min, sqrt};
use crate::{Kinematics, Place, Planner, Profile};
use leadscrew_stepper::Segment;

/// Turns the planner's moves into segments for the step interrupt. Main loop.
#[derive(Clone, Debug)]
pub struct Segmenter<const AXES: usize, const MOTORS: usize> {
    running: Option<Running<MOTORS>>,
    mode: Mode,
    /// Squared speed at the end of the last move, mm²/s²: the next move begins with it.
    exit_v2: f32,
    carry: Carry,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum Mode {
    /// Motion as planned.
    #[default]
    Going,
    /// A feed hold slows down.
    Stopping,
    /// A feed hold has reached rest.
    Held,
}

impl Mode {
    /// How far the running move is to go.
    const fn goal(self) -> Goal {
        match self {
            Self::Going => Goal::End,
            Self::Stopping | Self::Held => Goal::Stop,
        }
    }
}

impl<const AXES: usize, const MOTORS: usize> Default for Segmenter<AXES, MOTORS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const AXES: usize, const MOTORS: usize> Segmenter<AXES, MOTORS> {
    /// Makes a segmenter at rest.
    pub fn new() -> Self {
        Self {
            running: None,
            mode: Mode::Going,
            exit_v2: 0.0,
            carry: Carry::default(),
        }
    }

    /// Hands out the next segment: at most `Config::longest_segment` of motion.
    ///
    /// Where a move ends, takes the next one from `planner`. `None` where no move is queued, or a
    /// hold has reached rest.
    pub fn next<K>(&mut self, planner: &mut Planner<'_, K, AXES, MOTORS>) -> Option<Segment<MOTORS>>
    where
        K: Kinematics<AXES, MOTORS>,
    {
        planner.renew();
        if self.mode == Mode::Held {
            return None;
        }
        if self.running.is_none() {
            self.running = Running::new(planner.start_next()?, self.exit_v2);
        }
        // A reference: to move it out and back in would cost a copy for each segment.
        let running = self.running.as_mut()?;
        running.begin_pixel(|| planner.take_pixel());
        let timing = Timing::new(planner.config());
        let outlook = planner.outlook(|| running.whereabouts());
        if running.outlook != Some(outlook) && running.may_change() {
            running.plan(aim(self.mode.goal(), planner, running, outlook)?, timing);
            running.outlook = Some(outlook);
        }
        let segment = running.segment(timing, &mut self.carry, self.mode.goal());
        if running.at_profile_end() {
            self.end_profile(planner);
        }
        Some(segment)
    }

    /// Begins a feed hold: from the end of the segments handed out, the shortest stop on the path
    /// that acceleration allows.
    ///
    /// The stop ends on a whole step. Where the running move is too short, it ends in a later move.
    /// [`Segmenter::is_held`] tells when it has ended.
    pub fn hold(&mut self) {
        if self.mode == Mode::Going {
            self.mode = if self.is_moving() {
                Mode::Stopping
            } else {
                Mode::Held
            };
            self.plan_anew();
        }
    }

    /// Goes on after a feed hold. A hold that has not reached rest yet is broken off.
    pub fn resume(&mut self) {
        self.mode = Mode::Going;
        self.plan_anew();
    }

    /// Whether a feed hold has reached rest (at the end of the segments handed out).
    pub fn is_held(&self) -> bool {
        self.mode == Mode::Held
    }

    /// Whether no move is under way. (More may be queued.)
    pub fn is_idle(&self) -> bool {
        self.running.is_none()
    }

    /// Forgets the running move and any hold. Called at rest, after a reset or a jog cancel,
    /// together with [`Planner::clear`].
    pub fn abandon(&mut self) {
        *self = Self::new();
    }

    /// Makes the stepper begin the rest of the running line anew, because another line came between
    /// (parking). Called while held.
    pub fn renew_line(&mut self) {
        if let Some(running) = &mut self.running {
            running.renew_line();
        }
    }

    /// Speed along the path at the end of the segments handed out, mm/s.
    pub fn speed(&self) -> f32 {
        self.running
            .as_ref()
            .map_or_else(|| sqrt(self.exit_v2), Running::speed)
    }

    /// Seconds of the rest of the profile, the speed after it, mm/s, and the steps of the running
    /// move after it.
    pub(crate) fn rest_of_part(&self) -> (f32, f32, u32) {
        self.running
            .as_ref()
            .map_or_else(|| (0.0, sqrt(self.exit_v2), 0), Running::rest)
    }

    /// The line number of the running move.
    pub fn line_number(&self) -> Option<u32> {
        self.running.as_ref().and_then(Running::line_number)
    }

    /// The profile of the running move and the place up to which it was handed out.
    pub fn profile(&self) -> Option<(&Profile, Place)> {
        self.running
            .as_ref()
            .map(|running| (running.profile(), running.here()))
    }

    /// Whether the segments handed out end with a whole step event.
    #[cfg(test)]
    pub(crate) fn at_step(&self) -> bool {
        self.running.as_ref().is_none_or(Running::at_step)
    }

    /// Whether motion has a speed at the end of the segments handed out.
    fn is_moving(&self) -> bool {
        self.speed() > 0.0
    }

    /// The next segment makes the profile anew.
    fn plan_anew(&mut self) {
        if let Some(running) = &mut self.running {
            running.outlook = None;
        }
    }

    /// All steps of the profile have been handed out: the move is over, or a hold has stopped in
    /// it.
    fn end_profile<K>(&mut self, planner: &mut Planner<'_, K, AXES, MOTORS>)
    where
        K: Kinematics<AXES, MOTORS>,
    {
        let Some(running) = &mut self.running else {
            return;
        };
        self.exit_v2 = running.exit_v2();
        if self.mode == Mode::Stopping && self.exit_v2 <= 0.0 {
            self.mode = Mode::Held;
        }
        if running.at_end() {
            self.running = None;
            planner.finish();
        } else {
            running.outlook = None;
        }
    }
}

/// The next task of the running move.
fn aim<K, const AXES: usize, const MOTORS: usize>(
    goal: Goal,
    planner: &Planner<'_, K, AXES, MOTORS>,
    running: &Running<MOTORS>,
    outlook: Outlook,
) -> Option<Aim>
where
    K: Kinematics<AXES, MOTORS>,
{
    let course = planner.course(running.whereabouts(), outlook)?;
    Some(Aim {
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
        jerk: planner.config().jerk,
    })
}

#[cfg(test)]
mod tests;
