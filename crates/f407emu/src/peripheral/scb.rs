//! The system control block (DDI 0403, B3.2), the floating-point context (B1.5.7) and the debug
//! registers that a program reads (C1.6): settings of the core, and its reports of faults.
//!
//! Not modelled: the MPU (reads as absent), the cache registers, and the control of the core by
//! DHCSR.
use crate::trap::Trap;

/// CCR.UNALIGN_TRP: unaligned accesses fault.
const TRAP_UNALIGNED: u32 = 1 << 3;
/// CCR.DIV_0_TRP: divisions by zero fault.
const TRAP_DIVISION: u32 = 1 << 4;
/// CCR.STKALIGN: the stack is aligned to 8 bytes on entry.
const ALIGN_STACK: u32 = 1 << 9;
/// FPCCR.LSPACT: space on the stack is reserved for floating-point registers, which have not been
/// stored there yet (lazy stacking).
const LAZY_PENDING: u32 = 1;
/// FPCCR.LSPEN: floating-point registers are stacked only when they are needed.
const LAZY: u32 = 1 << 30;
/// FPCCR.ASPEN: the use of a floating-point register sets CONTROL.FPCA.
const AUTOMATIC: u32 = 1 << 31;
/// CPACR: full access to coprocessors 10 and 11.
const FLOAT_ACCESS: u32 = 0xF << 20;
/// HFSR.FORCED: a fault escalated because its own handler could not be used.
const FORCED: u32 = 1 << 30;
/// HFSR.DEBUGEVT: a breakpoint without a debugger.
const DEBUG_EVENT: u32 = 1 << 31;

/// Registers of the block.
#[derive(Clone, Debug)]
pub(crate) struct Scb {
    /// Address of the vector table.
    pub(crate) vtor: u32,
    pub(crate) scr: u32,
    pub(crate) ccr: u32,
    pub(crate) cfsr: u32,
    pub(crate) hfsr: u32,
    bfar: u32,
    pub(crate) cpacr: u32,
    pub(crate) fpccr: u32,
    /// The address at which lazy stacking stores the registers.
    pub(crate) fpcar: u32,
    pub(crate) fpdscr: u32,
    demcr: u32,
}

impl Scb {
    /// As after a reset.
    pub(crate) fn new() -> Self {
        Scb {
            vtor: 0,
            scr: 0,
            ccr: ALIGN_STACK,
            cfsr: 0,
            hfsr: 0,
            bfar: 0,
            cpacr: 0,
            fpccr: AUTOMATIC | LAZY,
            fpcar: 0,
            fpdscr: 0,
            demcr: 0,
        }
    }

    pub(crate) fn traps_unaligned(&self) -> bool {
        self.ccr & TRAP_UNALIGNED != 0
    }

    pub(crate) fn traps_division(&self) -> bool {
        self.ccr & TRAP_DIVISION != 0
    }

    pub(crate) fn aligns_stack(&self) -> bool {
        self.ccr & ALIGN_STACK != 0
    }

    pub(crate) fn has_float(&self) -> bool {
        self.cpacr & FLOAT_ACCESS == FLOAT_ACCESS
    }

    pub(crate) fn notes_float(&self) -> bool {
        self.fpccr & AUTOMATIC != 0
    }

    pub(crate) fn stacks_lazily(&self) -> bool {
        self.fpccr & LAZY != 0
    }

    /// Returns true if lazy stacking still has to store floating-point registers.
    pub(crate) fn lazy_pending(&self) -> bool {
        self.fpccr & LAZY_PENDING != 0
    }

    /// Reserves space on the stack for floating-point registers, at `address`.
    pub(crate) fn promise(&mut self, address: u32) {
        self.fpcar = address;
        self.fpccr |= LAZY_PENDING;
    }

    /// Ends lazy stacking: the registers are stored, or no longer needed.
    pub(crate) fn end_promise(&mut self) {
        self.fpccr &= !LAZY_PENDING;
    }

    /// Records a fault in CFSR, and its address in BFAR (B3.2.15).
    pub(crate) fn note(&mut self, trap: Trap) {
        self.cfsr |= match trap {
            Trap::Fetch { .. } => 1 << 8,
            Trap::Bus { address } => {
                self.bfar = address;
                1 << 9 | 1 << 15
            }
            Trap::Unstacking => 1 << 11,
            Trap::Stacking => 1 << 12,
            Trap::Undefined => 1 << 16,
            Trap::InvalidState => 1 << 17,
            Trap::InvalidReturn => 1 << 18,
            Trap::NoCoprocessor => 1 << 19,
            Trap::Unaligned { .. } => 1 << 24,
            Trap::DivideByZero => 1 << 25,
            Trap::Breakpoint | Trap::SupervisorCall => 0,
        };
    }

    /// Records in HFSR that a fault became a HardFault.
    pub(crate) fn note_hard_fault(&mut self, trap: Trap) {
        self.hfsr |= if trap == Trap::Breakpoint {
            DEBUG_EVENT
        } else {
            FORCED
        };
    }

    /// Reads a register at `offset` from 0xE000E000.
    pub(crate) fn read(&self, offset: u32) -> u32 {
        match offset {
            0x004 => 2,           // ICTR: interrupts in three groups of 32
            0xD00 => 0x410F_C241, // CPUID: Cortex-M4 r0p1
            0xD08 => self.vtor,
            0xD10 => self.scr,
            0xD14 => self.ccr,
            0xD28 => self.cfsr,
            0xD2C => self.hfsr,
            0xD38 => self.bfar,
            0xD88 => self.cpacr,
            0xDFC => self.demcr,
            0xF34 => self.fpccr,
            0xF38 => self.fpcar,
            0xF3C => self.fpdscr,
            0xF40 => 0x1011_0021, // MVFR0: single precision with division and square root
            0xF44 => 0x1100_0011, // MVFR1: fused operations, half precision
            _ => 0,
        }
    }

    /// Writes a register at `offset` from 0xE000E000. Ones clear bits of the fault registers.
    pub(crate) fn write(&mut self, offset: u32, value: u32) {
        match offset {
            0xD08 => self.vtor = value & !0x1FF,
            0xD10 => self.scr = value,
            0xD14 => self.ccr = value,
            0xD28 => self.cfsr &= !value,
            0xD2C => self.hfsr &= !value,
            0xD88 => self.cpacr = value,
            0xDFC => self.demcr = value,
            0xF34 => self.fpccr = value,
            0xF38 => self.fpcar = value,
            0xF3C => self.fpdscr = value,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bus_fault_leaves_its_address_and_says_that_it_is_valid() {
        let mut scb = Scb::new();
        scb.note(Trap::Bus {
            address: 0x3000_0000,
        });
        assert_eq!(scb.read(0xD28), 0x8200);
        assert_eq!(scb.read(0xD38), 0x3000_0000);
        scb.write(0xD28, 0x8200);
        assert_eq!(scb.read(0xD28), 0);
    }

    #[test]
    fn the_float_unit_needs_both_coprocessors() {
        let mut scb = Scb::new();
        assert!(!scb.has_float());
        scb.write(0xD88, 3 << 20);
        assert!(!scb.has_float());
        scb.write(0xD88, 0xF << 20);
        assert!(scb.has_float());
    }

    #[test]
    fn after_a_reset_the_stack_is_aligned_and_floats_are_stacked_lazily() {
        let scb = Scb::new();
        assert!(scb.aligns_stack() && scb.notes_float() && scb.stacks_lazily());
    }
}
