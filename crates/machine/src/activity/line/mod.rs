//! The line under way: its commands, carried out one after the other as the machine can take them.
//!
//! ```text
//!   line --Interpreter--> Commands --+--> next --> perform --+--> Done: the next command,
//!                                    ^                       |          or `ok` after the last
//!                                    +-- at the next poll <--+ Wait
//! ```
//!
//! There is one line at a time, from any sender. The [`Wait`] of a command says what it waits for:
//! room, rest, time or contact.

mod arc;
mod cycle;
mod feed;
mod perform;
mod probe;
mod tool;

use crate::board::{ChannelId, Instant};
use crate::interpreter::{Command, Commands, Strokes};
use arc::ArcFeed;

/// The origin of a line, to which its answer goes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) enum Origin {
    /// A serial line.
    Channel(ChannelId),
    /// A startup line, by its number.
    Startup(u8),
    /// The machine itself: nobody waits for an answer.
    Nobody,
}

/// Says whether a line belongs to the program or is a jog.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum LineKind {
    /// G-code.
    Program,
    /// `$J=`.
    Jog,
}

/// The event that the command under way waits for.
#[derive(Clone, Debug)]
pub(crate) enum Wait<const AXES: usize> {
    /// Nothing: the command has not begun.
    Nothing,
    /// Room for the arc's next chord.
    Arc(ArcFeed<AXES>),
    /// The end of a dwell.
    Dwell(Instant),
    /// Contact of the probe, or the end of the motion.
    Probe(Probing),
    /// The operator's resume (M0).
    Pause,
    /// The event for which an extension's M code waits.
    Own(OwnWait),
    /// The end of storing the line's change.
    Stored {
        /// True if the machine resets itself after the answer (`$RST=`).
        then_restart: bool,
    },
}

/// The event for which an extension's M code waits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum OwnWait {
    /// The next turn of the main loop, at this instant at the latest.
    Turn(Option<Instant>),
    /// The extension's permission to begin the command.
    Gate,
    /// The end of all motion.
    Rest,
    /// The end of a stop that the extension asked for.
    Stop,
}

/// The phase of a probing motion.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Probing {
    /// The machine moves, and the probe is watched.
    Moving,
    /// Contact was made, and motion slows down.
    Stopping,
}

/// Says whether a command is carried out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Progress {
    /// The command is carried out.
    Done,
    /// Not yet: the command is tried again at the next poll.
    Wait,
}

/// The line under way, if there is one.
#[derive(Clone, Debug)]
pub(crate) struct Executor<const AXES: usize> {
    /// The line's origin; `None` while the machine performs no line.
    origin: Option<Origin>,
    kind: LineKind,
    commands: Commands<AXES>,
    next: usize,
    /// The rest of the cycle whose stroke is the next command.
    cycle: Option<Strokes<AXES>>,
    wait: Wait<AXES>,
    /// True if further words of the line follow its commands.
    has_rest: bool,
}

impl<const AXES: usize> Executor<AXES> {
    /// Makes an executor without a line.
    pub(crate) const fn new() -> Self {
        Self {
            origin: None,
            kind: LineKind::Program,
            commands: Commands::new(),
            next: 0,
            cycle: None,
            wait: Wait::Nothing,
            has_rest: false,
        }
    }

    /// The list that takes the commands of the next line. No line may be under way. Follow with
    /// [`Executor::begin`].
    pub(crate) fn commands(&mut self) -> &mut Commands<AXES> {
        &mut self.commands
    }

    /// Takes on the line whose commands were put into [`Executor::commands`].
    pub(crate) fn begin(&mut self, origin: Origin, kind: LineKind) {
        self.origin = Some(origin);
        self.kind = kind;
        self.has_rest = false;
        self.start_commands();
    }

    /// Begins with the first of [`Executor::commands`].
    pub(crate) fn start_commands(&mut self) {
        self.next = 0;
        self.cycle = None;
        self.wait = Wait::Nothing;
    }

    /// Returns true if the line goes on after its commands. Its commands then belong to an M code
    /// that comes first. The machine reads the other words once the M code is done.
    pub(crate) fn has_rest(&self) -> bool {
        self.has_rest
    }

    /// Notes whether the line goes on after its commands.
    pub(crate) fn set_rest(&mut self, has_rest: bool) {
        self.has_rest = has_rest;
    }

    /// Takes on a line that is carried out already; it is answered once its change is stored.
    pub(crate) fn begin_storing(&mut self, origin: Origin, then_restart: bool) {
        self.commands.clear();
        self.begin(origin, LineKind::Program);
        self.wait = Wait::Stored { then_restart };
    }

    /// Returns true if the machine performs a line.
    pub(crate) fn is_busy(&self) -> bool {
        self.origin.is_some()
    }

    /// Forgets the line that is being carried out. Returns the origin of this line, which gets the
    /// answer.
    pub(crate) fn finish(&mut self) -> Option<Origin> {
        self.wait = Wait::Nothing;
        self.origin.take()
    }

    /// Returns true if the machine performs a jog's line.
    pub(crate) fn is_jogging(&self) -> bool {
        self.is_busy() && self.kind == LineKind::Jog
    }

    /// Returns true if the line makes motions of its own: the machine shows `Run` between them.
    pub(crate) fn is_running(&self) -> bool {
        matches!(self.wait, Wait::Probe(_) | Wait::Own(_))
    }

