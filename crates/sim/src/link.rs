//! Serial lines between the board and a host. On some lines a byte takes time, on others none.
//!
//! ```text
//!   Host::next_byte --(10 bit times)--> serial interrupt: Receiver::receive
//!   Host::receive <--(10 bit times)--- send buffer <--- Board::write
//! ```
//!
//! A line that *never waits* stands for one that is faster than the machine, such as USB: packets
//! of up to 64 bytes come in whenever the main loop has finished a turn, and all that is written
//! goes out at once.

use crate::clock::{Cycle, CPU_HZ};
use leadscrew_machine::board::ChannelId;
use std::collections::VecDeque;
use std::num::NonZeroU32;

/// The program at the other end of the serial lines.
pub trait Host {
    /// The next byte that the host sends on `channel`, if it has one to send now.
    ///
    /// Asked when the line is free, and again after each byte that the host receives.
    fn next_byte(&mut self, channel: ChannelId) -> Option<u8>;

    /// Returns true if the host has closed the line since it was last asked. The bytes that it sent
    /// before are on the way; after them the board notices the close.
    fn closes(&mut self, channel: ChannelId) -> bool {
        let _ = channel;
        false
    }

    /// A byte from the board has come in.
    fn receive(&mut self, channel: ChannelId, byte: u8, now: Cycle);

    /// Returns true if the host has sent all that it has to send, and has heard an answer to each
    /// line.
    fn is_done(&self) -> bool {
        false
    }
}

impl<H: Host + ?Sized> Host for &mut H {
    fn next_byte(&mut self, channel: ChannelId) -> Option<u8> {
        (**self).next_byte(channel)
    }
    fn closes(&mut self, channel: ChannelId) -> bool {
        (**self).closes(channel)
    }
    fn receive(&mut self, channel: ChannelId, byte: u8, now: Cycle) {
        (**self).receive(channel, byte, now);
    }
    fn is_done(&self) -> bool {
        (**self).is_done()
    }
}

/// The rate of a line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Rate {
    /// Bits a second; ten bits a byte.
    Baud(NonZeroU32),
    /// Faster than the machine.
    NeverWaits,
}

impl Rate {
    /// Returns the time of a byte in cycles, rounded down; `None` if it takes none.
    pub fn byte_time(self) -> Option<u64> {
        match self {
            Self::Baud(baud) => Some((CPU_HZ * 10 / u64::from(baud.get())).max(1)),
            Self::NeverWaits => None,
        }
    }
}

/// Bytes in a packet of a line that never waits: USB full speed, bulk (USB 2.0 specification,
/// 5.8.3).
pub(crate) const PACKET: usize = 64;

/// The size of the board's send buffer for a line that takes time, bytes, as in the firmware: the
/// bytes that the line sends in 0.7 ms, but at least 8 and at most 128. A status report waits
/// behind these bytes.
fn send_buffer(byte_time: u64) -> usize {
    usize::try_from(CPU_HZ * 7 / 10_000 / byte_time).map_or(128, |bytes| bytes.clamp(8, 128))
}

/// One line, both ways.
#[derive(Debug)]
pub(crate) struct Link {
    rate: Rate,
    /// The byte that is on the way to the board, and when it arrives.
    incoming: Option<(Cycle, u8)>,
    sending: VecDeque<u8>,
    /// The time at which the first byte of `sending` will have left.
    sent: Cycle,
    /// The least time from the end of a line of text to the next, cycles.
    line_time: u64,
    /// Before this instant no line of text ends.
    line_due: Cycle,
}

/// An event on a line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum LinkEvent {
    /// A byte has arrived at the board.
    Arrived(u8),
    /// A byte has arrived at the host.
    Sent(u8),
}

impl Link {
    fn new(rate: Rate) -> Self {
        Self {
            rate,
            incoming: None,
            sending: VecDeque::new(),
            sent: Cycle::NEVER,
            line_time: 0,
            line_due: Cycle::ZERO,
        }
    }

    fn due(&self) -> Cycle {
        self.incoming
            .map_or(Cycle::NEVER, |(at, _)| at)
            .min(self.sent)
    }

    fn write(&mut self, bytes: &[u8], now: Cycle) -> usize {
        let Some(byte_time) = self.rate.byte_time() else {
            self.sending.extend(bytes);
            return bytes.len();
        };
        let taken = bytes
            .len()
            .min(send_buffer(byte_time).saturating_sub(self.sending.len()));
        if self.sending.is_empty() && taken > 0 {
            self.sent = now + byte_time;
        }
        self.sending.extend(bytes.iter().take(taken));
        taken
    }

    /// Takes the event that is due at `now` or before.
    fn take(&mut self, now: Cycle) -> Option<LinkEvent> {
        if let Some((_, byte)) = self.incoming.filter(|(at, _)| *at <= now) {
            self.incoming = None;
            return Some(LinkEvent::Arrived(byte));
        }
        if self.sent > now {
            return None;
        }
        let byte = self.sending.pop_front()?;
        self.sent = match (self.sending.is_empty(), self.rate.byte_time()) {
            (false, Some(byte_time)) => self.sent + byte_time,
            (true, _) | (_, None) => Cycle::NEVER,
        };
        Some(LinkEvent::Sent(byte))
    }
}

/// All lines of a board.
#[derive(Debug)]
pub(crate) struct Links {
    links: Vec<Link>,
    due: Cycle,
}

