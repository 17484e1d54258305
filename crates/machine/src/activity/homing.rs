//! `$H`: finding the limit switches, axis group by axis group.
//!
//! ```text
//!  search ($25, 1.5 x travel) --contact--> pull off ($27) --> locate ($24, 5 x $27) --+
//!     | no contact                           | still closed     | no contact          | contact
//!     v                                      v                  v                     v
//!  ALARM:9                                ALARM:8            ALARM:9               pull off
//!                                                                             next group, or done
//! ```
//!
//! An axis with two motors ([`crate::config::Squaring`]) is squared on the way. Each motor is
//! locked at its own switch, and the approach is over once both are:
//!
//! ```text
//!   start, skewed       first contact       second contact      2 goes on by $702, both back
//!   1 --o               1 --------o|        1 --------o|        1 --------o|
//!        \        ->             /    ->              |   ->              \
//!   2 ----o             2 -----o   |        2 --------o|        2 ---------o|
//! ```
//!
//! Both motors have the same count of steps at the start of each motion. So the difference of their
//! counts is the distance, in steps, by which one motor has gone on since the other was locked. If
//! it is longer than the configuration allows, that is ALARM:10. Afterwards both count as one motor
//! again.
//!
//! Axes that share motors (crossed belts) home one by one, whatever their group, and a contact
//! locks all of these motors.
//!
//! Before each motion the switches have `$26` milliseconds to settle. The main loop locks the
//! motors whose switch is closed already. Then it leaves the motor lock to the switch interrupt,
//! its only writer until the approach ends. At a contact the switch interrupt locks the motor at
//! that very step ([`crate::inputs`]). The group's other axes go on until they meet their switches.
//! Rates are multiplied by √n for n axes at once, so that each axis moves at the set rate.

use super::switch_cycle::{LastMove, Phase, SwitchCycle, Wait};
use crate::activity::line::Origin;
use crate::board::{Board, Duration, Instant};
use crate::config::AxisMask;
use crate::console::Discard;
use crate::dual::DualAxis;
use crate::extension::Extension;
use crate::home;
use crate::inputs::{with_sharing, InputConfig};
use crate::machine::Machine;
use crate::motion::own_feed;
use crate::protocol::alarm::Alarm;
use crate::settings::table::{AxisSetting, Setting};
use crate::state::State;
use leadscrew_gcode::Number;
use leadscrew_planner::{Coordinate, Kinematics, Move, MoveKind, MovePower, THREE_DECIMALS};
use leadscrew_stepper::{MotorMask, OutputChange};

