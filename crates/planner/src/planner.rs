//! Moves in, planned moves queued: steps, limits along the line, corners.

use crate::config::{Limits, Scales, SpeedUnit, PIXELS_A_SECOND, SLOWEST};
use crate::curve::Bend;
use crate::junction::junction_v2;
use crate::lookahead::LookAhead;
use crate::moves::PlannedMove;
use crate::pixel::{Pixel, Pixels};
use crate::queue::Queue;
use crate::ramp;
use crate::real::{least, most, norm2, sqrt, worst};
use crate::row::{is_gap, is_short, Row};
use crate::strokes::{Bound, Piece, Strokes};
use crate::{Config, Coordinate, CornerRule, Feed, Kinematics, Move, MoveKind, Overrides};
use core::fmt;
use leadscrew_stepper::Line;

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
    pixels: Pixels<'q>,
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

/// Share of the true braking capacity that the look-ahead counts on: leaves room for the rounding of
/// ramps in `f32` (a few 2⁻²⁴), so that no ramp is steeper than allowed.
const GAIN_MARGIN: f32 = 1.0 - 1.0 / (1 << 20) as f32;

impl<'q, K, const AXES: usize, const MOTORS: usize> Planner<'q, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Makes a planner at position 0. What was in `queue` is forgotten.
    pub fn new<const MOVES: usize, const PIXELS: usize>(
        config: Config<AXES>,
        kinematics: K,
        queue: &'q mut Queue<MOTORS, MOVES, PIXELS>,
    ) -> Self {
        const { assert!(AXES <= MOTORS, "an axis has a motor of its own") };
        Self {
            limits: Limits::new(&config),
            scales: Scales::new(&config, &kinematics),
            config,
            kinematics,
            overrides: Overrides::default(),
            queue: LookAhead::new(queue.moves.as_mut_view(), &mut queue.candidates),
            pixels: Pixels::new(queue.pixels.as_mut_view()),
            position: [0; MOTORS],
            target: [(Coordinate::ZERO, 0); MOTORS],
            last: None,
            row: None,
            strokes: Strokes::new(),
            committed_v2: 0.0,
            revision: 0,
        }
    }

    /// Takes over new settings. At rest with an empty queue only; the position in steps stays.
    pub fn configure(&mut self, config: Config<AXES>) {
        self.limits = Limits::new(&config);
        self.scales = Scales::new(&config, &self.kinematics);
        self.target = [(Coordinate::ZERO, 0); MOTORS];
        self.config = config;
        self.forget_direction();
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
        self.renew();
        if !self.has_room() {
            return Err(PushError::Full);
        }
        let target = self.approach(&of.target).ok_or(PushError::TooFar)?;
        let delta = difference(&target, &self.position).ok_or(PushError::TooFar)?;
        if delta == [0; MOTORS] {
            return Ok(Pushed::TooShort);
        }
        Line::new(delta).map_err(|_| PushError::TooFar)?;
        if self.merge(of, delta).is_none() {
            self.append(of, delta)?;
        }
        self.position = target;
        Ok(Pushed::Queued)
    }

    /// Queues a move of its own.
    fn append(&mut self, of: &Move<AXES>, delta: [i32; MOTORS]) -> Result<(), PushError> {
        let (planned, direction) = self.plan(of, delta);
        match self.config.corner_rule {
            CornerRule::Grbl => {
                let corner_v2 = self.last.map_or(0.0, |(before, _)| {
                    junction_v2(&before, &direction, &self.limits)
                });
                self.enqueue(planned, direction, corner_v2);
            }
            CornerRule::Limits => self.queue_in_stroke(planned, direction, of.curve.is_some()),
        }
        let rows = self.pixel_capacity() > 0;
        self.row = Row::begin(of, delta).filter(|_| rows);
        Ok(())
    }

    /// Makes a move part of the last queued one, where that goes straight on and differs in power only. `None`, and nothing has
    /// changed, where it is to be a move of its own.
    fn merge(&mut self, of: &Move<AXES>, delta: [i32; MOTORS]) -> Option<()> {
        let (row, pixel) = self.row.as_ref()?.extended(of, delta)?;
        let shorter = *self.queue.last_waiting()?;
        let mut longer = PlannedMove {
            delta: row.delta(),
            length: sqrt(norm2(&self.axes_mm(row.delta()))),
            pixels: shorter.pixels.checked_add(1)?,
            has_gaps: shorter.has_gaps || is_gap(of),
            ..shorter
        };
        let nominal = self.nominal(&longer);
        let gap = longer.length - shorter.length;
        let slower = nominal < self.nominal(&shorter);
        if is_gap(of) && (slower || !is_short(gap, nominal, longer.acceleration)) {
            return None;
        }
        if let (CornerRule::Limits, Some((direction, _))) = (self.config.corner_rule, self.last) {
            self.straighten(&mut longer, &direction, gap);
        }
        self.queue.lengthen_last(longer, self.gain(&longer));
        self.pixels.push(pixel);
        self.row = Some(row);
        Some(())
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
    pub fn capacity(&self) -> usize {
        self.config.moves.min(self.queue.capacity())
    }

    /// How many changes of power queued moves hold at most.
    fn pixel_capacity(&self) -> usize {
        self.config.pixels.min(self.pixels.capacity())
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
        self.forget_direction();
    }

    /// As [`Planner::steps_at`], for motors that are not where they were the last time only.
    fn approach(&mut self, axes: &[Coordinate; AXES]) -> Option<[i32; MOTORS]> {
        let motors = self.kinematics.motors(axes).into_iter();
        let scales = motors.zip(self.scales.steps_per_mm);
        for (known, (motor, scale)) in self.target.iter_mut().zip(scales) {
            if known.0 != motor {
                *known = (motor, scale.steps(motor)?);
            }
        }
        Some(self.target.map(|(_, steps)| steps))
    }

    /// Where the motors stand, in steps, where the axes stand at `axes`; `None` beyond `i32`.
    pub fn steps_at(&self, axes: &[Coordinate; AXES]) -> Option<[i32; MOTORS]> {
        let motors = self.kinematics.motors(axes);
        let mut steps = [0; MOTORS];
        for ((steps, motor), scale) in steps.iter_mut().zip(motors).zip(self.scales.steps_per_mm) {
            *steps = scale.steps(motor)?;
        }
        Some(steps)
    }

    /// Where the axes stand where the motors stand at `steps`. Not for the path of a line: 128-bit divisions.
    pub fn axes_at(&self, steps: &[i32; MOTORS]) -> [Coordinate; AXES] {
        let mut motors = [Coordinate::ZERO; MOTORS];
        for ((motor, steps), scale) in motors.iter_mut().zip(steps).zip(self.scales.steps_per_mm) {
            *motor = scale.coordinate(*steps);
        }
        self.kinematics.axes(&motors)
    }

    /// `steps` with every motor beyond the axes put where the motor of its axis is: what their counts have to be
    /// before a move, since it brings both to the same one.
    pub fn ganged(&self, steps: [i32; MOTORS]) -> [i32; MOTORS] {
        let mut ganged = steps;
        for (motor, place) in ganged.iter_mut().enumerate().skip(AXES) {
            *place = steps
                .get(self.kinematics.axis_of(motor))
                .copied()
                .unwrap_or(*place);
        }
        ganged
    }

    /// The overrides in force.
    pub const fn overrides(&self) -> Overrides {
        self.overrides
    }

    /// Changes the overrides and begins to plan the queued moves anew, the first ones first.
    ///
    /// The running move follows at the next [`crate::Segmenter::next`]; the others with [`Planner::renew`].
    pub fn set_overrides(&mut self, overrides: Overrides) {
        if overrides == self.overrides {
            return;
        }
        self.overrides = overrides;
        self.queue.begin_renewal();
        self.renew();
        self.revision = self.revision.wrapping_add(1);
    }

    /// Whether a change of overrides has not reached all queued moves yet.
    pub const fn is_renewing(&self) -> bool {
        self.queue.is_renewing()
    }

    /// Plans a few more of the queued moves for a change of overrides; returns whether more of them are left.
    ///
    /// All limits are kept meanwhile; the moves that are left are planned for the speed asked for before the change.
    /// No move can be queued until it is over: at most 64 calls for 1024 moves. [`Planner::push`] and
    /// [`crate::Segmenter::next`] call it too. Bounded: 16 moves, since a `Machine::poll` may call it for
    /// each segment that it makes.
    pub fn renew(&mut self) -> bool {
        const A_CALL: usize = 16;
        if !self.queue.is_renewing() {
            return false;
        }
        let (overrides, unit) = (self.overrides, self.limits.unit);
        self.queue.renew(A_CALL, |before, planned| {
            let before = before.map(|before| nominal(overrides, before));
            cap(unit, before, nominal(overrides, planned), planned.corner)
        });
        let last = self.queue.newest().map(|last| nominal(overrides, last));
        if let (Some((_, speed)), Some(nominal)) = (&mut self.last, last) {
            *speed = nominal;
        }
        self.queue.is_renewing()
    }

    /// Forgets everything that is queued: after a reset or a jog cancel, at rest.
    ///
    /// The position remains the end of the forgotten queue: follow with [`Planner::set_position`] and
    /// [`crate::Segmenter::abandon`].
    pub fn clear(&mut self) {
        self.queue.clear();
        self.pixels.clear();
        self.forget_direction();
    }

    /// The next move begins at rest.
    fn forget_direction(&mut self) {
        self.last = None;
        self.row = None;
        self.strokes = Strokes::new();
        self.committed_v2 = 0.0;
    }

    pub(crate) const fn queue(&self) -> &LookAhead<'q, MOTORS> {
        &self.queue
    }

    pub(crate) fn start_next(&mut self) -> Option<&PlannedMove<MOTORS>> {
        self.queue.start_next()
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

    /// The speed that the running move is to cruise at, mm/s: its nominal one, and for a row no more than what lets its pixels be
    /// prepared in time.
    pub(crate) fn running_nominal(&self) -> f32 {
        self.queue.running().map_or(SLOWEST, |planned| {
            let nominal = self.nominal(planned);
            if planned.pixels == 0 {
                return nominal;
            }
            let pixel = planned.length / f32::from(planned.pixels);
            most(least(nominal, pixel * PIXELS_A_SECOND), SLOWEST)
        })
    }

    /// How far each axis goes where the motors make `delta` steps, mm.
    fn axes_mm(&self, delta: [i32; MOTORS]) -> [f32; AXES] {
        let mut motors_mm = [0.0; MOTORS];
        let scales = delta.into_iter().zip(self.scales.mm_per_step);
        for (mm, (steps, mm_per_step)) in motors_mm.iter_mut().zip(scales) {
            *mm = steps as f32 * mm_per_step;
        }
        self.kinematics.axes_mm(&motors_mm)
    }

    /// Finds length, direction and limits of the move by `delta` steps.
    fn plan(&self, of: &Move<AXES>, delta: [i32; MOTORS]) -> (PlannedMove<MOTORS>, [f32; AXES]) {
        let axes_mm = self.axes_mm(delta);
        let length = sqrt(norm2(&axes_mm));
        let direction = axes_mm.map(|mm| mm / length);
        let mut planned = PlannedMove::new(of, delta);
        planned.length = length;
        planned.acceleration = 1.0 / worst(&direction, &self.limits.per_acceleration);
        planned.rate = self.rate(&planned, &direction);
        planned.feed = match of.feed {
            Feed::Rapid => planned.rate,
            Feed::PerMinute(speed) => speed,
            Feed::InverseTime(per_second) => per_second * length,
        };
        if let (Some(curve), CornerRule::Limits) = (of.curve, self.config.corner_rule) {
            planned.bend(&curve.bend(planned.top_v2()));
        }
        (planned, direction)
    }

    /// The highest speed of a move by the rates of the axes and the step rate of the board, mm/s.
    fn rate(&self, planned: &PlannedMove<MOTORS>, direction: &[f32; AXES]) -> f32 {
        let steps = planned.delta.iter().map(|steps| steps.unsigned_abs()).max();
        let per_step = planned.length / steps.unwrap_or(1) as f32;
        least(
            1.0 / worst(direction, &self.limits.per_rate),
            self.limits.step_rate * per_step,
        )
    }

    /// Queues a planned move whose corner may be taken at the squared speed `corner_v2`, mm²/s². There is room.
    fn enqueue(
        &mut self,
        mut planned: PlannedMove<MOTORS>,
        direction: [f32; AXES],
        corner_v2: f32,
    ) {
        let unit = self.limits.unit;
        let before = self.last.map(|(_, speed)| speed);
        planned.corner = unit.units(corner_v2);
        let nominal = self.nominal(&planned);
        planned.cap = cap(unit, before, nominal, planned.corner);
        let _room = self.queue.push(planned, self.gain(&planned));
        self.last = Some((direction, nominal));
    }

    /// Queues a planned move by the rule that keeps the limits: corners and curves of strokes.
    fn queue_in_stroke(
        &mut self,
        mut planned: PlannedMove<MOTORS>,
        direction: [f32; AXES],
        is_chord: bool,
    ) {
        let piece = Piece {
            vector: direction.map(|u| u * planned.length),
            length: planned.length,
            top_v2: planned.top_v2(),
            is_chord,
        };
        if self.strokes.ends_before(&piece, &self.limits) {
            let corner = self.strokes.complete(false, &self.limits);
            self.lower_corner(corner, piece.top_v2);
            self.lower_curve();
            self.strokes.leave_curve();
        }
        let from_rest = self.last.is_none();
        let free = if from_rest { 0.0 } else { f32::INFINITY };
        if !self.strokes.add(&piece, &self.limits) {
            if let Some(curve) = self.strokes.open_curve() {
                planned.bend(&curve);
            }
            return self.enqueue(planned, direction, free);
        }
        let alone = piece.stands_alone(&self.limits);
        let corner = self.strokes.complete(alone, &self.limits);
        if corner.moves == 1 {
            self.enqueue(planned, direction, least(corner.limit, free));
        } else {
            self.enqueue(planned, direction, free);
            self.lower_corner(corner, piece.top_v2);
        }
        self.lower_curve();
    }

    /// The last move is longer by `more` mm. If it has outgrown any curve that it was taken for a chord of, it is freed of
    /// that.
    fn straighten(&mut self, longer: &mut PlannedMove<MOTORS>, direction: &[f32; AXES], more: f32) {
        let piece = Piece {
            vector: direction.map(|u| u * more),
            length: longer.length,
            top_v2: longer.top_v2(),
            is_chord: false,
        };
        let alone = piece.stands_alone(&self.limits);
        if alone {
            longer.acceleration = 1.0 / worst(direction, &self.limits.per_acceleration);
            longer.rate = self.rate(longer, direction);
        }
        self.strokes.lengthen_last(&piece.vector, more, alone);
    }

    fn lower_corner(&mut self, corner: Bound<f32>, top_v2: f32) {
        if corner.limit < top_v2 {
            let limit = self.limits.unit.units(corner.limit);
            self.queue.lower_last(corner.moves, |planned| {
                planned.corner = planned.corner.min(limit);
                planned.cap = planned.cap.min(limit);
                None
            });
        }
    }

    fn lower_curve(&mut self) {
        let Some(curve) = self.strokes.curve(&self.limits) else {
            return;
        };
        // Ramps that are planned to begin late must not become flatter: the running move may not be able to stop for
        // them any more.
        let committed = self.limits.unit.units(self.committed_v2);
        let ramps = if self
            .queue
            .stops_before_last(curve.moves, committed.saturating_add(1))
        {
            curve.limit.ramps
        } else {
            f32::INFINITY
        };
        let bend = Bend {
            ramps,
            ..curve.limit
        };
        self.bend_last(curve.moves, &bend);
    }

    /// Takes over the limits of a curve for the last `count` moves. Linear in `count`.
    fn bend_last(&mut self, count: usize, bend: &Bend) {
        let (unit, jerk) = (self.limits.unit, self.config.jerk);
        // What becomes of nominal speeds, and so of caps, is the same for all; rows with gaps obey the rapid override.
        let over_gaps = bend.rate * f32::from(self.overrides.rapid) * 0.01;
        let [cap, cap_of_gaps] = [bend.rate, over_gaps].map(|fastest| {
            let fastest = most(fastest, SLOWEST);
            unit.units(fastest * fastest)
        });
        self.queue.lower_last(count, |planned| {
            let most = if planned.has_gaps { cap_of_gaps } else { cap };
            planned.cap = planned.cap.min(most);
            let flatter = bend.ramps < planned.acceleration;
            planned.bend(bend);
            (flatter || jerk > 0.0).then(|| gain(unit, jerk, planned))
        });
        if let (Some((_, speed)), Some(last)) = (&mut self.last, self.queue.newest()) {
            *speed = nominal(self.overrides, last);
        }
    }

    /// What a move can brake, in speed units.
    fn gain(&self, planned: &PlannedMove<MOTORS>) -> u32 {
        gain(self.limits.unit, self.config.jerk, planned)
    }

    pub(crate) fn nominal(&self, planned: &PlannedMove<MOTORS>) -> f32 {
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

/// Limit at the start of a move by its `corner` (units), its `nominal` speed and that of the move `before` it (mm/s); squared,
/// in units.
fn cap(unit: SpeedUnit, before: Option<f32>, nominal: f32, corner: u32) -> u32 {
    let slower = before.map_or(nominal, |before| least(nominal, before));
    corner.min(unit.units(slower * slower))
}

/// What a move can brake, squared speed in units.
fn gain<const MOTORS: usize>(unit: SpeedUnit, jerk: f32, planned: &PlannedMove<MOTORS>) -> u32 {
    let acceleration = planned.acceleration;
    let gain = 2.0 * acceleration * planned.length;
    let gain = if jerk > 0.0 {
        let fastest = most(sqrt(planned.top_v2()), SLOWEST);
        let limits = ramp::Limits { acceleration, jerk };
        least(gain, ramp::braking(fastest, planned.length, limits))
    } else {
        gain
    };
    unit.units(gain * GAIN_MARGIN)
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
    let fastest = if planned.has_gaps {
        planned.rate * f32::from(overrides.rapid) * 0.01
    } else {
        planned.rate
    };
    most(least(fastest, asked), SLOWEST)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::{queue, to};
    use crate::{Cartesian, CoreXy, Curve, Ganged, MovePower, StepsPerMm, NANOS_PER_MM};
    use leadscrew_stepper::Outputs;
    use proptest::prelude::*;

    fn config() -> Config<2> {
        Config {
            max_rate: [100.0, 50.0],
            acceleration: [500.0, 200.0],
            ..Config::default()
        }
    }

    fn cartesian() -> Planner<'static, Cartesian, 2, 2> {
        Planner::new(config(), Cartesian, queue::<2, 8>())
    }

    #[test]
    fn a_move_of_less_than_half_a_step_is_nothing() {
        let mut planner = cartesian();
        assert_eq!(planner.push(&to(0.0019, 0.0, 10.0)), Ok(Pushed::TooShort));
        assert!(planner.is_empty());
        assert_eq!(planner.push(&to(0.002, 0.0, 10.0)), Ok(Pushed::Queued));
        assert_eq!(planner.position(), [1, 0]);
    }

    #[test]
    fn a_full_queue_and_a_target_out_of_reach_change_nothing() {
        let mut planner = cartesian();
        assert_eq!(planner.push(&to(9e6, 0.0, 10.0)), Err(PushError::TooFar));
        for k in 1..=8 {
            assert_eq!(
                planner.push(&to(f64::from(k), 0.0, 10.0)),
                Ok(Pushed::Queued)
            );
        }
        assert_eq!(planner.push(&to(9.0, 0.0, 10.0)), Err(PushError::Full));
        assert_eq!(planner.position(), [2000, 0]);
        planner.clear();
        assert_eq!(planner.room(), 8);
    }

    #[test]
    fn fewer_moves_than_there_is_room_for_can_be_used() {
        let mut planner = Planner::<_, 2, 2>::new(
            Config {
                moves: 2,
                ..config()
            },
            Cartesian,
            queue::<2, 8>(),
        );
        planner.push(&to(1.0, 0.0, 10.0)).unwrap();
        planner.push(&to(2.0, 0.0, 10.0)).unwrap();
        assert_eq!(planner.push(&to(3.0, 0.0, 10.0)), Err(PushError::Full));
    }

    #[test]
    fn limits_along_a_diagonal_are_those_of_the_weakest_axis() {
        let (planned, _) = cartesian().plan(&to(3.0, 4.0, 1e3), [750, 1000]);
        assert!((planned.length - 5.0).abs() < 1e-5);
        assert!((planned.rate - 62.5).abs() < 1e-3);
        assert!((planned.acceleration - 250.0).abs() < 1e-3);
    }

    #[test]
    fn limits_apply_to_axes_where_belts_cross() {
        let mut planner = Planner::<_, 2, 2>::new(config(), CoreXy, queue::<2, 8>());
        planner.push(&to(0.0, 4.0, 1e3)).unwrap();
        assert_eq!(planner.position(), [1000, -1000]);
        let running = *planner.start_next().unwrap();
        assert!((running.rate - 50.0).abs() < 1e-4);
        assert!((running.acceleration - 200.0).abs() < 1e-3);
        assert!((running.length - 4.0).abs() < 1e-5);
    }

    #[test]
    fn no_motor_steps_faster_than_the_board_where_belts_cross() {
        let config = Config {
            max_rate: [2000.0; 2],
            shortest_tick: leadscrew_stepper::Ticks(840), // 100 kHz at 84 MHz
            ..config()
        };
        let mut queue = Queue::<2, 8>::new();
        let mut planner = Planner::new(config, CoreXy, &mut queue);
        // 500 steps/mm of one motor along the diagonal, 250 along an axis.
        for (x, y, rate) in [(4.0, 4.0, 282.84), (8.0, 4.0, 400.0)] {
            planner.push(&to(x, y, 1e4)).unwrap();
            let found = planner.newest().unwrap().rate;
            assert!((found - rate).abs() < 0.01, "{found}");
        }
    }

    #[test]
    fn a_second_motor_has_the_steps_of_the_first_and_changes_no_limit() {
        let config = Config {
            steps_per_mm: [100, 80].map(|steps| StepsPerMm::from_nanos(steps * NANOS_PER_MM)),
            ..config()
        };
        let mut ganged = Planner::<_, 2, 3>::new(config, Ganged { axis_of: [1] }, queue::<3, 8>());
        let mut single = Planner::<_, 2, 2>::new(config, Cartesian, queue::<2, 8>());
        for (x, y) in [(3.0, 4.0), (-1.0, 0.3), (7.0, 7.0)] {
            ganged.push(&to(x, y, 80.0)).unwrap();
            single.push(&to(x, y, 80.0)).unwrap();
            let [x, y] = single.position();
            assert_eq!(ganged.position(), [x, y, y]);
            let (ganged, single) = (ganged.outlook(), single.outlook());
            assert_eq!(ganged, single);
        }
        let (ganged, single) = (ganged.start_next().unwrap(), single.start_next().unwrap());
        assert_eq!(ganged.length, single.length);
        assert_eq!(ganged.rate, single.rate);
        assert_eq!(ganged.acceleration, single.acceleration);
    }

    #[test]
    fn counts_of_a_second_motor_are_brought_to_those_of_the_first() {
        let planner = Planner::<_, 2, 3>::new(config(), Ganged { axis_of: [0] }, queue::<3, 8>());
        assert_eq!(planner.ganged([5, 6, 9]), [5, 6, 5]);
        assert_eq!(cartesian().ganged([5, 6]), [5, 6]);
    }

    #[test]
    fn overrides_scale_their_own_kind_only_and_never_beyond_the_rate() {
        let mut planner = cartesian();
        planner.set_overrides(Overrides {
            feed: 200,
            rapid: 25,
        });
        let nominal = |feed: f32, kind| {
            let of = Move {
                kind,
                ..to(1.0, 0.0, feed)
            };
            planner.nominal(&planner.plan(&of, [250, 0]).0)
        };
        assert_eq!(nominal(10.0, MoveKind::Feed), 20.0);
        assert!((nominal(80.0, MoveKind::Feed) - 100.0).abs() < 1e-3);
        assert_eq!(nominal(80.0, MoveKind::Rapid), 20.0);
        assert_eq!(nominal(10.0, MoveKind::Jog), 10.0);
        assert_eq!(nominal(0.0, MoveKind::System), SLOWEST);
    }

    #[test]
    fn inverse_time_is_along_the_path() {
        let planner = cartesian();
        let of = Move {
            feed: Feed::InverseTime(2.0),
            ..to(3.0, 4.0, 0.0)
        };
        let (planned, _) = planner.plan(&of, [750, 1000]);
        assert!((planned.feed - 10.0).abs() < 1e-5);
    }

    #[test]
    fn an_arc_bounds_the_speed_and_leaves_less_for_ramps_unless_grbls_rule_is_in_force() {
        let chord = |feed| Move {
            curve: Some(Curve {
                radius: 2.0,
                acceleration: 200.0,
            }),
            ..to(0.3, 0.4, feed)
        };
        let mut planner = cartesian();
        let (fast, _) = planner.plan(&chord(50.0), [75, 100]);
        assert!((fast.rate * fast.rate - 320.0).abs() < 1e-2);
        assert!((fast.acceleration - 120.0).abs() < 1e-2);
        // At 200 % the feed of 5 mm/s is 10: a pull of 50 mm/s².
        let (slow, _) = planner.plan(&chord(5.0), [75, 100]);
        assert!((slow.acceleration - 200.0 * (1.0f32 - 0.0625).sqrt()).abs() < 1e-2);
        planner.configure(Config {
            corner_rule: CornerRule::Grbl,
            ..config()
        });
        let (grbl, _) = planner.plan(&chord(50.0), [75, 100]);
        assert!((grbl.acceleration - 250.0).abs() < 1e-2);
        assert!((grbl.rate - 62.5).abs() < 1e-3);
    }

    #[test]
    fn an_override_that_is_taken_back_leaves_the_plan_as_it_was() {
        let mut planner = cartesian();
        for k in 1..8 {
            planner
                .push(&to(f64::from(k), f64::from(k % 2), 10.0))
                .unwrap();
        }
        planner.start_next();
        let before = planner.outlook();
        planner.set_overrides(Overrides {
            feed: 10,
            rapid: 100,
        });
        assert!(planner.outlook().exit < before.exit);
        planner.set_overrides(Overrides::default());
        assert_eq!(planner.outlook().exit, before.exit);
        assert_ne!(planner.outlook(), before);
    }

    proptest! {
        /// Position after any program, against rational arithmetic (half away from zero), with odd scales.
        #[test]
        fn the_end_of_the_queue_is_where_exact_arithmetic_says(
            moves in prop::collection::vec((-1_000_000_000_000i64..1_000_000_000_000, -900_000_000_000i64..900_000_000_000), 1..8),
            scale in 1i64..2_000_000_000_000,
        ) {
            let config = Config { steps_per_mm: [StepsPerMm::from_nanos(scale); 2], ..config() };
            let mut planner = Planner::<_, 2, 2>::new(config, Cartesian, queue::<2, 8>());
            for (x, y) in moves {
                let of = Move { target: [x, y].map(Coordinate::from_nanos), power: MovePower::Off, outputs: Outputs(0), ..to(0.0, 0.0, 1.0) };
                planner.push(&of).unwrap();
                let steps = [x, y].map(|nanos| {
                    let product = i128::from(nanos) * i128::from(scale);
                    let one = i128::from(NANOS_PER_MM) * i128::from(NANOS_PER_MM);
                    ((product.abs() + one / 2) / one * product.signum()) as i32
                });
                prop_assert_eq!(planner.position(), steps);
            }
        }
    }
}
