//! The flash interface (RM0090 chapter 3): keys, programming, sector erase, and the times that they
//! take.
//!
//! The core stalls if it fetches from the flash, reads it or writes FLASH_CR while an operation is
//! under way (sections 3.6 and 3.6.1). Times are the typical ones of the data sheet's table 40 at
//! 2.7 to 3.6 V. The time to program a unit can be set ([`crate::Timing`]).
//!
//! A wrong key is a bus error (section 3.6.1), which ends the run. The manual does not say whether
//! keys are wrong while the interface is open; here they have no effect.
//!
//! Not modelled, and warned of: mass erase, option bytes. Not modelled either: write protection.
use super::NEVER;
use crate::{
    instruction::Width,
    warning::{Warning, Warnings},
};
use core::ops::Range;

/// The address of its first register.
const BASE: u32 = 0x4002_3C00;
/// FLASH_KEYR: the two keys.
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// FLASH_ACR: data cache on, instruction cache on; their resets are two bits further up.
const CACHES: u32 = 3 << 9;
/// FLASH_CR: program, sector erase, mass erase, start, interrupts of the end and of errors, lock.
const PG: u32 = 1;
const SER: u32 = 1 << 1;
const MER: u32 = 1 << 2;
const STRT: u32 = 1 << 16;
const EOPIE: u32 = 1 << 24;
const ERRIE: u32 = 1 << 25;
const LOCK: u32 = 1 << 31;
/// FLASH_SR: end of operation, operation error, parallelism error, sequence error, busy.
const EOP: u32 = 1;
const OPERR: u32 = 1 << 1;
const PGPERR: u32 = 1 << 6;
const PGSERR: u32 = 1 << 7;
const BSY: u32 = 1 << 16;

/// The erase that FLASH_CR has started.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Erase {
    /// Its offsets in the flash.
    pub(crate) range: Range<usize>,
}

/// Says which keys have been written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Lock {
    Locked,
    FirstKey,
    Open,
    /// A wrong key: locked until the next reset.
    Barred,
}

/// The interface's registers.
#[derive(Clone, Debug)]
pub(crate) struct Flash {
    /// FLASH_ACR: wait states and caches.
    pub(crate) acr: u32,
    status: u32,
    control: u32,
    lock: Lock,
    /// The cycle at which the operation under way ends.
    pub(crate) busy_until: u64,
    /// The cycle at which the end of an operation must be reported.
    report_at: u64,
}

impl Flash {
    pub(crate) fn new() -> Self {
        Flash {
            acr: 0,
            status: 0,
            control: LOCK,
            lock: Lock::Locked,
            busy_until: 0,
            report_at: NEVER,
        }
    }

    /// The cycle at which an operation ends that causes an interrupt at its end.
    pub(crate) fn next_event(&self) -> u64 {
        self.report_at
    }

    /// Reports the end of an operation.
    pub(crate) fn event(&mut self) {
        self.report_at = NEVER;
        self.status |= EOP;
    }

    /// Raises flags of FLASH_SR.
    #[cfg(test)]
    pub(crate) fn raise(&mut self, flags: u32) {
        self.status |= flags;
    }

    /// The level of the interrupt line.
    pub(crate) fn interrupt(&self) -> bool {
        let asked = |flag, enable| self.status & flag != 0 && self.control & enable != 0;
        asked(EOP, EOPIE) || asked(OPERR, ERRIE)
    }

    /// Reads the register at `offset` from 0x40023C00.
    pub(crate) fn read(&self, offset: u32, now: u64) -> u32 {
        match offset {
            0x00 => self.acr,
            0x0C => self.status | if self.busy_until > now { BSY } else { 0 },
            0x10 => self.control,
            0x14 => 0x0FFF_AAED, // FLASH_OPTCR as delivered
            _ => 0,
        }
    }

    /// Writes the register at `offset` from 0x40023C00. Returns the erase that the write starts.
    pub(crate) fn write(
        &mut self,
        offset: u32,
        value: u32,
        (now, hclk): (u64, u32),
        warnings: &mut Warnings,
    ) -> Option<Erase> {
        match offset {
            0x00 => self.write_access(value, warnings),
            0x04 => self.write_key(value),
            0x0C => self.status &= !(value & 0xF3),
            0x10 if self.lock == Lock::Open => {
                return self.write_control(value, (now, hclk), warnings)
            }
            0x10 => warnings.add(Warning::FlashLocked),
            _ => {
                let address = BASE + offset;
                warnings.add(Warning::NotModelled { address });
            }
        }
        None
    }

