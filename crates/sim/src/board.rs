//! The simulated board: step timer, pins and serial output, as the firmware's board has them.
//!
//! TIM2 counts at [`TIMER_HZ`](crate::clock::TIMER_HZ) and raises two interrupts. The step
//! interrupt handles a tick and has the highest priority. The pulse interrupt, one priority below,
//! ends the pulse under way:
//!
//! ```text
//!  tick due     step_edge    power_edge      step or load        pulse over   pulse_edge  pulse_end
//!     |------------|------------|-----------------|                 |------------|-----------|
//!   entry       pins rise     power       next tick armed         entry      pins fall     exit
//! ```
//!
//! The step edges of all ticks come [`Costs::step_edge`] after the timer's compare, or later if the
//! tick before has not ended. New directions go out when the pulse ends, so that no direction pin
//! changes at a step edge. An interrupt writes its other outputs at its end.

use crate::clock::{cycles_of_micros, Cycle, CYCLES_PER_COUNT};
use crate::contacts::{Contacts, Inputs};
use crate::cost::Costs;
use crate::link::Links;
use crate::observer::{Observer, StepEvent};
use crate::output_pins::OutputPins;
use crate::plant::{Plant, Rise, LEAST_SETUP};
use crate::trouble::{Late, LateReason, Record, Violation};
use leadscrew_machine::board::{
    Board, ChannelId, CoolantOutput, Instant, PortConfig, SpindleOutput, Switches,
};
use leadscrew_machine::explain::{Committed, Explain, PlannedMove};
use leadscrew_outputs::OutputPort;
use leadscrew_stepper::{
    Glide, MotorMask, OutputChange, Power, StepPort, Ticks, MAX_SMOOTHING_LEVEL,
};

/// The parts into which a step of the dominant motor (the motor with the most steps in a move) is
/// divided: the ticks in a step at the finest step smoothing.
pub(crate) const PARTS: u64 = 1 << MAX_SMOOTHING_LEVEL;

/// The counts of the board.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Counts {
    /// Instants at which at least one motor steps.
    pub step_events: u64,
    /// Ticks, with or without a step.
    pub(crate) ticks: u64,
    /// Steps of the dominant motor of each move, added up, in parts of a step ([`PARTS`]).
    pub(crate) dominant_parts: u64,
    /// The longest time from the instant at which a tick was due to the start of its interrupt, in
    /// cycles.
    pub longest_delay: u64,
    /// The number of times that synchronised outputs have changed.
    pub(crate) output_changes: u64,
}

impl Counts {
    /// Ticks at which no motor steps.
    pub fn smoothing_ticks(&self) -> u64 {
        self.ticks - self.step_events
    }
}

/// The board under a simulated machine: implements [`Board`] for its main loop and [`StepPort`] for
/// its step interrupt.
#[derive(Debug)]
pub struct SimBoard<O, const MOTORS: usize> {
    /// The world beyond the pins.
    pub plant: Plant<MOTORS>,
    pub(crate) observer: O,
    pub(crate) links: Links,
    pub(crate) counts: Counts,
    pub(crate) late: Record<Late>,
    pub(crate) violations: Record<Violation>,
    pub(crate) first_step: Cycle,
    pub(crate) last_step: Cycle,
    /// The time at which the step timer started out of rest for the first time.
    pub(crate) first_start: Cycle,
    pub(crate) last_rest: Cycle,
    pub(crate) port: PortConfig,
    /// Motors that are mounted the other way round: they move their carriages backwards when others
    /// move them forwards.
    pub(crate) mirrored: MotorMask,
    /// The contacts between the switches and the inputs; `None` if the inputs follow the
    /// switches directly.
    pub(crate) contacts: Option<Inputs<MOTORS>>,
    /// Set whenever an input may have changed its level.
    pub(crate) switches_moved: bool,
    /// True if the check of positions needs a new origin: the wiring or a carriage's place has
    /// changed.
    pub(crate) rewired: bool,
    /// Only times count: steps move the carriages, and no pin.
    pub(crate) glides: bool,
    /// Parts of a dominant step in each tick of the segment under way; `None` if no tick is due.
    pub(crate) parts_per_tick: Option<u64>,
    costs: Costs,
    /// The start of the tick or poll under way.
    now: Cycle,
    /// The cycles that the step interrupt under way takes.
    takes: u32,
    /// The time at which the next step interrupt is due.
    step_due: Cycle,
    /// The time at which the tick that was armed last is due; the wait for the next tick counts
    /// from it.
    tick_due: Cycle,
    /// The time at which the step pins are to fall.
    pulse_due: Cycle,
    /// The pulse width (`$0`) of the pulse under way, in cycles.
    pulse_width: u64,
    direction: MotorMask,
    power: Power,
    outputs: OutputPins,
    /// The levels of the outputs as the observer knows them.
    pub(crate) shown_outputs: u8,
    spindle: SpindleOutput,
    coolant: CoolantOutput,
    motors_on: bool,
}

