//! The constants of the cycle model.
//!
//! The code of each instruction charges its cycles: one as a rule; loads and stores two, but one
//! if they follow each other; divisions two to twelve, by the size of the quotient; VDIV and
//! VSQRT fourteen; exception entry and exit 12 and 10, a tail chain 6. These are figures of the
//! Cortex-M4 Technical Reference Manual (DDI 0439) from memory, not looked up. Branch refills,
//! divisions and tables come from an earlier version of this model. Its constants were fitted to 45
//! kernels on a cycle-exact Cortex-M3 without wait states (30 equal, 11 within a cycle for each
//! loop). That was a fit, not a validation, and it was not repeated for this code. It did not cover
//! exceptions, floats, bus bridges and the flash. Nothing has been compared with silicon: an
//! accuracy of ±15 % is a judgement.
//!
//! Code in SRAM: over the system bus (at 0x20000000) each instruction takes a cycle more. Over the
//! instruction bus (SRAM1 at 0, SYSCFG_MEMRMP) it takes none, since SRAM has no wait states (RM0090
//! section 2.3.1, which recommends the remapping for that reason). A data access to SRAM1 then
//! takes a cycle more, because both go to one slave of the bus matrix; data in CCM or SRAM2 do not.
//! One cycle for each such access is an assumption, and an upper bound: see `bus.rs`.
//!
//! Not modelled: contention of core and DMA on the bus matrix, and the late arrival of a higher
//! interrupt during entry (here it nests).

/// The charges of the cycle model, in cycles of HCLK.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// Refill of the pipeline after a direct branch that is taken.
    pub refill: u32,
    /// Refill after the program counter was loaded.
    pub refill_loaded: u32,
    /// Exception entry, from the interrupt to the handler's first instruction.
    pub entry: u32,
    /// Exception return.
    pub exit: u32,
    /// Going from one handler straight to the next.
    pub tail_chain: u32,
    /// Stacking or restoring the floating-point registers.
    pub float_context: u32,
    /// The bus clocks that an access to an APB peripheral takes beyond the core's own cycle.
    pub apb_clocks: u32,
    /// The way in which reads of instructions and constants from the flash are charged.
    pub flash: FlashTiming,
    /// The time in which the flash programs a unit of any width, µs: 16 is typical, 100 the maximum
    /// (data sheet, table 40).
    pub program_us: u32,
}

/// The way in which the flash's wait states are charged (RM0090 section 3.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashTiming {
    /// No wait states: the lower bound.
    ZeroWait,
    /// With the ART accelerator's caches as the program has filled them.
    Art,
    /// The caches are empty at each exception entry: the upper bound for an interrupt, to be used
    /// for budgets.
    ArtCold,
}

impl Default for Timing {
    fn default() -> Self {
        Timing {
            refill: 1,
            refill_loaded: 3,
            entry: 12,
            exit: 10,
            tail_chain: 6,
            float_context: 17,
            apb_clocks: 2,
            flash: FlashTiming::Art,
            program_us: 16,
        }
    }
}

#[cfg(test)]
mod tests {
    //! RM0090 section 3.5: the flash is read in lines of 16 bytes, and each takes `LATENCY` + 1
    //! cycles. At 168 MHz and 3.3 V there are 5 wait states (table 11). The Cortex-M4 enters an
    //! exception in 12 cycles, returns in 10, and goes from one handler to the next in 6.
    use super::*;
    use crate::{machine::Machine, peripheral::nvic::Exception};

    /// FLASH_ACR and its bits (RM0090 section 3.9.1).
    const ACR: u32 = 0x4002_3C00;
    const FIVE: u32 = 5;
    const PREFETCH: u32 = 1 << 8;
    const INSTRUCTION_CACHE: u32 = 1 << 9;
    /// The addresses of two flash lines with eight instructions each, and of a handler that returns
    /// at once.
    const CODE: u32 = 0x0800_0400;
    const HANDLER: u32 = 0x0800_0300;
    const NOP: [u8; 2] = [0x00, 0xBF];
    const RETURN: [u8; 2] = [0x70, 0x47];

    /// A machine about to run 16 instructions of one cycle each.
    fn machine(acr: u32) -> Box<Machine> {
        let mut machine = Machine::new(8_000_000);
        for index in 0..98 {
            let vector = [0x2000_1000, CODE | 1].get(index).copied();
            let vector = vector.unwrap_or(HANDLER | 1).to_le_bytes();
            machine.program_flash(0x0800_0000 + 4 * index as u32, &vector);
        }
        machine.program_flash(HANDLER, &RETURN);
        machine.program_flash(CODE, &NOP.repeat(16));
        machine.boot();
        machine.write_word(ACR, acr).unwrap();
        machine
    }

    /// The cycles that `instructions` instructions take.
    fn cycles(machine: &mut Machine, instructions: usize) -> u64 {
        let before = machine.cycle();
        for _ in 0..instructions {
            machine.step().unwrap();
        }
        machine.cycle() - before
    }

    fn entry(machine: &mut Machine) -> u64 {
        let before = machine.cycle();
        machine.take_pending().unwrap();
        machine.cycle() - before
    }

    #[test]
    fn each_line_of_the_flash_is_waited_for() {
        assert_eq!(cycles(&mut machine(0), 16), 16);
        assert_eq!(cycles(&mut machine(FIVE), 16), 16 + 2 * 5);
    }

    #[test]
    fn a_line_that_is_read_ahead_behind_eight_cycles_of_work_is_there() {
        assert_eq!(cycles(&mut machine(FIVE | PREFETCH), 16), 16 + 5);
    }

    #[test]
    fn a_line_that_the_cache_holds_is_there() {
        let mut machine = machine(FIVE | INSTRUCTION_CACHE);
        assert_eq!(cycles(&mut machine, 16), 16 + 2 * 5);
        machine.cpu.next = CODE;
        assert_eq!(cycles(&mut machine, 16), 16);
    }

    #[test]
    fn entry_return_and_tail_chain_take_12_10_and_6_cycles() {
        let mut machine = machine(0);
        machine.nvic.pend(Exception::PEND_SV);
        machine.nvic.pend(Exception::SYSTICK);
        assert_eq!(entry(&mut machine), 12);
        assert_eq!(
            cycles(&mut machine, 1),
            1 + 6,
            "bx lr, into the next handler"
        );
        assert_eq!(
            cycles(&mut machine, 1),
            1 + 10,
            "bx lr, back to the program"
        );
    }

    #[test]
    fn a_handler_whose_line_is_not_held_is_waited_for_each_time() {
        let mut machine = machine(FIVE | INSTRUCTION_CACHE);
        machine.timing.flash = FlashTiming::ArtCold;
        for _ in 0..3 {
            machine.nvic.pend(Exception::PEND_SV);
            assert_eq!(entry(&mut machine), 12, "the vector is read meanwhile");
            assert_eq!(cycles(&mut machine, 1), 5 + 1 + 10);
        }
    }
}
