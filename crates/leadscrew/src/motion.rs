//! Motion without G-code: targets and speeds in, steps out. For a plotter, a pick-and-place, a
//! camera slider.
//!
//! ```text
//!  move_to, arc_to --> queue of moves --> Motion::poll --> segments --> Stepping::tick --> pins
//!                                            ^                              |
//!                                            +----- wakes, after a segment -+
//! ```

use crate::motion_config::{MotionConfig, MotionConfigError};
use crate::motion_words::{MotionError, MotionFault, MotionStatus, Speed, Turn};
use crate::steps::Steps;
use crate::words::Words;
use heapless::spsc::{Producer, Queue};
use leadscrew_planner::{
    Arc, Coordinate, Curve, Feed, Kinematics, Move, MoveKind, MovePower, PixelQueue, Planner,
    Segmenter, THREE_DECIMALS, USUAL_BLOCKS,
};
use leadscrew_stepper::{OutputChange, Segment, Ticks};

/// Slots for segments; one stays empty. Segments are a millisecond at most, so a hold acts 8 ms
/// later at most.
const SLOTS: usize = 9;

/// All memory of a motion: one `static`. `MOVES` may be queued at once.
pub struct MotionResources<
    const AXES: usize,
    const MOTORS: usize,
    const MOVES: usize,
    const BLOCKS: usize = USUAL_BLOCKS,
> {
    moves: leadscrew_planner::Queue<AXES, MOTORS, MOVES, BLOCKS>,
    pixels: PixelQueue<1>,
    segments: Queue<Segment<MOTORS>, SLOTS>,
    words: Words<MOTORS>,
}

impl<const AXES: usize, const MOTORS: usize, const MOVES: usize, const BLOCKS: usize>
    MotionResources<AXES, MOTORS, MOVES, BLOCKS>
{
    /// Makes empty queues, for a `static`.
    pub const fn new() -> Self {
        Self {
            moves: leadscrew_planner::Queue::new(),
            pixels: PixelQueue::new(),
            segments: Queue::new(),
            words: Words::new(),
        }
    }
}

impl<const AXES: usize, const MOTORS: usize, const MOVES: usize, const BLOCKS: usize> Default
    for MotionResources<AXES, MOTORS, MOVES, BLOCKS>
{
    fn default() -> Self {
        Self::new()
    }
}

/// Moves the axes of a machine, in mm. It belongs to the main loop.
///
/// Moves that are queued blend: at a corner the speed is the one that the junction deviation
/// allows, and motion stops only when the queue ends.
pub struct Motion<'a, K, const AXES: usize, const MOTORS: usize> {
    planner: Planner<'a, K, AXES, MOTORS>,
    segmenter: Segmenter<AXES, MOTORS>,
    segments: Producer<'a, Segment<MOTORS>>,
    words: &'a Words<MOTORS>,
    travel: Option<[[Coordinate; 2]; AXES]>,
    /// The end of the last queued move.
    target: [Coordinate; AXES],
    room: usize,
    course: Course,
    underruns: u32,
    fault: Option<MotionFault>,
}

/// The course that was asked for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Course {
    Going,
    /// A hold: `resume` goes on.
    Holding,
    /// A stop: the queue is forgotten at rest.
    Stopping,
}

/// Makes a motion and its step interrupt.
///
/// # Errors
/// The first value of `config` with which nothing can be planned.
pub fn motion<
    K: Kinematics<AXES, MOTORS>,
    const AXES: usize,
    const MOTORS: usize,
    const MOVES: usize,
    const BLOCKS: usize,
>(
    resources: &mut MotionResources<AXES, MOTORS, MOVES, BLOCKS>,
    config: MotionConfig<AXES>,
    kinematics: K,
) -> Result<(Motion<'_, K, AXES, MOTORS>, Steps<'_, MOTORS>), MotionConfigError> {
    let travel = config.travel()?;
    let planned = config.planner(MOVES)?;
    let (producer, segments) = resources.segments.split();
    let words = &resources.words;
    words.order_wiring(&config.wiring);
    let wait = planned.shortest_tick.0.saturating_mul(2);
    words.shared.set_direction_wait(Ticks(wait));
    let planner = Planner::new(
        planned,
        kinematics,
        &mut resources.moves,
        &mut resources.pixels,
    )?;
    let motion = Motion {
        planner,
        segmenter: Segmenter::new(),
        segments: producer,
        words,
        travel,
        target: [Coordinate::ZERO; AXES],
        room: MOVES,
        course: Course::Going,
        underruns: 0,
        fault: None,
    };
    Ok((motion, Steps::new(segments, words, planned.timer_hz)))
}

