//! Queues moves as planned moves: steps, limits along the move, corners.

mod append;
mod backlog;
mod one_move;
mod overrides;
#[cfg(test)]
mod tests;

pub(crate) use one_move::nominal;

use crate::ahead::lookahead::LookAhead;
use crate::ahead::queue::{Lent, PixelQueue, Room};
use crate::built::{CURVES, RASTERS};
use crate::config::{Limits, Scales, SpeedUnit};
use crate::ease::Ease;
use crate::emit::pixel::{Pixel, Pixels};
use crate::moves::PlannedMove;
use crate::path::row::Row;
use crate::path::short::Short;
use crate::real::{min, sqrt};
use crate::space::axis_limits::{AxisLimits, Course, Whereabouts};
use crate::{Config, ConfigError, Coordinate, CornerRule, Kinematics, Move, MoveError, Overrides};
use backlog::Backlog;
use core::fmt;
use leadscrew_stepper::{Line, LineError};

/// Plans the moves of a machine in a [`crate::Queue`] that it borrows.
///
/// Moves of a laser that go straight on and differ only in power are planned as one move; their
/// changes of power wait in the queue's pool of pixels.
///
/// All methods are for the main loop. There are at least as many motors as axes.
#[derive(Debug)]
pub struct Planner<'q, K, const AXES: usize, const MOTORS: usize> {
    config: Config<AXES>,
    limits: Limits<AXES>,
    scales: Scales<MOTORS>,
    kinematics: K,
    overrides: Overrides,
    queue: LookAhead<'q, AXES, MOTORS>,
    /// The end of the last queued move, steps.
    position: [i32; MOTORS],
    /// For each motor its place and its steps at the target of the last `push`. In most moves some
    /// motor does not move, and its steps need not be computed again.
    target: [(Coordinate, i32); MOTORS],
    /// Direction at the end of the last queued move, for Grbl's rule.
    last: Option<[f32; AXES]>,
    /// The nominal speed of the last planned move, mm/s.
    nominal_before: Option<f32>,
    /// The last queued move, while further moves may be merged into it.
    row: Option<Row<MOTORS>>,
    /// The last queued move, while it is so short that the next one may be joined with it.
    short: Option<Short<AXES, MOTORS>>,
    pixels: Pixels<'q>,
    backlog: Backlog,
    /// The end of the path, and the moves there whose curvature is not known yet.
    window: Lent<'q, AXES>,
    /// Counts changes after which the running move's profile is out of date.
    revision: u32,
}

/// The result of queueing a move.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Pushed {
    /// It is queued.
    Queued,
    /// It has become the next change of power in the row that was queued last.
    Merged,
    /// It is less than a step long: there is nothing to do.
    TooShort,
}

/// The reason why a move was not queued; nothing has changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PushError {
    /// The queue is full: try again once a move has ended.
    Full,
    /// The target is beyond ±2³¹ steps, or the move has more than
    /// [`MAX_STEP_EVENTS`](leadscrew_stepper::MAX_STEP_EVENTS).
    TooFar,
    /// [`Move::validate`] refuses it.
    Invalid(MoveError),
}

impl fmt::Display for PushError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Full => "the planner's queue is full",
            Self::TooFar => "the target is too many steps away",
            Self::Invalid(error) => return error.fmt(f),
        })
    }
}

impl core::error::Error for PushError {}

