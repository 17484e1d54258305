//! The machine's state, as `?` reports it, and the events that change it.
//!
//! ```text
//!              motion begins           0x84, door opens (not in Alarm, Check, Sleep, Home)
//!    +------+ ---------------> +-----+ ------------> +----------------+
//!    | Idle |   motion ends    | Run |               | Door: Stopping |
//!    +------+ <--------------- +-----+               |   Retracting   |
//!     ^ ^ |      $J=  +-----+   |   ^                |   Parked  --~--+--> Restoring --> Idle, Run
//!     | | +---------> | Jog |   | ! | ~              +----------------+
//!     | +------------ +-----+   v   |
//!     |                  +---------------+     0x18 in motion, limits, failed cycles
//!     +----- ~ ----------| Hold:Stopping |    any ------------------------> Alarm -- $X --> Idle
//!                        | Hold:Complete |
//!                        +---------------+     Home: $H; Check: $C; Sleep: $SLP, left by 0x18 only
//! ```
//!
//! Phases are data of their state, so that none can contradict another. Each event is one method:
//! it returns the next state, or `None` if the event means nothing.
//!
//! The machine remembers the states that it has been in: a test that fails prints them.

use crate::board::Instant;
use crate::protocol::alarm::Alarm;

/// The activity of the machine.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// At rest, ready for lines.
    #[default]
    Idle,
    /// A program's motion is under way.
    Run,
    /// A jog is under way.
    Jog(Jog),
    /// Motion is held.
    Hold(Hold),
    /// Homing.
    Home,
    /// The safety door is, or was, open.
    Door(Door),
    /// Locked until `$X`, `$H` or a reset.
    Alarm(Lock),
    /// Lines are checked, nothing moves.
    Check,
    /// Asleep until a reset.
    Sleep,
}

/// The way in which a jog goes on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Jog {
    /// The jog goes on to its end.
    Moving,
    /// The jog slows down. Once it stands, the rest of its way is forgotten.
    Cancelling {
        /// True if the safety door has opened meanwhile: then the door's sequence follows.
        then_door: bool,
    },
}

/// The stage of a feed hold.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Hold {
    /// Slowing down on the path (`Hold:1`).
    Stopping {
        /// The time at which the hold began.
        since: Instant,
        /// The stop is due to a soft limit: ALARM:2 follows.
        then_alarm: bool,
    },
    /// At rest (`Hold:0`).
    Complete {
        /// The time at which the hold began to stop motion; `None` if nothing moved, or if a report
        /// has told a sender that motion is at rest.
        since: Option<Instant>,
        /// `~` has come, and motion goes on at this instant: the spindle is getting up to speed.
        goes_on_at: Option<Instant>,
    },
}

impl Hold {
    /// A hold that has stopped nothing.
    pub const AT_REST: Self = Self::Complete {
        since: None,
        goes_on_at: None,
    };

    /// Returns when motion goes on by itself.
    pub(crate) fn goes_on_at(self) -> Option<Instant> {
        match self {
            Self::Complete { goes_on_at, .. } => goes_on_at,
            Self::Stopping { .. } => None,
        }
    }
}

/// The stage of the safety door's sequence.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Door {
    /// Slowing down on the path (`Door:2`).
    Stopping,
    /// Pulling out, switching off, parking (`Door:2`).
    Retracting,
    /// At rest; the door may be open (`Door:1`) or shut (`Door:0`).
    Parked,
    /// Going back, switching on (`Door:3`).
    Restoring,
}

/// The command that unlocks an alarm.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Lock {
    /// `$X` and `$H` unlock it.
    Unlockable,
    /// Only a reset unlocks it; lines are not answered (ALARM:1 and 2).
    Critical,
}

impl State {
    /// Returns true if motion planned by lines or cycles may be under way.
    pub fn is_moving(self) -> bool {
        match self {
            Self::Run | Self::Jog(_) | Self::Home | Self::Sleep => true, // asleep: parking
            Self::Hold(hold) => matches!(hold, Hold::Stopping { .. }),
            Self::Door(door) => door != Door::Parked,
            Self::Idle | Self::Alarm(_) | Self::Check => false,
        }
    }

    /// Returns true if lines are taken and executed at all.
    pub fn takes_lines(self) -> bool {
        match self {
            Self::Idle | Self::Run | Self::Jog(Jog::Moving) | Self::Check => true,
            Self::Alarm(lock) => lock == Lock::Unlockable,
            Self::Jog(Jog::Cancelling { .. })
            | Self::Hold(_)
            | Self::Home
            | Self::Door(_)
            | Self::Sleep => false,
        }
    }

    /// Returns true if motion may be started out of rest.
    pub fn may_start(self) -> bool {
        match self {
            Self::Idle | Self::Run | Self::Jog(Jog::Moving) | Self::Home => true,
            Self::Jog(Jog::Cancelling { .. })
            | Self::Hold(_)
            | Self::Door(_)
            | Self::Alarm(_)
            | Self::Check
            | Self::Sleep => false,
        }
    }

    /// Returns the next state once the program's motion has begun, out of rest.
    pub fn motion_begins(self) -> Option<Self> {
        (self == Self::Idle).then_some(Self::Run)
    }

