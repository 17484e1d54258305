//! The host's end of the serial line: bytes that wait to be sent, and lines received.

use crate::clock::Cycle;
use crate::link::Host;
use leadscrew_machine::board::ChannelId;
use std::collections::VecDeque;

/// The bytes sent and received; they outlive the machine's power cycles.
#[derive(Debug, Default)]
pub(super) struct Wire {
    waiting: VecDeque<u8>,
    line: Vec<u8>,
    lines: Vec<String>,
    answers: u32,
    last_byte: Cycle,
    /// The time at which the machine was last powered up.
    power_up: Cycle,
}

impl Wire {
    pub(super) fn new() -> Self {
        Self::default()
    }

    /// Continues with a machine that was powered up at `now`, counted from the first power-up.
    pub(super) fn power_up(&mut self, now: Cycle) {
        self.power_up = now;
    }

    /// Queues bytes; they are sent as time passes.
    pub(super) fn send(&mut self, bytes: &[u8]) {
        self.waiting.extend(bytes);
    }

    /// Returns true if all queued bytes have been sent.
    pub(super) fn is_sent(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Returns how many lines have come that are `ok` or `error:N` and nothing else.
    pub(super) fn answers(&self) -> u32 {
        self.answers
    }

    /// Returns when the last byte came, since the first power-up.
    pub(super) fn last_byte(&self) -> Cycle {
        self.last_byte
    }

    /// Takes the lines that have come.
    pub(super) fn take_lines(&mut self) -> Vec<String> {
        std::mem::take(&mut self.lines)
    }

    fn end_line(&mut self) {
        let line = String::from_utf8_lossy(&std::mem::take(&mut self.line)).into_owned();
        self.answers += u32::from(is_answer(&line));
        self.lines.push(line);
    }
}

impl Host for Wire {
    fn next_byte(&mut self, _: ChannelId) -> Option<u8> {
        self.waiting.pop_front()
    }

    fn receive(&mut self, _: ChannelId, byte: u8, now: Cycle) {
        self.last_byte = self.power_up + now.0;
        match byte {
            b'\r' => {}
            b'\n' => self.end_line(),
            byte => self.line.push(byte),
        }
    }
}

/// Returns true if a received line answers a sent line. The output of a startup line, `>G21:ok`,
/// does not.
fn is_answer(line: &str) -> bool {
    line == "ok" || line.starts_with("error:")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_with_lf_and_answers_are_counted() {
        let mut wire = Wire::new();
        for byte in *b"\r\nok\r\n>G21:ok\r\nerror:20\r\no" {
            wire.receive(ChannelId(0), byte, Cycle(7));
        }
        assert_eq!(wire.take_lines(), ["", "ok", ">G21:ok", "error:20"]);
        assert_eq!((wire.answers(), wire.last_byte()), (2, Cycle(7)));
    }
}
