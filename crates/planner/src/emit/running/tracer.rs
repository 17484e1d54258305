//! The parts of a segment besides its ticks: the line, the motors that are due and how early they
//! are (see [`Early`]), power, and outputs.

use super::Timing;
use crate::built::RASTERS;
use crate::config::SLOWEST;
use crate::emit::fit::smoothing;
use crate::emit::pixel::Pixel;
use crate::moves::{MovePower, PlannedMove};
use crate::real::max;
use crate::speed::plan::Place;
use core::num::NonZeroU16;
use fixed::types::U1F31;
use leadscrew_stepper::{Early, Line, LineStart, OutputChange, Power, PowerChange, Smoothing};

/// The line of the running move, as the stepper traces it: which motors are due, and how early.
/// This is the state that the stepper's tracer will have at the end of the segments handed out.
#[derive(Clone, Debug)]
pub(super) struct Tracer<const MOTORS: usize> {
    line: Line<MOTORS>,
    /// The step of the move at which `line` begins: 0 until the line is begun anew.
    start: u32,
    /// True if the stepper has yet to be told of `line`.
    announce: bool,
    /// True if a motor steps less often than the dominant one: only then is smoothing of use.
    smooth: bool,
    /// The time by which motors are early: half a tick of this smoothing. It may be coarser than
    /// the last segment's smoothing (see [`Tracer::smoothing`]). `None` if motors are not early
    /// at all.
    early: Option<Smoothing>,
}

impl<const MOTORS: usize> Tracer<MOTORS> {
    /// The start of a line.
    pub(super) fn new(line: Line<MOTORS>) -> Self {
        let events = line.step_events().get();
        let mut steps = line.steps().iter();
        Self {
            line,
            start: 0,
            announce: true,
            smooth: steps.any(|steps| *steps != 0 && *steps != events),
            early: None,
        }
    }

    /// Makes the stepper begin the line anew at the step `done`.
    pub(super) fn begin_anew(&mut self, done: u32) {
        if let Some(rest) = self.line.rest(done - self.start, self.early()) {
            self.line = rest;
            self.start = done;
            self.announce = true;
        }
    }

    /// The line's start, if the stepper does not know the line yet. `early` belongs to the line's
    /// first segment.
    pub(super) fn take_start(&mut self, early: Early) -> Option<LineStart<MOTORS>> {
        let announce = core::mem::take(&mut self.announce);
        announce.then(|| LineStart::new(self.line, early))
    }

    /// Returns how early motors are at the end of the segments handed out.
    pub(super) fn early(&self) -> Early {
        self.early.map_or(Early::NOT, Early::half_a_tick)
    }

    /// Sets how early motors are after a part of a step event.
    pub(super) fn set_early(&mut self, early: Option<Smoothing>) {
        self.early = early;
    }

    /// Returns true if smoothing is of use.
    pub(super) const fn is_smooth(&self) -> bool {
        self.smooth
    }

    /// The smoothing of the next segment. A coarser smoothing begins one segment late: the next
    /// segment keeps the finer smoothing, and in it the motors become as early as the coarser
    /// smoothing needs.
    pub(super) fn smoothing(&mut self, interval: f32, timing: Timing, evenness: f32) -> Smoothing {
        let wanted = self.wanted(interval, timing, evenness);
        match self.early.replace(wanted) {
            Some(prepared) if !self.announce => prepared.max(wanted),
            Some(_) | None => wanted,
        }
    }

    /// The least smoothing that keeps the steps of other motors near enough to the line (see
    /// `fit`).
    pub(super) fn wanted(&self, interval: f32, timing: Timing, evenness: f32) -> Smoothing {
        if self.smooth {
            smoothing(interval, timing.shortest_tick, evenness)
        } else {
            Smoothing::None
        }
    }

    /// For each motor the place in the step event after `done` at which it is due.
    pub(super) fn due(&self, done: u32) -> [Place; MOTORS] {
        let events = self.line.step_events().get();
        let share = |steps| due(steps, events, done - self.start);
        self.line
            .steps()
            .map(|steps| Place::at(done).moved(share(steps)))
    }
}

/// The share of the step event after `done` at which a motor is due; 1 if it is due at the end
/// of that event or later. The motor takes `steps` in a line of `events`. Bresenham's counter
/// begins half full, so a motor's step is due when its exact share is half-way between two whole
/// numbers.
#[inline(never)] // inlined, a record of four motors takes 332 bytes more
fn due(steps: u32, events: u32, done: u32) -> f32 {
    let (each, full) = (2 * u64::from(steps), 2 * u64::from(events));
    let left = full - (each * u64::from(done) + full / 2) % full;
    if steps < events && left < each {
        left as f32 / each as f32
    } else {
        1.0
    }
}

