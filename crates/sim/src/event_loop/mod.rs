//! The event loop: the next event, and the CPU that pays for it.
//!
//! ```text
//!             due                         then                                charged
//!  timers     a tick, a pulse's end       on_timer, end of a pulse            step, load, pulse_end
//!  switches   a carriage passed one       Inputs::on_switches                 switches
//!  lines      a byte's last bit           Receiver::receive, Host::receive    byte_in, byte_out
//!  main loop  woken, and the CPU is free  Machine::poll                       poll and the counts of Work
//! ```
//!
//! Events at the same instant come in this order. The main loop is woken by a byte, a switch edge,
//! a segment taken, motion at rest, its own deadline, or because it said that it is busy. Turns
//! that would find nothing to do are left out.
//!
//! The effects of a poll take place at its start, and its time passes after that. The next poll
//! begins when that time is over, delayed by all interrupts in between. A poll is short (one line,
//! a few segments), so its effects come at most some tens of microseconds too early; the queue
//! holds two milliseconds of segments.

mod lines;
mod rules;

use crate::board::SimBoard;
use crate::clock::{cycles_of_micros, Cycle};
use crate::cost::Costs;
use crate::link::{Host, Links};
use crate::load::Cpu;
use crate::observer::Observer;
use crate::plant::{Pin, Plant, Plate, Switch};
use crate::position::PositionCheck;
use crate::setup::{Memory, Setup};
use crate::stepping::{Ran, Stepping};
use crate::tool_pins::ToolHeight;
use leadscrew_machine::config::CHANNELS;
use leadscrew_machine::extension::Extension;
use leadscrew_machine::inputs::Inputs;
use leadscrew_machine::machine::{Links as MachineLinks, Machine, Next};
use leadscrew_machine::protocol::serial::Receiver;
use leadscrew_machine::work::Work;
use leadscrew_planner::Kinematics;
use leadscrew_stepper::{MotorMask, Shared};

/// The last instant at which anything can happen.
const LAST: Cycle = Cycle(Cycle::NEVER.0 - 1);

/// The motor of Z, along which the tool moves.
const Z: usize = 2;

/// The reason why a simulation returned to its caller.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stopped {
    /// The instant asked for was reached.
    Reached,
    /// Nothing will ever happen again unless something comes from outside.
    Quiet,
    /// The caller's condition was met.
    Condition,
}

/// A machine on its board, with a plant around it.
pub struct Simulation<'a, K, O, const AXES: usize, const MOTORS: usize, const MOVES: usize, X = ()>
{
    machine: Machine<'a, K, AXES, MOTORS, X>,
    pub(crate) board: SimBoard<O, MOTORS>,
    stepping: Stepping<'a, MOTORS>,
    pub(crate) cpu: Cpu,
    costs: Costs,
    receivers: heapless::Vec<Receiver<'a>, CHANNELS>,
    shared: &'a Shared<MOTORS>,
    inputs: &'a Inputs<MOTORS>,
    position: PositionCheck<MOTORS>,
    /// Tells the extension's switches where the tool is.
    tool: ToolHeight,
    work: Work,
    /// The laser is on when it has to be off, and this violation has been noted.
    laser_noted: bool,
    now: Cycle,
    /// Since when the main loop has had a reason to run; [`Cycle::NEVER`] if it has none.
    wake: Cycle,
    /// The latest instant at which the main loop wants to run.
    deadline: Cycle,
    /// At the deadline only an extension's regular work is due.
    is_chore: bool,
    /// Since the last turn of the main loop nothing has happened but step interrupts, and that turn
    /// left nothing to do.
    is_undisturbed: bool,
    /// When the main loop has something to do besides segments.
    quiet_until: Cycle,
    pub(crate) first_byte: Cycle,
    pub(crate) last_byte: Cycle,
}

impl<'a, K, O, const AXES: usize, const MOTORS: usize, const MOVES: usize>
    Simulation<'a, K, O, AXES, MOTORS, MOVES>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    O: Observer,
{
    /// Puts a machine on a board, at power-up. Its main loop runs for the first time in
    /// [`Simulation::run_until`].
    ///
    /// # Panics
    /// If nothing can be planned with `setup.machine` (see [`Machine::new`]).
    pub fn new(
        memory: &'a mut Memory<AXES, MOTORS, MOVES>,
        setup: &Setup<AXES>,
        kinematics: K,
        observer: O,
    ) -> Self {
        Self::extended(memory, setup, kinematics, observer, ())
    }
}

