//! Loads and stores. A load takes two cycles, but only one if it follows another access and does
//! not use the value loaded there as its address.
use crate::{
    instruction::{AddressMode, LoadKind, Memory, Width},
    machine::{LastAccess, Machine},
    trap::Trap,
};

impl Machine {
    #[inline(always)]
    pub(super) fn execute_memory(&mut self, memory: Memory) -> Result<(), Trap> {
        match memory {
            Memory::Load {
                kind,
                rt,
                rn,
                offset,
                mode,
            } => {
                let (address, base) = self.address(rn, offset, mode);
                let value = self.load(address, kind)?;
                self.write_back(rn, base, mode);
                self.finish_load(rt, rn, value)
            }
            Memory::LoadIndexed {
                kind,
                rt,
                rn,
                rm,
                shift,
            } => {
                let value = self.load(self.indexed(rn, rm, shift), kind)?;
                self.finish_load(rt, rn, value)
            }
            Memory::LoadLiteral { kind, rt, address } => {
                let value = self.load(address, kind)?;
                self.finish_load(rt, 15, value)
            }
            Memory::Store {
                width,
                rt,
                rn,
                offset,
                mode,
            } => {
                let (address, base) = self.address(rn, offset, mode);
                self.store(address, width, rt)?;
                self.write_back(rn, base, mode);
                self.finish_store(1)
            }
            Memory::StoreIndexed {
                width,
                rt,
                rn,
                rm,
                shift,
            } => {
                self.store(self.indexed(rn, rm, shift), width, rt)?;
                let alone = self.last_access == LastAccess::None;
                self.finish_store(if alone { 2 } else { 1 })
            }
            other => self.execute_several(other),
        }
    }

    /// Accesses to several words, and exclusive accesses.
    fn execute_several(&mut self, memory: Memory) -> Result<(), Trap> {
        match memory {
            Memory::LoadDouble {
                rt,
                rt2,
                rn,
                offset,
                mode,
            } => self.load_double((rt, rt2), rn, offset, mode)?,
            Memory::StoreDouble {
                rt,
                rt2,
                rn,
                offset,
                mode,
            } => self.store_double((rt, rt2), rn, offset, mode)?,
            Memory::LoadMultiple {
                rn,
                list,
                writeback,
                before,
            } => return self.load_multiple(rn, list, writeback, before),
            Memory::StoreMultiple {
                rn,
                list,
                writeback,
                before,
            } => self.store_multiple(rn, list, writeback, before)?,
            Memory::LoadExclusive {
                width,
                rt,
                rn,
                offset,
            } => self.load_exclusive(width, rt, rn, offset)?,
            Memory::StoreExclusive {
                width,
                rd,
                rt,
                rn,
                offset,
            } => self.store_exclusive(width, (rd, rt), rn, offset)?,
            Memory::ClearExclusive => self.cpu.exclusive = None,
            Memory::Load { .. }
            | Memory::LoadIndexed { .. }
            | Memory::LoadLiteral { .. }
            | Memory::Store { .. }
            | Memory::StoreIndexed { .. }
            | Memory::Preload => {}
        }
        self.spend(1);
        Ok(())
    }

    /// The address of an access, and the new value of its base if it is written back.
    #[inline(always)]
    fn address(&self, rn: u8, offset: i32, mode: AddressMode) -> (u32, u32) {
        let base = self.cpu.get(rn);
        let moved = base.wrapping_add_signed(offset);
        match mode {
            AddressMode::Offset | AddressMode::PreIndexed => (moved, moved),
            AddressMode::PostIndexed => (base, moved),
        }
    }

    #[inline(always)]
    fn indexed(&self, rn: u8, rm: u8, shift: u8) -> u32 {
        let offset = self.cpu.get(rm) << shift;
        self.cpu.get(rn).wrapping_add(offset)
    }

    #[inline(always)]
    fn write_back(&mut self, rn: u8, base: u32, mode: AddressMode) {
        match mode {
            AddressMode::Offset => {}
            AddressMode::PreIndexed | AddressMode::PostIndexed => self.cpu.set(rn, base),
        }
    }

    #[inline(always)]
    fn load(&mut self, address: u32, kind: LoadKind) -> Result<u32, Trap> {
        Ok(match kind {
            LoadKind::Word => {
                self.check_alignment(address, 3)?;
                self.read_word(address)?
            }
            LoadKind::Byte => self.read(address, Width::Byte)?,
            LoadKind::SignedByte => self.read(address, Width::Byte)? as i8 as u32,
            LoadKind::Half => {
                self.check_alignment(address, 1)?;
                self.read(address, Width::Half)?
            }
            LoadKind::SignedHalf => {
                self.check_alignment(address, 1)?;
                self.read(address, Width::Half)? as i16 as u32
            }
        })
    }

    #[inline(always)]
    fn store(&mut self, address: u32, width: Width, rt: u8) -> Result<(), Trap> {
        self.check_alignment(address, width.bytes() as u32 - 1)?;
        self.write(address, width, self.cpu.get(rt))
    }

    /// Charges a cycle for an access across a word boundary, or fails if CCR makes it a fault.
    #[inline(always)]
    fn check_alignment(&mut self, address: u32, mask: u32) -> Result<(), Trap> {
        if address & mask != 0 {
            if self.scb.traps_unaligned() {
                return Err(Trap::Unaligned { address });
            }
            self.cycle += 1;
        }
        Ok(())
    }

