//! Waits for clients on a TCP port. Each client gets a thread of its own, and one client at a time
//! has the line.

use super::line::{LineError, What, RETRY};
use super::seat::{Guest, Seat, Ticket};
use super::uplink::Uplink;
use super::web::Allowed;
use socket2::{SockRef, TcpKeepalive};
use std::io;
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

/// The time between two looks of the listener for a new client.
const POLL: Duration = Duration::from_millis(5);

/// The most clients that have a thread at a time. Further clients wait in the operating system
/// until one of these ends.
const GUESTS: usize = 64;

/// After a client has been silent for `ASK`, the operating system asks whether its computer is
/// still there. It asks `TIMES` times, `ASK_AGAIN` apart; a client that does not answer is gone
/// after [`GONE`].
const ASK: Duration = Duration::from_secs(5);
const ASK_AGAIN: Duration = Duration::from_secs(3);
const TIMES: u32 = 3;

/// The longest time that bytes sent to a client may stay unacknowledged. With [`ASK`], a client
/// that is gone is noticed after at most 15 s.
const GONE: Duration = Duration::from_secs(14);

/// A client that has connected.
pub(super) struct Client {
    pub(super) stream: TcpStream,
    /// Its name or address, as far as it is known.
    pub(super) peer: String,
    /// Its place in the queue for the line.
    pub(super) ticket: Ticket,
}

/// The way in which a port's clients are served.
#[derive(Clone, Copy)]
pub(super) struct Protocol {
    /// The state of a client that has said nothing yet.
    pub(super) newcomer: Guest,
    /// Waits for the line and talks to the client until it goes.
    pub(super) serve: fn(Client, &Allowed, &Uplink),
}

/// Listens at `address` until the server ends.
pub(super) fn run(address: &str, allowed: &Allowed, uplink: &Uplink, protocol: Protocol) {
    let Some(listener) = listen(address, uplink) else {
        return;
    };
    let seat = Arc::new(Seat::new(uplink.busy()));
    let mut guests: Vec<JoinHandle<()>> = Vec::new();
    while !uplink.stopped() {
        guests.retain(|guest| !guest.is_finished());
        let room = guests.len() < GUESTS;
        match room.then(|| listener.accept()) {
            Some(Ok((stream, peer))) => {
                watch(&stream);
                let client = Client {
                    stream,
                    peer: peer.to_string(),
                    ticket: seat.queue(protocol.newcomer),
                };
                let (uplink, allowed) = (uplink.clone(), allowed.clone());
                guests.push(std::thread::spawn(move || {
                    (protocol.serve)(client, &allowed, &uplink);
                }));
            }
            // No client has come, or one has left before it was accepted.
            Some(Err(_)) | None => std::thread::sleep(POLL),
        }
    }
    for guest in guests {
        // A client's thread that has panicked has already closed its connection.
        let _ = guest.join();
    }
}

/// Makes the operating system close a connection to a computer that is gone. On systems that
/// cannot, the connection lasts longer.
fn watch(stream: &TcpStream) {
    let socket = SockRef::from(stream);
    let ask = TcpKeepalive::new()
        .with_time(ASK)
        .with_interval(ASK_AGAIN)
        .with_retries(TIMES);
    let _ = socket.set_tcp_keepalive(&ask);
    // While bytes are on the way to the client, the system does not ask it; this limit counts
    // instead.
    #[cfg(any(target_os = "linux", target_os = "android"))]
    let _ = socket.set_tcp_user_timeout(Some(GONE));
}

/// Opens the port. While the port is not available, waits for it, and says so once. `None` if
/// the server ends first.
fn listen(address: &str, uplink: &Uplink) -> Option<TcpListener> {
    let mut said = false;
    while !uplink.stopped() {
        match bind(address) {
            Ok((listener, address)) => {
                uplink.tell(What::Ready(address));
                return Some(listener);
            }
            Err(error) => {
                if !std::mem::replace(&mut said, true) {
                    uplink.tell(What::Unavailable(LineError::Listen(error)));
                }
                uplink.pause(RETRY);
            }
        }
    }
    None
}

fn bind(address: &str) -> io::Result<(TcpListener, String)> {
    let listener = TcpListener::bind(address)?;
    listener.set_nonblocking(true)?;
    let address = listener.local_addr()?.to_string();
    Ok((listener, address))
}
