//! The main loop's end of a channel.

use super::late::Taken;
use super::{Mark, Request, Shared, LINE};
use crate::line_reader::LineReader;
use crate::output::Output;
use crate::realtime::Realtime;
use core::sync::atomic::{fence, Ordering};
use heapless::spsc::Consumer;

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
