//! Switch edges and the probe latch: the reaction to a contact at the very step of the contact.
//!
//! The switch interrupt calls [`Inputs::on_switches`] with the levels of all inputs. The reactions
//! that cannot wait for the main loop are done in the interrupt, "at once":
//!
//! | input | armed by | at once | later, in `Machine::poll` |
//! |---|---|---|---|
//! | limit | `$21=1` | stepping stops, the laser's gate shuts | ALARM:1 |
//! | limit | homing | the motor is locked | next phase once all motors are locked |
//! | probe | probing | the position is latched | hold, `[PRB:` |
//! | reset | – | stepping stops, the laser's gate shuts | reset, and locked as long as it is held |
//! | buttons | – | the edge is counted | reset, hold, start, door |
//!
//! Each word has one writer at a time. The writer of the motor lock is the main loop; while
//! [`Inputs::watch_homing`] is in force it is the switch interrupt. Events are counters: the
//! interrupt advances them, the main loop compares them with its last copy. So no compare-and-swap
//! is needed, which a Cortex-M0 lacks.

use crate::board::Switches;
use crate::config::WITHOUT_EXTRUDER;
use core::sync::atomic::{AtomicBool, AtomicI32, AtomicU8, Ordering};
use leadscrew_stepper::{MotorMask, Shared};

/// The change of the probe that is waited for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ProbeWatch {
    /// Nothing: no probing under way.
    Off = 0,
    /// The probe makes contact (G38.2, G38.3).
    Contact = 1,
    /// The probe loses contact (G38.4, G38.5).
    Release = 2,
}

/// Says which levels are active, and whether a limit switch stops the machine.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct InputConfig {
    /// True if limit switches are active high (`$5`).
    pub limits_invert: bool,
    /// True if the probe is active high (`$6`).
    pub probe_invert: bool,
    /// True if a limit switch stops the machine (`$21`).
    pub hard_limits: bool,
    /// True if there is a safety door switch.
    pub door: bool,
    /// Motors of axes that are absent: they have no limit switch, whichever level is active.
    pub absent: MotorMask,
}

/// Words shared by the switch interrupts and the main loop.
#[derive(Debug)]
pub struct Inputs<const MOTORS: usize> {
    // Written by the main loop.
    limits_invert: AtomicBool,
    probe_invert: AtomicBool,
    hard_limits: AtomicBool,
    door_present: AtomicBool,
    /// Motors of axes that are absent.
    absent: AtomicU8,
    /// Motors whose limit switch stops nothing now.
    ignored: AtomicU8,
    homing: AtomicU8,
    /// Motors that stop together while homing.
    sharing: AtomicU8,
    /// A [`ProbeWatch`] in the low bits, above it a count that tells one watch from the next.
    watch: AtomicU8,
    // Written by the switch interrupt.
    last: AtomicU8,
    last_limits: AtomicU8,
    limit_hits: AtomicU8,
    resets: AtomicU8,
    holds: AtomicU8,
    starts: AtomicU8,
    doors: AtomicU8,
    /// The value of `watch` whose event has come.
    latched_watch: AtomicU8,
    latched: [AtomicI32; MOTORS],
}

/// The number of edges, modulo 256, since power-up.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Edges {
    /// Limit switches that stopped the machine.
    pub limit_hits: u8,
    /// The edges of the reset button.
    pub resets: u8,
    /// The edges of the feed hold button.
    pub holds: u8,
    /// The edges of the cycle start button.
    pub starts: u8,
    /// The times that the safety door opened.
    pub doors: u8,
}

impl Edges {
    /// The counts of the edges that stop the machine in the interrupt.
    pub(crate) fn stops(&self) -> [u8; 2] {
        [self.limit_hits, self.resets]
    }
}

/// The switches that are active: closed, as the settings read their levels.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ActiveSwitches {
    /// Motors whose limit switch is active.
    pub limits: MotorMask,
    /// True while the probe has contact.
    pub probe: bool,
    /// Reset button pressed.
    pub reset: bool,
    /// Feed hold button pressed.
    pub hold: bool,
    /// Cycle start button pressed.
    pub start: bool,
    /// Door open; never if there is no door switch.
    pub door: bool,
}

