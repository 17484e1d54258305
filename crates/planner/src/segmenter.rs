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
//! Each call hands out at most 1 ms of motion (one step event where an interval is longer). Before it does, it asks the planner
//! again how fast the running move may end (the queue may have grown) and whether speeds have changed (overrides); where
//! something has, the profile is made anew from the step and speed reached. So with two segments in the step queue
//! everything takes effect within 2 ms.

use crate::fit::Carry;
use crate::planner::Outlook;
use crate::real::sqrt;
use crate::running::{Aim, Running, Timing};
use crate::{Kinematics, Planner, Trapezoid};
use leadscrew_stepper::Segment;

/// Turns the planner's moves into segments for the step interrupt. Main loop.
#[derive(Clone, Debug)]
pub struct Segmenter<const AXES: usize, const MOTORS: usize> {
    running: Option<Running<MOTORS>>,
    mode: Mode,
    /// Squared speed at the end of the last move, mm²/s²: the next one begins with it.
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

    /// Hands out the next segment: at most 1 ms of motion, or one step event where that is longer.
    ///
    /// Takes the next move from `planner` where one ends. `None` where nothing is queued, or a hold has reached rest.
    pub fn next<K, const CAPACITY: usize>(
        &mut self,
        planner: &mut Planner<K, AXES, MOTORS, CAPACITY>,
    ) -> Option<Segment<MOTORS>>
    where
        K: Kinematics<AXES, MOTORS>,
    {
        if self.mode == Mode::Held {
            return None;
        }
        let mut running = match self.running.take() {
            Some(running) => running,
            None => Running::new(planner.start_next()?, self.exit_v2)?,
        };
        let timing = Timing::new(planner.config());
        let outlook = planner.outlook();
        if running.outlook != Some(outlook) {
            running.plan(self.aim(planner, outlook), timing);
            running.outlook = Some(outlook);
        }
        let stopping = self.mode == Mode::Stopping;
        let segment = running.segment(timing, &mut self.carry, stopping);
        if running.at_profile_end() {
            self.end_profile(running, planner);
        } else {
            self.running = Some(running);
        }
        Some(segment)
    }

    /// Begins a feed hold: from the end of what was handed out, the shortest stop on the path that acceleration allows.
    ///
    /// It ends on a whole step; where the running move is too short, in a later one. [`Segmenter::is_held`] tells when.
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

    /// Goes on after a feed hold, or breaks one off that has not reached rest.
    pub fn resume(&mut self) {
        self.mode = Mode::Going;
        self.plan_anew();
    }

    /// Whether a feed hold has reached rest (at the end of what was handed out).
    pub fn is_held(&self) -> bool {
        self.mode == Mode::Held
    }

    /// Whether no move is under way. (More may be queued.)
    pub fn is_idle(&self) -> bool {
        self.running.is_none()
    }

    /// Forgets the running move and any hold: after a reset or a jog cancel, at rest, together with [`Planner::clear`].
    pub fn abandon(&mut self) {
        *self = Self::new();
    }

    /// Has the stepper begin the rest of the running line anew, because another line came between (parking). While held.
    pub fn renew_line(&mut self) {
        if let Some(running) = &mut self.running {
            running.renew_line();
        }
    }

    /// Speed along the path at the end of what was handed out, mm/s.
    pub fn speed(&self) -> f32 {
        self.running
            .as_ref()
            .map_or_else(|| sqrt(self.exit_v2), Running::speed)
    }

    /// The line number of the running move.
    pub fn line_number(&self) -> Option<u32> {
        self.running
            .as_ref()
            .and_then(|running| running.line_number)
    }

    /// The profile of the running move and the step of its dominant motor up to which it was handed out.
    pub fn profile(&self) -> Option<(&Trapezoid, u32)> {
        self.running
            .as_ref()
            .map(|running| (running.profile(), running.done()))
    }

    fn is_moving(&self) -> bool {
        self.speed() > 0.0
    }

    fn plan_anew(&mut self) {
        if let Some(running) = &mut self.running {
            running.outlook = None;
        }
    }

    fn aim<K, const CAPACITY: usize>(
        &self,
        planner: &Planner<K, AXES, MOTORS, CAPACITY>,
        outlook: Outlook,
    ) -> Aim
    where
        K: Kinematics<AXES, MOTORS>,
    {
        let nominal = planner.running_nominal();
        match self.mode {
            Mode::Going => Aim::End {
                exit_v2: planner.exit_v2(outlook),
                nominal,
            },
            Mode::Stopping | Mode::Held => Aim::Stop {
                last: outlook.exit == 0,
                nominal,
            },
        }
    }

    /// All steps of the profile have been handed out: the move is over, or a hold has stopped in it.
    fn end_profile<K, const CAPACITY: usize>(
        &mut self,
        running: Running<MOTORS>,
        planner: &mut Planner<K, AXES, MOTORS, CAPACITY>,
    ) where
        K: Kinematics<AXES, MOTORS>,
    {
        self.exit_v2 = running.exit_v2();
        if self.mode == Mode::Stopping && self.exit_v2 <= 0.0 {
            self.mode = Mode::Held;
        }
        if running.at_end() {
            planner.finish();
        } else {
            self.running = Some(running);
        }
    }
}
