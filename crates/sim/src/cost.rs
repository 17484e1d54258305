//! What the CPU of an STM32F407 pays for each piece of work, in cycles.
//!
//! # Sources
//! No board has been measured yet. Until then:
//!
//! * Instructions marked *counted* are the budgets that exact counts keep to (`cargo xtask icount`,
//!   `bench/budgets.txt`); all others are estimates from the length of the code.
//! * Cycles are instructions times 1.65: what a step interrupt of 66 instructions took with a cold flash
//!   accelerator on an emulated F407 at five wait states (131 cycles, 22 of them exception entry and exit:
//!   109 / 66). A warm one takes 117; the cold figure is the conservative one. The emulator is calibrated
//!   to within about 15 %.
//! * An exception takes 12 cycles to enter and 10 to return from, as in that emulator: not checked on silicon.
//!
//! What is charged when is in [`crate::event_loop`].

use leadscrew_machine::work::Work;

/// Cycles from an interrupt's being due to its first instruction.
const ENTRY: u32 = 12;
/// Cycles from an interrupt's last instruction back to what it interrupted.
const EXIT: u32 = 10;

/// The CPU's price list, in cycles. Interrupts include their entry and exit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Costs {
    /// From the timer's compare to the edge of the step pins: entry and some 15 instructions.
    pub step_edge: u32,
    /// From the timer's compare to the registers written last (direction, power) in a step interrupt that goes on
    /// with its segment.
    pub step_written: u32,
    /// From the timer's compare to the next compare's being armed in the longest step interrupt: a tick due
    /// before that is late.
    pub step_armed: u32,
    /// A step interrupt that goes on with its segment: 102 instructions with three motors stepping, counted.
    pub step: u32,
    /// A step interrupt that takes the first segment of a line: 217 instructions, counted.
    pub step_with_segment: u32,
    /// From the timer's second compare to the fall of the step pins: entry and some 10 instructions.
    pub pulse_edge: u32,
    /// An interrupt that ends a pulse: 25 instructions.
    pub pulse_end: u32,
    /// A switch interrupt: all inputs read and compared, 100 instructions.
    pub switches: u32,
    /// A serial interrupt that receives a byte: 45 instructions. The F407's takes less since DMA brings the bytes: the dearer
    /// figure stays, for boards without.
    pub byte_in: u32,
    /// A serial interrupt that sends a byte: 30 instructions.
    pub byte_out: u32,
    /// A turn of the main loop, without what is listed below: 1300 instructions, as on x86-64.
    pub poll: u32,
    /// A byte put on its line, or one of an answer printed: 25 instructions.
    pub byte: u32,
    /// A line checked and interpreted: 1810 instructions for `G1X12.345Y-6.789F1500`, counted.
    pub line: u32,
    /// A move planned: 1150 instructions at most with 1024 queued, counted.
    pub planned_move: u32,
    /// A segment made: 20 step events of 35 instructions each, counted.
    pub segment: u32,
    /// A queued move whose time is added up: 150 instructions, an estimate.
    pub timed: u32,
    /// A status report printed: 2500 instructions, an estimate.
    pub report: u32,
}

impl Costs {
    /// An STM32F407 at 168 MHz, as described above.
    pub const F407: Self = Self {
        step_edge: ENTRY + cycles(15),
        step_written: ENTRY + cycles(97),
        step_armed: ENTRY + cycles(217),
        step: interrupt(102),
        step_with_segment: interrupt(217),
        pulse_edge: ENTRY + cycles(10),
        pulse_end: interrupt(25),
        switches: interrupt(100),
        byte_in: interrupt(45),
        byte_out: interrupt(30),
        poll: cycles(1300),
        byte: cycles(25),
        line: cycles(1810),
        planned_move: cycles(1150),
        segment: cycles(700),
        timed: cycles(150),
        report: cycles(2500),
    };

    /// A CPU that takes no time: for tests that want the timer's own schedule.
    pub const NONE: Self = Self {
        step_edge: 0,
        step_written: 0,
        step_armed: 0,
        step: 0,
        step_with_segment: 0,
        pulse_edge: 0,
        pulse_end: 0,
        switches: 0,
        byte_in: 0,
        byte_out: 0,
        poll: 0,
        byte: 0,
        line: 0,
        planned_move: 0,
        segment: 0,
        timed: 0,
        report: 0,
    };

    /// Cycles of one turn of the main loop that has brought its counters from `before` to `after`.
    pub fn of_poll(&self, before: &Work, after: &Work) -> u64 {
        let cost = |cost: u32, before: u32, after: u32| {
            u64::from(cost) * u64::from(after.wrapping_sub(before))
        };
        u64::from(self.poll)
            + cost(self.byte, before.bytes, after.bytes)
            + cost(self.byte, before.written, after.written)
            + cost(self.line, before.lines, after.lines)
            + cost(self.planned_move, before.moves, after.moves)
            + cost(self.segment, before.segments, after.segments)
            + cost(self.timed, before.timed, after.timed)
            + cost(self.report, before.reports, after.reports)
    }
}

/// Cycles of `instructions` with a cold flash accelerator: 1.65 each, rounded up.
const fn cycles(instructions: u32) -> u32 {
    (instructions * 165).div_ceil(100)
}

/// Cycles of an interrupt of so many instructions, entry and exit included.
const fn interrupt(instructions: u32) -> u32 {
    ENTRY + cycles(instructions) + EXIT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interrupt_that_was_emulated_costs_what_it_took_there() {
        assert_eq!(interrupt(66), 131);
    }

    #[test]
    fn pins_change_before_the_interrupt_ends() {
        let c = Costs::F407;
        assert!(c.step_edge < c.step_written && c.step_written < c.step);
        assert!(c.step_armed < c.step_with_segment);
        assert!(c.pulse_edge < c.pulse_end);
    }
}
