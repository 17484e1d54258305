//! Products and quotients.
use super::arithmetic::half;
use crate::{
    instruction::{LongOp, Multiply, SetFlags, ShortOp, NO_OPERAND},
    machine::Machine,
    trap::Trap,
};

impl Machine {
    pub(super) fn execute_multiply(&mut self, multiply: Multiply) -> Result<(), Trap> {
        match multiply {
            Multiply::Short {
                op,
                flags,
                rd,
                rn,
                rm,
                ra,
            } => self.multiply_short(op, flags, rd, (rn, rm, ra)),
            Multiply::Long {
                op,
                low,
                high,
                rn,
                rm,
            } => self.multiply_long(op, (low, high), rn, rm),
            Multiply::Divide { signed, rd, rn, rm } => self.divide(signed, rd, rn, rm)?,
        }
        self.spend(1);
        Ok(())
    }

    fn multiply_short(&mut self, op: ShortOp, flags: SetFlags, rd: u8, operands: (u8, u8, u8)) {
        let (rn, rm, ra) = operands;
        let (n, m) = (self.cpu.get(rn), self.cpu.get(rm));
        let addend = if ra == NO_OPERAND {
            0
        } else {
            self.cpu.get(ra)
        };
        let wide = i64::from(addend as i32);
        let value = match op {
            ShortOp::Add => n.wrapping_mul(m).wrapping_add(addend),
            ShortOp::Subtract => {
                self.cycle += 1;
                self.cpu.get(ra).wrapping_sub(n.wrapping_mul(m))
            }
            ShortOp::Halves { n_top, m_top } => {
                self.note_overflow(half(n, n_top) * half(m, m_top) + wide)
            }
            ShortOp::WordByHalf { m_top } => {
                let product = i64::from(n as i32) * half(m, m_top);
                self.note_overflow((product >> 16) + wide)
            }
            ShortOp::Dual { subtract, exchange } => {
                self.note_overflow(dual(n, m, subtract, exchange) + wide)
            }
            ShortOp::Top { subtract, round } => top(n, m, addend, subtract, round),
            ShortOp::AbsoluteDifferences => absolute_differences(n, m).wrapping_add(addend),
        };
        if self.sets_flags(flags) {
            self.cpu.set_sign(value);
        }
        self.cpu.set(rd, value);
    }

    /// Sets Q if a sum leaves the range of 32 bits. Returns the lower 32 bits.
    fn note_overflow(&mut self, sum: i64) -> u32 {
        self.cpu.flags.saturated |= i32::try_from(sum).is_err();
        sum as u32
    }

    fn multiply_long(&mut self, op: LongOp, (low, high): (u8, u8), rn: u8, rm: u8) {
        let (n, m) = (self.cpu.get(rn), self.cpu.get(rm));
        let (low_value, high_value) = (self.cpu.get(low), self.cpu.get(high));
        let sum = u64::from(high_value) << 32 | u64::from(low_value);
        let unsigned = u64::from(n) * u64::from(m);
        let signed = (i64::from(n as i32) * i64::from(m as i32)) as u64;
        let value = match op {
            LongOp::Unsigned { accumulate: false } => unsigned,
            LongOp::Unsigned { accumulate: true } => sum.wrapping_add(unsigned),
            LongOp::Signed { accumulate: false } => signed,
            LongOp::Signed { accumulate: true } => sum.wrapping_add(signed),
            LongOp::UnsignedPlusBoth => unsigned + u64::from(low_value) + u64::from(high_value),
            LongOp::Halves { n_top, m_top } => {
                sum.wrapping_add((half(n, n_top) * half(m, m_top)) as u64)
            }
            LongOp::Dual { subtract, exchange } => {
                sum.wrapping_add(dual(n, m, subtract, exchange) as u64)
            }
        };
        self.cpu.set(low, value as u32);
        self.cpu.set(high, (value >> 32) as u32);
    }

    /// Divides. The divider takes a cycle for each four bits of the quotient.
    fn divide(&mut self, signed: bool, rd: u8, rn: u8, rm: u8) -> Result<(), Trap> {
        let (n, m) = (self.cpu.get(rn), self.cpu.get(rm));
        if m == 0 && self.scb.traps_division() {
            return Err(Trap::DivideByZero);
        }
        let (value, dividend, divisor) = if signed {
            let (n, m) = (n as i32, m as i32);
            let quotient = if m == 0 { 0 } else { n.wrapping_div(m) };
            (quotient as u32, n.unsigned_abs(), m.unsigned_abs())
        } else {
            (n.checked_div(m).unwrap_or(0), n, m)
        };
        let bits = divisor
            .leading_zeros()
            .saturating_sub(dividend.leading_zeros());
        self.cycle += if divisor == 0 || dividend < divisor {
            1
        } else {
            u64::from(4 + bits / 4).min(11)
        };
        self.cpu.set(rd, value);
        Ok(())
    }
}

/// The sum or difference of two products of halves.
fn dual(n: u32, m: u32, subtract: bool, exchange: bool) -> i64 {
    let low = half(n, false) * half(m, exchange);
    let high = half(n, true) * half(m, !exchange);
    if subtract {
        low - high
    } else {
        low + high
    }
}

/// The upper word of a product, added to or subtracted from another upper word.
fn top(n: u32, m: u32, addend: u32, subtract: bool, round: bool) -> u32 {
    let product = i64::from(n as i32) * i64::from(m as i32);
    let addend = i64::from(addend) << 32;
    let sum = if subtract {
        addend.wrapping_sub(product)
    } else {
        addend.wrapping_add(product)
    };
    (sum.wrapping_add(if round { 1 << 31 } else { 0 }) >> 32) as u32
}

fn absolute_differences(n: u32, m: u32) -> u32 {
    let pairs = n.to_le_bytes().into_iter().zip(m.to_le_bytes());
    pairs.map(|(n, m)| u32::from(n.abs_diff(m))).sum()
}
