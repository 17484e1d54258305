//! The observers of the pins: file writers, pictures, tests.
//!
//! The simulation takes its observer as a type parameter; methods that are not overridden cost
//! nothing. A pair of observers is an observer too, as are `()` (none) and `Option` (one or none).

use crate::clock::Cycle;
use crate::trouble::{Late, Violation};
use leadscrew_machine::board::{CoolantOutput, PortConfig, SpindleOutput};
use leadscrew_machine::explain::{Committed, PlannedMove};
use leadscrew_machine::machine::LineFault;
use leadscrew_stepper::{MotorMask, Power};

/// The rising edges of one step event.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct StepEvent {
    /// The time at which the step pins rise.
    pub cycle: Cycle,
    /// The motors that step; at least one.
    pub motors: MotorMask,
    /// The motors whose direction is negative.
    pub negative: MotorMask,
    /// The power of the spindle or laser between the previous step event and this one.
    pub power: Power,
}

/// A segment as the step interrupt takes it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Taken<'a> {
    /// The steps of each motor in the move that begins with this segment, without their direction;
    /// `None` if the segment continues the move under way.
    pub line: Option<&'a [u32]>,
    /// Steps of the dominant motor that end in this segment. 0 if a step is split over several
    /// segments and this segment is not the last of them.
    pub step_events: u32,
    /// True if a whole step ends at the segment's end.
    pub ends_event: bool,
    /// Power in the segment's first and last tick, as shares of full power.
    pub power: [f64; 2],
}

/// The events that can be watched. Cycles never fall from call to call.
#[allow(unused_variables)]
pub trait Observer {
    /// Step pins rise.
    #[inline]
    fn step(&mut self, event: &StepEvent) {}
    /// All step pins fall.
    #[inline]
    fn pulse_end(&mut self, cycle: Cycle) {}
    /// Direction pins change.
    #[inline]
    fn direction(&mut self, cycle: Cycle, negative: MotorMask) {}
    /// Spindle or laser power changes.
    #[inline]
    fn power(&mut self, cycle: Cycle, power: Power) {}
    /// Synchronised outputs change.
    #[inline]
    fn outputs(&mut self, cycle: Cycle, levels: u8) {}
    /// The step timer starts out of rest (`true`) or comes to rest.
    #[inline]
    fn running(&mut self, cycle: Cycle, running: bool) {}
    /// The motor drivers are enabled or disabled.
    #[inline]
    fn motors_enabled(&mut self, cycle: Cycle, on: bool) {}
    /// The spindle's direction and enable pins are set.
    #[inline]
    fn spindle(&mut self, cycle: Cycle, output: SpindleOutput) {}
    /// The coolant valves are set.
    #[inline]
    fn coolant(&mut self, cycle: Cycle, output: CoolantOutput) {}
    /// A move of the program is planned.
    #[inline]
    fn move_planned(&mut self, planned: &PlannedMove<'_>) {}
    /// The main loop has made `segments` segments. `committed` returns the state of motion at the
    /// end of the last one.
    #[inline]
    fn segments_made(&mut self, segments: u32, committed: &dyn Fn() -> Committed) {}
    /// The step interrupt takes a segment, or comes to rest: segments are taken in the order in
    /// which they were made.
    #[inline]
    fn segment_taken(&mut self, cycle: Cycle, taken: Option<&Taken<'_>>) {}
    /// A line was refused.
    #[inline]
    fn refused(&mut self, cycle: Cycle, fault: &LineFault) {}
    /// The step port's wiring is set.
    #[inline]
    fn configured(&mut self, cycle: Cycle, port: &PortConfig) {}
    /// Something came too late.
    #[inline]
    fn late(&mut self, late: &Late) {}
    /// Something happened that must never happen.
    #[inline]
    fn violation(&mut self, violation: &Violation) {}
}

impl Observer for () {}

/// Implements every method of `Observer`. The method calls the same method of each observer in
/// the given iterators.
macro_rules! forward {
    (@method $self:ident $observers:tt $name:ident($($arg:ident: $type:ty),*)) => {
        #[inline]
        fn $name(&mut $self, $($arg: $type),*) {
            forward!(@call $observers $name ($($arg),*));
        }
    };
    (@call ($($observers:expr),+) $name:ident $args:tt) => {
        $(for observer in $observers { observer.$name $args; })+
    };
    ($self:ident, $observers:tt) => {
        forward!(@method $self $observers step(event: &StepEvent));
        forward!(@method $self $observers pulse_end(cycle: Cycle));
        forward!(@method $self $observers direction(cycle: Cycle, negative: MotorMask));
        forward!(@method $self $observers power(cycle: Cycle, power: Power));
        forward!(@method $self $observers outputs(cycle: Cycle, levels: u8));
        forward!(@method $self $observers running(cycle: Cycle, running: bool));
        forward!(@method $self $observers motors_enabled(cycle: Cycle, on: bool));
        forward!(@method $self $observers spindle(cycle: Cycle, output: SpindleOutput));
        forward!(@method $self $observers coolant(cycle: Cycle, output: CoolantOutput));
        forward!(@method $self $observers move_planned(planned: &PlannedMove<'_>));
        forward!(@method $self $observers segments_made(segments: u32, committed: &dyn Fn() -> Committed));
        forward!(@method $self $observers segment_taken(cycle: Cycle, taken: Option<&Taken<'_>>));
        forward!(@method $self $observers refused(cycle: Cycle, fault: &LineFault));
        forward!(@method $self $observers configured(cycle: Cycle, port: &PortConfig));
        forward!(@method $self $observers late(late: &Late));
        forward!(@method $self $observers violation(violation: &Violation));
    };
}

impl<A: Observer, B: Observer> Observer for (A, B) {
    forward!(self, ([&mut self.0], [&mut self.1]));
}

impl<O: Observer> Observer for Option<O> {
    forward!(self, (self.iter_mut()));
}

impl<O: Observer + ?Sized> Observer for &mut O {
    forward!(self, ([&mut **self]));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Default)]
    struct Count(u32);

    impl Observer for Count {
        fn pulse_end(&mut self, _: Cycle) {
            self.0 += 1;
        }
    }

    #[test]
    fn pairs_options_and_references_pass_everything_on() {
        let mut shared = Count::default();
        let mut all = ((&mut shared, None::<Count>), Some(Count::default()));
        all.pulse_end(Cycle(1));
        assert_eq!(all.1.map(|c| c.0), Some(1));
        assert_eq!(shared.0, 1);
    }
}
