//! The user of the CPU at each time (the step interrupt, other interrupts, or the main loop), and
//! the CPU's load.
//!
//! ```text
//!  ticks              ====           ====            highest priority
//!  pulse end              ==   ====|     |====       below it: a tick interrupts it
//!  serial, switches         ==                       below both: only their time is counted
//!  main loop                  =               =====  the rest; interrupts make a poll end later
//! ```
//!
//! Cycles of the step interrupts are collected in slots of a quarter of a millisecond. Cycles that
//! do not fit into a slot carry over into the next. The peak is the busiest run of four slots: the
//! busiest millisecond, to a quarter of one. The main loop does not count towards the peak: it is
//! always busy while lines come as fast as it takes them, and motion does not depend on it.

use crate::clock::{Cycle, CPU_HZ};

/// Slots in a millisecond.
const SLOTS: usize = 4;

/// Cycles in a slot.
const SLOT: u64 = CPU_HZ / 1000 / SLOTS as u64;

/// Tracks the work of the CPU, and when it is free.
#[derive(Clone, Debug)]
pub struct Cpu {
    /// The end of the tick under way.
    tick_until: Cycle,
    /// The end of the tick or pulse end under way.
    timer_until: Cycle,
    main_until: Cycle,
    /// Cycles of the main loop and of other interrupts.
    other: u64,
    /// Cycles of step interrupts put into slots.
    busy: u64,
    /// Cycles of step interrupts not yet put into a slot.
    pending: u64,
    slot_end: Cycle,
    slots: [u64; SLOTS],
    slot: usize,
    window: u64,
    peak: u64,
}

/// The load of the CPU.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct CpuLoad {
    /// Share of all cycles, 0 to 1.
    pub mean: f64,
    /// The largest share of a millisecond that step interrupts took, 0 to 1.
    pub peak: f64,
}

impl Default for Cpu {
    fn default() -> Self {
        Self::new()
    }
}

impl Cpu {
    /// Makes the table of a CPU that has not run yet.
    pub const fn new() -> Self {
        Self {
            tick_until: Cycle::ZERO,
            timer_until: Cycle::ZERO,
            main_until: Cycle::ZERO,
            other: 0,
            busy: 0,
            pending: 0,
            slot_end: Cycle(SLOT),
            slots: [0; SLOTS],
            slot: 0,
            window: 0,
            peak: 0,
        }
    }

    /// Returns when a tick that is due at `due` begins: at `due`, or at the end of the tick before
    /// it.
    #[inline]
    pub fn tick_start(&self, due: Cycle) -> Cycle {
        due.max(self.tick_until)
    }

    /// Returns when the end of a pulse that is due at `due` begins: at `due`, or once the CPU has
    /// done the tick or the pulse end before it.
    #[inline]
    pub fn pulse_end_start(&self, due: Cycle) -> Cycle {
        due.max(self.timer_until)
    }

    /// Charges a tick that begins at `start`. If it interrupts the end of a pulse, that end takes
    /// longer.
    #[inline]
    pub fn charge_tick(&mut self, start: Cycle, cycles: u32) {
        self.tick_until = start + u64::from(cycles);
        self.timer_until = self.timer_until.max(start) + u64::from(cycles);
        self.delay_main(start, cycles);
        self.charge(start, u64::from(cycles));
    }

    /// Returns true if the CPU is free at `at`.
    #[inline]
    pub fn is_free(&self, at: Cycle) -> bool {
        self.main_start(Cycle::ZERO) <= at
    }

    /// Charges `count` ticks of `cycles` each. The first begins at `first`, the last at `last`, the
    /// others evenly between them. Nothing else is under way meanwhile, and each tick ends before
    /// the next begins.
    #[inline]
    pub fn charge_ticks(&mut self, [first, last]: [Cycle; 2], count: u32, cycles: u32) {
        self.tick_until = last + u64::from(cycles);
        self.timer_until = self.tick_until;
        let (mut left, mut next) = (u64::from(count), first);
        while last >= self.slot_end && left > 0 {
            let every = ((last - first) / u64::from(count - 1).max(1)).max(1);
            if next >= self.slot_end {
                self.roll(next);
            }
            let in_slot = left.min((self.slot_end - next).div_ceil(every));
            self.pending += in_slot * u64::from(cycles);
            next = next + in_slot * every;
            left -= in_slot;
        }
        self.pending += left * u64::from(cycles);
    }

    /// Charges the end of a pulse that begins at `start`.
    #[inline]
    pub fn charge_pulse_end(&mut self, start: Cycle, cycles: u32) {
        self.timer_until = start + u64::from(cycles);
        self.delay_main(start, cycles);
        self.charge(start, u64::from(cycles));
    }

    /// Lengthens the poll under way at `start` by the time of many interrupts.
    #[inline]
    pub fn delay(&mut self, start: Cycle, cycles: u64) {
        if self.main_until > start {
            self.main_until = self.main_until + cycles;
        }
    }

    /// Charges the ends of many pulses, of which the first comes after `start`.
    #[inline]
    pub fn charge_pulses(&mut self, start: Cycle, cycles: u64) {
        self.delay(start, cycles);
        self.pending += cycles;
    }

