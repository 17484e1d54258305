//! The system timer (DDI 0403, B3.3): counts down at HCLK or an eighth of it (RM0090 section 7.2,
//! the clock tree).
//!
//! Not modelled: SYST_CALIB (reads as zero).
use super::NEVER;

/// SYST_CSR: the timer is enabled.
const ENABLE: u32 = 1;
/// SYST_CSR: reaching zero makes the exception pending.
const INTERRUPT: u32 = 1 << 1;
/// SYST_CSR: the timer counts HCLK instead of an eighth of it.
const CORE_CLOCK: u32 = 1 << 2;
/// SYST_CSR: the count has reached zero since the last read.
const REACHED_ZERO: u32 = 1 << 16;

/// The timer's registers. The count is calculated from the last known one.
#[derive(Clone, Debug)]
pub(crate) struct SysTick {
    control: u32,
    reload: u32,
    /// The count at `since`.
    count: u32,
    since: u64,
    next: u64,
    reached_zero: bool,
}

impl SysTick {
    pub(crate) fn new() -> Self {
        SysTick {
            control: 0,
            reload: 0,
            count: 0,
            since: 0,
            next: NEVER,
            reached_zero: false,
        }
    }

    /// The cycle at which the count reaches zero next.
    pub(crate) fn next_event(&self) -> u64 {
        self.next
    }

    /// The count has reached zero. Returns whether that makes the exception pending.
    pub(crate) fn event(&mut self, now: u64) -> bool {
        self.reached_zero = true;
        // The reload value is loaded one clock later.
        self.count = self.reload;
        self.since = now + self.clock();
        self.plan();
        self.control & INTERRUPT != 0
    }

    /// Reads the register at `offset` from 0xE000E010.
    pub(crate) fn read(&mut self, offset: u32, now: u64) -> u32 {
        match offset {
            0x0 => {
                let reached = core::mem::take(&mut self.reached_zero);
                self.control | if reached { REACHED_ZERO } else { 0 }
            }
            0x4 => self.reload,
            0x8 => self.count(now),
            _ => 0,
        }
    }

    /// Writes the register at `offset` from 0xE000E010.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: u64) {
        self.count = self.count(now);
        self.since = now;
        match offset {
            0x0 => self.control = value & 7,
            0x4 => self.reload = value & 0x00FF_FFFF,
            0x8 => {
                self.count = 0;
                self.reached_zero = false;
            }
            _ => {}
        }
        if self.control & ENABLE != 0 && self.count == 0 && self.reload != 0 {
            self.count = self.reload;
            self.since = now + self.clock();
        }
        self.plan();
    }

    /// The cycles of HCLK in a count.
    fn clock(&self) -> u64 {
        if self.control & CORE_CLOCK != 0 {
            1
        } else {
            8
        }
    }

    fn count(&self, now: u64) -> u32 {
        if self.control & ENABLE == 0 {
            return self.count;
        }
        let counted = now.saturating_sub(self.since) / self.clock();
        self.count
            .saturating_sub(u32::try_from(counted).unwrap_or(u32::MAX))
    }

    fn plan(&mut self) {
        self.next = if self.control & ENABLE == 0 || self.count == 0 {
            NEVER
        } else {
            self.since + u64::from(self.count) * self.clock()
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counting(reload: u32) -> SysTick {
        let mut timer = SysTick::new();
        timer.write(0x4, reload, 0);
        timer.write(0x8, 0, 0);
        timer.write(0x0, ENABLE | INTERRUPT | CORE_CLOCK, 0);
        timer
    }

    #[test]
    fn the_period_is_the_reload_value_and_one() {
        let mut timer = counting(999);
        let first = timer.next_event();
        assert!(timer.event(first));
        assert_eq!(timer.next_event() - first, 1000);
    }

    #[test]
    fn reading_the_control_register_clears_its_flag() {
        let mut timer = counting(99);
        timer.event(timer.next_event());
        assert_eq!(timer.read(0x0, 200), 7 | REACHED_ZERO);
        assert_eq!(timer.read(0x0, 200), 7);
    }

    #[test]
    fn it_counts_down_at_the_clock_that_is_selected() {
        let mut timer = counting(999);
        assert_eq!(timer.read(0x8, 101), 899);
        timer.write(0x0, ENABLE, 101); // an eighth of HCLK
        assert_eq!(timer.read(0x8, 101 + 80), 889);
    }

    #[test]
    fn a_reload_value_of_zero_stops_it() {
        let mut timer = counting(0);
        assert_eq!(timer.next_event(), NEVER);
        timer.write(0x4, 9, 50);
        assert_ne!(timer.next_event(), NEVER);
    }
}
