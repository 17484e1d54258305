//! Moves in, planned moves queued: steps, limits along the line, corners.

use crate::config::{Limits, SLOWEST};
use crate::junction::junction_v2;
use crate::lookahead::LookAhead;
use crate::moves::PlannedMove;
use crate::real::{least, most, norm2, sqrt, worst};
use crate::{Config, Feed, Kinematics, Move, MoveKind, Overrides};
use core::fmt;
use leadscrew_stepper::Line;

/// The queue of planned moves of a machine with up to `CAPACITY` of them.
///
/// All methods are for the main loop. `MOTORS` equals `AXES` for all [`Kinematics`] of this crate.
#[derive(Clone, Debug)]
pub struct Planner<K, const AXES: usize, const MOTORS: usize, const CAPACITY: usize> {
    config: Config<AXES>,
    limits: Limits<AXES>,
    kinematics: K,
    overrides: Overrides,
    queue: LookAhead<MOTORS, CAPACITY>,
    /// Where the last queued move ends, steps.
    position: [i32; MOTORS],
    /// Direction and nominal speed (mm/s) at the end of the last queued move.
    last: Option<([f32; AXES], f32)>,
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

/// Share of the true braking capacity that the look-ahead counts on: leaves room for the rounding of
/// ramps in `f32` (a few 2⁻²⁴), so that no ramp is steeper than allowed.
const GAIN_MARGIN: f32 = 1.0 - 1.0 / (1 << 20) as f32;

impl<K, const AXES: usize, const MOTORS: usize, const CAPACITY: usize>
    Planner<K, AXES, MOTORS, CAPACITY>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Makes an empty planner at position 0.
    pub fn new(config: Config<AXES>, kinematics: K) -> Self {
        const { assert!(AXES == MOTORS, "motor m has the steps/mm of axis m") };
        Self {
            limits: Limits::new(&config),
            config,
            kinematics,
            overrides: Overrides::default(),
            queue: LookAhead::new(),
            position: [0; MOTORS],
            last: None,
            revision: 0,
        }
    }

    /// Takes over new settings. At rest with an empty queue only; the position in steps stays.
    pub fn configure(&mut self, config: Config<AXES>) {
        self.limits = Limits::new(&config);
        self.config = config;
        self.last = None;
    }

