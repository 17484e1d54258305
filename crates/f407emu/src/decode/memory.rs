//! The 32-bit encodings of loads and stores (A5.3.5 to A5.3.10).
use super::{aligned_pc, bit, bits, register};
use crate::instruction::{AddressMode, Branch, Instruction, LoadKind, Memory, Width, NO_OPERAND};

/// LDM, STM, LDRD, STRD, exclusives and table branches (A5.3.5, A5.3.6).
pub(super) fn multiple_or_double(word: u32) -> Instruction {
    match (bit(word, 22), bit(word, 24), bit(word, 21)) {
        (false, ..) => multiple(word),
        (true, false, false) => exclusive(word),
        (true, ..) => Instruction::Memory(double(word)),
    }
}

fn multiple(word: u32) -> Instruction {
    let (rn, list) = (register(word, 16), word as u16);
    let writeback = bit(word, 21);
    let before = match bits(word, 23, 2) {
        1 => false,
        2 => true,
        _ => return Instruction::Undefined,
    };
    Instruction::Memory(if bit(word, 20) {
        Memory::LoadMultiple {
            rn,
            list,
            writeback,
            before,
        }
    } else {
        Memory::StoreMultiple {
            rn,
            list,
            writeback,
            before,
        }
    })
}

fn double(word: u32) -> Memory {
    let (rt, rt2, rn) = (register(word, 12), register(word, 8), register(word, 16));
    let offset = offset(word, bits(word, 0, 8) << 2) as i16;
    let mode = mode(bit(word, 24), bit(word, 21));
    if bit(word, 20) {
        Memory::LoadDouble {
            rt,
            rt2,
            rn,
            offset,
            mode,
        }
    } else {
        Memory::StoreDouble {
            rt,
            rt2,
            rn,
            offset,
            mode,
        }
    }
}

/// The signed offset: bit 23 says whether it is added.
fn offset(word: u32, magnitude: u32) -> i32 {
    if bit(word, 23) {
        magnitude as i32
    } else {
        -(magnitude as i32)
    }
}

fn mode(index: bool, writeback: bool) -> AddressMode {
    match (index, writeback) {
        (true, false) => AddressMode::Offset,
        (true, true) => AddressMode::PreIndexed,
        (false, _) => AddressMode::PostIndexed,
    }
}

/// Table A5-17, the rows without indexing.
fn exclusive(word: u32) -> Instruction {
    let (rn, rt, rd) = (register(word, 16), register(word, 12), register(word, 0));
    let load = bit(word, 20);
    if !bit(word, 23) {
        let offset = (bits(word, 0, 8) << 2) as u16;
        let rd = register(word, 8);
        return Instruction::Memory(exclusive_access(load, Width::Word, rd, rt, rn, offset));
    }
    let width = match bits(word, 4, 4) {
        code @ (0 | 1) if load => {
            let width = if code == 0 { Width::Byte } else { Width::Half };
            return Instruction::Branch(Branch::Table { width, rn, rm: rd });
        }
        4 => Width::Byte,
        5 => Width::Half,
        _ => return Instruction::Undefined,
    };
    Instruction::Memory(exclusive_access(load, width, rd, rt, rn, 0))
}

fn exclusive_access(load: bool, width: Width, rd: u8, rt: u8, rn: u8, offset: u16) -> Memory {
    if load {
        Memory::LoadExclusive {
            width,
            rt,
            rn,
            offset,
        }
    } else {
        Memory::StoreExclusive {
            width,
            rd,
            rt,
            rn,
            offset,
        }
    }
}

/// Loads and stores of one register (A5.3.7 to A5.3.10).
pub(super) fn single(word: u32, address: u32) -> Instruction {
    let Some(access) = access(word) else {
        return Instruction::Undefined;
    };
    let (rn, rt) = (register(word, 16), register(word, 12));
    let hint = rt == 15 && matches!(access, Access::Load(kind) if kind != LoadKind::Word);
    match access {
        Access::Load(_) if hint => Instruction::Memory(Memory::Preload),
        Access::Load(kind) if rn == NO_OPERAND => {
            let address = aligned_pc(address).wrapping_add_signed(offset(word, bits(word, 0, 12)));
            Instruction::Memory(Memory::LoadLiteral { kind, rt, address })
        }
        Access::Store(_) if rn == NO_OPERAND => Instruction::Undefined,
        access => addressed(word, access, rt, rn),
    }
}

/// A load or a store of one register, with its width.
#[derive(Clone, Copy)]
enum Access {
    Load(LoadKind),
    Store(Width),
}

fn access(word: u32) -> Option<Access> {
    let (size, signed) = (bits(word, 21, 2), bit(word, 24));
    Some(match (bit(word, 20), signed, size) {
        (true, false, 0) => Access::Load(LoadKind::Byte),
        (true, false, 1) => Access::Load(LoadKind::Half),
        (true, false, 2) => Access::Load(LoadKind::Word),
        (true, true, 0) => Access::Load(LoadKind::SignedByte),
        (true, true, 1) => Access::Load(LoadKind::SignedHalf),
        (false, false, 0) => Access::Store(Width::Byte),
        (false, false, 1) => Access::Store(Width::Half),
        (false, false, 2) => Access::Store(Width::Word),
        _ => return None,
    })
}

/// The three forms of address: 12-bit offset, indexed by a register, 8-bit offset with indexing.
fn addressed(word: u32, access: Access, rt: u8, rn: u8) -> Instruction {
    if bit(word, 23) {
        let offset = bits(word, 0, 12) as i32;
        return with_offset(access, rt, rn, offset, AddressMode::Offset);
    }
    if !bit(word, 11) {
        return indexed(word, access, rt, rn);
    }
    let (index, add, writeback) = (bit(word, 10), bit(word, 9), bit(word, 8));
    if !index && !writeback {
        return Instruction::Undefined;
    }
    let magnitude = bits(word, 0, 8) as i32;
    let offset = if add { magnitude } else { -magnitude };
    with_offset(access, rt, rn, offset, mode(index, writeback))
}

fn with_offset(access: Access, rt: u8, rn: u8, offset: i32, mode: AddressMode) -> Instruction {
    Instruction::Memory(match access {
        Access::Load(kind) => Memory::Load {
            kind,
            rt,
            rn,
            offset,
            mode,
        },
        Access::Store(width) => Memory::Store {
            width,
            rt,
            rn,
            offset,
            mode,
        },
    })
}

fn indexed(word: u32, access: Access, rt: u8, rn: u8) -> Instruction {
    if bits(word, 6, 6) != 0 {
        return Instruction::Undefined;
    }
    let (rm, shift) = (register(word, 0), bits(word, 4, 2) as u8);
    Instruction::Memory(match access {
        Access::Load(kind) => Memory::LoadIndexed {
            kind,
            rt,
            rn,
            rm,
            shift,
        },
        Access::Store(width) => Memory::StoreIndexed {
            width,
            rt,
            rn,
            rm,
            shift,
        },
    })
}
