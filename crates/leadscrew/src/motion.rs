//! Motion without G-code: targets and speeds in, steps out. For a plotter, a pick-and-place, a
//! camera slider.
//!
//! ```text
//!  move_to, arc_to --> queue of moves --> Motion::poll --> segments --> Stepping::tick --> pins
//!                                            ^                              |
//!                                            +----- wakes, after a segment -+
//! ```

use crate::fault::Fault;
use crate::motion_config::HomingConfig;
use crate::motion_course::{Course, Homing};
use crate::motion_words::{MotionError, MotionFault, MotionStatus, Speed, Turn};
use crate::outputs::Actuators;
use crate::words::Words;
use heapless::spsc::Producer;
use leadscrew_machine::inputs::Edges;
use leadscrew_planner::{
    Arc, Coordinate, Curve, Feed, Kinematics, Move, MoveKind, MovePower, Planner, Segmenter,
    THREE_DECIMALS,
};
use leadscrew_stepper::{MotorMask, OutputChange, Segment};

/// Moves the axes of a machine, in mm. It belongs to the main loop.
///
/// Moves that are queued blend: at a corner the speed is the one that the junction deviation
/// allows, and motion stops only when the queue ends.
///
/// ```
/// # use leadscrew::{Cartesian, End, MotionConfig, MotionResources, MotionStatus, NoPin, Outputs};
/// # use leadscrew::{Instant, Speed, StepDir, SwitchPins};
/// # use leadscrew::embedded_hal::digital::{ErrorType, InputPin, OutputPin};
/// # use core::sync::atomic::{AtomicI32, AtomicU32, Ordering::Relaxed};
/// # // An axis on the desk: its place in steps, its way, its switch at -300, a part at 1234.
/// # static PLACE: AtomicI32 = AtomicI32::new(5000);
/// # static WAY: AtomicI32 = AtomicI32::new(1);
/// # static COUNT: AtomicU32 = AtomicU32::new(0);
/// # enum Pin { Step, Direction, Limit, Probe }
/// # impl ErrorType for Pin { type Error = core::convert::Infallible; }
/// # impl OutputPin for Pin {
/// #   fn set_low(&mut self) -> Result<(), Self::Error> {
/// #     if let Pin::Direction = self { WAY.store(1, Relaxed); } Ok(()) }
/// #   fn set_high(&mut self) -> Result<(), Self::Error> {
/// #     match self { Pin::Direction => WAY.store(-1, Relaxed),
/// #       _ => { PLACE.fetch_add(WAY.load(Relaxed), Relaxed); } } Ok(()) } }
/// # impl InputPin for Pin {
/// #   fn is_high(&mut self) -> Result<bool, Self::Error> { let place = PLACE.load(Relaxed);
/// #     Ok(match self { Pin::Limit => place > -300, _ => place < 1234 }) }
/// #   fn is_low(&mut self) -> Result<bool, Self::Error> { Ok(!self.is_high()?) } }
/// # struct Timer;
/// # impl leadscrew::Alarm for Timer { fn count(&self) -> u32 { COUNT.load(Relaxed) }
/// #   fn ring_at(&mut self, at: u32) { COUNT.store(at, Relaxed); } fn silence(&mut self) {} }
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let mut resources = MotionResources::<1, 1, 16>::new();
/// let config = MotionConfig::new()
///     .timer_hz(1_000_000)
///     .with_steps_per_mm([100.0])
///     .with_travel_mm([[0.0, 60.0]])
///     .with_homing_mm_s(8.0, 1.0)
///     .with_pull_off_mm(1.5);
/// let (mut motion, steps, switches) = leadscrew::motion(&mut resources, config, Cartesian)?;
/// let mut steps = steps.on(StepDir::new([(Pin::Step, Pin::Direction)]), Timer);
/// let mut watch = switches.on(SwitchPins::new([Some(Pin::Limit)]).with_probe(Pin::Probe));
/// let mut outputs = Outputs::<_, NoPin>::without_enable(|| { /* NVIC::pend */ });
/// // The timer's interrupt calls `steps.tick()`, the switches' interrupt `watch.look(now)`.
/// # macro_rules! arrive { () => { loop { match motion.poll(&mut outputs) {
/// #   MotionStatus::Moving => { steps.tick(); watch.look(Instant::from_ticks(0)); }
/// #   MotionStatus::Failed(fault) => return Err(fault.into()), _ => break } } } }
///
/// motion.home([Some(End::Low)])?;
/// arrive!(); // poll until it is idle
/// assert_eq!(motion.position(), [1.5]);
///
/// motion.probe_to([60.0], Speed::mm_s(5.0))?;
/// arrive!();
/// assert_eq!(motion.touched(), Some([15.34])); // the part is 15.34 mm from the switch
/// # Ok(()) }
/// ```
pub struct Motion<'a, K, const AXES: usize, const MOTORS: usize> {
    pub(crate) planner: Planner<'a, K, AXES, MOTORS>,
    pub(crate) segmenter: Segmenter<AXES, MOTORS>,
    pub(crate) segments: Producer<'a, Segment<MOTORS>>,
    pub(crate) words: &'a Words<MOTORS>,
    pub(crate) travel: Option<[[Coordinate; 2]; AXES]>,
    pub(crate) homing: HomingConfig,
    /// The motors that each axis has a limit switch for.
    pub(crate) motors: [MotorMask; AXES],
    /// Axes that share motors.
    pub(crate) sharing: MotorMask,
    /// The end of the last queued move.
    pub(crate) target: [Coordinate; AXES],
    /// The place of the last probe's contact.
    pub(crate) touched: Option<[Coordinate; AXES]>,
    pub(crate) room: usize,
    pub(crate) course: Course<AXES>,
    pub(crate) underruns: u32,
    pub(crate) edges: Edges,
    /// The drivers are on; a high level enables them.
    pub(crate) drivers: (bool, bool),
    pub(crate) fault: Option<MotionFault>,
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

    /// Hands segments to the step interrupt. If it rests, enables the drivers and makes it come.
    /// Main loop: after moves were queued, after [`Motion::is_woken`], every 4 ms in motion. Never
    /// waits.
    pub fn poll<O: Actuators>(&mut self, outputs: &mut O) -> MotionStatus {
        self.words.bells.machine.clear();
        self.look();
        if self.fault.is_none() {
            self.advance();
        }
        if self.fault.is_none() {
            self.feed();
            if !self.words.shared.is_running() && !self.segments.is_empty() {
                self.start(outputs);
            }
        }
        self.status()
    }

    /// Switches the drivers on or off. [`Motion::poll`] switches them on before the first step: call
    /// this earlier if they need time to wake. A motor that is off may be turned by hand.
    ///
    /// # Errors
    /// The motion is not idle, or has failed.
    pub fn set_drivers<O: Actuators>(
        &mut self,
        outputs: &mut O,
        on: bool,
    ) -> Result<(), MotionError> {
        self.ensure_idle()?;
        self.put_drivers(outputs, on);
        self.ensure_ready()
    }

    /// Returns what the motion does.
    pub fn status(&self) -> MotionStatus {
        match (self.fault, &self.course) {
            (Some(fault), _) => MotionStatus::Failed(fault),
            (None, Course::Holding) if self.is_at_rest() => MotionStatus::Held,
            (None, Course::Holding | Course::Stopping) => MotionStatus::Stopping,
            (None, Course::Going) if self.has_ended() => MotionStatus::Idle,
            (None, Course::Going | Course::Homing(_) | Course::Probing) => MotionStatus::Moving,
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

    /// Declares the axes to be at `position`, mm: at power-up, or at a mark of your own.
    ///
    /// # Errors
    /// The motion is not idle, or a place is none.
    pub fn set_position(&mut self, position: [f32; AXES]) -> Result<(), MotionError> {
        self.ensure_idle()?;
        self.declare(place(position)?)
    }

    pub(crate) fn declare(&mut self, target: [Coordinate; AXES]) -> Result<(), MotionError> {
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

    /// Slows down on the path, and waits at rest for [`Motion::resume`]. Homing and probes are not
    /// held.
    pub fn hold(&mut self) {
        if matches!(self.course, Course::Going) {
            self.segmenter.hold();
            self.course = Course::Holding;
        }
    }

    /// Goes on after a hold.
    pub fn resume(&mut self) {
        if matches!(self.course, Course::Holding) {
            self.segmenter.resume();
            self.course = Course::Going;
        }
    }

    /// Slows down on the path, and forgets all moves. The motion is idle then, and its position is
    /// the place at which it came to rest.
    pub fn stop(&mut self) {
        self.segmenter.hold();
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
        if !self.steps_rest() || self.words.fault().is_some() {
            return false;
        }
        self.words.shared.set_laser_off(false); // a switch that stops motion does this, too
        self.underruns = self.words.shared.underruns();
        self.fault = None;
        self.forget();
        true
    }

    /// Polls until the queue, homing or a probe has ended, or a hold or a stop has. For one task that
    /// queues moves and awaits them; woken by [`crate::Stepping::tick`] and [`crate::Watch::look`].
    ///
    /// # Errors
    /// The motion has failed.
    #[cfg(feature = "async")]
    pub async fn arrive<O: Actuators>(&mut self, outputs: &mut O) -> Result<(), MotionFault> {
        loop {
            match self.poll(outputs) {
                MotionStatus::Idle | MotionStatus::Held => return Ok(()),
                MotionStatus::Failed(fault) => return Err(fault),
                MotionStatus::Moving | MotionStatus::Stopping => {
                    self.words.bells.machine.heard().await;
                }
            }
        }
    }

    fn ensure_ready(&self) -> Result<(), MotionError> {
        match (self.fault, &self.course) {
            (Some(fault), _) => Err(MotionError::Failed(fault)),
            (None, Course::Homing(_) | Course::Probing) => Err(MotionError::NotIdle),
            (None, Course::Going | Course::Holding | Course::Stopping) => Ok(()),
        }
    }

    pub(crate) fn ensure_idle(&self) -> Result<(), MotionError> {
        self.ensure_ready()?;
        match self.status() {
            MotionStatus::Idle => Ok(()),
            _ => Err(MotionError::NotIdle),
        }
    }

    pub(crate) fn ensure_within(&self, target: &[Coordinate; AXES]) -> Result<(), MotionError> {
        let mut ends = self.travel.iter().flatten().zip(target);
        match ends.position(|([low, high], place)| place < low || place > high) {
            Some(axis) => Err(MotionError::OutOfTravel(axis)),
            None => Ok(()),
        }
    }

    pub(crate) fn push(
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

    /// Takes notice of what the interrupts have told since the last poll.
    fn look(&mut self) {
        let underruns = self.words.shared.underruns();
        let edges = self.words.inputs.edges();
        let before = core::mem::replace(&mut self.edges, edges);
        if let Some(fault) = self.words.fault() {
            self.fail(MotionFault::Board(fault));
        } else if edges.limit_hits != before.limit_hits {
            self.fail(MotionFault::LimitSwitch);
        } else if edges.resets != before.resets {
            self.fail(MotionFault::StoppedNow);
        } else if underruns != self.underruns {
            self.fail(MotionFault::PollTooLate);
        }
        self.underruns = underruns;
        if edges.holds != before.holds {
            self.hold();
        } else if edges.starts != before.starts {
            self.resume();
        }
    }

    /// Goes on with a stop, homing or a probe.
    fn advance(&mut self) {
        match self.course {
            Course::Going | Course::Holding => {}
            Course::Stopping if self.is_at_rest() => self.forget(),
            Course::Stopping => {}
            Course::Probing => self.advance_probe(),
            Course::Homing(homing) => self.advance_homing(homing),
        }
    }

    fn start<O: Actuators>(&mut self, outputs: &mut O) {
        if !self.drivers.0 {
            self.put_drivers(outputs, true);
        }
        if self.fault.is_none() {
            self.words.shared.set_running();
            outputs.pend_step_interrupt();
        }
    }

    fn put_drivers<O: Actuators>(&mut self, outputs: &mut O, on: bool) {
        self.drivers.0 = on;
        if outputs.enable_motors(on, on == self.drivers.1).is_err() {
            self.words.fail(Fault::Output);
            self.fail(MotionFault::Board(Fault::Output));
        }
    }

    /// Fills the queue of segments. Each call goes round a few times at most.
    fn feed(&mut self) {
        if matches!(self.course, Course::Homing(Homing { halts: true, .. })) {
            return;
        }
        while self.segments.ready() {
            let Some(segment) = self.segmenter.next(&mut self.planner) else {
                return;
            };
            // There is room for it.
            let _ = self.segments.enqueue(segment);
        }
    }

    /// Returns true if no step is to come without a further poll that has something to hand out.
    pub(crate) fn is_at_rest(&self) -> bool {
        let nothing_comes = self.segmenter.is_held() || self.segmenter.is_idle();
        nothing_comes && self.steps_rest()
    }

    /// Returns true if the step interrupt rests and has nothing to begin.
    pub(crate) fn steps_rest(&self) -> bool {
        !self.words.shared.is_running() && self.segments.is_empty()
    }

    /// Returns true if all moves have been made.
    pub(crate) fn has_ended(&self) -> bool {
        self.is_at_rest() && self.planner.is_empty()
    }

    pub(crate) fn fail(&mut self, fault: MotionFault) {
        self.words.shared.set_stop(true);
        self.fault = self.fault.or(Some(fault));
    }

    /// Forgets all moves, homing and a probe, at rest.
    pub(crate) fn forget(&mut self) {
        self.course = Course::Going;
        self.ignore_switches();
        self.forget_moves();
    }

    /// Forgets all moves, at rest.
    pub(crate) fn forget_moves(&mut self) {
        // The motors of one axis count alike, wherever each of them met its switch.
        let steps = self.planner.ganged(self.words.shared.position());
        self.planner.clear();
        self.segmenter.abandon();
        self.words.shared.set_stop(false);
        self.words.shared.set_position(steps);
        self.planner.set_position(steps);
        self.target = self.planner.axes_at(&steps);
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
