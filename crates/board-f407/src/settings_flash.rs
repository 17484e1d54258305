//! The machine's settings in two sectors of the flash (RM0090 chapter 3).
//!
//! The CPU stands still while the flash is written, since its program is there. A word takes 16 µs,
//! 100 µs at most (data sheet, table 40); the longest record takes less than 2 ms. Bytes that
//! arrive meanwhile wait in the ring that DMA fills ([`crate::serial`]). Erasing a small sector
//! takes half a second. A sector is erased at start-up if that is needed, also on a new chip.
//! Later a sector is erased only after both sectors have been filled.
use crate::{
    profile, pwm,
    registers::{self, Word},
    sector::Sector,
    step_interrupt::SHARED,
    switches, watchdog,
};
use leadscrew_machine::settings::flash::{Area, SettingsStore};
use stm32f4::stm32f407::{flash, FLASH};

/// Bytes of a sector that are used: all of a small one.
const AREA: usize = 16 * 1024;

/// The reason why the flash refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug, defmt::Format)]
pub(crate) enum FlashError {
    /// The bytes are not whole words, or not within their area, or all places for a record are
    /// taken.
    OutOfBounds,
    /// The controller reports an error (the supply is too low, the sector is protected, the
    /// sequence is wrong), or a record does not read back as it was written.
    Refused,
}

/// The two sectors.
pub(crate) struct Sectors {
    _flash: FLASH,
}

impl Sectors {
    /// Takes the flash.
    pub(crate) fn new(flash: FLASH) -> Self {
        Self { _flash: flash }
    }
}

/// Unlocks the flash for `work`. Afterwards it checks the controller's error flags, locks the
/// flash, and clears the caches.
fn unlocked(work: impl FnOnce(&flash::RegisterBlock)) -> Result<(), FlashError> {
    let flash = registers::flash();
    // A bootloader may have left the flash unlocked. Keys for an unlocked flash may count as a
    // wrong sequence, which locks it until the next reset (RM0090 section 3.6.1).
    if flash.cr().read().lock().bit_is_set() {
        flash.keyr().write(|w| w.key().set(0x4567_0123));
        flash.keyr().write(|w| w.key().set(0xCDEF_89AB));
    }
    // The error flags and the end-of-operation flag are cleared by ones (RM0090 section 3.9.5).
    flash.sr().put(0xF3);
    work(flash);
    while flash.sr().read().bsy().bit_is_set() {}
    let errors = flash.sr().read().bits() & 0xF2;
    // Sets the lock bit alone; PG, SER and the sector number go back to zero.
    flash.cr().put(1 << 31);
    reset_caches();
    if errors == 0 {
        Ok(())
    } else {
        Err(FlashError::Refused)
    }
}

/// Empties the flash's caches, which may hold old data (RM0090 section 3.6.4). They have to be off
/// for that.
fn reset_caches() {
    let access = registers::flash().acr();
    access.modify(|_, w| w.dcen().disabled().icen().disabled());
    access.modify(|_, w| w.dcrst().reset().icrst().reset());
    access.modify(|_, w| w.dcrst().no_reset().icrst().no_reset());
    access.modify(|_, w| w.dcen().enabled().icen().enabled());
}

fn erase_sector(sector: Sector) -> Result<(), FlashError> {
    unlocked(|flash| {
        // Sector erase, 32 bits at a time (2.7 V and more), the sector's number, start (RM0090
        // section 3.9.7).
        flash
            .cr()
            .put(1 << 16 | 0b10 << 8 | u32::from(sector.0) << 3 | 1 << 1);
    })
}

/// Programs words from address `start` on. The words must be empty before.
pub(crate) fn program(start: usize, bytes: &[u8]) -> Result<(), FlashError> {
    if !start.is_multiple_of(4) || !bytes.len().is_multiple_of(4) {
        return Err(FlashError::OutOfBounds);
    }
    unlocked(|flash| {
        // Programming, 32 bits at a time.
        flash.cr().put(0b10 << 8 | 1);
        for (word, place) in bytes.chunks_exact(4).zip((start..).step_by(4)) {
            let word = word
                .iter()
                .rev()
                .fold(0, |all, byte| all << 8 | u32::from(*byte));
            registers::store_in_flash(place, word);
            while flash.sr().read().bsy().bit_is_set() {}
        }
    })
}

/// The sector of an area.
fn sector(area: Area) -> Sector {
    let (first, second) = profile::settings_sectors();
    match area {
        Area::First => first,
        Area::Second => second,
    }
}

/// The address of `length` bytes at `offset`, all of them within the area.
fn address(area: Area, offset: usize, length: usize) -> Result<usize, FlashError> {
    let end = offset.checked_add(length);
    if end.is_some_and(|end| end <= AREA) {
        Ok(sector(area).address() + offset)
    } else {
        Err(FlashError::OutOfBounds)
    }
}

impl SettingsStore for Sectors {
    type Error = FlashError;

    fn size(&self) -> usize {
        AREA
    }

    fn read(&mut self, area: Area, offset: usize, bytes: &mut [u8]) -> Result<(), FlashError> {
        let start = address(area, offset, bytes.len())?;
        registers::read_flash(start, bytes);
        Ok(())
    }

    fn write(&mut self, area: Area, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        let start = address(area, offset, bytes.len())?;
        program(start, bytes)
    }

    fn erase(&mut self, area: Area) -> Result<(), FlashError> {
        // A sector whose erase was cut short may read as empty, so an empty sector is erased all
        // the same.
        let sector = sector(area);
        // No interrupt runs while the flash is erased, so no switch can turn the laser off. The
        // switches are given the filter's time before the gate is asked.
        let gate_is_shut = || {
            switches::let_settle();
            SHARED.is_laser_off()
        };
        pwm::off_during(
            || watchdog::patiently(|| erase_sector(sector)),
            gate_is_shut,
        )
    }
}
