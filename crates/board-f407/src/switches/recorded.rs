//! The inputs of a board whose pins are in its record.
use crate::{
    fast_memory::placed,
    gpio::{AnyPort, Input},
    profile::{self, MOTORS},
};
use core::sync::atomic::{AtomicU16, Ordering::Relaxed};
use leadscrew_machine::board::Switches;
use leadscrew_stepper::MotorMask;

/// The most inputs of a board.
const INPUTS: usize = MOTORS + 5;

/// Tables of the inputs. Written at start-up, read by the switch interrupts.
struct Table {
    /// The port of the input on each line of EXTI. A pin has the number of its line.
    ports: [AnyPort; 16],
    /// Lines in use, one bit a line.
    lines: AtomicU16,
    /// Lines whose input is inverted, one bit a line.
    inverted: AtomicU16,
    /// The line of each limit switch, as a bit; 0 if there is no switch.
    limits: [AtomicU16; MOTORS],
    /// The same for probe, reset, hold, start and door.
    buttons: [AtomicU16; 5],
}

// SAFETY of the section: it is memory that `fast_memory` has zeroed before anything reads it.
placed! { ".bss.ccm.inputs";
    static TABLE: Table = Table {
        ports: [const { AnyPort::new() }; 16],
        lines: AtomicU16::new(0),
        inverted: AtomicU16::new(0),
        limits: [const { AtomicU16::new(0) }; MOTORS],
        buttons: [const { AtomicU16::new(0) }; 5],
    };
}

fn bit(input: Option<Input>) -> u16 {
    input.map_or(0, Input::line)
}

/// Makes the tables. Start-up.
pub(super) fn prepare() {
    let (limits, buttons) = (profile::limits(), profile::buttons());
    for (line, input) in TABLE.limits.iter().zip(limits) {
        line.store(bit(input), Relaxed);
    }
    for (line, input) in TABLE.buttons.iter().zip(buttons) {
        line.store(bit(input), Relaxed);
    }
    let (mut lines, mut inverted) = (0, 0);
    for input in all().iter().flatten() {
        lines |= input.line();
        inverted |= if input.inverted { input.line() } else { 0 };
        if let Some(port) = TABLE.ports.get(usize::from(input.pin.number)) {
            port.set(input.pin.bank);
        }
    }
    TABLE.lines.store(lines, Relaxed);
    TABLE.inverted.store(inverted, Relaxed);
}

/// All inputs.
pub(super) fn all() -> [Option<Input>; INPUTS] {
    let mut all = [None; INPUTS];
    let (limits, buttons) = all.split_at_mut(MOTORS);
    limits.copy_from_slice(&profile::limits());
    buttons.copy_from_slice(&profile::buttons());
    all
}

/// Lines of EXTI in use, one bit a line.
#[inline(always)]
pub(super) fn lines() -> u16 {
    TABLE.lines.load(Relaxed)
}

/// Lines whose input is inverted, one bit a line.
#[inline(always)]
pub(super) fn inverted() -> u16 {
    TABLE.inverted.load(Relaxed)
}

/// The line of the probe, as a bit; 0 if there is no probe.
#[inline(always)]
pub(super) fn probe_line() -> u16 {
    let [probe, ..] = &TABLE.buttons;
    probe.load(Relaxed)
}

/// The levels at the port of the input on a line.
#[inline(always)]
pub(super) fn levels(line: usize) -> u32 {
    TABLE.ports[line % 16].levels()
}

/// All switches, with these levels; one that the board does not have is open.
#[inline(always)]
pub(super) fn switches_at(levels: u16) -> Switches {
    let is_open = |line: &AtomicU16| {
        let line = line.load(Relaxed);
        line == 0 || levels & line != 0
    };
    let limits = (0u8..).zip(&TABLE.limits);
    let limits = limits.fold(0, |all, (motor, line)| {
        all | u8::from(is_open(line)) << motor
    });
    let [probe, reset, hold, start, door] = &TABLE.buttons;
    Switches {
        limits: MotorMask::from_bits(limits),
        probe: is_open(probe),
        reset: is_open(reset),
        hold: is_open(hold),
        start: is_open(start),
        door: is_open(door),
    }
}
