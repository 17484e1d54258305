//! The registers of the core (DDI 0403, B1.4) and the meaning of the flags.

/// The registers as an instruction sees them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cpu {
    /// r0 to r15. Register 15 is the value that an instruction reads there: its own address plus 4.
    pub(crate) r: [u32; 16],
    /// s0 to s31, as bit patterns.
    pub(crate) s: [u32; 32],
    pub(crate) fpscr: u32,
    pub(crate) flags: Flags,
    /// The GE flags that SADD8 and similar instructions set for SEL, one bit for each byte.
    pub(crate) ge: u8,
    /// The IT block under way: condition and mask, 0 outside (A7.3).
    pub(crate) it: u8,
    /// True if the core executes an instruction of an IT block.
    pub(crate) in_it: bool,
    /// IPSR: the number of the exception under way, 0 in thread mode.
    pub(crate) exception: u8,
    pub(crate) masks: Masks,
    /// CONTROL: unprivileged, process stack, floating-point context.
    pub(crate) control: u32,
    /// The stack pointer that is not in use.
    pub(crate) other_stack: u32,
    /// Address of the next instruction.
    pub(crate) next: u32,
    /// The word that an exclusive load has marked.
    pub(crate) exclusive: Option<u32>,
    /// The event register that WFE looks at.
    pub(crate) event: bool,
    /// True if the core sleeps in a WFI or WFE.
    pub(crate) asleep: bool,
}

/// The condition flags, and the sticky saturation flag Q.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Flags {
    pub(crate) negative: bool,
    pub(crate) zero: bool,
    pub(crate) carry: bool,
    pub(crate) overflow: bool,
    pub(crate) saturated: bool,
}

/// The registers that mask interrupts (B1.4.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Masks {
    pub(crate) primask: bool,
    pub(crate) faultmask: bool,
    /// The priority from which on exceptions are masked; 0 masks nothing.
    pub(crate) basepri: u8,
}

/// CONTROL.SPSEL: thread mode uses the process stack.
pub(crate) const CONTROL_PROCESS_STACK: u32 = 1 << 1;
/// CONTROL.FPCA: the context holds floating-point registers.
pub(crate) const CONTROL_FLOAT: u32 = 1 << 2;
/// Number of the stack pointer.
pub(crate) const SP: usize = 13;
/// Number of the link register.
pub(crate) const LR: usize = 14;
/// Number of the program counter.
pub(crate) const PC: usize = 15;
const APSR_MASK: u32 = 0xF80F_0000;

impl Cpu {
    /// A register's value.
    #[inline(always)]
    pub(crate) fn get(&self, register: u8) -> u32 {
        self.r[usize::from(register & 15)]
    }

    /// Sets a register other than the program counter.
    #[inline(always)]
    pub(crate) fn set(&mut self, register: u8, value: u32) {
        self.r[usize::from(register & 15)] = value;
    }

    /// The address of the instruction that the core executes.
    pub(crate) fn current(&self) -> u32 {
        self.r[PC].wrapping_sub(4)
    }

    /// Sets N and Z after a result.
    #[inline(always)]
    pub(crate) fn set_sign(&mut self, value: u32) {
        self.flags.negative = value >> 31 != 0;
        self.flags.zero = value == 0;
    }

    /// Returns true if a condition holds (A7.3); 14 and 15 always do.
    #[inline(always)]
    pub(crate) fn holds(&self, condition: u8) -> bool {
        let f = &self.flags;
        let positive = match condition >> 1 {
            0 => f.zero,
            1 => f.carry,
            2 => f.negative,
            3 => f.overflow,
            4 => f.carry && !f.zero,
            5 => f.negative == f.overflow,
            6 => f.negative == f.overflow && !f.zero,
            _ => return true,
        };
        positive != (condition & 1 != 0)
    }

    /// Returns true if the IT block lets this instruction be carried out. Moves on in the block
    /// (ITAdvance, A7.3.3).
    pub(crate) fn passes_it(&mut self) -> bool {
        let passes = self.holds(self.it >> 4);
        self.it = if self.it & 7 == 0 {
            0
        } else {
            self.it & 0xE0 | self.it << 1 & 0x1F
        };
        passes
    }

    /// Returns true if the process stack is in use, which is possible in thread mode only.
    pub(crate) fn on_process_stack(&self) -> bool {
        self.control & CONTROL_PROCESS_STACK != 0 && self.exception == 0
    }

    /// Exchanges the two stack pointers.
    pub(crate) fn swap_stacks(&mut self) {
        core::mem::swap(&mut self.r[SP], &mut self.other_stack);
    }

    /// xPSR: flags, IT block, exception (B1.4.2).
    pub(crate) fn xpsr(&self) -> u32 {
        let f = &self.flags;
        u32::from(f.negative) << 31
            | u32::from(f.zero) << 30
            | u32::from(f.carry) << 29
            | u32::from(f.overflow) << 28
            | u32::from(f.saturated) << 27
            | u32::from(self.it & 3) << 25
            | 1 << 24
            | u32::from(self.ge) << 16
            | u32::from(self.it >> 2) << 10
            | u32::from(self.exception)
    }

    /// Sets everything that [`Cpu::xpsr`] holds.
    pub(crate) fn set_xpsr(&mut self, value: u32) {
        self.set_apsr(value);
        self.it = (value >> 25 & 3 | value >> 8 & 0xFC) as u8;
        self.exception = value as u8;
    }

