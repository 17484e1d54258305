//! The 16-bit encodings (A5.2).
use super::{aligned_pc, bit, bits, branch_target, immediate_shift, signed};
use crate::instruction::{
    AddressMode, Branch, Data, DataOp, ExtendOp, Instruction, LoadKind, Media, Memory, Multiply,
    ReverseOp, SetFlags, Shift, ShortOp, System, Width, NO_OPERAND, NO_REGISTER,
};

const STACK: u8 = 13;

/// The first level of the 16-bit encodings (table A5-1).
pub(super) fn decode(half: u32, address: u32) -> Instruction {
    let high = low_register(half, 8);
    match half >> 11 {
        0..=2 => Instruction::Data(shift_immediate(half)),
        3 => Instruction::Data(add_or_subtract(half)),
        4 => constant(DataOp::Mov, high, 0, half),
        5 => constant(DataOp::Sub, NO_REGISTER, high, half),
        6 => constant(DataOp::Add, high, high, half),
        7 => constant(DataOp::Sub, high, high, half),
        8 if bit(half, 10) => high_registers(half),
        8 => data_processing(half),
        9 => Instruction::Memory(Memory::LoadLiteral {
            kind: LoadKind::Word,
            rt: high,
            address: aligned_pc(address).wrapping_add(byte(half) * 4),
        }),
        10 | 11 => Instruction::Memory(indexed(half)),
        12..=19 => Instruction::Memory(with_offset(half)),
        20 => address_of(high, aligned_pc(address).wrapping_add(byte(half) * 4)),
        21 => offset_to(DataOp::Add, high, byte(half) * 4),
        22 | 23 => miscellaneous(half, address),
        24 | 25 => Instruction::Memory(multiple(half)),
        26 | 27 => conditional(half, address),
        28 => Instruction::Branch(Branch::Direct {
            condition: 14,
            target: branch_target(address, signed(bits(half, 0, 11) << 1, 12)),
        }),
        _ => Instruction::Undefined,
    }
}

fn low_register(half: u32, low: u32) -> u8 {
    bits(half, low, 3) as u8
}

fn byte(half: u32) -> u32 {
    bits(half, 0, 8)
}

fn shift_immediate(half: u32) -> Data {
    let (shift, amount) = immediate_shift(half >> 11, bits(half, 6, 5));
    Data::Register {
        op: DataOp::Mov,
        flags: SetFlags::OutsideIt,
        rd: low_register(half, 0),
        rn: 0,
        rm: low_register(half, 3),
        shift,
        amount,
    }
}

fn add_or_subtract(half: u32) -> Data {
    let op = if bit(half, 9) {
        DataOp::Sub
    } else {
        DataOp::Add
    };
    let (rd, rn) = (low_register(half, 0), low_register(half, 3));
    if bit(half, 10) {
        plain_immediate(op, SetFlags::OutsideIt, rd, rn, bits(half, 6, 3))
    } else {
        plain_register(op, SetFlags::OutsideIt, rd, rn, low_register(half, 6))
    }
}

fn plain_immediate(op: DataOp, flags: SetFlags, rd: u8, rn: u8, value: u32) -> Data {
    Data::Immediate {
        op,
        flags,
        rd,
        rn,
        value,
        carry: None,
    }
}

fn plain_register(op: DataOp, flags: SetFlags, rd: u8, rn: u8, rm: u8) -> Data {
    Data::Register {
        op,
        flags,
        rd,
        rn,
        rm,
        shift: Shift::Left,
        amount: 0,
    }
}

/// An operation with an 8-bit constant; a comparison always sets the flags.
fn constant(op: DataOp, rd: u8, rn: u8, half: u32) -> Instruction {
    let flags = match rd {
        NO_REGISTER => SetFlags::Yes,
        _ => SetFlags::OutsideIt,
    };
    Instruction::Data(plain_immediate(op, flags, rd, rn, byte(half)))
}

fn address_of(rd: u8, value: u32) -> Instruction {
    Instruction::Data(plain_immediate(DataOp::Mov, SetFlags::No, rd, 0, value))
}