impl<'a, K, O, X, const AXES: usize, const MOTORS: usize, const MOVES: usize>
    Simulation<'a, K, O, AXES, MOTORS, MOVES, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    O: Observer,
    X: Extension<AXES>,
{
    /// As [`Simulation::new`], with an extension of the machine.
    ///
    /// # Panics
    /// As [`Simulation::new`].
    pub fn extended(
        memory: &'a mut Memory<AXES, MOTORS, MOVES>,
        setup: &Setup<AXES>,
        kinematics: K,
        observer: O,
        extension: X,
    ) -> Self {
        let (producer, consumer) = memory.segments.split();
        let (shared, inputs) = (&memory.shared, &memory.inputs);
        let (receivers, inboxes) = memory.serial.iter_mut().map(|queue| queue.split()).unzip();
        let links = MachineLinks {
            moves: &mut memory.moves,
            pixels: &mut memory.pixels,
            segments: producer,
            shared,
            inputs,
            inboxes,
        };
        Self {
            machine: Machine::with_extension(setup.machine, kinematics, links, extension)
                .unwrap_or_else(|error| panic!("the machine's build: {error}")),
            board: SimBoard::new(
                setup.costs,
                Links::new(&setup.lines),
                Plant::new(),
                setup.contacts,
                memory.outputs.clone(),
                observer,
            ),
            stepping: Stepping::new(consumer, shared, setup.costs),
            cpu: Cpu::new(),
            costs: setup.costs,
            receivers,
            shared,
            inputs,
            position: PositionCheck::default(),
            tool: memory.tool.clone(),
            work: Work::default(),
            laser_noted: false,
            now: Cycle::ZERO,
            wake: Cycle::ZERO,
            deadline: Cycle::NEVER,
            is_chore: false,
            is_undisturbed: false,
            quiet_until: Cycle::ZERO,
            first_byte: Cycle::NEVER,
            last_byte: Cycle::ZERO,
        }
    }

    /// Runs the simulation up to `end`, or until nothing is left to happen; in that case the
    /// present is the instant of the last event. If `end` is [`Cycle::NEVER`], the regular work of
    /// an extension does not count as something left to happen.
    pub fn run_until<H: Host>(&mut self, host: &mut H, end: Cycle) -> Stopped {
        self.run_while(host, end, |_| true)
    }

    /// Lets time pass up to `end`, whether anything happens or not.
    pub fn wait_until<H: Host>(&mut self, host: &mut H, end: Cycle) {
        self.run_until(host, end);
        self.now = self.now.max(end);
    }

    /// As [`Simulation::run_until`], but stops as soon as `going` returns false after a byte or a
    /// poll.
    pub fn run_while<H: Host>(
        &mut self,
        host: &mut H,
        end: Cycle,
        going: impl Fn(&H) -> bool,
    ) -> Stopped {
        self.exchange(host);
        loop {
            let (line, contact) = (self.board.links.due(), self.board.contacts_due());
            self.run_timer(end.min(line).min(contact));
            let (main, contact) = (self.main_due(), self.board.contacts_due());
            let next = main.min(line).min(contact);
            if next > end || next == Cycle::NEVER {
                return self.stop(next, end);
            }
            if end == Cycle::NEVER && self.has_only_chores(line.min(contact)) {
                return Stopped::Quiet;
            }
            self.now = next;
            if contact == next {
                self.look_at_inputs(next);
            } else if line <= main {
                self.byte(host);
            } else {
                self.turn(host);
            }
            if !going(host) {
                return Stopped::Condition;
            }
        }
    }

    /// Returns the present.
    pub fn now(&self) -> Cycle {
        self.now
    }

    /// Returns how many bytes of a line were lost since power-up because the sender had sent more
    /// than the receive buffer holds; 0 for a line that is not there.
    pub fn lost_bytes(&self, line: usize) -> u32 {
        self.receivers.get(line).map_or(0, Receiver::lost_bytes)
    }

    /// Returns the machine.
    pub fn machine(&self) -> &Machine<'a, K, AXES, MOTORS, X> {
        &self.machine
    }

    /// Returns the machine, to load and save its stored values.
    pub fn machine_mut(&mut self) -> &mut Machine<'a, K, AXES, MOTORS, X> {
        &mut self.machine
    }

    /// Returns the board, with the plant and its switches.
    pub fn board(&self) -> &SimBoard<O, MOTORS> {
        &self.board
    }

    /// Returns the observer of the simulation.
    pub fn observer(&mut self) -> &mut O {
        &mut self.board.observer
    }

    /// Notes that a host has connected to a line: the machine sends it the general messages.
    pub fn open_line(&mut self, line: usize) {
        if let Some(receiver) = self.receivers.get_mut(line) {
            receiver.open();
            self.disturb(self.now);
        }
    }

    /// Returns the position as the step interrupt counts it.
    pub fn counted_position(&self) -> [i32; MOTORS] {
        self.shared.position()
    }

    /// Sets the level of an input; buttons act by their edges.
    pub fn set_pin(&mut self, pin: Pin, high: bool) {
        self.board.plant.set_pin(pin, high);
        self.report_switches(false, self.now);
    }

    /// Holds an input at a level whatever its switch does; `None` releases it. Returns the level at
    /// which it was held before.
    pub fn force_pin(&mut self, pin: Pin, level: Option<bool>) -> Option<bool> {
        let before = self.board.plant.force(pin, level);
        self.report_switches(false, self.now);
        before
    }

    /// Mounts motors the other way round. To be called at power-up.
    pub fn mirror(&mut self, motors: MotorMask) {
        self.board.mirrored = motors;
    }

    /// From now on only times count: the steps of a segment are made at once, without pins. Peaks and
    /// pulses are not measured then.
    pub fn glide(&mut self) {
        self.stepping.glide();
    }

    /// Lets no line of text end sooner than `micros` after the one before it, on serial lines that
    /// take time.
    pub fn pace(&mut self, micros: u64) {
        self.board.links.pace(cycles_of_micros(micros));
    }

    /// Puts the carriages of X and Y on crossed belts. To be called at power-up.
    pub fn cross_belts(&mut self) {
        self.board.plant.cross_belts();
    }

    /// Bends and tilts the plate that the probe meets. To be called at power-up.
    pub fn bend_plate(&mut self, plate: Plate) {
        self.board.plant.bend_plate(plate);
    }

    /// Adds a switch that a carriage works.
    pub fn add_switch(&mut self, switch: Switch) {
        self.board.plant.add_switch(switch);
        self.report_switches(false, self.now);
    }

    /// Removes all switches that carriages work; the pins keep their levels.
    pub fn remove_switches(&mut self) {
        self.board.plant.remove_switches();
    }

    /// Moves the carriages to another place without steps; the machine does not notice.
    pub fn place(&mut self, position: [i32; MOTORS]) {
        self.board.plant.place(position);
        self.board.rewired = true;
        self.report_switches(false, self.now);
    }

    /// As [`Simulation::place`], but the switches keep their levels until a carriage steps.
    pub fn place_unseen(&mut self, position: [i32; MOTORS]) {
        self.board.plant.place_unseen(position);
        self.board.rewired = true;
    }

    /// Handles the timer's interrupts up to `limit`, or until the main loop can run.
    fn run_timer(&mut self, limit: Cycle) {
        loop {
            // Interrupts only delay the main loop. Until one of them wakes it, this horizon is
            // never too late.
            let horizon = limit.min(self.main_due()).min(LAST);
            if self.board.timer_due() > horizon {
                return;
            }
            if let Ran::Wake(at) = self.stepping.run(&mut self.board, &mut self.cpu, horizon) {
                self.now = self.now.max(at);
                self.wake = self.wake.min(at);
                if std::mem::take(&mut self.board.switches_moved)
                    && self.board.plant.update_switches()
                {
                    self.report_switches(true, at);
                }
            }
        }
    }

    /// Returns when the main loop runs next.
    #[inline]
    fn main_due(&self) -> Cycle {
        self.cpu.main_start(self.wake.min(self.deadline))
    }

    /// Returns true if only an extension's regular work is left to happen. `due` is the next event
    /// on lines and switches.
    fn has_only_chores(&self, due: Cycle) -> bool {
        let others = due.min(self.wake).min(self.board.timer_due());
        self.is_chore && others == Cycle::NEVER
    }

    fn stop(&mut self, next: Cycle, end: Cycle) -> Stopped {
        if next.min(self.board.timer_due()) == Cycle::NEVER {
            return Stopped::Quiet;
        }
        self.now = self.now.max(end);
        Stopped::Reached
    }

    /// Tells the machine the new levels, through the contacts. `moved`: a carriage has worked the
    /// switches.
    fn report_switches(&mut self, moved: bool, now: Cycle) {
        let levels = self.board.plant.levels();
        let Some(contacts) = &mut self.board.contacts else {
            self.inputs.on_switches(levels, self.shared);
            return self.switch_interrupt(now);
        };
        if now == Cycle::ZERO {
            contacts.begin(levels);
            self.inputs.on_switches(levels, self.shared);
        } else {
            contacts.change(levels, moved, now);
            self.look_at_inputs(now);
        }
    }

    /// Looks at the inputs if contacts bounce or the board filters.
    fn look_at_inputs(&mut self, now: Cycle) {
        let position = self.shared.position();
        let contacts = self.board.contacts.as_mut();
        if let Some(told) = contacts.and_then(|contacts| contacts.look(now, position)) {
            self.inputs
                .on_switches_at(&told.levels, self.shared, &told.position);
            self.switch_interrupt(now);
        }
    }

    fn switch_interrupt(&mut self, now: Cycle) {
        self.cpu.charge_interrupt(now, self.costs.switches);
        self.disturb(now);
        if self.shared.is_laser_off() {
            self.board.darken(now);
        }
    }

    /// Wakes the main loop for something that is no step.
    fn disturb(&mut self, at: Cycle) {
        self.wake = self.wake.min(at);
        self.is_undisturbed = false;
    }

    /// Lets the main loop have a turn.
    fn turn<H: Host>(&mut self, host: &mut H) {
        let is_quiet = self.is_undisturbed && self.now < self.quiet_until;
        if !(self.stepping.glides() && is_quiet && self.carry_on()) {
            self.poll(host);
        }
    }

    /// Lets the main loop make segments, if it has nothing else to do; returns whether it has not.
    fn carry_on(&mut self) -> bool {
        self.board.begin_poll(self.now);
        let next = self.machine.carry_on(self.now.instant());
        if let Some(next) = &next {
            self.charge_poll();
            self.schedule(next);
            self.deadline = self.deadline.min(self.quiet_until);
        }
        next.is_some()
    }

    fn poll<H: Host>(&mut self, host: &mut H) {
        let counted = self.shared.position();
        // Checks the laser as motion has left it, before the main loop can correct it.
        self.check_laser();
        self.show_tool();
        self.board.begin_poll(self.now);
        let turn = self.machine.turn(&mut self.board, self.now.instant());
        self.board.show_outputs(self.now);
        if let Some(fault) = self.machine.take_fault() {
            self.board.observer.refused(self.now, &fault);
        }
        self.charge_poll();
        self.check(&counted);
        self.schedule(&turn.next);
        let quiet_until = turn.quiet_until.map(Cycle::from_instant);
        self.quiet_until = quiet_until.unwrap_or(Cycle::NEVER);
        let is_silent = self.exchange(host);
        self.is_undisturbed &= is_silent;
    }

    /// Tells the extension's switches where Z is.
    fn show_tool(&self) {
        let place = self.board.plant.position();
        if let Some(z) = place.get(Z) {
            self.tool.set(*z);
        }
    }

    fn schedule(&mut self, next: &Next) {
        let soonest = self.now + cycles_of_micros(1);
        let deadline = next.when.map(Cycle::from_instant);
        self.deadline = deadline.map_or(Cycle::NEVER, |deadline| deadline.max(soonest));
        self.is_chore = next.is_chore && !self.machine.line_goes_on();
        self.wake = if next.busy { self.now } else { Cycle::NEVER };
        self.is_undisturbed = !next.busy;
    }

    /// Charges the CPU for the poll just made.
    fn charge_poll(&mut self) {
        let work = *self.machine.work();
        let cycles = self.costs.of_poll(&self.work, &work);
        self.work = work;
        self.cpu.charge_main(self.now, cycles);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::Rate;
    use crate::observer::StepEvent;
    use crate::outcome::{Answers, Outcome};
    use crate::streamer::{Streamer, Streaming};
    use leadscrew_machine::board::Board;
    use leadscrew_machine::config::MachineConfig;
    use leadscrew_planner::Cartesian;
    use leadscrew_stepper::Power;
    use std::num::NonZeroU32;

    /// A checksum of all edges, to compare two runs.
    #[derive(Default)]
    struct Digest(u64);

    impl Observer for Digest {
        fn step(&mut self, event: &StepEvent) {
            let word = event.cycle.0 << 8 | u64::from(event.motors.bits());
            self.0 = (self.0 ^ word).wrapping_mul(0x100_0000_01B3);
        }
    }

    const BAUD: Rate = Rate::Baud(NonZeroU32::new(115_200).unwrap());

    fn run(line: Rate, program: &str) -> (Outcome<3>, Answers, u64) {
        let setup = Setup::<3>::new(MachineConfig::new(), line);
        let mut memory = Memory::new(&setup);
        let mut sim: Simulation<'_, _, _, 3, 3, 256> =
            Simulation::new(&mut memory, &setup, Cartesian, Digest::default());
        let streaming = Streaming {
            window: 128,
            keep_going: true,
        };
        let mut host = Streamer::new(program.as_bytes(), streaming, Answers::default());
        let stopped = sim.run_until(&mut host, Cycle::from_micros(600_000_000));
        assert_eq!(
            stopped,
            Stopped::Quiet,
            "at {}, {:?}",
            sim.now(),
            sim.machine().work()
        );
        assert!(host.is_done());
        let (outcome, digest) = sim.finish();
        assert!(outcome.violations.is_empty(), "{:?}", outcome.violations);
        assert!(outcome.late.is_empty(), "{:?}", outcome.late);
        (outcome, host.finish().unwrap(), digest.0)
    }

    #[test]
    fn a_line_moves_the_carriage_to_its_end_on_either_link() {
        for (link, slowest) in [(Rate::NeverWaits, 0.1), (BAUD, 0.1)] {
            let (outcome, answers, _) = run(link, "G1 X10 F600\n");
            assert_eq!(outcome.motors.map(|motor| motor.net_steps), [2500, 0, 0]);
            assert_eq!(outcome.step_events, 2500);
            assert_eq!(outcome.dominant_step_events, 2500);
            assert_eq!((answers.lines, answers.errors.count()), (1, 0));
            // $110=500 bounds the feed: 10 mm at 8.33 mm/s with ramps of 10 mm/s².
            let ideal = 10.0 / (500.0 / 60.0) + (500.0 / 60.0) / 10.0;
            let error = outcome.motion_seconds - ideal;
            assert!(error.abs() < 1e-4, "{error}");
            assert!(
                outcome.job_seconds < ideal + slowest,
                "{}",
                outcome.job_seconds
            );
            assert!((outcome.peak_step_hz / (250.0 * 500.0 / 60.0) - 1.0).abs() < 1e-3);
            assert!(outcome.min_pulse_us.unwrap() >= 10.0);
            assert!(outcome.cpu.mean > 0.0 && outcome.cpu.peak < 0.5);
        }
    }

    #[test]
    fn a_program_of_many_lines_ends_where_it_says_and_twice_on_the_same_cycle() {
        let program: String = (0..400)
            .map(|k| {
                format!(
                    "G1 X{:.3} Y{:.3} F400\n",
                    f64::from(k % 7) * 0.11,
                    f64::from(k) * 0.05
                )
            })
            .collect();
        let (outcome, answers, digest) = run(BAUD, &program);
        assert_eq!(answers.lines, 400);
        let last = (0.11f64 * f64::from(399 % 7) * 250.0).round() as i64;
        assert_eq!(outcome.motors.map(|motor| motor.net_steps), [last, 4988, 0]);
        assert_eq!(run(BAUD, &program).2, digest);
    }

    #[test]
    fn refused_lines_are_named() {
        let (_, answers, _) = run(Rate::NeverWaits, "G1 X1 F100\nG77\nG1 X0\n");
        let errors: Vec<_> = answers
            .errors
            .first()
            .iter()
            .map(|e| (e.line, e.code))
            .collect();
        assert_eq!(errors, [(2, 20)]);
    }

    /// Returns true if power at rest is reported as a violation: the test switches it on after
    /// `program`.
    fn is_caught(program: &str) -> bool {
        let setup = Setup::<3>::new(MachineConfig::new(), Rate::NeverWaits);
        let mut memory = Memory::new(&setup);
        let mut sim: Simulation<'_, _, _, 3, 3, 256> =
            Simulation::new(&mut memory, &setup, Cartesian, ());
        let streaming = Streaming {
            window: 128,
            keep_going: true,
        };
        let mut host = Streamer::new(program.as_bytes(), streaming, Answers::default());
        sim.run_until(&mut host, Cycle::from_micros(60_000_000));
        assert!(sim.board.violations.is_empty(), "{program}");
        Board::set_power(&mut sim.board, Power::FULL);
        sim.check_laser();
        !sim.board.violations.is_empty()
    }

    #[test]
    fn a_laser_that_is_on_where_it_has_to_be_off_is_caught() {
        assert!(is_caught("$32=1\nM4S500\nG1X1F500\n"));
        assert!(is_caught("$32=1\nM3S500\nG1X1F500\nM0\n"));
        assert!(is_caught("$32=1\nG1X1F500\n"));
        assert!(is_caught("$32=1\nM3S500\nG1X1F500\nG4P0.01\n$C\n"));
        assert!(is_caught("$32=1\n$SLP\n"));
        assert!(!is_caught("$32=1\nM3S500\nG1X1F500\n"));
        assert!(!is_caught("$32=0\nM4S500\nG1X1F500\n"));
    }
}
