//! The 32-bit encodings with register operands only: shifts, extensions, lanes, products, quotients
//! (A5.3.12 to A5.3.17).
use super::{bit, bits, register};
use crate::instruction::{
    Data, ExtendOp, Instruction, LaneOp, LaneResult, LongOp, Media, Multiply, ReverseOp, SetFlags,
    Shift, ShortOp, NO_OPERAND,
};

/// Table A5-9, the rows with op1 = 3 and a register as second operand.
pub(super) fn on_registers(word: u32) -> Instruction {
    match bits(word, 23, 2) {
        0 | 1 => data_processing(word),
        2 => short(word),
        _ => long(word),
    }
}

/// The registers of an operation with two operands.
struct Operands {
    rd: u8,
    rn: u8,
    rm: u8,
}

fn operands(word: u32) -> Operands {
    Operands {
        rd: register(word, 8),
        rn: register(word, 16),
        rm: register(word, 0),
    }
}

/// Shifts, extensions and lanes (table A5-24).
fn data_processing(word: u32) -> Instruction {
    let (first, second) = (bits(word, 20, 4), bits(word, 4, 4));
    if bits(word, 12, 4) != 15 {
        return Instruction::Undefined;
    }
    match (first, second) {
        (0..=7, 0) => Instruction::Data(shift(word)),
        (0..=5, 8..) => Instruction::Media(extend(word)),
        (8.., 0..=7) => parallel(word),
        (8.., 8..=11) => miscellaneous(first, second, operands(word)),
        _ => Instruction::Undefined,
    }
}

fn shift(word: u32) -> Data {
    let Operands { rd, rn, rm } = operands(word);
    Data::Shift {
        shift: match bits(word, 21, 2) {
            0 => Shift::Left,
            1 => Shift::Right,
            2 => Shift::ArithmeticRight,
            _ => Shift::Rotate,
        },
        flags: if bit(word, 20) {
            SetFlags::Yes
        } else {
            SetFlags::No
        },
        rd,
        rn,
        rm,
    }
}

fn extend(word: u32) -> Media {
    let Operands { rd, rn, rm } = operands(word);
    Media::Extend {
        op: match bits(word, 21, 2) {
            0 => ExtendOp::Half,
            1 => ExtendOp::TwoBytes,
            _ => ExtendOp::Byte,
        },
        signed: !bit(word, 20),
        rd,
        rn: if rn == 15 { NO_OPERAND } else { rn },
        rm,
        rotation: bits(word, 4, 2) as u8 * 8,
    }
}

/// Parallel additions and subtractions (tables A5-25 and A5-26).
fn parallel(word: u32) -> Instruction {
    let Operands { rd, rn, rm } = operands(word);
    let op = match bits(word, 20, 3) {
        0 => LaneOp::Add8,
        1 => LaneOp::Add16,
        2 => LaneOp::AddSubtractExchanged,
        4 => LaneOp::Subtract8,
        5 => LaneOp::Subtract16,
        6 => LaneOp::SubtractAddExchanged,
        _ => return Instruction::Undefined,
    };
    let result = match bits(word, 4, 2) {
        0 => LaneResult::Wrap,
        1 => LaneResult::Saturate,
        2 => LaneResult::Halve,
        _ => return Instruction::Undefined,
    };
    Instruction::Media(Media::Parallel {
        op,
        signed: !bit(word, 6),
        result,
        rd,
        rn,
        rm,
    })
}

/// Saturating additions, reversals, SEL and CLZ (table A5-27).
fn miscellaneous(first: u32, second: u32, operands: Operands) -> Instruction {
    let Operands { rd, rn, rm } = operands;
    let reverse = |op| Media::Reverse { op, rd, rm };
    Instruction::Media(match (first, second) {
        (8, _) => Media::SaturatingAdd {
            double: second & 1 != 0,
            subtract: second & 2 != 0,
            rd,
            rn,
            rm,
        },
        (9, 8) => reverse(ReverseOp::Bytes),
        (9, 9) => reverse(ReverseOp::BytesInHalves),
        (9, 10) => reverse(ReverseOp::Bits),
        (9, 11) => reverse(ReverseOp::SignedHalf),
        (10, 8) => Media::Select { rd, rn, rm },
        (11, 8) => reverse(ReverseOp::LeadingZeros),
        _ => return Instruction::Undefined,
    })
}

/// Table A5-28: products of 32 bits.
fn short(word: u32) -> Instruction {
    let Operands { rd, rn, rm } = operands(word);
    let (low, high) = (bit(word, 4), bit(word, 5));
    let op = match (bits(word, 20, 3), high) {
        _ if bits(word, 6, 2) != 0 => return Instruction::Undefined,
        (0, false) if low => ShortOp::Subtract,
        (0, false) => ShortOp::Add,
        (1, n_top) => ShortOp::Halves { n_top, m_top: low },
        (3, false) => ShortOp::WordByHalf { m_top: low },
        (code @ (2 | 4), false) => ShortOp::Dual {
            subtract: code == 4,
            exchange: low,
        },
        (code @ (5 | 6), false) => ShortOp::Top {
            subtract: code == 6,
            round: low,
        },
        (7, false) if !low => ShortOp::AbsoluteDifferences,
        _ => return Instruction::Undefined,
    };
    Instruction::Multiply(Multiply::Short {
        op,
        flags: SetFlags::No,
        rd,
        rn,
        rm,
        ra: register(word, 12),
    })
}

/// Table A5-29: products of 64 bits, and quotients.
fn long(word: u32) -> Instruction {
    let Operands { rd, rn, rm } = operands(word);
    let second = bits(word, 4, 4);
    let (low, high) = (bit(word, 4), bit(word, 5));
    let op = match (bits(word, 20, 3), second) {
        (code @ (1 | 3), 15) => {
            let signed = code == 1;
            return Instruction::Multiply(Multiply::Divide { signed, rd, rn, rm });
        }
        (code @ (0 | 4), 0) => LongOp::Signed {
            accumulate: code == 4,
        },
        (code @ (2 | 6), 0) => LongOp::Unsigned {
            accumulate: code == 6,
        },
        (4, 8..=11) => LongOp::Halves {
            n_top: high,
            m_top: low,
        },
        (code @ (4 | 5), 12 | 13) => LongOp::Dual {
            subtract: code == 5,
            exchange: low,
        },
        (6, 6) => LongOp::UnsignedPlusBoth,
        _ => return Instruction::Undefined,
    };
    Instruction::Multiply(Multiply::Long {
        op,
        low: register(word, 12),
        high: rd,
        rn,
        rm,
    })
}
