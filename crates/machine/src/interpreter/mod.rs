//! Lines of G-code to canonical commands.
//!
//! ```text
//!  line --words--> Block --check--> Plan --commit--> Commands
//!                    |                |                 |
//!              1, 2, 20…25, 38   22, 26…37, 52    nothing can fail: modal state, offsets, position change
//! ```
//!
//! Read first: Kramer, Proctor, Messina, "The NIST RS274/NGC Interpreter, Version 3" (NISTIR 6556). Which of its words
//! exist, and which fault of a line is reported, is GRBL 1.1h's.
//!
//! Everything is checked before anything changes: a line is carried out wholly or not at all. The first fault from the
//! left is reported while words are read, then the first in the order of the checks.

mod command;
mod context;
mod coordinate;
mod modal_state;
mod offsets;

pub use command::{
    ArcShape, Command, Commands, Feed, Jog, OffsetId, Spindle, Travel, MAX_COMMANDS,
};
pub use context::{Context, Fault};
pub use coordinate::Coordinate;
pub use modal_state::{
    Coolant, Distance, FeedMode, ModalState, Motion, Plane, ProbeKind, Rotation, Turn, Units,
    WorkSystem,
};
pub use offsets::Offsets;

/// The largest axis, centre or radius word, mm or degrees: 10⁶ m, so that no sum of offsets overflows.
pub const MAX_WORD: Coordinate = Coordinate::from_nanos(1_000_000_000_000_000_000);
