//! Streams a job through a simulated machine.

mod complaints;

use crate::checker::follow;
use crate::complaint::Complaint;
use crate::life::{End, Wait};
use crate::machine::Machine;
use crate::remark::Remarks;
use complaints::Complaints;
use leadscrew_machine::board::ChannelId;
use leadscrew_machine::machine::LineFault;
use leadscrew_machine::settings::table::Setting;
use leadscrew_program::is_program;
use leadscrew_sim::clock::Cycle;
use leadscrew_sim::event_loop::Stopped;
use leadscrew_sim::link::{Host, Rate};
use leadscrew_sim::observer::Observer;
use leadscrew_sim::outcome::Outcome;
use leadscrew_sim::powered::{Powered, Supply, MOST_MOTORS};
use leadscrew_sim::scene::ToolSizes;
use leadscrew_sim::streamer::{Replies, Streamer, Streaming};
use leadscrew_sim::PowerUp;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{self, BufRead};
use std::rc::Rc;

/// The realtime byte that raises the feed override by 10 %.
const FEED_TEN_MORE: u8 = 0x91;

/// The time that Grbl takes for a line of a program, µs. The recorded raster (`laser_raster_m4` of
/// tests/conformance/traces) goes at 72.8 mm/s along pixels of 0.2 mm, 2.75 ms each, though its
/// look-ahead and its serial line allow more; while it moves faster, a line takes longer. With this
/// time both recorded rasters agree within 1.3 %.
const GRBL_LINE_US: u64 = 2_875;

/// Errors that are kept in full.
const KEPT_ERRORS: usize = 100;

/// Warnings that are kept, as many as `check` keeps.
const KEPT_WARNINGS: usize = 10_000;

/// The way in which a job is streamed, and the machine.
pub struct Stream<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The serial line.
    pub rate: Rate,
    /// True if lines after a refused one are sent all the same.
    pub keep_going: bool,
    /// The feed override, 100 to 200 in tens.
    pub feed_percent: u8,
    /// True if to keep which line each answer was for (8 bytes a line), and the sizes of the tools.
    pub keep_answers: bool,
    /// True if to report likely mistakes.
    pub warn: bool,
    /// True if only times count: no step is seen by an observer, and no peak is measured.
    pub only_times: bool,
    /// True if the carriages stand where the machine's file puts them: a job ends before a line
    /// that they cannot follow. Otherwise the job is run for what it does, wherever it begins.
    pub knows_place: bool,
    /// Is called with news while the job runs.
    pub tell: fn(&News<'_>),
}

/// News of a job that runs.
#[derive(Debug)]
pub enum News<'a> {
    /// The machine is locked at power-up until it is homed; `$X` has unlocked it at its present
    /// position.
    Unlocked,
    /// An error or an alarm.
    Complaint(&'a Complaint),
    /// There are more errors than are kept; further ones are only counted.
    FurtherErrors,
}

/// The result of a job.
pub struct Streamed<O> {
    /// Lines read from the file.
    pub lines: u64,
    /// The errors that were kept in full.
    pub errors: Vec<Complaint>,
    /// The number of errors.
    pub error_count: u64,
    /// The alarm that ended the job.
    pub alarm: Option<Complaint>,
    /// Likely mistakes, as `check` finds them, up to 10 000; empty if they were not asked for.
    pub warnings: Vec<Complaint>,
    /// The number of likely mistakes.
    pub warning_count: u64,
    /// The end of the job.
    pub end: End,
    /// The lines at which the program waited for its operator (M0, M6); somebody went on at once.
    pub waits: Vec<Wait>,
    /// The tools that it asked for.
    pub tools: Vec<u32>,
    /// The lines as the machine counts them.
    pub counted: Counted,
    /// The result of the simulation.
    pub outcome: Outcome<MOST_MOTORS>,
    /// The observer of the run.
    pub observer: O,
}

