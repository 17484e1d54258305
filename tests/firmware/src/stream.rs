//! A sender that streams a program by character counting: lines go out while the unread ones fit
//! the receive buffer.
use crate::bench::{cycles, ensure, fail, is_answer, Bench, Failure, BANNER};
use std::{collections::VecDeque, ops::Range};

/// Cycles between two looks at received bytes: 30 µs, as a sender on a fast line.
const SLICE: u64 = 5_000;
/// The longest that nothing may be answered, s: a slow move through a full queue.
const PATIENCE_SECONDS: f64 = 120.0;

/// The time that an operator takes to change a tool, s.
const OPERATOR_SECONDS: f64 = 0.5;

/// How a program is sent.
pub(crate) struct Stream<'a> {
    /// The program's lines.
    pub(crate) program: &'a str,
    /// Bytes of unanswered lines at most.
    pub(crate) window: usize,
    /// Time between two status queries in s; none where it is 0.
    pub(crate) poll_seconds: f64,
    /// When the sender neither speaks nor listens, s from its first line on.
    pub(crate) silence: Range<f64>,
}

impl<'a> Stream<'a> {
    /// Bytes that the firmware's receive buffer takes.
    pub(crate) const WINDOW: usize = 1023;

    /// A program to be sent as fast as the buffer allows.
    pub(crate) fn new(program: &'a str) -> Self {
        Stream {
            program,
            window: Self::WINDOW,
            poll_seconds: 0.0,
            silence: 0.0..0.0,
        }
    }

    /// The same with status queries.
    pub(crate) fn polling(self, poll_seconds: f64) -> Self {
        Stream {
            poll_seconds,
            ..self
        }
    }

    /// The same with a sender that is silent for a time.
    pub(crate) fn silent(self, silence: Range<f64>) -> Self {
        Stream { silence, ..self }
    }

    /// Sends everything; every line must be answered with `ok`. Motion may go on.
    pub(crate) fn send_all(&self, bench: &mut Bench) -> Result<(), Failure> {
        let lines = self.program.lines().filter(|line| !line.starts_with('%'));
        let mut lines = lines.peekable();
        let mut unanswered: VecDeque<&str> = VecDeque::new();
        let mut queries = Queries::new(self.poll_seconds, bench);
        let begin = bench.machine.cycle();
        let silence = begin + cycles(self.silence.start)..begin + cycles(self.silence.end);
        let mut patience = begin + cycles(PATIENCE_SECONDS);
        while lines.peek().is_some() || !unanswered.is_empty() {
            let mut used: usize = unanswered.iter().map(|line| line.len() + 1).sum();
            while let Some(line) = lines.next_if(|line| used + line.len() < self.window) {
                bench.send(format!("{line}\n"));
                used += line.len() + 1;
                unanswered.push_back(line);
            }
            queries.ask(bench);
            let now = bench.machine.cycle();
            let silent = silence.contains(&now);
            bench.run_to(if silent { silence.end } else { now + SLICE })?;
            for heard in bench.heard() {
                patience = bench.machine.cycle() + cycles(PATIENCE_SECONDS);
                // Tools are changed quickly here.
                if heard.starts_with("[MSG:Tool ") {
                    bench.run_for(OPERATOR_SECONDS)?;
                    bench.send("~");
                }
                self.take(&heard, &mut unanswered)?;
            }
            ensure(bench.machine.cycle() < patience, || {
                format!("no answer to {:?}", unanswered.front())
            })?;
        }
        Ok(())
    }

    fn take(&self, heard: &str, unanswered: &mut VecDeque<&str>) -> Result<(), Failure> {
        if heard.starts_with("ALARM") {
            return fail(format!("{heard} at {:?}", unanswered.front()));
        }
        if heard == BANNER {
            return fail(format!("starts anew at {:?}", unanswered.front()));
        }
        if !is_answer(heard) {
            return Ok(());
        }
        let line = unanswered.pop_front();
        ensure(heard == "ok" && line.is_some(), || {
            format!("{heard} to {line:?}")
        })
    }

    /// Sends everything and waits until the machine rests.
    pub(crate) fn run(&self, bench: &mut Bench) -> Result<(), Failure> {
        self.send_all(bench)?;
        bench.wait_for("Idle", 4.0 * PATIENCE_SECONDS)?;
        Ok(())
    }
}

/// Status queries at a rate.
struct Queries {
    every: u64,
    next: u64,
}

impl Queries {
    fn new(seconds: f64, bench: &Bench) -> Self {
        let every = cycles(seconds);
        let next = if every == 0 {
            u64::MAX
        } else {
            bench.machine.cycle()
        };
        Queries { every, next }
    }

    fn ask(&mut self, bench: &mut Bench) {
        if bench.machine.cycle() >= self.next {
            self.next += self.every;
            bench.send("?");
        }
    }
}
