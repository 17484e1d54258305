//! From the serial interrupt to the main loop: ordinary bytes in one queue, realtime commands in
//! another.
//!
//! ```text
//!            serial interrupt      |  main loop
//!                                  |
//!  byte --> Receiver::receive --+--+--> Inbox::next_realtime   (what, mark)
//!             | above 0x7F and  |  |
//!             v unknown         +--+--> Inbox::take
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

use super::late::{Late, Taken};
use super::line_reader::LineReader;
use super::realtime::{Byte, Realtime};
pub use crate::console::LEAST_TX;
use crate::console::{Output, LINE};
use core::sync::atomic::{fence, AtomicBool, AtomicU32, Ordering};
use heapless::spsc::{Consumer, Producer, Queue};
use heapless::Deque;

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
    /// Where it stood among the ordinary bytes.
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
/// use leadscrew_machine::protocol::serial::SerialQueue;
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
    /// Places of the byte queue that are never used. They are stored in place of the limit so that
    /// an empty channel is all zeros, which take no room in a program's image.
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

/// The serial interrupt's end of a channel.
pub struct Receiver<'a> {
    bytes: Producer<'a, u8>,
    requests: Producer<'a, Request>,
    shared: &'a Shared,
    limit: usize,
    /// Ordinary bytes queued since power-up, modulo 2³².
    received: u32,
}

impl Receiver<'_> {
    /// Takes a received byte, and answers the realtime command if it is one. Serial interrupt;
    /// bounded.
    ///
    /// The answer is for a board that wants to act at once; the inbox gets the command in any case.
    #[inline]
    pub fn receive(&mut self, byte: u8) -> Option<Realtime> {
        match Byte::sort(byte) {
            Byte::Ordinary(byte) => {
                self.keep(byte);
                None
            }
            Byte::Realtime(realtime) => {
                self.request(realtime);
                Some(realtime)
            }
            Byte::Unknown => None,
        }
    }

    /// Notes that somebody has opened the other end, and is to get the general messages. Serial
    /// interrupt.
    pub fn open(&mut self) {
        self.shared.opened.store(true, Ordering::Release);
    }

    /// Answers how many ordinary bytes were lost since power-up. Serial interrupt.
    pub fn lost_bytes(&self) -> u32 {
        self.shared.lost_bytes.load(Ordering::Relaxed)
    }

    /// Notes that at least this number of bytes was lost before they came here. Serial interrupt.
    pub fn lose(&mut self, bytes: u32) {
        add(&self.shared.lost_bytes, bytes);
    }

    /// Notes that the other end has gone away: a socket that closed, a cable that was pulled. Bytes
    /// that come after this are somebody else's. Serial interrupt; wake the main loop.
    pub fn close(&mut self) {
        self.shared
            .closed_at
            .store(self.received, Ordering::Relaxed);
        self.shared.closed.store(true, Ordering::Release);
    }

    fn keep(&mut self, byte: u8) {
        // A limit that is the queue's own capacity is left to the queue.
        let fits = self.limit == self.bytes.capacity() || self.bytes.len() < self.limit;
        if fits && self.bytes.enqueue(byte).is_ok() {
            self.received = self.received.wrapping_add(1);
        } else {
            count(&self.shared.lost_bytes);
        }
    }

    fn request(&mut self, realtime: Realtime) {
        let is_reset = realtime == Realtime::Reset;
        if is_reset {
            self.shared.reset.store(self.received, Ordering::Release);
            self.shared.late.forget();
        } else if self.shared.late.waits() && self.shared.late.keep(realtime, self.received) {
            return; // behind those that wait already
        }
        let free = self.requests.capacity() - self.requests.len();
        let request = Request {
            realtime,
            mark: Mark(self.received),
        };
        if free > usize::from(!is_reset) && self.requests.enqueue(request).is_ok() {
            return;
        }
        match realtime {
            Realtime::Report => self.shared.report.store(true, Ordering::Release),
            Realtime::Reset => {} // one is under way, and takes this one's mark
            Realtime::Hold | Realtime::Resume | Realtime::Door | Realtime::JogCancel => {
                self.shared.late.keep(realtime, self.received);
            }
            Realtime::Feed(_)
            | Realtime::Rapid(_)
            | Realtime::Spindle(_)
            | Realtime::SpindleStop
            | Realtime::Flood
            | Realtime::Mist
            | Realtime::Own(_) => {} // without effect: its sender sees that, and sends it again
        }
    }
}