/// Power, outputs and line number of the running move's next segment, and the changes of power that
/// follow in the move.
#[derive(Clone, Debug)]
pub(super) struct Along {
    power: MovePower,
    /// 1 / programmed feed, s/step.
    per_feed: f32,
    line_number: Option<u32>,
    /// Outputs that change with the first segment, until that is handed out.
    outputs: OutputChange,
    /// The number of changes of power that the pool still holds for this move.
    pixels: u16,
    /// The next change of power, and the step at which it comes.
    next_pixel: Option<(u32, Pixel)>,
}

impl Along {
    /// The start of `planned`, which has `steps_per_mm` of the dominant motor.
    pub(super) fn new<const AXES: usize, const MOTORS: usize>(
        planned: &PlannedMove<AXES, MOTORS>,
        steps_per_mm: f32,
    ) -> Self {
        Self {
            power: planned.power,
            per_feed: 1.0 / (max(planned.feed, SLOWEST) * steps_per_mm),
            line_number: planned.line_number(),
            outputs: planned.outputs,
            pixels: planned.pixels,
            next_pixel: None,
        }
    }

    /// If the next pixel begins at the step `done`, takes its power and asks `next` for the pixel
    /// after it.
    pub(super) fn begin_pixel(&mut self, done: u32, mut next: impl FnMut() -> Option<Pixel>) {
        if !RASTERS {
            return;
        }
        if let Some((_, pixel)) = self.next_pixel.take_if(|(at, _)| *at <= done) {
            self.power = self.power.with(pixel.power);
            self.line_number = pixel.line_number;
        }
        if self.next_pixel.is_none() && self.pixels > 0 {
            self.pixels -= 1;
            self.next_pixel = next().map(|pixel| (done + pixel.after, pixel));
        }
    }

    /// The line number of the pixel under way, or of the move.
    pub(super) const fn line_number(&self) -> Option<u32> {
        self.line_number
    }

    /// Steps from the step `done` to the next pixel; `u32::MAX` if there is none.
    pub(super) fn to_next_pixel(&self, done: u32) -> u32 {
        let next = self.next_pixel.filter(|_| RASTERS);
        next.map_or(u32::MAX, |(at, _)| at - done)
    }

    /// Takes the outputs that change with the next segment. Only the first segment changes any.
    pub(super) fn take_outputs(&mut self) -> OutputChange {
        core::mem::take(&mut self.outputs)
    }

    /// The power that the program asks for.
    pub(super) const fn power(&self) -> MovePower {
        self.power
    }

    /// The power of the first tick and its change from tick to tick, if the program asks for
    /// `power`. `speeds` are the speeds in the first and in the last tick, steps/s.
    pub(super) fn power_over(
        &self,
        power: MovePower,
        speeds: [f32; 2],
        ticks: NonZeroU16,
    ) -> (Power, PowerChange) {
        match power {
            MovePower::Off => (Power::OFF, PowerChange::ZERO),
            MovePower::Spindle { power } | MovePower::Constant { power } => {
                (power, PowerChange::ZERO)
            }
            MovePower::Dynamic { power } => {
                let full = power.share().to_bits() as f32 * self.per_feed;
                let [first, last] = speeds.map(|speed| share(full * speed));
                let changes = i32::from(ticks.get() - 1).max(1);
                let change = (last as i32 - first as i32) / changes;
                (
                    Power::from_share(U1F31::from_bits(first)),
                    PowerChange::from_bits(change),
                )
            }
        }
    }
}

/// Full power in units of [`Power`].
const FULL: u32 = 1 << 31;

/// The bits of a power, at most full power.
fn share(bits: f32) -> u32 {
    (bits as u32).min(FULL - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_motor_with_three_steps_in_ten_is_due_at_a_sixth_a_half_and_five_sixths_of_the_line() {
        let shares = [0, 1, 2, 4, 5, 8, 9].map(|done| due(3, 10, done));
        let [begin, first, none, end, second, last, over] = shares;
        assert_eq!([begin, none, end, second, over], [1.0; 5]);
        assert!((first - 2.0 / 3.0).abs() < 1e-6 && (last - 1.0 / 3.0).abs() < 1e-6);
    }

    proptest! {
        /// Against the places themselves: the step `j` of `steps` is due after `(j +
        /// 1/2)·events/steps` step events.
        #[test]
        fn a_motor_is_due_half_way_to_its_next_step(events in 1u32..400, share in 0.0f64..1.0) {
            let steps = (share * f64::from(events)) as u32;
            let each = f64::from(events) / f64::from(steps);
            for done in 0..events {
                let begin = f64::from(done);
                let mut places = (0..events).map(|j| (f64::from(j) + 0.5) * each);
                let place = places.find(|at| *at > begin + 1e-9);
                let share = place.map_or(1.0, |at| (at - begin).min(1.0));
                prop_assert!((f64::from(due(steps, events, done)) - share).abs() < 1e-6);
            }
        }
    }
}