impl Stream<'_> {
    /// Streams the job called `name` to its end while `observer` watches.
    ///
    /// # Errors
    /// If its text cannot be read to its end.
    pub fn run<O: Observer>(
        &self,
        name: &str,
        text: impl BufRead,
        observer: O,
    ) -> io::Result<Streamed<O>> {
        let faults = Faults::default();
        let mut watching = (observer, FaultWatch(Rc::clone(&faults)));
        let mut text = text;
        let complaints = self.complaints(name, faults, begins_as_program(text.fill_buf()?));
        let streaming = Streaming {
            window: self.window(),
            keep_going: self.keep_going,
        };
        let mut operator = Operator::new(Streamer::new(text, streaming, complaints));
        if self.machine.settings.is_on(Setting::Homing) {
            operator.say(b"$X\n");
            (self.tell)(&News::Unlocked);
        }
        let tens = usize::from(self.feed_percent.saturating_sub(100) / 10);
        operator.say(&vec![FEED_TEN_MORE; tens]);
        let (mut waits, mut result) = (Vec::new(), None);
        let file = &self.machine.file;
        file.power_up(self.supply(), &mut watching, &mut |powered| {
            waits = operate(powered, &mut operator);
            result = Some((powered.outcome(), powered.snapshot().state));
        });
        let (outcome, state) =
            result.ok_or_else(|| io::Error::other("the machine has no power"))?;

        let lines = operator.streamer.lines();
        let own = operator.own_lines;
        let unanswered = operator.streamer.unanswered();
        let was_reset = operator.streamer.was_reset();
        let mut complaints = operator.streamer.finish()?;
        complaints.see_end(state, was_reset, unanswered);
        let end = complaints.end();
        Ok(Streamed {
            lines,
            errors: complaints.errors,
            error_count: complaints.count,
            alarm: complaints.alarm,
            warnings: complaints.warnings,
            warning_count: complaints.warning_count,
            end,
            waits,
            tools: complaints.tools,
            counted: Counted {
                tools: complaints
                    .sizes
                    .take()
                    .map(|sizes| sizes.behind(own))
                    .unwrap_or_default(),
                lines: std::iter::repeat_n(0, own)
                    .chain(complaints.answered.into_iter().flatten())
                    .collect(),
            },
            outcome,
            observer: watching.0,
        })
    }

    fn complaints(&self, name: &str, faults: Faults, reads_machine: bool) -> Complaints {
        let looks_ahead = self.warn || !self.keep_going || reads_machine || self.knows_place;
        let mut checker = looks_ahead.then(|| follow(name, self.machine));
        if let Some(checker) = checker.as_mut().filter(|_| self.knows_place) {
            checker.know_carriages();
        }
        Complaints {
            answered: self.keep_answers.then(Vec::new),
            sizes: self.keep_answers.then(Sizes::default),
            remarks: self.warn.then(Remarks::default),
            keep_going: self.keep_going,
            knows_place: self.knows_place,
            ..Complaints::new(name, faults, checker, self.tell)
        }
    }

    /// Bytes of unanswered lines. Lines that wait in Grbl's buffer come no sooner to be planned, since
    /// Grbl takes its time for each: one line at a time has the same effect.
    fn window(&self) -> usize {
        match self.machine.is_grbl {
            true => 1,
            false => usize::from(self.machine.file.receive_buffer()),
        }
    }

    fn supply(&self) -> Supply {
        Supply {
            first: Some(self.machine.first()),
            outputs: self.machine.outputs,
            heat_fault: self.machine.heat_fault,
            glides: self.only_times,
            joins_rows: !self.machine.is_grbl,
            line_us: if self.machine.is_grbl {
                GRBL_LINE_US
            } else {
                0
            },
            ..self.machine.file.supply(self.rate)
        }
    }
}

/// Returns true if a job shows in its first bytes that it is a program: it may read where the
/// machine is, which a checker knows.
fn begins_as_program(head: &[u8]) -> bool {
    head.split(|byte| matches!(byte, b'\n' | b'\r'))
        .any(is_program)
}

/// Faults that the machine has found and not yet answered, in order. They are kept because an
/// answer has no column.
type Faults = Rc<RefCell<VecDeque<LineFault>>>;

/// Collects the faults.
struct FaultWatch(Faults);

impl Observer for FaultWatch {
    fn refused(&mut self, _: Cycle, fault: &LineFault) {
        self.0.borrow_mut().push_back(*fault);
    }
}

