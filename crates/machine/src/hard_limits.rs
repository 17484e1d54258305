//! A limit switch that stays closed (`$21=1`), and the jogs that are still allowed.
//!
//! The edge stops the machine ([`crate::inputs`]). As long as the switch is closed after that, programs are refused, and of the
//! jogs those that lead farther into it:
//!
//! | the switch closed | a jog of its axis |
//! |---|---|
//! | while the axis moved | against that motion |
//! | at rest, or nobody knows | either way, at `$25` at most: both ends of an axis may be on one input |

use crate::board::Board;
use crate::extension::Extension;
use crate::interpreter::{Coordinate, Feed, Jog};
use crate::machine::Machine;
use crate::protocol::message::Message;
use crate::protocol::status::Status;
use crate::settings::table::Setting;
use core::cmp::Ordering;
use leadscrew_gcode::Number;
use leadscrew_planner::Kinematics;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Notes which way motors go, and where a limit switch has closed or opened. `hit`: one has stopped the machine. Main loop, at
    /// every turn, before anything moves on.
    pub(crate) fn watch_limits<B: Board>(&mut self, hit: bool, board: &B) {
        if !self.settings.is_on(Setting::HardLimits) {
            return;
        }
        self.switches.ends.follow(&self.motion.shared.position());
        if hit || self.switches.ends.closed.iter().any(Option::is_some) {
            self.look_at_limits(board);
        }
        if self.motion.is_at_rest() {
            self.switches.ends.heading = [0; MOTORS];
        }
    }

    /// Whether a limit switch is closed that allows jogs only. At rest.
    pub(crate) fn is_at_limit<B: Board>(&mut self, board: &B) -> bool {
        if !self.settings.is_on(Setting::HardLimits) {
            return false;
        }
        self.look_at_limits(board);
        self.switches.ends.closed.iter().any(Option::is_some)
    }

    /// Lets a jog lead away from a closed switch, slowly where nobody knows which way that is.
    ///
    /// # Errors
    /// [`Status::JogOutOfTravel`] where it leads farther into it.
    pub(crate) fn bound_jog<B: Board>(
        &mut self,
        jog: &mut Jog<AXES>,
        board: &B,
    ) -> Result<(), Status> {
        if !self.is_at_limit(board) {
            return Ok(());
        }
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

    fn look_at_limits<B: Board>(&mut self, board: &B) {
        let active = self.switches.inputs.active(&board.switches());
        let axes = self.switches.axes_at_limits(&active);
        let ways = self.motion.axes(&self.switches.ends.heading);
        for (axis, (closed, way)) in self.switches.ends.closed.iter_mut().zip(ways).enumerate() {
            *closed = match *closed {
                _ if !axes.contains(axis) => None,
                None => Some(way.cmp(&Coordinate::ZERO)),
                known => known,
            };
        }
    }
}

const NONE: Number = Number::from_int(0);

/// A feed of no more than `most` mm/min. A jog has no other sort of feed.
fn at_most(feed: Feed, most: Number) -> Feed {
    match feed {
        Feed::PerMinute(rate) => Feed::PerMinute(rate.min(most)),
        Feed::Rapid | Feed::InverseTime(_) => feed,
    }
}
