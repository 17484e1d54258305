//! Activities: they take longer than one [`Machine::poll`](crate::machine::Machine::poll). Each is
//! a value that every poll advances. No activity blocks.
//!
//! | activity | state | begins with |
//! |---|---|---|
//! | [`mod@line`] | Idle, Run, Jog, Check | a line of G-code or `$J=` |
//! | [`homing`] | Home | `$H`, or a limit switch from which axes back off |
//! | [`aside`] | Idle | an M code that an extension puts aside |
//! | [`door`] | Door, Sleep | the door, 0x84, `$SLP` |

pub(crate) mod aside;
pub(crate) mod door;
pub(crate) mod door_cycle;
pub(crate) mod homing;
pub(crate) mod line;
pub(crate) mod switch_cycle;

use crate::protocol::serial::LINE;
use aside::{Aside, Kept};
use door_cycle::DoorCycle;
use line::Executor;
use switch_cycle::SwitchCycle;

/// The activities under way. A line may wait while the door is open; homing, or backing off a limit
/// switch, excludes both.
pub(crate) struct Activity<const AXES: usize> {
    pub(crate) line: Executor<AXES>,
    pub(crate) switch_cycle: Option<SwitchCycle>,
    pub(crate) door: Option<DoorCycle<AXES>>,
    /// An M code that is put aside.
    pub(crate) aside: Option<Aside>,
    /// The line whose other words wait for an M code that comes first: see
    /// [`Executor::has_rest`](line::Executor::has_rest).
    pub(crate) rest: heapless::Vec<u8, LINE>,
    /// Lines that were kept while an M code was put aside, and that are not taken yet.
    pub(crate) kept: Option<Kept>,
}

impl<const AXES: usize> Activity<AXES> {
    /// Makes the activity of a machine that carries out no line, no homing, no door and no aside.
    pub(crate) const fn new() -> Self {
        Self {
            line: Executor::new(),
            switch_cycle: None,
            door: None,
            aside: None,
            rest: heapless::Vec::new(),
            kept: None,
        }
    }
}