fn offset_to(op: DataOp, rd: u8, value: u32) -> Instruction {
    Instruction::Data(plain_immediate(op, SetFlags::No, rd, STACK, value))
}

/// Table A5-3: operations on two low registers.
fn data_processing(half: u32) -> Instruction {
    let (rdn, rm) = (low_register(half, 0), low_register(half, 3));
    let set = |op| plain_register(op, SetFlags::OutsideIt, rdn, rdn, rm);
    let compare = |op| plain_register(op, SetFlags::Yes, NO_REGISTER, rdn, rm);
    let shift = |shift| Data::Shift {
        shift,
        flags: SetFlags::OutsideIt,
        rd: rdn,
        rn: rdn,
        rm,
    };
    Instruction::Data(match bits(half, 6, 4) {
        0 => set(DataOp::And),
        1 => set(DataOp::Eor),
        2 => shift(Shift::Left),
        3 => shift(Shift::Right),
        4 => shift(Shift::ArithmeticRight),
        5 => set(DataOp::Adc),
        6 => set(DataOp::Sbc),
        7 => shift(Shift::Rotate),
        8 => compare(DataOp::And),
        9 => plain_immediate(DataOp::Rsb, SetFlags::OutsideIt, rdn, rm, 0),
        10 => compare(DataOp::Sub),
        11 => compare(DataOp::Add),
        12 => set(DataOp::Orr),
        13 => return Instruction::Multiply(multiply(rdn, rm)),
        14 => set(DataOp::Bic),
        _ => set(DataOp::Mvn),
    })
}

fn multiply(rdn: u8, rm: u8) -> Multiply {
    Multiply::Short {
        op: ShortOp::Add,
        flags: SetFlags::OutsideIt,
        rd: rdn,
        rn: rdn,
        rm,
        ra: NO_OPERAND,
    }
}

/// Table A5-4: operations that reach the upper registers.
fn high_registers(half: u32) -> Instruction {
    let rdn = (bits(half, 7, 1) << 3 | bits(half, 0, 3)) as u8;
    let rm = bits(half, 3, 4) as u8;
    match bits(half, 8, 2) {
        0 => Instruction::Data(plain_register(DataOp::Add, SetFlags::No, rdn, rdn, rm)),
        1 => {
            let compare = plain_register(DataOp::Sub, SetFlags::Yes, NO_REGISTER, rdn, rm);
            Instruction::Data(compare)
        }
        2 => Instruction::Data(plain_register(DataOp::Mov, SetFlags::No, rdn, 0, rm)),
        _ if bit(half, 7) => Instruction::Branch(Branch::LinkExchange { rm }),
        _ => Instruction::Branch(Branch::Exchange { rm }),
    }
}

/// Loads and stores with a register as offset (table A5-5).
fn indexed(half: u32) -> Memory {
    let (rt, rn, rm) = (
        low_register(half, 0),
        low_register(half, 3),
        low_register(half, 6),
    );
    let load = |kind| Memory::LoadIndexed {
        kind,
        rt,
        rn,
        rm,
        shift: 0,
    };
    let store = |width| Memory::StoreIndexed {
        width,
        rt,
        rn,
        rm,
        shift: 0,
    };
    match bits(half, 9, 3) {
        0 => store(Width::Word),
        1 => store(Width::Half),
        2 => store(Width::Byte),
        3 => load(LoadKind::SignedByte),
        4 => load(LoadKind::Word),
        5 => load(LoadKind::Half),
        6 => load(LoadKind::Byte),
        _ => load(LoadKind::SignedHalf),
    }
}

/// Loads and stores with a constant as offset (table A5-5).
fn with_offset(half: u32) -> Memory {
    let (rt, rn, offset) = (
        low_register(half, 0),
        low_register(half, 3),
        bits(half, 6, 5) as i32,
    );
    let stack = (low_register(half, 8), STACK, byte(half) as i32 * 4);
    match half >> 11 {
        12 => store(Width::Word, (rt, rn, offset * 4)),
        13 => load(LoadKind::Word, (rt, rn, offset * 4)),
        14 => store(Width::Byte, (rt, rn, offset)),
        15 => load(LoadKind::Byte, (rt, rn, offset)),
        16 => store(Width::Half, (rt, rn, offset * 2)),
        17 => load(LoadKind::Half, (rt, rn, offset * 2)),
        18 => store(Width::Word, stack),
        _ => load(LoadKind::Word, stack),
    }
}

