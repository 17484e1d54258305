//! Fetches instructions from the memories.
use crate::{
    decode::{self, Decoded},
    instruction::Width,
    machine::Machine,
    memory::{Region, FLASH},
    timing::FlashTiming,
    trap::Trap,
};

impl Machine {
    /// The instruction at an address. Charges the flash's wait states.
    #[inline(always)]
    pub(crate) fn fetch(&mut self, address: u32) -> Result<Decoded, Trap> {
        let offset = address.wrapping_sub(FLASH) as usize;
        if offset >= self.memory.flash.len() {
            // SRAM1 at 0 answers the instruction bus without wait states (RM0090 section 2.3.1).
            return match self.memory.low_instruction(address) {
                Some(decoded) => Ok(decoded),
                None => self.fetch_elsewhere(address),
            };
        }
        let waits = self.timing.flash != FlashTiming::ZeroWait;
        if waits && !self.art.is_current(address) {
            self.wait_for_line(address);
        }
        let decoded = self.memory.instruction(offset);
        let last_half = address & 15 == 14;
        if last_half && decoded.length == 4 && waits {
            self.wait_for_line(address + 2);
        }
        Ok(decoded)
    }

    fn wait_for_line(&mut self, address: u32) {
        let acr = self.devices.flash.acr;
        self.cycle += self.art.fetch(address, acr, self.cycle);
        self.tell_stale_use();
    }

    /// Fetches from SRAM over the system bus, which takes one cycle more (RM0090 section 2.1.3:
    /// less efficient), or from the alias of the flash at 0.
    #[cold]
    fn fetch_elsewhere(&mut self, address: u32) -> Result<Decoded, Trap> {
        let trap = Trap::Fetch { address };
        match self.memory.place(address) {
            Some((Region::Sram, _)) => self.cycle += 1,
            Some((Region::Flash, _)) => {}
            Some((Region::Ccm | Region::Signature | Region::System, _)) | None => return Err(trap),
        }
        let half = |address| {
            let place = self.memory.place(address).ok_or(trap)?;
            let half = self.memory.read(place, Width::Half).ok_or(trap)?;
            Ok(half as u16)
        };
        let first = half(address)?;
        let second = if decode::is_wide(first) {
            half(address.wrapping_add(2))?
        } else {
            0
        };
        Ok(decode::decode(first, second, address))
    }
}