    /// Charges an interrupt that is neither a tick nor the end of a pulse.
    #[inline]
    pub fn charge_interrupt(&mut self, start: Cycle, cycles: u32) {
        self.delay_main(start, cycles);
        self.other += u64::from(cycles);
    }

    /// Lengthens the poll under way by the time of an interrupt.
    #[inline]
    fn delay_main(&mut self, start: Cycle, cycles: u32) {
        if self.main_until > start {
            self.main_until = self.main_until + u64::from(cycles);
        }
    }

    /// Returns when the main loop can go on, if it is woken at `wake`.
    #[inline]
    pub fn main_start(&self, wake: Cycle) -> Cycle {
        wake.max(self.main_until).max(self.timer_until)
    }

    /// Charges a poll that begins at `start`.
    pub fn charge_main(&mut self, start: Cycle, cycles: u64) {
        self.main_until = start + cycles;
        self.other += cycles;
    }

    /// Returns the load from power-up to `end`.
    pub fn load(&self, end: Cycle) -> CpuLoad {
        let mut rest = self.clone();
        rest.roll(end + SLOTS as u64 * SLOT);
        CpuLoad {
            mean: ((self.other + self.busy + self.pending) as f64 / end.0.max(1) as f64).min(1.0),
            peak: rest.peak as f64 / (SLOTS as u64 * SLOT) as f64,
        }
    }

    #[inline]
    fn charge(&mut self, now: Cycle, cycles: u64) {
        if now >= self.slot_end {
            self.roll(now);
        }
        self.pending += cycles;
    }

    /// Closes all slots that end at `now` or before.
    fn roll(&mut self, now: Cycle) {
        while now >= self.slot_end {
            if self.pending == 0 && self.window == 0 {
                let idle = (now - self.slot_end) / SLOT + 1;
                self.slot_end = self.slot_end + idle * SLOT;
                return;
            }
            self.close_slot();
        }
    }

    #[inline]
    fn close_slot(&mut self) {
        let busy = self.pending.min(SLOT);
        self.pending -= busy;
        self.busy += busy;
        let oldest = &mut self.slots[self.slot % SLOTS];
        self.window = self.window + busy - *oldest;
        *oldest = busy;
        self.slot = self.slot.wrapping_add(1);
        self.peak = self.peak.max(self.window);
        self.slot_end = self.slot_end + SLOT;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = CPU_HZ / 1000;

    #[test]
    fn an_interrupt_lengthens_the_poll_that_it_interrupts_and_no_other() {
        let mut cpu = Cpu::new();
        cpu.charge_main(Cycle(100), 1000);
        cpu.charge_tick(Cycle(500), 200);
        assert_eq!(cpu.main_start(Cycle(0)), Cycle(1300));
        cpu.charge_tick(Cycle(2000), 200);
        assert_eq!(cpu.main_start(Cycle(0)), Cycle(2200));
        assert_eq!(cpu.tick_start(Cycle(2100)), Cycle(2200));
    }

    #[test]
    fn a_tick_interrupts_the_end_of_a_pulse_and_not_the_other_way_round() {
        let mut cpu = Cpu::new();
        cpu.charge_pulse_end(Cycle(100), 60);
        assert_eq!(cpu.tick_start(Cycle(120)), Cycle(120));
        cpu.charge_tick(Cycle(120), 200);
        assert_eq!(cpu.pulse_end_start(Cycle(130)), Cycle(360));
        assert_eq!(cpu.main_start(Cycle(0)), Cycle(360));
        cpu.charge_tick(Cycle(1000), 200);
        assert_eq!(cpu.pulse_end_start(Cycle(1100)), Cycle(1200));
    }

    #[test]
    fn mean_and_peak_of_a_burst() {
        let mut cpu = Cpu::new();
        // Half busy during the second of four milliseconds.
        for k in 0..100 {
            cpu.charge_tick(Cycle(MS + k * MS / 100), (MS / 200) as u32);
        }
        let load = cpu.load(Cycle(4 * MS));
        assert!((load.mean - 0.125).abs() < 1e-9);
        assert!((load.peak - 0.5).abs() < 1e-9);
    }

    #[test]
    fn ticks_that_take_longer_than_a_millisecond_are_full_load_and_not_more() {
        let mut cpu = Cpu::new();
        cpu.charge_tick(Cycle(0), 3 * MS as u32);
        let load = cpu.load(Cycle(10 * MS));
        assert!((load.peak - 1.0).abs() < 1e-9);
        assert!((load.mean - 0.3).abs() < 1e-9);
    }

    #[test]
    fn a_main_loop_that_is_always_busy_is_no_peak() {
        let mut cpu = Cpu::new();
        cpu.charge_main(Cycle(0), 2 * MS);
        cpu.charge_interrupt(Cycle(0), MS as u32);
        cpu.charge_tick(Cycle(5 * MS), (MS / 10) as u32);
        let load = cpu.load(Cycle(10 * MS));
        assert!((load.peak - 0.1).abs() < 1e-9);
        assert!((load.mean - 0.31).abs() < 1e-9);
    }

    #[test]
    fn a_long_rest_is_passed_in_one_go() {
        let mut cpu = Cpu::new();
        cpu.charge_tick(Cycle(0), 100);
        cpu.charge_tick(Cycle(u64::MAX / 4), 100);
        assert_eq!(cpu.busy + cpu.pending, 200);
    }
}
