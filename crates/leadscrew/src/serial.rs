//! The serial line: bytes of a sender to the machine, and answers back.
//!
//! There are three ways to drive it. An interrupt calls [`Serial::receive`] and
//! [`Serial::next_to_send`]. A loop calls [`Serial::exchange`] with a line of `embedded-io`. A task
//! awaits [`Serial::pump`] with the two halves of a line of `embedded-io-async`.

use crate::words::Bells;
use core::sync::atomic::Ordering;
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use heapless::{spsc::Consumer, Deque};
use leadscrew_machine::protocol::realtime::Realtime;
use leadscrew_machine::protocol::serial::Receiver;

/// The end of the serial line that belongs to the board.
pub struct Serial<'a> {
    listener: Listener<'a>,
    speaker: Speaker<'a>,
}

/// The half of a [`Serial`] that takes received bytes.
pub struct Listener<'a> {
    receiver: Receiver<'a>,
    bells: &'a Bells,
}

/// The half of a [`Serial`] that has bytes to send.
pub struct Speaker<'a> {
    wire: Consumer<'a, u8>,
    /// Bytes from the wire that the line has not taken yet.
    held: Deque<u8, CHUNK>,
    bells: &'a Bells,
}

/// Bytes that are read from a line or written to it at once.
const CHUNK: usize = 32;

impl<'a> Serial<'a> {
    pub(crate) fn new(receiver: Receiver<'a>, wire: Consumer<'a, u8>, bells: &'a Bells) -> Self {
        Self {
            listener: Listener { receiver, bells },
            speaker: Speaker {
                wire,
                held: Deque::new(),
                bells,
            },
        }
    }

    /// Takes a received byte, and wakes the main loop. See [`Listener::receive`].
    pub fn receive(&mut self, byte: u8) -> Option<Realtime> {
        self.listener.receive(byte)
    }

    /// Takes the next byte to send, if there is one. See [`Speaker::next_to_send`].
    pub fn next_to_send(&mut self) -> Option<u8> {
        self.speaker.next_to_send()
    }

    /// Parts the line, for two interrupts or two tasks.
    pub fn split(self) -> (Listener<'a>, Speaker<'a>) {
        (self.listener, self.speaker)
    }

    /// Reads what has come and sends what `line` has room for. Never waits. Call it in each turn of
    /// the main loop, or from the line's interrupt.
    ///
    /// # Errors
    /// The line's. A byte that could not be read is counted as lost; the rest stays to be sent.
    pub fn exchange<L>(&mut self, line: &mut L) -> Result<(), L::Error>
    where
        L: ErrorType + Read + ReadReady + Write + WriteReady,
    {
        while line.read_ready()? {
            let mut bytes = [0; CHUNK];
            match line.read(&mut bytes) {
                Ok(0) => break,
                Ok(count) => self.listener.receive_all(bytes.iter().take(count)),
                Err(error) => {
                    self.listener.receiver.lose(1);
                    return Err(error);
                }
            }
        }
        while line.write_ready()? {
            let bytes = self.speaker.waiting();
            if bytes.is_empty() {
                break;
            }
            let count = line.write(bytes)?;
            self.speaker.sent(count);
        }
        Ok(())
    }

    /// Moves bytes both ways, until the line fails.
    ///
    /// A task of its own. Bytes wake the machine, answers wake this task. Dropping the future loses
    /// no byte that was taken from the line.
    ///
    /// # Errors
    /// The line's first error; its read half may be at the end ([`LineError::End`]). Bytes that
    /// could not be read are counted as lost. Call it again to go on.
    #[cfg(feature = "async")]
    pub async fn pump<R, W>(
        &mut self,
        reader: &mut R,
        writer: &mut W,
    ) -> Result<core::convert::Infallible, LineError<R::Error, W::Error>>
    where
        R: embedded_io_async::Read,
        W: embedded_io_async::Write,
    {
        let Self { listener, speaker } = self;
        let listen = core::pin::pin!(listener.listen(reader));
        let speak = core::pin::pin!(speaker.speak(writer));
        let (mut listen, mut speak) = (listen, speak);
        core::future::poll_fn(|context| {
            use core::{future::Future, task::Poll};
            if let Poll::Ready(end) = listen.as_mut().poll(context) {
                return Poll::Ready(Err(end.map_or_else(LineError::Read, |()| LineError::End)));
            }
            match speak.as_mut().poll(context) {
                Poll::Ready(error) => Poll::Ready(Err(LineError::Write(error))),
                Poll::Pending => Poll::Pending,
            }
        })
        .await
    }
}

