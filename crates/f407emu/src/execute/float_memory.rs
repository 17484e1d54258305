//! Moves floating-point registers to and from the memory and the core.
use super::memory::must_be_word_aligned;
use crate::{
    instruction::{Direction, Float},
    machine::Machine,
    trap::Trap,
};

/// The bits of FPSCR that exist.
const FPSCR_MASK: u32 = 0xF7C0_009F;

impl Machine {
    /// Carries out loads, stores and transfers, and returns their cycles. Calculations are carried
    /// out elsewhere, and take no cycles here.
    pub(super) fn move_float(&mut self, float: Float) -> Result<u32, Trap> {
        match float {
            Float::Memory {
                direction,
                sd,
                count,
                rn,
                offset,
            } => {
                let address = self.float_address(rn, offset);
                self.move_floats(direction, address, sd, count)?;
                Ok(1 + u32::from(count))
            }
            Float::Multiple {
                direction,
                sd,
                count,
                rn,
                writeback,
                before,
            } => {
                let (address, base) = self.float_span(rn, count, before);
                self.move_floats(direction, address, sd, count)?;
                self.write_float_base(rn, base, writeback);
                Ok(1 + u32::from(count))
            }
            other => Ok(self.transfer_float(other)),
        }
    }

    /// Transfers between the registers of the core and of the unit; returns their cycles.
    fn transfer_float(&mut self, float: Float) -> u32 {
        match float {
            Float::FromCore { sn, rt } => self.set_s(sn, self.cpu.get(rt)),
            Float::ToCore { sn, rt } => self.cpu.set(rt, self.s(sn)),
            Float::FromCorePair { sm, rt, rt2 } => {
                self.set_s(sm, self.cpu.get(rt));
                self.set_s(sm + 1, self.cpu.get(rt2));
                return 2;
            }
            Float::ToCorePair { sm, rt, rt2 } => {
                self.cpu.set(rt, self.s(sm));
                self.cpu.set(rt2, self.s(sm + 1));
                return 2;
            }
            Float::ReadStatus { rt: 15 } => {
                let kept = self.cpu.xpsr() & 0x080F_0000;
                self.cpu.set_apsr(self.cpu.fpscr & 0xF000_0000 | kept);
            }
            Float::ReadStatus { rt } => self.cpu.set(rt, self.cpu.fpscr),
            Float::WriteStatus { rt } => self.cpu.fpscr = self.cpu.get(rt) & FPSCR_MASK,
            Float::Binary { .. }
            | Float::MultiplyAdd { .. }
            | Float::Unary { .. }
            | Float::Constant { .. }
            | Float::Compare { .. }
            | Float::CompareZero { .. }
            | Float::ToInteger { .. }
            | Float::FromInteger { .. }
            | Float::ToFixed { .. }
            | Float::FromFixed { .. }
            | Float::Memory { .. }
            | Float::Multiple { .. } => {}
        }
        1
    }

    /// A register's bit pattern.
    #[inline(always)]
    pub(super) fn s(&self, register: u8) -> u32 {
        self.cpu.s[usize::from(register & 31)]
    }

    #[inline(always)]
    pub(super) fn set_s(&mut self, register: u8, value: u32) {
        self.cpu.s[usize::from(register & 31)] = value;
    }

    /// The address of an access. Register 15 as base is the word-aligned program counter.
    fn float_address(&self, rn: u8, offset: i16) -> u32 {
        let base = self.cpu.get(rn);
        let base = if rn == 15 { base & !3 } else { base };
        base.wrapping_add_signed(i32::from(offset))
    }

    fn float_span(&self, rn: u8, count: u8, before: bool) -> (u32, u32) {
        let (base, size) = (self.cpu.get(rn), 4 * u32::from(count));
        if before {
            (base.wrapping_sub(size), base.wrapping_sub(size))
        } else {
            (base, base.wrapping_add(size))
        }
    }

    fn write_float_base(&mut self, rn: u8, base: u32, writeback: bool) {
        if writeback {
            self.cpu.set(rn, base);
        }
    }

    fn move_floats(
        &mut self,
        direction: Direction,
        address: u32,
        first: u8,
        count: u8,
    ) -> Result<(), Trap> {
        must_be_word_aligned(address)?;
        for index in 0..count {
            let address = address.wrapping_add(4 * u32::from(index));
            match direction {
                Direction::Load => {
                    let value = self.read_word(address)?;
                    self.set_s(first + index, value);
                }
                Direction::Store => self.write_word(address, self.s(first + index))?,
            }
        }
        Ok(())
    }
}
