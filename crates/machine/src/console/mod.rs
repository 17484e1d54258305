//! The serial lines. Each is a channel: it reads its input line by line, and sends its output.
//!
//! An answer goes out on the channel that its line came in on, messages and alarms on all. A line
//! is taken only once the board has taken all answers before it. So no answer is ever lost, however
//! slowly the other end reads. A report that is asked for waits for one answer at most, however
//! many lines have come.

mod discard;
mod listing;

use crate::board::{Board, ChannelId};
use crate::config::CHANNELS;
use crate::protocol::cadence::Cadence;
use crate::protocol::line_reader::COMMENT;
use crate::protocol::message::Message;
use crate::protocol::serial::{Inbox, Mark, Request};
use crate::protocol::status::Status;
use crate::work::Work;
use core::fmt;
pub(crate) use discard::Discard;
use heapless::{String, Vec};
use leadscrew_planner::TimeLeft;
pub(crate) use listing::Listing;

/// Bytes read into lines in one poll, per channel: bounds its time.
const BYTES_A_POLL: usize = 64;

/// The reason why a line was refused, for front ends that want to point at the fault.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LineFault {
    /// The channel that the line came from.
    pub channel: ChannelId,
    /// Its answer.
    pub status: Status,
    /// Byte offset in the filtered line, from 0.
    pub column: usize,
}

/// One serial line.
pub(crate) struct Channel<'a> {
    inbox: Inbox<'a>,
    /// Its reader holds a whole line, not yet taken.
    complete: bool,
    /// The listing that is being sent row by row; its line is answered after the last row.
    pub(crate) listing: Option<Listing>,
    /// A `?` waits for its report.
    pub(crate) report_due: bool,
    /// The place of the last jog cancel among the received bytes: jogs before it no longer begin.
    pub(crate) jogs_cancelled: Option<Mark>,
    /// A byte has come since the last call of [`Console::take_heard`].
    heard: bool,
    /// Kept lines come first: no byte is read from the receive queue.
    blocked: bool,
}

/// All serial lines.
pub(crate) struct Console<'a> {
    channels: Vec<Channel<'a>, CHANNELS>,
    /// The channel that is looked at first for the next line.
    turn: usize,
    /// The channel that is looked at first for the next realtime command.
    next_to_ask: usize,
    /// The choice of the reports that have `WCO:` and `Ov:`.
    pub(crate) cadence: Cadence,
    /// The time to finish, while it is added up for a report that was asked for.
    pub(crate) time_left: Option<TimeLeft>,
    /// The reason why the last line was refused.
    pub(crate) last_fault: Option<LineFault>,
}

impl<'a> Console<'a> {
    /// Makes a console of the serial lines' ends; refuses lines of more than `limit` characters.
    pub(crate) fn new(inboxes: Vec<Inbox<'a>, CHANNELS>, limit: usize) -> Self {
        let channels = inboxes.into_iter().map(|inbox| {
            inbox.reader.set_limit(limit);
            Channel {
                inbox,
                complete: false,
                listing: None,
                report_due: false,
                jogs_cancelled: None,
                heard: false,
                blocked: false,
            }
        });
        Self {
            channels: channels.collect(),
            turn: 0,
            next_to_ask: 0,
            cadence: Cadence::new(),
            time_left: None,
            last_fault: None,
        }
    }

