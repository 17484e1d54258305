//! The serial interrupt's end of a channel.

use super::{Mark, Request, Shared};
use crate::realtime::{Byte, Realtime};
use core::sync::atomic::{AtomicU32, Ordering};
use heapless::spsc::Producer;

/// The serial interrupt's end of a channel.
pub struct Receiver<'a> {
    pub(super) bytes: Producer<'a, u8>,
    pub(super) requests: Producer<'a, Request>,
    pub(super) shared: &'a Shared,
    pub(super) limit: usize,
    /// Ordinary bytes queued since power-up, modulo 2³².
    pub(super) received: u32,
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
