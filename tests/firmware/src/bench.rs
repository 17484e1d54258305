//! The test bench: an emulated board, and somebody at the other end of its serial line.
//!
//! Time passes only in [`Bench::run_for`] and in functions that call it. Each caller that waits
//! gives the longest time that the wait may take.
use crate::{
    firmware::Build,
    pins::{CPU_HZ, SETTLED, TICK},
    plant::Plant,
    steps::Tracker,
    stream::Stream,
    wiring::{Wiring, FLASH},
};
use leadscrew_f407emu::{FlashTiming, Machine, Pin};

pub(crate) use crate::failure::{fail, Failure};

/// Fails with `words` unless `held`.
pub(crate) fn ensure(held: bool, words: impl FnOnce() -> String) -> Result<(), Failure> {
    if held {
        Ok(())
    } else {
        Err(Failure(words()))
    }
}

/// The text of every banner.
pub(crate) const BANNER: &str = "Grbl 1.1h ['$' for help]";
/// The longest time from reset to the banner, s. The firmware may first erase a sector of its
/// settings, 32 bits at a time, which takes 0.5 s at most (data sheet DocID022152, table 40: 16
/// KB).
const BOOT_SECONDS: f64 = 2.0;
/// The longest time that a host takes to set the device up, s: five times the sum of its waits.
const USB_SECONDS: f64 = 0.6;
/// The longest time until a line is answered at rest, s.
const ANSWER_SECONDS: f64 = 2.0;
/// The allowed error of the line's rate: 1 %. That is less than half of a receiver's tolerance when
/// the other end is 1 % off as well (RM0090 section 30.3.5).
const RATE_ERROR: f64 = 0.01;
/// Bytes of a flood that wait at any time: 3 ms of USB's packets, 20 ms at 2 Mbaud.
const FLOOD_BYTES: usize = 4_000;
/// Cycles between two looks at the received bytes: 119 µs.
const SLICE: u64 = 20_000;

/// An emulated board. A clone goes on from the same instant.
#[derive(Clone)]
pub(crate) struct Bench {
    pub(crate) machine: Box<Machine>,
    /// The record of the motors' pins.
    pub(crate) pins: Tracker,
    /// The devices on the pins.
    pub(crate) wiring: &'static Wiring,
    /// The carriages and the heated bodies around the board.
    pub(crate) plant: Plant,
    /// The rate that the serial line should have, baud.
    baud: u32,
    /// The received bytes of a line that has not ended yet.
    incoming: Vec<u8>,
    /// True if input and output go over USB.
    over_usb: bool,
    /// The bytes that come on the other line without end.
    flood: Option<Flood>,
}

/// Bytes that come again and again, as fast as a line takes them, from a sender that reads all
/// answers.
#[derive(Clone, Copy)]
pub(crate) struct Flood {
    /// True if they come over USB, false if on the serial line.
    pub(crate) over_usb: bool,
    pub(crate) bytes: &'static [u8],
}

impl Bench {
    /// Switches a board with this firmware on and hears its banner.
    pub(crate) fn boot(build: &Build) -> Result<Bench, Failure> {
        let mut bench = Bench::switch_on(build)?;
        bench.hear_banner()?;
        Ok(bench)
    }

    /// Switches a board on; nothing has been carried out yet.
    pub(crate) fn switch_on(build: &Build) -> Result<Bench, Failure> {
        Bench::switch_on_with(build, build.wiring.crystal_hz)
    }

    /// As [`Bench::switch_on`] with another crystal; a frequency of 0 is no crystal.
    pub(crate) fn switch_on_with(build: &Build, crystal_hz: u32) -> Result<Bench, Failure> {
        let mut machine = Machine::new(crystal_hz);
        let wiring = build.wiring;
        machine.set_flash_size(wiring.flash_kb);
        if wiring.start != FLASH {
            machine.program_flash(FLASH, &bootloader(wiring.start));
        }
        machine.plug_serial(wiring.line);
        machine.load_elf(&build.elf)?;
        if let Some(record) = &build.record {
            machine.program_flash(wiring.record(), record);
        }
        if let Some(fault) = build.fault {
            machine.tamper_with(fault.register, fault.tamper);
        }
        machine.watch_channel(TICK.0, TICK.1);
        machine.watch_channel(SETTLED.0, SETTLED.1);
        Ok(Bench {
            machine,
            pins: Tracker::new(wiring),
            wiring,
            plant: Plant::default(),
            baud: build.baud,
            incoming: Vec::new(),
            over_usb: false,
            flood: None,
        })
    }

    /// Empties the flash's caches at every exception from now on, which makes interrupts as slow as
    /// they can be. Code between many interrupts is then slower than on the chip.
    pub(crate) fn cold(&mut self) {
        self.machine.timing_mut().flash = FlashTiming::ArtCold;
    }

