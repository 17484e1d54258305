//! Decides which client has a line: one at a time. The others wait for it or are turned away.
//!
//! A client may reconnect before the server has noticed the end of its old connection. A client
//! whose program hangs, or whose network has lost the end of the connection, would keep everybody
//! out. So:
//!
//! * a new client waits [`GRACE`] for the client before it to disconnect;
//! * a new client from the same address that has sent a byte takes the line over from a client that
//!   has been silent for [`SILENCE`], unless a job is unfinished;
//! * the operating system notices a client whose computer is gone (`listener.rs`).

use std::net::{IpAddr, Shutdown, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The time for which a new client waits for a client that is just disconnecting: programs that
/// probe a port close it and come back within milliseconds.
const GRACE: Duration = Duration::from_millis(500);

/// The time that a new client from the holder's address may take to send its first byte; and the
/// time for which it then waits for the holder to fall silent.
const PATIENCE: Duration = Duration::from_secs(3);

/// The time for which a client has to be silent before another one may take its line.
const SILENCE: Duration = Duration::from_secs(2);

/// The most clients that may wait longer than [`GRACE`] without having sent a byte.
const FEW: usize = 8;

/// A client that wants the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Guest {
    /// It has not shown yet that it is a client of this port.
    Stranger,
    /// It has sent nothing yet.
    Silent,
    /// It has sent a byte.
    Spoken,
    /// It has disconnected, or is no client of this port.
    Gone,
}

/// The client that has the line.
struct Holder {
    address: IpAddr,
    stream: TcpStream,
    heard: Instant,
}

/// The clients of a line: the client that has the line, and the clients that wait.
#[derive(Default)]
struct People {
    holder: Option<Holder>,
    /// Clients that wait, by number, in the order in which they came.
    queue: Vec<(u64, Guest)>,
    /// The number of clients that have come.
    come: u64,
}

impl People {
    /// The client whose turn it is once the seat is free. Clients that have sent a byte go first.
    fn next(&self) -> Option<u64> {
        let first = |kind| self.queue.iter().find(|(_, guest)| *guest == kind);
        let next = first(Guest::Spoken).or_else(|| first(Guest::Silent));
        next.map(|(number, _)| *number)
    }
}

/// The place for the one client of a line.
pub(super) struct Seat {
    people: Mutex<People>,
    /// True if the machine has a job that is not finished.
    busy: Arc<AtomicBool>,
}

/// A place in the queue; given up when dropped.
pub(super) struct Ticket {
    seat: Arc<Seat>,
    number: u64,
}

/// The right to talk to the machine; given back when dropped.
pub(super) struct Seated(Arc<Seat>);

impl Seat {
    /// Makes a free seat at a machine that is `busy` or not.
    pub(super) fn new(busy: Arc<AtomicBool>) -> Self {
        Self {
            people: Mutex::default(),
            busy,
        }
    }

    /// Gives a client a place in the queue.
    pub(super) fn queue(self: &Arc<Self>, guest: Guest) -> Ticket {
        let mut people = self.people();
        people.come += 1;
        let number = people.come;
        people.queue.push((number, guest));
        Ticket {
            seat: self.clone(),
            number,
        }
    }

    fn people(&self) -> MutexGuard<'_, People> {
        self.people.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns how long a guest may wait; `None` if it has disconnected.
    fn patience(&self, address: IpAddr, guest: Guest) -> Option<Duration> {
        let people = self.people();
        let same = people
            .holder
            .as_ref()
            .is_none_or(|holder| holder.address == address);
        let may = same && !self.busy.load(Ordering::Relaxed);
        let few = people.queue.len() <= FEW;
        match guest {
            Guest::Gone => None,
            Guest::Spoken if may => Some(PATIENCE),
            Guest::Silent if may && few => Some(PATIENCE),
            Guest::Spoken | Guest::Silent | Guest::Stranger => Some(GRACE),
        }
    }

    /// Hangs up on a holder that has been silent for [`SILENCE`]; its thread then frees the seat.
    fn end_silence(&self) {
        if let Some(holder) = &self.people().holder {
            if holder.heard.elapsed() >= SILENCE {
                // If the holder has disconnected on its own, this does no harm.
                let _ = holder.stream.shutdown(Shutdown::Both);
            }
        }
    }
}

impl Ticket {
    /// Waits for the seat; `None` if it cannot be had. `guest` waits a moment and then returns
    /// how the client has behaved.
    pub(super) fn wait(
        self,
        stream: &TcpStream,
        mut guest: impl FnMut() -> Guest,
    ) -> Option<Seated> {
        let address = stream.peer_addr().ok()?.ip();
        let begun = Instant::now();
        loop {
            if let Some(seated) = self.take(address, stream) {
                return Some(seated);
            }
            let guest = guest();
            self.note(guest);
            let patience = self.seat.patience(address, guest)?;
            if guest == Guest::Spoken && patience == PATIENCE {
                self.seat.end_silence();
            }
            if begun.elapsed() > patience {
                return None;
            }
        }
    }

    /// Takes the seat, if it is free and it is this guest's turn.
    fn take(&self, address: IpAddr, stream: &TcpStream) -> Option<Seated> {
        let mut people = self.seat.people();
        if people.holder.is_some() || people.next() != Some(self.number) {
            return None;
        }
        people.holder = Some(Holder {
            address,
            stream: stream.try_clone().ok()?,
            heard: Instant::now(),
        });
        Some(Seated(self.seat.clone()))
    }

    fn note(&self, now: Guest) {
        for (number, guest) in &mut self.seat.people().queue {
            if *number == self.number {
                *guest = now;
            }
        }
    }
}

impl Drop for Ticket {
    fn drop(&mut self) {
        self.seat
            .people()
            .queue
            .retain(|(number, _)| *number != self.number);
    }
}

impl Seated {
    /// Notes that the client has sent something.
    pub(super) fn heard(&self) {
        if let Some(holder) = &mut self.0.people().holder {
            holder.heard = Instant::now();
        }
    }
}

impl Drop for Seated {
    fn drop(&mut self) {
        self.0.people().holder = None;
    }
}