    /// The channel `id`, if there is one.
    pub(crate) fn channel(&mut self, id: ChannelId) -> Option<&mut Channel<'a>> {
        self.channels.get_mut(usize::from(id.0))
    }

    /// All channels with their numbers.
    pub(crate) fn channels(&mut self) -> impl Iterator<Item = (ChannelId, &mut Channel<'a>)> {
        (0u8..).map(ChannelId).zip(&mut self.channels)
    }

    /// Sends a line on all channels.
    pub(crate) fn broadcast(&mut self, line: impl fmt::Display) {
        for channel in &mut self.channels {
            channel.inbox.output.line(&line);
        }
    }

    /// Sends a message on all channels that have room for it.
    #[inline(never)] // as for `say`
    pub(crate) fn message(&mut self, message: Message) {
        for channel in &mut self.channels {
            channel.inbox.output.message(message);
        }
    }

    /// Sends a line on all channels that have room for it.
    #[inline(never)] // inlined, machine 004 (`examples/machines/004`) takes 576 bytes more
    pub(crate) fn say(&mut self, line: fmt::Arguments<'_>) {
        for channel in &mut self.channels {
            channel.inbox.output.message(line);
        }
    }

    /// Sends a message on one channel, if there is room for it.
    pub(crate) fn tell(&mut self, id: ChannelId, message: Message) {
        if let Some(channel) = self.channel(id) {
            channel.inbox.output.message(message);
        }
    }

    /// Takes the note that somebody has opened the other end of a channel; returns the channel.
    pub(crate) fn next_opened(&mut self) -> Option<ChannelId> {
        self.channels()
            .find_map(|(id, channel)| channel.inbox.take_opened().then_some(id))
    }

    /// Sends a line on one channel.
    pub(crate) fn line(&mut self, id: ChannelId, line: impl fmt::Display) {
        if let Some(channel) = self.channel(id) {
            channel.inbox.output.line(line);
        }
    }

    /// Answers a line on the channel that it came from.
    pub(crate) fn answer(&mut self, id: ChannelId, result: Result<(), Status>) {
        match result {
            Ok(()) => {
                if let Some(channel) = self.channel(id) {
                    channel.inbox.output.ok();
                }
            }
            Err(status) => self.line(id, format_args!("error:{}", status.number())),
        }
    }

    /// Returns true if a realtime command has come, or somebody has opened the other end of a
    /// channel.
    pub(crate) fn has_requests(&self) -> bool {
        let mut channels = self.channels.iter();
        channels.any(|channel| channel.inbox.has_requests() || channel.inbox.was_opened())
    }

    /// Returns true if a list is being sent.
    pub(crate) fn lists(&self) -> bool {
        self.channels
            .iter()
            .any(|channel| channel.listing.is_some())
    }

    /// Takes the next realtime command, from one channel after the other: a channel that floods the
    /// machine with them keeps no other one waiting.
    pub(crate) fn next_request(&mut self) -> Option<(ChannelId, Request)> {
        let count = self.channels.len();
        (0..count).find_map(|offset| {
            let index = (self.next_to_ask + offset) % count;
            let channel = self.channels.get_mut(index)?;
            let request = channel.inbox.next_realtime()?;
            channel.heard = true;
            self.next_to_ask = index + 1;
            Some((ChannelId(index as u8), request)) // CHANNELS at most
        })
    }

    /// Returns true if a byte has come from `owner` since this was asked last; without an owner,
    /// from any channel.
    pub(crate) fn take_heard(&mut self, owner: Option<ChannelId>) -> bool {
        let mut heard = false;
        for (id, channel) in self.channels() {
            heard |= core::mem::take(&mut channel.heard) && owner.is_none_or(|owner| owner == id);
        }
        heard
    }

    /// Takes the note that the other end of a channel has gone away, once all that it sent is
    /// carried out; returns the channel. An incomplete line from it is forgotten.
    pub(crate) fn take_closed(&mut self) -> Option<ChannelId> {
        self.channels()
            .find_map(|(id, channel)| channel.take_closed().then_some(id))
    }

    /// Reads on until a line is complete that may be taken; returns its channel. While a channel is
    /// `owner` of the job, others may only ask (`$`).
    pub(crate) fn read(&mut self, owner: Option<ChannelId>, work: &mut Work) -> Option<ChannelId> {
        let count = self.channels.len();
        for offset in 0..count {
            let index = (self.turn + offset) % count;
            let Some(channel) = self.channels.get_mut(index) else {
                continue;
            };
            channel.read(work);
            let id = ChannelId(u8::try_from(index).unwrap_or(u8::MAX));
            let may_move = owner.is_none_or(|owner| owner == id);
            if channel.is_ready() && (may_move || channel.asks()) {
                return Some(id);
            }
        }
        None
    }

    /// The comment of the line that was taken last from a channel.
    pub(crate) fn comment(&mut self, id: ChannelId) -> String<COMMENT> {
        let comment = self
            .channel(id)
            .map(|channel| channel.inbox.reader.comment());
        comment
            .and_then(|text| text.try_into().ok())
            .unwrap_or_default()
    }

    /// Moves bytes that a channel has received to `room`; returns how many.
    pub(crate) fn keep(&mut self, id: ChannelId, room: &mut [u8]) -> usize {
        let mut kept = 0;
        if let Some(channel) = self.channel(id) {
            let ready = channel.inbox.ready();
            for place in room.iter_mut().take(ready) {
                let Some(byte) = channel.inbox.take() else {
                    break;
                };
                *place = byte;
                kept += 1;
            }
        }
        kept
    }

    /// Reads kept bytes until a line is complete; returns how many. Reads none while the channel
    /// holds a complete line that is not taken, or an incomplete one of its own. With `goes_on` the
    /// incomplete line is a kept one, and is read on.
    pub(crate) fn read_kept(&mut self, id: ChannelId, bytes: &[u8], goes_on: bool) -> usize {
        let Some(channel) = self.channel(id) else {
            return bytes.len();
        };
        if channel.complete || !goes_on && !channel.inbox.reader.is_empty() {
            return 0;
        }
        let mut read = 0;
        for byte in bytes.iter().take(BYTES_A_POLL) {
            read += 1;
            channel.complete = channel.inbox.reader.push(*byte);
            if channel.complete {
                break;
            }
        }
        read
    }

    /// Keeps the bytes in a channel's receive queue waiting, or lets them be read again.
    pub(crate) fn block(&mut self, id: ChannelId, blocked: bool) {
        if let Some(channel) = self.channel(id) {
            channel.blocked = blocked;
        }
    }

    /// Forgets the line that was taken from `id`; the next one may come from another channel.
    pub(crate) fn take(&mut self, id: ChannelId) {
        if let Some(channel) = self.channel(id) {
            channel.inbox.reader.clear();
            channel.complete = false;
            let inbox = &channel.inbox;
            channel.jogs_cancelled = channel.jogs_cancelled.filter(|mark| inbox.is_before(*mark));
        }
        self.turn = usize::from(id.0) + 1;
    }

    /// Forgets lines begun, lists begun, and received bytes as far as `discard` says. After a
    /// reset. Behind its own 0x18 a channel begins a new line; behind any other reset it ends the
    /// line that it has begun.
    pub(crate) fn discard(&mut self, discard: Discard) {
        if discard == Discard::Nothing {
            return;
        }
        for (id, channel) in self.channels() {
            if core::mem::take(&mut channel.complete) {
                channel.inbox.reader.clear();
            }
            channel.listing = None;
            channel.blocked = false;
            match discard {
                Discard::Before(source, mark) if source == id => {
                    channel.inbox.reader.clear();
                    channel.inbox.drop_before(mark);
                }
                Discard::Before(..) | Discard::All => channel.inbox.drop_all(),
                Discard::Nothing => {}
            }
        }
    }

    /// Hands the board as much of the waiting output as it takes.
    pub(crate) fn flush<B: Board>(&mut self, board: &mut B, work: &mut Work) {
        for (id, channel) in self.channels() {
            if !channel.output_is_empty() {
                let sent = channel.inbox.output.flush(|bytes| board.write(id, bytes));
                work.written = work.written.wrapping_add(sent);
            }
        }
    }

    /// The number of channels.
    pub(crate) fn count(&self) -> u8 {
        self.channels.len() as u8 // CHANNELS at most
    }

    /// Returns true if a line has come that is not carried out yet, or is coming.
    pub(crate) fn hears(&self) -> bool {
        self.channels.iter().any(|channel| {
            channel.complete || channel.inbox.has_bytes() || !channel.inbox.reader.is_empty()
        })
    }

    /// Returns true if a status report that was asked for can be written.
    pub(crate) fn reports_now(&self) -> bool {
        let mut channels = self.channels.iter();
        channels.any(|channel| channel.report_due && channel.has_room())
    }

    /// Returns true if there is something to do at once. `takes_lines`: whether a line would be
    /// taken.
    pub(crate) fn is_busy(&self, takes_lines: bool) -> bool {
        self.channels.iter().any(|channel| {
            let has_line = || channel.complete || channel.inbox.has_bytes();
            channel.report_due && channel.has_room()
                || takes_lines && channel.has_ended()
                || (channel.listing.is_some() || takes_lines && has_line())
                    && channel.output_is_empty()
                || channel.inbox.has_requests()
                || channel.inbox.was_opened()
        })
    }

    /// Returns true if no line, list, report or output waits.
    pub(crate) fn is_quiet(&self) -> bool {
        self.channels.iter().all(|channel| {
            !channel.report_due
                && channel.listing.is_none()
                && !channel.complete
                && !channel.inbox.has_bytes()
                && !channel.inbox.has_requests()
                && channel.output_is_empty()
        })
    }

    /// Bytes of output that were lost since power-up, because the other end of a line had stopped
    /// reading.
    pub(crate) fn lost_output(&self) -> u32 {
        self.channels.iter().fold(0, |sum, channel| {
            sum.wrapping_add(channel.inbox.output.lost())
        })
    }
}

