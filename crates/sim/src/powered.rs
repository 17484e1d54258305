//! A machine file under power: a simulation of as many axes and motors as the file has.

use crate::clock::Cycle;
use crate::event_loop::{Simulation, Stopped};
use crate::fixtures::Fixtures;
use crate::flash::Flash;
use crate::link::{Host, Rate};
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::oven::HeatFault;
use crate::own::{self, Own};
use crate::plant::Pin;
use crate::profile::{Belts, Profile, MOST_AXES};
use crate::setup::{Memory, Setup};
use leadscrew_machine::board::{CoolantOutput, SpindleOutput, Switches};
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::extension::Extension;
use leadscrew_machine::settings::store::Condition;
use leadscrew_machine::settings::values::{Entry, Key};
use leadscrew_machine::state::State;
use leadscrew_machine::step_timing::StepTiming;
use leadscrew_outputs::OutputsConfig;
use leadscrew_planner::{Coordinate, Kinematics, Train};

/// The motors of the largest machine: one more than its axes.
pub const MOST_MOTORS: usize = MOST_AXES + 1;

/// The most moves that are planned ahead, as on the board.
const MOVES: usize = 1024;

/// The operations of a simulation, whatever its axes, motors and kinematics.
pub trait Powered {
    /// Lets the machine work until `host` is done or nothing happens any more.
    fn work(&mut self, host: &mut dyn Host) -> Stopped;
    /// Lets the machine work until nothing happens any more.
    fn settle(&mut self, host: &mut dyn Host);
    /// Lets time pass up to `end`.
    fn wait_until(&mut self, host: &mut dyn Host, end: Cycle);
    /// The simulated present.
    fn now(&self) -> Cycle;
    /// Returns true if the machine waits for its operator: a program pause, a tool change.
    fn waits_for_operator(&self) -> bool;
    /// Returns true if no job and no command is under way.
    fn is_quiet(&self) -> bool;
    /// The results so far.
    fn outcome(&self) -> Outcome<MOST_MOTORS>;
    /// The machine's state at the present.
    fn snapshot(&self) -> Snapshot;
    /// The levels of its inputs.
    fn levels(&self) -> Switches;
    /// The number of its axes.
    fn axes(&self) -> usize;
    /// Lines that the machine has begun since power-up.
    fn lines_begun(&self) -> u32;
    /// The carriages' places, steps of their motors.
    fn carriages(&self) -> [i32; MOST_MOTORS];
    /// Holds an input at a level whatever its switch does; `None` releases it. Returns the level at
    /// which it was held before.
    fn force_pin(&mut self, pin: Pin, level: Option<bool>) -> Option<bool>;
    /// All settings, each as `$$` prints it.
    fn settings(&self) -> Vec<(Key, String)>;
    /// Loads the stored values from `flash`, before time passes; returns their condition.
    fn load(&mut self, flash: &mut Flash) -> Condition;
    /// Stores changed values in `flash`; does nothing while the machine is not at rest.
    fn save(&mut self, flash: &mut Flash);
    /// Notes that the stored values are lost.
    fn distrust_settings(&mut self);
    /// Notes that the last write has failed: the line that caused it is answered with `error:7`.
    fn not_saved(&mut self);
    /// Notes that a host has connected to a line.
    fn open_line(&mut self, line: usize);
    /// The bytes of a line that were lost since power-up because the receive buffer was full.
    fn lost_bytes(&self, line: usize) -> u32;
}

/// A machine at an instant.
#[derive(Clone, PartialEq, Debug)]
pub struct Snapshot {
    /// Simulated time since power-up.
    pub now: Cycle,
    /// The state, as status reports spell it.
    pub state: &'static str,
    /// The fields of extensions in status reports, such as `|T:2`.
    pub own: String,
    /// Machine position, mm or degrees, axis by axis.
    pub position: Vec<f32>,
    /// Speed on the path, mm/min.
    pub feed: f32,
    /// Feed, rapid and spindle overrides, percent.
    pub overrides: [u8; 3],
    /// The place of work zero, machine position, axis by axis.
    pub work_offset: Vec<f32>,
    /// The output to the spindle.
    pub spindle: SpindleOutput,
    /// Power of the spindle or the laser at this instant, as a share of full power.
    pub power: f32,
    /// The coolant valves.
    pub coolant: CoolantOutput,
    /// Levels of all switches.
    pub switches: Switches,
    /// Lines of the program taken since it began. The machine does not know how many are still to
    /// come.
    pub lines: u32,
    /// Time to finish the queued moves, s.
    pub seconds_queued: f32,
}

