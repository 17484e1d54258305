//! The clients' ends of the machine's serial lines: bytes that wait to go to the machine, and bytes
//! that came from it.

use crate::outlet::Outlet;
use leadscrew_machine::board::ChannelId;
use leadscrew_sim::clock::Cycle;
use leadscrew_sim::link::Host;
use std::collections::VecDeque;

/// One line.
#[derive(Debug, Default)]
struct Wire {
    waiting: VecDeque<u8>,
    /// The number of waiting bytes that a client had sent before it disconnected; `None` if no
    /// client has disconnected.
    gone: Option<usize>,
    /// Bytes that the machine has taken since the last call of [`Wires::taken`].
    taken: usize,
    /// Bytes that the machine may still take in this slice of time.
    left: usize,
    written: Vec<u8>,
    /// The client that gets the machine's output.
    outlet: Option<Outlet>,
}

/// Bytes that a line may bring in a slice of time, at most 2 ms. So a line that floods the machine
/// delays the bytes of the others by the time of so many. It is 128 KB/s and more, ten times what
/// the fastest serial lines bring.
const SLICE: usize = 256;

/// All lines, as the simulated machine's host.
#[derive(Debug)]
pub struct Wires(Vec<Wire>);

impl Wires {
    /// Makes `count` lines without clients.
    pub fn new(count: usize) -> Self {
        Self((0..count).map(|_| Wire::default()).collect())
    }

    /// Returns the number of lines.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// Begins a slice of time.
    pub(crate) fn begin_slice(&mut self) {
        self.0.iter_mut().for_each(|wire| wire.left = SLICE);
    }

    /// Notes that a client has connected to a line.
    pub fn open(&mut self, line: usize, outlet: Outlet) {
        self.0[line].outlet = Some(outlet);
    }

    /// Notes bytes that a client has sent.
    pub fn push(&mut self, line: usize, bytes: &[u8]) {
        self.0[line].waiting.extend(bytes);
    }

    /// Notes that the client has disconnected.
    pub fn close(&mut self, line: usize) {
        let wire = &mut self.0[line];
        wire.outlet = None;
        wire.gone = Some(wire.waiting.len());
    }

    /// Drops the bytes that wait to go to the machine, because it is reset.
    pub fn clear(&mut self, line: usize) {
        let wire = &mut self.0[line];
        wire.taken += wire.waiting.len();
        wire.waiting.clear();
        wire.gone = None;
    }

    /// Returns true if bytes wait to go to the machine.
    pub fn wait(&self) -> bool {
        self.0.iter().any(|wire| !wire.waiting.is_empty())
    }

    /// Returns how many bytes of clients the machine has taken since the last call.
    pub fn taken(&mut self, line: usize) -> usize {
        std::mem::take(&mut self.0[line].taken)
    }

    /// Returns the machine's output since the last call.
    pub fn written(&mut self, line: usize) -> Vec<u8> {
        std::mem::take(&mut self.0[line].written)
    }

    /// Sends bytes to the client, if there is one; returns whether there was room for them.
    pub fn send(&self, line: usize, bytes: Vec<u8>) -> bool {
        self.0[line]
            .outlet
            .as_ref()
            .is_none_or(|outlet| outlet.send(bytes))
    }
}

impl Host for Wires {
    fn next_byte(&mut self, channel: ChannelId) -> Option<u8> {
        let wire = self.0.get_mut(usize::from(channel.0))?;
        if wire.gone == Some(0) || wire.left == 0 {
            return None;
        }
        let byte = wire.waiting.pop_front()?;
        wire.gone = wire.gone.map(|ahead| ahead - 1);
        wire.taken += 1;
        wire.left -= 1;
        Some(byte)
    }

    fn closes(&mut self, channel: ChannelId) -> bool {
        let wire = self.0.get_mut(usize::from(channel.0));
        wire.is_some_and(|wire| wire.gone.take_if(|ahead| *ahead == 0).is_some())
    }

    fn receive(&mut self, channel: ChannelId, byte: u8, _now: Cycle) {
        if let Some(wire) = self.0.get_mut(usize::from(channel.0)) {
            wire.written.push(byte);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: ChannelId = ChannelId(0);

    fn all(wires: &mut Wires) -> Vec<u8> {
        wires.begin_slice();
        std::iter::from_fn(|| wires.next_byte(LINE)).collect()
    }

    #[test]
    fn a_client_goes_behind_its_bytes_and_ahead_of_those_of_the_next_one() {
        let mut wires = Wires::new(1);
        wires.push(0, b"G0X1\nG1X");
        wires.close(0);
        wires.push(0, b"$G\n");
        assert!(!wires.closes(LINE));
        assert_eq!(all(&mut wires), b"G0X1\nG1X");
        assert!(wires.closes(LINE) && !wires.closes(LINE));
        assert_eq!(all(&mut wires), b"$G\n");
        assert_eq!((wires.taken(0), wires.taken(0)), (11, 0));
    }

    #[test]
    fn a_line_brings_no_more_in_a_slice_than_its_share() {
        let mut wires = Wires::new(2);
        wires.push(0, &[b'?'; 2 * SLICE + 1]);
        wires.push(1, b"!");
        assert_eq!(all(&mut wires).len(), SLICE);
        assert_eq!(wires.next_byte(ChannelId(1)), Some(b'!'));
        assert_eq!(all(&mut wires).len(), SLICE);
        assert_eq!(all(&mut wires).len(), 1);
    }

    #[test]
    fn a_machine_that_starts_anew_knows_of_no_client_before() {
        let mut wires = Wires::new(1);
        wires.push(0, b"G0X1\n");
        wires.close(0);
        wires.clear(0);
        wires.push(0, b"?");
        assert_eq!(all(&mut wires), b"?");
        assert!(!wires.closes(LINE));
        assert_eq!(wires.taken(0), 6);
    }
}
