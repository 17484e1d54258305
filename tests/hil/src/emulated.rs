//! Runs the same image in an emulated STM32F407, with the wires of the board's file.
use crate::{
    failure::Failure,
    link::Link,
    wires::{self, Wires},
};
use leadscrew_f407emu::{Exception, Machine, Pin, SerialLine, SerialPort, Tamper};

/// The Discovery's crystal, Hz.
const CRYSTAL_HZ: u32 = 8_000_000;
/// The board's serial line: PB6 and PB7, as docs/hil.md has it.
const LINE: SerialLine = SerialLine {
    port: SerialPort::Usart1,
    output: Pin::new('B', 6),
    input: Pin::new('B', 7),
};
/// The cycles that each look at the line lets pass: 60 µs.
const LOOK: u64 = 10_000;

/// The fault of an emulated board: none, or one planted fault.
#[derive(Clone, Copy)]
pub(crate) enum Fault {
    /// It is as it should be.
    None,
    /// Words that the program writes to a register are changed.
    Tamper {
        /// The register's address.
        register: u32,
        /// The change.
        tamper: Tamper,
    },
    /// The core stands still once, for a number of cycles, before the next store of an interrupt to
    /// a register.
    Stall {
        /// The number of the interrupt.
        irq: u8,
        /// The register's address.
        register: u32,
        /// The time for which the core stands still.
        cycles: u64,
    },
    /// Two wires of captures, given by their numbers, have changed places.
    Swapped(usize, usize),
    /// The wire with this number is broken.
    Broken(usize),
    /// The edges of a wire come late by a number of cycles: wire, cycles.
    Late(usize, u64),
    /// The crystal has another frequency, Hz.
    Crystal(u32),
    /// Programming a word of the flash takes this time, µs.
    SlowFlash(u32),
}

/// An emulated board.
pub(crate) struct Emulated {
    machine: Box<Machine>,
    seconds: f64,
}

impl Emulated {
    /// Switches a board on.
    ///
    /// # Errors
    /// The file is no program for the board.
    pub(crate) fn switch_on(elf: &[u8], wires: &Wires, fault: Fault) -> Result<Self, Failure> {
        let crystal_hz = match fault {
            Fault::Crystal(hz) => hz,
            _ => CRYSTAL_HZ,
        };
        let mut machine = Machine::new(crystal_hz);
        machine.plug_serial(LINE);
        machine.load_elf(elf)?;
        match fault {
            Fault::Tamper { register, tamper } => machine.tamper_with(register, tamper),
            Fault::Stall {
                irq,
                register,
                cycles,
            } => machine.stall_before(Exception::irq(irq), register, cycles),
            Fault::SlowFlash(micros) => machine.timing_mut().program_us = micros,
            Fault::None
            | Fault::Swapped(..)
            | Fault::Broken(_)
            | Fault::Late(..)
            | Fault::Crystal(_) => {}
        }
        connect(&mut machine, wires, fault);
        Ok(Emulated {
            machine,
            seconds: 0.0,
        })
    }
}

/// Connects the wires, with the fault if it is one of wires.
fn connect(machine: &mut Machine, wires: &Wires, fault: Fault) {
    let pin = |pin: leadscrew_boards::Pin| Pin::new(pin.port, pin.number);
    for (number, wire) in wires.captures.iter().enumerate() {
        let to = match fault {
            Fault::Swapped(one, other) if number == one => wires.captures[other].to,
            Fault::Swapped(one, other) if number == other => wires.captures[one].to,
            _ => wire.to,
        };
        let delay = match fault {
            Fault::Broken(broken) if broken == number => continue,
            Fault::Late(late, cycles) if late == number => cycles,
            _ => 0,
        };
        machine.connect(pin(wire.from), pin(to), delay);
        machine.watch(pin(to), false);
    }
    for wire in &wires.others {
        machine.connect(pin(wire.from), pin(wire.to), 0);
    }
    for pin in wires::outputs(wires) {
        machine.watch(Pin::new(pin.port, pin.number), false);
    }
}

impl Link for Emulated {
    fn send(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        self.machine.uart_send(LINE, bytes);
        Ok(())
    }

    fn receive(&mut self) -> Result<Vec<u8>, Failure> {
        let before = self.machine.cycle();
        self.machine.run_until(before + LOOK)?;
        let passed = self.machine.cycle() - before;
        self.seconds += passed as f64 / f64::from(self.machine.clocks().hclk);
        self.machine.clear_records();
        Ok(std::mem::take(self.machine.uart_out(LINE)))
    }

    fn seconds(&self) -> f64 {
        self.seconds
    }

    fn name(&self) -> String {
        "an emulated STM32F407 with its wires".into()
    }
}
