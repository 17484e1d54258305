//! An emulator of the STM32F407 for tests that run unmodified firmware.
//!
//! It boots an unmodified ELF, talks to its serial ports, drives its inputs, and records each edge
//! of its pins with the cycle and the cause:
//!
//! ```text
//!            bytes, switches, resets                         edges, duties, bytes
//!  test ---------------------------> Machine ------------------------------------> test
//!                                      |
//!     Cpu <- execute <- decode <- Memory, Art          core: ARMv7E-M with FPv4-SP
//!      |  \- exception <- Nvic, Scb                    exceptions, faults, priorities
//!     bus -> registers -> Devices <-> wiring           RM0090's peripherals, an event at a time
//! ```
//!
//! Time is counted in cycles of HCLK. The cycle model ([`Timing`]) advances it: the flash's wait
//! states behind the ART accelerator's caches, exception entry and exit, slow peripheral buses.
//! [`FlashTiming::ArtCold`] lets each interrupt begin with cold caches, which gives an upper bound
//! on its time.
//!
//! **Not** emulated are: the ADC except for ADC1's injected group, SPI, I2C, RTC, DACs, the MPU,
//! contention on the buses, and silicon errata except the delay of a peripheral's clock. Each
//! module lists the parts of its chapter of the reference manual that it leaves out. No result has
//! been compared with silicon. The core has been compared with QEMU (`oracle/README.md`), the
//! peripherals' registers with ST's data (`src/st_data`), and USB with its driver
//! (synopsys-usb-otg).
//!
//! # Example
//! ```no_run
//! use leadscrew_f407emu::{Machine, Pin, SerialLine, SerialPort};
//!
//! let elf = std::fs::read("target/thumbv7em-none-eabihf/firmware/board-f407")?;
//! let line = SerialLine {
//!     port: SerialPort::Usart2,
//!     output: Pin::new('A', 2),
//!     input: Pin::new('A', 3),
//! };
//! let mut machine = Machine::new(8_000_000);
//! machine.plug_serial(line);
//! machine.load_elf(&elf)?;
//! machine.run_until(10_000_000)?;
//! machine.uart_send(line, b"G1 X1 F100\n");
//! machine.pin_at(machine.cycle() + 100_000, Pin::new('C', 0), false); // a switch
//! machine.run_until(machine.cycle() + 168_000_000)?;
//! for edge in machine.edges() {
//!     println!("{} {} {}", edge.cycle, edge.pin, edge.level);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

mod art;
mod bus;
mod cpu;
mod decode;
mod devices;
mod elf;
mod exception;
mod execute;
mod instruction;
mod machine;
mod memory;
pub mod oracle;
mod peripheral;
mod record;
mod registers;
mod reset;
#[cfg(test)]
mod st_data;
mod test_bench;
mod timing;
mod trap;
mod turns;
mod warning;
mod wiring;
mod world;

pub use art::ArtStatistics;
pub use devices::{SerialLine, SerialPort};
pub use elf::LoadError;
pub use machine::Machine;
pub use peripheral::{
    iwdg::{LSI_FASTEST_HZ, LSI_SLOWEST_HZ, LSI_TYPICAL_HZ},
    nvic::Exception,
    rcc::{Clocks, ResetCause},
};
pub use record::{Cause, Duty, Edge, FlashOperation, Match, Pin, Profile, Service, Tamper};
pub use timing::{FlashTiming, Timing};
pub use trap::{Stop, Stray, Trap};
pub use turns::Turns;
pub use warning::Warning;
