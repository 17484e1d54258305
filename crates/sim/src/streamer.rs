//! A sender that streams a program by character counting.
//!
//! The machine answers every line with `ok` or `error:N`, in order. The sender knows how many bytes
//! the receive buffer holds and counts the bytes of all unanswered lines. It sends the next line as
//! soon as it fits:
//!
//! ```text
//!  reader --> line --> [ unanswered lines .......... | next ] <= window
//!                        ^ ok: drop the first
//! ```
//!
//! The machine gets the bytes of the file, realtime bytes too: they act as with a sender that leaves
//! nothing out.
//!
//! Memory use is constant whatever the length of the file: one window of text, and one line that is
//! being read. A program with parameters, expressions or O words is kept from the first line that
//! has one: it may go back.

use crate::clock::Cycle;
use crate::link::Host;
use crate::program::{Branch, Next, ProgramFault, Running};
use leadscrew_machine::board::ChannelId;
use leadscrew_program::{is_program, World};
use memchr::memchr2;
use std::collections::{BTreeMap, VecDeque};
use std::io::{self, BufRead};

/// The machine's answer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Reply<'a> {
    /// The line was taken.
    Ok {
        /// Its number in the program, from 1.
        line: u64,
    },
    /// The line was refused.
    Error {
        /// Its number in the program, from 1.
        line: u64,
        /// GRBL's number.
        code: u8,
        /// The line as it stands in the program.
        text: &'a [u8],
    },
    /// The machine locked itself.
    Alarm {
        /// GRBL's number.
        code: u8,
        /// The first unanswered line in the program, from 1; the last answered line if none is
        /// unanswered.
        line: u64,
        /// That line as it stands in the program; empty if it has been answered.
        text: &'a [u8],
    },
    /// Anything else: reports, messages, the banner.
    Other(&'a [u8]),
}

/// The longest line that is kept, bytes. The rest of a longer line is dropped, and the machine
/// refuses the kept part (GRBL takes 79 bytes without blanks and comments). Without this limit a
/// file without line ends would fill the memory.
const LONGEST_LINE: usize = 64 * 1024;

/// The byte that resets the machine.
const RESET: u8 = 0x18;

/// The beginning of the line that the machine says after a reset.
const BANNER: &[u8] = b"Grbl ";

/// The treatment by a sender of the next line of its program.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Then {
    /// It sends it as soon as it fits.
    GoOn,
    /// It sends it, and waits for its answer before it sends more: the machine will probably refuse
    /// it, and the program is to stop there.
    Await,
    /// It sends neither this line nor any after it.
    Stop,
}

