//! The board at the other end of the line: lines and their answers, programs, captured edges.
use crate::{
    edges::Edges,
    failure::{fail, Failure},
    link::Link,
    wires::Signal,
};
use std::collections::VecDeque;

/// The last line of every greeting.
const BANNER: &str = "Grbl 1.1h ['$' for help]";
/// The longest time that the board may take to start, s: it may first erase a sector of 128 KiB.
const BOOT_SECONDS: f64 = 4.0;
/// The longest time in which nothing may be heard, s.
const PATIENCE_SECONDS: f64 = 3.0;
/// The most bytes of unanswered lines: the receive buffer takes as many.
const WINDOW: usize = 1023;
/// The most edges that a line of `M121` lists.
const PER_LINE: usize = 20;

/// The board.
pub(crate) struct Board<'a> {
    link: &'a mut dyn Link,
    /// The received bytes of a line that has not ended yet.
    incoming: Vec<u8>,
}

impl<'a> Board<'a> {
    /// The board at the other end of `link`.
    pub(crate) fn new(link: &'a mut dyn Link) -> Self {
        Board {
            link,
            incoming: Vec::new(),
        }
    }

    /// The serial line, with its name and a clock that the board has no part in.
    pub(crate) fn link(&self) -> &dyn Link {
        self.link
    }

    /// Sends bytes as they are.
    pub(crate) fn send(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        self.link.send(bytes)
    }

    /// The lines that have come; empty ones are left out.
    fn heard(&mut self) -> Result<Vec<String>, Failure> {
        let mut lines = Vec::new();
        for byte in self.link.receive()? {
            match byte {
                b'\r' => {}
                b'\n' => {
                    let line = std::mem::take(&mut self.incoming);
                    lines.push(String::from_utf8_lossy(&line).into_owned());
                }
                other => self.incoming.push(other),
            }
        }
        lines.retain(|line| !line.is_empty());
        Ok(lines)
    }

    /// Lets time pass, and drops the bytes that come meanwhile.
    pub(crate) fn wait(&mut self, seconds: f64) -> Result<(), Failure> {
        let end = self.link.seconds() + seconds;
        while self.link.seconds() < end {
            self.heard()?;
        }
        Ok(())
    }

    /// Waits for a line. Returns all lines heard up to it.
    pub(crate) fn hear_until(
        &mut self,
        seconds: f64,
        is_last: impl Fn(&str) -> bool,
    ) -> Result<Vec<String>, Failure> {
        let (mut all, end) = (Vec::new(), self.link.seconds() + seconds);
        while self.link.seconds() < end {
            all.append(&mut self.heard()?);
            if all.iter().any(|line| is_last(line)) {
                return Ok(all);
            }
        }
        let last = all.last().map_or("nothing", String::as_str);
        fail(format!("waited {seconds} s, heard {last}"))
    }

    /// Waits for the greeting of a board that was just switched on.
    pub(crate) fn hear_boot(&mut self) -> Result<(), Failure> {
        self.hear_until(BOOT_SECONDS, |line| line == BANNER)?;
        Ok(())
    }

    /// Resets the machine and unlocks it.
    pub(crate) fn reset(&mut self) -> Result<(), Failure> {
        self.send(b"\x18")?;
        let heard = self.hear_until(BOOT_SECONDS, |line| line == BANNER);
        heard.map_err(|Failure(words)| Failure(format!("no greeting: {words}")))?;
        self.command("$X")?;
        Ok(())
    }

    /// Sends a line that must be answered with `ok`. Returns the lines heard before the `ok`.
    pub(crate) fn command(&mut self, line: &str) -> Result<Vec<String>, Failure> {
        self.stream(line)
    }

    /// Sends lines as fast as the receive buffer allows. Each must be answered with `ok`. Returns
    /// all other lines that were heard.
    pub(crate) fn stream(&mut self, program: &str) -> Result<Vec<String>, Failure> {
        let mut lines = program.lines().filter(|line| !line.is_empty()).peekable();
        let (mut unanswered, mut others) = (VecDeque::new(), Vec::new());
        let mut end = self.link.seconds() + PATIENCE_SECONDS;
        while lines.peek().is_some() || !unanswered.is_empty() {
            let used: usize = unanswered.iter().map(|line: &&str| line.len() + 1).sum();
            // Sends all lines that fit at once: then an adapter puts no gap between them.
            let mut going = String::new();
            while let Some(line) = lines.next_if(|line| used + going.len() + line.len() < WINDOW) {
                going.extend([line, "\n"]);
                unanswered.push_back(line);
            }
            if !going.is_empty() {
                self.link.send(going.as_bytes())?;
            }
            for heard in self.heard()? {
                end = self.link.seconds() + PATIENCE_SECONDS;
                match heard.as_str() {
                    "ok" if !unanswered.is_empty() => drop(unanswered.pop_front()),
                    bad if bad.starts_with("error:") || bad.starts_with("ALARM:") => {
                        return fail(format!("{bad} to {:?}", unanswered.front()))
                    }
                    _ => others.push(heard),
                }
            }
            if self.link.seconds() > end {
                return fail(format!("no answer to {:?}", unanswered.front()));
            }
        }
        Ok(others)
    }

    /// Waits until the machine rests.
    pub(crate) fn wait_idle(&mut self) -> Result<(), Failure> {
        let end = self.link.seconds() + 4.0 * PATIENCE_SECONDS;
        while self.link.seconds() < end {
            self.send(b"?")?;
            let heard = self.hear_until(PATIENCE_SECONDS, |line| line.starts_with('<'))?;
            if heard.iter().any(|line| line.starts_with("<Idle")) {
                return Ok(());
            }
            self.wait(0.02)?;
        }
        fail("the machine does not come to rest")
    }

    /// Runs a program to its end.
    pub(crate) fn run(&mut self, program: &str) -> Result<(), Failure> {
        self.stream(program)?;
        self.wait_idle()
    }

    /// Captures the edges of these signals from now on.
    pub(crate) fn capture(&mut self, signals: &[Signal]) -> Result<(), Failure> {
        let wires = signals.iter().fold(0, |all, one| all | 1 << one.number());
        self.command(&format!("M120 P{wires}"))?;
        Ok(())
    }

    /// The count of the timer that captures edges.
    pub(crate) fn count(&mut self) -> Result<u32, Failure> {
        let heard = self.command("M122")?;
        let mut counts = heard
            .iter()
            .filter_map(|line| line.strip_prefix("[COUNT:")?.strip_suffix(']'));
        let count = counts
            .next_back()
            .and_then(|word| u32::from_str_radix(word, 16).ok());
        count.ok_or_else(|| Failure(format!("no count in {heard:?}")))
    }

    /// The edges that have been captured since [`Board::capture`].
    pub(crate) fn edges(&mut self, signal: Signal) -> Result<Edges, Failure> {
        let wire = signal.number();
        let first = self.command(&format!("M121 P{wire} L0"))?;
        let mut edges = Edges::read(&first, signal)?;
        let rest: String = (PER_LINE..edges.all)
            .step_by(PER_LINE)
            .map(|from| format!("M121 P{wire} L{from}\n"))
            .collect();
        for line in self.stream(&rest)? {
            edges.add(&line)?;
        }
        edges.ensure_whole()?;
        Ok(edges)
    }
}