impl ActiveSwitches {
    const RESET: u8 = 1;
    const HOLD: u8 = 2;
    const START: u8 = 4;
    const DOOR: u8 = 8;

    fn buttons(&self) -> u8 {
        let pressed = |pressed, button| if pressed { button } else { 0 };
        pressed(self.reset, Self::RESET)
            | pressed(self.hold, Self::HOLD)
            | pressed(self.start, Self::START)
            | pressed(self.door, Self::DOOR)
    }
}

impl<const MOTORS: usize> Default for Inputs<MOTORS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const MOTORS: usize> Inputs<MOTORS> {
    /// The bits of `watch` for the kind of event that is awaited.
    const KIND: u8 = 3;

    /// Makes the words of a board with all switches open.
    pub const fn new() -> Self {
        Self {
            limits_invert: AtomicBool::new(false),
            probe_invert: AtomicBool::new(false),
            hard_limits: AtomicBool::new(false),
            door_present: AtomicBool::new(false),
            absent: AtomicU8::new(0),
            ignored: AtomicU8::new(0),
            homing: AtomicU8::new(0),
            sharing: AtomicU8::new(0),
            watch: AtomicU8::new(ProbeWatch::Off as u8),
            last: AtomicU8::new(0),
            last_limits: AtomicU8::new(0),
            limit_hits: AtomicU8::new(0),
            resets: AtomicU8::new(0),
            holds: AtomicU8::new(0),
            starts: AtomicU8::new(0),
            doors: AtomicU8::new(0),
            latched_watch: AtomicU8::new(0),
            latched: [const { AtomicI32::new(0) }; MOTORS],
        }
    }

    /// Acts on the levels of all switches: stops, locks, latches, counts edges.
    ///
    /// Called from the switch interrupt at every edge of any input, with the levels read after the
    /// edge. Must not be preempted by itself. Bounded: no loop but one over the motors.
    ///
    /// Returns nothing: what has to happen at once has happened, and the rest waits for the main
    /// loop. Wake a main loop that sleeps.
    pub fn on_switches(&self, switches: &Switches, shared: &Shared<MOTORS>) {
        self.on_switches_at(switches, shared, &shared.position());
    }

    /// As [`Inputs::on_switches`], for a board that filters its inputs: `position` is the place at
    /// which the motors stood at the edge that has lasted long enough by now.
    pub fn on_switches_at(
        &self,
        switches: &Switches,
        shared: &Shared<MOTORS>,
        position: &[i32; MOTORS],
    ) {
        let active = self.active(switches);
        self.check_limits(active.limits, shared);
        self.check_probe(active.probe, position);
        self.check_buttons(active.buttons(), shared);
    }

    /// Returns true if [`Inputs::on_switches_at`] with these levels is going to stop motion: for a
    /// board that makes the laser dark before it does anything else. Switch interrupt.
    #[inline]
    pub fn would_stop(&self, switches: &Switches) -> bool {
        let active = self.active(switches);
        let pressed = active.buttons() & !self.last.load(Ordering::Relaxed);
        self.is_hit(active.limits) || stops(pressed)
    }

    /// Returns the switches that are active. Any context.
    pub fn active(&self, switches: &Switches) -> ActiveSwitches {
        let here = self.motors();
        let invert = self.limits_invert.load(Ordering::Relaxed);
        let high = MotorMask::from_bits(switches.limits.bits() & here.bits());
        ActiveSwitches {
            limits: if invert { high } else { here.without(high) },
            probe: switches.probe == self.probe_invert.load(Ordering::Relaxed),
            reset: !switches.reset,
            hold: !switches.hold,
            start: !switches.start,
            door: !switches.door && self.door_present.load(Ordering::Relaxed),
        }
    }