fn load(kind: LoadKind, (rt, rn, offset): (u8, u8, i32)) -> Memory {
    Memory::Load {
        kind,
        rt,
        rn,
        offset,
        mode: AddressMode::Offset,
    }
}

fn store(width: Width, (rt, rn, offset): (u8, u8, i32)) -> Memory {
    Memory::Store {
        width,
        rt,
        rn,
        offset,
        mode: AddressMode::Offset,
    }
}

/// Operations on the stack and others (table A5-6).
fn miscellaneous(half: u32, address: u32) -> Instruction {
    let (rd, rm) = (low_register(half, 0), low_register(half, 3));
    match bits(half, 8, 4) {
        0 if bit(half, 7) => offset_to(DataOp::Sub, STACK, bits(half, 0, 7) << 2),
        0 => offset_to(DataOp::Add, STACK, bits(half, 0, 7) << 2),
        1 | 3 | 9 | 11 => Instruction::Branch(Branch::Compare {
            nonzero: bit(half, 11),
            rn: rd,
            target: branch_target(
                address,
                (bits(half, 9, 1) << 6 | bits(half, 3, 5) << 1) as i32,
            ),
        }),
        2 => Instruction::Media(extend(half)),
        4 | 5 => Instruction::Memory(Memory::StoreMultiple {
            rn: STACK,
            list: (byte(half) | bits(half, 8, 1) << 14) as u16,
            writeback: true,
            before: true,
        }),
        6 if half & 0xFFE8 == 0xB660 => Instruction::System(System::ChangeState {
            disable: bit(half, 4),
            primask: bit(half, 1),
            faultmask: bit(half, 0),
        }),
        10 => reverse(half, rd, rm),
        12 | 13 => Instruction::Memory(Memory::LoadMultiple {
            rn: STACK,
            list: (byte(half) | bits(half, 8, 1) << 15) as u16,
            writeback: true,
            before: false,
        }),
        14 => Instruction::System(System::Breakpoint),
        15 => hint_or_if_then(half),
        _ => Instruction::Undefined,
    }
}

fn extend(half: u32) -> Media {
    Media::Extend {
        op: if bit(half, 6) {
            ExtendOp::Byte
        } else {
            ExtendOp::Half
        },
        signed: !bit(half, 7),
        rd: low_register(half, 0),
        rn: NO_OPERAND,
        rm: low_register(half, 3),
        rotation: 0,
    }
}

fn reverse(half: u32, rd: u8, rm: u8) -> Instruction {
    let op = match bits(half, 6, 2) {
        0 => ReverseOp::Bytes,
        1 => ReverseOp::BytesInHalves,
        3 => ReverseOp::SignedHalf,
        _ => return Instruction::Undefined,
    };
    Instruction::Media(Media::Reverse { op, rd, rm })
}

/// Hints, and IT (table A5-7).
fn hint_or_if_then(half: u32) -> Instruction {
    if bits(half, 0, 4) != 0 {
        let state = byte(half) as u8;
        return Instruction::Branch(Branch::IfThen { state });
    }
    Instruction::System(super::branch::hint(bits(half, 4, 4)))
}

fn multiple(half: u32) -> Memory {
    let (rn, list) = (low_register(half, 8), byte(half) as u16);
    if bit(half, 11) {
        Memory::LoadMultiple {
            rn,
            list,
            writeback: list >> rn & 1 == 0,
            before: false,
        }
    } else {
        Memory::StoreMultiple {
            rn,
            list,
            writeback: true,
            before: false,
        }
    }
}

/// Conditional branches, and SVC (table A5-8).
fn conditional(half: u32, address: u32) -> Instruction {
    match bits(half, 8, 4) {
        14 => Instruction::Undefined,
        15 => Instruction::System(System::SupervisorCall),
        condition => Instruction::Branch(Branch::Direct {
            condition: condition as u8,
            target: branch_target(address, signed(byte(half) << 1, 9)),
        }),
    }
}
