//! The clients' ends of the machine's serial lines: what waits to go in, what has come out.

use super::line::Outlet;
use crate::clock::Cycle;
use crate::link::Host;
use leadscrew_machine::board::ChannelId;
use leadscrew_machine::protocol::realtime::Byte;
use std::collections::VecDeque;

/// Ends the line of a client that vanished in the middle of it, so that its beginning neither acts nor spoils the next
/// client's first line: leaves any comment, and makes the line longer than any machine takes it.
const SPOIL: [u8; 256] = {
    let mut bytes = [b'X'; 256];
    bytes[0] = b')';
    bytes[255] = b'\n';
    bytes
};

/// What the machine answers to a line that is too long: nobody's business where the client is gone that began it.
const SPOILED: &[u8] = b"error:11\r\n";

/// How the machine's first line after a reset begins: lines before it get no answer any more.
const BANNER: &[u8] = b"Grbl ";

/// One line.
#[derive(Debug, Default)]
struct Wire {
    waiting: VecDeque<u8>,
    /// Bytes of the client among them.
    owed: usize,
    /// Bytes of clients that the machine has taken since [`Wires::taken`].
    taken: usize,
    written: Vec<u8>,
    /// Answers to spoiled lines that are still to come.
    spoiled: usize,
    /// The client that gets what the machine writes.
    outlet: Option<Outlet>,
    /// Whether the last byte of the client was in the middle of a line.
    mid_line: bool,
}

impl Wire {
    /// Takes the answer to a spoiled line out of what is written, if it is the last line there.
    fn forget_spoiled(&mut self) {
        let body = self.written.len() - 1;
        let end_before = self.written[..body].iter().rposition(|byte| *byte == b'\n');
        let before = end_before.map_or(0, |end| end + 1);
        let last = &self.written[before..];
        if last == SPOILED {
            self.written.truncate(before);
            self.spoiled -= 1;
        } else if last.starts_with(BANNER) {
            self.spoiled = 0;
        }
    }
}

/// All lines, as the simulated machine's host.
#[derive(Debug)]
pub(super) struct Wires(Vec<Wire>);

impl Wires {
    /// Makes `count` lines without clients.
    pub(super) fn new(count: usize) -> Self {
        Self((0..count).map(|_| Wire::default()).collect())
    }

    /// A client has come.
    pub(super) fn open(&mut self, line: usize, outlet: Outlet) {
        self.0[line].outlet = Some(outlet);
    }

    /// A client has sent bytes.
    pub(super) fn push(&mut self, line: usize, bytes: &[u8]) {
        let wire = &mut self.0[line];
        let ordinary = |byte: &&u8| matches!(Byte::sort(**byte), Byte::Ordinary(_));
        if let Some(last) = bytes.iter().rfind(ordinary) {
            wire.mid_line = !matches!(last, b'\n' | b'\r');
        }
        wire.waiting.extend(bytes);
        wire.owed += bytes.len();
    }

    /// The client has gone.
    pub(super) fn close(&mut self, line: usize) {
        let wire = &mut self.0[line];
        wire.outlet = None;
        if std::mem::take(&mut wire.mid_line) {
            wire.waiting.extend(SPOIL);
            wire.spoiled += 1;
        }
    }

    /// Forgets what waits to go in: the machine starts anew.
    pub(super) fn clear(&mut self, line: usize) {
        let wire = &mut self.0[line];
        wire.waiting.clear();
        wire.taken += std::mem::take(&mut wire.owed);
    }

    /// Whether bytes wait to go in.
    pub(super) fn wait(&self) -> bool {
        self.0.iter().any(|wire| !wire.waiting.is_empty())
    }

    /// How many bytes of clients the machine has taken since it was asked last.
    pub(super) fn taken(&mut self, line: usize) -> usize {
        std::mem::take(&mut self.0[line].taken)
    }

    /// What the machine has written since it was asked last; while a spoiled line's answer is to come, whole lines.
    pub(super) fn written(&mut self, line: usize) -> Vec<u8> {
        let wire = &mut self.0[line];
        if wire.spoiled == 0 {
            return std::mem::take(&mut wire.written);
        }
        let whole = wire.written.iter().rposition(|byte| *byte == b'\n');
        let rest = wire.written.split_off(whole.map_or(0, |end| end + 1));
        std::mem::replace(&mut wire.written, rest)
    }

    /// Sends bytes to the client, if there is one; answers whether there was room for them.
    pub(super) fn send(&self, line: usize, bytes: Vec<u8>) -> bool {
        self.0[line]
            .outlet
            .as_ref()
            .is_none_or(|outlet| outlet.send(bytes))
    }
}

impl Host for Wires {
    fn next_byte(&mut self, channel: ChannelId) -> Option<u8> {
        let wire = self.0.get_mut(usize::from(channel.0))?;
        let byte = wire.waiting.pop_front()?;
        if wire.owed > 0 {
            wire.owed -= 1;
            wire.taken += 1;
        }
        Some(byte)
    }

    fn receive(&mut self, channel: ChannelId, byte: u8, _now: Cycle) {
        if let Some(wire) = self.0.get_mut(usize::from(channel.0)) {
            wire.written.push(byte);
            if byte == b'\n' && wire.spoiled > 0 {
                wire.forget_spoiled();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(wires: &mut Wires) -> Vec<u8> {
        std::iter::from_fn(|| wires.next_byte(ChannelId(0))).collect()
    }

    #[test]
    fn a_line_whose_client_vanished_is_spoiled_and_ended() {
        let mut wires = Wires::new(1);
        wires.push(0, b"G0X1\nG1X100 (half a com?");
        wires.close(0);
        let bytes = all(&mut wires);
        assert!(bytes.starts_with(b"G0X1\nG1X100 (half a com?)XXX") && bytes.ends_with(b"X\n"));
    }

    fn write(wires: &mut Wires, bytes: &[u8]) -> String {
        for byte in bytes {
            wires.receive(ChannelId(0), *byte, Cycle::ZERO);
        }
        String::from_utf8(wires.written(0)).unwrap()
    }

    #[test]
    fn the_answer_to_a_spoiled_line_is_nobodys_not_even_in_pieces() {
        let mut wires = Wires::new(1);
        wires.push(0, b"G0X1\nG1X100");
        wires.close(0);
        assert_eq!(write(&mut wires, b"ok\r\nerr"), "ok\r\n");
        assert_eq!(write(&mut wires, b"or:11\r\n"), "");
        assert_eq!(write(&mut wires, b"error:11\r\no"), "error:11\r\no");
        assert_eq!(write(&mut wires, b"k\r\n"), "k\r\n");
    }

    #[test]
    fn a_spoiled_line_gets_no_answer_after_a_reset() {
        let mut wires = Wires::new(1);
        wires.push(0, b"G1X100");
        wires.close(0);
        let banner = "\r\nGrbl 1.1h ['$' for help]\r\n";
        assert_eq!(write(&mut wires, banner.as_bytes()), banner);
        assert_eq!(write(&mut wires, b"error:11\r\n"), "error:11\r\n");
    }

    #[test]
    fn a_client_that_goes_after_its_last_line_leaves_nothing_behind() {
        let mut wires = Wires::new(1);
        wires.push(0, b"G0X1\n?");
        wires.push(0, b"!");
        wires.close(0);
        assert_eq!(all(&mut wires), b"G0X1\n?!");
        assert_eq!(wires.taken(0), 7);
        assert_eq!(wires.taken(0), 0);
    }
}