/// The length of a search, in travels of the axis.
const SEARCH_TRAVELS: f32 = 1.5;
/// The length of the second approach, in pull-off distances.
const LOCATE_PULL_OFFS: f32 = 5.0;
/// A rate of 0 is taken as this, mm/min.
const SLOWEST: f32 = 0.001;
/// A move without a way takes this, min.
const SHORTEST: f32 = 1e-15;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Begins to home `groups` of axes, one after the other; the line is answered at the end. The
    /// spindle stops until the next move.
    pub(crate) fn begin_homing(&mut self, origin: Origin, groups: [AxisMask; 4], now: Instant) {
        self.enter(State::Home);
        self.stop_cutting();
        self.tool.spindle.stand(0.0);
        self.update_power();
        self.switches.inputs.configure(&InputConfig {
            hard_limits: false,
            ..self.input_config()
        });
        let all = groups.iter().fold(0, |all, group| all | group);
        let without = self.config.rules.without_switch;
        self.activity.switch_cycle = Some(SwitchCycle {
            origin,
            groups: groups.map(|group| group & !without),
            last: match all & without {
                0 => LastMove::None,
                axes => LastMove::ToZero(axes),
            },
            one_by_one: self.motion.sharing().bits(),
            phase: Phase::Search,
            wait: Wait::Settled(now),
        });
    }

    /// Goes on with homing. Main loop.
    pub(crate) fn advance_homing<B: Board>(&mut self, board: &mut B, now: Instant) {
        let Some(cycle) = self.activity.switch_cycle else {
            return;
        };
        let Some(group) = cycle.group() else {
            return self.advance_last_move(&cycle, board, now);
        };
        match cycle.wait {
            Wait::Settled(instant) => {
                if now >= instant && !self.motion.is_stopping() {
                    self.begin_phase(cycle.phase, group, board);
                }
            }
            Wait::Motion if cycle.phase.approaches() => self.watch_approach(group, board, now),
            Wait::Motion if cycle.phase == Phase::Offset => {
                if self.motion.is_aside_idle() {
                    self.motion.end_aside();
                    self.end_phase(now);
                }
            }
            Wait::Motion => self.watch_pull_off(group, board, now),
        }
    }

    /// Begins a motion. If a switch closes just now, the next poll begins it instead.
    fn begin_phase<B: Board>(&mut self, phase: Phase, group: AxisMask, board: &B) {
        match phase {
            Phase::Search | Phase::Locate => {
                if !self.watch_switches(self.motors_of(group), board) {
                    return;
                }
            }
            Phase::Offset => {
                let second = self.motors_of(group).without(MotorMask::from_bits(group));
                let all = MotorMask::from_bits(u8::MAX);
                self.motion.shared.set_motor_lock(all.without(second));
            }
            Phase::PullOff | Phase::FinalPullOff => {
                self.motion.shared.set_motor_lock(MotorMask::NONE)
            }
        }
        let next = self.homing_move(phase, group);
        // A distance of 0 plans nothing: the phase then ends at once.
        let _ = self.motion.push_aside(&next);
        if let Some(cycle) = &mut self.activity.switch_cycle {
            cycle.wait = Wait::Motion;
        }
    }

    /// Locks the motors whose switch is closed already, and lets the switch interrupt lock the
    /// others. Returns whether all motors with a closed switch are locked. An edge between the two
    /// steps locks no motor: the next poll then tries again. At rest.
    fn watch_switches<B: Board>(&self, motors: MotorMask, board: &B) -> bool {
        let sharing = self.motion.sharing();
        self.switches.inputs.watch_homing(MotorMask::NONE, sharing);
        let lock = with_sharing(self.closed(motors, board), sharing);
        self.motion.shared.set_motor_lock(lock);
        self.switches.inputs.watch_homing(motors, sharing);
        self.closed(motors, board)
            .without(self.motion.shared.motor_lock())
            .is_empty()
    }

    /// The motors among `motors` whose limit switch is closed.
    fn closed<B: Board>(&self, motors: MotorMask, board: &B) -> MotorMask {
        let closed = self.switches.inputs.active(&board.switches()).limits;
        motors.without(motors.without(closed))
    }

    fn homing_move(&self, phase: Phase, group: AxisMask) -> Move<AXES> {
        let moving = match phase {
            Phase::Offset => self.dual_of(group).map_or(0, |dual| axis_bit(dual.axis)),
            Phase::Search | Phase::PullOff | Phase::Locate | Phase::FinalPullOff => group,
        };
        // The time of the axis that takes longest, min.
        let time = (0..AXES).filter(|axis| moving >> axis & 1 == 1);
        let time = time.fold(SHORTEST, |time, axis| {
            let way = self.homing_way(phase, group, axis).abs();
            time.max(way / self.homing_rate(phase, axis))
        });
        let mut target = self.motion.position();
        let mut squares = 0.0;
        for (axis, target) in target.iter_mut().enumerate() {
            if moving >> axis & 1 == 0 {
                continue;
            }
            let way = match phase {
                // All go on for that time, each at its own rate: the faster ones go farther than
                // they have to.
                Phase::Search | Phase::Locate => time * self.homing_rate(phase, axis),
                Phase::PullOff | Phase::FinalPullOff | Phase::Offset => {
                    self.homing_way(phase, group, axis)
                }
            };
            squares += way * way;
            let way = Coordinate::from_mm(way).unwrap_or_default();
            *target = match self.homes_negative(axis) {
                true => *target - way,
                false => *target + way,
            };
        }
        Move {
            target,
            feed: own_feed(libm::sqrtf(squares) / time),
            power: MovePower::Off,
            curve: None,
            rounding: THREE_DECIMALS,
            outputs: OutputChange::NONE,
            line_number: None,
            kind: MoveKind::System,
        }
    }

    /// Returns how far an axis goes in a phase at least, mm; back off its switch if negative.
    fn homing_way(&self, phase: Phase, group: AxisMask, axis: usize) -> f32 {
        let pull_off = home::pull_off(&self.settings, axis).to_mm();
        match phase {
            Phase::Search => SEARCH_TRAVELS * self.longest_travel(group),
            Phase::Locate => LOCATE_PULL_OFFS * pull_off,
            Phase::PullOff | Phase::FinalPullOff => -pull_off,
            Phase::Offset => self.settings.value(Setting::SecondMotorOffset).to_f32(),
        }
    }

    /// Returns how fast an axis goes in a phase, mm/min.
    fn homing_rate(&self, phase: Phase, axis: usize) -> f32 {
        let (own, common) = match phase {
            Phase::Search | Phase::PullOff | Phase::FinalPullOff => {
                (AxisSetting::HomeSeek, Setting::HomingSeek)
            }
            Phase::Locate | Phase::Offset => (AxisSetting::HomeFeed, Setting::HomingFeed),
        };
        let rate = home::of_axis(&self.settings, own, common, axis);
        rate.to_f32().max(SLOWEST)
    }

    fn longest_travel(&self, group: AxisMask) -> f32 {
        let bounds = self.motion.bounds.iter().enumerate();
        bounds
            .filter(|(axis, _)| group >> axis & 1 == 1)
            .fold(Coordinate::ZERO, |longest, (_, of)| {
                longest.max(of.travel())
            })
            .to_mm()
    }

    fn homes_negative(&self, axis: usize) -> bool {
        self.settings.mask(Setting::HomingDirection) >> axis & 1 == 1
    }

    /// Ends the approach once all switches of the group have closed. If the motion ends before
    /// that, the alarm is ALARM:9. If two switches of one axis are too far apart, it is ALARM:10.
    fn watch_approach<B: Board>(&mut self, group: AxisMask, board: &mut B, now: Instant) {
        let lock = self.motion.shared.motor_lock();
        if self.is_skewed(group) {
            self.fail_homing(Alarm::HomingDualApproach, board, now);
        } else if self.motors_of(group).without(lock).is_empty() {
            self.motion.stop();
            self.end_phase(now);
        } else if self.motion.is_aside_idle() {
            self.fail_homing(Alarm::HomingApproach, board, now);
        }
    }

    /// The pull-off ends with its motion; a switch that is still closed then is ALARM:8.
    fn watch_pull_off<B: Board>(&mut self, group: AxisMask, board: &mut B, now: Instant) {
        if !self.motion.is_aside_idle() {
            return;
        }
        self.motion.end_aside();
        if self.closed(self.motors_of(group), board).is_empty() {
            self.end_phase(now);
        } else {
            self.fail_homing(Alarm::HomingPullOff, board, now);
        }
    }

    /// Returns true if one motor of a dual axis has gone on too far without its switch.
    fn is_skewed(&self, group: AxisMask) -> bool {
        let Some(dual) = self.dual_of(group) else {
            return false;
        };
        let counted = self.motion.shared.position();
        let (Some(first), Some(second)) = (counted.get(dual.axis), counted.get(dual.motor)) else {
            return false;
        };
        let config = self.motion.config();
        let steps_per_mm = config.steps_per_mm.get(dual.axis);
        let bounds = self.motion.bounds.get(dual.axis);
        let travel = bounds.map_or(0.0, |of| of.travel().to_mm());
        let allowed = self.config.squaring.allowance(travel)
            * steps_per_mm.map_or(0.0, |scale| scale.to_f32());
        first.wrapping_sub(*second).unsigned_abs() as f32 > allowed
    }

    fn end_phase(&mut self, now: Instant) {
        let group = self
            .activity
            .switch_cycle
            .as_ref()
            .and_then(SwitchCycle::group)
            .unwrap_or(0);
        let offset = self.settings.value(Setting::SecondMotorOffset) != Number::from_int(0);
        let offset = offset && self.dual_of(group).is_some();
        self.switches
            .inputs
            .watch_homing(MotorMask::NONE, MotorMask::NONE);
        let debounce =
            Duration::from_ticks(u64::from(self.settings.whole(Setting::HomingDebounce)) * 1_000);
        let Some(cycle) = &mut self.activity.switch_cycle else {
            return;
        };
        cycle.wait = Wait::Settled(now + debounce);
        match cycle.phase.next(offset) {
            Some(next) => cycle.phase = next,
            None => {
                cycle.end_group();
                cycle.phase = Phase::Search;
                self.set_home(group);
            }
        }
    }

    /// Sets the position of the axes of `group`: each is a pull-off away from its switch.
    fn set_home(&mut self, group: AxisMask) {
        let mut position = self.motion.position();
        let ends = self.motion.bounds.iter();
        for (axis, (position, ends)) in position.iter_mut().zip(ends).enumerate() {
            if group >> axis & 1 == 1 {
                let pull_off = home::pull_off(&self.settings, axis);
                *position = ends.place(pull_off, self.homes_negative(axis));
            }
        }
        self.motion.set_position(&position);
        self.take_position();
    }

    pub(crate) fn end_homing(&mut self) {
        if let Some(homing) = self.activity.switch_cycle.take() {
            self.release_homing();
            self.enter(State::Idle);
            self.program.startup.begin(Some(homing.origin));
        }
    }

    /// Puts motor lock and limit switches back to their state outside homing.
    pub(crate) fn release_homing(&mut self) {
        self.switches
            .inputs
            .watch_homing(MotorMask::NONE, MotorMask::NONE);
        self.motion.shared.set_motor_lock(MotorMask::NONE);
        self.switches.inputs.configure(&self.input_config());
    }

    /// Ends homing with an alarm: message, answer, reset and banner at once.
    pub(crate) fn fail_homing<B: Board>(&mut self, alarm: Alarm, board: &mut B, now: Instant) {
        self.fail_homing_and_discard(alarm, Discard::Nothing, board, now);
    }

    /// Ends homing after 0x18 or the reset button.
    pub(crate) fn reset_homing<B: Board>(&mut self, discard: Discard, board: &mut B, now: Instant) {
        self.fail_homing_and_discard(Alarm::HomingReset, discard, board, now);
    }

    fn fail_homing_and_discard<B: Board>(
        &mut self,
        alarm: Alarm,
        discard: Discard,
        board: &mut B,
        now: Instant,
    ) {
        self.motion.stop();
        self.raise(alarm, board);
        if let Some(homing) = self.activity.switch_cycle.take() {
            self.answer(homing.origin, Ok(()));
        }
        self.restart(discard, board, now);
    }

    /// The axis with two motors, if it is in `group`.
    fn dual_of(&self, group: AxisMask) -> Option<DualAxis> {
        self.switches
            .dual
            .filter(|dual| group & axis_bit(dual.axis) != 0)
    }

    /// The motors of a group: each axis has the motor of its own number, the axis with two motors
    /// also the second one.
    fn motors_of(&self, group: AxisMask) -> MotorMask {
        let own = MotorMask::from_bits(group);
        let dual = self.dual_of(group);
        dual.map_or(own, |dual| own.with(MotorMask::only(dual.motor)))
    }
}

/// The mask of one axis.
fn axis_bit(axis: usize) -> AxisMask {
    MotorMask::only(axis).bits()
}
