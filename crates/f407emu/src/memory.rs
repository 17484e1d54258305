//! The memories on the chip (RM0090 section 2.3), and a cache of instructions that have been
//! decoded from them.
use crate::{
    decode::{self, Decoded},
    instruction::Width,
};
use core::ops::Range;

/// The first address of the flash.
pub(crate) const FLASH: u32 = 0x0800_0000;
/// The first address of SRAM1; SRAM2 follows it.
pub(crate) const SRAM: u32 = 0x2000_0000;
/// The begin of CCM, the memory on the core's data bus: DMA cannot reach it, and instructions
/// cannot be fetched from it.
pub(crate) const CCM: u32 = 0x1000_0000;
const FLASH_SIZE: usize = 1 << 20;
const SRAM_SIZE: usize = 128 << 10;
/// The size of SRAM1, bytes. The bus matrix has a slave for SRAM1 alone. The program can map SRAM1
/// at address 0, too.
pub(crate) const SRAM1_SIZE: u32 = 112 << 10;
/// The number of bytes from the start of SRAM whose decoded instructions are cached.
const CODE_SIZE: usize = 16 << 10;
const CCM_SIZE: usize = 64 << 10;
/// Device signature: the unique number, and the flash's size in KB (RM0090 chapter 39).
const SIGNATURE: u32 = 0x1FFF_7A10;
const SIGNATURE_BYTES: [u8; 20] = *b"leadscrew407\xFF\xFF\xFF\xFF\xFF\xFF\x00\x04";
/// The place of the flash's size in the signature.
const SIZE_PLACE: usize = 18;

/// The begin of the system memory, which holds ST's loader. Of the loader there are only its stack
/// pointer and the address of its first instruction, at which a run stops.
const SYSTEM: u32 = 0x1FFF_0000;
/// The loader's first instruction.
pub(crate) const LOADER_START: u32 = SYSTEM + 8;
const LOADER: [u8; 8] = [0x00, 0x20, 0x00, 0x20, 0x09, 0x00, 0xFF, 0x1F];

/// The three memories.
#[derive(Clone)]
pub(crate) struct Memory {
    pub(crate) flash: Box<[u8]>,
    pub(crate) sram: Box<[u8; SRAM_SIZE]>,
    pub(crate) ccm: Box<[u8]>,
    signature: [u8; 20],
    /// The memory that is mapped at address 0, too.
    pub(crate) low: Low,
    /// The decoded instruction at each halfword of the flash; dropped when the flash is written.
    decoded: Box<[Option<Decoded>]>,
    /// The decoded instruction at each halfword of the start of SRAM, as mapped at address 0.
    decoded_low: Box<[Option<Decoded>]>,
}

/// The memory that is mapped at address 0 (RM0090 section 9.2.1, SYSCFG_MEMRMP.MEM_MODE).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Low {
    /// The flash: the boot pins select it at every reset.
    Flash,
    /// SRAM1.
    Sram1,
    /// The system memory.
    System,
}

/// The memory or device that answers at an address.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Region {
    Flash,
    Sram,
    Ccm,
    Signature,
    System,
}

impl Memory {
    /// Erased flash, and RAM full of zeroes.
    pub(crate) fn new() -> Self {
        Memory {
            flash: vec![0xFF; FLASH_SIZE].into(),
            sram: Box::new([0; SRAM_SIZE]),
            ccm: vec![0; CCM_SIZE].into(),
            signature: SIGNATURE_BYTES,
            low: Low::Flash,
            decoded: vec![None; FLASH_SIZE / 2].into(),
            decoded_low: vec![None; CODE_SIZE / 2].into(),
        }
    }

    /// Erased flash of another size: a chip with `kilobytes` of it.
    pub(crate) fn set_flash_size(&mut self, kilobytes: u16) {
        let bytes = usize::from(kilobytes) << 10;
        self.flash = vec![0xFF; bytes].into();
        self.decoded = vec![None; bytes / 2].into();
        self.signature[SIZE_PLACE..].copy_from_slice(&kilobytes.to_le_bytes());
    }

    /// The memory at an address, and the offset in it. Flash or SRAM1 is mapped at 0, too (section
    /// 2.4).
    pub(crate) fn place(&self, address: u32) -> Option<(Region, usize)> {
        within(address, SRAM, SRAM_SIZE, Region::Sram)
            .or_else(|| within(address, FLASH, self.flash.len(), Region::Flash))
            .or_else(|| within(address, CCM, CCM_SIZE, Region::Ccm))
            .or_else(|| within(address, SYSTEM, 8, Region::System))
            .or_else(|| match self.low {
                Low::Flash => within(address, 0, self.flash.len(), Region::Flash),
                Low::Sram1 => within(address, 0, SRAM1_SIZE as usize, Region::Sram),
                Low::System => within(address, 0, 8, Region::System),
            })
            .or_else(|| within(address, SIGNATURE, 20, Region::Signature))
    }

    fn bytes(&self, region: Region) -> &[u8] {
        match region {
            Region::Flash => &self.flash,
            Region::Sram => &self.sram[..],
            Region::Ccm => &self.ccm,
            Region::Signature => &self.signature,
            Region::System => &LOADER,
        }
    }

