//! The host at the other end of the cable. It sets a serial device up as an operating system does
//! (USB 2.0 chapter 9, CDC 1.2), and then moves a program's bytes both ways.
//!
//! ```text
//!   Alone --pull-up--> Seen --100 ms--> Resetting --10 ms--> Asking, request by request --> Talking
//!     ^                                                                                        |
//!     +------------------ Leaving, 3 ms (the device notices) <-------- cable pulled -----------+
//! ```
//!
//! The host is as strict as an operating system may be: it refuses a device whose descriptors state
//! wrong lengths or counts, and one that sends more than it was asked for.
//!
//! A transaction takes the time of its bytes at 12 Mbit/s. After a refused transaction the host
//! makes the next one at once, which may go in the other direction. After two refusals in a row it
//! waits a little. DTR is never set.
use super::{
    descriptors::{self, Fault},
    Answer, Usb,
};
use crate::peripheral::NEVER;
use std::collections::VecDeque;

/// The bytes of a transaction besides its data, including the times between packets (USB 2.0 table
/// 5-9).
const OVERHEAD: u64 = 13;
/// The bit rate, bits/s.
const BIT_RATE: u64 = 12_000_000;
/// The time from the pull-up to the reset, the length of the reset, and the time from its end to
/// the first request, µs (USB 2.0 section 7.1.7.3 and 7.1.7.5: TATTDB, TDRST, TRSTRCY).
const DEBOUNCE: u64 = 100_000;
const RESET: u64 = 10_000;
const RECOVERY: u64 = 10_000;
/// The time for a device to take its address, µs (section 9.2.6.3).
const ADDRESSING: u64 = 2_000;
/// The silence after which the controller reports that it is suspended, µs. The bus is suspended
/// after 3 ms (section 7.1.7.6), which causes an early warning, and the interrupt comes 3 ms later
/// (RM0090 section 34.5.2).
const SILENCE: u64 = 6_000;
/// The time between two looks for a pull-up, µs.
const LOOK: u64 = 1_000;
/// The pause after two refusals, µs.
const PAUSE: u64 = 10;
/// The packet size of a full-speed bulk endpoint, bytes.
const PACKET: usize = 64;
/// The device's address.
const ADDRESS: u8 = 5;

/// A control transfer.
#[derive(Clone, Copy, Debug)]
struct Request {
    setup: [u8; 8],
    /// The data that the host sends with it.
    data: &'static [u8],
}

const fn request(setup: [u8; 8]) -> Request {
    Request { setup, data: &[] }
}

impl Request {
    fn reads(&self) -> bool {
        self.setup[0] & 0x80 != 0
    }

    fn length(&self) -> usize {
        usize::from(u16::from_le_bytes([self.setup[6], self.setup[7]]))
    }

    fn sets_address(&self) -> bool {
        self.setup[..2] == [0, 5]
    }
}

/// The requests in order: device descriptor (its first packet), set address, device descriptor,
/// configuration descriptor (its head, then all of it), set configuration 1, set 115200 baud. The
/// strings that the device names are asked for behind the configuration.
const REQUESTS: [Request; 7] = [
    request([0x80, 6, 0, 1, 0, 0, 64, 0]),
    request([0, 5, ADDRESS, 0, 0, 0, 0, 0]),
    request([0x80, 6, 0, 1, 0, 0, 18, 0]),
    request([0x80, 6, 0, 2, 0, 0, 9, 0]),
    request([0x80, 6, 0, 2, 0, 0, 255, 0]),
    request([0, 9, 1, 0, 0, 0, 0, 0]),
    Request {
        setup: [0x21, 0x20, 0, 0, 0, 0, 7, 0],
        data: &[0x00, 0xC2, 0x01, 0x00, 0, 0, 8],
    },
];
/// The requests whose answers are the device's descriptor, and the configuration that names the
/// endpoints.
const DEVICE: usize = 2;
const CONFIGURATION: usize = 4;
/// English of the United States, the language in which strings are asked for.
const LANGUAGE: [u8; 2] = 0x0409u16.to_le_bytes();

