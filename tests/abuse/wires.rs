//! The tests' end of the serial lines, and the bytes that went over them.

use leadscrew_machine::board::ChannelId;
use leadscrew_sim::{Cycle, Host};
use std::collections::VecDeque;

/// The number of serial lines.
pub(super) const LINES: usize = 2;

/// One serial line.
#[derive(Default)]
pub(super) struct Wire {
    to_send: VecDeque<u8>,
    heard: Vec<u8>,
    /// The bytes sent so far.
    sent: Vec<u8>,
    /// Lines that have been sent.
    lines: usize,
    /// The number of greetings that were heard.
    banners: usize,
}

const BANNER: &[u8] = b"Grbl 1.1h";

impl Wire {
    pub(super) fn send(&mut self, bytes: &[u8]) {
        self.to_send.extend(bytes);
    }

    fn begin(&mut self) -> usize {
        self.to_send.clear();
        self.heard.len()
    }

    fn heard_since(&self, begin: usize) -> &str {
        std::str::from_utf8(&self.heard[begin..]).expect("text")
    }

    /// The number of lines that were answered.
    fn answers(&self) -> usize {
        let lines = self.heard_since(0).lines();
        let is_answer = |line: &&str| *line == "ok" || line.starts_with("error:");
        lines.filter(is_answer).count()
    }

    /// Checks that each line has one answer. A reset drops lines without an answer, and no line is
    /// answered twice. `complete`: no byte was lost, and no line waits.
    pub(super) fn assert_answered(&self, complete: bool) {
        let (lines, answers) = (self.lines, self.answers());
        let heard = self.heard_since(0);
        assert!(answers <= lines, "{answers} of {lines}: {heard}");
        if complete && self.banners == 1 {
            assert_eq!(answers, lines, "{heard}");
        }
    }
}

/// All serial lines.
#[derive(Default)]
pub(super) struct Wires(pub(super) [Wire; LINES]);

impl Wires {
    /// Returns true if a line was sent that stops the spindle until the next move: `$H`, `$30=` or
    /// `$31=`, in any spelling.
    pub(super) fn stop_the_spindle(&self) -> bool {
        let lines = |wire: &Wire| {
            let mut lines = wire.sent.split(|byte| matches!(byte, b'\r' | b'\n'));
            lines.any(|line| line.contains(&b'$') && line.iter().any(|byte| b"Hh3".contains(byte)))
        };
        self.0.iter().any(lines)
    }

    /// Drops the bytes that wait to be sent. Returns where the next output begins on each line.
    pub(super) fn begin(&mut self) -> [usize; LINES] {
        self.0.each_mut().map(Wire::begin)
    }

    /// Greetings heard on the line that never waits.
    pub(super) fn banners(&self) -> usize {
        self.0[0].banners
    }

    /// The output on each line since the positions `begin`.
    pub(super) fn heard_since(&self, begin: [usize; LINES]) -> [String; LINES] {
        std::array::from_fn(|line| self.0[line].heard_since(begin[line]).to_owned())
    }
}

impl Host for Wires {
    fn next_byte(&mut self, channel: ChannelId) -> Option<u8> {
        let wire = &mut self.0[usize::from(channel.0)];
        let byte = wire.to_send.pop_front()?;
        wire.sent.push(byte);
        wire.lines += usize::from(matches!(byte, b'\r' | b'\n'));
        Some(byte)
    }

    fn receive(&mut self, channel: ChannelId, byte: u8, _: Cycle) {
        let wire = &mut self.0[usize::from(channel.0)];
        wire.heard.push(byte);
        wire.banners += usize::from(wire.heard.ends_with(BANNER));
    }
}
