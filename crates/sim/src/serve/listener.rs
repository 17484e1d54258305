//! Waits for clients on a TCP port and lets in one at a time.

use super::line::{LineError, Uplink, What, RETRY};
use std::io;
use std::net::{TcpListener, TcpStream};
use std::thread::JoinHandle;
use std::time::Duration;

/// How often a new client is looked for.
const POLL: Duration = Duration::from_millis(5);

/// How long a new client waits for the end of one that is just going: programs that probe a port close it and come
/// back within milliseconds.
const GRACE: Duration = Duration::from_millis(500);

/// How clients are met.
#[derive(Clone, Copy)]
pub(super) struct Protocol {
    /// Talks to one client until it goes.
    pub(super) serve: fn(TcpStream, String, &Uplink),
    /// Sends a client away that comes while another is there: in a thread of its own, for seconds at most.
    pub(super) turn_away: fn(TcpStream),
}

/// Listens at `address` until the server ends.
pub(super) fn run(address: &str, uplink: &Uplink, protocol: Protocol) {
    let Some(listener) = listen(address, uplink) else {
        return;
    };
    let mut client: Option<JoinHandle<()>> = None;
    while !uplink.stopped() {
        match listener.accept() {
            Ok((stream, peer)) => {
                if wait_for_end(&client, uplink) {
                    let uplink = uplink.clone();
                    client = Some(std::thread::spawn(move || {
                        (protocol.serve)(stream, peer.to_string(), &uplink)
                    }));
                } else {
                    std::thread::spawn(move || (protocol.turn_away)(stream));
                    uplink.tell(What::TurnedAway(peer.to_string()));
                }
            }
            // Nobody there, or a client that went before it was let in.
            Err(_) => std::thread::sleep(POLL),
        }
    }
    if let Some(client) = client {
        // A client's thread that has panicked has closed its connection.
        let _ = client.join();
    }
}

/// Gets the port, in the end; says once that it has to wait. `None` where the server ends first.
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

fn wait_for_end(client: &Option<JoinHandle<()>>, uplink: &Uplink) -> bool {
    let ended = || client.as_ref().is_none_or(JoinHandle::is_finished);
    let mut waited = Duration::ZERO;
    while !ended() && waited < GRACE && !uplink.stopped() {
        std::thread::sleep(POLL);
        waited += POLL;
    }
    ended()
}
