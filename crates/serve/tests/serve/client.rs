//! A program at the other end of a line.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// The most bytes of unanswered lines, as Grbl's senders count.
const WINDOW: usize = 128;

/// The time after which a sender asks for a report again.
const POLL: Duration = Duration::from_millis(40);

pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// A program at the other end of a line.
pub(crate) struct Client {
    to: Box<dyn Write>,
    lines: Receiver<String>,
    pub(crate) reports: Vec<String>,
}

impl Client {
    pub(crate) fn new(from: impl Read + Send + 'static, to: impl Write + 'static) -> Self {
        let (line_in, lines) = mpsc::channel();
        std::thread::spawn(move || {
            for line in BufReader::new(from).lines().map_while(Result::ok) {
                if line_in.send(line).is_err() {
                    return;
                }
            }
        });
        Self {
            to: Box::new(to),
            lines,
            reports: Vec::new(),
        }
    }

    pub(crate) fn send(&mut self, bytes: &[u8]) {
        self.to.write_all(bytes).unwrap();
        self.to.flush().unwrap();
    }

    /// The next line that is neither empty nor a report; `None` if none comes in time.
    pub(crate) fn hear(&mut self, patience: Duration) -> Option<String> {
        let until = Instant::now() + patience;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            match self.lines.recv_timeout(left) {
                Ok(line) if line.is_empty() => {}
                Ok(line) if line.starts_with('<') => {
                    assert!(line.ends_with('>'), "{line}");
                    self.reports.push(line);
                }
                Ok(line) => return Some(line),
                Err(RecvTimeoutError::Timeout) => return None,
                Err(RecvTimeoutError::Disconnected) => panic!("the server has hung up"),
            }
        }
    }

    pub(crate) fn expect(&mut self, expected: &str) {
        assert_eq!(self.hear(PATIENCE).as_deref(), Some(expected));
    }

    pub(crate) fn ask(&mut self) -> String {
        self.send(b"?");
        let heard = self.reports.len();
        let until = Instant::now() + PATIENCE;
        while self.reports.len() == heard {
            assert!(Instant::now() < until, "no report");
            assert_eq!(self.hear(Duration::from_millis(2)), None);
        }
        self.reports[heard].clone()
    }

    /// Sends a line; returns the lines that come before its `ok`.
    pub(crate) fn say(&mut self, line: &str) -> Vec<String> {
        self.send(format!("{line}\n").as_bytes());
        std::iter::from_fn(|| self.hear(PATIENCE).filter(|heard| heard != "ok")).collect()
    }

    /// The row of `$$` for a setting.
    pub(crate) fn setting(&mut self, name: &str) -> Option<String> {
        let begins = format!("{name}=");
        let mut rows = self.say("$$").into_iter();
        rows.rfind(|row| row.starts_with(&begins))
    }

    pub(crate) fn wait_for(&mut self, state: &str) -> String {
        let until = Instant::now() + PATIENCE;
        loop {
            let report = self.ask();
            if report.starts_with(&format!("<{state}|")) {
                return report;
            }
            assert!(Instant::now() < until, "no {state}, but {report}");
        }
    }

    /// Streams a job by character counting, and asks for reports all the while.
    pub(crate) fn stream(&mut self, job: &str) {
        let mut waiting: VecDeque<&str> = job.lines().collect();
        let mut on_the_way: VecDeque<&str> = VecDeque::new();
        let mut next_poll = Instant::now();
        while !(waiting.is_empty() && on_the_way.is_empty()) {
            let used: usize = on_the_way.iter().map(|line| line.len() + 1).sum();
            match waiting.front() {
                Some(line) if used + line.len() < WINDOW => {
                    self.send(format!("{line}\n").as_bytes());
                    on_the_way.extend(waiting.pop_front());
                    continue;
                }
                Some(_) | None => {}
            }
            if Instant::now() >= next_poll {
                self.send(b"?");
                next_poll += POLL;
            }
            match self.hear(POLL / 4).as_deref() {
                None => {}
                Some("ok") => assert!(on_the_way.pop_front().is_some(), "an ok too many"),
                Some(message) if message.starts_with('[') => {}
                Some(answer) => panic!("{answer} to {:?}", on_the_way.front()),
            }
        }
        assert_eq!(self.hear(POLL), None);
    }
}