    /// The motors of axes that are present.
    fn motors(&self) -> MotorMask {
        let all = MotorMask::from_bits(((1u16 << MOTORS.min(8)) - 1) as u8);
        if MOTORS <= WITHOUT_EXTRUDER {
            return all;
        }
        all.without(MotorMask::from_bits(self.absent.load(Ordering::Relaxed)))
    }

    /// Puts settings into effect. Main loop.
    pub fn configure(&self, config: &InputConfig) {
        self.limits_invert
            .store(config.limits_invert, Ordering::Relaxed);
        self.probe_invert
            .store(config.probe_invert, Ordering::Relaxed);
        self.door_present.store(config.door, Ordering::Relaxed);
        self.absent.store(config.absent.bits(), Ordering::Relaxed);
        self.hard_limits
            .store(config.hard_limits, Ordering::Release);
    }

    /// From now on, locks each of `motors` at the step at which its limit switch closes, and raises
    /// no alarm. [`MotorMask::NONE`] ends this. Until then only the switch interrupt may write the
    /// motor lock. Main loop.
    ///
    /// A switch that is closed already has no edge: lock its motor before this, and look once more
    /// after it.
    ///
    /// `sharing`: motors that turn for several axes ([`leadscrew_planner::Kinematics::sharing`]).
    /// If one of them is locked, all of them are: a single one would drag another axis along.
    pub fn watch_homing(&self, motors: MotorMask, sharing: MotorMask) {
        self.sharing.store(sharing.bits(), Ordering::Relaxed);
        self.homing.store(motors.bits(), Ordering::Release);
    }

    /// Lets the limit switches of `motors` stop nothing, and all others stop motion. Main loop.
    pub fn ignore_limits(&self, motors: MotorMask) {
        self.ignored.store(motors.bits(), Ordering::Relaxed);
    }

    /// Begins the wait for the probe, or ends it. Main loop.
    ///
    /// A probe that is in the awaited state already is noticed at the next edge only: ask
    /// [`Inputs::active`] first.
    pub fn watch_probe(&self, watch: ProbeWatch) {
        let count = self.watch.load(Ordering::Relaxed) | Self::KIND;
        let next = count.wrapping_add(1) | watch as u8;
        self.watch.store(next, Ordering::Release);
    }

    /// Returns the motors' positions at the contact that [`Inputs::watch_probe`] waits for, once it
    /// has come. Main loop.
    pub fn latched(&self) -> Option<[i32; MOTORS]> {
        let watch = self.watch.load(Ordering::Relaxed);
        let met = self.latched_watch.load(Ordering::Acquire) == watch;
        (met && watch & Self::KIND != ProbeWatch::Off as u8).then(|| {
            core::array::from_fn(|motor| {
                let latched = self.latched.get(motor);
                latched.map_or(0, |steps| steps.load(Ordering::Relaxed))
            })
        })
    }

    /// Returns the counts of edges so far, to compare with earlier ones. Main loop.
    pub fn edges(&self) -> Edges {
        Edges {
            limit_hits: self.limit_hits.load(Ordering::Acquire),
            resets: self.resets.load(Ordering::Acquire),
            holds: self.holds.load(Ordering::Acquire),
            starts: self.starts.load(Ordering::Acquire),
            doors: self.doors.load(Ordering::Acquire),
        }
    }

    /// Returns true if a limit switch has closed, and ends motion.
    #[inline]
    fn is_hit(&self, active: MotorMask) -> bool {
        let before =
            self.last_limits.load(Ordering::Relaxed) | self.ignored.load(Ordering::Relaxed);
        let before = MotorMask::from_bits(before);
        self.homing.load(Ordering::Acquire) == 0
            && self.hard_limits.load(Ordering::Acquire)
            && !active.without(before).is_empty()
    }