    /// Stops recording the edges of laser or spindle power: a PWM has many.
    pub(crate) fn ignore_power(&mut self) {
        self.machine.watch(self.wiring.power, false);
    }

    /// Waits for the banner, which has to come at the right rate.
    pub(crate) fn hear_banner(&mut self) -> Result<Vec<String>, Failure> {
        let heard = self.hear_until(BOOT_SECONDS, |line| line == BANNER)?;
        let (baud, expected) = (
            self.machine.uart_baud(self.wiring.line) as f64,
            f64::from(self.baud),
        );
        ensure((baud / expected - 1.0).abs() <= RATE_ERROR, || {
            format!("the serial line is at {baud} baud")
        })?;
        Ok(heard)
    }

    /// Waits for the banner after a reset. Forgets lines from before the reset, and answers the
    /// lines that come before the banner.
    pub(crate) fn hear_boot(&mut self) -> Result<Vec<String>, Failure> {
        self.incoming.clear();
        self.output().clear();
        self.hear_banner()
    }

    /// Lets time pass.
    pub(crate) fn run_for(&mut self, seconds: f64) -> Result<(), Failure> {
        self.run_to(self.machine.cycle() + cycles(seconds))
    }

    /// Lets time pass up to a cycle.
    pub(crate) fn run_to(&mut self, cycle: u64) -> Result<(), Failure> {
        self.fill_flood();
        let stopped = self.machine.run_until(cycle);
        self.pins.follow(&mut self.machine);
        self.follow_plant();
        stopped?;
        let warnings = self.machine.warnings();
        ensure(warnings.is_empty(), || {
            format!("the emulator warns: {warnings:?}")
        })
    }

    /// Moves switches and sensors as the motors and heaters ask.
    fn follow_plant(&mut self) {
        let mut plant = std::mem::take(&mut self.plant);
        plant.follow(&mut self.machine, &self.pins.steps);
        self.plant = plant;
    }

    /// Sets an input in a few cycles. Returns the cycle of the edge.
    pub(crate) fn set(&mut self, pin: Pin, level: bool) -> u64 {
        let edge = self.machine.cycle() + 100;
        self.machine.pin_at(edge, pin, level);
        edge
    }

    /// Plugs in the USB cable, waits until a host has set the device up, and goes on over USB.
    pub(crate) fn plug_usb(&mut self) -> Result<(), Failure> {
        self.machine.usb_plug(true);
        self.over_usb = true;
        self.incoming.clear();
        let end = self.machine.cycle() + cycles(USB_SECONDS);
        while !self.machine.usb_is_up() {
            self.run_to(self.machine.cycle() + SLICE)?;
            let refusal = self.machine.usb_refusal();
            ensure(self.machine.cycle() < end && refusal.is_none(), || {
                let (broken, answers) =
                    (refusal.unwrap_or("no answer"), self.machine.usb_answers());
                format!("the host cannot set the device up: {broken}; {answers:02x?}")
            })?;
        }
        Ok(())
    }

    /// Pulls the USB cable out and goes on over the serial line.
    pub(crate) fn unplug_usb(&mut self) {
        self.machine.usb_plug(false);
        self.use_serial();
    }

    /// Goes on over the serial line; the USB cable stays plugged in.
    pub(crate) fn use_serial(&mut self) {
        self.over_usb = false;
        self.incoming.clear();
    }

    /// Floods the line that is not in use from now on. Time must pass in steps of 3 ms at most.
    pub(crate) fn flood(&mut self, flood: Flood) {
        self.flood = Some(flood);
    }

    /// Lets so many bytes of the flood wait that none is missing for 3 ms.
    fn fill_flood(&mut self) {
        let Some(Flood { over_usb, bytes }) = self.flood else {
            return;
        };
        let (machine, line) = (&mut self.machine, self.wiring.line);
        let waiting = match over_usb {
            true => machine.usb_unsent(),
            false => machine.uart_unsent(line),
        };
        let more = bytes.repeat(FLOOD_BYTES.saturating_sub(waiting) / bytes.len());
        if over_usb {
            machine.usb_send(&more);
            machine.usb_out().clear();
        } else {
            machine.uart_send(line, &more);
            machine.uart_out(line).clear();
        }
    }

    /// Sends bytes.
    pub(crate) fn send(&mut self, bytes: impl AsRef<[u8]>) {
        if self.over_usb {
            self.machine.usb_send(bytes.as_ref());
        } else {
            self.machine.uart_send(self.wiring.line, bytes.as_ref());
        }
    }

    /// Bytes that have come in.
    fn output(&mut self) -> &mut Vec<u8> {
        if self.over_usb {
            self.machine.usb_out()
        } else {
            self.machine.uart_out(self.wiring.line)
        }
    }

