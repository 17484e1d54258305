//! A timer's counter (RM0090 chapters 17 to 20): TIM1 to TIM14, counting up.
//!
//! The count is calculated from the last known one: only compare matches and overflows are events.
//!
//! ```text
//!  count ^      ______CCR3___overflow: update event, shadow registers are loaded
//!        |   __/  :      : __/
//!        | _/     :      :/
//!        +--------+------+--------> HCLK cycles, (PSC + 1) × clock for each count
//! ```
//!
//! Counting begins in the cycle in which CEN is set, and a flag rises in the cycle of its match; on
//! the chip each takes one or two clocks of the timer more. An edge is captured in its own cycle;
//! on the chip it is first sampled by the timer's clock, and captured a count or two later. The
//! prescaler's count is lost when the counter is stopped.
//!
//! Not modelled, and warned of: counting down or both ways; slave modes, external clocks and
//! triggers; breaks, dead times, locks and COM events; bursts of DMA, and DMA requests at the
//! update instead of the match; prescalers, filters and triggers of input capture.
use super::{
    timer_map::Instance,
    timer_output::{Output, Outputs},
    NEVER,
};
use crate::warning::{Warning, Warnings};

/// TIMx_CR1: counter enable, update disable, update request source, one pulse, direction and
/// alignment, ARR preload.
const CEN: u32 = 1;
const UDIS: u32 = 1 << 1;
const URS: u32 = 1 << 2;
const OPM: u32 = 1 << 3;
const DIR_CMS: u32 = 7 << 4;
const ARPE: u32 = 1 << 7;
/// TIMx_CR2.OISx and OISxN: the levels of outputs while MOE is off. Its other bits are not
/// modelled.
const IDLE_LEVELS: u32 = 0x7F << 8;
/// TIMx_SMCR: slave mode, external clock.
const SMS: u32 = 7;
const ECE: u32 = 1 << 14;
/// TIMx_SR and TIMx_DIER: update, and the first of the compare channels.
const UIF: u32 = 1;
const CC1IF: u32 = 1 << 1;
/// TIMx_SR: a capture came while the flag of the capture before was still set.
const CC1OF: u32 = 1 << 9;
/// TIMx_DIER: DMA requests at update and compare.
const UDE: u32 = 1 << 8;
const CC1DE: u32 = 1 << 9;
/// TIMx_DIER: requests of triggers, breaks and COM events.
const OTHER_REQUESTS: u32 = 0x60E0;
/// TIMx_EGR.UG: make an update event.
const UG: u32 = 1;
/// TIMx_EGR: triggers, breaks and COM events.
const OTHER_EVENTS: u32 = 0xE0;
/// The four compare flags, in SR and EGR.
const COMPARES: u32 = 0xF << 1;

/// The requests of a timer to the DMA controllers, and the flags that rose.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct TimerRequests {
    pub(crate) update: bool,
    /// One bit for each channel.
    pub(crate) compare: u8,
    /// One bit for each channel whose flag rose.
    pub(crate) matched: u8,
}

/// A timer's registers.
#[derive(Clone, Debug)]
pub(crate) struct Timer {
    pub(crate) instance: &'static Instance,
    cr1: u32,
    cr2: u32,
    smcr: u32,
    dier: u32,
    sr: u32,
    psc: u32,
    arr: u32,
    rcr: u32,
    dcr: u32,
    /// The option register, which selects the source of an input.
    or: u32,
    /// The cycle up to which edges of the crystal have been shown to the input.
    shown: u64,
    pub(crate) outputs: Outputs,
    /// The values in force until the next update event loads the registers' values.
    prescaler: u32,
    top: u32,
    repetitions: u32,
    /// The count at `since`.
    count: u32,
    since: u64,
    /// The HCLK cycles in a clock of the timer.
    clock: u64,
    next: u64,
}

impl Timer {
    /// The state after a reset.
    pub(crate) fn new(instance: &'static Instance) -> Self {
        let top = instance.mask();
        Timer {
            instance,
            cr1: 0,
            cr2: 0,
            smcr: 0,
            dier: 0,
            sr: 0,
            psc: 0,
            arr: top,
            rcr: 0,
            dcr: 0,
            or: 0,
            shown: 0,
            outputs: Outputs::default(),
            prescaler: 0,
            top,
            repetitions: 0,
            count: 0,
            since: 0,
            clock: 1,
            next: NEVER,
        }
    }