    fn check_limits(&self, active: MotorMask, shared: &Shared<MOTORS>) {
        let is_hit = self.is_hit(active);
        self.last_limits.store(active.bits(), Ordering::Relaxed);
        let homing = self.homing.load(Ordering::Acquire);
        if homing != 0 {
            let reached = MotorMask::from_bits(active.bits() & homing);
            let sharing = MotorMask::from_bits(self.sharing.load(Ordering::Relaxed));
            shared.set_motor_lock(shared.motor_lock().with(with_sharing(reached, sharing)));
        } else if is_hit {
            stop(shared);
            advance(&self.limit_hits);
        }
    }

    fn check_probe(&self, contact: bool, position: &[i32; MOTORS]) {
        let watch = self.watch.load(Ordering::Acquire);
        let met = match watch & Self::KIND {
            kind if kind == ProbeWatch::Contact as u8 => contact,
            kind if kind == ProbeWatch::Release as u8 => !contact,
            _ => false,
        };
        if !met || self.latched_watch.load(Ordering::Relaxed) == watch {
            return;
        }
        for (latched, step) in self.latched.iter().zip(*position) {
            latched.store(step, Ordering::Relaxed);
        }
        self.latched_watch.store(watch, Ordering::Release);
    }

    fn check_buttons(&self, active: u8, shared: &Shared<MOTORS>) {
        let pressed = active & !self.last.load(Ordering::Relaxed);
        self.last.store(active, Ordering::Relaxed);
        if stops(pressed) {
            stop(shared);
        }
        let buttons = [
            (ActiveSwitches::RESET, &self.resets),
            (ActiveSwitches::HOLD, &self.holds),
            (ActiveSwitches::START, &self.starts),
            (ActiveSwitches::DOOR, &self.doors),
        ];
        for (button, count) in buttons {
            if pressed & button != 0 {
                advance(count);
            }
        }
    }
}

/// Returns true if one of the buttons that have been pressed stops the machine.
#[inline]
fn stops(pressed: u8) -> bool {
    pressed & ActiveSwitches::RESET != 0
}

/// Stops steps and light, until the main loop has dealt with the edge that the caller counts next.
fn stop<const MOTORS: usize>(shared: &Shared<MOTORS>) {
    shared.set_laser_off(true);
    shared.set_stop(true);
}

/// `motors`; with all of `sharing` as well if any of `motors` is among them.
pub fn with_sharing(motors: MotorMask, sharing: MotorMask) -> MotorMask {
    if sharing.without(motors) == sharing {
        motors
    } else {
        motors.with(sharing)
    }
}

