//! A second client that asks for the machine's state while a sender works.

use crate::failure::Failure;
use std::{
    io::{self, BufRead, BufReader, Write},
    net::TcpStream,
    sync::{
        atomic::{AtomicBool, Ordering},
        Arc,
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

/// The time between two status queries.
const POLL: Duration = Duration::from_millis(10);

/// The longest time that an answer may take on a busy computer.
const PATIENCE: Duration = Duration::from_secs(5);

/// The parts of a status report that are checked.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Sight {
    /// The state with its sub-state, for example `Hold:0`.
    pub(super) state: String,
    /// Machine position, mm.
    pub(super) position: Vec<f64>,
}

/// The things that the observer saw after the sender had gone.
#[derive(Debug)]
pub(super) struct Rest {
    /// The sight at rest.
    pub(super) last: Sight,
    /// The sight after the observer had asked for a move of a millimetre in X; `None` if the
    /// machine refused the move.
    pub(super) moved: Option<Sight>,
}

/// Asks for the state in a thread of its own. The server's log has the answers.
pub(super) struct Observer {
    gone: Arc<AtomicBool>,
    thread: JoinHandle<io::Result<Rest>>,
}

impl Observer {
    /// Begins to watch the machine at `address`.
    pub(super) fn start(address: &str) -> Result<Self, Failure> {
        let stream = TcpStream::connect(address).map_err(Failure::file(address))?;
        let gone = Arc::new(AtomicBool::new(false));
        let told = gone.clone();
        let thread = thread::spawn(move || Watch::new(stream)?.watch(&told));
        Ok(Self { gone, thread })
    }

    /// To be called when the sender has gone: waits for rest, and asks for a move.
    pub(super) fn finish(self) -> Result<Rest, Failure> {
        self.gone.store(true, Ordering::Relaxed);
        let joined = self.thread.join();
        let rest = joined.map_err(|_| Failure::finding("the observer has panicked"))?;
        rest.map_err(Failure::file("the observer's line"))
    }
}

struct Watch {
    to: TcpStream,
    from: BufReader<TcpStream>,
}

impl Watch {
    fn new(to: TcpStream) -> io::Result<Self> {
        to.set_nodelay(true)?;
        to.set_read_timeout(Some(PATIENCE))?;
        let from = BufReader::new(to.try_clone()?);
        Ok(Self { to, from })
    }

    fn watch(mut self, gone: &AtomicBool) -> io::Result<Rest> {
        while !gone.load(Ordering::Relaxed) {
            self.look()?;
            thread::sleep(POLL);
        }
        let last = self.rest()?;
        let moved = self.say("G91 G0 X1")?.then(|| self.rest()).transpose()?;
        Ok(Rest { last, moved })
    }

    /// The next report that shows no motion. If motion does not end in time, the last report.
    fn rest(&mut self) -> io::Result<Sight> {
        let until = Instant::now() + PATIENCE;
        loop {
            let sight = self.look()?;
            if !matches!(&*sight.state, "Run" | "Jog" | "Home") || Instant::now() > until {
                return Ok(sight);
            }
            thread::sleep(POLL);
        }
    }

    fn look(&mut self) -> io::Result<Sight> {
        self.to.write_all(b"?")?;
        loop {
            if let Some(sight) = Sight::read(&self.line()?) {
                return Ok(sight);
            }
        }
    }

    /// Sends a line. Returns whether it was accepted.
    fn say(&mut self, line: &str) -> io::Result<bool> {
        writeln!(self.to, "{line}")?;
        loop {
            let answer = self.line()?;
            if answer == "ok" || answer.starts_with("error") {
                return Ok(answer == "ok");
            }
        }
    }

    fn line(&mut self) -> io::Result<String> {
        let mut line = String::new();
        if self.from.read_line(&mut line)? == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(line.trim_end().to_owned())
    }
}

impl Sight {
    /// Reads a status report.
    pub(super) fn read(line: &str) -> Option<Self> {
        let mut fields = line.strip_prefix('<')?.strip_suffix('>')?.split('|');
        let state = fields.next()?.to_owned();
        let place = fields.find_map(|field| field.strip_prefix("MPos:"))?;
        let position: Result<Vec<f64>, _> = place.split(',').map(str::parse).collect();
        let position = position.ok()?;
        Some(Self { state, position })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_is_taken_apart_and_nothing_else_is_one() {
        let seen = Sight::read("<Hold:0|MPos:1.500,-2.000,0.000|FS:0,0>").unwrap();
        assert_eq!(
            (&*seen.state, seen.position),
            ("Hold:0", vec![1.5, -2.0, 0.0])
        );
        assert_eq!(Sight::read("ok"), None);
        assert_eq!(Sight::read("<Idle|WPos:1,2,3>"), None);
    }
}