    #[inline(always)]
    fn finish_load(&mut self, rt: u8, rn: u8, value: u32) -> Result<(), Trap> {
        let overlaps = match self.last_access {
            LastAccess::None => false,
            LastAccess::Load(register) => register != rn,
            LastAccess::Store => true,
        };
        self.cycle += if overlaps { 1 } else { 2 };
        if rt == 15 {
            self.last_access = LastAccess::None;
            return self.exchange(value, self.timing.refill_loaded);
        }
        self.last_access = LastAccess::Load(rt);
        self.cpu.set(rt, value);
        Ok(())
    }

    #[inline(always)]
    fn finish_store(&mut self, cycles: u64) -> Result<(), Trap> {
        self.cycle += cycles;
        self.last_access = LastAccess::Store;
        Ok(())
    }

    fn load_double(
        &mut self,
        (rt, rt2): (u8, u8),
        rn: u8,
        offset: i16,
        mode: AddressMode,
    ) -> Result<(), Trap> {
        let (address, base) = if rn == 15 {
            let address = (self.cpu.get(15) & !3).wrapping_add_signed(i32::from(offset));
            (address, address)
        } else {
            self.address(rn, i32::from(offset), mode)
        };
        must_be_word_aligned(address)?;
        let (first, second) = (
            self.read_word(address)?,
            self.read_word(address.wrapping_add(4))?,
        );
        self.write_back(rn, base, mode);
        self.cpu.set(rt, first);
        self.cpu.set(rt2, second);
        self.cycle += 2;
        Ok(())
    }

    fn store_double(
        &mut self,
        (rt, rt2): (u8, u8),
        rn: u8,
        offset: i16,
        mode: AddressMode,
    ) -> Result<(), Trap> {
        let (address, base) = self.address(rn, i32::from(offset), mode);
        must_be_word_aligned(address)?;
        self.write_word(address, self.cpu.get(rt))?;
        self.write_word(address.wrapping_add(4), self.cpu.get(rt2))?;
        self.write_back(rn, base, mode);
        self.cycle += 2;
        Ok(())
    }

    /// The first address of a list of registers, and the new value of the base.
    fn span(&self, rn: u8, list: u16, before: bool) -> (u32, u32) {
        let (base, size) = (self.cpu.get(rn), 4 * list.count_ones());
        if before {
            (base.wrapping_sub(size), base.wrapping_sub(size))
        } else {
            (base, base.wrapping_add(size))
        }
    }

    fn load_multiple(
        &mut self,
        rn: u8,
        list: u16,
        writeback: bool,
        before: bool,
    ) -> Result<(), Trap> {
        let (mut address, base) = self.span(rn, list, before);
        must_be_word_aligned(address)?;
        let mut values = self.cpu.r;
        for (register, value) in values.iter_mut().enumerate() {
            if list >> register & 1 != 0 {
                *value = self.read_word(address)?;
                address = address.wrapping_add(4);
            }
        }
        if writeback {
            self.cpu.set(rn, base);
        }
        let loaded = (0..15).filter(|&register| list >> register & 1 != 0);
        loaded.for_each(|register| self.cpu.r[register] = values[register]);
        self.spend(1 + list.count_ones());
        if list >> 15 != 0 {
            self.exchange(values[15], self.timing.refill_loaded)?;
        }
        Ok(())
    }

    fn store_multiple(
        &mut self,
        rn: u8,
        list: u16,
        writeback: bool,
        before: bool,
    ) -> Result<(), Trap> {
        let (mut address, base) = self.span(rn, list, before);
        must_be_word_aligned(address)?;
        for register in (0..15u8).filter(|&register| list >> register & 1 != 0) {
            self.write_word(address, self.cpu.get(register))?;
            address = address.wrapping_add(4);
        }
        if writeback {
            self.cpu.set(rn, base);
        }
        self.cycle += u64::from(list.count_ones());
        Ok(())
    }

    fn load_exclusive(&mut self, width: Width, rt: u8, rn: u8, offset: u16) -> Result<(), Trap> {
        let address = self.cpu.get(rn).wrapping_add(u32::from(offset));
        let value = self.read(address, width)?;
        self.cpu.exclusive = Some(address & !3);
        self.cpu.set(rt, value);
        self.cycle += 1;
        Ok(())
    }

    fn store_exclusive(
        &mut self,
        width: Width,
        (rd, rt): (u8, u8),
        rn: u8,
        offset: u16,
    ) -> Result<(), Trap> {
        let address = self.cpu.get(rn).wrapping_add(u32::from(offset));
        let marked = self.cpu.exclusive.take() == Some(address & !3);
        if marked {
            self.write(address, width, self.cpu.get(rt))?;
        }
        self.cpu.set(rd, u32::from(!marked));
        self.cycle += 1;
        Ok(())
    }
}

/// Fails if an access to several words is not aligned to a word, whatever CCR says (A3.2.1).
pub(super) fn must_be_word_aligned(address: u32) -> Result<(), Trap> {
    if address & 3 == 0 {
        Ok(())
    } else {
        Err(Trap::Unaligned { address })
    }
}
