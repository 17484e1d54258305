//! Raw TCP: bytes as they are, both ways.

use super::line::{Outlet, Uplink, What, CHUNK};
use super::listener::Protocol;
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::mpsc::Receiver;
use std::time::Duration;

/// How often a reader looks whether it is to end.
const LOOK: Duration = Duration::from_millis(50);

/// Who is turned away finds the connection closed: raw bytes have no words for it.
pub(super) const PROTOCOL: Protocol = Protocol {
    serve,
    turn_away: drop,
};

/// Passes bytes between a client and the server until the client goes.
fn serve(stream: TcpStream, peer: String, uplink: &Uplink) {
    let Ok((reader, writer)) = prepare(stream) else {
        return uplink.tell(What::Refused(peer));
    };
    let (outlet, pieces) = Outlet::new();
    uplink.tell(What::Opened { peer, outlet });
    // Ends when the server drops the outlet.
    std::thread::spawn(move || write_all(writer, &pieces));
    read_all(&reader, uplink, |bytes| uplink.pass(bytes));
    // The writer may be stuck with a client that does not read.
    let _ = reader.shutdown(Shutdown::Both);
    uplink.tell(What::Closed);
}

/// Makes two ends of a connection for two threads: the reader's looks up every now and then.
pub(super) fn prepare(stream: TcpStream) -> io::Result<(TcpStream, TcpStream)> {
    // An accepted socket inherits the listener's mode on some systems.
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(LOOK))?;
    let writer = stream.try_clone()?;
    Ok((stream, writer))
}

/// Reads until the client goes or the server ends.
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
