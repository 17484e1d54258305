//! The record of the pins: turns edges into step events, each with the tick that caused it.
//!
//! ```text
//!  TIM2 CC1   |                |          matches: the timer's schedule
//!                 ____             ____
//!  step pin  ____|    |___________|    |  rising edge: `latency` after the last match
//! ```
//!
//! A motor without a driver has lines instead: `windings.rs` says which of their changes is a step.
use crate::{
    pins::{CYCLES_PER_COUNT, TICK},
    windings::{Change, Phases},
    wiring::Wiring,
};
use leadscrew_f407emu::{Edge, Machine, Match, Pin};

/// The time by which the stores to two ports may be apart and still make one step event, cycles.
const SKEW: u64 = 20;
/// As [`SKEW`], if each motor's lines have a store of their own.
const SKEW_OF_LINES: u64 = 100;
/// The most motors of a board.
const MOTORS: usize = 6;

/// One step event at the pins.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Step {
    /// The instant of the tick that caused it, in counts of the step timer since power-up.
    pub(crate) due: u64,
    /// Cycles from the tick to the rising edges.
    pub(crate) latency: u32,
    /// True if the tick came too late: its instant had passed when it was armed, and the firmware
    /// made it at once.
    pub(crate) late: bool,
    /// The motors that step, one bit each.
    pub(crate) motors: u8,
    /// The motors whose direction is negative, one bit each.
    pub(crate) negative: u8,
}

impl Step {
    /// The cycle of the rising edges.
    pub(crate) fn edge(&self) -> u64 {
        self.due * CYCLES_PER_COUNT + u64::from(self.latency)
    }
}

/// The extreme times at the pins that matter to a motor driver, cycles.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Extremes {
    /// The shortest pulse.
    pub(crate) pulse: u64,
    /// The longest pulse.
    pub(crate) longest_pulse: u64,
    /// The shortest time between two pulses of a motor.
    pub(crate) low: u64,
    /// The shortest time from a change of direction to the motor's next rising edge.
    pub(crate) setup: u64,
    /// The shortest time from a motor's last rising edge to a change of its direction.
    pub(crate) hold: u64,
    /// The longest time between the rising edges of one step event.
    pub(crate) skew: u64,
}

impl Extremes {
    /// Before anything has happened.
    const NONE: Extremes = Extremes {
        pulse: u64::MAX,
        longest_pulse: 0,
        low: u64::MAX,
        setup: u64::MAX,
        hold: u64::MAX,
        skew: 0,
    };
}

/// Follows the pins of all motors.
#[derive(Clone, Debug)]
pub(crate) struct Tracker {
    /// All step events since the last [`Tracker::clear`].
    pub(crate) steps: Vec<Step>,
    pub(crate) extremes: Extremes,
    /// Edges of all other pins that are watched.
    pub(crate) others: Vec<Edge>,
    /// The cycles at which the time of the switches' filter ended.
    pub(crate) settled: Vec<u64>,
    wiring: &'static Wiring,
    tick: Option<Match>,
    negative: u8,
    rose: [Option<u64>; MOTORS],
    fell: [Option<u64>; MOTORS],
    turned: [Option<u64>; MOTORS],
    /// Motors without drivers.
    pub(crate) phases: Vec<Phases>,
    /// The cycles at which lines were put to no state, or to one that must not follow.
    pub(crate) faults: Vec<u64>,
}

impl Tracker {
    pub(crate) fn new(wiring: &'static Wiring) -> Self {
        Tracker {
            wiring,
            steps: Vec::new(),
            extremes: Extremes::NONE,
            others: Vec::new(),
            settled: Vec::new(),
            tick: None,
            negative: 0,
            rose: [None; MOTORS],
            fell: [None; MOTORS],
            turned: [None; MOTORS],
            phases: (1..=wiring.lines.len()).map(Phases::new).collect(),
            faults: Vec::new(),
        }
    }

    /// Forgets the steps, but keeps the levels.
    pub(crate) fn clear(&mut self) {
        *self = Tracker {
            negative: self.negative,
            tick: self.tick,
            phases: std::mem::take(&mut self.phases),
            ..Tracker::new(self.wiring)
        };
    }

