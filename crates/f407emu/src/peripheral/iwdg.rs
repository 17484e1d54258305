//! The independent watchdog (RM0090 chapter 21): resets the chip unless it is fed in time.
//!
//! The time until the reset is
//!
//! ```text
//! timeout = 4 × 2^PR × (RLR + 1) / f_LSI
//! ```
//!
//! f_LSI may be anywhere from 17 to 47 kHz (data sheet, table 39), so that tests run at both ends.
//! Once started, the watchdog cannot be stopped. Its own clock runs on, whatever happens to the
//! other clocks. It starts with the reset value of RLR, 0xFFF; each feeding loads RLR (section
//! 21.3).
//!
//! A new prescaler or reload value takes effect after five clocks of the oscillator (sections
//! 21.4.2 to 21.4.4). Until then SR has a flag for it, and feeding uses the old value. A new
//! prescaler changes the counts that are left, too.
//!
//! Not modelled: the option byte that starts the watchdog at power-on.
use super::NEVER;

/// The bit of DBGMCU_APB1_FZ (RM0090 section 38.16.4) with which the watchdog's clock stands still
/// while a debugger stops the core.
pub(crate) const DBG_STOP: u32 = 1 << 12;
/// IWDG_KR: feeds the watchdog.
const FEED: u32 = 0xAAAA;
/// IWDG_KR: unlocks the other registers.
const UNLOCK: u32 = 0x5555;
/// IWDG_KR: starts the watchdog.
const START: u32 = 0xCCCC;

/// The count with which the watchdog starts.
const FULL: u32 = 0xFFF;
/// IWDG_SR: the prescaler, or the reload value, has not taken effect yet.
const PVU: u32 = 1;
const RVU: u32 = 1 << 1;
/// The clocks of the oscillator until a value takes effect.
const ARRIVES_AFTER: u64 = 5;

/// The lowest frequency that the low-speed oscillator may have, Hz.
pub const LSI_SLOWEST_HZ: u32 = 17_000;
/// The highest frequency that the low-speed oscillator may have, Hz.
pub const LSI_FASTEST_HZ: u32 = 47_000;
/// The typical frequency of the low-speed oscillator, Hz.
pub const LSI_TYPICAL_HZ: u32 = 32_000;

/// Returns true if a word written at `offset` from 0x40003000 feeds the watchdog.
pub(crate) fn is_feeding(offset: u32, value: u32) -> bool {
    (offset, value) == (0, FEED)
}

/// A value on its way into the clock domain of the watchdog.
#[derive(Clone, Copy, Debug)]
struct Arriving {
    /// The value that was written last.
    written: u32,
    /// The value that was in force before.
    before: u32,
    /// The first cycle at which `written` is in force.
    at: u64,
}

impl Arriving {
    fn new(value: u32) -> Self {
        Arriving {
            written: value,
            before: value,
            at: 0,
        }
    }

    fn is_under_way(self, now: u64) -> bool {
        now < self.at
    }

    fn in_force(self, now: u64) -> u32 {
        if self.is_under_way(now) {
            self.before
        } else {
            self.written
        }
    }

    /// Writes a value, if the previous value has taken effect (section 21.4.4).
    fn write(&mut self, value: u32, now: u64, at: u64) {
        if !self.is_under_way(now) {
            *self = Arriving {
                written: value,
                before: self.written,
                at,
            };
        }
    }
}

/// The watchdog.
#[derive(Clone, Debug)]
pub(crate) struct Iwdg {
    prescaler: Arriving,
    reload: Arriving,
    unlocked: bool,
    lsi_hz: u32,
    hclk_hz: u32,
    /// The cycle at which the watchdog resets the chip.
    expires_at: u64,
}

impl Iwdg {
    /// A watchdog that has not been started, with this frequency of its oscillator.
    pub(crate) fn new(lsi_hz: u32, hclk_hz: u32) -> Self {
        Iwdg {
            prescaler: Arriving::new(0),
            reload: Arriving::new(FULL),
            unlocked: false,
            lsi_hz,
            hclk_hz,
            expires_at: NEVER,
        }
    }

    /// The frequency of its oscillator, Hz.
    pub(crate) fn lsi_hz(&self) -> u32 {
        self.lsi_hz
    }

