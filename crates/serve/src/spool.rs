//! Text on its way to an output that may block: a pipe that nobody reads, a terminal behind a
//! stalled connection.

use std::io::{self, Write};
use std::sync::mpsc::{self, Receiver, SyncSender, TrySendError};
use std::time::Duration;

/// The time that the program's end waits for unwritten text.
const PARTING: Duration = Duration::from_millis(500);

/// Hands text to a thread that writes it; never waits itself. Text that is flushed together is
/// written completely or not at all.
pub(super) struct Spool {
    begun: Vec<u8>,
    /// `None` once the spool ends.
    pieces: Option<SyncSender<Vec<u8>>>,
    /// Gives the failure that ended the thread; disconnects when it has written everything.
    ended: Receiver<io::Error>,
}

impl Spool {
    /// Makes a spool in which at most `room` pieces of text wait.
    pub(super) fn new(mut to: impl Write + Send + 'static, room: usize) -> Self {
        let (pieces, waiting) = mpsc::sync_channel::<Vec<u8>>(room);
        let (end, ended) = mpsc::channel();
        std::thread::spawn(move || {
            for piece in waiting {
                if let Err(error) = to.write_all(&piece).and_then(|()| to.flush()) {
                    // If nobody flushes any more, nobody asks.
                    let _ = end.send(error);
                    return;
                }
            }
        });
        Self {
            begun: Vec::new(),
            pieces: Some(pieces),
            ended,
        }
    }
}

impl Write for Spool {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.begun.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    /// # Errors
    /// `WouldBlock` if there is no room: the text since the last flush is thrown away.
    /// The failure of the output, once; then `BrokenPipe`.
    fn flush(&mut self) -> io::Result<()> {
        let piece = std::mem::take(&mut self.begun);
        let Some(pieces) = &self.pieces else {
            return Err(io::ErrorKind::BrokenPipe.into());
        };
        pieces.try_send(piece).map_err(|error| match error {
            TrySendError::Full(_) => io::ErrorKind::WouldBlock.into(),
            TrySendError::Disconnected(_) => {
                let failure = self.ended.try_recv();
                failure.unwrap_or_else(|_| io::ErrorKind::BrokenPipe.into())
            }
        })
    }
}

impl Drop for Spool {
    fn drop(&mut self) {
        // What was begun is written as well, if there is room.
        let _ = self.flush();
        self.pieces = None;
        // Whether the thread has ended or time has run out makes no difference: the program ends.
        let _ = self.ended.recv_timeout(PARTING);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{pipe, Read};
    use std::time::Instant;

    #[test]
    fn what_was_flushed_is_written_before_the_end() {
        let (mut read, write) = pipe().unwrap();
        let mut spool = Spool::new(write, 100);
        for number in 0..100 {
            writeln!(spool, "{number}").unwrap();
            spool.flush().unwrap();
        }
        drop(spool);
        let mut text = String::new();
        read.read_to_string(&mut text).unwrap();
        assert!((0..100).map(|number| number.to_string()).eq(text.lines()));
    }

    #[test]
    fn nothing_waits_for_an_output_that_nobody_reads() {
        let (_unread, write) = pipe().unwrap();
        let mut spool = Spool::new(write, 2);
        let begun = Instant::now();
        let mut lost = 0;
        for _ in 0..10 {
            spool.write_all(&[b'x'; 1 << 20]).unwrap();
            lost += usize::from(spool.flush().is_err());
        }
        drop(spool);
        assert!(lost >= 7, "{lost}");
        assert!(begun.elapsed() < 4 * PARTING);
    }
}