    /// Reads the record of a machine.
    pub(crate) fn follow(&mut self, machine: &mut Machine) {
        let (ticks, alarms): (Vec<Match>, Vec<Match>) = machine
            .take_matches()
            .into_iter()
            .partition(|matched| (matched.timer, matched.channel) == TICK);
        self.settled.extend(alarms.iter().map(|alarm| alarm.cycle));
        let mut ticks = ticks.into_iter().peekable();
        let mut edges = machine.take_edges().into_iter().peekable();
        while let Some(edge) = edges.next() {
            while let Some(tick) = ticks.next_if(|tick| tick.cycle <= edge.cycle) {
                self.tick = Some(tick);
            }
            // A store changes all pins of its port at the same instant.
            let is_last = edges.peek().is_none_or(|next| next.cycle > edge.cycle);
            match self.line(edge.pin) {
                Some((motor, line)) => self.switch(motor, line, &edge, is_last),
                None => self.edge(&edge),
            }
        }
        self.tick = ticks.last().or(self.tick);
    }

    /// The motor whose winding is on a pin, and the number of the line.
    fn line(&self, pin: Pin) -> Option<(usize, usize)> {
        let motors = self.wiring.lines.iter().enumerate();
        let mut found = motors.filter_map(|(motor, lines)| {
            let line = lines.iter().position(|&line| line == pin)?;
            Some((motor, line))
        });
        found.next()
    }

    /// Notes the level of a line. After the `last` line of a store its effect is known.
    fn switch(&mut self, motor: usize, line: usize, edge: &Edge, last: bool) {
        let phases = &mut self.phases[motor];
        phases.set(line, edge.level);
        match last.then(|| phases.settle()) {
            None | Some(Change::Current) => {}
            Some(Change::Fault) => self.faults.push(edge.cycle),
            Some(Change::Step { negative }) => {
                self.negative = self.negative & !(1 << motor) | u8::from(negative) << motor;
                self.step(motor, edge.cycle, SKEW_OF_LINES);
            }
        }
    }

    fn edge(&mut self, edge: &Edge) {
        let motor = |pins: &[Pin]| pins.iter().position(|&pin| pin == edge.pin);
        match (motor(self.wiring.step), motor(self.wiring.direction)) {
            (Some(motor), _) if edge.level => self.rise(motor, edge.cycle),
            (Some(motor), _) => self.fall(motor, edge.cycle),
            (None, Some(motor)) => self.turn(motor, edge),
            (None, None) => self.others.push(*edge),
        }
    }

    fn rise(&mut self, motor: usize, cycle: u64) {
        if let Some(turned) = self.turned[motor].take() {
            self.extremes.setup = self.extremes.setup.min(cycle - turned);
        }
        if let Some(fell) = self.fell[motor] {
            self.extremes.low = self.extremes.low.min(cycle - fell);
        }
        self.rose[motor] = Some(cycle);
        self.step(motor, cycle, SKEW);
    }

    /// A motor steps: in an event of its own, or with others whose edges are at most `skew` cycles
    /// earlier.
    fn step(&mut self, motor: usize, cycle: u64, skew: u64) {
        let bit = 1 << motor;
        if let Some(last) = self.steps.last_mut() {
            if cycle <= last.edge() + skew && last.motors & bit == 0 {
                last.motors |= bit;
                last.negative = self.negative;
                self.extremes.skew = self.extremes.skew.max(cycle - last.edge());
                return;
            }
        }
        let tick = self.tick.map_or(0, |tick| tick.cycle);
        self.steps.push(Step {
            due: tick / CYCLES_PER_COUNT,
            latency: u32::try_from(cycle - tick).unwrap_or(u32::MAX),
            late: self.tick.is_none_or(|tick| tick.forced),
            motors: bit,
            negative: self.negative,
        });
    }