impl Channel<'_> {
    /// The line that is complete.
    ///
    /// # Errors
    /// [`Status::LineTooLong`].
    pub(crate) fn line(&self) -> Result<&[u8], Status> {
        self.inbox.reader.line()
    }

    /// Bytes that the receive queue has room for.
    pub(crate) fn free(&self) -> usize {
        self.inbox.free()
    }

    /// Bytes that the receive queue takes in all.
    pub(crate) fn limit(&self) -> usize {
        self.inbox.limit()
    }

    /// Returns true if the line taken last was sent before a jog cancel.
    pub(crate) fn is_jog_cancelled(&self) -> bool {
        self.jogs_cancelled.is_some()
    }

    fn read(&mut self, work: &mut Work) {
        if self.complete || self.blocked {
            return;
        }
        let (bytes, complete) = self.inbox.read_line(BYTES_A_POLL);
        self.complete = complete;
        work.bytes = work.bytes.wrapping_add(bytes);
        self.heard |= bytes > 0;
    }

    /// Returns true if the other end has gone away, and all of its lines are taken.
    fn has_ended(&self) -> bool {
        let closed = self.inbox.closed();
        !self.complete && closed.is_some_and(|mark| self.inbox.ahead_of(mark) == 0)
    }

    fn take_closed(&mut self) -> bool {
        let ended = self.has_ended();
        if ended {
            self.inbox.forget_close();
            self.inbox.reader.clear();
        }
        ended
    }

    /// Returns true if the line is a `$` command, empty or too long: nothing that belongs to a job.
    fn asks(&self) -> bool {
        self.inbox
            .reader
            .line()
            .map_or(true, |line| line.first().is_none_or(|first| *first == b'$'))
    }

    /// Returns true if a report fits.
    pub(crate) fn has_room(&self) -> bool {
        self.inbox.output.has_room()
    }

    /// Returns true if the board has taken all output.
    pub(crate) fn output_is_empty(&self) -> bool {
        self.inbox.output.is_empty()
    }

    fn is_ready(&self) -> bool {
        self.complete && self.listing.is_none() && self.output_is_empty()
    }
}
