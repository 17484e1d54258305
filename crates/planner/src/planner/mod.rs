//! Moves in, planned moves queued: steps, limits along the line, corners.

mod append;
mod backlog;
mod join;
mod one_move;
mod overrides;
mod position;
#[cfg(test)]
mod tests;

use crate::config::{Limits, Scales};
use crate::lookahead::LookAhead;
use crate::moves::PlannedMove;
use crate::pixel::{Pixel, Pixels};
use crate::queue::{PixelQueue, Queue};
use crate::row::Row;
use crate::short::Short;
use crate::strokes::Strokes;
use crate::{Config, ConfigError, Coordinate, Kinematics, Move, Overrides};
use backlog::Backlog;
use core::fmt;
use leadscrew_stepper::{Line, LineError};

/// Plans the moves of a machine in a [`Queue`] that it borrows.
///
/// Moves of a laser that go straight on and differ in power are planned as one; their changes of power wait in the queue's pool
/// of pixels.
///
/// All methods are for the main loop. There are at least as many motors as axes.
#[derive(Debug)]
pub struct Planner<'q, K, const AXES: usize, const MOTORS: usize> {
    config: Config<AXES>,
    limits: Limits<AXES>,
    scales: Scales<MOTORS>,
    kinematics: K,
    overrides: Overrides,
    queue: LookAhead<'q, MOTORS>,
    /// Where the last queued move ends, steps.
    position: [i32; MOTORS],
    /// The target of the last `push`, by motors, and its steps: most moves leave some motor where it is.
    target: [(Coordinate, i32); MOTORS],
    /// Direction and nominal speed (mm/s) at the end of the last queued move.
    last: Option<([f32; AXES], f32)>,
    /// The last queued move, if more may be merged into it.
    row: Option<Row<MOTORS>>,
    /// The last queued move, if it is a few steps long, for the next one to be joined to it.
    short: Option<Short<MOTORS>>,
    pixels: Pixels<'q>,
    backlog: Backlog,
    /// Corners and curves at the end of the queue.
    strokes: Strokes<AXES>,
    /// Squared speed, mm²/s², with which the running move is planned to end: what follows must be able to go on from it.
    committed_v2: f32,
    /// Counts changes after which the running move's profile is out of date.
    revision: u32,
}

/// What became of a move.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Pushed {
    /// It is queued.
    Queued,
    /// It is not a step long: there is nothing to do.
    TooShort,
}

/// Why a move was not queued; nothing has changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PushError {
    /// The queue is full: try again once a move has ended.
    Full,
    /// The target is beyond ±2³¹ steps, or the move has more than
    /// [`MAX_STEP_EVENTS`](leadscrew_stepper::MAX_STEP_EVENTS).
    TooFar,
}

impl fmt::Display for PushError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Full => "the planner's queue is full",
            Self::TooFar => "the target is too many steps away",
        })
    }
}

impl core::error::Error for PushError {}

