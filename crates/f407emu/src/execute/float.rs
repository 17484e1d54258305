//! Single-precision arithmetic (DDI 0403, A2.5). The host's arithmetic carries it out, since both
//! follow IEEE 754 and round to nearest.
//!
//! Not modelled: other rounding modes (except in VCVTR), flush-to-zero, and the cumulative
//! exception flags.
use crate::{
    cpu::CONTROL_FLOAT,
    instruction::{Float, FloatOp, FloatUnary},
    machine::Machine,
    trap::Trap,
};

/// FPSCR: the rounding mode, default NaN, and all bits that FPDSCR sets.
const ROUNDING: u32 = 22;
const DEFAULT_NAN: u32 = 1 << 25;
const DEFAULTS: u32 = 0x07C0_0000;
/// The bit that makes a NaN quiet, and the default NaN.
const QUIET: u32 = 1 << 22;
const NAN: u32 = 0x7FC0_0000;
const SIGN: u32 = 1 << 31;
/// The cycles of a division or a square root, and of a multiplication with addition.
const DIVISION: u32 = 14;
const MULTIPLY_ADD: u32 = 3;

impl Machine {
    pub(super) fn execute_float(&mut self, float: Float) -> Result<(), Trap> {
        self.use_float()?;
        let cycles = match float {
            Float::Binary { op, sd, sn, sm } => self.binary(op, sd, sn, sm),
            Float::MultiplyAdd {
                fused,
                negate_product,
                negate_addend,
                sd,
                sn,
                sm,
            } => self.multiply_add(fused, (negate_product, negate_addend), sd, (sn, sm)),
            Float::Unary { op, sd, sm } => self.unary(op, sd, sm),
            Float::Constant { sd, bits } => self.keep(sd, bits),
            Float::Compare { sd, sm } => self.compare(self.f(sd), self.f(sm)),
            Float::CompareZero { sd } => self.compare(self.f(sd), 0.0),
            Float::ToInteger {
                signed,
                toward_zero,
                sd,
                sm,
            } => {
                let value = self.round(f64::from(self.f(sm)), toward_zero);
                self.keep(sd, to_integer(value, signed, 32))
            }
            Float::FromInteger { signed, sd, sm } => {
                let value = from_integer(self.s(sm), signed, 32) as f32;
                self.keep(sd, value.to_bits())
            }
            Float::ToFixed {
                signed,
                bits,
                fraction,
                sd,
            } => {
                let scaled = f64::from(self.f(sd)) * scale(fraction);
                self.keep(sd, to_integer(scaled.trunc(), signed, bits))
            }
            Float::FromFixed {
                signed,
                bits,
                fraction,
                sd,
            } => {
                let value = from_integer(self.s(sd), signed, bits) / scale(fraction);
                self.keep(sd, (value as f32).to_bits())
            }
            movement => self.move_float(movement)?,
        };
        self.spend(cycles);
        Ok(())
    }

    /// Called before each instruction of the unit. The unit must be on. Registers whose stacking
    /// was deferred go to the stack, and a new floating-point context begins (B1.5.7).
    #[inline(always)]
    fn use_float(&mut self) -> Result<(), Trap> {
        if !self.scb.has_float() {
            return Err(Trap::NoCoprocessor);
        }
        if self.scb.lazy_pending() {
            let address = self.scb.fpcar;
            self.stack_float(address)?;
            self.scb.end_promise();
        }
        if self.cpu.control & CONTROL_FLOAT == 0 && self.scb.notes_float() {
            self.cpu.control |= CONTROL_FLOAT;
            self.cpu.fpscr = self.cpu.fpscr & !DEFAULTS | self.scb.fpdscr & DEFAULTS;
        }
        Ok(())
    }

    #[inline(always)]
    fn f(&self, register: u8) -> f32 {
        f32::from_bits(self.s(register))
    }

    /// Stores a bit pattern in a register. Returns its cost, one cycle.
    fn keep(&mut self, sd: u8, bits: u32) -> u32 {
        self.set_s(sd, bits);
        1
    }

    /// Stores a result in a register. FPSCR.DN makes every NaN the default NaN.
    #[inline(always)]
    fn keep_result(&mut self, sd: u8, value: f32) {
        let default = value.is_nan() && self.cpu.fpscr & DEFAULT_NAN != 0;
        self.set_s(sd, if default { NAN } else { value.to_bits() });
    }

    fn binary(&mut self, op: FloatOp, sd: u8, sn: u8, sm: u8) -> u32 {
        let (a, b) = (self.f(sn), self.f(sm));
        let value = match op {
            FloatOp::Add => a + b,
            FloatOp::Subtract => a - b,
            FloatOp::Multiply | FloatOp::NegatedMultiply => a * b,
            FloatOp::Divide => a / b,
        };
        let value = propagate(value, [a, b]);
        match op {
            FloatOp::NegatedMultiply => self.keep_result(sd, negate(value)),
            FloatOp::Add | FloatOp::Subtract | FloatOp::Multiply => self.keep_result(sd, value),
            FloatOp::Divide => {
                self.keep_result(sd, value);
                return DIVISION;
            }
        }
        1
    }

