//! Checks and times G-code jobs on a simulated machine.
//!
//! ```text
//!   text --lines--> Follow: interpreter alone ----> CheckReport     read_through
//!    |                                              path, remarks
//!    `----bytes---> Stream: simulated machine ----> ProfileReport   Recorder watches
//! ```
//!
//! The crate needs neither a command line nor a clock nor threads. Its users are `leadscrew check`
//! and `profile`, the page of `leadscrew serve`, and the page without a server.
#![forbid(unsafe_code)]

mod check;
mod checker;
mod complaint;
mod foreign;
mod grbl_timer;
mod json;
mod life;
mod look;
mod machine;
mod order;
mod profile;
mod remark;
mod remedy;
mod rest;
pub mod settings_file;
mod stream;
mod time;
mod words;

pub use check::{read_through, CheckJson, CheckReport};
pub use checker::{follow, Ask, Doubt, Follow, RestError};
pub use complaint::{faults, Complaint, Fault};
pub use foreign::{board_options, board_speeds, drawing, unix_lines, Foreign};
pub use json::{
    error_json, extents, warning_json, Extent, Extents, JsonError, JsonWarning, JSON_VERSION,
};
pub use life::{Cause, End, JsonEnd, Wait};
pub use look::{Finding, Workshop};
pub use machine::{capped, Machine, TIMING};
pub use order::{Job, Level, Resume};
pub use profile::{limits_of, without_lead, ProfileJson, ProfileReport, Trial};
pub use remark::{Done, Remark};
pub use rest::{rest_of, Rest};
pub use stream::{Counted, News, Stream, Streamed};
pub use time::{time, Time};
pub use words::{duration, pauses, title, waits, work};

/// The example of the package's README, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
