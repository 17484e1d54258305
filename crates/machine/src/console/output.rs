//! The output that waits to be sent on one serial line.

use crate::board::{Board, ChannelId};
use core::fmt;
use heapless::Deque;

/// Bytes that may wait to be sent on one line.
const OUTPUT: usize = 1024;

/// Room that a report fits into, and leaves enough for the messages that may come then.
const REPORT_ROOM: usize = 512;

/// Messages leave this room, bytes: for an alarm, the greeting and an answer, which others depend
/// on.
const MESSAGES_LEAVE: usize = 256;

/// Bytes that wait to be sent.
#[derive(Debug)]
pub(crate) struct Output {
    waiting: Deque<u8, OUTPUT>,
    /// Bytes that found no room: of messages on a line whose other end reads too slowly, or has
    /// stopped reading.
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

    /// Adds a line and its CR LF: whole, or where there is no room for it, not at all.
    pub(crate) fn line(&mut self, line: impl fmt::Display) {
        self.add(0, format_args!("{line}\r\n"));
    }

    /// As [`Output::line`], for text that may be missed where the other end reads slowly.
    pub(crate) fn message(&mut self, line: impl fmt::Display) {
        self.add(MESSAGES_LEAVE, format_args!("{line}\r\n"));
    }

    /// Adds `text` where that leaves `room` bytes; otherwise nothing.
    fn add(&mut self, room: usize, text: fmt::Arguments<'_>) {
        let (before, lost) = (self.waiting.len(), self.lost);
        // Writing here cannot fail; see `write_str`.
        let _ = fmt::write(self, text);
        if self.lost != lost || OUTPUT - self.waiting.len() < room {
            while self.waiting.len() > before && self.waiting.pop_back().is_some() {
                self.lost = self.lost.wrapping_add(1);
            }
        }
    }

    /// Adds `ok` and its CR LF, as [`Output::line`] would: nearly all answers, without the ways of
    /// formatting.
    pub(crate) fn ok(&mut self) {
        let _ = fmt::Write::write_str(self, "ok\r\n");
    }

    /// Hands the board as many bytes as it takes; returns their number.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn text(output: &Output) -> std::string::String {
        let bytes = output.waiting.iter().copied().collect();
        std::string::String::from_utf8(bytes).unwrap()
    }

    extern crate std;

    #[test]
    fn a_message_without_room_is_missed_whole_and_an_answer_still_fits() {
        let mut output = Output::new();
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
        let mut output = Output::new();
        for _ in 0..100 {
            output.line("a line of 29 characters or so");
        }
        assert!(text(&output).ends_with("or so\r\n"));
    }
}
