//! A limit switch that stays closed (`$21=1`), and the jogs that are still allowed.
//!
//! The edge stops the machine ([`crate::inputs`]). While the switch stays closed after that,
//! programs are refused, and so are jogs that lead farther into the switch:
//!
//! | the switch closed | a jog of its axis |
//! |---|---|
//! | while the axis moved | against that motion |
//! | at rest, or nobody knows | either way, at `$25` at most: both ends may be on one input |
//!
//! If the build says at which end the only switch of an axis stands
//! ([`SwitchRules`](crate::config::SwitchRules)), the switch stops only motion towards that end:
//! programs may move away from the closed switch.

use crate::board::Board;
use crate::extension::Extension;
use crate::interpreter::{Coordinate, Feed, Jog};
use crate::machine::Machine;
use crate::protocol::message::Message;
use crate::protocol::status::Status;
use crate::settings::table::Setting;
use crate::state::State;
use core::cmp::Ordering;
use leadscrew_gcode::Number;
use leadscrew_planner::Kinematics;
use leadscrew_stepper::MotorMask;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Notes the direction of each motor, and which limit switches have closed or opened. `hit`: a
    /// limit switch has stopped the machine. Returns whether a limit switch is to stop the machine:
    /// on `hit`, or if an axis moves farther into its closed switch. Main loop, at every turn,
    /// before any motion goes on.
    pub(crate) fn watch_limits<B: Board>(&mut self, hit: bool, board: &B) -> bool {
        if !self.settings.is_on(Setting::HardLimits) {
            return hit;
        }
        self.switches.ends.follow(&self.motion.shared.position());
        let closed = &self.switches.ends.closed;
        let looks = hit || self.config.rules.are_own() || closed.iter().any(Option::is_some);
        let leads_into = looks && self.look_at_limits(board);
        if self.motion.is_at_rest() {
            self.switches.ends.heading = [0; MOTORS];
        }
        hit || leads_into && !matches!(self.state, State::Home | State::Alarm(_))
    }

    /// Returns true if a limit switch is closed, so that only jogs are allowed. At rest.
    pub(crate) fn is_at_limit<B: Board>(&mut self, board: &B) -> bool {
        if !self.settings.is_on(Setting::HardLimits) {
            return false;
        }
        self.look_at_limits(board);
        let rules = &self.config.rules;
        let mut closed = self.switches.ends.closed.iter().enumerate();
        closed.any(|(axis, closed)| closed.is_some() && rules.only_end(axis).is_none())
    }

    /// Allows a jog that leads away from a closed switch, slowly if nobody knows in which direction
    /// that is.
    ///
    /// # Errors
    /// [`Status::JogOutOfTravel`] if the jog leads farther into the switch.
    pub(crate) fn bound_jog<B: Board>(
        &mut self,
        jog: &mut Jog<AXES>,
        board: &B,
    ) -> Result<(), Status> {
        if !self.settings.is_on(Setting::HardLimits) {
            return Ok(());
        }
        self.look_at_limits(board);
        let slow = self.settings.value(Setting::HomingSeek);
        let ways = jog.travel.target.iter().zip(&self.motion.path_end);
        for ((target, from), closed) in ways.zip(&self.switches.ends.closed) {
            let way = target.cmp(from);
            match closed {
                Some(Ordering::Equal) if way != Ordering::Equal && slow > NONE => {
                    jog.travel.feed = at_most(jog.travel.feed, slow);
                }
                Some(into)
                    if way != Ordering::Equal && (*into == way || *into == Ordering::Equal) =>
                {
                    self.console.message(Message::CheckLimits);
                    return Err(Status::JogOutOfTravel);
                }
                Some(_) | None => {}
            }
        }
        Ok(())
    }

    /// Notes which switches are closed, and which limit switches stop no motion for now: those that
    /// serve homing alone, and those from which their axis moves away. Returns whether an axis
    /// moves towards its only switch while that switch is closed. A motion that has begun since the
    /// last turn has no direction yet: the next turn finds it.
    pub(crate) fn look_at_limits<B: Board>(&mut self, board: &B) -> bool {
        let active = self.switches.inputs.active(&board.switches());
        let rules = &self.config.rules;
        let mut ignored = MotorMask::from_bits(rules.homing_only);
        let axes = self.switches.axes_at_limits(&active).without(ignored);
        let ways = self.motion.axes(&self.switches.ends.heading);
        let mut leads_into = false;
        for (axis, (closed, way)) in self.switches.ends.closed.iter_mut().zip(ways).enumerate() {
            let (way, end) = (way.cmp(&Coordinate::ZERO), rules.only_end(axis));
            *closed = match *closed {
                _ if !axes.contains(axis) => None,
                None => Some(end.unwrap_or(way)),
                known => known,
            };
            let goes_there = end == Some(way);
            leads_into |= goes_there && closed.is_some();
            if end.is_some() && !goes_there {
                ignored = ignored.with(MotorMask::only(axis));
            }
        }
        if let Some(dual) = self
            .switches
            .dual
            .filter(|dual| ignored.contains(dual.axis))
        {
            ignored = ignored.with(MotorMask::only(dual.motor));
        }
        self.switches.inputs.ignore_limits(ignored);
        leads_into
    }
}

const NONE: Number = Number::from_int(0);

/// Limits a feed to `most` mm/min. A jog has no other sort of feed.
fn at_most(feed: Feed, most: Number) -> Feed {
    match feed {
        Feed::PerMinute(rate) => Feed::PerMinute(rate.min(most)),
        Feed::Rapid | Feed::InverseTime(_) => feed,
    }
}
