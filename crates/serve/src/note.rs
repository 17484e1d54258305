//! The messages of `serve` to its user.

use super::line::{LineSpec, What};
use super::state_file::{Copied, SetAside};
use std::fmt;
use std::io;
use std::path::PathBuf;

/// A message.
#[derive(Debug)]
pub enum Note<'a> {
    /// Something happened on a line.
    Line(&'a LineSpec, &'a What),
    /// A client does not read: bytes for it are thrown away.
    NotRead(&'a LineSpec),
    /// A client has sent more than the machine's receive buffer holds: bytes are lost, as on a real
    /// line.
    BytesLost(&'a LineSpec),
    /// The simulation cannot run at the speed that was asked for.
    TooSlow,
    /// The log cannot be written any more.
    NoLog(io::Error),
    /// The state file cannot be written.
    NoState(PathBuf, io::Error),
    /// The state file could be written again.
    StateAgain(PathBuf),
    /// Another program uses the state file.
    StateInUse(PathBuf),
    /// The state file cannot be read.
    UnreadState(PathBuf, io::Error),
    /// The last change of a setting was not stored completely.
    LastChangeLost,
    /// Some stored values are lost.
    Damaged(Copied),
    /// The state file could not be used.
    SetAside(SetAside),
    /// The page can be opened, at this address.
    Page(String),
    /// The machine is reset, as an Arduino is when its port is opened.
    Restarted,
}

impl fmt::Display for Note<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // An address that is the same as the requested one is not repeated.
            Self::Line(line, What::Ready(at)) if line.to_string().ends_with(at) => {
                write!(f, "{line}: ready")
            }
            Self::Line(line, what) => write!(f, "{line}: {what}"),
            Self::NotRead(line) => write!(
                f,
                "{line}: the client does not read; what it does not take is thrown away"
            ),
            Self::BytesLost(line) => write!(
                f,
                "{line}: the client has sent more than the receive buffer holds; bytes of its lines are lost"
            ),
            Self::TooSlow => write!(
                f,
                "this computer is too slow for the speed asked for: simulated time falls behind"
            ),
            Self::NoLog(error) => write!(f, "the log ends here, it cannot be written: {error}"),
            Self::NoState(file, error) => {
                write!(
                    f,
                    "{}: settings will not survive, the file cannot be written: {error}; it is tried again every second",
                    leadscrew_files::shown(file)
                )
            }
            Self::StateAgain(file) => {
                write!(f, "{}: written again: settings survive", leadscrew_files::shown(file))
            }
            Self::StateInUse(file) => {
                write!(
                    f,
                    "{}: in use by another `leadscrew serve`: settings cannot be changed here (error:7); `--state FILE` names another file",
                    leadscrew_files::shown(file)
                )
            }
            Self::UnreadState(file, error) => {
                write!(
                    f,
                    "{}: cannot be read, defaults loaded: {error}",
                    leadscrew_files::shown(file)
                )
            }
            Self::LastChangeLost => write!(
                f,
                "the last change of a setting was cut short; the value before it is loaded"
            ),
            Self::Damaged(copied) => copied.fmt(f),
            Self::SetAside(aside) => aside.fmt(f),
            Self::Page(address) => write!(f, "page: {address}"),
            Self::Restarted => write!(f, "the machine starts anew because its port was opened"),
        }
    }
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ready(at) => write!(f, "ready at {at}"),
            Self::Unavailable(error) => write!(f, "{error}; it is tried again every second"),
            Self::Opened { peer, .. } => write!(f, "a client has come: {peer}"),
            Self::Bytes(bytes) => write!(f, "{} bytes", bytes.len()),
            Self::Closed => write!(f, "the client has gone"),
            Self::TurnedAway(peer) => write!(f, "turned away, another client is there: {peer}"),
            Self::Refused(peer, why) => write!(f, "refused: {peer}: {why}"),
        }
    }
}