    /// Reads a value from a memory; `None` past its end.
    pub(crate) fn read(&self, (region, offset): (Region, usize), width: Width) -> Option<u32> {
        let bytes = self.bytes(region).get(offset..offset + width.bytes())?;
        Some(little_endian(bytes))
    }

    /// Writes a value to RAM; `None` past its end, or for another memory.
    pub(crate) fn write(
        &mut self,
        (region, offset): (Region, usize),
        width: Width,
        value: u32,
    ) -> Option<()> {
        let memory = match region {
            Region::Sram => &mut self.sram[..],
            Region::Ccm => &mut self.ccm[..],
            Region::Flash | Region::Signature | Region::System => return None,
        };
        let bytes = memory.get_mut(offset..offset + width.bytes())?;
        bytes.copy_from_slice(&value.to_le_bytes()[..width.bytes()]);
        if region == Region::Sram && offset < CODE_SIZE {
            // An instruction of 32 bits may begin in the halfword before.
            let half = offset / 2;
            self.decoded_low[half.saturating_sub(1)..(half + 2).min(CODE_SIZE / 2)].fill(None);
        }
        Some(())
    }

    /// The instruction at an address below [`SRAM1_SIZE`] while SRAM1 is mapped at 0.
    #[inline(always)]
    pub(crate) fn low_instruction(&mut self, address: u32) -> Option<Decoded> {
        match self.decoded_low.get(address as usize / 2) {
            Some(Some(decoded)) if self.low == Low::Sram1 => Some(*decoded),
            Some(_) | None => self.decode_low(address & !1),
        }
    }

    #[cold]
    fn decode_low(&mut self, address: u32) -> Option<Decoded> {
        if self.low != Low::Sram1 || address >= SRAM1_SIZE {
            return None;
        }
        let offset = address as usize;
        let half = |at: usize| self.sram.get(at..at + 2).map_or(0, little_endian) as u16;
        let decoded = decode::decode(half(offset), half(offset + 2), address);
        if let Some(place) = self.decoded_low.get_mut(offset / 2) {
            *place = Some(decoded);
        }
        Some(decoded)
    }

    /// Reads a word of SRAM quickly; `None` elsewhere.
    #[inline(always)]
    pub(crate) fn sram_word(&self, address: u32) -> Option<u32> {
        let offset = address.wrapping_sub(SRAM) as usize;
        let bytes = self.sram.get(offset..offset.wrapping_add(4))?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    }

    /// Programs a unit of the flash: bits can only be cleared.
    pub(crate) fn program(&mut self, offset: usize, width: Width, value: u32) {
        for (index, byte) in value.to_le_bytes()[..width.bytes()].iter().enumerate() {
            if let Some(stored) = self.flash.get_mut(offset + index) {
                *stored &= byte;
            }
        }
        self.forget(offset..offset + width.bytes());
    }

    /// Writes bytes to the flash, as a programmer outside the chip does.
    pub(crate) fn load(&mut self, offset: usize, bytes: &[u8]) -> Option<()> {
        let range = offset..offset + bytes.len();
        self.flash.get_mut(range.clone())?.copy_from_slice(bytes);
        self.forget(range);
        Some(())
    }

    /// Erases a part of the flash.
    pub(crate) fn erase(&mut self, range: Range<usize>) {
        self.flash[range.clone()].fill(0xFF);
        self.forget(range);
    }

    /// Drops cached instructions that may have changed; one may begin in the halfword before.
    fn forget(&mut self, range: Range<usize>) {
        let first = (range.start / 2).saturating_sub(1);
        let end = range.end.div_ceil(2).min(self.decoded.len());
        self.decoded[first..end].fill(None);
    }

    /// The instruction at an offset in the flash.
    #[inline(always)]
    pub(crate) fn instruction(&mut self, offset: usize) -> Decoded {
        match self.decoded[offset / 2] {
            Some(decoded) => decoded,
            None => self.decode(offset & !1),
        }
    }

    #[cold]
    fn decode(&mut self, offset: usize) -> Decoded {
        let half = |at: usize| self.flash.get(at..at + 2).map_or(0, little_endian) as u16;
        let decoded = decode::decode(half(offset), half(offset + 2), FLASH + offset as u32);
        self.decoded[offset / 2] = Some(decoded);
        decoded
    }

    /// Returns true if an instruction of 32 bits begins at an address in the flash.
    pub(crate) fn is_wide(&self, address: u32) -> bool {
        let offset = address.wrapping_sub(FLASH) as usize;
        let upper = self.flash.get(offset.wrapping_add(1)).copied().unwrap_or(0);
        decode::is_wide(u16::from(upper) << 8)
    }
}

impl Width {
    /// The number of bytes of an access.
    pub(crate) fn bytes(self) -> usize {
        match self {
            Width::Byte => 1,
            Width::Half => 2,
            Width::Word => 4,
        }
    }

    /// The bits of a value that an access moves.
    pub(crate) fn mask(self) -> u32 {
        match self {
            Width::Byte => 0xFF,
            Width::Half => 0xFFFF,
            Width::Word => u32::MAX,
        }
    }
}

