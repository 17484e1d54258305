//! Loads firmware: the loadable segments of an ELF go to their physical addresses.
use crate::memory::{Memory, Region};
use core::fmt;
use object::{
    elf::{FileHeader32, EM_ARM, PT_LOAD},
    read::elf::{FileHeader, ProgramHeader},
    Endianness,
};

/// The reason why an ELF cannot be loaded.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LoadError {
    /// The file is no 32-bit ELF, or it is damaged.
    Malformed(object::Error),
    /// The file is for another processor.
    NotArm,
    /// A segment lies outside flash and RAM.
    Outside {
        /// The segment's physical address.
        address: u32,
    },
    /// The file has no loadable segment, perhaps because a linker script was missing.
    Empty,
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LoadError::Malformed(error) => write!(f, "no ELF of 32 bits: {error}"),
            LoadError::NotArm => f.write_str("an ELF for another processor"),
            LoadError::Outside { address } => {
                write!(f, "a segment at {address:#010x} lies outside flash and RAM")
            }
            LoadError::Empty => f.write_str("an ELF without loadable segments"),
        }
    }
}

impl core::error::Error for LoadError {}

impl From<object::Error> for LoadError {
    fn from(error: object::Error) -> Self {
        LoadError::Malformed(error)
    }
}

/// Loads all segments of `elf`; the memory outside them does not change.
///
/// # Errors
/// When `elf` is not an ELF for this chip; some segments may have been loaded then.
pub(crate) fn load(memory: &mut Memory, elf: &[u8]) -> Result<(), LoadError> {
    let header = FileHeader32::<Endianness>::parse(elf)?;
    let endian = header.endian()?;
    if header.e_machine(endian) != EM_ARM {
        return Err(LoadError::NotArm);
    }
    let mut loaded = false;
    for segment in header.program_headers(endian, elf)? {
        let bytes = segment.data(endian, elf).unwrap_or(&[]);
        if segment.p_type(endian) != PT_LOAD || bytes.is_empty() {
            continue;
        }
        place(memory, segment.p_paddr(endian), bytes)?;
        loaded = true;
    }
    if loaded {
        Ok(())
    } else {
        Err(LoadError::Empty)
    }
}

fn place(memory: &mut Memory, address: u32, bytes: &[u8]) -> Result<(), LoadError> {
    let outside = LoadError::Outside { address };
    let (region, offset) = memory.place(address).ok_or(outside)?;
    let ram = match region {
        Region::Flash => return memory.load(offset, bytes).ok_or(outside),
        Region::Sram => &mut memory.sram[..],
        Region::Ccm => &mut memory.ccm[..],
        Region::Signature | Region::System => return Err(outside),
    };
    let part = ram.get_mut(offset..offset + bytes.len()).ok_or(outside)?;
    part.copy_from_slice(bytes);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instruction::Width;

    /// An ELF with one segment of four bytes.
    fn elf(machine: u16, address: u32) -> Vec<u8> {
        let mut elf = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
        let halves = |elf: &mut Vec<u8>, values: &[u16]| {
            elf.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        };
        let words = |elf: &mut Vec<u8>, values: &[u32]| {
            elf.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        };
        halves(&mut elf, &[2, machine]);
        words(&mut elf, &[1, address | 1, 52, 0, 0]);
        halves(&mut elf, &[52, 32, 1, 40, 0, 0]);
        words(&mut elf, &[1, 84, address, address, 4, 4, 5, 4]);
        elf.extend([1, 2, 3, 4]);
        elf
    }

    #[test]
    fn segments_go_to_their_physical_addresses() {
        let mut memory = Memory::new();
        load(&mut memory, &elf(EM_ARM, 0x0800_0100)).unwrap();
        let word = memory.place(0x0800_0100).unwrap();
        assert_eq!(memory.read(word, Width::Word), Some(0x0403_0201));
    }

    #[test]
    fn what_is_not_for_this_chip_is_refused() {
        let mut memory = Memory::new();
        assert_eq!(
            load(&mut memory, &elf(62, 0x0800_0000)),
            Err(LoadError::NotArm)
        );
        let address = 0x3000_0000;
        let outside = Err(LoadError::Outside { address });
        assert_eq!(load(&mut memory, &elf(EM_ARM, address)), outside);
        let text = load(
            &mut memory,
            b"no ELF at all, but some text that is long enough",
        );
        assert!(matches!(text, Err(LoadError::Malformed(_))));
    }
}