    /// Sets how many HCLK cycles a clock of the timer takes from now on. Clocks that the prescaler
    /// has counted stay counted. Events that are due by now must have happened.
    pub(crate) fn set_clock(&mut self, cycles: u64, now: u64) {
        self.synchronise(now);
        let prescaled = now.saturating_sub(self.since) / self.clock;
        self.since = now.saturating_sub(prescaled * cycles);
        self.clock = cycles;
        self.plan();
    }

    /// The cycle of the next match or overflow.
    pub(crate) fn next_event(&self) -> u64 {
        self.next
    }

    /// Returns true if the timer counts: a top of 0 stops it (RM0090 section 18.4.12).
    fn counts(&self) -> bool {
        self.cr1 & CEN != 0 && self.top != 0
    }

    /// The HCLK cycles in a count.
    fn period(&self) -> u64 {
        self.clock * (u64::from(self.prescaler) + 1)
    }

    fn count_at(&self, now: u64) -> u32 {
        if !self.counts() {
            return self.count;
        }
        let counted = now.saturating_sub(self.since) / self.period();
        (u64::from(self.count) + counted) as u32
    }

    /// Updates the known count to now.
    fn synchronise(&mut self, now: u64) {
        self.count = self.count_at(now);
        if self.counts() {
            let whole = now.saturating_sub(self.since) / self.period();
            self.since += whole * self.period();
        } else {
            self.since = now;
        }
    }

    /// The last count before the overflow. A count already beyond the top goes on to the end of the
    /// register.
    fn last_count(&self) -> u32 {
        if self.count > self.top {
            self.instance.mask()
        } else {
            self.top
        }
    }

    /// Calculates the cycle of the next event.
    fn plan(&mut self) {
        if !self.counts() {
            self.next = NEVER;
            return;
        }
        let last = self.last_count();
        let overflow = u64::from(last) + 1 - u64::from(self.count);
        let counts = self
            .compares()
            .map(|channel| self.outputs.compare(channel))
            .filter(|&compare| compare > self.count && compare <= last)
            .map(|compare| u64::from(compare - self.count))
            .fold(overflow, u64::min);
        self.next = self.since + counts * self.period();
    }

    fn channels(&self) -> core::ops::Range<usize> {
        0..usize::from(self.instance.channels)
    }

