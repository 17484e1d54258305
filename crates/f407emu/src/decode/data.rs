//! The 32-bit encodings of arithmetic, logic, bit fields and saturation on constants (A5.3.1,
//! A5.3.3, A5.3.11).
use super::{aligned_pc, bit, bits, immediate_shift, register};
use crate::instruction::{
    Data, DataOp, Instruction, Media, SetFlags, Shift, NO_OPERAND, NO_REGISTER,
};

/// Data processing with a constant: a modified one (table A5-10) or a plain one (table A5-12).
pub(super) fn immediate(word: u32, address: u32) -> Instruction {
    if bit(word, 25) {
        return plain(word, address);
    }
    let Some(Operation { op, flags, rd, rn }) = operation(word) else {
        return Instruction::Undefined;
    };
    let (value, carry) = expand(constant12(word));
    Instruction::Data(Data::Immediate {
        op,
        flags,
        rd,
        rn,
        value,
        carry,
    })
}

/// Data processing with a shifted register (table A5-22).
pub(super) fn shifted_register(word: u32) -> Instruction {
    let (shift, amount) = immediate_shift(bits(word, 4, 2), shift_amount(word));
    let rm = register(word, 0);
    if bits(word, 21, 4) == 6 {
        return Instruction::Media(Media::Pack {
            top_first: bit(word, 5),
            rd: register(word, 8),
            rn: register(word, 16),
            rm,
            shift,
            amount,
        });
    }
    let Some(Operation { op, flags, rd, rn }) = operation(word) else {
        return Instruction::Undefined;
    };
    Instruction::Data(Data::Register {
        op,
        flags,
        rd,
        rn,
        rm,
        shift,
        amount,
    })
}

/// The fields that instructions with a modified constant and with a shifted register share.
struct Operation {
    op: DataOp,
    flags: SetFlags,
    rd: u8,
    rn: u8,
}

/// Reads the fields of [`Operation`]. Register 15 as destination makes the operation a comparison,
/// register 15 as first operand makes it a move.
fn operation(word: u32) -> Option<Operation> {
    let (rd, rn) = (register(word, 8), register(word, 16));
    let set = bit(word, 20);
    let code = bits(word, 21, 4);
    let op = match (code, rn) {
        (0, _) => DataOp::And,
        (1, _) => DataOp::Bic,
        (2, 15) => DataOp::Mov,
        (2, _) => DataOp::Orr,
        (3, 15) => DataOp::Mvn,
        (3, _) => DataOp::Orn,
        (4, _) => DataOp::Eor,
        (8, _) => DataOp::Add,
        (10, _) => DataOp::Adc,
        (11, _) => DataOp::Sbc,
        (13, _) => DataOp::Sub,
        (14, _) => DataOp::Rsb,
        _ => return None,
    };
    let compares = matches!(code, 0 | 4 | 8 | 13) && rd == 15 && set;
    Some(Operation {
        op,
        flags: if set { SetFlags::Yes } else { SetFlags::No },
        rd: if compares { NO_REGISTER } else { rd },
        rn,
    })
}

/// Table A5-12: plain constants, bit fields and saturation.
fn plain(word: u32, address: u32) -> Instruction {
    let (rd, rn) = (register(word, 8), register(word, 16));
    let constant = constant12(word);
    let half = (constant | u32::from(rn) << 12) as u16;
    match bits(word, 20, 5) {
        0 => add_constant(DataOp::Add, rd, rn, constant, address),
        10 => add_constant(DataOp::Sub, rd, rn, constant, address),
        4 => Instruction::Data(Data::MoveBottom { rd, value: half }),
        12 => Instruction::Data(Data::MoveTop { rd, value: half }),
        code @ (16 | 18 | 24 | 26) => Instruction::Media(saturate(word, code)),
        code @ (20 | 28) => Instruction::Media(Media::Extract {
            signed: code == 20,
            rd,
            rn,
            lsb: shift_amount(word) as u8,
            width: bits(word, 0, 5) as u8 + 1,
        }),
        22 => insert(word, rd, rn),
        _ => Instruction::Undefined,
    }
}