impl<K, O, X, const AXES: usize, const MOTORS: usize, const MOVES: usize> Powered
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

    fn wait_until(&mut self, mut host: &mut dyn Host, end: Cycle) {
        self.wait_until(&mut host, end);
    }

    fn now(&self) -> Cycle {
        self.now()
    }

    fn waits_for_operator(&self) -> bool {
        matches!(self.machine().state(), State::Hold(_)) || self.machine().is_aside()
    }

    fn is_quiet(&self) -> bool {
        self.machine().is_quiet()
    }

    fn outcome(&self) -> Outcome<MOST_MOTORS> {
        self.outcome().with_motors()
    }

    fn snapshot(&self) -> Snapshot {
        let levels = Powered::levels(self);
        let machine = self.machine();
        let overrides = machine.overrides();
        Snapshot {
            now: self.now(),
            state: machine.reported_state(!levels.door),
            own: machine.own_fields().to_string(),
            position: machine.position().map(Coordinate::to_mm).to_vec(),
            feed: machine.speed() * 60.0,
            overrides: [overrides.feed, overrides.rapid, overrides.spindle],
            work_offset: machine.work_offset().map(Coordinate::to_mm).to_vec(),
            spindle: self.board().spindle(),
            power: self.board().power().share().to_num(),
            coolant: self.board().coolant(),
            switches: levels,
            lines: machine.program_lines(),
            seconds_queued: machine.time_to_finish(),
        }
    }

    fn levels(&self) -> Switches {
        *self.board().plant.levels()
    }

    fn axes(&self) -> usize {
        AXES
    }

    fn lines_begun(&self) -> u32 {
        self.machine().work().lines
    }

    fn carriages(&self) -> [i32; MOST_MOTORS] {
        let mut places = self.board().plant.position().into_iter();
        [0; MOST_MOTORS].map(|_: i32| places.next().unwrap_or(0))
    }

    fn force_pin(&mut self, pin: Pin, level: Option<bool>) -> Option<bool> {
        self.force_pin(pin, level)
    }

    fn settings(&self) -> Vec<(Key, String)> {
        let settings = self.machine().settings();
        settings
            .keys()
            .map(|key| (key, settings.line(key).to_string()))
            .collect()
    }

    fn load(&mut self, flash: &mut Flash) -> Condition {
        let Ok(condition) = self.machine_mut().load(flash);
        condition
    }

    fn save(&mut self, flash: &mut Flash) {
        // If the store is full, the machine answers `error:7`.
        while self.machine_mut().save(flash) == Ok(true) && self.machine().state() == State::Idle {}
    }

    fn distrust_settings(&mut self) {
        self.machine_mut().distrust_settings();
    }

    fn not_saved(&mut self) {
        self.machine_mut().not_saved();
    }

    fn open_line(&mut self, line: usize) {
        self.open_line(line);
    }

    fn lost_bytes(&self, line: usize) -> u32 {
        self.lost_bytes(line)
    }
}

/// The simulation of a machine file with its extensions.
type Assembled<'m, const AXES: usize, const MOTORS: usize> =
    Simulation<'m, Train, &'m mut dyn Observer, AXES, MOTORS, MOVES, Own<AXES>>;

/// The options of a power-up that the machine's file does not hold.
#[derive(Clone, Copy, Debug)]
pub struct Supply {
    /// The first settings of a new machine. With `None` they are made from the file's settings,
    /// which allocates memory at each power-up that is never freed.
    pub first: Option<&'static [Entry]>,
    /// Its serial lines.
    pub lines: usize,
    /// Their speed.
    pub rate: Rate,
    /// Its outputs that M62 to M65 switch.
    pub outputs: OutputsConfig,
    /// A failure of a heater during the run.
    pub heat_fault: Option<HeatFault>,
    /// The carriages' places, in steps of their motors; `None` for the places in the file.
    pub carriages: Option<[i32; MOST_MOTORS]>,
    /// The times of making steps on its board.
    pub timing: StepTiming,
    /// True if only times count: the steps of a segment are made at once.
    pub glides: bool,
    /// True if the lines of a raster become rows; if not, each is a move of its own, as in Grbl.
    pub joins_rows: bool,
    /// The least time from one line of a program to the next, µs, on serial lines that take time:
    /// how long a slow machine takes for a line.
    pub line_us: u64,
}

/// Puts a machine together and switches it on. Implemented for a machine's file.
pub trait PowerUp {
    /// The options of a power-up with the file's values: one serial line at `rate`, and no failure
    /// of a heater.
    fn supply(&self, rate: Rate) -> Supply;

