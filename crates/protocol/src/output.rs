//! The output that waits to be sent on one serial line.

use core::fmt;
use heapless::deque::DequeView;

/// Bytes of room in which a report fits, with enough left for messages that may follow it. It is
/// also the least size of an output.
pub const LEAST_TX: usize = 512;

/// Bytes of room that a message leaves free for an alarm, the greeting and an answer: senders
/// depend on those.
const MESSAGES_LEAVE: usize = 256;

/// Bytes that wait to be sent.
pub struct Output<'a> {
    waiting: &'a mut DequeView<u8>,
    /// Bytes that found no room: of messages on a line whose other end reads too slowly, or has
    /// stopped reading.
    lost: u32,
}

impl<'a> Output<'a> {
    pub(crate) fn new(waiting: &'a mut DequeView<u8>) -> Self {
        Self { waiting, lost: 0 }
    }

    /// Whether a report fits.
    pub fn has_room(&self) -> bool {
        self.room() >= LEAST_TX
    }

    fn room(&self) -> usize {
        self.waiting.storage_capacity() - self.waiting.storage_len()
    }

    /// Whether nothing waits.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Bytes that were lost for want of room since power-up.
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// Adds a line and its CR LF: whole, or where there is no room for it, not at all.
    pub fn line(&mut self, line: impl fmt::Display) {
        self.add(0, format_args!("{line}\r\n"));
    }

    /// As [`Output::line`], for text that may be missed where the other end reads slowly.
    pub fn message(&mut self, line: impl fmt::Display) {
        self.add(MESSAGES_LEAVE, format_args!("{line}\r\n"));
    }

    /// Adds `text` where that leaves `room` bytes; otherwise nothing.
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

    /// Hands `write` as many bytes as it takes; returns their number. `write` answers how many of the
    /// bytes it took.
    pub fn flush(&mut self, mut write: impl FnMut(&[u8]) -> usize) -> u32 {
        let (first, second) = self.waiting.as_slices();
        let mut sent = write(first);
        if sent == first.len() && !second.is_empty() {
            sent += write(second);
        }
        for _ in 0..sent {
            self.waiting.pop_front();
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