    /// The channels in compare mode.
    fn compares(&self) -> impl Iterator<Item = usize> + '_ {
        let channels = self.channels();
        channels.filter(|&channel| !self.outputs.is_input(channel))
    }

    /// Shows TIM11's input the edges of the crystal's clock for the RTC up to now, if the option
    /// register connects them (RM0090 section 19.5.11). `crystal` edges come in `core` cycles.
    pub(crate) fn show_crystal(&mut self, (crystal, core): (u64, u64), now: u64) {
        const TIM11: u32 = 0x4001_4800;
        const HSE_RTC: u32 = 0b10;
        let begin = core::mem::replace(&mut self.shown, now);
        if self.or & 3 != HSE_RTC || self.instance.base != TIM11 || crystal == 0 {
            return;
        }
        let number = |cycle: u64| cycle * crystal / core;
        for edge in number(begin) + 1..=number(now) {
            self.edge(0, true, (edge * core).div_ceil(crystal).min(now));
        }
    }

    /// The level of the timer's pin `input` has changed; 0 is the pin of channel 1. Channels
    /// capture the count (RM0090 section 18.3.5). Events that are due by now must have happened.
    pub(crate) fn edge(&mut self, input: usize, rises: bool, now: u64) -> TimerRequests {
        let count = self.count_at(now);
        let mut captured = 0;
        for channel in self.channels() {
            if self.outputs.captures(channel, input, rises)
                && self.outputs.passes_prescaler(channel)
            {
                self.capture(channel, count);
                captured |= 1 << channel;
            }
        }
        TimerRequests {
            matched: 0,
            ..self.requests(false, captured)
        }
    }

    fn capture(&mut self, channel: usize, count: u32) {
        self.outputs.capture(channel, count);
        // The capture before has not been read.
        if self.sr & CC1IF << channel != 0 {
            self.sr |= CC1OF << channel;
        }
        self.sr |= CC1IF << channel;
    }

    /// The count of the planned event has come.
    pub(crate) fn event(&mut self, now: u64) -> TimerRequests {
        let last = self.last_count();
        let counted = now.saturating_sub(self.since) / self.period();
        let count = u64::from(self.count) + counted;
        self.since = now;
        let overflow = count > u64::from(last);
        let above = if overflow { self.above_top() } else { 0 };
        self.count = if overflow { 0 } else { count as u32 };
        let updated = overflow && self.overflow();
        let matched = self.matches();
        self.outputs.follow(self.count, matched);
        self.sr |= u32::from(above) * CC1IF;
        self.plan();
        self.requests(updated, matched | above)
    }

    /// Handles an overflow. Returns whether it is an update event.
    fn overflow(&mut self) -> bool {
        if self.cr1 & UDIS != 0 {
            return false;
        }
        if self.repetitions > 0 {
            self.repetitions -= 1;
            return false;
        }
        self.update();
        self.sr |= UIF;
        true
    }

    /// An update event: loads the shadow registers (RM0090 section 18.3.1). It stops the counter in
    /// one-pulse mode, also if the program has made it (section 18.4.1, OPM and CEN).
    fn update(&mut self) {
        if self.cr1 & OPM != 0 {
            self.cr1 &= !CEN;
        }
        self.prescaler = self.psc;
        self.top = self.arr;
        self.repetitions = self.rcr;
        self.outputs.update();
    }

    /// Sets the flags of the channels that match the count; returns a bit for each.
    fn matches(&mut self) -> u8 {
        let matched = self.compare_where(|compare| compare == self.count);
        self.sr |= u32::from(matched) * CC1IF;
        matched
    }

    /// The channels whose compare value no count reaches, one bit each: their flags rise at the
    /// overflow (RM0090 section 18.4.5, CC1IF).
    fn above_top(&self) -> u8 {
        self.compare_where(|compare| compare > self.top)
    }

    /// The channels for whose compare value `is_one` holds, one bit each.
    fn compare_where(&self, is_one: impl Fn(u32) -> bool) -> u8 {
        self.compares()
            .filter(|&channel| is_one(self.outputs.compare(channel)))
            .fold(0, |all, channel| all | 1 << channel)
    }

    fn requests(&self, updated: bool, matched: u8) -> TimerRequests {
        TimerRequests {
            update: updated && self.dier & UDE != 0,
            compare: matched & (self.dier / CC1DE) as u8 & 0xF,
            matched,
        }
    }

    /// The level of the update interrupt.
    pub(crate) fn update_interrupt(&self) -> bool {
        self.sr & self.dier & UIF != 0
    }

    /// The level of the compare interrupt.
    pub(crate) fn compare_interrupt(&self) -> bool {
        self.sr & self.dier & COMPARES != 0
    }

    /// The PWM of a channel: the HCLK cycles for which it is high, and the HCLK cycles of the
    /// period.
    pub(crate) fn duty(&self, channel: usize) -> Option<(u64, u64)> {
        let counts = u64::from(self.top) + 1;
        let high = self.outputs.high_counts(channel, counts)?;
        let running = if self.counts() { self.period() } else { 0 };
        Some((high * running, counts * running))
    }

    /// The register at `offset` is about to be read, which clears the flag of a capture. Answers
    /// whether it did.
    pub(crate) fn take_capture(&mut self, offset: u32) -> bool {
        let channel = match offset {
            0x34..=0x40 => (offset as usize - 0x34) / 4,
            _ => return false,
        };
        let flag = CC1IF << channel;
        let takes = self.outputs.is_input(channel) && self.sr & flag != 0;
        if takes {
            self.sr &= !flag;
        }
        takes
    }

    /// Reads the register at `offset` from its base.
    pub(crate) fn read(&self, offset: u32, now: u64) -> u32 {
        match offset {
            0x00 => self.cr1,
            0x04 => self.cr2,
            0x08 => self.smcr,
            0x0C => self.dier,
            0x10 => self.sr,
            0x24 => self.count_at(now),
            0x28 => self.psc,
            0x2C => self.arr,
            0x30 => self.rcr,
            0x48 => self.dcr,
            0x50 => self.or,
            _ => self.outputs.read(offset),
        }
    }

    /// Writes the register at `offset` from its base.
    pub(crate) fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: u64,
        warnings: &mut Warnings,
    ) -> TimerRequests {
        self.synchronise(now);
        let mask = self.instance.mask();
        let mut requests = TimerRequests::default();
        match offset {
            0x00 => self.write_control(value, now),
            0x04 => self.cr2 = value,
            0x08 => self.smcr = value,
            0x0C => self.dier = value,
            0x10 => self.sr &= value,
            0x14 => requests = self.generate(value, now),
            0x24 => self.count = value & mask,
            0x28 => self.psc = value & 0xFFFF,
            0x2C => self.write_top(value & mask),
            0x30 => self.rcr = value & 0xFF,
            0x48 => self.dcr = value,
            0x50 => self.or = value,
            _ => self.outputs.write(offset, value & self.output_mask(offset)),
        }
        let is_modelled = match offset {
            0x14 => value & OTHER_EVENTS == 0,
            0x4C => false,
            _ => self.is_modelled(),
        };
        if !is_modelled {
            let base = self.instance.base;
            warnings.add(Warning::TimerMode { base });
        }
        self.outputs.follow(self.count, 0);
        self.plan();
        requests
    }

    /// Returns true if all that the registers ask for is modelled.
    fn is_modelled(&self) -> bool {
        let mut channels = self.channels();
        self.cr1 & DIR_CMS == 0
            && self.cr2 & !IDLE_LEVELS == 0
            && self.smcr & (SMS | ECE) == 0
            && self.dier & OTHER_REQUESTS == 0
            && self.dcr == 0
            && self.outputs.has_plain_levels()
            && !channels.any(|channel| self.outputs.is_conditioned(channel))
    }

    /// The bits of the output register at `offset`: compare registers are as wide as the counter.
    fn output_mask(&self, offset: u32) -> u32 {
        match offset {
            0x34..=0x40 => self.instance.mask(),
            _ => u32::MAX,
        }
    }

    fn write_control(&mut self, value: u32, now: u64) {
        if value & !self.cr1 & CEN != 0 {
            self.since = now;
        }
        self.cr1 = value;
        self.write_top(self.arr);
    }

    fn write_top(&mut self, value: u32) {
        self.arr = value;
        if self.cr1 & ARPE == 0 {
            self.top = value;
        }
    }

    /// TIMx_EGR: makes the events that the program asks for.
    fn generate(&mut self, value: u32, now: u64) -> TimerRequests {
        let (mut events, mut captured) = (0, 0);
        for channel in self.channels().filter(|channel| value >> channel & 2 != 0) {
            if self.outputs.is_input(channel) {
                self.capture(channel, self.count);
                captured |= 1 << channel;
            } else {
                self.sr |= CC1IF << channel;
                events |= 1 << channel;
            }
        }
        let updated = value & UG != 0 && self.restart(now);
        if value & UG != 0 {
            events |= self.matches();
        }
        TimerRequests {
            matched: events,
            ..self.requests(updated, events | captured)
        }
    }

    /// Restarts the count at 0. Returns whether that is an update event that is signalled.
    fn restart(&mut self, now: u64) -> bool {
        (self.count, self.since) = (0, now);
        if self.cr1 & UDIS != 0 {
            return false;
        }
        self.update();
        let is_told = self.cr1 & URS == 0;
        if is_told {
            self.sr |= UIF;
        }
        is_told
    }

    /// The level of a pin that the timer drives; `None` if it does not drive it.
    pub(crate) fn level(&self, output: Output) -> Option<bool> {
        if !self.instance.advanced {
            return self.outputs.level(output);
        }
        let idle = 8 + 2 * output.channel + u8::from(output.complementary);
        let idle_level = self.cr2 >> idle & 1 != 0;
        self.outputs.advanced_level(output, idle_level)
    }
}

#[cfg(test)]
#[path = "timer_tests.rs"]
mod tests;