    /// Writes FLASH_ACR: a cache is reset only while it is off (section 3.9.1).
    fn write_access(&mut self, value: u32, warnings: &mut Warnings) {
        let ignored = value & (self.acr & CACHES) << 2;
        if ignored != 0 {
            warnings.add(Warning::CacheReset);
        }
        self.acr = value & !ignored;
    }

    /// Returns true if a wrong key has barred the interface.
    pub(crate) fn is_barred(&self) -> bool {
        self.lock == Lock::Barred
    }

    fn write_key(&mut self, key: u32) {
        self.lock = match (self.lock, key) {
            (Lock::Locked, key) if key == KEYS[0] => Lock::FirstKey,
            (Lock::FirstKey, key) if key == KEYS[1] => Lock::Open,
            (Lock::Open, _) => Lock::Open,
            (Lock::Locked | Lock::FirstKey | Lock::Barred, _) => Lock::Barred,
        };
        if self.lock == Lock::Open {
            self.control &= !LOCK;
        }
    }

    fn write_control(
        &mut self,
        value: u32,
        time: (u64, u32),
        warnings: &mut Warnings,
    ) -> Option<Erase> {
        self.control = value & !STRT;
        if value & LOCK != 0 {
            self.lock = Lock::Locked;
        }
        if value & STRT == 0 {
            return None;
        }
        // STRT needs MER or SER. If both are set, MER has precedence (section 3.6.3).
        if value & (MER | SER) != SER {
            let address = BASE + 0x10;
            warnings.add(Warning::NotModelled { address });
            return None;
        }
        let Some((range, milliseconds)) = sector(value >> 3 & 15, value >> 8 & 3) else {
            warnings.add(Warning::NoSuchSector);
            return None;
        };
        self.busy(time, milliseconds * 1000);
        Some(Erase { range })
    }

    /// Starts to program a unit, which takes `micros` µs. Returns whether the registers allow it.
    pub(crate) fn program(
        &mut self,
        width: Width,
        micros: u32,
        time: (u64, u32),
        warnings: &mut Warnings,
    ) -> bool {
        if self.lock != Lock::Open || self.control & PG == 0 {
            self.fail(PGSERR);
            warnings.add(Warning::FlashWriteNotEnabled);
            return false;
        }
        let expected = match self.control >> 8 & 3 {
            0 => Some(Width::Byte),
            1 => Some(Width::Half),
            2 => Some(Width::Word),
            // Double words, which the core does not write at once.
            _ => None,
        };
        if Some(width) != expected {
            self.fail(PGPERR);
            warnings.add(Warning::FlashWriteWidth);
            return false;
        }
        self.busy(time, micros.into());
        true
    }

    /// Sets a flag of an error. OPERR comes with it if interrupts of errors are on (section 3.9.5).
    fn fail(&mut self, flag: u32) {
        self.status |= flag;
        if self.control & ERRIE != 0 {
            self.status |= OPERR;
        }
    }

    fn busy(&mut self, (now, hclk): (u64, u32), microseconds: u64) {
        let cycles = microseconds * u64::from(hclk) / 1_000_000;
        self.busy_until = self.busy_until.max(now) + cycles;
        if self.control & EOPIE != 0 {
            self.report_at = self.busy_until;
        }
    }
}