impl Links {
    /// Makes lines of these rates, in the order of their channels.
    pub(crate) fn new(rates: &[Rate]) -> Self {
        Self {
            links: rates.iter().copied().map(Link::new).collect(),
            due: Cycle::NEVER,
        }
    }

    /// From now on no line of text ends sooner than `cycles` after the one before it, on lines that
    /// take time: the machine is a slow one.
    pub(crate) fn pace(&mut self, cycles: u64) {
        self.links
            .iter_mut()
            .for_each(|link| link.line_time = cycles);
    }

    pub(crate) fn count(&self) -> usize {
        self.links.len()
    }

    /// Returns when a byte arrives next, at either end.
    #[inline]
    pub(crate) fn due(&self) -> Cycle {
        self.due
    }

    pub(crate) fn write(&mut self, channel: ChannelId, bytes: &[u8], now: Cycle) -> usize {
        let Some(link) = self.links.get_mut(usize::from(channel.0)) else {
            return bytes.len();
        };
        let taken = link.write(bytes, now);
        self.due = self.due.min(link.due());
        taken
    }

    /// Returns true if `channel` never waits.
    pub(crate) fn never_waits(&self, channel: ChannelId) -> bool {
        self.links
            .get(usize::from(channel.0))
            .is_some_and(|link| link.rate == Rate::NeverWaits)
    }

    /// Returns true if a byte is on the way to the board on `channel`.
    pub(crate) fn is_receiving(&self, channel: ChannelId) -> bool {
        self.links
            .get(usize::from(channel.0))
            .is_some_and(|link| link.incoming.is_some())
    }

    /// Takes the next byte that the board has written to `channel`, a line that never waits.
    pub(crate) fn take_written(&mut self, channel: ChannelId) -> Option<u8> {
        let link = self.links.get_mut(usize::from(channel.0))?;
        debug_assert_eq!(link.rate, Rate::NeverWaits);
        link.sending.pop_front()
    }

    /// Puts the host's next byte on `channel` if the line is free.
    pub(crate) fn feed(&mut self, channel: ChannelId, host: &mut impl Host, now: Cycle) {
        let Some(link) = self.links.get_mut(usize::from(channel.0)) else {
            return;
        };
        if let (None, Some(byte_time)) = (link.incoming, link.rate.byte_time()) {
            link.incoming = host.next_byte(channel).map(|byte| {
                let mut at = now + byte_time;
                if byte == b'\n' {
                    at = at.max(link.line_due);
                    link.line_due = at + link.line_time;
                }
                (at, byte)
            });
            self.due = self.due.min(link.due());
        }
    }

    /// Takes the next event that is due at `now` or before.
    pub(crate) fn take(&mut self, now: Cycle) -> Option<(ChannelId, LinkEvent)> {
        let event = self
            .links
            .iter_mut()
            .zip(0u8..)
            .find_map(|(link, channel)| Some((ChannelId(channel), link.take(now)?)));
        self.due = self
            .links
            .iter()
            .map(Link::due)
            .min()
            .unwrap_or(Cycle::NEVER);
        event
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHANNEL: ChannelId = ChannelId(0);

    struct Text(VecDeque<u8>);

    impl Host for Text {
        fn next_byte(&mut self, _: ChannelId) -> Option<u8> {
            self.0.pop_front()
        }
        fn receive(&mut self, _: ChannelId, _: u8, _: Cycle) {}
    }

    fn serial() -> Links {
        Links::new(&[Rate::Baud(NonZeroU32::new(115_200).unwrap())])
    }

    #[test]
    fn a_byte_takes_ten_bit_times_each_way() {
        let (mut links, mut host) = (serial(), Text(VecDeque::from(*b"A")));
        links.feed(CHANNEL, &mut host, Cycle(0));
        links.write(CHANNEL, b"ok", Cycle(7));
        assert_eq!(links.due(), Cycle(14_583));
        assert_eq!(
            links.take(Cycle(14_583)),
            Some((CHANNEL, LinkEvent::Arrived(b'A')))
        );
        assert_eq!(links.take(Cycle(14_583)), None);
        assert_eq!(
            links.take(Cycle(14_590)),
            Some((CHANNEL, LinkEvent::Sent(b'o')))
        );
        assert_eq!(links.due(), Cycle(7 + 2 * 14_583));
        assert_eq!(
            links.take(Cycle(29_173)),
            Some((CHANNEL, LinkEvent::Sent(b'k')))
        );
        assert_eq!(links.due(), Cycle::NEVER);
    }

    #[test]
    fn a_full_send_buffer_takes_no_more_than_goes_out_soon() {
        for (baud, bytes) in [(9600, 8), (115_200, 8), (1_000_000, 70), (3_000_000, 128)] {
            let mut links = Links::new(&[Rate::Baud(NonZeroU32::new(baud).unwrap())]);
            assert_eq!(links.write(CHANNEL, &[b'x'; 2000], Cycle(0)), bytes);
            assert_eq!(links.write(CHANNEL, b"y", Cycle(0)), 0);
        }
    }

    #[test]
    fn a_line_that_never_waits_takes_everything_at_once() {
        let mut links = Links::new(&[Rate::NeverWaits]);
        assert_eq!(links.write(CHANNEL, &[b'x'; 5000], Cycle(0)), 5000);
        assert_eq!(links.due(), Cycle::NEVER);
        assert_eq!(links.take_written(CHANNEL), Some(b'x'));
    }
}
