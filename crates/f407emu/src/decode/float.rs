//! The encodings of the floating-point unit (A6.4 to A6.7). FPv4-SP can move doubles, but cannot
//! calculate with them.
//!
//! Not modelled: VCVTB and VCVTT (half precision), which decode as undefined.
use super::{bit, bits, register};
use crate::instruction::{Direction, Float, FloatOp, FloatUnary, Instruction};

/// Decodes any of these instructions (table A6-1). Coprocessors other than 10 and 11 do not exist.
pub(super) fn decode(word: u32) -> Instruction {
    if bits(word, 9, 3) != 5 || bit(word, 28) {
        return Instruction::Undefined;
    }
    let float = match (bits(word, 24, 2), bit(word, 4)) {
        (2, false) => calculation(word),
        (2, true) => transfer(word),
        (0, _) if bits(word, 21, 4) == 2 => transfer_pair(word),
        (0 | 1, _) => load_or_store(word),
        _ => None,
    };
    float.map_or(Instruction::Undefined, Instruction::Float)
}

/// Returns true if the operands are 64-bit registers.
fn is_double(word: u32) -> bool {
    bit(word, 8)
}

fn sd(word: u32) -> u8 {
    (bits(word, 12, 4) << 1 | bits(word, 22, 1)) as u8
}

fn sn(word: u32) -> u8 {
    (bits(word, 16, 4) << 1 | bits(word, 7, 1)) as u8
}

fn sm(word: u32) -> u8 {
    (bits(word, 0, 4) << 1 | bits(word, 5, 1)) as u8
}

/// Calculations (table A6-2).
fn calculation(word: u32) -> Option<Float> {
    if is_double(word) {
        return None;
    }
    let second = bit(word, 6);
    let multiply_add = |fused, negate_product, negate_addend| Float::MultiplyAdd {
        fused,
        negate_product,
        negate_addend,
        sd: sd(word),
        sn: sn(word),
        sm: sm(word),
    };
    let binary = |op| Float::Binary {
        op,
        sd: sd(word),
        sn: sn(word),
        sm: sm(word),
    };
    Some(match (bit(word, 23), bits(word, 20, 2), second) {
        (false, 0, negative) => multiply_add(false, negative, false),
        (false, 1, negative) => multiply_add(false, negative, true),
        (false, 2, false) => binary(FloatOp::Multiply),
        (false, 2, true) => binary(FloatOp::NegatedMultiply),
        (false, _, false) => binary(FloatOp::Add),
        (false, _, true) => binary(FloatOp::Subtract),
        (true, 0, false) => binary(FloatOp::Divide),
        (true, 1, negative) => multiply_add(true, negative, true),
        (true, 2, negative) => multiply_add(true, negative, false),
        (true, 3, _) => return other(word),
        (true, ..) => return None,
    })
}

/// Operations with one operand, conversions and constants (table A6-3).
fn other(word: u32) -> Option<Float> {
    let (sd, sm) = (sd(word), sm(word));
    let unary = |op| Float::Unary { op, sd, sm };
    let code = bits(word, 16, 4);
    if !bit(word, 6) {
        let bits = expand(bits(word, 16, 4) << 4 | bits(word, 0, 4));
        return Some(Float::Constant { sd, bits });
    }
    Some(match (code, bit(word, 7)) {
        (0, false) => unary(FloatUnary::Move),
        (0, true) => unary(FloatUnary::Absolute),
        (1, false) => unary(FloatUnary::Negate),
        (1, true) => unary(FloatUnary::SquareRoot),
        (4, _) => Float::Compare { sd, sm },
        (5, _) => Float::CompareZero { sd },
        (8, signed) => Float::FromInteger { signed, sd, sm },
        (12 | 13, toward_zero) => Float::ToInteger {
            signed: code == 13,
            toward_zero,
            sd,
            sm,
        },
        (10 | 11 | 14 | 15, wide) => return fixed(word, wide),
        _ => return None,
    })
}

