//! A simulation of any size, as the server sees it.

use super::browser::{Trail, Watched};
use super::panel::Snapshot;
use super::wires::Wires;
use leadscrew_machine::extension::Extension;
use leadscrew_machine::settings::store::Condition;
use leadscrew_machine::settings::table::Kind;
use leadscrew_machine::settings::values::{Key, Settings};
use leadscrew_machine::state::State;
use leadscrew_planner::{Coordinate, Kinematics};
use leadscrew_sim::clock::Cycle;
use leadscrew_sim::event_loop::Simulation;
use leadscrew_sim::flash::Flash;
use leadscrew_sim::plant::Pin;
use serde_json::{json, Value};

/// What the server does with a machine, whatever its axes, motors and kinematics.
pub(super) trait Desk {
    /// The simulated present.
    fn now(&self) -> Cycle;
    /// Lets time pass up to `end`.
    fn run_until(&mut self, wires: &mut Wires, end: Cycle);
    /// Holds an input at a level whatever its switch does; `None` lets it go. Returns how it was held before.
    fn force_pin(&mut self, pin: Pin, level: Option<bool>) -> Option<bool>;
    /// The level of an input.
    fn level(&self, pin: Pin) -> bool;
    /// The number of axes.
    fn axes(&self) -> usize;
    /// The number of motors: that of the axes, and second ones.
    fn motors(&self) -> usize;
    /// Takes over what is stored, before time passes; answers in what condition it is.
    fn load(&mut self, flash: &mut Flash) -> Condition;
    /// Notes that what was stored is lost.
    fn distrust_settings(&mut self);
    /// Somebody has come at the other end of a line.
    fn open_line(&mut self, line: usize);
    /// Stores what has changed, as far as the machine is at rest.
    fn save(&mut self, flash: &mut Flash);
    /// Notes that what was stored did not survive: the line that has changed it is answered with `error:7`.
    fn not_saved(&mut self);
    /// How many bytes of a line's clients were lost for want of room in the receive buffer since power-up.
    fn lost_bytes(&self, line: usize) -> u32;
    /// Whether no job and no command is under way.
    fn is_quiet(&self) -> bool;
    /// Lines that the machine has begun since power-up.
    fn lines_begun(&self) -> u32;
    /// Where the tool goes, if anybody watches it.
    fn trail(&mut self) -> Option<&mut Trail>;
    /// All settings with their names and limits, as pages get them.
    fn settings(&self) -> Value;
    /// All settings as `$$` prints them, our own ones too.
    fn settings_text(&self) -> String;
    /// What there is to be shown.
    fn snapshot(&self) -> Snapshot;
}

impl<K, O, X, const AXES: usize, const MOTORS: usize, const MOVES: usize> Desk
    for Simulation<'_, K, O, AXES, MOTORS, MOVES, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    O: Watched,
    X: Extension<AXES>,
{
    fn now(&self) -> Cycle {
        self.now()
    }

    fn run_until(&mut self, wires: &mut Wires, end: Cycle) {
        self.wait_until(wires, end);
    }

    fn force_pin(&mut self, pin: Pin, level: Option<bool>) -> Option<bool> {
        self.force_pin(pin, level)
    }

    fn level(&self, pin: Pin) -> bool {
        let levels = self.board().plant.levels();
        match pin {
            Pin::Limit(motor) => levels.limits.contains(motor),
            Pin::Probe => levels.probe,
            Pin::Reset => levels.reset,
            Pin::Hold => levels.hold,
            Pin::Start => levels.start,
            Pin::Door => levels.door,
        }
    }

    fn axes(&self) -> usize {
        AXES
    }

    fn motors(&self) -> usize {
        MOTORS
    }

    fn load(&mut self, flash: &mut Flash) -> Condition {
        let Ok(condition) = self.machine_mut().load(flash);
        condition
    }

    fn distrust_settings(&mut self) {
        self.machine_mut().distrust_settings();
    }

    fn open_line(&mut self, line: usize) {
        self.open_line(line);
    }

    fn save(&mut self, flash: &mut Flash) {
        // Where the store is full, the machine says so: `error:7`.
        while self.machine_mut().save(flash) == Ok(true) && self.machine().state() == State::Idle {}
    }

    fn not_saved(&mut self) {
        self.machine_mut().not_saved();
    }

    fn lost_bytes(&self, line: usize) -> u32 {
        self.lost_bytes(line)
    }

    fn is_quiet(&self) -> bool {
        self.machine().is_quiet()
    }

    fn lines_begun(&self) -> u32 {
        self.machine().work().lines
    }

    fn trail(&mut self) -> Option<&mut Trail> {
        self.observer().trail()
    }

    fn settings(&self) -> Value {
        let settings = self.machine().settings();
        let one = |key: Key| {
            let row = key.row();
            let line = settings.line(key).to_string();
            json!({
                "number": key.number(),
                "name": name_of(key),
                "unit": row.unit,
                "description": row.description,
                "value": line.split_once('=').map_or("", |(_, value)| value),
                "range": range_of(row.kind),
            })
        };
        Settings::<AXES>::keys().map(one).collect()
    }

    fn settings_text(&self) -> String {
        let settings = self.machine().settings();
        let lines = Settings::<AXES>::keys().map(|key| format!("{}\n", settings.line(key)));
        lines.collect()
    }

    fn snapshot(&self) -> Snapshot {
        let levels = *self.board().plant.levels();
        let machine = self.machine();
        let overrides = machine.overrides();
        Snapshot {
            now: self.now(),
            state: machine.state().name(!levels.door),
            position: machine.position().map(Coordinate::to_mm).to_vec(),
            feed: machine.speed() * 60.0,
            overrides: [overrides.feed, overrides.rapid, overrides.spindle],
            work_offset: machine.work_offset().map(Coordinate::to_mm).to_vec(),
            spindle: self.board().spindle(),
            power: self.board().power().share().to_num(),
            coolant: self.board().coolant(),
            motors: MOTORS,
            switches: levels,
            lines: machine.program_lines(),
            seconds_queued: machine.time_to_finish(),
        }
    }
}

/// What a setting is called, with its axis.
fn name_of(key: Key) -> String {
    match key {
        Key::Machine(setting) => setting.row().name.to_owned(),
        Key::Axis(setting, axis) => {
            let letter = ["X", "Y", "Z", "A"].get(axis).copied().unwrap_or("?");
            format!("{letter} {}", setting.row().name)
        }
    }
}

/// The values that a setting takes, in words.
fn range_of(kind: Kind) -> String {
    match kind {
        Kind::AxisMask => "one bit an axis, X is 1, Y is 2, Z is 4".to_owned(),
        Kind::Bits(names) => format!("bits from 1 on: {names}"),
        Kind::Switch => "0 or 1".to_owned(),
        Kind::Whole { max } => format!("0 to {max}"),
        Kind::Decimal { zero: true, .. } => "0 or more".to_owned(),
        Kind::Decimal { zero: false, .. } => "more than 0".to_owned(),
        Kind::Signed { most } => format!("-{most} to {most}"),
    }
}
