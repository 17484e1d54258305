//! What waits to be sent on one serial line.

use crate::board::{Board, ChannelId};
use core::fmt;
use heapless::Deque;

/// Bytes that may wait to be sent on one line.
const OUTPUT: usize = 1024;

/// Room that a report fits into, and leaves enough for the messages that may come then.
const REPORT_ROOM: usize = 512;

/// Bytes that wait to be sent.
#[derive(Debug)]
pub(crate) struct Output {
    waiting: Deque<u8, OUTPUT>,
    /// Bytes that found no room: messages on a line whose other end has stopped reading.
    lost: u32,
}

impl Output {
    pub(crate) const fn new() -> Self {
        Self {
            waiting: Deque::new(),
            lost: 0,
        }
    }

    /// Whether a report fits.
    pub(crate) fn has_room(&self) -> bool {
        OUTPUT - self.waiting.len() >= REPORT_ROOM
    }

    /// Whether nothing waits.
    pub(crate) fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Bytes that were lost for want of room since power-up.
    pub(crate) fn lost(&self) -> u32 {
        self.lost
    }

    /// Adds a line and its CR LF.
    pub(crate) fn line(&mut self, line: impl fmt::Display) {
        // Writing here cannot fail; see `write_str`.
        let _ = fmt::write(self, format_args!("{line}\r\n"));
    }

    /// Adds `ok` and its CR LF, as [`Output::line`] would: nearly all answers, without the ways of formatting.
    pub(crate) fn ok(&mut self) {
        let _ = fmt::Write::write_str(self, "ok\r\n");
    }

    /// Hands the board what it takes; returns how many bytes that was.
    pub(crate) fn flush<B: Board>(&mut self, channel: ChannelId, board: &mut B) -> u32 {
        let (first, second) = self.waiting.as_slices();
        let mut sent = board.write(channel, first);
        if sent == first.len() && !second.is_empty() {
            sent += board.write(channel, second);
        }
        for _ in 0..sent {
            self.waiting.pop_front();
        }
        u32::try_from(sent).unwrap_or(u32::MAX)
    }
}

impl fmt::Write for Output {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            if self.waiting.push_back(byte).is_err() {
                self.lost = self.lost.wrapping_add(1);
            }
        }
        Ok(())
    }
}
