//! Turns halfwords into [`Instruction`]s: Thumb as the Cortex-M4F has it (DDI 0403, chapters A5 and
//! A6).
//!
//! There is one file for each family of encodings. UNPREDICTABLE encodings and wrong bits that
//! should be zero are decoded leniently: a compiler never emits them.
mod branch;
mod data;
mod float;
mod media;
mod memory;
mod narrow;

use crate::instruction::{Instruction, Shift};

/// An instruction and how many bytes it takes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Decoded {
    pub(crate) instruction: Instruction,
    /// The length in bytes, 2 or 4.
    pub(crate) length: u8,
}

/// Returns true if an instruction that begins with this halfword has a second one (A5.1).
pub(crate) fn is_wide(first: u16) -> bool {
    first >= 0xE800
}

/// Decodes the instruction at `address`; `second` is only used if [`is_wide`] is true for `first`.
pub(crate) fn decode(first: u16, second: u16, address: u32) -> Decoded {
    if is_wide(first) {
        let word = u32::from(first) << 16 | u32::from(second);
        Decoded {
            instruction: wide(word, address),
            length: 4,
        }
    } else {
        Decoded {
            instruction: narrow::decode(u32::from(first), address),
            length: 2,
        }
    }
}

/// Table A5-9: the first level of the 32-bit encodings.
fn wide(word: u32, address: u32) -> Instruction {
    match (bits(word, 27, 2), bit(word, 26), bit(word, 25)) {
        (1 | 3, true, _) => float::decode(word),
        (1, false, true) => data::shifted_register(word),
        (1, false, false) => memory::multiple_or_double(word),
        (2, ..) if bit(word, 15) => branch::decode(word, address),
        (2, ..) => data::immediate(word, address),
        (3, false, false) => memory::single(word, address),
        (3, false, true) => media::on_registers(word),
        _ => Instruction::Undefined,
    }
}

/// `width` bits of `word` from bit `low` up.
fn bits(word: u32, low: u32, width: u32) -> u32 {
    word >> low & ((1 << width) - 1)
}

fn bit(word: u32, index: u32) -> bool {
    word >> index & 1 != 0
}

/// A register's number, four bits from `low` up.
fn register(word: u32, low: u32) -> u8 {
    bits(word, low, 4) as u8
}

/// Returns the low `width` bits of a word, sign-extended.
fn signed(value: u32, width: u32) -> i32 {
    let unused = 32 - width;
    (value << unused) as i32 >> unused
}

/// The PC as the instruction at `address` reads it, aligned to a word (A5.1.2).
fn aligned_pc(address: u32) -> u32 {
    address.wrapping_add(4) & !3
}

/// The target of a branch at `address`.
fn branch_target(address: u32, offset: i32) -> u32 {
    address.wrapping_add(4).wrapping_add_signed(offset)
}

/// DecodeImmShift (A7.4.2): a right shift by 0 stands for 32, and a rotation by 0 for RRX.
fn immediate_shift(kind: u32, amount: u32) -> (Shift, u8) {
    match (kind, amount) {
        (0, amount) => (Shift::Left, amount as u8),
        (1, 0) => (Shift::Right, 32),
        (1, amount) => (Shift::Right, amount as u8),
        (2, 0) => (Shift::ArithmeticRight, 32),
        (2, amount) => (Shift::ArithmeticRight, amount as u8),
        (_, 0) => (Shift::RotateWithCarry, 1),
        (_, amount) => (Shift::Rotate, amount as u8),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instruction::*;
    use proptest::prelude::*;

    /// Decodes up to two halfwords at the start of the flash.
    fn decoded(halfwords: &[u16]) -> Instruction {
        let second = halfwords.get(1).copied().unwrap_or(0);
        let decoded = decode(halfwords[0], second, 0x0800_0000);
        assert_eq!(usize::from(decoded.length), 2 * halfwords.len());
        decoded.instruction
    }

    #[test]
    fn the_length_follows_from_the_first_five_bits() {
        assert!(!is_wide(0xE7FF));
        assert!(is_wide(0xE800));
        assert!(is_wide(0xF000));
    }

    #[test]
    fn right_shifts_by_zero_mean_thirty_two_and_rotation_by_zero_takes_the_carry() {
        assert_eq!(immediate_shift(1, 0), (Shift::Right, 32));
        assert_eq!(immediate_shift(2, 0), (Shift::ArithmeticRight, 32));
        assert_eq!(immediate_shift(3, 0), (Shift::RotateWithCarry, 1));
        assert_eq!(immediate_shift(0, 0), (Shift::Left, 0));
    }

    #[test]
    fn what_an_assembler_makes_is_read_back() {
        let adds = Data::Register {
            op: DataOp::Add,
            flags: SetFlags::OutsideIt,
            rd: 0,
            rn: 1,
            rm: 2,
            shift: Shift::Left,
            amount: 0,
        };
        assert_eq!(decoded(&[0x1888]), Instruction::Data(adds)); // adds r0, r1, r2
        let movw = Data::MoveBottom {
            rd: 3,
            value: 0x1234,
        };
        assert_eq!(decoded(&[0xF241, 0x2334]), Instruction::Data(movw)); // movw r3, #0x1234
        let umull = Multiply::Long {
            op: LongOp::Unsigned { accumulate: false },
            low: 0,
            high: 1,
            rn: 2,
            rm: 3,
        };
        assert_eq!(decoded(&[0xFBA2, 0x0103]), Instruction::Multiply(umull)); // umull r0, r1, r2, r3
        let ldrd = Memory::LoadDouble {
            rt: 0,
            rt2: 1,
            rn: 2,
            offset: 8,
            mode: AddressMode::Offset,
        };
        assert_eq!(decoded(&[0xE9D2, 0x0102]), Instruction::Memory(ldrd)); // ldrd r0, r1, [r2, #8]
        let ubfx = Media::Extract {
            signed: false,
            rd: 0,
            rn: 1,
            lsb: 4,
            width: 8,
        };
        assert_eq!(decoded(&[0xF3C1, 0x1007]), Instruction::Media(ubfx)); // ubfx r0, r1, #4, #8
        let vmla = Float::MultiplyAdd {
            fused: false,
            negate_product: false,
            negate_addend: false,
            sd: 0,
            sn: 1,
            sm: 2,
        };
        assert_eq!(decoded(&[0xEE00, 0x0A81]), Instruction::Float(vmla)); // vmla.f32 s0, s1, s2
    }

    #[test]
    fn branches_name_their_target() {
        let back = Branch::Direct {
            condition: 14,
            target: 0x0800_0000,
        };
        assert_eq!(decoded(&[0xE7FE]), Instruction::Branch(back)); // b .
        let call = Branch::Link {
            target: 0x0800_0104,
        };
        assert_eq!(decoded(&[0xF000, 0xF880]), Instruction::Branch(call)); // bl .+0x104
    }

    #[test]
    fn double_precision_arithmetic_is_undefined() {
        assert_eq!(decoded(&[0xEE31, 0x0B02]), Instruction::Undefined); // vadd.f64 d0, d1, d2
    }

    proptest! {
        #[test]
        fn nothing_is_too_strange_to_be_decoded(first: u16, second: u16, address: u32) {
            decode(first, second, address & !1);
        }
    }
}
