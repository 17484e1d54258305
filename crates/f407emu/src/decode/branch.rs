//! The 32-bit encodings of branches and of system control (A5.3.4).
use super::{bit, bits, branch_target, register, signed};
use crate::instruction::{Branch, Instruction, Memory, System};

/// Branches and system control (table A5-13).
pub(super) fn decode(word: u32, address: u32) -> Instruction {
    match (bit(word, 14), bit(word, 12)) {
        (false, false) if bits(word, 22, 4) < 14 => Instruction::Branch(conditional(word, address)),
        (false, false) => control(word),
        (false, true) => Instruction::Branch(Branch::Direct {
            condition: 14,
            target: far_target(word, address),
        }),
        (true, true) => Instruction::Branch(Branch::Link {
            target: far_target(word, address),
        }),
        (true, false) => Instruction::Undefined,
    }
}

fn conditional(word: u32, address: u32) -> Branch {
    let offset = bits(word, 26, 1) << 20
        | bits(word, 11, 1) << 19
        | bits(word, 13, 1) << 18
        | bits(word, 16, 6) << 12
        | bits(word, 0, 11) << 1;
    Branch::Direct {
        condition: bits(word, 22, 4) as u8,
        target: branch_target(address, signed(offset, 21)),
    }
}

/// The target of a branch of up to 16 MB. For two bits of the offset the encoding stores whether
/// the bit equals the sign (A7.7.12, encoding T4).
fn far_target(word: u32, address: u32) -> u32 {
    let sign = bits(word, 26, 1);
    let agrees = |index| u32::from(bits(word, index, 1) == sign);
    let offset = sign << 24
        | agrees(13) << 23
        | agrees(11) << 22
        | bits(word, 16, 10) << 12
        | bits(word, 0, 11) << 1;
    branch_target(address, signed(offset, 25))
}

fn control(word: u32) -> Instruction {
    let system = match bits(word, 20, 7) {
        0x38 | 0x39 => System::WriteSpecial {
            rn: register(word, 16),
            register: bits(word, 0, 8) as u8,
            mask: bits(word, 8, 4) as u8,
        },
        0x3A => hint(bits(word, 0, 8)),
        0x3B => return barrier(word),
        0x3E | 0x3F => System::ReadSpecial {
            rd: register(word, 8),
            register: bits(word, 0, 8) as u8,
        },
        _ => return Instruction::Undefined,
    };
    Instruction::System(system)
}

/// Hints (A5.2.5). Hints without effect on a single core decode as NOP.
pub(super) fn hint(code: u32) -> System {
    match code {
        2 => System::WaitForEvent,
        3 => System::WaitForInterrupt,
        4 => System::SendEvent,
        _ => System::Nop,
    }
}

fn barrier(word: u32) -> Instruction {
    match bits(word, 4, 4) {
        2 => Instruction::Memory(Memory::ClearExclusive),
        4 | 5 => Instruction::System(System::DataBarrier),
        6 => Instruction::System(System::InstructionBarrier),
        _ => Instruction::Undefined,
    }
}