impl<'q, K, const AXES: usize, const MOTORS: usize> Planner<'q, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Makes a planner at position 0. What was in `queue` is forgotten.
    ///
    /// # Errors
    /// [`Config::validate`] refuses the settings.
    pub fn new<const MOVES: usize, const PIXELS: usize>(
        config: Config<AXES>,
        kinematics: K,
        queue: &'q mut Queue<MOTORS, MOVES>,
        pixels: &'q mut PixelQueue<PIXELS>,
    ) -> Result<Self, ConfigError> {
        const { assert!(AXES <= MOTORS, "an axis has a motor of its own") };
        config.validate()?;
        let mut planner = Self {
            limits: Limits::new(&config),
            scales: Scales::new(&config, &kinematics),
            backlog: Backlog::new(&config),
            config,
            kinematics,
            overrides: Overrides::default(),
            queue: LookAhead::new(queue.moves.as_mut_view(), &mut queue.candidates),
            pixels: Pixels::new(pixels.0.as_mut_view()),
            position: [0; MOTORS],
            target: [(Coordinate::ZERO, 0); MOTORS],
            last: None,
            row: None,
            short: None,
            strokes: Strokes::new(),
            committed_v2: 0.0,
            revision: 0,
        };
        planner.fit_room();
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
        self.config.pixels = self.config.pixels.min(self.pixels.capacity());
    }

    /// The settings in force: no more moves and pixels than there is room for.
    pub const fn config(&self) -> &Config<AXES> {
        &self.config
    }

    /// The map between axes and motors.
    pub const fn kinematics(&self) -> &K {
        &self.kinematics
    }

    /// Queues a straight move from the end of the queue to `of.target`.
    ///
    /// # Errors
    /// [`PushError`]; nothing has changed then.
    pub fn push(&mut self, of: &Move<AXES>) -> Result<Pushed, PushError> {
        if self.is_renewing() {
            self.renew();
        }
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
        let (moves, newest) = (self.len(), self.newest_micros());
        if self.merge(of, delta).is_none() {
            self.append(of, delta, line.step_events().get());
        }
        self.note_newest(moves, newest);
        self.position = target;
        Ok(Pushed::Queued)
    }

    /// Whether one more move can be queued. Not for a moment after a change of overrides, see [`Planner::renew`].
    pub fn has_room(&self) -> bool {
        let free = self.pixels.len() < self.pixel_capacity().max(1);
        free && self.len() < self.capacity() && !self.queue.is_renewing()
    }

    /// How many more moves can be queued, as if pixels took room of theirs in proportion: 0 where there is no room, all where
    /// nothing is queued, fewer the more lines are.
    pub fn room(&self) -> usize {
        let (all, capacity) = (self.capacity(), self.pixel_capacity().max(1));
        let free = capacity.saturating_sub(self.pixels.len());
        let free = (all * free).div_ceil(capacity);
        free.min(all.saturating_sub(self.len()))
    }

    /// How many moves the queue holds at most: `Config::moves`, the planner's size at most.
    pub const fn capacity(&self) -> usize {
        self.config.moves
    }

    /// How many changes of power queued moves hold at most.
    const fn pixel_capacity(&self) -> usize {
        self.config.pixels
    }

    /// How many moves are queued, the running one included.
    pub fn len(&self) -> usize {
        self.queue.len()
    }

    /// Whether no move is queued and none runs.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Forgets everything that is queued: after a reset or a jog cancel, at rest.
    ///
    /// The position remains the end of the forgotten queue: follow with [`Planner::set_position`] and
    /// [`crate::Segmenter::abandon`].
    pub fn clear(&mut self) {
        self.queue.clear();
        self.pixels.clear();
        self.backlog = Backlog::new(&self.config);
        self.forget_direction();
    }

    /// The next move begins at rest.
    #[inline(never)]
    fn forget_direction(&mut self) {
        self.last = None;
        self.row = None;
        self.short = None;
        self.strokes = Strokes::new();
        self.committed_v2 = 0.0;
    }

    pub(crate) const fn queue(&self) -> &LookAhead<'q, MOTORS> {
        &self.queue
    }

    pub(crate) fn start_next(&mut self) -> Option<&PlannedMove<MOTORS>> {
        self.queue.start_next();
        self.note_started();
        self.queue.running()
    }

    /// Notes how fast the running move is planned to end, mm²/s².
    pub(crate) fn commit(&mut self, exit_v2: f32) {
        self.committed_v2 = exit_v2;
    }

    pub(crate) fn finish(&mut self) {
        self.queue.finish();
    }

    /// The next change of power, where the running move has one left.
    pub(crate) fn take_pixel(&mut self) -> Option<Pixel> {
        self.pixels.pop()
    }

    /// What the running move's profile depends on, besides the move.
    pub(crate) fn outlook(&self) -> Outlook {
        let exit = self.queue.exit_limit();
        Outlook {
            exit,
            revision: self.revision,
        }
    }

    /// Squared speed in mm²/s² of `units`.
    pub(crate) fn v2(&self, units: u32) -> f32 {
        self.limits.unit.v2(units)
    }

    /// Squared speed in mm²/s² of an exit limit.
    pub(crate) fn exit_v2(&self, outlook: Outlook) -> f32 {
        self.limits.unit.v2(outlook.exit)
    }

    /// Limit of the corner at the running move's end, squared, mm²/s².
    pub(crate) fn corner_v2(&self) -> f32 {
        let next = self.queue.next();
        self.limits.unit.v2(next.map_or(0, |next| next.corner))
    }
}

/// What the running move's profile depends on, besides the move.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Outlook {
    /// Squared speed at which the move may end, speed units.
    pub(crate) exit: u32,
    /// Changes whenever nominal speeds do.
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