    fn fall(&mut self, motor: usize, cycle: u64) {
        if let Some(rose) = self.rose[motor] {
            let pulse = cycle - rose;
            self.extremes.pulse = self.extremes.pulse.min(pulse);
            self.extremes.longest_pulse = self.extremes.longest_pulse.max(pulse);
        }
        self.fell[motor] = Some(cycle);
    }

    fn turn(&mut self, motor: usize, edge: &Edge) {
        if let Some(rose) = self.rose[motor] {
            self.extremes.hold = self.extremes.hold.min(edge.cycle - rose);
        }
        self.turned[motor] = Some(edge.cycle);
        self.negative = self.negative & !(1 << motor) | u8::from(edge.level) << motor;
    }
}

/// The difference between the longest and the shortest latency, which a driver sees as jitter,
/// cycles.
pub(crate) fn jitter(steps: &[Step]) -> u32 {
    let latencies = || steps.iter().map(|step| step.latency);
    latencies().max().unwrap_or(0) - latencies().min().unwrap_or(0)
}

/// The net steps of each motor: positive less negative.
pub(crate) fn net<const MOTORS: usize>(steps: &[Step]) -> [i64; MOTORS] {
    let mut net = [0; MOTORS];
    for step in steps {
        for (motor, count) in net.iter_mut().enumerate() {
            let stepped = i64::from(step.motors >> motor & 1);
            let sign = 1 - 2 * i64::from(step.negative >> motor & 1);
            *count += stepped * sign;
        }
    }
    net
}

/// Counts the steps of motors while they are made. The last step event is counted anew at each
/// look: if its edges are stores of their own, a look may come between them.
#[derive(Clone, Debug)]
pub(crate) struct Counter<const MOTORS: usize> {
    /// The number of step events that are counted for good, and the net steps in them.
    counted: usize,
    steps: [i64; MOTORS],
}

impl<const MOTORS: usize> Counter<MOTORS> {
    pub(crate) const ZERO: Self = Counter {
        counted: 0,
        steps: [0; MOTORS],
    };

    /// Returns the net steps of each motor since the first of all `steps`.
    pub(crate) fn follow(&mut self, steps: &[Step]) -> [i64; MOTORS] {
        let complete = steps.len().saturating_sub(1);
        self.steps = sum(self.steps, net(&steps[self.counted..complete]));
        self.counted = complete;
        sum(self.steps, net(&steps[complete..]))
    }
}

fn sum<const MOTORS: usize>(one: [i64; MOTORS], other: [i64; MOTORS]) -> [i64; MOTORS] {
    std::array::from_fn(|motor| one[motor] + other[motor])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wiring::DISCOVERY;

    fn step(motors: u8, negative: u8) -> Step {
        Step {
            due: 0,
            latency: 50,
            late: false,
            motors,
            negative,
        }
    }

    #[test]
    fn steps_are_counted_in_their_direction() {
        let steps = [step(0b011, 0b010), step(0b001, 0), step(0b110, 0b100)];
        assert_eq!(net(&steps), [2, 0, -1]);
    }

    #[test]
    fn a_look_between_two_edges_of_an_event_loses_no_step() {
        let mut counter = Counter::ZERO;
        assert_eq!(counter.follow(&[]), [0, 0, 0]);
        assert_eq!(counter.follow(&[step(0b001, 0)]), [1, 0, 0]);
        assert_eq!(counter.follow(&[step(0b111, 0b100)]), [1, 1, -1]);
        let steps = [step(0b111, 0b100), step(0b010, 0b010)];
        assert_eq!(counter.follow(&steps), [1, 0, -1]);
        assert_eq!(counter.follow(&steps), [1, 0, -1]);
    }

    #[test]
    fn edges_close_together_are_one_event() {
        let mut tracker = Tracker::new(&DISCOVERY);
        tracker.rise(0, 100);
        tracker.rise(1, 104);
        tracker.rise(0, 300);
        let motors: Vec<u8> = tracker.steps.iter().map(|step| step.motors).collect();
        assert_eq!(motors, [0b011, 0b001]);
        assert_eq!(tracker.extremes.skew, 4);
    }
}