/// Lets the machine work until the program is done and motion rests. A program pause (M0) and a
/// tool change (M6) are resumed at once, since no operator is there. Returns what paused.
fn operate<R: BufRead>(
    powered: &mut dyn Powered,
    operator: &mut Operator<R, Complaints>,
) -> Vec<Wait> {
    let mut waits = Vec::new();
    loop {
        match powered.work(operator) {
            Stopped::Quiet if powered.waits_for_operator() => {
                let streamer = &operator.streamer;
                let (line, text) = streamer
                    .unanswered()
                    .unwrap_or_else(|| (streamer.current(), Vec::new()));
                waits.push(Wait::new(line, &text, &streamer.replies().message));
                operator.say(b"~");
            }
            Stopped::Quiet | Stopped::Reached | Stopped::Condition => break,
        }
    }
    powered.settle(operator);
    waits
}

/// The sender: it sends a program, and now and then the operator's own bytes in between.
struct Operator<R, F> {
    streamer: Streamer<R, F>,
    words: VecDeque<u8>,
    /// Answers to the operator's own lines that are still to come; they do not belong to the
    /// program.
    own_answers: usize,
    /// Lines that the operator sent before the program began.
    own_lines: usize,
    answer: Vec<u8>,
}

impl<R: BufRead, F: Replies> Operator<R, F> {
    fn new(streamer: Streamer<R, F>) -> Self {
        Self {
            streamer,
            words: VecDeque::new(),
            own_answers: 0,
            own_lines: 0,
            answer: Vec::new(),
        }
    }

    fn say(&mut self, words: &[u8]) {
        let lines = words.iter().filter(|byte| **byte == b'\n').count();
        self.own_answers += lines;
        self.own_lines += lines;
        self.words.extend(words);
    }
}

impl<R: BufRead, F: Replies> Host for Operator<R, F> {
    fn next_byte(&mut self, channel: ChannelId) -> Option<u8> {
        let word = self.words.pop_front();
        word.or_else(|| self.streamer.next_byte(channel))
    }

    fn receive(&mut self, channel: ChannelId, byte: u8, now: Cycle) {
        if self.own_answers == 0 {
            return self.streamer.receive(channel, byte, now);
        }
        if byte != b'\n' {
            return self.answer.push(byte);
        }
        if self.answer.starts_with(b"ok") || self.answer.starts_with(b"error") {
            self.own_answers -= 1;
        }
        self.answer.clear();
    }

    fn is_done(&self) -> bool {
        self.words.is_empty() && self.own_answers == 0 && self.streamer.is_done()
    }
}

/// The lines that the machine has answered; empty if they were not asked for.
#[derive(Default)]
pub struct Counted {
    /// For each answer, in order, the line of the file; 0 for the operator's own lines.
    lines: Vec<u64>,
    /// The diameters of tools, mm, each with the index in `lines` from which on it holds.
    tools: Vec<(usize, f32)>,
}

impl Counted {
    /// Returns the line of the file that the machine counts as its line `number`; `None` if there
    /// is none.
    pub fn line(&self, number: u32) -> Option<u64> {
        let index = usize::try_from(number).ok()?.checked_sub(1)?;
        self.lines.get(index).copied()
    }

    /// As [`Counted::line`], but 0 for none; and the diameter of the tool at that line, mm.
    pub fn line_and_tool(&self, number: u32) -> (u32, f32) {
        let line = self.line(number).unwrap_or(0);
        let line = u32::try_from(line).unwrap_or(u32::MAX);
        let begun = |(begin, _): &(usize, f32)| *begin < number as usize;
        let last = self.tools.partition_point(begun).checked_sub(1);
        let tool = last.and_then(|last| self.tools.get(last));
        (line, tool.map_or(0.0, |(_, mm)| *mm))
    }
}

/// The sizes of the tools along a program.
#[derive(Default)]
struct Sizes {
    tools: ToolSizes,
    /// The number of lines that have been sent.
    sent: usize,
    /// Each size, with the number of lines that were sent before it came into use.
    changes: Vec<(usize, f32)>,
}

impl Sizes {
    fn read(&mut self, line: &[u8]) {
        let size = self.tools.read(line);
        if self.changes.last().is_none_or(|(_, last)| *last != size) {
            self.changes.push((self.sent, size));
        }
        self.sent += 1;
    }

    /// The changes, counted from power-up: `own` lines were sent before the program.
    fn behind(self, own: usize) -> Vec<(usize, f32)> {
        let changes = self.changes.into_iter();
        changes.map(|(sent, size)| (sent + own, size)).collect()
    }
}
