//! A machine file under power: a simulation of as many axes and motors as the file has.

use crate::clock::Cycle;
use crate::event_loop::{Simulation, Stopped};
use crate::link::{Host, Rate};
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::oven::SensorFault;
use crate::plant::Pin;
use crate::profile::{Belts, Profile};
use crate::setup::{Memory, Setup};
use crate::train::Train;
use leadscrew_machine::extension::Extension;
use leadscrew_machine::settings::values::Entry;
use leadscrew_machine::state::State;
use leadscrew_outputs::OutputsConfig;
use leadscrew_planner::Kinematics;

/// The axes of the largest machine that a file can describe.
pub const MOST_AXES: usize = 6;

/// Its motors: one more than axes.
pub const MOST_MOTORS: usize = MOST_AXES + 1;

/// Moves planned ahead at most, as on the board.
const MOVES: usize = 1024;

/// What a job does with a simulation, whatever its axes, motors and kinematics.
pub trait Powered {
    /// Lets the machine work until `host` is done or nothing happens any more.
    fn work(&mut self, host: &mut dyn Host) -> Stopped;
    /// Lets the machine work until nothing happens any more.
    fn settle(&mut self, host: &mut dyn Host);
    /// Whether it waits for its operator: a program pause, a tool change.
    fn waits_for_operator(&self) -> bool;
    /// What has been found out so far.
    fn outcome(&self) -> Outcome<MOST_MOTORS>;
}

impl<K, O, X, const AXES: usize, const MOTORS: usize> Powered
    for Simulation<'_, K, O, AXES, MOTORS, MOVES, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    O: Observer,
    X: Extension<AXES>,
{
    fn work(&mut self, mut host: &mut dyn Host) -> Stopped {
        self.run_while(&mut host, Cycle::NEVER, |host| !host.is_done())
    }

    fn settle(&mut self, mut host: &mut dyn Host) {
        self.run_until(&mut host, Cycle::NEVER);
    }

    fn waits_for_operator(&self) -> bool {
        matches!(self.machine().state(), State::Hold(_)) || self.machine().is_aside()
    }

    fn outcome(&self) -> Outcome<MOST_MOTORS> {
        self.outcome().with_motors()
    }
}

/// What a machine is powered up with beside its file.
#[derive(Clone, Copy, Debug)]
pub struct Supply {
    /// Settings of a new machine.
    pub first: &'static [Entry],
    /// Its serial line.
    pub rate: Rate,
    /// Its outputs that M62 to M65 switch.
    pub outputs: OutputsConfig,
    /// A sensor that fails.
    pub sensor_fault: Option<SensorFault>,
}

impl Profile {
    /// Powers the machine up with one serial line and lends it to `work`.
    pub fn power_up(
        &self,
        with: Supply,
        observer: &mut dyn Observer,
        work: &mut dyn FnMut(&mut dyn Powered),
    ) {
        match (self.axis_count(), self.second_motor.is_some()) {
            (6, _) => self.simulate::<6, 6>(with, observer, work),
            (5, _) => self.simulate::<5, 5>(with, observer, work),
            (4, true) => self.simulate::<4, 5>(with, observer, work),
            (4, false) => self.simulate::<4, 4>(with, observer, work),
            (_, true) => self.simulate::<3, 4>(with, observer, work),
            (_, false) => self.simulate::<3, 3>(with, observer, work),
        }
    }

    fn simulate<const AXES: usize, const MOTORS: usize>(
        &self,
        with: Supply,
        observer: &mut dyn Observer,
        work: &mut dyn FnMut(&mut dyn Powered),
    ) {
        let mut setup = Setup::<AXES>::new(self.config(), with.rate);
        setup.machine.defaults = with.first;
        setup.receive_buffer = usize::from(self.receive_buffer());
        if self.has_switches() {
            setup.contacts = self.contacts();
        }
        let mut memory = Memory::new(&setup);
        let own = self.extension::<AXES>(with.outputs, with.sensor_fault, memory.own_pins());
        let mut simulation: Simulation<'_, _, _, AXES, MOTORS, MOVES, _> =
            Simulation::extended(&mut memory, &setup, self.train(), observer, own);
        if self.kinematics == Belts::CoreXy {
            simulation.cross_belts();
        }
        if self.has_switches() {
            simulation.place(self.start::<MOTORS>());
        }
        if let Some(plate) = self.plate() {
            simulation.bend_plate(plate);
        }
        for switch in self.plant_switches() {
            simulation.add_switch(switch);
        }
        if self.door.open {
            simulation.set_pin(Pin::Door, false);
        }
        work(&mut simulation);
    }

    /// What stands between its axes and motors.
    pub fn train(&self) -> Train {
        match (self.kinematics, &self.second_motor) {
            (Belts::CoreXy, _) => Train::Crossed,
            (Belts::Cartesian, Some(second)) => Train::Ganged(second.axis.number()),
            (Belts::Cartesian, None) => Train::Straight,
        }
    }
}