/// The main loop's end of a channel.
pub struct Inbox<'a> {
    bytes: Consumer<'a, u8>,
    requests: Consumer<'a, Request>,
    /// The output that waits to be sent to the other end.
    pub(crate) output: Output<'a>,
    /// Collects the line that is being read.
    pub(crate) reader: &'a mut LineReader<LINE>,
    shared: &'a Shared,
    limit: usize,
    /// Ordinary bytes taken since power-up, modulo 2³².
    taken: u32,
    /// Commands that found no room in the queue, which is empty then.
    late: Taken,
}

impl Inbox<'_> {
    /// Takes the next realtime command, whatever bytes are still unread before it. Main loop.
    #[inline]
    pub fn next_realtime(&mut self) -> Option<Request> {
        if let Some(realtime) = self.late.next() {
            return Some(self.at_late_mark(realtime));
        }
        let late = self.shared.late.peek();
        let Some(request) = self.requests.dequeue() else {
            // Everything from before the late commands has been taken.
            self.late = self.shared.late.take(late);
            let realtime = self.late.next();
            return realtime
                .map(|realtime| self.at_late_mark(realtime))
                .or_else(|| self.postponed_report());
        };
        let mark = match request.realtime {
            Realtime::Reset => Mark(self.shared.reset.load(Ordering::Acquire)),
            Realtime::Report
            | Realtime::Hold
            | Realtime::Resume
            | Realtime::Door
            | Realtime::JogCancel
            | Realtime::Feed(_)
            | Realtime::Rapid(_)
            | Realtime::Spindle(_)
            | Realtime::SpindleStop
            | Realtime::Flood
            | Realtime::Mist
            | Realtime::Own(_) => request.mark,
        };
        Some(Request { mark, ..request })
    }

    /// Answers how many ordinary bytes may be taken: those that came before the next realtime
    /// command, and before the other end went away. Main loop.
    pub fn ready(&self) -> usize {
        let here = self.bytes.len();
        // All commands that came ahead of these bytes are in their queue by now.
        fence(Ordering::Acquire);
        let ahead = self.ahead_of_request().unwrap_or(here);
        let closed = self.closed();
        let theirs = closed.map_or(here, |mark| self.ahead_of(mark) as usize);
        here.min(ahead).min(theirs)
    }

    /// Takes one of the bytes that are [`ready`](Self::ready). Main loop.
    pub fn take(&mut self) -> Option<u8> {
        let byte = self.bytes.dequeue()?;
        self.taken = self.taken.wrapping_add(1);
        Some(byte)
    }

    /// Drops the unread bytes that came before `mark`. Main loop; bounded by the size of the queue.
    pub fn drop_before(&mut self, mark: Mark) {
        let ahead = mark.0.wrapping_sub(self.taken);
        if ahead as usize > self.bytes.capacity() {
            return; // the mark has been passed
        }
        for _ in 0..ahead {
            self.take();
        }
    }

    /// Where the other end went away, until [`Inbox::forget_close`]: nothing that came after is
    /// [`ready`](Self::ready). Main loop.
    pub fn closed(&self) -> Option<Mark> {
        let closed = self.shared.closed.load(Ordering::Acquire);
        closed.then(|| Mark(self.shared.closed_at.load(Ordering::Relaxed)))
    }

    /// Lets the bytes come that were received after the other end went away. Main loop.
    pub fn forget_close(&mut self) {
        self.shared.closed.store(false, Ordering::Release);
    }

    /// How many unread bytes came before `mark`. Main loop.
    pub fn ahead_of(&self, mark: Mark) -> u32 {
        let ahead = mark.0.wrapping_sub(self.taken).cast_signed();
        u32::try_from(ahead).unwrap_or(0)
    }

    /// Answers whether the last byte taken came before `mark`. Main loop.
    pub fn is_before(&self, mark: Mark) -> bool {
        mark.0.wrapping_sub(self.taken) <= u32::MAX / 2
    }

    /// Drops all unread bytes. Main loop; bounded by the size of the queue.
    pub fn drop_all(&mut self) {
        for _ in 0..self.bytes.len() {
            self.take();
        }
    }

    /// Answers whether a byte is [`ready`](Self::ready). Main loop.
    pub fn has_bytes(&self) -> bool {
        let theirs = self.closed().is_none_or(|mark| self.ahead_of(mark) > 0);
        theirs && self.bytes.ready() && !self.is_realtime_next()
    }

    /// Answers whether [`next_realtime`](Self::next_realtime) has a command. Main loop.
    pub fn has_requests(&self) -> bool {
        self.requests.ready() || self.is_late() || self.shared.report.load(Ordering::Acquire)
    }

    /// Answers whether somebody has opened the other end since this was asked last. Main loop.
    pub fn take_opened(&mut self) -> bool {
        let opened = self.shared.opened.load(Ordering::Acquire);
        if opened {
            self.shared.opened.store(false, Ordering::Release);
        }
        opened
    }

    /// Answers whether [`take_opened`](Self::take_opened) would. Main loop.
    pub fn was_opened(&self) -> bool {
        self.shared.opened.load(Ordering::Acquire)
    }

    /// Answers how many bytes the channel has room for now: the second number of `Bf:`. Main loop.
    pub fn free(&self) -> usize {
        self.limit.saturating_sub(self.bytes.len())
    }

    /// Answers how many unread bytes the channel takes in all: the last number of `[OPT:`. Main
    /// loop.
    pub fn limit(&self) -> usize {
        self.limit
    }

    /// Answers how many ordinary bytes were lost since power-up. Main loop.
    pub fn lost_bytes(&self) -> u32 {
        self.shared.lost_bytes.load(Ordering::Relaxed)
    }

    fn is_late(&self) -> bool {
        !self.late.is_empty() || self.shared.late.waits()
    }

    /// A late command with its mark. The mark is that of the newest jog cancel: no other late
    /// command needs one.
    fn at_late_mark(&self, realtime: Realtime) -> Request {
        let mark = Mark(self.shared.late.mark());
        Request { realtime, mark }
    }

    fn postponed_report(&mut self) -> Option<Request> {
        let asked = self.shared.report.load(Ordering::Acquire);
        if asked {
            self.shared.report.store(false, Ordering::Release);
        }
        asked.then_some(Request {
            realtime: Realtime::Report,
            mark: Mark(self.taken),
        })
    }

    fn is_realtime_next(&self) -> bool {
        self.ahead_of_request() == Some(0)
    }

    /// How many bytes came before the next realtime command and have not been taken yet; `None`
    /// where there is no command.
    fn ahead_of_request(&self) -> Option<usize> {
        let Some(request) = self.requests.peek() else {
            return self.is_late().then_some(0);
        };
        Some(self.ahead_of(request.mark) as usize)
    }
}

