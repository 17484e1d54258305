//! A readable log of the bytes on the lines, with times.
//!
//! ```text
//!     12.034567 0 < G1X10F600          seconds since power-up, line, to the machine
//!     12.034981 0 < ?                  a realtime byte stands alone, wherever it came, and
//!                                      without the 0xC2 that a sender may write before it
//!     12.035202 0 > <Run|MPos:0.125,0.000,0.000|FS:600,0>
//!     12.040000 0 . a client has gone
//! ```

use super::spool::Spool;
use leadscrew_machine::protocol::realtime::{Byte, Sorter};
use leadscrew_sim::clock::Cycle;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::{self, Write};

/// The longest piece of text without a line end, in bytes; longer text is cut.
const LONGEST: usize = 512;

/// Pieces of the log, one each 100 ms, that may wait for a slow disk.
const PIECES: usize = 100;

/// The direction of bytes on a line.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Way {
    /// From a client to the machine.
    ToMachine,
    /// From the machine to a client.
    FromMachine,
}

impl Way {
    fn sign(self) -> char {
        match self {
            Self::ToMachine => '<',
            Self::FromMachine => '>',
        }
    }
}

/// Writes the bytes of the lines to a log.
pub struct WireLog {
    to: Box<dyn Write + Send>,
    /// The bytes of unfinished lines.
    begun: BTreeMap<(usize, Way), Vec<u8>>,
    /// One for each line, of the bytes to the machine.
    sorters: BTreeMap<usize, Sorter>,
}

impl WireLog {
    /// Makes a log. It never waits: if `to` takes nothing for long, the log ends.
    pub fn new(to: impl Write + Send + 'static) -> Self {
        Self::on(Spool::new(to, PIECES))
    }

    fn on(to: impl Write + Send + 'static) -> Self {
        Self {
            to: Box::new(to),
            begun: BTreeMap::new(),
            sorters: BTreeMap::new(),
        }
    }

    /// Logs bytes of a line.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn bytes(&mut self, now: Cycle, line: usize, way: Way, bytes: &[u8]) -> io::Result<()> {
        for byte in bytes {
            match way {
                Way::FromMachine => self.ordinary(now, line, way, *byte)?,
                Way::ToMachine => match self.sorters.entry(line).or_default().sort(*byte) {
                    Byte::Ordinary(_) | Byte::Unknown => self.ordinary(now, line, way, *byte)?,
                    Byte::Realtime(_) => self.realtime(now, line, *byte)?,
                },
            }
        }
        Ok(())
    }

    /// Logs a realtime byte in a row of its own, without the 0xC2 that came before it.
    fn realtime(&mut self, now: Cycle, line: usize, byte: u8) -> io::Result<()> {
        let begun = self.begun.entry((line, Way::ToMachine)).or_default();
        if byte >= 0x80 && begun.last() == Some(&0xC2) {
            begun.pop();
        }
        self.row(now, line, Way::ToMachine.sign(), &escape(&[byte]))
    }

    /// Logs an event on a line.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn event(&mut self, now: Cycle, line: usize, what: &impl Display) -> io::Result<()> {
        self.row(now, line, '.', &what.to_string())
    }

    /// Flushes everything to the file.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }

    fn ordinary(&mut self, now: Cycle, line: usize, way: Way, byte: u8) -> io::Result<()> {
        let begun = self.begun.entry((line, way)).or_default();
        begun.push(byte);
        let ended = match way {
            Way::ToMachine => matches!(byte, b'\r' | b'\n'),
            Way::FromMachine => byte == b'\n',
        };
        if !ended && begun.len() < LONGEST {
            return Ok(());
        }
        let text = escape(&std::mem::take(begun));
        self.row(now, line, way.sign(), &text)
    }

    fn row(&mut self, now: Cycle, line: usize, sign: char, text: &str) -> io::Result<()> {
        writeln!(self.to, "{:13.6} {line} {sign} {text}", now.seconds())
    }
}

/// Bytes as text. A line end (LF from a client, CR LF from the machine) is left out; other control
/// bytes are escaped.
fn escape(bytes: &[u8]) -> String {
    let text = bytes.strip_suffix(b"\n").unwrap_or(bytes);
    let text = text
        .strip_suffix(b"\r")
        .filter(|_| bytes.ends_with(b"\n"))
        .unwrap_or(text);
    let spell = |byte: &u8| match byte {
        b' '..=b'~' => char::from(*byte).to_string(),
        _ => std::ascii::escape_default(*byte).to_string(),
    };
    text.iter().map(spell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};

    #[derive(Clone, Default)]
    struct Paper(Arc<Mutex<Vec<u8>>>);

    impl Write for Paper {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn lines_are_whole_and_realtime_bytes_stand_alone() {
        let paper = Paper::default();
        let mut log = WireLog::on(paper.clone());
        let at = |millis: u64| Cycle::from_micros(millis * 1000);
        log.event(at(0), 1, &"a client has come").unwrap();
        log.bytes(at(1), 1, Way::ToMachine, b"G1X?1").unwrap();
        log.bytes(at(2), 0, Way::FromMachine, b"o").unwrap();
        log.bytes(at(3), 1, Way::ToMachine, b"0\r\n\xC2\x91")
            .unwrap();
        log.bytes(at(4), 0, Way::FromMachine, b"k\r\n").unwrap();
        log.bytes(at(5), 1, Way::ToMachine, "(\u{c4})\n".as_bytes())
            .unwrap();
        let expected = "     0.000000 1 . a client has come\n     \
                             0.001000 1 < ?\n     \
                             0.003000 1 < G1X10\\r\n     \
                             0.003000 1 < \n     \
                             0.003000 1 < \\x91\n     \
                             0.004000 0 > ok\n     \
                             0.005000 1 < (\\xc3\\x84)\n";
        assert_eq!(
            String::from_utf8(std::mem::take(&mut *paper.0.lock().unwrap())).unwrap(),
            expected
        );
    }

    #[test]
    fn a_line_without_end_is_cut_and_not_kept() {
        let paper = Paper::default();
        let mut log = WireLog::on(paper.clone());
        log.bytes(Cycle(0), 0, Way::ToMachine, &[b'x'; 1300])
            .unwrap();
        let written = std::mem::take(&mut *paper.0.lock().unwrap());
        assert_eq!(written.iter().filter(|byte| **byte == b'\n').count(), 2);
        assert_eq!(written.iter().filter(|byte| **byte == b'x').count(), 1024);
    }
}