/// ADDW, SUBW, and ADR if the base is the PC.
fn add_constant(op: DataOp, rd: u8, rn: u8, value: u32, address: u32) -> Instruction {
    let base = aligned_pc(address);
    let (op, value) = match (rn, op) {
        (15, DataOp::Sub) => (DataOp::Mov, base.wrapping_sub(value)),
        (15, _) => (DataOp::Mov, base.wrapping_add(value)),
        (_, op) => (op, value),
    };
    Instruction::Data(Data::Immediate {
        op,
        flags: SetFlags::No,
        rd,
        rn,
        value,
        carry: None,
    })
}

fn saturate(word: u32, code: u32) -> Media {
    let (rd, rn) = (register(word, 8), register(word, 16));
    let signed = code < 20;
    let amount = shift_amount(word) as u8;
    let extra = u8::from(signed);
    match (code & 2 != 0, amount) {
        (true, 0) => Media::SaturateHalves {
            signed,
            bits: bits(word, 0, 4) as u8 + extra,
            rd,
            rn,
        },
        (right, amount) => Media::Saturate {
            signed,
            bits: bits(word, 0, 5) as u8 + extra,
            rd,
            rn,
            shift: if right {
                Shift::ArithmeticRight
            } else {
                Shift::Left
            },
            amount,
        },
    }
}

/// BFI and BFC: the width counts from the lowest to the highest bit of the field.
fn insert(word: u32, rd: u8, rn: u8) -> Instruction {
    let (lsb, msb) = (shift_amount(word), bits(word, 0, 5));
    if msb < lsb {
        return Instruction::Undefined;
    }
    Instruction::Media(Media::Insert {
        rd,
        rn: if rn == 15 { NO_OPERAND } else { rn },
        lsb: lsb as u8,
        width: (msb - lsb + 1) as u8,
    })
}

/// The 5-bit shift amount, which the encoding keeps in two pieces.
fn shift_amount(word: u32) -> u32 {
    bits(word, 12, 3) << 2 | bits(word, 6, 2)
}

/// The 12-bit constant, which the encoding keeps in three pieces.
fn constant12(word: u32) -> u32 {
    bits(word, 26, 1) << 11 | bits(word, 12, 3) << 8 | bits(word, 0, 8)
}

/// ThumbExpandImm_C (A5.3.2): a repeated byte without a carry, or a rotated byte, if the top bit
/// of the result is the carry.
fn expand(constant: u32) -> (u32, Option<bool>) {
    let byte = constant & 0xFF;
    match constant >> 8 {
        0 => (byte, None),
        1 => (byte << 16 | byte, None),
        2 => (byte << 24 | byte << 8, None),
        3 => (byte * 0x0101_0101, None),
        _ => {
            let value = (constant & 0x7F | 0x80).rotate_right(constant >> 7);
            (value, Some(value >> 31 != 0))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_repeated_bytes_or_a_rotated_byte_with_its_carry() {
        assert_eq!(expand(0x0AB), (0xAB, None));
        assert_eq!(expand(0x1AB), (0x00AB_00AB, None));
        assert_eq!(expand(0x2AB), (0xAB00_AB00, None));
        assert_eq!(expand(0x3AB), (0xABAB_ABAB, None));
        assert_eq!(expand(0x400), (0x8000_0000, Some(true)));
        assert_eq!(expand(0xF80), (0x0000_0100, Some(false)));
    }

    #[test]
    fn a_field_whose_highest_bit_is_below_its_lowest_is_undefined() {
        assert_eq!(insert(0x0000_1000, 0, 0), Instruction::Undefined);
    }

    #[test]
    fn the_pc_as_base_makes_an_address() {
        let below = add_constant(DataOp::Sub, 2, 15, 4, 0x0800_0002);
        let Instruction::Data(Data::Immediate { op, value, .. }) = below else {
            panic!("{below:?}");
        };
        assert_eq!((op, value), (DataOp::Mov, 0x0800_0000));
    }
}