/// The place of a sector (RM0090 table 5), and the time of its erase at a parallelism, ms.
fn sector(number: u32, parallelism: u32) -> Option<(Range<usize>, u64)> {
    const K: usize = 1024;
    let number = number as usize;
    let (start, length, times) = match number {
        0..=3 => (number * 16 * K, 16 * K, [400, 300, 250]),
        4 => (64 * K, 64 * K, [1200, 700, 550]),
        5..=11 => ((number - 4) * 128 * K, 128 * K, [2000, 1300, 1000]),
        _ => return None,
    };
    let time = times[parallelism.min(2) as usize];
    Some((start..start + length, time))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIME: (u64, u32) = (0, 168_000_000);

    fn unlocked() -> (Flash, Warnings) {
        let (mut flash, mut warnings) = (Flash::new(), Warnings::default());
        for key in KEYS {
            flash.write(0x04, key, TIME, &mut warnings);
        }
        (flash, warnings)
    }

    #[test]
    fn control_is_locked_until_both_keys() {
        let (mut flash, mut warnings) = (Flash::new(), Warnings::default());
        flash.write(0x10, PG, TIME, &mut warnings);
        assert_eq!(flash.read(0x10, 0), LOCK);
        let (mut flash, mut warnings) = unlocked();
        flash.write(0x10, PG, TIME, &mut warnings);
        assert_eq!(flash.read(0x10, 0), PG);
    }

    #[test]
    fn a_wrong_key_bars_the_flash_until_the_reset() {
        let (mut flash, mut warnings) = (Flash::new(), Warnings::default());
        for key in [KEYS[1], KEYS[0], KEYS[1]] {
            flash.write(0x04, key, TIME, &mut warnings);
        }
        assert_eq!(flash.read(0x10, 0), LOCK);
        assert!(flash.is_barred());
    }

    #[test]
    fn a_cache_is_reset_only_while_it_is_off() {
        let (mut flash, mut warnings) = (Flash::new(), Warnings::default());
        for value in [3 << 9, 1 << 9, 1 << 9 | 1 << 12] {
            flash.write(0x00, value, TIME, &mut warnings);
            assert_eq!((flash.acr, warnings.all()), (value, &[][..]));
        }
        flash.write(0x00, 1 << 9 | 3 << 11, TIME, &mut warnings);
        assert_eq!(flash.acr, 1 << 9 | 1 << 12);
        assert_eq!(warnings.all(), [Warning::CacheReset]);
    }

    #[test]
    fn errors_interrupt_where_asked() {
        let (mut flash, mut warnings) = unlocked();
        flash.write(0x10, PG | ERRIE | 3 << 8, TIME, &mut warnings);
        assert!(!flash.program(Width::Word, 16, TIME, &mut warnings));
        assert_eq!(flash.read(0x0C, 0), PGPERR | OPERR);
        assert!(flash.interrupt());
        flash.write(0x0C, OPERR, TIME, &mut warnings);
        assert!(!flash.interrupt());
    }

    #[test]
    fn what_is_not_modelled_is_said() {
        for (offset, value) in [
            (0x08, 0x0819_2A3B),
            (0x10, MER | STRT),
            (0x10, MER | SER | STRT),
            (0x10, STRT),
            (0x14, 2),
        ] {
            let (mut flash, mut warnings) = unlocked();
            assert_eq!(flash.write(offset, value, TIME, &mut warnings), None);
            let address = BASE + offset;
            assert_eq!(warnings.all(), [Warning::NotModelled { address }]);
        }
        let (mut flash, mut warnings) = (Flash::new(), Warnings::default());
        flash.write(0x10, PG, TIME, &mut warnings);
        assert_eq!(warnings.all(), [Warning::FlashLocked]);
    }

    #[test]
    fn sector_sizes_and_places_are_those_of_the_manuals_table_5() {
        assert_eq!(sector(1, 0), Some((0x4000..0x8000, 400)));
        assert_eq!(sector(4, 2), Some((0x1_0000..0x2_0000, 550)));
        assert_eq!(sector(11, 0), Some((0xE_0000..0x10_0000, 2000)));
        assert_eq!(sector(12, 0), None);
    }

    #[test]
    fn an_erase_is_busy_for_its_time_and_reports_its_end_where_asked() {
        let (mut flash, mut warnings) = unlocked();
        let erase = flash.write(0x10, SER | STRT | EOPIE | 2 << 3, TIME, &mut warnings);
        assert_eq!(erase.unwrap().range, 0x8000..0xC000);
        assert_eq!(flash.busy_until, 67_200_000);
        assert_eq!(flash.next_event(), 67_200_000);
        assert_eq!(flash.read(0x0C, 1000), BSY);
        assert!(!flash.interrupt());
        flash.event();
        assert!(flash.interrupt());
        flash.write(0x0C, EOP, TIME, &mut warnings);
        assert!(!flash.interrupt());
    }

    #[test]
    fn programming_needs_pg_and_the_width_of_psize() {
        let (mut flash, mut warnings) = unlocked();
        assert!(!flash.program(Width::Word, 16, TIME, &mut warnings));
        flash.write(0x10, PG | 2 << 8, TIME, &mut warnings);
        assert!(!flash.program(Width::Byte, 16, TIME, &mut warnings));
        assert!(flash.program(Width::Word, 16, TIME, &mut warnings));
        assert_eq!(flash.busy_until, 2688);
    }
}
