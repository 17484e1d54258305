//! Carries out instructions from a given state, for the comparison with another emulator
//! (`oracle/README.md`).
//!
//! The code stands behind 32 KB of SRAM. The flash has no wait states, and floating-point registers
//! are not stacked.
use crate::{
    machine::Machine,
    timing::FlashTiming,
    trap::{Stop, Trap},
};

/// The address of the code.
pub const CODE: u32 = 0x2000_8000;
/// The bytes of SRAM before the code that are set and compared.
pub const RAM: usize = 0x8000;

/// The registers.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct State {
    /// The registers r0 to r14.
    pub r: [u32; 15],
    /// Flags and GE, at their bits in xPSR.
    pub apsr: u32,
    /// The registers s0 to s31.
    pub s: [u32; 32],
    /// The floating-point status register.
    pub fpscr: u32,
    /// Address of the next instruction.
    pub pc: u32,
}

/// The way in which the instructions ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Outcome {
    /// All were carried out.
    Done,
    /// One instruction is undefined.
    Undefined,
    /// One instruction had another fault.
    Fault,
}

/// A machine for single instructions.
pub struct Bench(Box<Machine>);

impl Default for Bench {
    fn default() -> Self {
        Bench::new()
    }
}

impl Bench {
    /// Makes a machine with the floating-point unit switched on.
    pub fn new() -> Self {
        let mut machine = Machine::new(8_000_000);
        machine.scb.cpacr = 0xF << 20;
        machine.scb.fpccr = 0;
        machine.timing.flash = FlashTiming::ZeroWait;
        Bench(machine)
    }

    /// Returns the first [`RAM`] bytes of SRAM.
    pub fn ram(&mut self) -> &mut [u8] {
        &mut self.0.memory.sram[..RAM]
    }

    /// Carries out `count` instructions of `code` from `state`. Afterwards `state` is the state
    /// after them.
    pub fn run(&mut self, code: [u8; 8], count: u32, state: &mut State) -> Outcome {
        let machine = &mut *self.0;
        machine.memory.sram[RAM..RAM + 8].copy_from_slice(&code);
        machine.cpu = Default::default();
        machine.cpu.r[..15].copy_from_slice(&state.r);
        machine.cpu.set_apsr(state.apsr);
        (machine.cpu.s, machine.cpu.fpscr) = (state.s, state.fpscr);
        machine.cpu.next = CODE;
        (machine.scb.cfsr, machine.locked) = (0, None);
        machine.nvic = crate::peripheral::nvic::Nvic::new();
        // FAULTMASK keeps all fault handlers from running. So a trap locks the core up, and leaves
        // the registers for inspection.
        machine.cpu.masks.faultmask = true;
        let outcome = (0..count)
            .try_for_each(|_| machine.step())
            .map_or_else(outcome, |()| Outcome::Done);
        state.r.copy_from_slice(&machine.cpu.r[..15]);
        state.apsr = machine.cpu.xpsr() & 0xF80F_0000;
        (state.s, state.fpscr, state.pc) = (machine.cpu.s, machine.cpu.fpscr, machine.cpu.next);
        outcome
    }
}

fn outcome(stop: Stop) -> Outcome {
    match stop {
        Stop::Lockup {
            trap: Trap::Undefined,
            ..
        } => Outcome::Undefined,
        Stop::Lockup { .. }
        | Stop::Breakpoint { .. }
        | Stop::Stray { .. }
        | Stop::Loader { .. } => Outcome::Fault,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_instruction_changes_what_it_says_and_a_trap_is_told_apart() {
        let mut bench = Bench::new();
        let mut state = State {
            r: [1; 15],
            apsr: 0,
            s: [0; 32],
            fpscr: 0,
            pc: 0,
        };
        let adds = [0x88, 0x18, 0x00, 0xBF, 0x00, 0xBF, 0x00, 0xBF]; // adds r0, r1, r2
        assert_eq!(bench.run(adds, 1, &mut state), Outcome::Done);
        assert_eq!((state.r[0], state.pc), (2, CODE + 2));
        let udf = [0x00, 0xDE, 0, 0, 0, 0, 0, 0];
        assert_eq!(bench.run(udf, 1, &mut state), Outcome::Undefined);
    }
}