    /// The settings in force.
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
        if !self.has_room() {
            return Err(PushError::Full);
        }
        let target = self.target_steps(of).ok_or(PushError::TooFar)?;
        let delta = difference(&target, &self.position).ok_or(PushError::TooFar)?;
        if delta == [0; MOTORS] {
            return Ok(Pushed::TooShort);
        }
        Line::new(delta).map_err(|_| PushError::TooFar)?;
        let (planned, direction) = self.plan(of, delta);
        let nominal = self.nominal(&planned);
        let gain = 2.0 * planned.acceleration * planned.length * GAIN_MARGIN;
        let gain = self.limits.unit.units(gain);
        self.queue
            .push(planned, gain)
            .map_err(|_| PushError::Full)?;
        self.position = target;
        self.last = Some((direction, nominal));
        Ok(Pushed::Queued)
    }

    /// Whether one more move can be queued.
    pub fn has_room(&self) -> bool {
        self.room() > 0
    }

    /// How many more moves can be queued.
    pub fn room(&self) -> usize {
        self.capacity().saturating_sub(self.len())
    }

    /// How many moves the queue holds at most: `Config::moves`, the planner's size at most.
    pub fn capacity(&self) -> usize {
        self.config.moves.min(CAPACITY)
    }

    /// How many moves are queued, the running one included.
    pub fn len(&self) -> usize {
        self.queue.len()
    }

    /// Whether no move is queued and none runs.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where the last queued move ends, in steps of each motor.
    pub const fn position(&self) -> [i32; MOTORS] {
        self.position
    }

    /// Says where the motors stand. At rest with an empty queue only.
    pub fn set_position(&mut self, steps: [i32; MOTORS]) {
        self.position = steps;
        self.last = None;
    }

    /// The overrides in force.
    pub const fn overrides(&self) -> Overrides {
        self.overrides
    }

    /// Changes the overrides and plans all queued moves anew: linear in their number.
    ///
    /// The running move follows at the next [`crate::Segmenter::next`].
    pub fn set_overrides(&mut self, overrides: Overrides) {
        if overrides == self.overrides {
            return;
        }
        self.overrides = overrides;
        let unit = self.limits.unit;
        let mut last = None;
        self.queue.set_caps(|before, planned| {
            let nominal = nominal(overrides, planned);
            last = Some(nominal);
            let limit = before.map_or(nominal, |before| self::nominal(overrides, before));
            let slower = least(nominal, limit);
            planned.corner.min(unit.units(slower * slower))
        });
        if let (Some((_, speed)), Some(nominal)) = (&mut self.last, last) {
            *speed = nominal;
        }
        self.revision = self.revision.wrapping_add(1);
    }

    /// Forgets everything that is queued: after a reset or a jog cancel, at rest.
    ///
    /// The position remains the end of the forgotten queue: follow with [`Planner::set_position`] and
    /// [`crate::Segmenter::abandon`].
    pub fn clear(&mut self) {
        self.queue.clear();
        self.last = None;
    }

    pub(crate) fn start_next(&mut self) -> Option<&PlannedMove<MOTORS>> {
        self.queue.start_next()
    }

    pub(crate) fn finish(&mut self) {
        self.queue.finish();
    }

    /// What the running move's profile depends on, besides the move.
    pub(crate) fn outlook(&self) -> Outlook {
        let exit = self.queue.exit_limit();
        Outlook {
            exit,
            revision: self.revision,
        }
    }

    /// Squared speed in mm²/s² of an exit limit.
    pub(crate) fn exit_v2(&self, outlook: Outlook) -> f32 {
        self.limits.unit.v2(outlook.exit)
    }

    /// Nominal speed of the running move, mm/s.
    pub(crate) fn running_nominal(&self) -> f32 {
        self.queue
            .running()
            .map_or(SLOWEST, |planned| self.nominal(planned))
    }

    fn target_steps(&self, of: &Move<AXES>) -> Option<[i32; MOTORS]> {
        let motors = self.kinematics.motors(&of.target);
        let mut steps = [0; MOTORS];
        for ((steps, motor), scale) in steps.iter_mut().zip(motors).zip(self.config.steps_per_mm) {
            *steps = scale.steps(motor)?;
        }
        Some(steps)
    }

    /// Finds length, direction and limits of the move by `delta` steps.
    fn plan(&self, of: &Move<AXES>, delta: [i32; MOTORS]) -> (PlannedMove<MOTORS>, [f32; AXES]) {
        let mut motors_mm = [0.0; MOTORS];
        for ((mm, steps), mm_per_step) in
            motors_mm.iter_mut().zip(delta).zip(self.limits.mm_per_step)
        {
            *mm = steps as f32 * mm_per_step;
        }
        let axes_mm = self.kinematics.axes_mm(&motors_mm);
        let length = sqrt(norm2(&axes_mm));
        let direction = axes_mm.map(|mm| mm / length);
        let mut planned = PlannedMove::new(of, delta);
        planned.length = length;
        planned.acceleration = 1.0 / worst(&direction, &self.limits.per_acceleration);
        let rate = 1.0 / worst(&direction, &self.limits.per_rate);
        planned.rate = of.speed_limit.map_or(rate, |limit| least(rate, limit));
        planned.feed = match of.feed {
            Feed::Rapid => planned.rate,
            Feed::PerMinute(speed) => speed,
            Feed::InverseTime(per_second) => per_second * length,
        };
        (planned.corner, planned.cap) = self.corner(&planned, &direction);
        (planned, direction)
    }

    /// The limits at the start of a move: by the corner alone, and by both nominal speeds as well.
    fn corner(&self, planned: &PlannedMove<MOTORS>, direction: &[f32; AXES]) -> (u32, u32) {
        let Some((before, speed)) = &self.last else {
            return (0, 0);
        };
        let slower = least(*speed, self.nominal(planned));
        let unit = self.limits.unit;
        let corner = unit.units(junction_v2(before, direction, &self.limits));
        (corner, corner.min(unit.units(slower * slower)))
    }

    fn nominal(&self, planned: &PlannedMove<MOTORS>) -> f32 {
        nominal(self.overrides, planned)
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

/// The speed that a move runs at where nothing else limits it, mm/s.
fn nominal<const MOTORS: usize>(overrides: Overrides, planned: &PlannedMove<MOTORS>) -> f32 {
    let percent = match planned.kind {
        MoveKind::Rapid => overrides.rapid,
        MoveKind::Feed => overrides.feed,
        MoveKind::Jog | MoveKind::System => 100,
    };
    let asked = if percent == 100 {
        planned.feed
    } else {
        planned.feed * f32::from(percent) * 0.01
    };
    most(least(planned.rate, asked), SLOWEST)
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