    /// Returns the next state after `!` or the hold button. `moving`: whether there is anything to
    /// slow down.
    pub fn feed_hold(self, moving: bool, now: Instant) -> Option<Self> {
        match self {
            Self::Idle | Self::Run if moving => Some(Self::Hold(Hold::Stopping {
                since: now,
                then_alarm: false,
            })),
            Self::Idle
            | Self::Run
            | Self::Hold(Hold::Complete {
                goes_on_at: Some(_),
                ..
            }) => Some(Self::Hold(Hold::AT_REST)),
            Self::Jog(_) => self.jog_cancel(),
            Self::Hold(_)
            | Self::Home
            | Self::Door(_)
            | Self::Alarm(_)
            | Self::Check
            | Self::Sleep => None,
        }
    }

    /// Returns the next state after 0x85.
    pub fn jog_cancel(self) -> Option<Self> {
        (self == Self::Jog(Jog::Moving)).then_some(Self::Jog(Jog::Cancelling { then_door: false }))
    }

    /// Returns the next state after 0x84 or an edge of the door's switch. `moving`: whether there
    /// is anything to slow down. An open door, or a sleeping machine, stays as it is.
    pub fn door_opens(self, moving: bool) -> Option<Self> {
        match self {
            Self::Jog(_) => Some(Self::Jog(Jog::Cancelling { then_door: true })),
            Self::Idle | Self::Run | Self::Hold(_) => Some(Self::Door(if moving {
                Door::Stopping
            } else {
                Door::Retracting
            })),
            Self::Door(Door::Restoring) => Some(Self::Door(Door::Retracting)),
            Self::Door(_) | Self::Sleep => Some(self),
            Self::Home | Self::Alarm(_) | Self::Check => None,
        }
    }

    /// Returns the next state once a hold or a door has brought motion to rest.
    pub fn stopped(self) -> Option<Self> {
        match self {
            Self::Hold(Hold::Stopping {
                since,
                then_alarm: false,
            }) => Some(Self::Hold(Hold::Complete {
                since: Some(since),
                goes_on_at: None,
            })),
            Self::Hold(Hold::Stopping {
                then_alarm: true, ..
            }) => Some(Self::Alarm(Lock::Critical)),
            Self::Door(Door::Stopping) => Some(Self::Door(Door::Retracting)),
            Self::Jog(Jog::Cancelling { then_door }) => Some(if then_door {
                Self::Door(Door::Retracting)
            } else {
                Self::Idle
            }),
            Self::Idle
            | Self::Run
            | Self::Jog(Jog::Moving)
            | Self::Hold(Hold::Complete { .. })
            | Self::Home
            | Self::Door(_)
            | Self::Alarm(_)
            | Self::Check
            | Self::Sleep => None,
        }
    }

    /// Returns the state as status reports spell it. `ajar`: whether the door is open now.
    pub fn name(self, ajar: bool) -> &'static str {
        match self {
            Self::Idle => "Idle",
            Self::Run => "Run",
            Self::Jog(_) => "Jog",
            Self::Hold(Hold::Complete { .. }) => "Hold:0",
            Self::Hold(Hold::Stopping { .. }) => "Hold:1",
            Self::Home => "Home",
            Self::Door(Door::Parked) if ajar => "Door:1",
            Self::Door(Door::Parked) => "Door:0",
            Self::Door(Door::Stopping | Door::Retracting) => "Door:2",
            Self::Door(Door::Restoring) => "Door:3",
            Self::Alarm(_) => "Alarm",
            Self::Check => "Check",
            Self::Sleep => "Sleep",
        }
    }
}

/// States that are remembered.
const STATES: usize = 8;

/// The states that the machine has left, and its last alarm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct History {
    /// The first poll is over.
    pub(crate) booted: bool,
    /// The last alarm since power-up.
    pub(crate) last_alarm: Option<Alarm>,
    /// The last states that the machine has left: a ring.
    states: [State; STATES],
    /// The number of states left since power-up.
    left: usize,
}

impl History {
    /// Begins as at power-up.
    pub(crate) const fn new() -> Self {
        Self {
            booted: false,
            last_alarm: None,
            states: [State::Idle; STATES],
            left: 0,
        }
    }

    /// Notes that the machine leaves `state`.
    #[inline(never)] // inlined, a record of four motors takes 316 bytes more
    pub(crate) fn leaves(&mut self, state: State) {
        if let Some(place) = self.states.get_mut(self.left % STATES) {
            *place = state;
        }
        self.left = self.left.wrapping_add(1);
    }

    /// The last states that the machine has left, the oldest first.
    pub(crate) fn states(&self) -> impl Iterator<Item = State> + '_ {
        let known = self.left.min(STATES);
        let first = self.left.wrapping_sub(known);
        (0..known)
            .filter_map(move |index| self.states.get(first.wrapping_add(index) % STATES).copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_last_eight_states_are_remembered_in_order() {
        let mut history = History::new();
        assert_eq!(history.states().count(), 0);
        history.leaves(State::Idle);
        history.leaves(State::Run);
        let states: Vec<_> = history.states().collect();
        assert_eq!(states, [State::Idle, State::Run]);
        for _ in 0..10 {
            history.leaves(State::Home);
            history.leaves(State::Check);
        }
        let states: Vec<_> = history.states().collect();
        assert_eq!(states, [State::Home, State::Check].repeat(4));
    }
}