/// Takes the machine's replies, in order.
pub trait Replies {
    /// A reply has come in at `now`.
    fn reply(&mut self, reply: &Reply<'_>, now: Cycle);

    /// Line `number` of the program was read and is about to be sent; `line` is its text in the
    /// file.
    fn read(&mut self, number: u64, line: &[u8]) {
        let _ = (number, line);
    }

    /// Returns what to do with `line`, which is about to be sent, and those after it.
    fn before(&mut self, line: &[u8]) -> Then {
        let _ = line;
        Then::GoOn
    }

    /// Returns what a program may know of the machine after the line read last.
    fn world(&self) -> &dyn World {
        &()
    }

    /// The program cannot go on: nothing more is sent.
    fn failed(&mut self, fault: &ProgramFault) {
        let _ = fault;
    }
}

impl Replies for () {
    fn reply(&mut self, _: &Reply<'_>, _: Cycle) {}
}

impl<F: FnMut(&Reply<'_>, Cycle)> Replies for F {
    fn reply(&mut self, reply: &Reply<'_>, now: Cycle) {
        self(reply, now);
    }
}

/// The way in which a program is streamed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Streaming {
    /// Bytes of unanswered lines, at most: the machine's receive buffer (128 for Grbl).
    pub window: usize,
    /// True if lines after a refused one are sent all the same.
    pub keep_going: bool,
}

/// An unanswered line.
#[derive(Clone, Copy, Debug)]
struct Pending {
    number: u64,
    /// Bytes, the line feed included.
    length: usize,
}

/// Sends the lines of a reader on channel 0.
#[derive(Debug)]
pub struct Streamer<R, F> {
    lines: Lines<R>,
    streaming: Streaming,
    replies: F,
    pending: VecDeque<Pending>,
    /// The text of all pending lines.
    text: VecDeque<u8>,
    /// Bytes at the end of `text` that are still to be sent.
    unsent: usize,
    /// A line that has been read and does not fit yet.
    waiting: Option<u64>,
    /// True if nothing may follow the line read last before it is answered.
    last: bool,
    line: Vec<u8>,
    incoming: Vec<u8>,
    state: Sending,
    answered: u64,
    /// The byte that resets the machine has been sent.
    resets: bool,
}

/// Says whether there is more to send.
#[derive(Debug)]
enum Sending {
    /// Lines are left.
    Lines,
    /// The line that was read last has to be answered before the next line is read.
    Awaits,
    /// The program has ended, or a line was refused.
    Done,
    /// The machine has locked itself: no further answer comes.
    Locked,
    /// A byte of the program has reset the machine: it has forgotten the lines it had not answered.
    Reset,
    /// The reader failed.
    Failed(io::Error),
}

impl<R: BufRead, F: Replies> Streamer<R, F> {
    /// Makes a sender for the lines of `reader`.
    pub fn new(reader: R, streaming: Streaming, replies: F) -> Self {
        Self {
            lines: Lines::new(reader),
            streaming,
            replies,
            pending: VecDeque::new(),
            text: VecDeque::new(),
            unsent: 0,
            waiting: None,
            last: false,
            line: Vec::new(),
            incoming: Vec::new(),
            state: Sending::Lines,
            answered: 0,
            resets: false,
        }
    }

    /// Returns true if there is nothing left to send and no answer left to wait for.
    pub fn is_done(&self) -> bool {
        match self.state {
            Sending::Lines | Sending::Awaits => false,
            Sending::Done => self.pending.is_empty(),
            Sending::Locked | Sending::Reset | Sending::Failed(_) => true,
        }
    }

    /// Returns the number of lines read from the file so far, including those without anything to
    /// send.
    pub fn lines(&self) -> u64 {
        self.lines.count()
    }

    /// Returns the number of lines that have been answered.
    pub fn answered(&self) -> u64 {
        self.answered
    }

    /// Returns the line that the machine is at: the first unanswered line, or the last one read if
    /// all are answered.
    pub fn current(&self) -> u64 {
        self.pending
            .front()
            .map_or(self.lines.number(), |pending| pending.number)
    }

    /// Returns the first line that the machine has left unanswered, and its text; `None` if it owes
    /// no answer.
    pub fn unanswered(&self) -> Option<(u64, Vec<u8>)> {
        let owes = !self.is_done() || self.was_reset();
        let pending = self.pending.front().filter(|_| owes)?;
        Some((pending.number, self.text_of(pending)))
    }

    /// Returns true if a byte of the program has reset the machine.
    pub fn was_reset(&self) -> bool {
        matches!(self.state, Sending::Reset)
    }

    /// Returns the receiver of the replies.
    pub fn replies(&self) -> &F {
        &self.replies
    }

    /// The text of the first pending line, without its line end.
    fn text_of(&self, first: &Pending) -> Vec<u8> {
        let length = first.length.saturating_sub(1);
        self.text.iter().take(length).copied().collect()
    }

    /// Ends the streaming: returns the receiver of the replies, or the error of reading the
    /// program.
    ///
    /// # Errors
    /// The reader's error.
    pub fn finish(self) -> io::Result<F> {
        match self.state {
            Sending::Failed(error) => Err(error),
            Sending::Lines | Sending::Awaits | Sending::Done | Sending::Locked | Sending::Reset => {
                Ok(self.replies)
            }
        }
    }

