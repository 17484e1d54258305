//! From the serial interrupt to the main loop: ordinary bytes in one queue, realtime commands in
//! another.
//!
//! ```text
//!            serial interrupt      |  main loop
//!                                  |
//!  byte --> Receiver::receive --+--+--> Inbox::next_realtime   (what, mark)
//!             | means nothing   |  |
//!             v                 +--+--> Inbox::take
//!           nothing                |
//! ```
//!
//! A realtime command carries a [`Mark`]: how many ordinary bytes came before it. A reset drops the
//! bytes received before it and no others, however late the main loop sees it. The order of arrival
//! is kept: the inbox hands out no byte before the realtime commands that came ahead of it.
//!
//! No byte can overtake a command: the receiver queues a command before any later byte, and the
//! queue publishes each entry with release ordering. Once the inbox sees a byte (acquire), it sees
//! all commands ahead of that byte.
//!
//! When a queue is full: an ordinary byte is lost and counted, as in Grbl. `?` is remembered in a
//! flag, so that a report follows. One place is kept for a reset; if that place is taken, a reset
//! is under way already, and only its mark is moved on. `!`, `~`, 0x84 and 0x85 are kept beside the
//! queue ([`Late`]). Overrides and the like are lost: their sender sees that they have no effect,
//! and sends them again.

mod late;
mod queues;
#[cfg(test)]
mod tests;

pub use queues::{Inbox, Output, Receiver, LEAST_TX};

use crate::line_reader::LineReader;
use crate::realtime::{Realtime, Sorter};
use core::sync::atomic::{AtomicBool, AtomicU32};
use heapless::spsc::Queue;
use heapless::Deque;
use late::{Late, Taken};

/// The most characters that a line can have after filtering.
pub const LINE: usize = 128;

/// Slots for ordinary bytes by default: 1024 usable bytes, as one slot of the ring stays empty.
pub const DEFAULT_RX: usize = 1025;

/// Bytes of output that may wait, by default.
pub const DEFAULT_TX: usize = 1024;

/// Slots for realtime commands by default; one of them stays empty. A burst of overrides at 3 Mbaud
/// comes 3.3 µs apart, so that the main loop may be away for 200 µs.
pub const DEFAULT_REALTIME: usize = 64;

/// A place in the stream of ordinary bytes: how many came before it since power-up, modulo 2³².
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mark(u32);

/// A realtime command and its place in the stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Request {
    /// The request.
    pub realtime: Realtime,
    /// Its place among the ordinary bytes.
    pub mark: Mark,
}

/// Words that the two ends share besides the queues. The interrupt writes all of them. The main
/// loop also clears `report`, `opened` and `closed`, and writes its part of `late`.
#[derive(Debug)]
struct Shared {
    /// A `?` that found no room.
    report: AtomicBool,
    /// Commands that found no room and must not be lost.
    late: Late,
    /// Somebody has opened the other end.
    opened: AtomicBool,
    /// The mark of the newest reset.
    reset: AtomicU32,
    /// The other end has gone away, at this mark.
    closed: AtomicBool,
    closed_at: AtomicU32,
    lost_bytes: AtomicU32,
}

/// The memory of one serial channel.
///
/// * `RX` slots for ordinary bytes: one more than the bytes that fit. Grbl has 129.
/// * `TX` bytes of output that may wait, at least [`LEAST_TX`]. With fewer bytes a sender gets its
///   answers no later, but messages are left out sooner.
/// * `REALTIME` slots for realtime commands, at least 4: one stays empty and one is a reset's.
///   Choose as many as come in 0.4 ms: 8 at 115 200 baud.
///
/// ```
/// use leadscrew_protocol::serial::SerialQueue;
///
/// type Small = SerialQueue<129, 512, 8>;
/// let mut queue = Small::new();
/// let (mut receiver, inbox) = queue.split();
/// receiver.receive(b'G');
/// assert_eq!((inbox.free(), inbox.limit()), (127, 128));
/// assert!(size_of::<Small>() < size_of::<SerialQueue>() / 2);
/// ```
#[derive(Debug)]
pub struct SerialQueue<
    const RX: usize = DEFAULT_RX,
    const TX: usize = DEFAULT_TX,
    const REALTIME: usize = DEFAULT_REALTIME,
> {
    bytes: Queue<u8, RX>,
    requests: Queue<Request, REALTIME>,
    /// The output that waits to be sent.
    output: Deque<u8, TX>,
    /// Collects the line that is being read.
    reader: LineReader<LINE>,
    shared: Shared,
    /// The number of places in the byte queue that are never used. It is stored in place of the
    /// limit, so that an empty channel is all zeros, which take no room in a program's image.
    spare: usize,
}

impl<const RX: usize, const TX: usize, const REALTIME: usize> Default
    for SerialQueue<RX, TX, REALTIME>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<const RX: usize, const TX: usize, const REALTIME: usize> SerialQueue<RX, TX, REALTIME> {
    /// Makes an empty channel that takes as many bytes as it has room for.
    pub const fn new() -> Self {
        Self::with_limit(RX - 1)
    }

    /// Makes an empty channel that loses bytes beyond `limit` unread ones: 128 to behave as Grbl
    /// does.
    pub const fn with_limit(limit: usize) -> Self {
        const {
            assert!(TX >= LEAST_TX, "a report may not fit");
            assert!(REALTIME >= 4, "a hold beside a reset may not fit");
        }
        Self {
            bytes: Queue::new(),
            requests: Queue::new(),
            output: Deque::new(),
            reader: LineReader::new(0), // the console sets its limit
            shared: Shared {
                report: AtomicBool::new(false),
                late: Late::new(),
                opened: AtomicBool::new(false),
                reset: AtomicU32::new(0),
                closed: AtomicBool::new(false),
                closed_at: AtomicU32::new(0),
                lost_bytes: AtomicU32::new(0),
            },
            spare: (RX - 1).saturating_sub(limit),
        }
    }

    /// Parts the channel into the end for the serial interrupt and the end for the main loop.
    pub fn split(&mut self) -> (Receiver<'_>, Inbox<'_>) {
        let limit = RX - 1 - self.spare;
        let (bytes_in, bytes_out) = self.bytes.split();
        let (requests_in, requests_out) = self.requests.split();
        let receiver = Receiver {
            bytes: bytes_in,
            requests: requests_in,
            shared: &self.shared,
            limit,
            received: 0,
            sorter: Sorter::new(),
        };
        let inbox = Inbox {
            bytes: bytes_out,
            requests: requests_out,
            output: Output::new(&mut self.output),
            reader: &mut self.reader,
            shared: &self.shared,
            limit,
            taken: 0,
            late: Taken::default(),
        };
        (receiver, inbox)
    }
}
