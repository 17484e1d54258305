//! The ART accelerator between core and flash (RM0090 section 3.5.2): how long a fetch waits.
//!
//! The flash is read in lines of 16 bytes, and each line takes `wait states + 1` cycles. The
//! accelerator keeps 64 lines of instructions and 8 lines of constants (ACR.ICEN, DCEN), and reads
//! the next line ahead (ACR.PRFTEN). A new line replaces the least recently used one: the manual
//! says so for the instruction cache, and says that the data cache works in the same way.
//!
//! An erase leaves the old content in the caches until the program resets them (section 3.6.4). A
//! read of what was erased, through a cache that was not reset since, is told, even if the cache
//! would have given up the old line by then: a program must not count on that. What is programmed
//! goes to the data cache, too. Switching a cache off and on again keeps its lines.

use core::ops::Range;

/// FLASH_ACR: the field of the wait states.
const LATENCY: u32 = 7;
/// FLASH_ACR.PRFTEN: the next line is read ahead.
const PREFETCH: u32 = 1 << 8;
/// FLASH_ACR.ICEN: instruction cache.
const INSTRUCTIONS: u32 = 1 << 9;
/// FLASH_ACR.DCEN: data cache.
const DATA: u32 = 1 << 10;
/// FLASH_ACR.ICRST and DCRST: the caches forget their lines.
const FORGET_INSTRUCTIONS: u32 = 1 << 11;
const FORGET_DATA: u32 = 1 << 12;
/// A line number that no line has.
const NONE: u32 = u32::MAX;

/// The lines that the accelerator holds, and statistics of its hits.
#[derive(Clone, Debug)]
pub(crate) struct Art {
    instructions: Lines<64>,
    data: Lines<8>,
    /// The line that the core fetches from, and when it came.
    current: u32,
    current_since: u64,
    current_data: u32,
    pub(crate) statistics: ArtStatistics,
}

/// The number of times that a line was in the accelerator, and that it had to be read from the
/// flash.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ArtStatistics {
    /// Reads of instruction lines that the accelerator held.
    pub instruction_hits: u64,
    /// Lines of instructions that were read from the flash.
    pub instruction_misses: u64,
    /// Lines of constants that were read from the flash.
    pub data_misses: u64,
}

impl Art {
    /// Makes empty caches.
    pub(crate) fn new() -> Self {
        Art {
            instructions: Lines::new(),
            data: Lines::new(),
            current: NONE,
            current_since: 0,
            current_data: NONE,
            statistics: ArtStatistics::default(),
        }
    }

    /// Forgets all lines.
    pub(crate) fn flush(&mut self) {
        *self = Art {
            statistics: self.statistics,
            ..Art::new()
        };
    }

    /// The program has written FLASH_ACR: forgets the lines of the caches that it resets.
    pub(crate) fn reset(&mut self, acr: u32) {
        if acr & FORGET_INSTRUCTIONS != 0 {
            self.instructions = Lines::new();
            self.current = NONE;
        }
        if acr & FORGET_DATA != 0 {
            self.data = Lines::new();
            self.current_data = NONE;
        }
    }

    /// A part of the flash is erased: what the caches may hold of it is old from now on.
    pub(crate) fn erase(&mut self, addresses: Range<u32>) {
        let lines = addresses.start >> 4..addresses.end.div_ceil(16);
        self.instructions.erase(&lines);
        self.data.erase(&lines);
        for current in [&mut self.current, &mut self.current_data] {
            if lines.contains(current) {
                *current = NONE;
            }
        }
    }

    /// Returns true if a line that may be old has been used since the last call.
    pub(crate) fn take_stale_use(&mut self) -> bool {
        let instructions = core::mem::take(&mut self.instructions.stale_use);
        core::mem::take(&mut self.data.stale_use) || instructions
    }

    /// Returns true if an address lies in the line that the core is fetching from.
    #[inline(always)]
    pub(crate) fn is_current(&self, address: u32) -> bool {
        address >> 4 == self.current
    }

    /// Reads the line of an instruction at cycle `now`. Returns how many cycles the core waits for
    /// it.
    pub(crate) fn fetch(&mut self, address: u32, acr: u32, now: u64) -> u64 {
        let line = address >> 4;
        let next = line == self.current.wrapping_add(1);
        let held = acr & INSTRUCTIONS != 0 && self.instructions.touch(line);
        let full = u64::from(acr & LATENCY);
        let wait = if held {
            self.statistics.instruction_hits += 1;
            0
        } else {
            self.statistics.instruction_misses += 1;
            let ahead = now.saturating_sub(self.current_since);
            if next && acr & PREFETCH != 0 {
                (full + 1).saturating_sub(ahead)
            } else {
                full
            }
        };
        self.current = line;
        self.current_since = now + wait;
        wait
    }