/// The request for a string; number 0 is the list of languages.
const fn string(number: u8) -> Request {
    let language = if number == 0 { [0, 0] } else { LANGUAGE };
    request([0x80, 6, number, 3, language[0], language[1], 255, 0])
}

/// The phase of a control transfer.
#[derive(Clone, PartialEq, Eq, Debug)]
enum Phase {
    Setup,
    Data(Vec<u8>),
    Status(Vec<u8>),
}

#[derive(Clone, PartialEq, Eq, Debug)]
enum Stage {
    Alone,
    Seen,
    Resetting,
    Asking {
        request: usize,
        phase: Phase,
    },
    Talking {
        input: usize,
        output: usize,
    },
    /// The device does not keep the rules: the host leaves it alone.
    Refused,
    Leaving,
}

/// The host and the program that uses it.
#[derive(Clone, Debug)]
pub(crate) struct Host {
    plugged: bool,
    /// True if the program reads the received bytes.
    pub(crate) reads: bool,
    stage: Stage,
    next: u64,
    hclk: u64,
    address: u8,
    /// True if the next transaction is OUT, if there are bytes to send.
    sends_next: bool,
    /// True if the last transaction was refused.
    refused: bool,
    /// The bytes that the program has still to send, and the bytes that were received for it.
    pub(crate) to_send: VecDeque<u8>,
    pub(crate) received: Vec<u8>,
    /// The requests of the device that has appeared.
    requests: Vec<Request>,
    /// The reason why the host has refused the device.
    pub(crate) refusal: Fault,
    /// The device's answer to each request since it last appeared.
    pub(crate) answers: Vec<Vec<u8>>,
}

impl Default for Host {
    fn default() -> Self {
        Host {
            plugged: false,
            reads: true,
            stage: Stage::Alone,
            next: NEVER,
            hclk: 1,
            address: 0,
            sends_next: false,
            refused: false,
            to_send: VecDeque::new(),
            received: Vec::new(),
            requests: REQUESTS.to_vec(),
            refusal: None,
            answers: Vec::new(),
        }
    }
}

impl Host {
    /// Plugs the cable in or pulls it out.
    pub(crate) fn plug(&mut self, plugged: bool, now: u64) {
        self.plugged = plugged;
        self.to_send.clear();
        if plugged {
            self.go_on(Stage::Alone, now);
        } else {
            self.go_on(Stage::Leaving, now + self.micros(SILENCE));
        }
    }

    /// Returns true if the program can send and receive.
    pub(crate) fn is_talking(&self) -> bool {
        matches!(self.stage, Stage::Talking { .. })
    }

    pub(crate) fn set_hclk(&mut self, hclk: u32) {
        self.hclk = u64::from(hclk);
    }

    /// The chip was reset: the pull-up is gone.
    pub(super) fn device_gone(&mut self, now: u64) {
        let next = if self.plugged { now } else { NEVER };
        self.go_on(Stage::Alone, next);
    }

    fn go_on(&mut self, stage: Stage, next: u64) {
        self.stage = stage;
        self.next = next;
    }

    fn micros(&self, micros: u64) -> u64 {
        self.hclk * micros / 1_000_000
    }

    /// Cycles of a transaction with this number of bytes of data.
    fn transaction(&self, bytes: usize) -> u64 {
        (OVERHEAD + bytes as u64) * 8 * self.hclk / BIT_RATE
    }
}

impl Usb {
    /// The cycle of the host's next action.
    pub(crate) fn next_event(&self) -> u64 {
        self.host.next
    }