    /// Puts further lines into the window while they fit. A line longer than the window is sent
    /// alone.
    fn fill(&mut self) {
        while matches!(self.state, Sending::Lines) {
            let Some(number) = self.waiting.or_else(|| self.read()) else {
                return;
            };
            let length = self.line.len() + 1;
            if !self.text.is_empty() && self.text.len() + length > self.streaming.window {
                self.waiting = Some(number);
                return;
            }
            self.waiting = None;
            if self.last {
                self.state = Sending::Awaits;
            }
            self.text.extend(&self.line);
            self.text.push_back(b'\n');
            self.unsent += length;
            self.pending.push_back(Pending { number, length });
        }
    }

    /// Reads the next line to send. Returns its number, or `None` at the end.
    fn read(&mut self) -> Option<u64> {
        match self.lines.next(&mut self.line, self.replies.world()) {
            Ok(Next::Line) => {
                let number = self.lines.number();
                self.replies.read(number, &self.line);
                let then = self.replies.before(&self.line);
                self.last = then == Then::Await || self.lines.waits();
                if then == Then::Stop {
                    self.state = Sending::Done;
                    return None;
                }
                Some(number)
            }
            Ok(Next::Begins) if self.pending.is_empty() => self.read(),
            Ok(Next::Begins) => {
                self.state = Sending::Awaits;
                None
            }
            Ok(Next::Fault(fault)) => {
                self.replies.failed(&fault);
                self.state = Sending::Done;
                None
            }
            Ok(Next::End) => {
                self.state = Sending::Done;
                None
            }
            Err(error) => {
                self.state = Sending::Failed(error);
                None
            }
        }
    }

    fn reply(&mut self, now: Cycle) {
        let line = std::mem::take(&mut self.incoming);
        if self.was_reset() {
            // What is answered now came after the byte that reset the machine.
            return;
        }
        match answer(&line) {
            Answer::Ok => self.answer(None, now),
            Answer::Error(code) => self.answer(Some(code), now),
            Answer::Alarm(code) => {
                self.state = Sending::Locked;
                let line = self.current();
                let pending = self.pending.front();
                let text = pending.map_or_else(Vec::new, |pending| self.text_of(pending));
                self.replies.reply(
                    &Reply::Alarm {
                        code,
                        line,
                        text: &text,
                    },
                    now,
                );
            }
            Answer::None if line.is_empty() => {}
            Answer::None if self.resets && line.starts_with(BANNER) => self.state = Sending::Reset,
            Answer::None => self.replies.reply(&Reply::Other(&line), now),
        }
        self.incoming = line;
        self.incoming.clear();
    }

    fn answer(&mut self, error: Option<u8>, now: Cycle) {
        let Some(Pending {
            number: line,
            length,
        }) = self.pending.pop_front()
        else {
            return;
        };
        self.answered += 1;
        match error {
            None => {
                self.text.drain(..length);
                self.replies.reply(&Reply::Ok { line }, now);
                if self.pending.is_empty() && matches!(self.state, Sending::Awaits) {
                    self.state = Sending::Lines;
                }
            }
            Some(code) => {
                let text: Vec<u8> = self.text.drain(..length).take(length - 1).collect();
                self.replies.reply(
                    &Reply::Error {
                        line,
                        code,
                        text: &text,
                    },
                    now,
                );
                let sends = matches!(self.state, Sending::Lines | Sending::Awaits);
                if sends && !self.streaming.keep_going {
                    self.state = Sending::Done;
                }
            }
        }
    }
}

impl<R: BufRead, F: Replies> Host for Streamer<R, F> {
    fn next_byte(&mut self, channel: ChannelId) -> Option<u8> {
        if channel != ChannelId(0) {
            return None;
        }
        if self.unsent == 0 {
            self.fill();
        }
        let next = self.text.len().checked_sub(self.unsent)?;
        let byte = self.text.get(next).copied()?;
        self.unsent -= 1;
        self.resets |= byte == RESET;
        Some(byte)
    }

