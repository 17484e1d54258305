//! A sender that streams a program by character counting: it sends lines as long as all unanswered
//! lines fit the receive buffer.
use crate::bench::{cycles, ensure, fail, is_answer, Bench, Failure, BANNER};
use std::{collections::VecDeque, ops::Range};

/// Cycles between two looks at received bytes: 30 µs, as for a sender on a fast line.
const SLICE: u64 = 5_000;
/// The longest time without an answer, s: a slow move through a full queue.
const PATIENCE_SECONDS: f64 = 120.0;

/// The time that an operator takes to change a tool, s.
const OPERATOR_SECONDS: f64 = 0.5;

/// The way in which a program is sent.
pub(crate) struct Stream<'a> {
    /// The program's lines.
    pub(crate) program: &'a str,
    /// The most bytes of unanswered lines.
    pub(crate) window: usize,
    /// The time between two status queries, s; 0 for none.
    pub(crate) poll_seconds: f64,
    /// The time in which the sender neither writes nor reads, s after its first line.
    pub(crate) silence: Range<f64>,
}

impl<'a> Stream<'a> {
    /// The number of bytes that the firmware's receive buffer takes.
    pub(crate) const WINDOW: usize = 1023;

    /// A program that is sent as fast as the buffer allows.
    pub(crate) fn new(program: &'a str) -> Self {
        Stream {
            program,
            window: Self::WINDOW,
            poll_seconds: 0.0,
            silence: 0.0..0.0,
        }
    }

    /// The same stream with status queries.
    pub(crate) fn polling(self, poll_seconds: f64) -> Self {
        Stream {
            poll_seconds,
            ..self
        }
    }

    /// The same stream with a sender that is silent for a time.
    pub(crate) fn silent(self, silence: Range<f64>) -> Self {
        Stream { silence, ..self }
    }

    /// Sends everything. Every line must be answered with `ok`. Motion may still go on at the end.
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

/// Status queries at regular intervals.
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