/// Pulse width before the machine has configured the port: Grbl's `$0`.
const DEFAULT_PULSE_US: u8 = 10;

impl<O: Observer, const MOTORS: usize> SimBoard<O, MOTORS> {
    /// Makes a board at power-up.
    pub(crate) fn new(
        costs: Costs,
        links: Links,
        plant: Plant<MOTORS>,
        contacts: Contacts,
        outputs: OutputPins,
        observer: O,
    ) -> Self {
        Self {
            plant,
            observer,
            links,
            counts: Counts::default(),
            late: Record::default(),
            violations: Record::default(),
            first_step: Cycle::NEVER,
            last_step: Cycle::ZERO,
            first_start: Cycle::NEVER,
            last_rest: Cycle::ZERO,
            port: PortConfig {
                pulse_us: DEFAULT_PULSE_US,
                ..PortConfig::default()
            },
            mirrored: MotorMask::default(),
            contacts: Inputs::new(contacts),
            switches_moved: false,
            rewired: false,
            glides: false,
            parts_per_tick: None,
            costs,
            now: Cycle::ZERO,
            takes: 0,
            step_due: Cycle::NEVER,
            tick_due: Cycle::ZERO,
            pulse_due: Cycle::NEVER,
            pulse_width: 0,
            direction: MotorMask::NONE,
            power: Power::OFF,
            outputs,
            shown_outputs: 0,
            spindle: SpindleOutput::Off,
            coolant: CoolantOutput::default(),
            motors_on: false,
        }
    }

    /// Tells the observer the outputs' levels if they have changed since it was last told.
    pub(crate) fn show_outputs(&mut self, at: Cycle) {
        let levels = self.outputs.levels();
        if levels != self.shown_outputs {
            self.shown_outputs = levels;
            self.counts.output_changes += 1;
            self.observer.outputs(at, levels);
        }
    }

    /// Returns when the step interrupt is due next.
    #[inline]
    pub(crate) fn step_due(&self) -> Cycle {
        self.step_due
    }

    /// Returns when one of the timer's interrupts is due next.
    #[inline]
    pub(crate) fn timer_due(&self) -> Cycle {
        self.step_due.min(self.pulse_due)
    }

    /// Returns when the contacts are to be looked at next.
    #[inline]
    pub(crate) fn contacts_due(&self) -> Cycle {
        self.contacts.as_ref().map_or(Cycle::NEVER, Inputs::due)
    }

    /// Returns when the step pins are to fall.
    #[inline]
    pub(crate) fn pulse_due(&self) -> Cycle {
        self.pulse_due
    }

    /// Begins a poll of the main loop.
    pub(crate) fn begin_poll(&mut self, now: Cycle) {
        self.now = now;
    }

    /// Begins a step interrupt at `now` that takes `cycles`. Its tick counts whether a motor steps
    /// or not.
    #[inline]
    pub(crate) fn begin_step_interrupt(&mut self, now: Cycle, cycles: u32) {
        self.now = now;
        self.takes = cycles;
        if let Some(parts) = self.parts_per_tick {
            self.counts.dominant_parts += parts;
            self.counts.ticks += 1;
        }
        if now > self.tick_due {
            self.counts.longest_delay = self.counts.longest_delay.max(now - self.tick_due);
        }
    }

    /// Returns when the step interrupt writes directions and outputs: at its end.
    fn written(&self) -> Cycle {
        self.now + u64::from(self.takes)
    }

    /// Returns true if the next step interrupt comes after the instant at which its tick is due.
    #[inline]
    pub(crate) fn is_late(&self) -> bool {
        self.step_due != self.tick_due
    }