    /// Sets the oscillator's frequency, Hz. It counts from the next feeding on.
    pub(crate) fn set_lsi(&mut self, hz: u32) {
        self.lsi_hz = hz;
    }

    /// HCLK changes: converts the rest of the time to cycles of the new frequency.
    pub(crate) fn set_hclk(&mut self, hz: u32, now: u64) {
        if self.expires_at != NEVER {
            let left = self.expires_at.saturating_sub(now);
            self.expires_at = now + left * u64::from(hz) / u64::from(self.hclk_hz);
        }
        self.hclk_hz = hz;
    }

    /// Stops counting for this number of cycles.
    pub(crate) fn stand_still(&mut self, cycles: u64) {
        self.expires_at = self.expires_at.saturating_add(cycles);
    }

    /// The cycle at which the watchdog resets the chip.
    pub(crate) fn next_event(&self) -> u64 {
        self.expires_at
    }

    /// Returns true if it has been started.
    pub(crate) fn is_running(&self) -> bool {
        self.expires_at != NEVER
    }

    /// Reads the register at `offset` from 0x40003000.
    pub(crate) fn read(&self, offset: u32, now: u64) -> u32 {
        let flag = |value: Arriving, flag| if value.is_under_way(now) { flag } else { 0 };
        match offset {
            0x4 => self.prescaler.written,
            0x8 => self.reload.written,
            0xC => flag(self.prescaler, PVU) | flag(self.reload, RVU),
            _ => 0,
        }
    }

    /// Writes the register at `offset` from 0x40003000.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: u64) {
        let at = now + self.cycles(ARRIVES_AFTER);
        match offset {
            0x0 => self.write_key(value, now),
            0x4 if self.unlocked => self.write_prescaler(value & 7, now, at),
            0x8 if self.unlocked => self.reload.write(value & 0xFFF, now, at),
            _ => {}
        }
    }

    fn write_key(&mut self, key: u32, now: u64) {
        self.unlocked = key == UNLOCK;
        let count = match (key, self.is_running()) {
            (START, false) => FULL,
            (FEED, true) => self.reload.in_force(now),
            _ => return,
        };
        self.expires_at = now + self.timeout(count, now);
        self.change_divider(now);
    }

    fn write_prescaler(&mut self, value: u32, now: u64, at: u64) {
        if !self.prescaler.is_under_way(now) {
            self.prescaler.write(value, now, at);
            self.change_divider(now);
        }
    }

    /// A prescaler that is on its way changes the length of the counts that are left when it
    /// arrives.
    fn change_divider(&mut self, now: u64) {
        let Arriving {
            written,
            before,
            at,
        } = self.prescaler;
        if self.is_running() && now < at && at < self.expires_at {
            let left = (self.expires_at - at) * divider(written) / divider(before);
            self.expires_at = at + left;
        }
    }

    /// The cycles of HCLK from now to the reset, from a count on.
    fn timeout(&self, count: u32, now: u64) -> u64 {
        self.cycles(divider(self.prescaler.in_force(now)) * u64::from(count + 1))
    }

    /// Converts clocks of the oscillator to cycles of HCLK.
    fn cycles(&self, clocks: u64) -> u64 {
        clocks * u64::from(self.hclk_hz) / u64::from(self.lsi_hz)
    }
}

