//! Motion without G-code at switches: homing and probes.
//!
//! ```text
//!  home:     search --contact--> pull off --> locate --contact--> pull off --> the next axes
//!            (first speed)       (first)      (second)            (first)
//!  probe_to: move ----contact--> slow down --> touched()
//! ```
//!
//! The switch interrupt locks a motor at the very step at which its switch closes, and latches the
//! place at which the probe touches. The main loop only notices it.

use crate::motion::Motion;
use crate::motion_course::{Course, Homing, Phase};
use crate::motion_words::{End, MotionError, MotionFault, Speed};
use leadscrew_machine::inputs::{with_sharing, ActiveSwitches, ProbeWatch};
use leadscrew_planner::{Coordinate, Feed, Kinematics};
use leadscrew_stepper::MotorMask;

/// The length of a search, in travels of the axis.
const SEARCH_TRAVELS: f32 = 1.5;

/// The length of the second approach, in ways back off the switch.
const LOCATE_PULL_OFFS: f32 = 5.0;

impl<K: Kinematics<AXES, MOTORS>, const AXES: usize, const MOTORS: usize>
    Motion<'_, K, AXES, MOTORS>
{
    /// Begins to home axes: each looks for its limit switch at the end that is given, `None` for an
    /// axis that stays where it is. Afterwards an axis stands
    /// [`MotionConfig::with_pull_off_mm`](crate::MotionConfig::with_pull_off_mm) off its switch, and
    /// its position is counted from that end of its travel. Poll, or await [`Motion::arrive`]; what
    /// fails is a [`MotionFault`].
    ///
    /// The axes go together; those that share motors (CoreXY) one after the other. Call it twice
    /// for an order: the tool first, then the table.
    ///
    /// # Errors
    /// The motion is not idle, an axis has no travel, or its home has more steps than can be counted.
    pub fn home(&mut self, ends: [Option<End>; AXES]) -> Result<(), MotionError> {
        self.ensure_idle()?;
        let homes = |(axis, end): (usize, Option<End>)| end.map(|_| axis);
        let mut homing = ends.into_iter().enumerate().filter_map(homes);
        if let Some(axis) = homing.find(|axis| self.travel_mm(*axis) <= self.homing.pull_off) {
            return Err(MotionError::NoTravel(axis));
        }
        let steps = self.planner.steps_at(&self.homes(&ends));
        steps.ok_or(MotionError::TooFar)?;
        let mut all = MotorMask::NONE;
        for (motors, end) in self.motors.iter().zip(ends) {
            all = end.map_or(all, |_| all.with(*motors));
        }
        if all.is_empty() {
            return Ok(());
        }
        self.words.inputs.ignore_limits(all);
        self.begin_phase(Homing {
            ends,
            phase: Phase::Search,
            moves: false,
            halts: false,
        });
        Ok(())
    }

    /// Moves straight towards `target`, mm, until the probe touches, then slows down and forgets
    /// the rest. Poll, or await [`Motion::arrive`]: a probe that touches nothing is
    /// [`MotionFault::NothingTouched`]; otherwise [`Motion::touched`] is the place.
    ///
    /// # Errors
    /// The motion is not idle, the probe touches already, or why the move was refused.
    pub fn probe_to(&mut self, target: [f32; AXES], speed: Speed) -> Result<(), MotionError> {
        self.ensure_idle()?;
        self.move_to(target, speed)?;
        self.touched = None;
        self.course = Course::Probing;
        // Watch, then look: a contact between the two is not lost.
        self.words.inputs.watch_probe(ProbeWatch::Contact);
        if self.closed().probe {
            self.forget();
            return Err(MotionError::ProbeTouches);
        }
        Ok(())
    }

    /// Returns the place at which the probe touched last, mm; `None` if [`Motion::probe_to`] was
    /// called since, and it has not touched yet.
    pub fn touched(&self) -> Option<[f32; AXES]> {
        self.touched.map(|place| place.map(Coordinate::to_mm))
    }

    /// Returns the switches that are closed.
    pub fn closed(&self) -> ActiveSwitches {
        self.words.inputs.active(&self.words.levels())
    }

    /// Goes on with a probe. Main loop.
    pub(crate) fn advance_probe(&mut self) {
        let ended = self.is_at_rest();
        match self.words.inputs.latched() {
            Some(steps) if ended => {
                self.touched = Some(self.planner.axes_at(&steps));
                self.forget();
            }
            Some(_) => self.segmenter.hold(),
            None if ended && self.planner.is_empty() => self.fail(MotionFault::NothingTouched),
            None => {}
        }
    }

    /// Goes on with homing. Main loop.
    pub(crate) fn advance_homing(&mut self, homing: Homing<AXES>) {
        let group = homing.group(self.sharing);
        if !homing.moves {
            self.begin_phase(homing);
        } else if homing.halts {
            if self.steps_rest() {
                self.end_phase(homing, group);
            }
        } else if homing.phase.approaches() {
            self.watch_approach(homing, group);
        } else if self.has_ended() {
            match self.axis_with(group, self.closed().limits) {
                Some(axis) => self.fail(MotionFault::SwitchStuck(axis)),
                None => self.end_phase(homing, group),
            }
        }
    }

    fn watch_approach(&mut self, homing: Homing<AXES>, group: MotorMask) {
        let ended = self.has_ended();
        let open = MotorMask::ALL.without(self.words.shared.motor_lock());
        if let Some(axis) = self.skewed(group) {
            return self.fail(MotionFault::Skewed(axis));
        }
        match self.axis_with(group, open) {
            None => {
                self.words.shared.set_stop(true);
                self.course = Course::Homing(Homing {
                    halts: true,
                    ..homing
                });
            }
            Some(axis) if ended => self.fail(MotionFault::NoSwitch(axis)),
            Some(_) => {}
        }
    }

    /// The first axis of `group` that has one of `motors`.
    fn axis_with(&self, group: MotorMask, motors: MotorMask) -> Option<usize> {
        let mut axes = self.motors.iter().enumerate();
        let found = axes.find(|(axis, own)| group.contains(*axis) && own.without(motors) != **own);
        found.map(|(axis, _)| axis)
    }

    /// The first axis of `group` one motor of which has gone on too far without its switch. All
    /// motors of an axis have the same count when a phase begins.
    fn skewed(&self, group: MotorMask) -> Option<usize> {
        let counts = self.words.shared.position();
        let scales = self.planner.config().steps_per_mm;
        let mut axes = self.motors.iter().zip(scales).enumerate();
        let found = axes.find(|(axis, (motors, scale))| {
            let of = || (counts.iter().enumerate()).filter(|(motor, _)| motors.contains(*motor));
            let most = of().map(|(_, count)| *count).max();
            let least = of().map(|(_, count)| *count).min();
            let (Some(most), Some(least)) = (most, least) else {
                return false;
            };
            let allowed = self.homing.squaring.allowance(self.travel_mm(*axis)) * scale.to_f32();
            group.contains(*axis) && most.abs_diff(least) as f32 > allowed
        });
        found.map(|(axis, _)| axis)
    }

    /// Begins a phase, at rest. If a switch closes just now, the next poll begins it instead.
    fn begin_phase(&mut self, homing: Homing<AXES>) {
        self.course = Course::Homing(homing);
        let group = homing.group(self.sharing);
        if homing.phase.approaches() && !self.watch_switches(group) {
            return;
        }
        self.course = Course::Homing(Homing {
            moves: true,
            ..homing
        });
        let (way, speed) = self.way(homing.phase, group);
        let mut target = self.target;
        for (axis, (target, end)) in target.iter_mut().zip(homing.ends).enumerate() {
            if group.contains(axis) {
                let way = Coordinate::from_mm(way).unwrap_or_default();
                let to_high = (end == Some(End::High)) == homing.phase.approaches();
                *target = if to_high {
                    *target + way
                } else {
                    *target - way
                };
            }
        }
        // All axes go that way, each at that speed.
        if self
            .push(target, Speed(Feed::InverseTime(speed / way)), None)
            .is_err()
        {
            // The way is beyond the range of steps.
            let axis = self.axis_with(group, MotorMask::ALL);
            self.fail(MotionFault::NoSwitch(axis.unwrap_or(0)));
        }
    }

    /// How far each axis of a group goes, mm, and how fast, mm/s.
    fn way(&self, phase: Phase, group: MotorMask) -> (f32, f32) {
        let of = &self.homing;
        match phase {
            Phase::Search => {
                let axes = (0..AXES).filter(|axis| group.contains(*axis));
                let longest =
                    axes.fold(0.0, |longest: f32, axis| longest.max(self.travel_mm(axis)));
                (SEARCH_TRAVELS * longest, of.fast)
            }
            Phase::Locate => (LOCATE_PULL_OFFS * of.pull_off, of.slow),
            Phase::PullOff | Phase::LastPullOff => (of.pull_off, of.fast),
        }
    }

    /// The travel of an axis, mm; 0 if it has none.
    fn travel_mm(&self, axis: usize) -> f32 {
        let travel = self.travel.as_ref().and_then(|travel| travel.get(axis));
        travel.map_or(0.0, |[low, high]| (*high - *low).to_mm())
    }

    /// Locks the motors whose switch is closed already, and lets the switch interrupt lock the
    /// others. Returns whether all motors with a closed switch are locked: an edge between the two
    /// steps locks none. At rest.
    fn watch_switches(&self, group: MotorMask) -> bool {
        let axes = (self.motors.iter().enumerate()).filter(|(axis, _)| group.contains(*axis));
        let motors = axes.fold(MotorMask::NONE, |all, (_, motors)| all.with(*motors));
        let closed = || motors.without(motors.without(self.closed().limits));
        let (inputs, shared) = (&self.words.inputs, &self.words.shared);
        inputs.watch_homing(MotorMask::NONE, self.sharing);
        shared.set_motor_lock(with_sharing(closed(), self.sharing));
        inputs.watch_homing(motors, self.sharing);
        closed().without(shared.motor_lock()).is_empty()
    }

    /// Ends the watch for homing and probes. At rest.
    pub(crate) fn ignore_switches(&mut self) {
        self.unlock();
        self.words.inputs.watch_probe(ProbeWatch::Off);
        self.words.inputs.ignore_limits(MotorMask::NONE);
    }

    fn unlock(&self) {
        let none = MotorMask::NONE;
        self.words.inputs.watch_homing(none, none);
        self.words.shared.set_motor_lock(none);
    }

    /// Ends a phase, at rest, and begins what follows.
    fn end_phase(&mut self, mut homing: Homing<AXES>, group: MotorMask) {
        self.unlock();
        self.forget_moves();
        (homing.moves, homing.halts) = (false, false);
        match homing.phase.next() {
            Some(phase) => homing.phase = phase,
            None => {
                self.declare_home(&homing, group);
                for (axis, end) in homing.ends.iter_mut().enumerate() {
                    *end = end.filter(|_| !group.contains(axis));
                }
                homing.phase = Phase::Search;
            }
        }
        match homing.group(self.sharing).is_empty() {
            true => self.forget(),
            false => self.begin_phase(homing),
        }
    }

    /// Each axis of `group` stands at its home.
    fn declare_home(&mut self, homing: &Homing<AXES>, group: MotorMask) {
        let mut ends = homing.ends;
        for (axis, end) in ends.iter_mut().enumerate() {
            *end = end.filter(|_| group.contains(axis));
        }
        let homes = self.homes(&ends);
        // `home` has refused those that cannot be counted.
        let _ = self.declare(homes);
    }

    /// Where the axes stand that have come off their switches at these ends; the others stay.
    fn homes(&self, ends: &[Option<End>; AXES]) -> [Coordinate; AXES] {
        let back = Coordinate::from_mm(self.homing.pull_off).unwrap_or_default();
        let mut homes = self.target;
        let travel = self.travel.iter().flatten();
        for ((home, end), [low, high]) in homes.iter_mut().zip(ends).zip(travel) {
            match end {
                Some(End::High) => *home = *high - back,
                Some(End::Low) => *home = *low + back,
                None => {}
            }
        }
        homes
    }
}