/// VFPExpandImm (A6.4.1): sign, three bits of exponent, four of fraction.
fn expand(constant: u32) -> u32 {
    let exponent = if bit(constant, 6) {
        0x1F << 25
    } else {
        1 << 30
    };
    bits(constant, 7, 1) << 31 | exponent | bits(constant, 0, 6) << 19
}

fn fixed(word: u32, wide: bool) -> Option<Float> {
    let bits_used: i8 = if wide { 32 } else { 16 };
    let integer = (bits(word, 0, 4) << 1 | bits(word, 5, 1)) as i8;
    // A fixed-point number with more integer bits than its width is UNPREDICTABLE; as in QEMU it is
    // scaled all the same.
    let fraction = bits_used - integer;
    let (signed, sd) = (!bit(word, 16), sd(word));
    Some(if bit(word, 18) {
        Float::ToFixed {
            signed,
            bits: bits_used as u8,
            fraction,
            sd,
        }
    } else {
        Float::FromFixed {
            signed,
            bits: bits_used as u8,
            fraction,
            sd,
        }
    })
}

/// Table A6-6: moves a register to the core or back; a lane is half of a double register.
fn transfer(word: u32) -> Option<Float> {
    let (rt, to_core) = (register(word, 12), bit(word, 20));
    let lane = bits(word, 21, 1) as u8;
    let sn = match (is_double(word), bits(word, 21, 3)) {
        (false, 0) => sn(word),
        (false, 7) if to_core => return Some(Float::ReadStatus { rt }),
        (false, 7) => return Some(Float::WriteStatus { rt }),
        (true, 0 | 1) if !bit(word, 7) => register(word, 16) * 2 + lane,
        _ => return None,
    };
    Some(if to_core {
        Float::ToCore { sn, rt }
    } else {
        Float::FromCore { sn, rt }
    })
}

/// Moves of two registers between the core and the unit (table A6-7).
fn transfer_pair(word: u32) -> Option<Float> {
    let (rt, rt2) = (register(word, 12), register(word, 16));
    let sm = if is_double(word) {
        (bits(word, 5, 1) << 4 | bits(word, 0, 4)) as u8 * 2
    } else {
        sm(word)
    };
    if bits(word, 6, 2) != 0 || !bit(word, 4) || sm > 30 {
        return None;
    }
    Some(if bit(word, 20) {
        Float::ToCorePair { sm, rt, rt2 }
    } else {
        Float::FromCorePair { sm, rt, rt2 }
    })
}

/// Loads and stores (table A6-5).
fn load_or_store(word: u32) -> Option<Float> {
    let (before, add, writeback) = (bit(word, 24), bit(word, 23), bit(word, 21));
    let double = is_double(word);
    let direction = if bit(word, 20) {
        Direction::Load
    } else {
        Direction::Store
    };
    let (sd, rn) = (first_register(word)?, register(word, 16));
    if before && !writeback {
        let magnitude = (bits(word, 0, 8) << 2) as i16;
        return Some(Float::Memory {
            direction,
            sd,
            count: if double { 2 } else { 1 },
            rn,
            offset: if add { magnitude } else { -magnitude },
        });
    }
    let count = bits(word, 0, 8) as u8 & if double { !1 } else { !0 };
    let past_the_end = u32::from(sd) + u32::from(count) > 32;
    if before == add || past_the_end {
        return None;
    }
    Some(Float::Multiple {
        direction,
        sd,
        count,
        rn,
        writeback,
        before,
    })
}

/// The first register; `None` for a double register beyond the sixteen that exist.
fn first_register(word: u32) -> Option<u8> {
    match (is_double(word), bit(word, 22)) {
        (false, _) => Some(sd(word)),
        (true, false) => Some(register(word, 12) * 2),
        (true, true) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_span_an_eighth_to_thirty_one() {
        assert_eq!(f32::from_bits(expand(0x70)), 1.0);
        assert_eq!(f32::from_bits(expand(0x40)), 0.125);
        assert_eq!(f32::from_bits(expand(0xBF)), -31.0);
    }
}