    fn receive(&mut self, channel: ChannelId, byte: u8, now: Cycle) {
        if channel != ChannelId(0) {
            return;
        }
        match byte {
            b'\n' => self.reply(now),
            b'\r' => {}
            other => self.incoming.push(other),
        }
    }
}

/// The kind of an answer to a line.
enum Answer {
    Ok,
    Error(u8),
    Alarm(u8),
    None,
}

fn answer(line: &[u8]) -> Answer {
    let number = |prefix| parse(line.strip_prefix(prefix)?);
    if line == b"ok" {
        Answer::Ok
    } else if let Some(code) = number(b"error:".as_slice()) {
        Answer::Error(code)
    } else if let Some(code) = number(b"ALARM:".as_slice()) {
        Answer::Alarm(code)
    } else {
        Answer::None
    }
}

fn parse(digits: &[u8]) -> Option<u8> {
    std::str::from_utf8(digits).ok()?.parse().ok()
}

/// Lines of a file that end with LF, CR or CR LF. A byte order mark and lines with `%` (tape marks)
/// are left out. From the first line on that has a parameter, an expression or an O word, they are
/// the plain lines that the program comes to.
#[derive(Debug)]
pub struct Lines<R> {
    reader: R,
    /// Lines read so far, including those left out.
    number: u64,
    /// The last line ended with CR: an LF right after it belongs to the same line end.
    after_return: bool,
    /// The program, once one has begun.
    program: Option<Running>,
    /// The line read last probes: what follows it in a program may depend on the place.
    probes: bool,
}

impl<R: BufRead> Lines<R> {
    const MARK: &'static [u8] = b"\xEF\xBB\xBF";

    /// Reads from `reader`, from its next line on.
    pub fn new(reader: R) -> Self {
        Self {
            reader,
            number: 0,
            after_return: false,
            program: None,
            probes: false,
        }
    }

    /// Returns the number of the line read last, from 1; lines left out count.
    pub fn number(&self) -> u64 {
        self.program.as_ref().map_or(self.number, Running::number)
    }

    /// Returns the number of lines of the file that have been read.
    pub fn count(&self) -> u64 {
        self.program.as_ref().map_or(self.number, Running::count)
    }

    /// Returns the conditions of a program that were met so far, each with its line; `None` for a
    /// file that is no program.
    pub fn branches(&self) -> Option<&BTreeMap<u64, Branch>> {
        self.program.as_ref().map(Running::branches)
    }

    /// Returns the first line of a program that has read what only the machine knows: a place, an
    /// offset, a tool, a probe.
    pub fn asks(&self) -> Option<u64> {
        self.program.as_ref().and_then(Running::asks)
    }

    /// Returns true if the line read last has to be answered before the next one is read.
    fn waits(&self) -> bool {
        self.program.is_some() && self.probes
    }

    /// Reads the next line without its line end. A program reads its machine from `world`.
    ///
    /// # Errors
    /// The reader's error.
    pub fn next(&mut self, line: &mut Vec<u8>, world: &dyn World) -> io::Result<Next> {
        if self.program.is_none() {
            if !self.next_plain(line)? {
                return Ok(Next::End);
            }
            if !is_program(line) {
                return Ok(Next::Line);
            }
            self.begin(line)?;
            return Ok(Next::Begins);
        }
        let Some(program) = &mut self.program else {
            return Ok(Next::End);
        };
        let next = program.next(line, world);
        self.probes = line.windows(2).any(|pair| pair == b"38");
        Ok(next)
    }

    /// Begins the program whose first line has been read.
    fn begin(&mut self, line: &mut Vec<u8>) -> io::Result<()> {
        let before = self.number - 1;
        let mut text = Vec::new();
        loop {
            text.append(line);
            text.push(b'\n');
            if !self.read(line)? {
                break;
            }
        }
        self.program = Some(Running::new(text, before));
        Ok(())
    }