    /// Counts `ticks` ticks at which nothing happens, and arms the tick after them. The first of
    /// them is due now, the last comes `to_last` later, and the armed tick comes `wait` after the
    /// last.
    #[inline]
    pub(crate) fn pass_ticks(&mut self, ticks: u32, [to_last, wait]: [Ticks; 2]) {
        let parts = self.parts_per_tick.unwrap_or(0);
        self.counts.dominant_parts += parts * u64::from(ticks);
        self.counts.ticks += u64::from(ticks);
        let counts = u64::from(to_last.0) + u64::from(wait.0);
        self.tick_due = self.tick_due + counts * CYCLES_PER_COUNT;
        self.step_due = self.tick_due;
    }

    /// Returns true if a motor has stepped since power-up.
    pub(crate) fn has_stepped(&self) -> bool {
        self.first_step != Cycle::NEVER
    }

    /// Takes the steps of `ticks` ticks at once, and arms the tick after them. Returns at how many
    /// instants motors stepped, at least.
    pub(crate) fn glide(&mut self, ticks: u32, glide: &Glide<MOTORS>) -> u64 {
        let events = u64::from(glide.steps.iter().copied().max().unwrap_or(0));
        self.counts.step_events += events;
        self.plant.carry(&glide.steps);
        self.pass_ticks(ticks, glide.waits);
        events
    }

    /// Lets the step pins fall, then sets the directions that waited for the end of the pulse.
    #[inline]
    pub(crate) fn end_pulse(&mut self, now: Cycle) {
        self.pulse_due = Cycle::NEVER;
        let width = self.plant.fall(now);
        self.observer.pulse_end(now);
        if width < self.pulse_width {
            self.violate(Violation::PulseTooShort { cycle: now, width });
        }
        self.write_direction(now);
    }

    /// Returns the power on the pin now.
    pub fn power(&self) -> Power {
        self.power
    }

    /// Switches the laser off at once, as the switch interrupt does.
    pub(crate) fn darken(&mut self, now: Cycle) {
        self.put_power(now, Power::OFF);
    }

    /// Returns the levels of the coolant valves' pins now.
    pub fn coolant(&self) -> CoolantOutput {
        self.coolant
    }

    /// Returns direction and enable of the spindle on the pins now.
    pub fn spindle(&self) -> SpindleOutput {
        self.spindle
    }

    /// Notes a late event.
    #[cold]
    pub(crate) fn note_late(&mut self, cycle: Cycle, reason: LateReason) {
        let late = Late { cycle, reason };
        self.observer.late(&late);
        self.late.push(late);
    }

    /// Notes a violation.
    #[cold]
    pub(crate) fn violate(&mut self, violation: Violation) {
        self.observer.violation(&violation);
        self.violations.push(violation);
    }

    #[cold]
    fn check_rise(&mut self, cycle: Cycle, rise: &Rise) {
        if !rise.lost.is_empty() {
            self.violate(Violation::StepLost {
                cycle,
                motors: rise.lost,
            });
        }
        if let Some(setup) = rise.setup.filter(|setup| *setup < LEAST_SETUP) {
            self.violate(Violation::DirectionNotSettled { cycle, setup });
        }
        self.switches_moved |= rise.switches;
    }

    /// Puts the direction asked for on the pins.
    #[inline]
    fn write_direction(&mut self, now: Cycle) {
        let carriages = self.direction.bits() ^ self.turned().bits();
        let carriages = MotorMask::from_bits(carriages);
        if carriages != self.plant.direction() {
            self.change_direction(now, carriages);
        }
    }

    /// The motors whose carriages move against the machine's count: those inverted by `$3` or
    /// mirrored, but not both.
    pub(crate) fn turned(&self) -> MotorMask {
        MotorMask::from_bits(self.port.direction_invert.bits() ^ self.mirrored.bits())
    }

    #[cold]
    fn change_direction(&mut self, now: Cycle, carriages: MotorMask) {
        let moving = self.plant.set_direction(now, carriages);
        self.observer.direction(now, self.direction);
        if !moving.is_empty() {
            self.violate(Violation::DirectionInPulse {
                cycle: now,
                motors: moving,
            });
        }
    }

    #[inline]
    fn put_power(&mut self, now: Cycle, power: Power) {
        if power != self.power {
            self.power = power;
            self.observer.power(now, power);
        }
    }
}

