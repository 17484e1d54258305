//! Raw TCP: unchanged bytes, both ways.
//!
//! A web page can make its browser send a request to any port of this computer. So the first bytes
//! of a client are held back while they may be the beginning of such a request.

use super::line::{Refusal, What, CHUNK};
use super::listener::{Client, Protocol};
use super::seat::{Guest, Seated};
use super::uplink::Uplink;
use super::web::{beginning, Allowed, Beginning};
use leadscrew_page::Outlet;
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// The time between two checks of whether the reader is to end.
const LOOK: Duration = Duration::from_millis(50);

/// The time between two checks of whether the line is free for a waiting client.
const POLL: Duration = Duration::from_millis(5);

/// The time for which bytes are held back that may be the beginning of a web page's request.
const HOLD: Duration = Duration::from_millis(100);

pub(super) const PROTOCOL: Protocol = Protocol {
    newcomer: Guest::Silent,
    serve,
};

/// Passes bytes between a client and the server until the client disconnects. A client that is
/// turned away only finds its connection closed: a raw connection has no way to tell the reason.
fn serve(client: Client, _: &Allowed, uplink: &Uplink) {
    let peer = client.peer;
    let Ok((reader, writer)) = prepare(client.stream) else {
        return uplink.tell(What::Refused(peer, Refusal::Gone));
    };
    let mut first = FirstBytes::new(&reader);
    let seated = client.ticket.wait(&reader, || match uplink.stopped() {
        true => Guest::Gone,
        false => first.guest(POLL),
    });
    match (seated, first.place) {
        (Some(seated), _) => serve_seated(writer, peer, first, &seated, uplink),
        (None, Place::Request) => uplink.tell(What::Refused(peer, Refusal::Request)),
        (None, Place::Gone) => uplink.tell(What::Refused(peer, Refusal::Gone)),
        (None, _) => uplink.tell(What::TurnedAway(peer)),
    }
}

fn serve_seated(
    writer: TcpStream,
    peer: String,
    mut first: FirstBytes<'_>,
    seated: &Seated,
    uplink: &Uplink,
) {
    let reader = first.reader;
    let (outlet, pieces) = Outlet::new();
    uplink.tell(What::Opened {
        peer: peer.clone(),
        outlet,
    });
    // The writer's thread ends when the server drops the outlet.
    std::thread::spawn(move || write_all(writer, &pieces));
    while first.is_open() && !uplink.stopped() {
        first.listen(LOOK);
    }
    match first.place {
        Place::Request => uplink.tell(What::Refused(peer, Refusal::Request)),
        Place::Passed => {
            seated.heard();
            uplink.pass(&first.bytes);
            read_all(reader, uplink, |bytes| {
                seated.heard();
                uplink.pass(bytes);
            });
        }
        Place::Begun(_) | Place::Silent | Place::Gone => {}
    }
    // The writer may be waiting for a client that does not read.
    let _ = reader.shutdown(Shutdown::Both);
    uplink.tell(What::Closed);
}

/// The facts that are known about a client.
#[derive(Clone, Copy)]
enum Place {
    /// It has sent nothing yet.
    Silent,
    /// Its bytes may be the beginning of a request; holds when the first of them came.
    Begun(Instant),
    /// It is no browser: its bytes are passed on.
    Passed,
    /// It is a browser, whose request is refused.
    Request,
    /// It has gone.
    Gone,
}

/// The first bytes of a client, held back until it is known that they are no request.
struct FirstBytes<'s> {
    reader: &'s TcpStream,
    bytes: Vec<u8>,
    place: Place,
}

impl<'s> FirstBytes<'s> {
    fn new(reader: &'s TcpStream) -> Self {
        Self {
            reader,
            bytes: Vec::new(),
            place: Place::Silent,
        }
    }

    /// Returns true if more bytes are needed to decide.
    fn is_open(&self) -> bool {
        matches!(self.place, Place::Silent | Place::Begun(_))
    }

    /// Listens for a moment; returns how the client has behaved.
    fn guest(&mut self, time: Duration) -> Guest {
        if self.is_open() {
            self.listen(time);
        } else {
            std::thread::sleep(time);
        }
        match self.place {
            Place::Silent | Place::Begun(_) => Guest::Silent,
            Place::Passed => Guest::Spoken,
            Place::Request | Place::Gone => Guest::Gone,
        }
    }

    /// Waits for bytes, at most for `time`, and classifies them.
    fn listen(&mut self, time: Duration) {
        let mut chunk = [0; CHUNK];
        // The time is not 0. If it cannot be set, the timeout before it applies.
        let _ = self.reader.set_read_timeout(Some(time));
        let read = self.reader.read(&mut chunk);
        let _ = self.reader.set_read_timeout(Some(LOOK));
        self.place = match read {
            Ok(0) => self.ended(),
            Ok(count) => {
                self.bytes.extend_from_slice(&chunk[..count]);
                self.judge()
            }
            Err(error) if is_passing(error.kind()) => self.judge(),
            Err(_) => Place::Gone,
        };
    }

    fn judge(&self) -> Place {
        let since = match self.place {
            Place::Begun(since) => since,
            _ if self.bytes.is_empty() => return Place::Silent,
            _ => Instant::now(),
        };
        match beginning(&self.bytes) {
            Beginning::Request => Place::Request,
            Beginning::Either if since.elapsed() < HOLD => Place::Begun(since),
            Beginning::Either | Beginning::Sender => Place::Passed,
        }
    }

    /// The state of a client that closes its end. Bytes sent before that count: they are no
    /// request.
    fn ended(&self) -> Place {
        match self.bytes.is_empty() {
            true => Place::Gone,
            false => Place::Passed,
        }
    }
}

/// Makes the two ends of a connection for two threads. The reader's end has a timeout, so that it
/// can check whether it is to end.
pub(super) fn prepare(stream: TcpStream) -> io::Result<(TcpStream, TcpStream)> {
    // An accepted socket inherits the listener's mode on some systems.
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(LOOK))?;
    let writer = stream.try_clone()?;
    Ok((stream, writer))
}

/// Reads until the client disconnects or the server ends.
pub(super) fn read_all(mut reader: &TcpStream, uplink: &Uplink, mut take: impl FnMut(&[u8])) {
    let mut chunk = [0; CHUNK];
    while !uplink.stopped() {
        match reader.read(&mut chunk) {
            Ok(0) => return,
            Ok(count) => take(&chunk[..count]),
            Err(error) if is_passing(error.kind()) => {}
            Err(_) => return,
        }
    }
}

fn is_passing(kind: io::ErrorKind) -> bool {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(kind, Interrupted | TimedOut | WouldBlock)
}

fn write_all(mut writer: TcpStream, pieces: &Receiver<Vec<u8>>) {
    for piece in pieces {
        if writer.write_all(&piece).is_err() {
            return;
        }
    }
}
