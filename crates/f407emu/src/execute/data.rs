//! Arithmetic and logic.
use super::arithmetic::{add, shift};
use crate::{
    cpu::SP,
    instruction::{Data, DataOp, SetFlags},
    machine::Machine,
};

impl Machine {
    #[inline(always)]
    pub(super) fn execute_data(&mut self, data: Data) {
        match data {
            Data::Immediate {
                op,
                flags,
                rd,
                rn,
                value,
                carry,
            } => {
                let carry = carry.unwrap_or(self.cpu.flags.carry);
                self.operate(op, flags, rd, rn, (value, carry));
            }
            Data::Register {
                op,
                flags,
                rd,
                rn,
                rm,
                shift: kind,
                amount,
            } => {
                let carry = self.cpu.flags.carry;
                let operand = shift(self.cpu.get(rm), kind, u32::from(amount), carry);
                self.operate(op, flags, rd, rn, operand);
            }
            Data::Shift {
                shift: kind,
                flags,
                rd,
                rn,
                rm,
            } => {
                let amount = self.cpu.get(rm) & 0xFF;
                let operand = shift(self.cpu.get(rn), kind, amount, self.cpu.flags.carry);
                self.operate(DataOp::Mov, flags, rd, rn, operand);
            }
            Data::MoveBottom { rd, value } => self.cpu.set(rd, u32::from(value)),
            Data::MoveTop { rd, value } => {
                let low = self.cpu.get(rd) & 0xFFFF;
                self.cpu.set(rd, low | u32::from(value) << 16);
            }
        }
        self.spend(1);
    }

    /// Carries out an operation on a register and an operand, which comes with the carry of its
    /// shift.
    #[inline(always)]
    fn operate(
        &mut self,
        op: DataOp,
        flags: SetFlags,
        rd: u8,
        rn: u8,
        (operand, shifted_out): (u32, bool),
    ) {
        let (first, carry) = (self.cpu.get(rn), self.cpu.flags.carry);
        let logic = |value| (value, shifted_out, self.cpu.flags.overflow);
        let sum = |a, b, carry| {
            let sum = add(a, b, carry);
            (sum.value, sum.carry, sum.overflow)
        };
        let (value, carry, overflow) = match op {
            DataOp::And => logic(first & operand),
            DataOp::Bic => logic(first & !operand),
            DataOp::Orr => logic(first | operand),
            DataOp::Orn => logic(first | !operand),
            DataOp::Eor => logic(first ^ operand),
            DataOp::Mov => logic(operand),
            DataOp::Mvn => logic(!operand),
            DataOp::Add => sum(first, operand, false),
            DataOp::Adc => sum(first, operand, carry),
            DataOp::Sub => sum(first, !operand, true),
            DataOp::Sbc => sum(first, !operand, carry),
            DataOp::Rsb => sum(!first, operand, true),
        };
        if self.sets_flags(flags) {
            self.cpu.set_sign(value);
            self.cpu.flags.carry = carry;
            self.cpu.flags.overflow = overflow;
        }
        self.write_register(rd, value);
    }

    #[inline(always)]
    pub(super) fn sets_flags(&self, flags: SetFlags) -> bool {
        match flags {
            SetFlags::No => false,
            SetFlags::Yes => true,
            SetFlags::OutsideIt => !self.cpu.in_it,
        }
    }

    /// Writes a result: to the stack pointer word-aligned, to the program counter as a branch, and
    /// nowhere for a comparison.
    #[inline(always)]
    fn write_register(&mut self, rd: u8, value: u32) {
        match rd {
            0..=12 | 14 => self.cpu.set(rd, value),
            13 => self.cpu.r[SP] = value & !3,
            15 => {
                self.branch(value);
                self.cycle += 1;
            }
            _ => {}
        }
    }
}
