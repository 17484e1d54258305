//! The serial line to the board: a port of this computer, or the line of an emulated board.
use crate::failure::Failure;
use serial2::SerialPort;
use std::{
    io::ErrorKind,
    time::{Duration, Instant},
};

/// The rate of the self-test's line, baud, unless it is built for another.
pub(crate) const BAUD: u32 = 1_000_000;
/// The time that one look at the line may take.
const LOOK: Duration = Duration::from_millis(5);

/// The line, and a clock at this end of it.
pub(crate) trait Link {
    /// Sends bytes.
    ///
    /// # Errors
    /// The line is gone.
    fn send(&mut self, bytes: &[u8]) -> Result<(), Failure>;

    /// The bytes that have come; waits a little if none have.
    ///
    /// # Errors
    /// The line is gone, or the emulated program has gone astray.
    fn receive(&mut self) -> Result<Vec<u8>, Failure>;

    /// The time of a clock that is independent of the board, s.
    fn seconds(&self) -> f64;

    /// The name of the line, for the report.
    fn name(&self) -> String;
}

/// A serial port of this computer.
pub(crate) struct Port {
    port: SerialPort,
    name: String,
    began: Instant,
}

impl Port {
    /// Opens the port: 8 bits, no parity, one stop bit.
    ///
    /// # Errors
    /// It cannot be opened, or not at this rate: the message names the port and the rate.
    pub(crate) fn open(name: &str, baud: u32) -> Result<Self, Failure> {
        let unopened = |error| Failure(format!("{name}, {baud} baud: {error}"));
        let port = SerialPort::open(name, baud).map_err(unopened)?;
        Port::of(port, format!("{name}, {baud} baud")).map_err(unopened)
    }

    fn of(mut port: SerialPort, name: String) -> Result<Self, std::io::Error> {
        port.set_read_timeout(LOOK)?;
        Ok(Port {
            port,
            name,
            began: Instant::now(),
        })
    }
}

impl Link for Port {
    fn send(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        Ok(self.port.write_all(bytes)?)
    }

    fn receive(&mut self) -> Result<Vec<u8>, Failure> {
        let mut bytes = [0; 4096];
        match self.port.read(&mut bytes) {
            Ok(count) => Ok(bytes[..count].to_vec()),
            Err(error) if error.kind() == ErrorKind::TimedOut => Ok(Vec::new()),
            Err(error) => Err(error.into()),
        }
    }

    fn seconds(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    fn name(&self) -> String {
        self.name.clone()
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_port_sends_receives_and_waits_no_longer_than_a_look() {
        let (ours, board) = SerialPort::pair().unwrap();
        let mut port = Port::of(ours, "a pair".into()).unwrap();
        assert!(port.receive().unwrap().is_empty());
        port.send(b"$I\n").unwrap();
        let mut heard = [0; 3];
        board.read_exact(&mut heard).unwrap();
        assert_eq!(&heard, b"$I\n");
        board.write_all(b"ok\r\n").unwrap();
        assert_eq!(port.receive().unwrap(), b"ok\r\n");
    }

    #[test]
    fn a_port_that_is_not_there_is_named() {
        let error = Port::open("/dev/no-such-port", BAUD).err().unwrap();
        assert!(
            error.0.starts_with("/dev/no-such-port, 1000000 baud: "),
            "{error}"
        );
    }
}