impl<K: Kinematics<AXES, MOTORS>, const AXES: usize, const MOTORS: usize>
    Motion<'_, K, AXES, MOTORS>
{
    /// Queues a straight move to `target`, mm.
    ///
    /// # Errors
    /// Why the move was refused.
    pub fn move_to(&mut self, target: [f32; AXES], speed: Speed) -> Result<(), MotionError> {
        self.ensure_ready()?;
        let target = place(target)?;
        self.ensure_within(&target)?;
        self.push(target, speed, None)
    }

    /// Queues an arc to `target` around `centre`, mm, in the plane of the first two axes; all other
    /// axes move in proportion. A target at the start is a full circle.
    ///
    /// # Errors
    /// Why the arc was refused; none of it is queued then.
    pub fn arc_to(
        &mut self,
        target: [f32; AXES],
        centre: [f32; 2],
        turn: Turn,
        speed: Speed,
    ) -> Result<(), MotionError> {
        self.ensure_ready()?;
        let target = place(target)?;
        let mut offset = place(centre)?;
        for (offset, start) in offset.iter_mut().zip(&self.target) {
            *offset = *offset - *start;
        }
        let (plane, clockwise) = ((0, 1), turn == Turn::Clockwise);
        let tolerance = self.planner.config().arc_tolerance;
        let arc = Arc::new(self.target, target, offset, plane, clockwise, tolerance);
        let mut arc = arc.map_err(MotionError::Arc)?;
        for place in arc.extremes() {
            self.ensure_within(&place)?;
        }
        let (chords, room) = (arc.chords(), self.room);
        match chords as usize {
            count if count > room => return Err(MotionError::ArcTooLong { chords, room }),
            count if count > self.planner.room() => return Err(MotionError::Full),
            _ => {}
        }
        let limits = self.planner.config().acceleration;
        let weaker = limits.iter().take(2).copied().fold(f32::MAX, f32::min);
        let curve = arc.curve(weaker);
        arc.try_for_each(|end| self.push(end, speed, curve))
    }

    /// Hands segments to the step interrupt, and calls `start` (`NVIC::pend`) if it rests. Main
    /// loop: after moves were queued, after [`Motion::is_woken`], every 4 ms in motion. Never waits.
    pub fn poll(&mut self, start: impl FnOnce()) -> MotionStatus {
        self.words.bells.machine.clear();
        let underruns = self.words.shared.underruns();
        if let Some(fault) = self.words.fault() {
            self.fail(MotionFault::Board(fault));
        } else if underruns != self.underruns {
            self.underruns = underruns;
            self.fail(MotionFault::PollTooLate);
        }
        if self.fault.is_none() {
            self.feed();
            if !self.words.shared.is_running() && !self.segments.is_empty() {
                self.words.shared.set_running();
                start();
            }
            if self.course == Course::Stopping && self.is_at_rest() {
                self.forget();
            }
        }
        self.status()
    }

    /// Returns what the motion does.
    pub fn status(&self) -> MotionStatus {
        match (self.fault, self.course) {
            (Some(fault), _) => MotionStatus::Failed(fault),
            (None, Course::Holding) if self.is_at_rest() => MotionStatus::Held,
            (None, Course::Holding | Course::Stopping) => MotionStatus::Stopping,
            (None, Course::Going) if self.is_at_rest() && self.planner.is_empty() => {
                MotionStatus::Idle
            }
            (None, Course::Going) => MotionStatus::Moving,
        }
    }

    /// Returns whether a handler has woken the main loop since the last poll.
    pub fn is_woken(&self) -> bool {
        self.words.bells.machine.is_rung()
    }

    /// Returns the position of the axes, counted from steps, mm.
    pub fn position(&self) -> [f32; AXES] {
        let steps = self.words.shared.position();
        self.planner.axes_at(&steps).map(Coordinate::to_mm)
    }

    /// Declares the axes to be at `position`, mm: after homing, or at power-up.
    ///
    /// # Errors
    /// The motion is not idle, or a place is none.
    pub fn set_position(&mut self, position: [f32; AXES]) -> Result<(), MotionError> {
        self.ensure_ready()?;
        if self.status() != MotionStatus::Idle {
            return Err(MotionError::NotIdle);
        }
        let target = place(position)?;
        let steps = self.planner.steps_at(&target).ok_or(MotionError::TooFar)?;
        self.words.shared.set_position(steps);
        self.planner.set_position(steps);
        self.target = target;
        Ok(())
    }

    /// Returns the number of moves for which the queue has room.
    pub fn room(&self) -> usize {
        self.planner.room()
    }

    /// Slows down on the path, and waits at rest for [`Motion::resume`].
    pub fn hold(&mut self) {
        if self.course == Course::Going {
            self.segmenter.hold();
            self.course = Course::Holding;
        }
    }

    /// Goes on after a hold.
    pub fn resume(&mut self) {
        if self.course == Course::Holding {
            self.segmenter.resume();
            self.course = Course::Going;
        }
    }

    /// Slows down on the path, and forgets all moves. The motion is idle then, and its position is
    /// the place at which it came to rest.
    pub fn stop(&mut self) {
        self.hold();
        self.course = Course::Stopping;
    }

    /// Stops before the next step, without slowing down. In motion that is a fault: motors may have
    /// lost steps.
    pub fn stop_now(&mut self) {
        if !self.is_at_rest() {
            self.fail(MotionFault::StoppedNow);
        }
    }

    /// Forgets a fault, once the step interrupt rests. Returns whether it did: a part of the board
    /// that failed stays failed.
    pub fn recover(&mut self) -> bool {
        let rests = !self.words.shared.is_running() && self.segments.is_empty();
        if !rests || self.words.fault().is_some() {
            return false;
        }
        self.words.shared.set_stop(false);
        self.underruns = self.words.shared.underruns();
        self.fault = None;
        self.forget();
        true
    }

    /// Polls until the queue has ended, or a hold or a stop has. For one task that queues moves and
    /// awaits them; woken by [`crate::Stepping::tick`].
    ///
    /// # Errors
    /// The motion has failed.
    #[cfg(feature = "async")]
    pub async fn arrive(&mut self, mut start: impl FnMut()) -> Result<(), MotionFault> {
        loop {
            match self.poll(&mut start) {
                MotionStatus::Idle | MotionStatus::Held => return Ok(()),
                MotionStatus::Failed(fault) => return Err(fault),
                MotionStatus::Moving | MotionStatus::Stopping => {
                    self.words.bells.machine.heard().await;
                }
            }
        }
    }

    fn ensure_ready(&self) -> Result<(), MotionError> {
        self.fault
            .map_or(Ok(()), |fault| Err(MotionError::Failed(fault)))
    }

    fn ensure_within(&self, target: &[Coordinate; AXES]) -> Result<(), MotionError> {
        let mut ends = self.travel.iter().flatten().zip(target);
        match ends.position(|([low, high], place)| place < low || place > high) {
            Some(axis) => Err(MotionError::OutOfTravel(axis)),
            None => Ok(()),
        }
    }

    fn push(
        &mut self,
        target: [Coordinate; AXES],
        Speed(feed): Speed,
        curve: Option<Curve>,
    ) -> Result<(), MotionError> {
        self.planner.push(&Move {
            target,
            feed,
            power: MovePower::Off,
            curve,
            rounding: THREE_DECIMALS,
            outputs: OutputChange::NONE,
            line_number: None,
            kind: match feed {
                Feed::Rapid => MoveKind::Rapid,
                Feed::PerMinute(_) | Feed::InverseTime(_) => MoveKind::Feed,
            },
        })?;
        self.target = target;
        Ok(())
    }

    /// Fills the queue of segments. Each call goes round a few times at most.
    fn feed(&mut self) {
        while self.segments.ready() {
            let Some(segment) = self.segmenter.next(&mut self.planner) else {
                return;
            };
            // There is room for it.
            let _ = self.segments.enqueue(segment);
        }
    }

    /// Returns true if no step is to come without a further poll that has something to hand out.
    fn is_at_rest(&self) -> bool {
        let nothing_comes = self.segmenter.is_held() || self.segmenter.is_idle();
        nothing_comes && !self.words.shared.is_running() && self.segments.is_empty()
    }

    fn fail(&mut self, fault: MotionFault) {
        self.words.shared.set_stop(true);
        self.fault = self.fault.or(Some(fault));
    }

    /// Forgets all moves, at rest.
    fn forget(&mut self) {
        let steps = self.words.shared.position();
        self.planner.clear();
        self.segmenter.abandon();
        self.planner.set_position(steps);
        self.target = self.planner.axes_at(&steps);
        self.course = Course::Going;
    }
}

/// A place of numbers in mm.
fn place<const COUNT: usize>(mm: [f32; COUNT]) -> Result<[Coordinate; COUNT], MotionError> {
    let mut place = [Coordinate::ZERO; COUNT];
    for (axis, (place, mm)) in place.iter_mut().zip(mm).enumerate() {
        *place = Coordinate::from_mm(mm).ok_or(MotionError::NoPlace(axis))?;
    }
    Ok(place)
}