fn advance(count: &AtomicU8) {
    count.store(
        count.load(Ordering::Relaxed).wrapping_add(1),
        Ordering::Release,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLOSED_X: Switches = Switches {
        limits: MotorMask::from_bits(0xFE),
        ..Switches::OPEN
    };
    const CONTACT: Switches = Switches {
        probe: false,
        ..Switches::OPEN
    };

    fn armed() -> (Inputs<3>, Shared<3>) {
        let inputs = Inputs::new();
        inputs.configure(&InputConfig {
            hard_limits: true,
            ..InputConfig::default()
        });
        (inputs, Shared::new())
    }

    #[test]
    fn a_limit_switch_stops_stepping_when_it_closes_and_not_when_it_opens() {
        let (inputs, shared) = armed();
        inputs.on_switches(&CLOSED_X, &shared);
        assert!(shared.is_stopped());
        assert_eq!(inputs.edges().limit_hits, 1);
        shared.set_stop(false);
        inputs.on_switches(&Switches::OPEN, &shared);
        assert!(!shared.is_stopped());
    }

    #[test]
    fn what_would_stop_is_known_before_it_does() {
        let pressed = Switches {
            reset: false,
            ..Switches::OPEN
        };
        for (switches, moving, homing) in [
            (CLOSED_X, false, 0),
            (CLOSED_X, true, 0),
            (CLOSED_X, true, 1),
            (pressed, false, 0),
            (pressed, true, 0),
            (CONTACT, true, 0),
            (Switches::OPEN, true, 0),
        ] {
            let (inputs, shared) = armed();
            inputs.watch_homing(MotorMask::from_bits(homing), MotorMask::NONE);
            if moving {
                shared.set_running();
            }
            let would = inputs.would_stop(&switches);
            inputs.on_switches(&switches, &shared);
            assert_eq!(would, shared.is_stopped(), "{switches:?}");
            assert_eq!(would, shared.is_laser_off(), "{switches:?}");
            assert!(!inputs.would_stop(&switches), "once");
        }
    }

    #[test]
    fn a_reset_button_stops_and_darkens_at_once_whether_there_is_motion_or_not() {
        let pressed = Switches {
            reset: false,
            ..Switches::OPEN
        };
        for moving in [false, true] {
            let (inputs, shared) = armed();
            if moving {
                shared.set_running();
            }
            inputs.on_switches(&pressed, &shared);
            assert!(shared.is_stopped() && shared.is_laser_off());
            assert_eq!(inputs.edges().resets, 1);
        }
    }

    #[test]
    fn the_probe_latches_the_position_at_the_edge_not_the_one_after_the_filter() {
        let (inputs, shared) = armed();
        inputs.watch_probe(ProbeWatch::Contact);
        shared.set_position([4, 5, 6]);
        inputs.on_switches_at(&CONTACT, &shared, &[1, 2, 3]);
        assert_eq!(inputs.latched(), Some([1, 2, 3]));
    }

    #[test]
    fn a_limit_switch_that_is_awaited_locks_its_motor_only() {
        let (inputs, shared) = armed();
        inputs.watch_homing(MotorMask::from_bits(0b011), MotorMask::NONE);
        inputs.on_switches(&CLOSED_X, &shared);
        assert_eq!(shared.motor_lock(), MotorMask::only(0));
        assert!(!shared.is_stopped());
    }

    #[test]
    fn a_motor_that_is_absent_has_no_switch_whichever_level_is_active() {
        let inputs = Inputs::<4>::new();
        for (limits_invert, closed) in [(true, Switches::OPEN.limits), (false, MotorMask::NONE)] {
            for (absent, limits) in [(MotorMask::only(3), 0b0111), (MotorMask::NONE, 0b1111)] {
                inputs.configure(&InputConfig {
                    limits_invert,
                    absent,
                    ..InputConfig::default()
                });
                let switches = Switches {
                    limits: closed,
                    ..Switches::OPEN
                };
                assert_eq!(inputs.active(&switches).limits.bits(), limits);
            }
        }
    }

    #[test]
    fn the_probe_latches_once_a_watch() {
        let (inputs, shared) = armed();
        shared.set_position([1, 2, 3]);
        inputs.on_switches(&CONTACT, &shared);
        assert_eq!(inputs.latched(), None);
        inputs.watch_probe(ProbeWatch::Contact);
        assert_eq!(inputs.latched(), None);
        inputs.on_switches(&CONTACT, &shared);
        shared.set_position([7, 7, 7]);
        inputs.on_switches(&CONTACT, &shared);
        assert_eq!(inputs.latched(), Some([1, 2, 3]));
        inputs.watch_probe(ProbeWatch::Release);
        assert_eq!(inputs.latched(), None);
        inputs.on_switches(&Switches::OPEN, &shared);
        assert_eq!(inputs.latched(), Some([7, 7, 7]));
        inputs.watch_probe(ProbeWatch::Off);
        assert_eq!(inputs.latched(), None);
    }

    #[test]
    fn a_button_counts_when_pressed_and_a_door_where_there_is_one() {
        let (inputs, shared) = armed();
        let pressed = Switches {
            hold: false,
            door: false,
            ..Switches::OPEN
        };
        inputs.on_switches(&pressed, &shared);
        inputs.on_switches(&pressed, &shared);
        assert_eq!((inputs.edges().holds, inputs.edges().doors), (1, 0));
        inputs.configure(&InputConfig {
            door: true,
            ..InputConfig::default()
        });
        inputs.on_switches(&pressed, &shared);
        assert_eq!(inputs.edges().doors, 1);
    }
}
