//! One serial line as the server sees it: it is opened, passes bytes both ways, and is closed. It
//! may be a TCP socket, a WebSocket or a pseudo-terminal.
//!
//! ```text
//!   client <--- socket or pty ---> reader thread --- Event ---> server loop
//!                              `-- writer thread <--- Outlet ------'
//! ```
//!
//! A line has one client at a time. Its threads may wait, but the server loop never does: events
//! come through a bounded channel. Bytes that a client does not read are thrown away once its
//! outlet is full.

use super::web::Foreign;
use leadscrew_page::Outlet;
use std::fmt;
use std::io;
use std::path::PathBuf;
use std::time::Duration;

/// Bytes that are read from a client at a time.
pub(super) const CHUNK: usize = 4096;

/// The time after which a line that is not available is tried again.
pub(super) const RETRY: Duration = Duration::from_secs(1);

/// An endpoint to which programs can connect.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum LineSpec {
    /// A pseudo-terminal behind a symbolic link: a serial port for local programs. Unix only.
    Pty {
        /// The link, which must not exist.
        link: PathBuf,
        /// True if opening the port resets the machine, as it resets an Arduino.
        reset_on_open: bool,
    },
    /// Raw bytes over TCP, at a host and port.
    Tcp(String),
    /// A WebSocket at a host and port, with any path.
    WebSocket(String),
}

impl fmt::Display for LineSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pty { link, .. } => write!(f, "pty {}", leadscrew_files::shown(link)),
            Self::Tcp(address) => write!(f, "tcp {address}"),
            Self::WebSocket(address) => write!(f, "ws {address}"),
        }
    }
}

/// The reason why a line is not available.
#[derive(Debug)]
pub enum LineError {
    /// The server cannot listen at the address: it is in use, belongs to another computer, or is
    /// not allowed.
    Listen(io::Error),
    /// Something exists at the link's path already.
    LinkExists,
    /// The link cannot be made.
    Link(io::Error),
    /// The operating system gives no pseudo-terminal.
    NoPty(io::Error),
}

impl fmt::Display for LineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Listen(error) if error.kind() == io::ErrorKind::AddrInUse => {
                write!(f, "another program listens there already")
            }
            Self::Listen(error) => write!(f, "cannot listen there: {error}"),
            Self::LinkExists => write!(f, "the path exists already: remove it or choose another"),
            Self::Link(error) => write!(f, "the link cannot be made: {error}"),
            Self::NoPty(error) => write!(f, "no pseudo-terminal: {error}"),
        }
    }
}

impl std::error::Error for LineError {}

/// An event on a line.
#[derive(Debug)]
pub enum What {
    /// Programs can connect now, at this address or device.
    Ready(String),
    /// Programs cannot connect. The server keeps trying without further messages.
    Unavailable(LineError),
    /// A client has connected.
    Opened {
        /// Its name or address, as far as it is known.
        peer: String,
        /// The outlet for bytes to the client.
        outlet: Outlet,
    },
    /// The client has sent bytes; never empty.
    Bytes(Vec<u8>),
    /// The client has disconnected.
    Closed,
    /// A second client has connected and was turned away.
    TurnedAway(String),
    /// A client was turned away for another reason.
    Refused(String, Refusal),
}

/// The reason why a client is not let in.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Refusal {
    /// A web page that is not allowed to connect.
    Foreign(Foreign),
    /// A browser's request on a port for raw bytes, or what no sender begins with.
    Request,
    /// The client does not speak WebSocket, or its handshake takes too long.
    NoWebSocket,
    /// A page without the token that the server has printed.
    NoToken,
    /// The client has disconnected again.
    Gone,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Foreign(foreign) => foreign.fmt(f),
            Self::Request => f.write_str(
                "a web browser's request, or other bytes that no sender of G-code begins with",
            ),
            Self::NoWebSocket => f.write_str("no WebSocket client"),
            Self::NoToken => f.write_str("a page without the token that leadscrew has printed"),
            Self::Gone => f.write_str("it has gone again"),
        }
    }
}

/// Something that happened on a line.
#[derive(Debug)]
pub(super) struct Event {
    /// The line, counted from 0.
    pub(super) line: usize,
    /// The event.
    pub(super) what: What,
}
