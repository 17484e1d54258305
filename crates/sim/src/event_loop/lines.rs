//! Bytes that come and go on the lines to the host.
use super::Simulation;
use crate::link::{Host, LinkEvent, PACKET};
use crate::observer::Observer;
use crate::trouble::LateReason;
use leadscrew_machine::board::ChannelId;
use leadscrew_machine::extension::Extension;
use leadscrew_planner::Kinematics;

impl<K, O, X, const AXES: usize, const MOTORS: usize, const MOVES: usize>
    Simulation<'_, K, O, AXES, MOTORS, MOVES, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    O: Observer,
    X: Extension<AXES>,
{
    /// Notes that the host has closed its end of a line.
    fn close(&mut self, channel: ChannelId) {
        if let Some(receiver) = self.receivers.get_mut(usize::from(channel.0)) {
            receiver.close();
        }
        self.disturb(self.now);
    }

    pub(super) fn byte<H: Host>(&mut self, host: &mut H) {
        while let Some((channel, event)) = self.board.links.take(self.now) {
            match event {
                LinkEvent::Arrived(byte) => self.receive(channel, byte),
                LinkEvent::Sent(byte) => {
                    self.cpu.charge_interrupt(self.now, self.costs.byte_out);
                    self.disturb(self.now);
                    self.last_byte = self.now;
                    host.receive(channel, byte, self.now);
                }
            }
        }
        self.exchange(host);
    }

    fn receive(&mut self, channel: ChannelId, byte: u8) {
        self.first_byte = self.first_byte.min(self.now);
        if let Some(receiver) = self.receivers.get_mut(usize::from(channel.0)) {
            let lost = receiver.lost_bytes();
            receiver.receive(byte);
            if receiver.lost_bytes() != lost {
                self.board.note_late(self.now, LateReason::ByteLost);
            }
        }
        self.cpu.charge_interrupt(self.now, self.costs.byte_in);
        self.disturb(self.now);
    }

    /// Asks the host for bytes to send, on all lines. On lines that never wait, gives the host the
    /// bytes that the board has written. Returns whether the host has nothing more to send now.
    pub(super) fn exchange<H: Host>(&mut self, host: &mut H) -> bool {
        let mut is_silent = true;
        for channel in (0..self.board.links.count()).map(|number| ChannelId(number as u8)) {
            // A line does not close before the bytes that were sent on it have come in.
            if !self.board.links.is_receiving(channel) && host.closes(channel) {
                self.close(channel);
            }
            if self.board.links.never_waits(channel) {
                is_silent &= self.exchange_at_once(channel, host);
            } else {
                self.board.links.feed(channel, host, self.now);
            }
        }
        is_silent
    }

    fn exchange_at_once<H: Host>(&mut self, channel: ChannelId, host: &mut H) -> bool {
        while let Some(byte) = self.board.links.take_written(channel) {
            self.last_byte = self.now;
            host.receive(channel, byte, self.now);
        }
        for _ in 0..PACKET {
            let Some(byte) = host.next_byte(channel) else {
                return true;
            };
            self.receive(channel, byte);
        }
        false
    }
}