    fn multiply_add(
        &mut self,
        fused: bool,
        (negate_product, negate_addend): (bool, bool),
        sd: u8,
        (sn, sm): (u8, u8),
    ) -> u32 {
        let (a, b, d) = (self.f(sn), self.f(sm), self.f(sd));
        let addend = if negate_addend { negate(d) } else { d };
        let value = if fused {
            let a = if negate_product { negate(a) } else { a };
            fused_multiply_add(a, b, addend)
        } else {
            let product = propagate(a * b, [a, b]);
            let product = if negate_product {
                negate(product)
            } else {
                product
            };
            propagate(addend + product, [addend, product])
        };
        self.keep_result(sd, value);
        MULTIPLY_ADD
    }

    fn unary(&mut self, op: FloatUnary, sd: u8, sm: u8) -> u32 {
        let bits = self.s(sm);
        match op {
            FloatUnary::Move => self.keep(sd, bits),
            FloatUnary::Absolute => self.keep(sd, bits & !SIGN),
            FloatUnary::Negate => self.keep(sd, bits ^ SIGN),
            FloatUnary::SquareRoot => {
                let value = self.f(sm);
                self.keep_result(sd, propagate(value.sqrt(), [value, value]));
                DIVISION
            }
        }
    }

    /// Sets the flags of FPSCR: less, equal, greater, or unordered.
    fn compare(&mut self, a: f32, b: f32) -> u32 {
        let flags = match a.partial_cmp(&b) {
            Some(core::cmp::Ordering::Less) => 0b1000,
            Some(core::cmp::Ordering::Equal) => 0b0110,
            Some(core::cmp::Ordering::Greater) => 0b0010,
            None => 0b0011,
        };
        self.cpu.fpscr = self.cpu.fpscr & 0x0FFF_FFFF | flags << 28;
        1
    }

    /// Rounds to a whole number, by FPSCR's mode or towards zero.
    fn round(&self, value: f64, toward_zero: bool) -> f64 {
        match self.cpu.fpscr >> ROUNDING & 3 {
            _ if toward_zero => value.trunc(),
            0 => value.round_ties_even(),
            1 => value.ceil(),
            2 => value.floor(),
            _ => value.trunc(),
        }
    }
}

fn negate(value: f32) -> f32 {
    f32::from_bits(value.to_bits() ^ SIGN)
}

fn is_signalling(value: f32) -> bool {
    value.is_nan() && value.to_bits() & QUIET == 0
}

fn quieted(value: f32) -> f32 {
    f32::from_bits(value.to_bits() | QUIET)
}

/// FPProcessNaNs: the first signalling NaN of the operands, made quiet; else the first quiet one;
/// else the default NaN.
fn propagate(value: f32, operands: [f32; 2]) -> f32 {
    if !value.is_nan() {
        return value;
    }
    let first = |test: fn(f32) -> bool| operands.into_iter().find(|&operand| test(operand));
    first(is_signalling)
        .or_else(|| first(f32::is_nan))
        .map_or(f32::from_bits(NAN), quieted)
}

/// FPMulAdd (A2.5.9), with one rounding. A NaN of the addend comes first, unless a factor is a
/// signalling NaN.
fn fused_multiply_add(a: f32, b: f32, addend: f32) -> f32 {
    let value = a.mul_add(b, addend);
    if !value.is_nan() {
        return value;
    }
    let invalid = (a == 0.0 && b.is_infinite()) || (a.is_infinite() && b == 0.0);
    let quiet_addend = addend.is_nan() && !is_signalling(addend);
    if invalid && quiet_addend {
        return f32::from_bits(NAN);
    }
    let operands = [addend, a, b];
    let first = |test: fn(f32) -> bool| operands.into_iter().find(|&operand| test(operand));
    first(is_signalling)
        .or_else(|| first(f32::is_nan))
        .map_or(f32::from_bits(NAN), quieted)
}

/// The nearest integer of `bits` bits; NaN is zero. The casts saturate.
fn to_integer(value: f64, signed: bool, bits: u8) -> u32 {
    match (signed, bits) {
        (true, 16) => value as i16 as u32,
        (false, 16) => u32::from(value as u16),
        (true, _) => value as i32 as u32,
        (false, _) => value as u32,
    }
}

fn from_integer(value: u32, signed: bool, bits: u8) -> f64 {
    match (signed, bits) {
        (true, 16) => f64::from(value as i16),
        (false, 16) => f64::from(value as u16),
        (true, _) => f64::from(value as i32),
        (false, _) => f64::from(value),
    }
}

/// Returns `2^fraction`.
fn scale(fraction: i8) -> f64 {
    2f64.powi(i32::from(fraction))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_nan_wins_but_a_signalling_one_before_it() {
        let quiet = f32::from_bits(0x7FC0_1234);
        let signalling = f32::from_bits(0x7F80_0001);
        assert_eq!(
            propagate(f32::NAN, [quiet, signalling]).to_bits(),
            0x7FC0_0001
        );
        assert_eq!(propagate(f32::NAN, [1.0, quiet]).to_bits(), 0x7FC0_1234);
        assert_eq!(propagate(f32::NAN, [0.0, 0.0]).to_bits(), NAN);
        assert_eq!(propagate(2.0, [1.0, 1.0]), 2.0);
    }

    #[test]
    fn conversions_saturate() {
        assert_eq!(to_integer(3e9, true, 32), i32::MAX as u32);
        assert_eq!(to_integer(-1.0, false, 32), 0);
        assert_eq!(to_integer(-40_000.0, true, 16), -32_768i32 as u32);
        assert_eq!(to_integer(f64::NAN, true, 32), 0);
    }
}