    fn next_plain(&mut self, line: &mut Vec<u8>) -> io::Result<bool> {
        while self.read(line)? {
            self.number += 1;
            if self.number == 1 && line.starts_with(Self::MARK) {
                line.drain(..Self::MARK.len());
            }
            if line.trim_ascii_start().first() != Some(&b'%') {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn read(&mut self, line: &mut Vec<u8>) -> io::Result<bool> {
        line.clear();
        let mut any = false;
        loop {
            let bytes = self.reader.fill_buf()?;
            if bytes.is_empty() {
                return Ok(any);
            }
            if std::mem::take(&mut self.after_return) && bytes[0] == b'\n' {
                self.reader.consume(1);
                continue;
            }
            any = true;
            let end = memchr2(b'\n', b'\r', bytes);
            let taken = end.unwrap_or(bytes.len());
            let room = LONGEST_LINE - line.len();
            line.extend_from_slice(&bytes[..taken.min(room)]);
            if end.is_some() {
                self.after_return = bytes[taken] == b'\r';
                self.reader.consume(taken + 1);
                return Ok(true);
            }
            self.reader.consume(taken);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHANNEL: ChannelId = ChannelId(0);

    fn stream<F: Replies>(text: &str, window: usize, replies: F) -> Streamer<&[u8], F> {
        let streaming = Streaming {
            window,
            keep_going: false,
        };
        Streamer::new(text.as_bytes(), streaming, replies)
    }

    fn sent(host: &mut impl Host) -> String {
        std::iter::from_fn(|| host.next_byte(CHANNEL))
            .map(char::from)
            .collect()
    }

    fn say(host: &mut impl Host, line: &str) {
        line.bytes()
            .for_each(|byte| host.receive(CHANNEL, byte, Cycle(1)));
        host.receive(CHANNEL, b'\r', Cycle(1));
        host.receive(CHANNEL, b'\n', Cycle(1));
    }

    #[test]
    fn a_line_is_sent_when_it_fits_beside_the_unanswered_ones() {
        let mut host = stream("G1X1\nG1X22\nG1X3", 11, ());
        assert_eq!(sent(&mut host), "G1X1\nG1X22\n");
        say(&mut host, "<Idle>");
        assert_eq!(sent(&mut host), "");
        say(&mut host, "ok");
        assert_eq!(sent(&mut host), "G1X3\n");
        say(&mut host, "ok");
        assert!(!host.is_done());
        say(&mut host, "ok");
        assert!(host.next_byte(CHANNEL).is_none() && host.is_done());
        assert_eq!(host.answered(), 3);
    }

    /// Expects that the machine refuses each line with a 7.
    struct Expects;

    impl Replies for Expects {
        fn reply(&mut self, _: &Reply<'_>, _: Cycle) {}

        fn before(&mut self, line: &[u8]) -> Then {
            match line.contains(&b'7') {
                true => Then::Await,
                false => Then::GoOn,
            }
        }
    }

    #[test]
    fn who_expects_a_refusal_and_hears_ok_goes_on() {
        let mut host = stream("G1X1\nG77\nG1X3\nG77\nG1X4", 64, Expects);
        assert_eq!(sent(&mut host), "G1X1\nG77\n");
        say(&mut host, "ok");
        assert_eq!(sent(&mut host), "");
        say(&mut host, "ok");
        assert_eq!(sent(&mut host), "G1X3\nG77\n");
        say(&mut host, "ok");
        say(&mut host, "error:20");
        assert_eq!(sent(&mut host), "");
        assert!(host.is_done());
    }

    #[test]
    fn the_first_line_without_an_answer_is_known() {
        let mut host = stream("G1X1\nG1X22", 64, ());
        sent(&mut host);
        assert_eq!(host.unanswered(), Some((1, b"G1X1".to_vec())));
        say(&mut host, "ok");
        assert_eq!(host.unanswered(), Some((2, b"G1X22".to_vec())));
        say(&mut host, "ok");
        assert_eq!(host.unanswered(), None);
        let mut locked = stream("G1X1", 64, ());
        sent(&mut locked);
        say(&mut locked, "ALARM:1");
        assert_eq!(locked.unanswered(), None);
    }

    #[test]
    fn a_byte_that_resets_the_machine_ends_the_streaming_at_the_oldest_line() {
        let mut host = stream("G1X1\nG1X2\nG1X3 \u{18}\nG1X4", 64, ());
        assert_eq!(sent(&mut host).len(), 22);
        say(&mut host, "ok");
        say(&mut host, "Grbl 1.1h ['$' for help]");
        assert!(host.is_done() && host.was_reset());
        say(&mut host, "ok");
        assert_eq!(host.unanswered(), Some((2, b"G1X2".to_vec())));
        let mut started = stream("G1X1\n", 64, ());
        sent(&mut started);
        say(&mut started, "Grbl 1.1h ['$' for help]");
        assert!(!started.is_done(), "the banner of power-up");
    }

    #[test]
    fn a_line_longer_than_the_window_goes_alone() {
        let mut host = stream("G1\nG1X123456789\nG2", 8, ());
        assert_eq!(sent(&mut host), "G1\n");
        say(&mut host, "ok");
        assert_eq!(sent(&mut host), "G1X123456789\n");
    }

    #[test]
    fn a_refused_line_is_named_and_ends_the_program() {
        let mut errors = Vec::new();
        let mut host = stream("%\nG1X1\nG77\nG1X2", 9, |reply: &Reply<'_>, _: Cycle| {
            if let Reply::Error { line, code, text } = reply {
                errors.push((*line, *code, text.to_vec()));
            }
        });
        sent(&mut host);
        say(&mut host, "ok");
        say(&mut host, "error:20");
        assert_eq!(sent(&mut host), "");
        assert!(host.is_done());
        drop(host);
        assert_eq!(errors, [(3, 20, b"G77".to_vec())]);
    }

    #[test]
    fn an_alarm_ends_the_streaming_at_once() {
        let mut host = stream("G1X1\nG1X2\n", 99, ());
        sent(&mut host);
        say(&mut host, "ALARM:1");
        assert!(host.is_done());
        assert_eq!(host.next_byte(CHANNEL), None);
    }

    #[test]
    fn every_kind_of_line_end_ends_one_line() {
        let mut host = stream("\u{FEFF}A\r\nB\rC\n\nD", 99, ());
        assert_eq!(sent(&mut host), "A\nB\nC\n\nD\n");
    }

    #[test]
    fn a_line_without_end_is_cut_and_the_next_one_is_whole() {
        let program = "X".repeat(1_000_000) + "\nG0";
        let mut lines = Lines::new(std::io::Cursor::new(program));
        let mut line = Vec::new();
        assert_eq!(lines.next(&mut line, &()).unwrap(), Next::Line);
        assert_eq!(line.len(), LONGEST_LINE);
        assert_eq!(lines.next(&mut line, &()).unwrap(), Next::Line);
        assert_eq!(line, b"G0");
    }

    #[test]
    fn a_program_is_sent_as_plain_lines_with_the_numbers_of_its_file() {
        let mut errors = Vec::new();
        let text = "G21\r\n#1=2\r\n\r\no1 repeat [2]\r\nG1X#1\r\no1 endrepeat\r\nG0X[1/0]\r\n";
        let mut host = stream(text, 99, |reply: &Reply<'_>, _: Cycle| {
            if let Reply::Error { line, .. } = reply {
                errors.push(*line);
            }
        });
        assert_eq!(sent(&mut host), "G21\n", "a probe may have gone before");
        say(&mut host, "ok");
        assert_eq!(sent(&mut host), "G1X2\nG1X2\n");
        assert_eq!(host.lines(), 7);
        say(&mut host, "ok");
        say(&mut host, "error:22");
        assert!(host.is_done(), "the fault has ended it");
        drop(host);
        assert_eq!(errors, [5]);
    }

    #[test]
    fn a_program_waits_for_the_answer_to_a_probe() {
        let mut host = stream("#1=1\nG38.2Z-5F50\nG0X#1", 99, ());
        assert_eq!(sent(&mut host), "G38.2Z-5F50\n");
        say(&mut host, "ok");
        assert_eq!(sent(&mut host), "G0X1\n");
    }

    #[test]
    fn the_machine_gets_the_bytes_of_the_file() {
        let mut host = stream("(stop! \u{e9}?)X1", 99, ());
        assert_eq!(sent(&mut host), "(stop! \u{c3}\u{a9}?)X1\n");
    }
}