    /// Lets the host act.
    pub(crate) fn event(&mut self, now: u64) {
        let gone = !self.is_attached();
        let stage = core::mem::replace(&mut self.host.stage, Stage::Alone);
        let (stage, wait) = match stage {
            Stage::Leaving => {
                self.bus_idle();
                self.host.next = NEVER;
                return;
            }
            _ if gone => (Stage::Alone, self.host.micros(LOOK)),
            Stage::Alone => (Stage::Seen, self.host.micros(DEBOUNCE)),
            Stage::Seen => {
                self.bus_reset();
                self.host.answers.clear();
                self.host.requests = REQUESTS.to_vec();
                self.host.refusal = None;
                self.host.address = 0;
                (Stage::Resetting, self.host.micros(RESET))
            }
            Stage::Resetting => {
                self.bus_ready();
                (asking(0), self.host.micros(RECOVERY))
            }
            Stage::Asking { request, phase } => self.ask(request, phase),
            Stage::Talking { input, output } => {
                let wait = self.talk(input, output);
                (Stage::Talking { input, output }, wait)
            }
            Stage::Refused => (Stage::Refused, self.host.micros(LOOK)),
        };
        self.host.go_on(stage, now + wait.max(1));
    }

    /// Makes a transaction of a control transfer. Returns the next stage, and the cycles until
    /// then.
    fn ask(&mut self, number: usize, phase: Phase) -> (Stage, u64) {
        let request = self.host.requests[number];
        let address = self.host.address;
        let (answer, bytes) = match &phase {
            Phase::Setup => (self.setup(address, &request.setup), 8),
            Phase::Data(_) if request.reads() => (self.r#in(address, 0), PACKET),
            Phase::Data(_) => (self.out(address, 0, request.data), request.data.len()),
            Phase::Status(_) if request.reads() => (self.out(address, 0, &[]), 0),
            Phase::Status(_) => (self.r#in(address, 0), 0),
        };
        let wait = self.host.transaction(bytes);
        let data = match answer {
            Answer::Ack(data) => data,
            Answer::Nak | Answer::Stall | Answer::Nothing => {
                let again = Stage::Asking {
                    request: number,
                    phase,
                };
                return (again, self.host.micros(PAUSE));
            }
        };
        let phase = match phase {
            Phase::Setup if request.length() == 0 => Phase::Status(Vec::new()),
            Phase::Setup => Phase::Data(Vec::new()),
            Phase::Data(mut all) => {
                let last = data.len() < PACKET;
                all.extend(data);
                if !request.reads() || last || all.len() >= request.length() {
                    Phase::Status(all)
                } else {
                    Phase::Data(all)
                }
            }
            Phase::Status(all) => return self.answered(number, all, wait),
        };
        let stage = Stage::Asking {
            request: number,
            phase,
        };
        (stage, wait)
    }

    /// Ends a control transfer. Returns the next stage, and the cycles until then.
    fn answered(&mut self, number: usize, all: Vec<u8>, wait: u64) -> (Stage, u64) {
        let request = self.host.requests[number];
        let fault = match request.length() {
            length if request.reads() && all.len() > length => Some("no more than was asked for"),
            _ => check(&request, number, &all),
        };
        if fault.is_some() {
            self.host.answers.push(all);
            self.host.refusal = fault;
            return (Stage::Refused, wait);
        }
        if number == DEVICE {
            let mut numbers: Vec<u8> = descriptors::strings(&all).collect();
            // A device without strings has no list of their languages.
            if !numbers.is_empty() {
                numbers.insert(0, 0);
            }
            let place = CONFIGURATION + 1;
            let strings = numbers.into_iter().map(string);
            self.host.requests.splice(place..place, strings);
        }
        self.host.answers.push(all);
        let wait = match request.sets_address() {
            true => {
                self.host.address = ADDRESS;
                self.host.micros(ADDRESSING)
            }
            false => wait,
        };
        if number + 1 < self.host.requests.len() {
            return (asking(number + 1), wait);
        }
        let (input, output) = bulk_endpoints(&self.host.answers[CONFIGURATION]);
        (Stage::Talking { input, output }, wait)
    }

    /// Makes a transaction of the program, OUT and IN alternately.
    fn talk(&mut self, input: usize, output: usize) -> u64 {
        let (has_bytes, reads) = (!self.host.to_send.is_empty(), self.host.reads);
        if !has_bytes && !reads {
            return self.host.micros(PAUSE);
        }
        let sends = has_bytes && (self.host.sends_next || !reads);
        self.host.sends_next = !sends;
        let packet: Vec<u8> = match sends {
            true => self.host.to_send.iter().take(PACKET).copied().collect(),
            false => Vec::new(),
        };
        let answer = match sends {
            true => self.out(ADDRESS, output, &packet),
            false => self.r#in(ADDRESS, input),
        };
        match answer {
            Answer::Ack(data) => {
                self.host.refused = false;
                self.host.to_send.drain(..packet.len());
                let wait = self.host.transaction(packet.len() + data.len());
                self.host.received.extend(data);
                wait
            }
            Answer::Nak | Answer::Stall | Answer::Nothing => {
                match core::mem::replace(&mut self.host.refused, true) {
                    true => self.host.micros(PAUSE),
                    false => self.host.transaction(packet.len()),
                }
            }
        }
    }
}

fn asking(request: usize) -> Stage {
    Stage::Asking {
        request,
        phase: Phase::Setup,
    }
}

/// Checks the answer to a request for a descriptor.
fn check(request: &Request, number: usize, answer: &[u8]) -> Fault {
    match (request.setup[..2] == [0x80, 6], request.setup[3], number) {
        (true, 1, _) => descriptors::device(answer),
        (true, 2, CONFIGURATION) => descriptors::configuration(answer),
        (true, 2, _) if answer.len() != request.length() => Some("the head of the configuration"),
        (true, 3, _) => descriptors::string(answer),
        _ => None,
    }
}

/// The numbers of the bulk endpoints of a configuration, IN and OUT; 0 if there is none (USB 2.0
/// table 9-13).
fn bulk_endpoints(configuration: &[u8]) -> (usize, usize) {
    let (mut input, mut output) = (0, 0);
    let mut rest = configuration;
    while let [length, kind, ..] = *rest {
        if let (5, [_, _, address, attributes, ..]) = (kind, rest) {
            let number = usize::from(address & 15);
            match (attributes & 3 == 2, address & 0x80 != 0) {
                (true, true) => input = number,
                (true, false) => output = number,
                (false, _) => {}
            }
        }
        rest = rest.get(usize::from(length.max(2))..).unwrap_or(&[]);
    }
    (input, output)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bulk_endpoints_are_found_among_others() {
        let interrupt = [7, 5, 0x82, 3, 8, 0, 255];
        let data = [9, 4, 1, 0, 2, 10, 0, 0, 0];
        let bulk = [7, 5, 0x01, 2, 64, 0, 0, 7, 5, 0x83, 2, 64, 0, 0];
        let all = [&interrupt[..], &data, &bulk].concat();
        assert_eq!(bulk_endpoints(&all), (3, 1));
        assert_eq!(bulk_endpoints(&[]), (0, 0));
    }

    #[test]
    fn a_host_without_a_device_waits_and_one_without_a_cable_does_nothing() {
        let mut usb = Usb::default();
        assert_eq!(usb.next_event(), NEVER);
        usb.host.set_hclk(168_000_000);
        usb.host.plug(true, 1000);
        usb.event(1000);
        assert_eq!(usb.next_event(), 1000 + 168 * LOOK);
        usb.host.plug(false, 2000);
        assert_eq!(usb.next_event(), 2000 + 168 * 6_000);
        usb.event(usb.next_event());
        assert_eq!(usb.read(0x14) >> 11 & 1, 1, "USBSUSP");
        assert_eq!(usb.next_event(), NEVER);
        assert!(!usb.host.is_talking());
    }
}