    /// Returns true if the line under way waits for the operator (M0).
    pub(crate) fn is_paused(&self) -> bool {
        matches!(self.wait, Wait::Pause)
    }

    /// Returns true if the line under way dwells.
    pub(crate) fn is_dwelling(&self) -> bool {
        matches!(self.wait, Wait::Dwell(_))
    }

    /// Returns true if the line under way waits for the store.
    pub(crate) fn is_storing(&self) -> bool {
        matches!(self.wait, Wait::Stored { .. })
    }

    /// Returns true if the machine starts anew after the line under way.
    fn then_restart(&self) -> bool {
        matches!(self.wait, Wait::Stored { then_restart: true })
    }

    /// Returns true if the machine can carry out the next part of its line now. `resting`: motion
    /// rests; `room`: the planner has room. A line that waits for the store wants the next poll at
    /// once, since the board writes the store between two polls.
    pub(crate) fn can_advance(&self, resting: bool, room: impl FnOnce() -> bool) -> bool {
        self.is_busy()
            && match self.wait {
                Wait::Nothing if self.cycle.is_some() && self.moves_next() => resting || room(),
                Wait::Nothing | Wait::Own(OwnWait::Rest | OwnWait::Stop) => resting,
                Wait::Arc(_) => room(),
                Wait::Stored { .. } => true,
                Wait::Dwell(_)
                | Wait::Probe(_)
                | Wait::Pause
                | Wait::Own(OwnWait::Turn(_) | OwnWait::Gate) => false,
            }
    }

    /// Returns when a dwell ends, or an extension's M code wants to be asked again.
    pub(crate) fn wakes(&self) -> Option<Instant> {
        match self.wait {
            Wait::Dwell(at) | Wait::Own(OwnWait::Turn(Some(at))) => Some(at),
            Wait::Nothing
            | Wait::Arc(_)
            | Wait::Probe(_)
            | Wait::Pause
            | Wait::Own(_)
            | Wait::Stored { .. } => None,
        }
    }

    /// The event for which an extension's M code waits, once it has begun.
    pub(crate) fn own_wait(&self) -> Option<OwnWait> {
        match self.wait {
            Wait::Own(wait) => Some(wait),
            Wait::Nothing
            | Wait::Arc(_)
            | Wait::Dwell(_)
            | Wait::Probe(_)
            | Wait::Pause
            | Wait::Stored { .. } => None,
        }
    }

    /// Makes the line under way wait until its change is stored.
    pub(crate) fn begin_waiting_for_store(&mut self) {
        self.wait = Wait::Stored {
            then_restart: false,
        };
    }

    /// Makes the line under way wait for this event.
    pub(crate) fn wait_own(&mut self, wait: OwnWait) {
        self.wait = Wait::Own(wait);
    }

    /// Returns true if the line's present command has begun. The machine asks the extension's gate
    /// before that, and not again.
    pub(crate) fn has_passed(&self) -> bool {
        !matches!(self.wait, Wait::Nothing | Wait::Own(OwnWait::Gate))
    }

    /// Notes that the extension's gate is open for the command under way.
    pub(crate) fn pass(&mut self) {
        self.wait = Wait::Nothing;
    }

    /// The origin of the line under way.
    pub(crate) fn origin(&self) -> Option<Origin> {
        self.origin
    }

    /// The kind of the line that is carried out.
    fn kind(&self) -> LineKind {
        self.kind
    }

    /// The command to carry out; `None` once all are carried out.
    fn current(&self) -> Option<&Command<AXES>> {
        self.commands.get(self.next)
    }

    /// Returns true if the next command needs room in the planner.
    pub(crate) fn moves_next(&self) -> bool {
        if !matches!(self.wait, Wait::Nothing | Wait::Arc(_)) {
            return false;
        }
        match self.current() {
            Some(Command::Line(_) | Command::Arc { .. } | Command::Probe { .. }) => true,
            Some(
                Command::Spindle(_)
                | Command::Coolant(_)
                | Command::ParkingControl(_)
                | Command::OverrideControl(_)
                | Command::Dwell(_)
                | Command::StoreOffset { .. }
                | Command::StoreTool { .. }
                | Command::Own(_)
                | Command::WorkOffset(_)
                | Command::Cycle { .. }
                | Command::Pause
                | Command::ProgramEnd,
            )
            | None => false,
        }
    }

    /// Returns true if further commands follow the current one.
    fn has_more(&self) -> bool {
        let cycle = self.cycle.as_ref().filter(|_| cfg!(feature = "cycles"));
        let in_cycle = cycle.is_some_and(|cycle| !cycle.is_over());
        in_cycle || self.next + 1 < self.commands.len()
    }

    /// Goes on to the cycle's next stroke, if there is one, and otherwise to the next command of
    /// the line.
    fn advance(&mut self) {
        self.wait = Wait::Nothing;
        if let Some(cycle) = self.cycle.as_mut().filter(|_| cfg!(feature = "cycles")) {
            if let (Some(stroke), Some(slot)) = (cycle.next(), self.commands.get_mut(self.next)) {
                *slot = stroke;
                return;
            }
            self.cycle = None;
        }
        self.next += 1;
    }
}