impl Listener<'_> {
    /// Takes a received byte, and wakes the main loop. Serial interrupt or task; bounded.
    ///
    /// Returns the realtime command if the byte is one, for a board that wants to act at once; the
    /// machine gets the command in any case.
    pub fn receive(&mut self, byte: u8) -> Option<Realtime> {
        let realtime = self.receiver.receive(byte);
        self.bells.machine.ring();
        realtime
    }

    /// Notes that bytes were lost before they came here: an overrun, a framing error.
    pub fn lose(&mut self, bytes: u32) {
        self.receiver.lose(bytes);
    }

    /// Notes that somebody has opened the other end, as over USB.
    pub fn open(&mut self) {
        self.receiver.open();
        self.bells.machine.ring();
    }

    /// Notes that the other end has gone away, as over USB.
    pub fn close(&mut self) {
        self.receiver.close();
        self.bells.machine.ring();
    }

    fn receive_all<'b>(&mut self, bytes: impl Iterator<Item = &'b u8>) {
        for byte in bytes {
            self.receiver.receive(*byte);
        }
        self.bells.machine.ring();
    }

    /// Receives until the line ends or fails.
    #[cfg(feature = "async")]
    async fn listen<R: embedded_io_async::Read>(&mut self, line: &mut R) -> Result<(), R::Error> {
        loop {
            let mut bytes = [0; CHUNK];
            match line.read(&mut bytes).await {
                Ok(0) => return Ok(()),
                Ok(count) => self.receive_all(bytes.iter().take(count)),
                Err(error) => {
                    self.receiver.lose(1);
                    return Err(error);
                }
            }
        }
    }
}

impl Speaker<'_> {
    /// Takes the next byte to send, if there is one. Serial interrupt or task.
    pub fn next_to_send(&mut self) -> Option<u8> {
        self.waiting();
        self.held.pop_front()
    }

    /// Bytes to send, if there are any.
    fn waiting(&mut self) -> &[u8] {
        while !self.held.is_full() {
            let Some(byte) = self.wire.dequeue() else {
                break;
            };
            // There is room for it.
            let _ = self.held.push_back(byte);
        }
        self.wake_writer();
        self.held.as_slices().0
    }

    /// Takes `count` bytes away, which were sent.
    fn sent(&mut self, count: usize) {
        for _ in 0..count {
            self.held.pop_front();
        }
    }

    /// Wakes the main loop if it waits for room on the wire.
    fn wake_writer(&self) {
        if self.bells.wire_is_full.load(Ordering::Acquire) {
            self.bells.wire_is_full.store(false, Ordering::Relaxed);
            self.bells.machine.ring();
        }
    }

    /// Sends until the line fails.
    #[cfg(feature = "async")]
    async fn speak<W: embedded_io_async::Write>(&mut self, line: &mut W) -> W::Error {
        loop {
            self.bells.wire.clear();
            loop {
                let bytes = self.waiting();
                if bytes.is_empty() {
                    break;
                }
                match line.write(bytes).await {
                    Ok(count) => self.sent(count),
                    Err(error) => return error,
                }
            }
            if let Err(error) = line.flush().await {
                return error;
            }
            self.bells.wire.heard().await;
        }
    }
}

/// The reason why [`Serial::pump`] has ended.
#[cfg(feature = "async")]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum LineError<R, W> {
    /// The line has no more bytes: its other end was closed.
    End,
    /// Reading failed.
    Read(R),
    /// Writing failed.
    Write(W),
}

#[cfg(feature = "async")]
impl<R: core::fmt::Debug, W: core::fmt::Debug> core::fmt::Display for LineError<R, W> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::End => f.write_str("the serial line is at its end: await a new one, and pump it"),
            Self::Read(error) => write!(f, "the serial line cannot be read: {error:?}; pump again"),
            Self::Write(error) => {
                write!(
                    f,
                    "the serial line cannot be written: {error:?}; pump again"
                )
            }
        }
    }
}

#[cfg(feature = "async")]
impl<R: core::fmt::Debug, W: core::fmt::Debug> core::error::Error for LineError<R, W> {}
