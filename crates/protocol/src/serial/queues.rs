//! The queues between the serial interrupt and the main loop, both directions.
//!
//! The serial interrupt puts received bytes in by its [`Receiver`]. The main loop takes them out by
//! its [`Inbox`]. [`Output`] holds the bytes that wait to be sent.

use super::late::Taken;
use super::{Mark, Request, Shared, LINE};
use crate::line_reader::{is_line_end, LineReader};
use crate::realtime::{Byte, Realtime, Sorter};
use core::fmt;
use core::sync::atomic::{fence, AtomicU32, Ordering};
use heapless::deque::DequeView;
use heapless::spsc::{Consumer, Producer};

/// The serial interrupt's end of a channel.
pub struct Receiver<'a> {
    pub(super) bytes: Producer<'a, u8>,
    pub(super) requests: Producer<'a, Request>,
    pub(super) shared: &'a Shared,
    pub(super) limit: usize,
    /// Ordinary bytes queued since power-up, modulo 2³².
    pub(super) received: u32,
    pub(super) sorter: Sorter,
}

impl Receiver<'_> {
    /// Takes a received byte. Serial interrupt; bounded.
    ///
    /// Returns the realtime command if the byte is one, for a board that wants to act at once; the
    /// inbox gets the command in any case. Returns `None` for a byte of a line, and for a byte that
    /// means nothing. Wake a main loop that sleeps, whatever is returned.
    #[inline]
    pub fn receive(&mut self, byte: u8) -> Option<Realtime> {
        match self.sorter.sort(byte) {
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

    /// Returns how many ordinary bytes were lost since power-up. Serial interrupt.
    pub fn lost_bytes(&self) -> u32 {
        self.shared.lost_bytes.load(Ordering::Relaxed)
    }

    /// Notes that at least this number of bytes was lost before they came here. Serial interrupt.
    pub fn lose(&mut self, bytes: u32) {
        add(&self.shared.lost_bytes, bytes);
    }

    /// Notes that the other end has gone away: a socket that closed, a cable that was pulled. Bytes
    /// that come after this are from another sender. Serial interrupt; the caller then wakes the
    /// main loop.
    pub fn close(&mut self) {
        self.shared
            .closed_at
            .store(self.received, Ordering::Relaxed);
        self.shared.closed.store(true, Ordering::Release);
        self.sorter = Sorter::new();
    }

    fn keep(&mut self, byte: u8) {
        // If the limit is the queue's own capacity, `enqueue` checks it.
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
            return; // queued behind the late commands
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
            Realtime::Reset => {} // a reset is queued already, and takes the mark of this one
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

/// The main loop's end of a channel.
pub struct Inbox<'a> {
    pub(super) bytes: Consumer<'a, u8>,
    pub(super) requests: Consumer<'a, Request>,
    /// The output that waits to be sent to the other end.
    pub output: Output<'a>,
    /// Collects the line that is being read.
    pub reader: &'a mut LineReader<LINE>,
    pub(super) shared: &'a Shared,
    pub(super) limit: usize,
    /// Ordinary bytes taken since power-up, modulo 2³².
    pub(super) taken: u32,
    /// Commands that found no room in the queue, which is empty then.
    pub(super) late: Taken,
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
            // All commands from before the late ones have been taken.
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

    /// Returns how many ordinary bytes may be taken: those that came before the next realtime
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

    /// Reads on, at most `most` of the bytes that are [`ready`](Self::ready); returns how many were
    /// read, and whether they complete the line. Main loop.
    pub fn read_line(&mut self, most: usize) -> (u32, bool) {
        let (mut read, mut complete) = (0, false);
        for _ in 0..self.ready().min(most) {
            let Some(byte) = self.bytes.dequeue() else {
                break;
            };
            read += 1;
            complete = self.reader.push(byte);
            if complete {
                break;
            }
        }
        self.taken = self.taken.wrapping_add(read);
        (read, complete)
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

    /// Returns the mark at which the other end went away, if it did, until [`Inbox::forget_close`]:
    /// nothing that came after is [`ready`](Self::ready). Main loop.
    pub fn closed(&self) -> Option<Mark> {
        let closed = self.shared.closed.load(Ordering::Acquire);
        closed.then(|| Mark(self.shared.closed_at.load(Ordering::Relaxed)))
    }

    /// Makes the bytes [`ready`](Self::ready) that were received after the other end went away.
    /// Main loop.
    pub fn forget_close(&mut self) {
        self.shared.closed.store(false, Ordering::Release);
    }

    /// Returns the number of unread bytes that came before `mark`. Main loop.
    pub fn ahead_of(&self, mark: Mark) -> u32 {
        let ahead = mark.0.wrapping_sub(self.taken).cast_signed();
        u32::try_from(ahead).unwrap_or(0)
    }

    /// Returns whether the last byte taken came before `mark`. Main loop.
    pub fn is_before(&self, mark: Mark) -> bool {
        mark.0.wrapping_sub(self.taken) <= u32::MAX / 2
    }

    /// Drops all unread bytes, and what the reader has of a line. The rest of a line of which only
    /// the begin has come is no line. Main loop; bounded by the size of the queue.
    pub fn drop_all(&mut self) {
        let mut torn = self.reader.has_begun();
        for _ in 0..self.bytes.len() {
            torn = self.take().map_or(torn, |byte| !is_line_end(byte));
        }
        self.reader.clear();
        if torn {
            self.reader.tear();
        }
    }

    /// Returns whether a byte is [`ready`](Self::ready). Main loop.
    pub fn has_bytes(&self) -> bool {
        let theirs = self.closed().is_none_or(|mark| self.ahead_of(mark) > 0);
        theirs && self.bytes.ready() && !self.is_realtime_next()
    }

    /// Returns whether [`next_realtime`](Self::next_realtime) has a command. Main loop.
    pub fn has_requests(&self) -> bool {
        self.requests.ready() || self.is_late() || self.shared.report.load(Ordering::Acquire)
    }

    /// Returns whether somebody has opened the other end since this was asked last. Main loop.
    pub fn take_opened(&mut self) -> bool {
        let opened = self.shared.opened.load(Ordering::Acquire);
        if opened {
            self.shared.opened.store(false, Ordering::Release);
        }
        opened
    }

    /// Returns whether [`take_opened`](Self::take_opened) would. Main loop.
    pub fn was_opened(&self) -> bool {
        self.shared.opened.load(Ordering::Acquire)
    }

    /// Returns how many bytes the channel has room for now: the second number of `Bf:`. Main loop.
    pub fn free(&self) -> usize {
        self.limit.saturating_sub(self.bytes.len())
    }

    /// Returns how many unread bytes the channel takes in all: the last number of `[OPT:`. Main
    /// loop.
    pub fn limit(&self) -> usize {
        self.limit
    }

    /// Returns how many ordinary bytes were lost since power-up. Main loop.
    pub fn lost_bytes(&self) -> u32 {
        self.shared.lost_bytes.load(Ordering::Relaxed)
    }

    fn is_late(&self) -> bool {
        !self.late.is_empty() || self.shared.late.waits()
    }

    /// A late command with its mark. Only a jog cancel needs a mark, so every late command gets the
    /// mark of the newest jog cancel.
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

    /// Returns how many bytes came before the next realtime command and have not been taken yet;
    /// `None` if there is no command.
    fn ahead_of_request(&self) -> Option<usize> {
        let Some(request) = self.requests.peek() else {
            return self.is_late().then_some(0);
        };
        Some(self.ahead_of(request.mark) as usize)
    }
}

/// Bytes of room in which a report fits, with enough left for messages that may follow it. It is
/// also the least size of an output.
pub const LEAST_TX: usize = 512;

/// Bytes of room that a message leaves free for an alarm, the greeting and an answer: senders
/// depend on those.
const MESSAGES_LEAVE: usize = 256;

/// The output that waits to be sent on one serial line.
pub struct Output<'a> {
    waiting: &'a mut DequeView<u8>,
    /// Bytes that found no room, because the other end reads too slowly or has stopped reading.
    lost: u32,
}

impl<'a> Output<'a> {
    pub(super) fn new(waiting: &'a mut DequeView<u8>) -> Self {
        Self { waiting, lost: 0 }
    }

    /// Returns true if a report fits.
    pub fn has_room(&self) -> bool {
        self.room() >= LEAST_TX
    }

    fn room(&self) -> usize {
        self.waiting.storage_capacity() - self.waiting.storage_len()
    }

    /// Returns true if nothing waits.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Returns the number of bytes that were lost for want of room since power-up.
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// Adds a line and its CR LF: whole, or if there is no room for it, not at all.
    pub fn line(&mut self, line: impl fmt::Display) {
        self.add(0, format_args!("{line}\r\n"));
    }

    /// As [`Output::line`], for text that may be missed if the other end reads slowly.
    pub fn message(&mut self, line: impl fmt::Display) {
        self.add(MESSAGES_LEAVE, format_args!("{line}\r\n"));
    }

    /// Adds `text` if that leaves `room` bytes; otherwise nothing.
    fn add(&mut self, room: usize, text: fmt::Arguments<'_>) {
        let (before, lost) = (self.waiting.storage_len(), self.lost);
        // Writing here cannot fail; see `write_str`.
        let _ = fmt::write(self, text);
        if self.lost != lost || self.room() < room {
            let torn = self.waiting.storage_len() - before;
            self.waiting.truncate(before);
            self.lost = self.lost.wrapping_add(torn as u32);
        }
    }

    /// Adds `ok` and its CR LF, as [`Output::line`] would. Nearly all answers are `ok`, and this
    /// one skips the formatting.
    pub fn ok(&mut self) {
        let _ = fmt::Write::write_str(self, "ok\r\n");
    }

    /// Hands `write` as many bytes as it takes; returns their number. `write` returns how many of
    /// the bytes it took.
    pub fn flush(&mut self, mut write: impl FnMut(&[u8]) -> usize) -> u32 {
        let (first, second) = self.waiting.as_slices();
        let mut sent = write(first);
        if sent == first.len() && !second.is_empty() {
            sent += write(second);
        }
        if sent == self.waiting.storage_len() {
            self.waiting.clear();
        } else {
            for _ in 0..sent {
                self.waiting.pop_front();
            }
        }
        u32::try_from(sent).unwrap_or(u32::MAX)
    }
}

impl fmt::Write for Output<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            if self.waiting.push_back(byte).is_err() {
                self.lost = self.lost.wrapping_add(1);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heapless::Deque;

    fn text(output: &Output<'_>) -> std::string::String {
        let bytes = output.waiting.iter().copied().collect();
        std::string::String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn a_message_without_room_is_missed_whole_and_an_answer_still_fits() {
        let mut waiting = Deque::<_, 1024>::new();
        let mut output = Output::new(&mut waiting);
        for _ in 0..100 {
            output.message("[MSG:twenty characters]");
        }
        output.line("ALARM:1");
        output.ok();
        let text = text(&output);
        assert!(text.ends_with("characters]\r\nALARM:1\r\nok\r\n"), "{text}");
        assert_eq!(text.matches("[MSG:").count(), 30);
        assert_eq!(output.lost(), 70 * 25);
    }

    #[test]
    fn no_line_is_torn() {
        let mut waiting = Deque::<_, 1024>::new();
        let mut output = Output::new(&mut waiting);
        for _ in 0..100 {
            output.line("a line of 29 characters or so");
        }
        assert!(text(&output).ends_with("or so\r\n"));
    }
}
