//! A machine from one power-up to the next, and the operations that are done to it.

use super::op::Op;
use super::wire::Wire;
use super::world::World;
use crate::clock::{cycles_of_micros, seconds, Cycle};
use crate::event_loop::{Simulation, Stopped};
use crate::flash::Flash;
use crate::setup::{Memory, Setup};
use leadscrew_machine::state::State;
use leadscrew_planner::Cartesian;
use std::array::from_fn;
use std::time::Duration;

/// The moves that Grbl plans ahead at most.
const MOVES: usize = 15;

/// The longest time from power-up until the machine listens.
const BOOT: Duration = Duration::from_millis(30);
/// The time that `cmd` waits at most.
const COMMAND: Duration = Duration::from_secs(20);
/// The time that `resp` waits at most.
const ANSWERS: Duration = Duration::from_secs(60);
/// The time that `idle` waits at most.
const IDLE: Duration = Duration::from_secs(120);
/// The time without a step after which a machine counts as idle.
const STILL: Duration = Duration::from_millis(25);

/// Simulated time between two checks of unsaved changes and of the condition that is waited for.
const SLICE: Duration = Duration::from_millis(1);

/// The reason why a session is over.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Ended {
    /// The machine lost its power.
    PowerCycle,
    /// All operations are done.
    Done,
}

/// A machine that is powered.
pub(super) struct Session<'m, const N: usize> {
    sim: Simulation<'m, Cartesian, (), N, N, MOVES>,
    flash: &'m mut Flash,
    wire: &'m mut Wire,
    world: World<N>,
    /// The time at which it was powered up, counted from the first power-up.
    begun: Cycle,
}

impl<'m, const N: usize> Session<'m, N> {
    /// Powers the machine up, at `begun` after the first power-up.
    pub(super) fn power_up(
        memory: &'m mut Memory<N, N, MOVES>,
        setup: &Setup<N>,
        flash: &'m mut Flash,
        wire: &'m mut Wire,
        world: &World<N>,
        begun: Cycle,
    ) -> Self {
        let mut sim = Simulation::new(memory, setup, Cartesian, ());
        world.wire_to(&mut sim);
        wire.power_up(begun);
        let Ok(_) = sim.machine_mut().load(flash);
        Self {
            sim,
            flash,
            wire,
            world: world.clone(),
            begun,
        }
    }

    /// Carries out operations until the power goes off. `done` gets the time at which each
    /// operation began, ms, and the lines that came before the next one.
    pub(super) fn hold(
        &mut self,
        ops: &[Op],
        mut done: impl FnMut(Option<f64>, Vec<String>),
    ) -> Ended {
        for op in ops {
            let began = (*op != Op::Boot).then(|| seconds(self.now().0) * 1e3);
            self.apply(op);
            done(began, self.wire.take_lines());
            if *op == Op::PowerCycle {
                return Ended::PowerCycle;
            }
        }
        Ended::Done
    }

    /// Time since the first power-up.
    pub(super) fn now(&self) -> Cycle {
        self.begun + self.sim.now().0
    }

    /// The state that stays when the power goes off.
    pub(super) fn world(&self) -> World<N> {
        let plant = &self.sim.board().plant;
        World {
            levels: *plant.levels(),
            switches: self.world.switches.clone(),
            carriages: plant.position(),
        }
    }

    fn apply(&mut self, op: &Op) {
        match op {
            Op::Boot => self.wait(BOOT),
            Op::Wait(span) => self.wait(*span),
            Op::Send(bytes) => self.wire.send(bytes),
            Op::Command(bytes) => {
                self.wire.send(bytes);
                self.wait_for_answers(1, COMMAND);
            }
            Op::Answers(count) => self.wait_for_answers(*count, ANSWERS),
            Op::Idle => {
                let began = self.sim.now();
                self.wait_while(IDLE, |session| session.is_idle_since(began));
            }
            Op::Quiet(span) => self.wait_until_quiet(*span),
            Op::Pin(pin, level) => self.sim.set_pin(*pin, *level),
            Op::Switch(switch) => {
                self.world.switches.push(*switch);
                self.sim.add_switch(*switch);
            }
            Op::NoSwitch => {
                self.world.switches.clear();
                self.sim.remove_switches();
            }
            Op::Place(place) => {
                let of = |motor| place.get(motor).copied();
                self.sim
                    .place_unseen(from_fn(|motor| of(motor).unwrap_or(0)));
            }
            Op::PowerCycle => self.save(),
        }
    }

    fn wait(&mut self, span: Duration) {
        self.wait_while(span, |_| false);
    }

    fn wait_for_answers(&mut self, count: u32, limit: Duration) {
        let last = self.wire.answers() + count;
        self.wait_while(limit, |session| session.wire.answers() >= last);
    }

    fn wait_until_quiet(&mut self, span: Duration) {
        while self.now() < self.wire.last_byte() + cycles(span) {
            self.advance(self.wire.last_byte() + cycles(span) - self.now(), |_| true);
        }
    }

    /// Lets time pass until `reached` is true, at most `limit`. `reached` is checked after each
    /// line from the machine, and every [`SLICE`].
    fn wait_while(&mut self, limit: Duration, reached: impl Fn(&Self) -> bool) {
        let end = self.sim.now() + cycles(limit);
        while self.sim.now() < end && !reached(self) {
            let answers = self.wire.answers();
            self.advance(end - self.sim.now(), |wire| wire.answers() == answers);
        }
    }

    /// Lets a [`SLICE`] pass, or `most` cycles if they are fewer. Ends early when `going` returns
    /// false.
    fn advance(&mut self, most: u64, going: impl Fn(&Wire) -> bool) {
        let end = self.sim.now() + most.min(cycles(SLICE));
        if self.sim.run_while(self.wire, end, going) != Stopped::Condition {
            self.sim.wait_until(self.wire, end);
        }
        self.save();
    }

    /// Stores changed settings; does nothing while the machine is not at rest.
    fn save(&mut self) {
        while self.sim.machine_mut().save(self.flash) == Ok(true)
            && self.sim.machine().state() == State::Idle
        {}
    }

    /// Returns true if the machine has nothing to do. `began` is when the wait for it began.
    fn is_idle_since(&self, began: Cycle) -> bool {
        let still = |since: Cycle| self.sim.now() >= since + cycles(STILL);
        let ready = match self.sim.machine().state() {
            State::Idle | State::Alarm(_) | State::Check | State::Sleep => true,
            State::Run | State::Jog(_) | State::Hold(_) | State::Home | State::Door(_) => false,
        };
        ready
            && still(began)
            && still(self.sim.board().last_step)
            && self.wire.is_sent()
            && self.sim.machine().is_quiet()
    }
}

fn cycles(span: Duration) -> u64 {
    cycles_of_micros(span.as_micros() as u64) // an hour at most
}
