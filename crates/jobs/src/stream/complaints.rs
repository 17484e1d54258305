//! The machine's answers to a job: refusals become complaints, and one of them, or an alarm, is its
//! end.

use super::{Faults, News, Sizes, KEPT_ERRORS, KEPT_WARNINGS};
use crate::checker::{Follow, Foreseen};
use crate::complaint::{Complaint, Fault};
use crate::life::{Cause, End};
use crate::remark::Remarks;
use leadscrew_machine::machine::LineFault;
use leadscrew_machine::protocol::alarm::Alarm;
use leadscrew_machine::protocol::line_reader::raw_column;
use leadscrew_machine::protocol::status::Status;
use leadscrew_program::World;
use leadscrew_sim::clock::Cycle;
use leadscrew_sim::program::ProgramFault;
use leadscrew_sim::scene::note_tools;
use leadscrew_sim::streamer::{Replies, Reply, Then};

/// Turns the machine's refusals into complaints, and reports each complaint at once.
pub(super) struct Complaints {
    pub(super) file: String,
    pub(super) faults: Faults,
    /// Checks lines ahead of the machine, so that nothing is sent after the first line that the
    /// machine will refuse.
    pub(super) checker: Option<Box<dyn Follow>>,
    pub(super) errors: Vec<Complaint>,
    pub(super) count: u64,
    pub(super) alarm: Option<Complaint>,
    /// The cause that stopped the job, and the line.
    pub(super) stopped: Option<(Cause, u64)>,
    /// The line that was answered last.
    pub(super) last: u64,
    /// The last message of the machine.
    pub(super) message: String,
    /// The lines that have been answered, in order; `None` if they were not asked for.
    pub(super) answered: Option<Vec<u64>>,
    /// Tools that lines have asked for.
    pub(super) tools: Vec<u32>,
    /// The sizes of the tools; `None` if they were not asked for.
    pub(super) sizes: Option<Sizes>,
    /// Looks for likely mistakes; `None` if they were not asked for.
    pub(super) remarks: Option<Remarks>,
    pub(super) warnings: Vec<Complaint>,
    pub(super) warning_count: u64,
    /// True if lines after a refused one are sent all the same.
    pub(super) keep_going: bool,
    /// True if the job ends before a line that the carriages cannot follow.
    pub(super) knows_place: bool,
    /// The line that is about to be sent.
    pub(super) next: u64,
    pub(super) tell: fn(&News<'_>),
}

impl Complaints {
    pub(super) fn new(
        file: &str,
        faults: Faults,
        checker: Option<Box<dyn Follow>>,
        tell: fn(&News<'_>),
    ) -> Self {
        Self {
            file: file.to_owned(),
            faults,
            checker,
            errors: Vec::new(),
            count: 0,
            alarm: None,
            stopped: None,
            last: 0,
            message: String::new(),
            answered: None,
            tools: Vec::new(),
            sizes: None,
            remarks: None,
            warnings: Vec::new(),
            warning_count: 0,
            keep_going: false,
            knows_place: false,
            next: 0,
            tell,
        }
    }

    fn complaint(&self, line: u64, byte: Option<usize>, fault: Fault, text: &[u8]) -> Complaint {
        Complaint::new(&self.file, line, byte, fault, text)
    }

    /// Returns how the job ended, once all is over.
    pub(super) fn end(&self) -> End {
        match self.stopped {
            Some((by, line)) => End::Stopped { by, line },
            None => End::Done {
                line: self.last,
                refused: self.count,
            },
        }
    }

    fn note_answer(&mut self, line: u64) {
        self.last = line;
        if let Some(answered) = &mut self.answered {
            answered.push(line);
        }
    }

    fn refused(&mut self, line: u64, code: u8, text: &[u8]) {
        // If one turn of the main loop refuses two lines, the machine tells the fault of one only.
        // So the answer may be to a line without a fault.
        let is_its = |fault: &mut LineFault| fault.status.number() == code;
        let fault = self.faults.borrow_mut().pop_front_if(is_its);
        let status = fault
            .map(|fault| fault.status)
            .or_else(|| Status::from_number(code))
            .unwrap_or(Status::Own(code));
        let column = fault.map(|fault| raw_column(text, fault.column));
        let fault = match (status, column) {
            // The interpreter's faults have a column. A fault without a column is the planner's:
            // the move is too long.
            (Status::InvalidTarget, None) => Fault::TooLong,
            (status, _) => Fault::Error(status),
        };
        if !self.keep_going {
            self.stopped.get_or_insert((Cause::Fault(fault), line));
        }
        let complaint = self.complaint(line, column, fault, text);
        self.tell_error(complaint);
    }

    /// The machine has come to rest in this state. It leaves the line `unanswered`, if any, and all
    /// that follow it without an answer.
    pub(super) fn see_end(
        &mut self,
        state: &str,
        was_reset: bool,
        unanswered: Option<(u64, Vec<u8>)>,
    ) {
        let line = unanswered.as_ref().map(|(line, _)| *line);
        let cause = match line {
            _ if state == "Sleep" => Some((Cause::Sleep, self.last)),
            Some(line) if was_reset => Some((Cause::Reset, line)),
            Some(line) if state.starts_with("Door") => Some((Cause::Door, line)),
            Some(line) => Some((Cause::Silence, line)),
            None => None,
        };
        self.stopped = self.stopped.or(cause);
        if let Some((line, text)) = unanswered {
            let complaint = self.complaint(line, None, Fault::Unanswered, &text);
            self.tell_error(complaint);
        }
    }

    /// The carriages cannot follow the next line.
    fn crash(&mut self, complaint: Complaint) -> Then {
        let cause = (Cause::Fault(complaint.fault), complaint.line);
        self.tell_error(complaint);
        if self.keep_going {
            return Then::GoOn;
        }
        self.stopped.get_or_insert(cause);
        Then::Stop
    }

    /// Notes a message of the machine.
    fn hear(&mut self, said: &[u8]) {
        if let Some(message) = said.strip_prefix(b"[MSG:") {
            let message = message.strip_suffix(b"]").unwrap_or(message);
            self.message = String::from_utf8_lossy(message).into_owned();
        }
        if let (Some(checker), Some((at, touched))) = (&mut self.checker, probe_end(said)) {
            checker.end_probe(&at, touched);
        }
    }

    fn tell_error(&mut self, complaint: Complaint) {
        self.count += 1;
        if self.errors.len() < KEPT_ERRORS {
            (self.tell)(&News::Complaint(&complaint));
            self.errors.push(complaint);
        } else if self.count == KEPT_ERRORS as u64 + 1 {
            (self.tell)(&News::FurtherErrors);
        }
    }
}

impl Replies for Complaints {
    fn reply(&mut self, reply: &Reply<'_>, _: Cycle) {
        match *reply {
            Reply::Error { line, code, text } => {
                self.note_answer(line);
                self.refused(line, code, text);
            }
            Reply::Alarm { code, line, text } => {
                let alarm = Alarm::from_number(code).unwrap_or(Alarm::Own(code));
                let complaint = self.complaint(line, None, Fault::Alarm(alarm), text);
                (self.tell)(&News::Complaint(&complaint));
                self.stopped
                    .get_or_insert((Cause::Fault(complaint.fault), line));
                self.alarm.get_or_insert(complaint);
            }
            Reply::Ok { line } => self.note_answer(line),
            Reply::Other(said) => self.hear(said),
        }
    }

