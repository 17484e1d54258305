//! The cost of each piece of work on an STM32F407, in CPU cycles.
//!
//! All figures come from [`crate::measured`], which `cargo fw-test --costs` writes. They are the
//! cycles that the unmodified firmware takes in the emulator of `crates/f407emu`. The emulator's
//! cycles are right to within about 15 %. This figure is a judgement: no board has been measured.
//! The check `costs` of `cargo fw-test` compares the file with the current firmware.
//!
//! An interrupt is charged the median of its times in a job, with its entry and exit. The longest
//! time decides whether a tick is late. A tick that takes a segment is charged the longest time
//! if the segment begins a line, and the median elsewhere. The main loop's work is charged its
//! mean. For this mean, each measured job adds one kind of work to the job before it; the added
//! cycles are the cost of this kind (`tests/firmware/src/checks/costs.rs`).
//!
//! The firmware looks at the serial line every 50 µs. The bytes that it finds are charged as they
//! come. A look that finds no byte is not charged (some 50 cycles, 0.6 % of the CPU).
//!
//! `HUNDRED_INSTRUCTIONS` converts counted instructions to cycles (`docs/benchmarks.md`).
//!
//! [`crate::event_loop`] says when each cost is charged.

use crate::measured;
use leadscrew_machine::work::Work;

/// The CPU's price list, in cycles. Interrupts include their entry and exit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Costs {
    /// From the timer's compare to the edge of the step pins.
    pub step_edge: u32,
    /// From the timer's compare to the power that changes with a step.
    pub power_edge: u32,
    /// A tick.
    pub step: u32,
    /// The longest time from one compare of the timer until the next one is armed. A tick that is
    /// due before then is late.
    pub step_armed: u32,
    /// A tick that loads a segment which continues the line under way.
    pub load: u32,
    /// The longest tick that loads the first segment of a line.
    pub load_line: u32,
    /// A tick that finds no segment to load.
    pub run_out: u32,
    /// From the end of a pulse's time to the fall of the step pins.
    pub pulse_edge: u32,
    /// An interrupt that ends a pulse.
    pub pulse_end: u32,
    /// The interrupts of a switch's edge and of the end of its filter time, together.
    pub switches: u32,
    /// Cycles of interrupts for a received byte.
    pub byte_in: u32,
    /// Cycles of interrupts for a sent byte.
    pub byte_out: u32,
    /// A turn of the main loop, without the work listed below.
    pub poll: u32,
    /// A byte added to its line, or a byte of an answer printed.
    pub byte: u32,
    /// A line checked and interpreted.
    pub line: u32,
    /// A move planned.
    pub planned_move: u32,
    /// A move that became part of a row of pixels.
    pub pixel: u32,
    /// A segment made.
    pub segment: u32,
    /// A queued move whose time is added up.
    pub timed: u32,
    /// A status report printed.
    pub report: u32,
}

impl Costs {
    /// An STM32F407 at 168 MHz, as described above.
    pub const F407: Self = Self {
        step_edge: measured::STEP_EDGE,
        power_edge: measured::POWER_EDGE,
        step: measured::STEP,
        step_armed: measured::STEP_MOST,
        load: measured::LOAD,
        load_line: measured::LOAD_MOST,
        run_out: measured::RUN_OUT,
        pulse_edge: measured::PULSE_EDGE,
        pulse_end: measured::PULSE_END,
        switches: measured::SWITCHES,
        byte_in: measured::BYTE_IN,
        byte_out: measured::BYTE_OUT,
        poll: measured::POLL,
        byte: measured::BYTE,
        line: measured::LINE,
        planned_move: measured::PLANNED_MOVE,
        pixel: measured::PIXEL,
        segment: measured::SEGMENT,
        timed: measured::TIMED,
        report: measured::REPORT,
    };

    /// A CPU that takes no time: for tests that want the timer's own schedule.
    pub const NONE: Self = Self {
        step_edge: 0,
        power_edge: 0,
        step: 0,
        step_armed: 0,
        load: 0,
        load_line: 0,
        run_out: 0,
        pulse_edge: 0,
        pulse_end: 0,
        switches: 0,
        byte_in: 0,
        byte_out: 0,
        poll: 0,
        byte: 0,
        line: 0,
        planned_move: 0,
        pixel: 0,
        segment: 0,
        timed: 0,
        report: 0,
    };

    /// Cycles of one turn of the main loop, which has raised the counters of work from `before` to
    /// `after`.
    pub fn of_poll(&self, before: &Work, after: &Work) -> u64 {
        let cost = |cost: u32, before: u32, after: u32| {
            u64::from(cost) * u64::from(after.wrapping_sub(before))
        };
        u64::from(self.poll)
            + cost(self.byte, before.bytes, after.bytes)
            + cost(self.byte, before.written, after.written)
            + cost(self.line, before.lines, after.lines)
            + cost(self.planned_move, before.moves, after.moves)
            + cost(self.pixel, before.pixels, after.pixels)
            + cost(self.segment, before.segments, after.segments)
            + cost(self.timed, before.timed, after.timed)
            + cost(self.report, before.reports, after.reports)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pins_change_before_the_interrupt_ends() {
        let c = Costs::F407;
        assert!(c.step_edge < c.power_edge && c.power_edge < c.step && c.step <= c.step_armed);
        assert!(c.pulse_edge < c.pulse_end);
    }
}