/// The region and the offset in it, if an address is one of the `size` bytes from `base` on.
fn within(address: u32, base: u32, size: usize, region: Region) -> Option<(Region, usize)> {
    let offset = address.wrapping_sub(base) as usize;
    (offset < size).then_some((region, offset))
}

fn little_endian(bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .rev()
        .fold(0, |value, &byte| value << 8 | u32::from(byte))
}

/// An operation of the flash that may still be under way, and the contents of its range before it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Unfinished {
    pub(crate) range: Range<usize>,
    pub(crate) before: Vec<u8>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instruction::{Instruction, System};

    #[test]
    fn each_memory_has_its_place_and_size() {
        let memory = Memory::new();
        let place = |address| memory.place(address);
        assert_eq!(place(0x080F_FFFF), Some((Region::Flash, 0xF_FFFF)));
        assert_eq!(place(0x0000_0004), Some((Region::Flash, 4)));
        assert_eq!(place(0x2001_FFFF), Some((Region::Sram, 0x1_FFFF)));
        assert_eq!(place(0x1000_FFFF), Some((Region::Ccm, 0xFFFF)));
        assert_eq!(place(0x2002_0000), None);
        assert_eq!(place(0x0810_0000), None);
    }

    #[test]
    fn the_signature_says_1024_kilobytes() {
        let memory = Memory::new();
        let size = memory.place(0x1FFF_7A22).unwrap();
        assert_eq!(memory.read(size, Width::Half), Some(1024));
    }

    #[test]
    fn nothing_is_behind_the_flash_of_a_smaller_chip() {
        let mut memory = Memory::new();
        memory.set_flash_size(512);
        let size = memory.place(0x1FFF_7A22).unwrap();
        assert_eq!(memory.read(size, Width::Half), Some(512));
        assert_eq!(memory.place(0x0807_FFFF), Some((Region::Flash, 0x7_FFFF)));
        assert_eq!(memory.place(0x0808_0000), None);
        assert_eq!(memory.load(0x8_0000, &[0]), None);
    }

    #[test]
    fn programming_clears_bits_and_erasing_sets_them() {
        let mut memory = Memory::new();
        memory.program(0x4000, Width::Word, 0x1234_5678);
        memory.program(0x4000, Width::Byte, 0xF0);
        let word = memory.place(0x0800_4000).unwrap();
        assert_eq!(memory.read(word, Width::Word), Some(0x1234_5670));
        memory.erase(0x4000..0x8000);
        assert_eq!(memory.read(word, Width::Word), Some(u32::MAX));
    }

    #[test]
    fn an_instruction_that_is_overwritten_is_decoded_anew() {
        let mut memory = Memory::new();
        memory.load(0x100, &[0x00, 0xBF]);
        let nop = memory.instruction(0x100).instruction;
        assert_eq!(nop, Instruction::System(System::Nop));
        memory.program(0x100, Width::Half, 0xBE00);
        let breakpoint = memory.instruction(0x100).instruction;
        assert_eq!(breakpoint, Instruction::System(System::Breakpoint));
    }

    #[test]
    fn sram1_is_at_0_where_it_is_asked_for_and_sram2_is_not() {
        let mut memory = Memory::new();
        memory.low = Low::Sram1;
        assert_eq!(memory.place(4), Some((Region::Sram, 4)));
        assert_eq!(memory.place(0x1_BFFF), Some((Region::Sram, 0x1_BFFF)));
        assert_eq!(memory.place(0x1_C000), None);
        assert_eq!(memory.place(0x0800_0004), Some((Region::Flash, 4)));
    }

    #[test]
    fn the_system_memory_is_at_0_if_it_is_asked_for_and_starts_the_loader() {
        let mut memory = Memory::new();
        memory.low = Low::System;
        for begin in [0, 0x1FFF_0000] {
            let place = memory.place(begin + 4).unwrap();
            assert_eq!(memory.read(place, Width::Word), Some(LOADER_START | 1));
            assert_eq!(memory.place(begin + 8), None);
        }
        assert_eq!(memory.place(0x0800_0004), Some((Region::Flash, 4)));
    }

    #[test]
    fn an_instruction_in_sram_that_is_overwritten_is_decoded_anew() {
        let mut memory = Memory::new();
        assert_eq!(memory.low_instruction(0x100), None);
        memory.low = Low::Sram1;
        let write = |memory: &mut Memory, half| {
            let place = memory.place(0x2000_0100).unwrap();
            memory.write(place, Width::Half, half).unwrap();
            memory.low_instruction(0x100).unwrap().instruction
        };
        assert_eq!(write(&mut memory, 0xBF00), Instruction::System(System::Nop));
        let breakpoint = Instruction::System(System::Breakpoint);
        assert_eq!(write(&mut memory, 0xBE00), breakpoint);
    }

    #[test]
    fn accesses_past_the_end_fail() {
        let memory = Memory::new();
        assert_eq!(
            memory.read((Region::Sram, SRAM_SIZE - 2), Width::Word),
            None
        );
        assert_eq!(memory.read((Region::Ccm, CCM_SIZE), Width::Byte), None);
    }
}