    fn before(&mut self, line: &[u8]) -> Then {
        let Some(checker) = &mut self.checker else {
            return Then::GoOn;
        };
        let foreseen = checker.foresee(self.next, line);
        if let Some(remarks) = &mut self.remarks {
            remarks.pass(checker.last());
        }
        match foreseen {
            Foreseen::Crash(complaint) if self.knows_place => self.crash(complaint),
            Foreseen::Refused if !self.keep_going => Then::Await,
            // Its end decides what comes of the lines behind it.
            Foreseen::Taken if self.knows_place && probes(line) => Then::Await,
            Foreseen::Taken | Foreseen::Refused | Foreseen::Crash(_) => Then::GoOn,
        }
    }

    fn world(&self) -> &dyn World {
        match &self.checker {
            Some(checker) => checker.world(),
            None => &(),
        }
    }

    fn failed(&mut self, fault: &ProgramFault) {
        let complaint = Complaint::of_program(&self.file, fault);
        self.stopped
            .get_or_insert((Cause::Fault(complaint.fault), fault.line));
        self.tell_error(complaint);
    }

    fn read(&mut self, number: u64, line: &[u8]) {
        self.next = number;
        note_tools(&mut self.tools, line);
        if let Some(sizes) = &mut self.sizes {
            sizes.read(line);
        }
        let Some(remarks) = &mut self.remarks else {
            return;
        };
        for (column, remark) in remarks.read(line) {
            self.warning_count += 1;
            if self.warnings.len() < KEPT_WARNINGS {
                let warning = self.complaint(number, Some(column), Fault::Remark(remark), line);
                self.warnings.push(warning);
            }
        }
    }
}

/// Returns true if a line may be a probe's, G38.2 to G38.5.
fn probes(line: &[u8]) -> bool {
    let mut words = line.split(|byte| byte.eq_ignore_ascii_case(&b'G')).skip(1);
    words.any(|word| word.trim_ascii_start().starts_with(b"38"))
}

/// Reads `[PRB:1.000,2.000,-3.000:1]`: the place at which a probe has ended, and whether it has
/// touched.
fn probe_end(said: &[u8]) -> Option<(Vec<f32>, bool)> {
    let said = std::str::from_utf8(said).ok()?;
    let (at, touched) = said
        .strip_prefix("[PRB:")?
        .strip_suffix(']')?
        .split_once(':')?;
    let at: Result<Vec<f32>, _> = at.split(',').map(str::parse).collect();
    Some((at.ok()?, touched == "1"))
}