    /// Sets the flags and GE from their bits in xPSR.
    pub(crate) fn set_apsr(&mut self, value: u32) {
        self.flags = Flags {
            negative: value >> 31 != 0,
            zero: value >> 30 & 1 != 0,
            carry: value >> 29 & 1 != 0,
            overflow: value >> 28 & 1 != 0,
            saturated: value >> 27 & 1 != 0,
        };
        self.ge = (value >> 16 & 15) as u8;
    }

    /// Reads a special register (MRS, B5.2.2).
    pub(crate) fn special(&self, register: u8) -> u32 {
        let process = self.on_process_stack();
        match register {
            0..=7 => {
                let exception = if register & 1 != 0 { 0x1FF } else { 0 };
                let flags = if register & 4 == 0 { APSR_MASK } else { 0 };
                self.xpsr() & (exception | flags)
            }
            8 if process => self.other_stack,
            8 => self.r[SP],
            9 if process => self.r[SP],
            9 => self.other_stack,
            16 => u32::from(self.masks.primask),
            17 | 18 => u32::from(self.masks.basepri),
            19 => u32::from(self.masks.faultmask),
            20 => self.control,
            _ => 0,
        }
    }

    /// Writes a special register (MSR, B5.2.3); bits 3 and 2 of `mask` select flags and GE.
    pub(crate) fn set_special(&mut self, register: u8, mask: u8, value: u32) {
        let process = self.on_process_stack();
        match register {
            0..=3 => self.set_masked_apsr(mask, value),
            8 if process => self.other_stack = value & !3,
            8 => self.r[SP] = value & !3,
            9 if process => self.r[SP] = value & !3,
            9 => self.other_stack = value & !3,
            16 => self.masks.primask = value & 1 != 0,
            17 => self.masks.basepri = value as u8 & 0xF0,
            18 => self.raise_basepri(value as u8 & 0xF0),
            19 => self.masks.faultmask = value & 1 != 0,
            20 => self.set_control(value),
            _ => {}
        }
    }

    fn set_masked_apsr(&mut self, mask: u8, value: u32) {
        let before = self.xpsr();
        let flags = if mask & 8 != 0 { 0xF800_0000 } else { 0 };
        let ge = if mask & 4 != 0 { 0x000F_0000 } else { 0 };
        let selected = flags | ge;
        self.set_apsr(before & !selected | value & selected);
    }

    /// BASEPRI_MAX: sets BASEPRI only if that masks more.
    fn raise_basepri(&mut self, level: u8) {
        let basepri = &mut self.masks.basepri;
        if level != 0 && (*basepri == 0 || level < *basepri) {
            *basepri = level;
        }
    }

    fn set_control(&mut self, value: u32) {
        let before = self.on_process_stack();
        let kept = if self.exception == 0 {
            0
        } else {
            CONTROL_PROCESS_STACK
        };
        self.control = self.control & kept | value & 7 & !kept;
        if before != self.on_process_stack() {
            self.swap_stacks();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn conditions_come_in_pairs_of_opposites() {
        for bits in 0..16u32 {
            let mut cpu = Cpu::default();
            cpu.set_apsr(bits << 28);
            for condition in (0..14).step_by(2) {
                assert_ne!(cpu.holds(condition), cpu.holds(condition + 1));
            }
            assert!(cpu.holds(14));
        }
    }

    #[test]
    fn signed_comparisons_follow_the_overflow() {
        let mut cpu = Cpu::default();
        cpu.flags.overflow = true; // as after a subtraction that leaves the range
        assert!(cpu.holds(11), "less than");
        cpu.flags.negative = true;
        assert!(cpu.holds(10), "greater or equal");
    }

    #[test]
    fn an_it_block_of_three_ends_after_three() {
        let mut cpu = Cpu {
            it: 0b0000_1010, // ITET EQ: mask 1010 holds for two more
            ..Cpu::default()
        };
        cpu.flags.zero = true;
        assert!(cpu.passes_it());
        assert!(!cpu.passes_it());
        assert!(cpu.passes_it() || cpu.it == 0);
        assert_eq!(cpu.it, 0);
    }

    #[test]
    fn basepri_max_only_masks_more() {
        let mut cpu = Cpu::default();
        cpu.set_special(18, 0, 0x40);
        cpu.set_special(18, 0, 0x80);
        cpu.set_special(18, 0, 0);
        assert_eq!(cpu.masks.basepri, 0x40);
        cpu.set_special(18, 0, 0x20);
        assert_eq!(cpu.masks.basepri, 0x20);
    }

    #[test]
    fn the_process_stack_is_banked() {
        let mut cpu = Cpu::default();
        cpu.r[SP] = 0x2000_1000;
        cpu.set_special(9, 0, 0x2000_0800);
        cpu.set_special(20, 0, CONTROL_PROCESS_STACK);
        assert_eq!(cpu.r[SP], 0x2000_0800);
        assert_eq!(cpu.special(8), 0x2000_1000);
    }

    proptest! {
        #[test]
        fn xpsr_comes_back_as_it_was(flags: u32, it: u8, exception in 0u8..98) {
            let mut cpu = Cpu { it, exception, ..Cpu::default() };
            cpu.set_apsr(flags);
            let mut other = Cpu::default();
            other.set_xpsr(cpu.xpsr());
            prop_assert_eq!(other.xpsr(), cpu.xpsr());
            prop_assert_eq!(other.it, it);
        }
    }
}