    /// The lines that have come in since the last call; empty ones are left out.
    pub(crate) fn heard(&mut self) -> Vec<String> {
        let mut lines = Vec::new();
        for byte in std::mem::take(self.output()) {
            match byte {
                b'\r' => {}
                b'\n' => {
                    let line = std::mem::take(&mut self.incoming);
                    lines.extend(Some(String::from_utf8_lossy(&line).into_owned()));
                }
                other => self.incoming.push(other),
            }
        }
        lines.retain(|line| !line.is_empty());
        lines
    }

    /// Waits for a line. Returns all lines heard up to it.
    pub(crate) fn hear_until(
        &mut self,
        seconds: f64,
        is_last: impl Fn(&str) -> bool,
    ) -> Result<Vec<String>, Failure> {
        let end = self.machine.cycle() + cycles(seconds);
        let mut all = Vec::new();
        while self.machine.cycle() < end {
            self.run_to(end.min(self.machine.cycle() + SLICE))?;
            all.append(&mut self.heard());
            if all.iter().any(|line| is_last(line)) {
                return Ok(all);
            }
        }
        let unfinished = String::from_utf8_lossy(&self.incoming);
        fail(format!(
            "waited {seconds} s, heard only {all:?} {unfinished:?}; at {:#x}, {:?}",
            self.machine.pc(),
            self.machine.warnings()
        ))
    }

    /// Sends a line and waits for its answer. Returns the lines heard, the answer included.
    pub(crate) fn say(&mut self, line: &str) -> Result<Vec<String>, Failure> {
        self.send(format!("{line}\n"));
        self.hear_until(ANSWER_SECONDS, is_answer)
    }

    /// Sends a line that must be answered with `ok`. Returns the lines heard before the `ok`.
    pub(crate) fn command(&mut self, line: &str) -> Result<Vec<String>, Failure> {
        let mut heard = self.say(line)?;
        match heard.pop() {
            Some(answer) if answer == "ok" => Ok(heard),
            other => fail(format!("{line}: {heard:?} {other:?}")),
        }
    }

    /// Sends lines, each after the answer to the line before; empty lines are left out.
    pub(crate) fn commands(&mut self, lines: &str) -> Result<(), Failure> {
        for line in lines.lines().filter(|line| !line.trim().is_empty()) {
            self.command(line)?;
        }
        Ok(())
    }

    /// Asks for a status report and answers it.
    pub(crate) fn status(&mut self) -> Result<String, Failure> {
        self.send("?");
        let heard = self.hear_until(ANSWER_SECONDS, |line| line.starts_with('<'))?;
        let report = heard.into_iter().find(|line| line.starts_with('<'));
        report.ok_or_else(|| Failure("no status report".into()))
    }

    /// Waits until a status report begins with `state`; asks at 20 Hz.
    pub(crate) fn wait_for(&mut self, state: &str, seconds: f64) -> Result<String, Failure> {
        let end = self.machine.cycle() + cycles(seconds);
        loop {
            let status = self.status()?;
            if status.trim_start_matches('<').starts_with(state) {
                return Ok(status);
            }
            ensure(self.machine.cycle() < end, || {
                format!("waited {seconds} s for {state}: {status}")
            })?;
            self.run_for(0.05)?;
        }
    }

    /// Streams a program by character counting and waits for rest; see [`Stream`].
    pub(crate) fn stream(&mut self, stream: &Stream<'_>) -> Result<(), Failure> {
        stream.run(self)
    }
}

/// The smallest possible bootloader: it starts the program whose vector table is at `start`.
fn bootloader(start: u32) -> Vec<u8> {
    let vectors = [0x2000_1000, FLASH | 0x9];
    // ldr r0, =start; ldr r1, [r0]; mov sp, r1; ldr r1, [r0, #4]; bx r1; nop
    let code: [u16; 6] = [0x4802, 0x6801, 0x468D, 0x6841, 0x4708, 0xBF00];
    let words = |words: &[u32]| words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let mut image: Vec<u8> = words(&vectors);
    image.extend(code.iter().flat_map(|half| half.to_le_bytes()));
    image.extend::<Vec<u8>>(words(&[start]));
    image
}

/// Returns true if a line is the answer to a line that was sent.
pub(crate) fn is_answer(line: &str) -> bool {
    line == "ok" || line.starts_with("error:")
}

/// Microseconds at full speed from one cycle to another; negative if `to` is the earlier one.
pub(crate) fn micros_between(from: u64, to: u64) -> f64 {
    (to as f64 - from as f64) * 1e6 / CPU_HZ as f64
}

/// The number of cycles at full speed in a time.
pub(crate) fn cycles(seconds: f64) -> u64 {
    (seconds * CPU_HZ as f64) as u64
}