impl<'q, K, const AXES: usize, const MOTORS: usize> Planner<'q, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Makes a planner at position 0. The old contents of `queue` are forgotten.
    ///
    /// # Errors
    /// [`Config::validate`] refuses the settings.
    pub fn new<const PIXELS: usize>(
        config: Config<AXES>,
        kinematics: K,
        queue: impl Into<Room<'q, AXES, MOTORS>>,
        pixels: &'q mut PixelQueue<PIXELS>,
    ) -> Result<Self, ConfigError> {
        const { assert!(AXES <= MOTORS, "an axis has a motor of its own") };
        config.validate()?;
        let Room {
            moves,
            blocks,
            window,
        } = queue.into();
        let mut planner = Self {
            limits: Limits::new(&config),
            scales: Scales::new(&config, &kinematics),
            backlog: Backlog::new(&config),
            config,
            kinematics,
            overrides: Overrides::default(),
            queue: LookAhead::new(moves, blocks),
            pixels: Pixels::new(pixels.0.as_mut_view()),
            position: [0; MOTORS],
            target: [(Coordinate::ZERO, 0); MOTORS],
            last: None,
            nominal_before: None,
            row: None,
            short: None,
            window,
            revision: 0,
        };
        planner.fit_room();
        planner.forget_direction();
        Ok(planner)
    }

    /// Takes over new settings. At rest with an empty queue only; the position in steps stays.
    ///
    /// # Errors
    /// [`Config::validate`] refuses the settings; those in force stay.
    pub fn configure(&mut self, config: Config<AXES>) -> Result<(), ConfigError> {
        config.validate()?;
        self.limits = Limits::new(&config);
        self.scales = Scales::new(&config, &self.kinematics);
        self.target = [(Coordinate::ZERO, 0); MOTORS];
        self.backlog = Backlog::new(&config);
        self.config = config;
        self.fit_room();
        self.forget_direction();
        Ok(())
    }

    fn fit_room(&mut self) {
        self.config.moves = self.config.moves.min(self.queue.capacity());
        self.config.pixels = match RASTERS {
            true => self.config.pixels.min(self.pixels.capacity()),
            false => 0,
        };
        if !CURVES {
            self.config.corner_rule = CornerRule::Grbl;
        }
    }

    /// Returns the settings in force. Their numbers of moves and pixels are at most the queue's
    /// room.
    pub const fn config(&self) -> &Config<AXES> {
        &self.config
    }

    /// Returns the map between axes and motors.
    pub const fn kinematics(&self) -> &K {
        &self.kinematics
    }

    /// Queues a straight move from the end of the queue to `of.target`.
    ///
    /// # Errors
    /// [`PushError`]; nothing has changed then.
    pub fn push(&mut self, of: &Move<AXES>) -> Result<Pushed, PushError> {
        of.validate().map_err(PushError::Invalid)?;
        self.renew();
        if !self.has_room() {
            return Err(PushError::Full);
        }
        let target = self.approach(&of.target).ok_or(PushError::TooFar)?;
        let delta = difference(&target, &self.position).ok_or(PushError::TooFar)?;
        let line = match Line::new(delta) {
            Ok(line) => line,
            Err(LineError::NoSteps) => return Ok(Pushed::TooShort),
            Err(LineError::TooLong) => return Err(PushError::TooFar),
        };
        let merged = self.merge(of, delta).is_some();
        if !merged {
            self.append(of, delta, line.step_events().get());
        }
        self.position = target;
        Ok(if merged {
            Pushed::Merged
        } else {
            Pushed::Queued
        })
    }

    /// Returns true if one more move can be queued. For a moment after a change of overrides no
    /// move can, see [`Planner::renew`].
    pub fn has_room(&self) -> bool {
        let free = self.pixels.len() < self.pixel_capacity().max(1);
        free && self.len() < self.capacity() && !self.queue.is_renewing()
    }

    /// Returns how many more moves can be queued. If the room for pixels is scarcer, this is the
    /// free share of the pixels, as a number of moves: 0 if no pixel fits, all if nothing is
    /// queued.
    pub fn room(&self) -> usize {
        let (all, capacity) = (self.capacity(), self.pixel_capacity().max(1));
        let free = capacity.saturating_sub(self.pixels.len());
        let free = (all * free).div_ceil(capacity);
        free.min(all.saturating_sub(self.len()))
    }

    /// Returns the most moves that the queue holds: `Config::moves`, or the queue's room if that is
    /// less.
    pub const fn capacity(&self) -> usize {
        self.config.moves
    }

    /// The most changes of power that queued moves hold together.
    const fn pixel_capacity(&self) -> usize {
        self.config.pixels
    }

    /// Returns how many moves are queued, the running one included.
    pub fn len(&self) -> usize {
        self.queue.len()
    }

    /// Returns true if no move is queued and none runs.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Forgets everything that is queued: after a reset or a jog cancel, at rest.
    ///
    /// The position remains the end of the forgotten queue: follow with [`Planner::set_position`]
    /// and [`crate::Segmenter::abandon`].
    pub fn clear(&mut self) {
        self.queue.clear();
        self.pixels.clear();
        self.backlog = Backlog::new(&self.config);
        self.forget_direction();
    }

    /// Makes the next move begin at rest.
    fn forget_direction(&mut self) {
        self.last = None;
        self.nominal_before = None;
        self.row = None;
        self.short = None;
        if let Some(window) = self.window.get_mut() {
            window.forget();
        }
    }

    pub(crate) const fn queue(&self) -> &LookAhead<'q, AXES, MOTORS> {
        &self.queue
    }

    /// The queue, and the limits that the axes leave to its moves.
    pub(crate) fn parts(
        &mut self,
    ) -> (
        &mut LookAhead<'q, AXES, MOTORS>,
        AxisLimits<'_, K, AXES, MOTORS>,
    ) {
        let (scales, kinematics) = (&self.scales, &self.kinematics);
        let axis_limits = AxisLimits::new(self.overrides, &self.limits, scales, kinematics);
        (&mut self.queue, axis_limits)
    }

    pub(crate) fn axis_limits(&self) -> AxisLimits<'_, K, AXES, MOTORS> {
        AxisLimits::new(self.overrides, &self.limits, &self.scales, &self.kinematics)
    }

    pub(crate) fn start_next(&mut self) -> Option<&PlannedMove<AXES, MOTORS>> {
        if self.queue.waiting() == 0 && self.queue.is_unplanned() {
            self.plan_one();
        }
        self.queue.start_next();
        self.note_started();
        self.queue.running()
    }

    /// Returns true if the rest at the end of the planned moves bounds the speed: one more move
    /// would then make it higher.
    pub(crate) fn is_bound_by_end(&self) -> bool {
        self.queue.is_bound_by_end()
    }

    pub(crate) fn finish(&mut self) {
        self.queue.finish();
    }

    /// The average over the plan, if the jerk is limited.
    pub(crate) fn ease(&self) -> Option<Ease> {
        self.limits.ease().copied()
    }

    /// Returns true if the jerk is limited.
    pub(crate) const fn is_eased(&self) -> bool {
        self.limits.ease().is_some()
    }

    /// The move whose segments come next, if the plan has begun it.
    pub(crate) fn front(&self) -> Option<&PlannedMove<AXES, MOTORS>> {
        self.queue.front()
    }

    /// Notes that the plan has come to the end of the running move.
    pub(crate) fn pass(&mut self) {
        self.queue.pass();
    }

    /// Removes the first move, all of whose segments are made.
    pub(crate) fn retire(&mut self) {
        self.queue.retire();
    }

    /// Takes out the next change of power of the running move, if one is left.
    pub(crate) fn take_pixel(&mut self) -> Option<Pixel> {
        self.pixels.pop()
    }

    /// The values that the running move's profile depends on, besides the move. If the running move
    /// would soon slow down because later moves wait for their curvature, some of these are planned
    /// now. `at` answers the state of the running move.
    pub(crate) fn outlook(&mut self, at: impl FnOnce() -> Whereabouts) -> Outlook {
        self.find();
        if self.needs_more() && self.too_many_wait() && self.slows_down_soon(at()) {
            self.plan_some();
            self.find();
        }
        Outlook {
            exit: self.queue.exit_limit(),
            revision: self.revision,
        }
    }

    /// Plans some of the moves that wait. With a jerk limit a move depends on many others, so that
    /// it takes long.
    fn plan_some(&mut self) {
        /// The most moves that are planned in one call.
        const MOST: usize = 4;
        if self.is_eased() {
            return self.plan_one_eased(1);
        }
        for _ in 0..MOST {
            if self.too_many_wait() {
                self.plan_one();
            }
        }
    }

    /// Returns true if one more planned move might make the running move faster.
    fn needs_more(&self) -> bool {
        self.is_bound_by_end()
    }

    /// Returns true if the running move would be too fast for the speed at its end if it went on
    /// for one more segment, of `way` mm, with its full acceleration.
    fn slows_down_soon(&self, at: Whereabouts) -> bool {
        let Some(running) = self.queue.running() else {
            return true;
        };
        let (a, seconds) = (running.acceleration, self.config.longest_segment);
        let left = at.steps_to(0) / running.steps_per_mm();
        let way = min(left, (sqrt(at.v2) + a * seconds) * seconds);
        let exit_v2 = self.limits.unit.v2(self.queue.exit_limit());
        // v² + 2·a·way > exit² + 2·a·(left − way)
        at.v2 - exit_v2 > 2.0 * a * (left - 2.0 * way)
    }

    /// Returns true if too many moves wait until the turn at their start is known, compared with
    /// the number of planned moves.
    fn too_many_wait(&self) -> bool {
        /// The least number of planned moves for each move that waits.
        const FEW: usize = 64;
        /// The least number if a corner is at the start of the first move that waits: a move that
        /// is planned too early there stays slow.
        const FEW_BEFORE_CORNER: usize = 8;
        if self.limits.ease().is_some() {
            return self.queue.is_unplanned();
        }
        self.window.get().is_some_and(|window| {
            let few = if window.waits_at_corner() {
                FEW_BEFORE_CORNER
            } else {
                FEW
            };
            window.waiting() > self.queue.waiting() / few
        })
    }

    fn find(&mut self) {
        let (queue, axis_limits) = self.parts();
        queue.find(&axis_limits);
    }

    /// The limits for the rest of the running move; `None` if no move runs.
    pub(crate) fn course(&self, at: Whereabouts, outlook: Outlook) -> Option<Course> {
        let exit_v2 = self.limits.unit.v2(outlook.exit);
        let (running, next) = (self.queue.running()?, self.queue.next());
        if self.limits.ease().is_some() {
            let (path, index) = (self.queue.path(), self.queue.at());
            return self.axis_limits().eased_course(&path, index, at, exit_v2);
        }
        Some(self.axis_limits().course(running, next, at, exit_v2))
    }

    /// The unit of squared speeds.
    pub(crate) const fn unit(&self) -> SpeedUnit {
        self.limits.unit
    }

    /// The limit at the corner at the running move's end, squared, mm²/s².
    pub(crate) fn corner_v2(&self) -> f32 {
        let next = self.queue.next();
        self.limits.unit.v2(next.map_or(0, |next| next.corner))
    }
}

/// The values that the running move's profile depends on, besides the move.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Outlook {
    /// Squared speed at which the move may end, in units of [`SpeedUnit`].
    pub(crate) exit: u32,
    /// A number that changes whenever nominal speeds change.
    pub(crate) revision: u32,
}

fn difference<const MOTORS: usize>(
    to: &[i32; MOTORS],
    from: &[i32; MOTORS],
) -> Option<[i32; MOTORS]> {
    let mut delta = *to;
    for (delta, from) in delta.iter_mut().zip(from) {
        *delta = delta.checked_sub(*from)?;
    }
    Some(delta)
}