impl<O: Observer, const MOTORS: usize> StepPort for SimBoard<O, MOTORS> {
    #[inline]
    fn step(&mut self, motors: MotorMask) {
        let edge = self.now + u64::from(self.costs.step_edge);
        self.counts.step_events += 1;
        self.first_step = self.first_step.min(edge);
        self.last_step = edge;
        if self.glides && self.plant.is_free_for(1) {
            return self.plant.carry_once(motors);
        }
        let rise = self.plant.raise(edge, motors);
        if rise.setup.is_some() || rise.switches || !rise.lost.is_empty() {
            self.check_rise(edge, &rise);
        }
        let (negative, power) = (self.direction, self.power);
        self.observer.step(&StepEvent {
            cycle: edge,
            motors,
            negative,
            power,
        });
        // The timer's count is rounded down, so one count is added: the pulse is never too short.
        self.pulse_width = cycles_of_micros(u64::from(self.port.pulse_us));
        let width = self.pulse_width + CYCLES_PER_COUNT;
        self.pulse_due = Cycle(edge.0 - edge.0 % CYCLES_PER_COUNT + width);
    }

    #[inline]
    fn set_direction(&mut self, negative: MotorMask) {
        self.direction = negative;
        if self.pulse_due == Cycle::NEVER {
            self.write_direction(self.written());
        }
    }

    #[inline]
    fn set_power(&mut self, power: Power) {
        self.put_power(self.now + u64::from(self.costs.power_edge), power);
    }

    #[inline]
    fn change_outputs(&mut self, change: OutputChange) {
        if !change.is_none() {
            self.outputs.change(change);
            self.show_outputs(self.written());
        }
    }

    #[inline]
    fn arm(&mut self, wait: Ticks) {
        self.tick_due = self.tick_due + u64::from(wait.0) * CYCLES_PER_COUNT;
    }

    fn make_up(&mut self) -> bool {
        // The latest instant at which this interrupt arms the next tick.
        let armed = self.now + u64::from(self.costs.step_armed.max(self.takes));
        let late = self.tick_due < armed;
        self.step_due = self.tick_due;
        if late {
            self.step_due = armed;
            self.note_late(armed, LateReason::TickPassed);
        }
        late
    }

    fn rest(&mut self) {
        self.step_due = Cycle::NEVER;
        self.last_rest = self.now;
        self.observer.running(self.written(), false);
    }
}

impl<O: Observer, const MOTORS: usize> Explain for SimBoard<O, MOTORS> {
    fn move_planned(&mut self, planned: &PlannedMove<'_>) {
        self.observer.move_planned(planned);
    }

    fn segments_made(&mut self, count: u32, committed: &dyn Fn() -> Committed) {
        self.observer.segments_made(count, committed);
    }
}

impl<O: Observer, const MOTORS: usize> Board for SimBoard<O, MOTORS> {
    fn start_stepping(&mut self, now: Instant) -> Instant {
        self.tick_due = self.now;
        self.step_due = self.now;
        self.first_start = self.first_start.min(self.now);
        self.observer.running(self.now, true);
        now
    }

    fn write(&mut self, channel: ChannelId, bytes: &[u8]) -> usize {
        self.links.write(channel, bytes, self.now)
    }

    fn switches(&self) -> Switches {
        let contacts = self.contacts.as_ref();
        contacts.map_or(*self.plant.levels(), Inputs::believed)
    }

    fn enable_motors(&mut self, on: bool) {
        if on != self.motors_on {
            self.motors_on = on;
            self.observer.motors_enabled(self.now, on);
        }
    }

    fn set_spindle(&mut self, output: SpindleOutput) {
        if output != self.spindle {
            self.spindle = output;
            self.observer.spindle(self.now, output);
        }
    }

    fn set_power(&mut self, power: Power) {
        self.put_power(self.now, power);
    }

    fn set_coolant(&mut self, output: CoolantOutput) {
        if output != self.coolant {
            self.coolant = output;
            self.observer.coolant(self.now, output);
        }
    }

    fn explainer(&mut self) -> Option<&mut dyn Explain> {
        Some(self)
    }

    fn configure(&mut self, port: &PortConfig) {
        self.port = *port;
        if let Some(contacts) = &mut self.contacts {
            contacts.set_filter(port.filter_us);
        }
        self.rewired = true;
        self.observer.configured(self.now, port);
        // The last pulse before the rest may still be high.
        if self.pulse_due == Cycle::NEVER {
            self.write_direction(self.now);
        }
    }
}