    /// Powers the machine up and lends it to `work`.
    fn power_up(
        &self,
        with: Supply,
        observer: &mut dyn Observer,
        work: &mut dyn FnMut(&mut dyn Powered),
    );

    /// Powers the machine up for as long as the program runs: its memory is never freed.
    fn power_up_for_good(
        &self,
        with: Supply,
        observer: &'static mut dyn Observer,
    ) -> Box<dyn Powered>;
}

impl PowerUp for Profile {
    fn supply(&self, rate: Rate) -> Supply {
        Supply {
            first: None,
            lines: 1,
            rate,
            outputs: self.outputs.config(),
            heat_fault: None,
            carriages: None,
            timing: StepTiming::F407,
            glides: false,
            joins_rows: true,
            line_us: 0,
        }
    }

    fn power_up(
        &self,
        with: Supply,
        observer: &mut dyn Observer,
        work: &mut dyn FnMut(&mut dyn Powered),
    ) {
        // Every machine has one motor more than axes, fitted or not, so that fewer types have to be
        // compiled.
        match self.axis_count() {
            6 => simulate::<6, 7>(self, with, observer, work),
            5 => simulate::<5, 6>(self, with, observer, work),
            4 => simulate::<4, 5>(self, with, observer, work),
            _ => simulate::<3, 4>(self, with, observer, work),
        }
    }

    fn power_up_for_good(
        &self,
        with: Supply,
        observer: &'static mut dyn Observer,
    ) -> Box<dyn Powered> {
        match self.axis_count() {
            6 => keep::<6, 7>(self, with, observer),
            5 => keep::<5, 6>(self, with, observer),
            4 => keep::<4, 5>(self, with, observer),
            _ => keep::<3, 4>(self, with, observer),
        }
    }
}

fn simulate<const AXES: usize, const MOTORS: usize>(
    profile: &Profile,
    with: Supply,
    observer: &mut dyn Observer,
    work: &mut dyn FnMut(&mut dyn Powered),
) {
    let setup = setup::<AXES>(profile, with);
    let mut memory = Memory::<AXES, MOTORS, MOVES>::new(&setup);
    work(&mut assemble(profile, &setup, with, &mut memory, observer));
}

fn keep<const AXES: usize, const MOTORS: usize>(
    profile: &Profile,
    with: Supply,
    observer: &'static mut dyn Observer,
) -> Box<dyn Powered> {
    let setup = setup::<AXES>(profile, with);
    let memory = Box::leak(Box::new(Memory::<AXES, MOTORS, MOVES>::new(&setup)));
    Box::new(assemble(profile, &setup, with, memory, observer))
}

fn setup<const AXES: usize>(profile: &Profile, with: Supply) -> Setup<AXES> {
    let mut config = match with.first {
        Some(defaults) => MachineConfig {
            defaults,
            ..profile.bare_config()
        },
        None => profile.config(),
    };
    config.step_timing = with.timing;
    if !with.joins_rows {
        config.pixels = 0;
    }
    let mut setup = Setup::new(config, with.rate);
    setup.lines = vec![with.rate; with.lines];
    setup.receive_buffer = usize::from(profile.receive_buffer());
    setup.contacts = profile.contacts();
    setup
}

/// Puts the machine together: its extensions, its carriages and the switches that they work.
fn assemble<'m, const AXES: usize, const MOTORS: usize>(
    profile: &Profile,
    setup: &Setup<AXES>,
    with: Supply,
    memory: &'m mut Memory<AXES, MOTORS, MOVES>,
    observer: &'m mut dyn Observer,
) -> Assembled<'m, AXES, MOTORS> {
    let own = own::extension::<AXES>(profile, with.outputs, with.heat_fault, memory.own_pins());
    let mut simulation = Simulation::extended(memory, setup, profile.train(), observer, own);
    if with.glides {
        simulation.glide();
    }
    simulation.pace(with.line_us);
    simulation.mirror(profile.reversed());
    if profile.kinematics == Belts::CoreXy {
        simulation.cross_belts();
    }
    let mut places = with
        .carriages
        .unwrap_or_else(|| profile.start())
        .into_iter();
    simulation.place([0; MOTORS].map(|_: i32| places.next().unwrap_or(0)));
    if let Some(plate) = profile.plate() {
        simulation.bend_plate(plate);
    }
    for switch in profile.plant_switches() {
        simulation.add_switch(switch);
    }
    simulation.set_pin(Pin::Door, !profile.door.open);
    simulation
}