/// The clocks of the oscillator in a count.
fn divider(prescaler: u32) -> u64 {
    4 << prescaler.min(6)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HCLK: u32 = 168_000_000;
    /// A start so late that the values have taken effect: 0.3 ms.
    const START_AT: u64 = 100_000;

    fn started(lsi_hz: u32, prescaler: u32, reload: u32) -> Iwdg {
        let mut watchdog = Iwdg::new(lsi_hz, HCLK);
        watchdog.write(0x0, UNLOCK, 0);
        watchdog.write(0x4, prescaler, 0);
        watchdog.write(0x8, reload, 0);
        watchdog.write(0x0, START, START_AT);
        watchdog.write(0x0, FEED, START_AT);
        watchdog
    }

    fn milliseconds(watchdog: &Iwdg) -> u64 {
        (watchdog.next_event() - START_AT) * 1000 / u64::from(HCLK)
    }

    #[test]
    fn the_timeouts_at_32_khz_are_those_of_the_manuals_table() {
        // RM0090 table 108: the longest timeouts of the shortest and of the longest prescaler
        assert_eq!(milliseconds(&started(32_000, 0, 0xFFF)), 512);
        assert_eq!(milliseconds(&started(32_000, 6, 0xFFF)), 32_768);
    }

    #[test]
    fn the_oscillators_tolerance_spreads_the_timeout_almost_threefold() {
        assert_eq!(milliseconds(&started(LSI_SLOWEST_HZ, 0, 169)), 40);
        assert_eq!(milliseconds(&started(LSI_FASTEST_HZ, 0, 169)), 14);
    }

    #[test]
    fn feeding_begins_the_time_anew_and_starts_nothing() {
        let mut watchdog = started(32_000, 0, 319); // 40 ms
        watchdog.write(0x0, FEED, START_AT + 1_680_000);
        assert_eq!(milliseconds(&watchdog), 50);
        let mut idle = Iwdg::new(32_000, HCLK);
        idle.write(0x0, FEED, 0);
        assert_eq!(idle.next_event(), NEVER);
    }

    #[test]
    fn the_start_counts_from_the_reset_value_and_counts_once() {
        let mut watchdog = Iwdg::new(32_000, HCLK);
        watchdog.write(0x0, UNLOCK, 0);
        watchdog.write(0x8, 319, 0);
        watchdog.write(0x0, START, START_AT);
        assert_eq!(milliseconds(&watchdog), 512);
        watchdog.write(0x0, START, 2 * START_AT);
        assert_eq!(milliseconds(&watchdog), 512);
        watchdog.write(0x0, FEED, START_AT);
        assert_eq!(milliseconds(&watchdog), 40);
    }

    #[test]
    fn a_new_prescaler_changes_the_counts_that_are_left() {
        let mut watchdog = started(32_000, 0, 319);
        let five = 5 * u64::from(HCLK) / 32_000;
        watchdog.write(0x0, UNLOCK, START_AT);
        watchdog.write(0x4, 6, START_AT);
        let left = 6_720_000 - five;
        assert_eq!(watchdog.next_event(), START_AT + five + 64 * left);
        watchdog.write(0x0, FEED, START_AT + five - 1);
        let left = 6_720_000 - 1;
        assert_eq!(watchdog.next_event(), START_AT + five + 64 * left);
        watchdog.write(0x0, FEED, START_AT + five);
        assert_eq!(watchdog.next_event(), START_AT + five + 64 * 6_720_000);
    }

    #[test]
    fn registers_are_locked_until_the_key_and_after_any_other() {
        let mut watchdog = Iwdg::new(32_000, HCLK);
        watchdog.write(0x8, 5, 0);
        assert_eq!(watchdog.read(0x8, 0), 0xFFF);
        watchdog.write(0x0, UNLOCK, 0);
        watchdog.write(0x8, 5, 0);
        assert_eq!(watchdog.read(0x8, 0), 5);
        watchdog.write(0x0, FEED, START_AT);
        watchdog.write(0x8, 6, START_AT);
        assert_eq!(watchdog.read(0x8, START_AT), 5);
    }

    #[test]
    fn a_value_is_in_force_five_clocks_of_the_oscillator_later() {
        let mut watchdog = started(32_000, 0, 319);
        let five = 5 * u64::from(HCLK) / 32_000;
        watchdog.write(0x0, UNLOCK, START_AT);
        watchdog.write(0x8, 79, START_AT);
        assert_eq!(watchdog.read(0xC, START_AT + five - 1), RVU);
        watchdog.write(0x8, 5, START_AT + five - 1);
        watchdog.write(0x0, FEED, START_AT + five - 1);
        assert_eq!(watchdog.next_event(), START_AT + five - 1 + 6_720_000);
        assert_eq!(watchdog.read(0xC, START_AT + five), 0);
        watchdog.write(0x0, FEED, START_AT + five);
        assert_eq!(watchdog.next_event(), START_AT + five + 1_680_000);
    }

    #[test]
    fn a_slower_core_leaves_the_time_as_it_is() {
        let mut watchdog = started(32_000, 0, 319);
        watchdog.set_hclk(16_000_000, START_AT);
        assert_eq!(watchdog.next_event(), START_AT + 640_000);
    }
}