/// Adds one. Serial interrupt.
fn count(counter: &AtomicU32) {
    add(counter, 1);
}

/// Adds `some`. Serial interrupt only, so that a load and a store are enough.
fn add(counter: &AtomicU32, some: u32) {
    counter.store(
        counter.load(Ordering::Relaxed).wrapping_add(some),
        Ordering::Relaxed,
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn receive(receiver: &mut Receiver<'_>, bytes: &[u8]) {
        for byte in bytes {
            receiver.receive(*byte);
        }
    }

    /// The bytes that may be taken at once.
    fn ready(inbox: &mut Inbox<'_>) -> Vec<u8> {
        (0..inbox.ready()).map_while(|_| inbox.take()).collect()
    }

    fn read(inbox: &mut Inbox<'_>) -> Vec<u8> {
        let mut bytes = Vec::new();
        while inbox.has_bytes() {
            bytes.extend(ready(inbox));
        }
        bytes
    }

    #[test]
    fn realtime_bytes_are_picked_out_of_a_line() {
        let mut queue = SerialQueue::<64>::new();
        let (mut receiver, mut inbox) = queue.split();
        receive(&mut receiver, b"G1?X1\xc2\x91\n");
        assert_eq!(inbox.next_realtime().unwrap().realtime, Realtime::Report);
        let step = Realtime::Feed(super::super::realtime::OverrideStep::CoarseUp);
        assert_eq!(inbox.next_realtime().unwrap().realtime, step);
        assert_eq!(inbox.next_realtime(), None);
        assert_eq!(read(&mut inbox), b"G1X1\n");
    }

    #[test]
    fn no_byte_overtakes_a_realtime_command() {
        let mut queue = SerialQueue::<64>::new();
        let (mut receiver, mut inbox) = queue.split();
        receive(&mut receiver, b"ab!cd");
        assert_eq!(read(&mut inbox), b"ab");
        assert_eq!(inbox.next_realtime().unwrap().realtime, Realtime::Hold);
        assert_eq!(read(&mut inbox), b"cd");
    }

    #[test]
    fn a_reset_drops_what_came_before_it_and_keeps_what_came_after() {
        let mut queue = SerialQueue::<64>::new();
        let (mut receiver, mut inbox) = queue.split();
        receive(&mut receiver, b"G0X1\nG0\x18$G\n");
        assert_eq!(inbox.take(), Some(b'G'));
        let reset = inbox.next_realtime().unwrap();
        inbox.drop_before(reset.mark);
        assert_eq!(read(&mut inbox), b"$G\n");
        inbox.drop_before(reset.mark); // passed: nothing happens
        receive(&mut receiver, b"x");
        assert_eq!(read(&mut inbox), b"x");
    }

    #[test]
    fn a_report_asked_for_after_a_reset_comes_after_it() {
        let mut queue = SerialQueue::<64>::new();
        let (mut receiver, mut inbox) = queue.split();
        receive(&mut receiver, b"!\x18?");
        let order: Vec<_> = core::iter::from_fn(|| inbox.next_realtime())
            .map(|request| request.realtime)
            .collect();
        assert_eq!(order, [Realtime::Hold, Realtime::Reset, Realtime::Report]);
    }

    #[test]
    fn what_comes_after_the_other_end_has_gone_waits_until_that_is_dealt_with() {
        let mut queue = SerialQueue::<64>::new();
        let (mut receiver, mut inbox) = queue.split();
        receive(&mut receiver, b"G1X");
        receiver.close();
        receive(&mut receiver, b"$G\n");
        assert_eq!(ready(&mut inbox), b"G1X");
        let mark = inbox.closed().unwrap();
        assert_eq!(inbox.ahead_of(mark), 0);
        inbox.forget_close();
        assert_eq!((inbox.closed(), read(&mut inbox)), (None, b"$G\n".to_vec()));
    }

    #[test]
    fn bytes_beyond_the_limit_are_lost_and_counted() {
        let mut queue = SerialQueue::<1025>::with_limit(128);
        let (mut receiver, mut inbox) = queue.split();
        receive(&mut receiver, &[b'x'; 130]);
        assert_eq!(
            (inbox.free(), inbox.limit(), inbox.lost_bytes()),
            (0, 128, 2)
        );
        assert_eq!(read(&mut inbox).len(), 128);
        assert_eq!(inbox.free(), 128);
    }

    #[test]
    fn the_default_channel_takes_1024_bytes() {
        let mut queue = SerialQueue::<DEFAULT_RX>::new();
        let (mut receiver, inbox) = queue.split();
        assert_eq!(inbox.free(), 1024);
        receive(&mut receiver, &[b'x'; 1024]);
        assert_eq!((inbox.free(), inbox.lost_bytes()), (0, 0));
    }

    #[test]
    fn a_limit_beyond_the_room_is_the_room() {
        let mut queue = SerialQueue::<16>::with_limit(1000);
        let (_, inbox) = queue.split();
        assert_eq!(inbox.free(), 15);
    }

    #[test]
    fn with_a_full_queue_a_reset_a_report_and_the_newest_mark_survive() {
        let mut queue = SerialQueue::<64>::new();
        let (mut receiver, mut inbox) = queue.split();
        receive(&mut receiver, &[0x91; 100]);
        receive(&mut receiver, b"?");
        receive(&mut receiver, b"a\x18b\x18c");
        let requests: Vec<_> = core::iter::from_fn(|| inbox.next_realtime()).collect();
        assert_eq!(requests.len(), DEFAULT_REALTIME - 2 + 2);
        let reset = requests[DEFAULT_REALTIME - 2];
        assert_eq!(reset.realtime, Realtime::Reset);
        assert_eq!(requests.last().unwrap().realtime, Realtime::Report);
        inbox.drop_before(reset.mark);
        assert_eq!(read(&mut inbox), b"c");
    }

    /// The commands that come out behind a full queue.
    fn behind_a_full_queue(bytes: &[u8]) -> Vec<Realtime> {
        let mut queue = SerialQueue::<64>::new();
        let (mut receiver, mut inbox) = queue.split();
        receive(&mut receiver, &[0x91; DEFAULT_REALTIME]);
        receive(&mut receiver, bytes);
        let requests = core::iter::from_fn(|| inbox.next_realtime());
        requests
            .skip(DEFAULT_REALTIME - 2)
            .map(|request| request.realtime)
            .collect()
    }

    #[test]
    fn with_a_full_queue_a_hold_a_resume_a_door_and_a_jog_cancel_survive_in_their_order() {
        use Realtime::{Door, Hold, JogCancel, Report, Reset, Resume};
        let cases: [(&[u8], &[Realtime]); 7] = [
            (b"!", &[Hold]),
            (b"!~", &[Hold, Resume]),
            (b"~!~!", &[Resume, Hold]),
            (b"\x84~?", &[Door, Resume, Report]),
            (b"\x85!\x85", &[Hold, JogCancel]),
            (b"!\x18", &[Reset]),
            (b"\x18!", &[Reset, Hold]),
        ];
        for (bytes, expected) in cases {
            assert_eq!(behind_a_full_queue(bytes), expected, "{bytes:x?}");
        }
    }

    #[test]
    fn what_comes_behind_a_late_command_stays_behind_it() {
        let mut queue = SerialQueue::<256>::new();
        let (mut receiver, mut inbox) = queue.split();
        receive(&mut receiver, &[0x91; 100]);
        receive(&mut receiver, b"!");
        while inbox.requests.ready() {
            inbox.next_realtime();
        }
        // There is room in the queue again, and the hold waits still.
        receive(&mut receiver, b"a~b\x85c");
        assert!(!inbox.has_bytes() && inbox.has_requests());
        let requests: Vec<_> = core::iter::from_fn(|| inbox.next_realtime()).collect();
        let order: Vec<_> = requests.iter().map(|request| request.realtime).collect();
        assert_eq!(
            order,
            [Realtime::Hold, Realtime::Resume, Realtime::JogCancel]
        );
        inbox.drop_before(requests[2].mark);
        assert_eq!(read(&mut inbox), b"c");
    }

    #[test]
    fn marks_survive_the_wrap_of_their_counter() {
        let mut queue = SerialQueue::<16>::new();
        let (mut receiver, mut inbox) = queue.split();
        receiver.received = u32::MAX - 1;
        inbox.taken = u32::MAX - 1;
        receive(&mut receiver, b"abc\x18d");
        let reset = inbox.next_realtime().unwrap();
        inbox.drop_before(reset.mark);
        assert_eq!(read(&mut inbox), b"d");
    }

    proptest! {
        #[test]
        fn ordinary_bytes_arrive_in_order_and_all_others_vanish(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let mut queue = SerialQueue::<256>::new();
            let (mut receiver, mut inbox) = queue.split();
            receive(&mut receiver, &bytes);
            let mut seen = Vec::new();
            loop {
                seen.extend(read(&mut inbox));
                if inbox.next_realtime().is_none() {
                    break;
                }
            }
            let expected: Vec<u8> = bytes
                .into_iter()
                .filter(|byte| matches!(Byte::sort(*byte), Byte::Ordinary(_)))
                .collect();
            prop_assert_eq!(seen, expected);
        }
    }
}