    /// Reads a constant in the flash. Returns how many cycles the core waits for it.
    pub(crate) fn read(&mut self, address: u32, acr: u32) -> u64 {
        let line = address >> 4;
        if line == self.current_data {
            return 0;
        }
        self.current_data = line;
        if acr & DATA != 0 && self.data.touch(line) {
            return 0;
        }
        self.statistics.data_misses += 1;
        u64::from(acr & LATENCY)
    }
}

/// Cached lines, the one used last first.
#[derive(Clone, Debug)]
struct Lines<const COUNT: usize> {
    lines: [u32; COUNT],
    /// From the first to the last line that was erased since the cache was empty.
    erased: Option<Range<u32>>,
    /// One of them was read.
    stale_use: bool,
}

impl<const COUNT: usize> Lines<COUNT> {
    fn new() -> Self {
        Lines {
            lines: [NONE; COUNT],
            erased: None,
            stale_use: false,
        }
    }

    /// Returns true if the cache held a line. If not, the line replaces the least recently used
    /// one.
    fn touch(&mut self, line: u32) -> bool {
        let held = self.lines.iter().position(|&held| held == line);
        self.lines.copy_within(..held.unwrap_or(COUNT - 1), 1);
        self.lines[0] = line;
        let erased = self.erased.as_ref();
        self.stale_use |= erased.is_some_and(|lines| lines.contains(&line));
        held.is_some()
    }

    fn erase(&mut self, lines: &Range<u32>) {
        let before = self.erased.as_ref().unwrap_or(lines);
        self.erased = Some(before.start.min(lines.start)..before.end.max(lines.end));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIVE: u32 = 5;

    #[test]
    fn a_jump_to_a_line_not_held_waits_for_all_wait_states() {
        let mut art = Art::new();
        assert_eq!(art.fetch(0x0800_0100, FIVE | INSTRUCTIONS, 100), 5);
        assert_eq!(art.fetch(0x0800_0200, FIVE | INSTRUCTIONS, 110), 5);
        assert_eq!(art.fetch(0x0800_0100, FIVE | INSTRUCTIONS, 120), 0);
    }

    #[test]
    fn the_line_read_ahead_is_there_after_its_own_reading_time() {
        let mut art = Art::new();
        art.fetch(0x0800_0100, FIVE | PREFETCH, 100); // there at 105
        assert_eq!(art.fetch(0x0800_0110, FIVE | PREFETCH, 109), 2);
        let mut slow = Art::new();
        slow.fetch(0x0800_0100, FIVE | PREFETCH, 100);
        assert_eq!(slow.fetch(0x0800_0110, FIVE | PREFETCH, 120), 0);
    }

    #[test]
    fn the_sixty_fifth_line_replaces_the_oldest() {
        let mut art = Art::new();
        for line in 0..65 {
            art.fetch(line * 16, FIVE | INSTRUCTIONS, 0);
        }
        assert_eq!(art.fetch(16, FIVE | INSTRUCTIONS, 0), 0);
        assert_eq!(art.fetch(0, FIVE | INSTRUCTIONS, 0), 5);
    }

    #[test]
    fn an_erased_line_is_old_until_the_cache_is_reset() {
        let uses = |between: fn(&mut Art), address: u32, erased: Range<u32>| {
            let mut art = Art::new();
            art.read(0x0800_0100, FIVE | DATA);
            art.fetch(0x0800_0200, FIVE | INSTRUCTIONS, 0);
            art.erase(erased);
            between(&mut art);
            match address {
                0x0800_0100 => art.read(address, FIVE | DATA),
                _ => art.fetch(address, FIVE | INSTRUCTIONS, 100),
            };
            (art.take_stale_use(), art.take_stale_use())
        };
        let all = 0x0800_0000..0x0800_4000;
        for address in [0x0800_0100, 0x0800_0200] {
            let forget = |art: &mut Art| art.reset(FORGET_DATA | FORGET_INSTRUCTIONS);
            assert_eq!(uses(|_| {}, address, all.clone()), (true, false));
            assert_eq!(uses(forget, address, all.clone()), (false, false));
            assert_eq!(
                uses(|_| {}, address, 0x0800_4000..0x0800_8000),
                (false, false)
            );
        }
        let only_instructions = |art: &mut Art| art.reset(FORGET_INSTRUCTIONS);
        assert!(uses(only_instructions, 0x0800_0100, all.clone()).0);
        let full = |art: &mut Art| {
            (1..9).for_each(|line| _ = art.read(0x0801_0000 + 16 * line, FIVE | DATA));
        };
        assert!(uses(full, 0x0800_0100, all).0);
    }

    #[test]
    fn constants_in_one_line_wait_once() {
        let mut art = Art::new();
        assert_eq!(art.read(0x0800_0100, FIVE | DATA), 5);
        assert_eq!(art.read(0x0800_010C, FIVE | DATA), 0);
        art.flush();
        assert_eq!(art.read(0x0800_0100, FIVE | DATA), 5);
    }
}
