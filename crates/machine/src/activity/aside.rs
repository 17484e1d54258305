//! An M code of an extension is put aside, such as a tool change: the operator has the machine
//! until `~`. Lines that the sender has sent already are kept in the extension's memory.
//!
//! ```text
//!   M6 --SetAside--> Collecting -------> Waiting ---~---> Returning ---Done---> `ok`, and then
//!                    lines that the      operator's       the code goes on      the kept lines
//!                    sender had on the   lines
//!                    way are kept, until nothing comes for 100 ms, or for 300 ms in any case
//! ```

use super::line::Origin;
use crate::board::{ChannelId, Duration, Instant};
use crate::extension::{Call, Shown};
use crate::interpreter::ModalState;

/// After a silence of this length (100 ms), a sender that keeps the receive buffer full has nothing
/// more on the way.
pub(crate) const SETTLE: Duration = Duration::from_ticks(100_000);

/// Collecting ends after this time (300 ms) in any case, because a sender that asks for reports all
/// the time is never silent.
pub(crate) const LONGEST: Duration = Duration::from_ticks(300_000);

/// The phase of an M code that is put aside.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Phase {
    /// Lines that the sender had on the way are kept.
    Collecting {
        /// The time at which the collecting began.
        since: Instant,
        /// The time at which the last byte came.
        last: Instant,
    },
    /// The M code waits for `~`; the operator's lines are obeyed.
    Waiting,
    /// The M code goes on.
    Returning,
}

/// An M code that is put aside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aside {
    pub(crate) call: Call,
    pub(crate) phase: Phase,
    /// The receiver of the answer to the M code's line, once the machine has performed that line.
    pub(crate) origin: Origin,
    pub(crate) shown: Shown,
    /// The modes of the program, which the operator's lines may change.
    pub(crate) modal: ModalState,
    /// True if the line goes on after the code.
    pub(crate) has_rest: bool,
    /// The number of kept bytes in the extension's memory.
    pub(crate) kept: usize,
}

/// Lines that were kept and are now carried out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kept {
    /// The channel that they came from.
    pub(crate) id: ChannelId,
    /// The index of the next byte in the extension's memory. The last byte is before index `end`.
    pub(crate) next: usize,
    pub(crate) end: usize,
}

impl Aside {
    /// The lines that were kept, if there are any.
    pub(crate) fn lines(&self) -> Option<Kept> {
        match self.origin {
            Origin::Channel(id) if self.kept > 0 => Some(Kept {
                id,
                next: 0,
                end: self.kept,
            }),
            Origin::Channel(_) | Origin::Startup(_) | Origin::Nobody => None,
        }
    }
}
