//! Follows a program line by line without a machine: its mistakes, and its path.
//!
//! Lines go through the machine's own line reader, interpreter and settings, but are not planned or
//! moved.

mod bends;
mod carriage;
mod doubts;
mod finding;
mod frame;
mod known;
mod measures;
mod preamble;
mod standing;
mod system;

pub use doubts::Doubt;
pub use preamble::{Ask, RestError};
pub(crate) use standing::names_motion;

use crate::complaint::Complaint;
use crate::machine::Machine;
use crate::remark::Done;
use carriage::Carriage;
use doubts::Habits;
use finding::{refused, refused_by, Finding, LineFaultKind};
use frame::{counts_from_here, is_in_machine_coordinates, Spans};
use known::Probed;
use leadscrew_machine::config::{AxisMask, MachineConfig};
use leadscrew_machine::extension::{Call, Extension};
use leadscrew_machine::interpreter::{
    ArcShape, Command, Commands, Context, Extent, Fault as LineFault, Feed, Interpreter, OffsetId,
    Own as Codes, OwnCodes, Rotation, Spindle, Strokes, ToolTable, Travel, WorkSystem,
};
use leadscrew_machine::protocol::line_reader::LineReader;
use leadscrew_machine::protocol::realtime::{Byte, Sorter};
use leadscrew_machine::settings::table::Setting;
use leadscrew_machine::settings::values::Settings;
use leadscrew_planner::Coordinate;
use leadscrew_program::World;
use leadscrew_sim::own::{extension, Own, OwnPins};
use leadscrew_sim::profile::Room;
use leadscrew_sim::scene::{StrokeKind, ToolSizes, Tooling, Toolpath};
use measures::Measures;
use standing::Standing;
use system::State;

/// M6, at which a machine with a tool change waits for its operator.
const TOOL_CHANGE: u8 = 6;

/// The way of a move to its target.
enum Way<'a> {
    Straight,
    /// It ends on its way, where the probe touches.
    Probe,
    Arc(&'a ArcShape),
}

/// Follows a program line by line, whatever the axes of its machine.
pub trait Follow {
    /// Puts the machine's X, Y and Z at `origin`, in machine coordinates, and sets work zero there.
    /// From then on a move that leaves the travel is a fault.
    fn begin_at(&mut self, origin: [Coordinate; 3]);
    /// Keeps the moves for a picture.
    fn draw(&mut self);
    /// Takes the line with this number; returns the fault in it, if any.
    fn check(&mut self, number: u64, raw: &[u8]) -> Option<Complaint>;
    /// Takes the carriages to stand where the machine's file puts them at power-up. From then on a
    /// move that leaves the frame is a fault.
    fn know_carriages(&mut self);
    /// Takes the line with this number before the machine does; returns what will come of it.
    fn foresee(&mut self, number: u64, raw: &[u8]) -> Foreseen;
    /// The effects of the line under way.
    fn last(&self) -> Done;
    /// Returns the likely mistakes in the line that was checked last. Each kind is told once in a
    /// program.
    fn doubts(&mut self) -> Vec<Doubt>;
    /// Takes the end of the program, whose last line is number `last`. Returns likely mistakes that
    /// only a whole program shows, each with a line and its text.
    fn end(&mut self, last: u64, raw: &[u8]) -> Vec<(u64, Vec<u8>, Doubt)>;
    /// The path of the program so far.
    fn path(&self) -> &Toolpath;
    /// Notes from here on by which words the program comes to its place. It stands at `start`,
    /// work coordinates, if that is known.
    fn stand(&mut self, start: Option<[Coordinate; 3]>);
    /// Lines that bring a machine from anywhere to the program's place.
    ///
    /// # Errors
    /// A place that only the machine knew.
    fn preamble(&self, ask: &Ask) -> Result<Vec<String>, RestError>;
    /// The line whose arc, canned cycle or probe the next line goes on with, if it names no motion.
    fn motion_line(&self) -> Option<u64>;
    /// The place of the zero of X, Y and Z by the program so far, machine position, mm.
    fn zero(&self) -> [f32; 3];
    /// Returns what a program may know of the machine after the line checked last. A probe has
    /// touched at the end of its way, unless [`Follow::end_probe`] tells the place.
    fn world(&self) -> &dyn World;
    /// Takes over the place at which a probe has really ended, machine coordinates, mm, and whether
    /// it touched.
    fn end_probe(&mut self, at: &[f32], touched: bool);
}

/// The foreseen outcome of a line that the machine has not taken yet.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Foreseen {
    /// The machine takes it, or leaves it unanswered.
    Taken,
    /// The machine refuses it.
    Refused,
    /// The machine takes it, and the carriage cannot go there.
    Crash(Complaint),
}

/// Begins a program called `file` on `machine` as it is after power-up.
pub fn follow(file: &str, machine: &Machine) -> Box<dyn Follow> {
    match machine.axes() {
        6 => Box::new(Checker::<6>::new(file, machine)),
        5 => Box::new(Checker::<5>::new(file, machine)),
        4 => Box::new(Checker::<4>::new(file, machine)),
        _ => Box::new(Checker::<3>::new(file, machine)),
    }
}

/// Follows a program line by line without a machine.
struct Checker<const AXES: usize> {
    file: String,
    /// Letters of the axes, in order.
    letters: Vec<char>,
    config: MachineConfig<AXES>,
    settings: Settings<AXES>,
    measures: Measures<AXES>,
    interpreter: Interpreter<AXES>,
    motors: usize,
    /// The M codes of the machine's extensions.
    own: Own<AXES>,
    /// The program's path.
    path: Toolpath,
    tooling: Tooling,
    /// The tools that comments describe; kept only for a picture.
    tools: ToolSizes,
    /// True if targets outside the travel are faults even with soft limits off.
    travel_counts: bool,
    /// The state of the machine.
    state: State<AXES>,
    /// Motion may go on: nothing has waited for its end.
    moves: bool,
    /// The effects of the line under way.
    last: Done,
    /// The text of the line that is being checked. It is kept until the program has switched its
    /// spindle on and made a feed move with power: a doubt at the end may quote it.
    raw: Vec<u8>,
    habits: Habits,
    /// True if the line that is being checked moves in machine coordinates.
    in_machine_coordinates: bool,
    /// The line that is being checked gives the present place other coordinates.
    keeps_zero: bool,
    spans: Spans<AXES>,
    /// The carriages whose places are known.
    carriages: [Option<Carriage>; AXES],
    /// The travel that the machine's file gives the carriages.
    rooms: Vec<Option<Room>>,
    /// Axes that the program has homed: their places are known.
    homed: AxisMask,
    /// The number of the line that is being checked.
    number: u64,
    /// By which words the program has come to its place, if somebody asks.
    standing: Option<Standing<AXES>>,
    /// The end of the last probe.
    probed: Option<Probed<AXES>>,
    /// The tool that the program has taken last.
    tool: u32,
}

impl<const AXES: usize> Follow for Checker<AXES> {
    fn begin_at(&mut self, origin: [Coordinate; 3]) {
        let origin = std::array::from_fn(|axis| origin.get(axis).copied().unwrap_or_default());
        let zero = OffsetId::Work(WorkSystem::default());
        self.interpreter.load_offset(zero, origin);
        self.interpreter.set_position(origin);
        self.travel_counts = true;
        self.path = Toolpath::new(mm(&origin), self.path.is_drawn());
    }

    fn draw(&mut self) {
        self.path = Toolpath::new(mm(self.interpreter.position()), true);
    }

    fn check(&mut self, number: u64, raw: &[u8]) -> Option<Complaint> {
        self.number = number;
        self.path.line = u32::try_from(number).unwrap_or(u32::MAX);
        if self.habits.may_need_lines() {
            self.raw.clear();
            self.raw.extend_from_slice(raw);
        }
        if self.path.is_drawn() {
            self.path.tool_mm = self.tools.read(raw);
        }
        let (kind, detail) = self.check_line(raw).err()?;
        Some(self.complaint(number, raw, &kind, detail))
    }

    fn know_carriages(&mut self) {
        let rooms = std::mem::take(&mut self.rooms);
        self.place_carriages(&rooms);
    }

    fn foresee(&mut self, number: u64, raw: &[u8]) -> Foreseen {
        let Err((kind, detail)) = self.check_line(raw) else {
            return Foreseen::Taken;
        };
        match kind {
            LineFaultKind::OutOfTravel
            | LineFaultKind::MayLeaveTravel
            | LineFaultKind::Unanswered => Foreseen::Taken,
            LineFaultKind::Refused(_) | LineFaultKind::TooLong => Foreseen::Refused,
            LineFaultKind::CannotFit | LineFaultKind::LeavesFrame => {
                Foreseen::Crash(self.complaint(number, raw, &kind, detail))
            }
        }
    }

    fn last(&self) -> Done {
        self.last
    }

    fn doubts(&mut self) -> Vec<Doubt> {
        std::mem::take(&mut self.habits.found)
    }

    fn end(&mut self, last: u64, raw: &[u8]) -> Vec<(u64, Vec<u8>, Doubt)> {
        self.see_end(last, raw)
    }

    fn path(&self) -> &Toolpath {
        &self.path
    }

    fn stand(&mut self, start: Option<[Coordinate; 3]>) {
        self.standing = Some(Standing::new(start.is_some()));
        if let Some(start) = start {
            let start = std::array::from_fn(|axis| start.get(axis).copied().unwrap_or_default());
            self.interpreter.set_position(start);
        }
    }

    fn preamble(&self, ask: &Ask) -> Result<Vec<String>, RestError> {
        self.lines_to_here(ask)
    }

    fn motion_line(&self) -> Option<u64> {
        self.line_of_motion()
    }

    fn zero(&self) -> [f32; 3] {
        let offset = self.interpreter.work_offset();
        std::array::from_fn(|axis| offset.get(axis).map_or(0.0, |place| place.to_mm()))
    }

    fn world(&self) -> &dyn World {
        self
    }

    fn end_probe(&mut self, at: &[f32], touched: bool) {
        Self::end_probe(self, at, touched);
    }
}

impl<const AXES: usize> Checker<AXES> {
    fn new(file: &str, machine: &Machine) -> Self {
        let settings = Settings::new(machine.first());
        let mut checker = Self {
            file: file.to_owned(),
            letters: machine.file.letters(),
            config: machine.config(),
            measures: Measures::new(&settings),
            settings,
            interpreter: Interpreter::new(),
            motors: machine.file.motor_count(),
            own: extension(&machine.file, machine.outputs, None, OwnPins::default()),
            path: Toolpath::new([0.0; 3], false),
            tooling: machine.tooling(),
            tools: ToolSizes::default(),
            travel_counts: false,
            state: State::Idle,
            moves: false,
            last: Done::default(),
            raw: Vec::new(),
            habits: Habits::default(),
            in_machine_coordinates: false,
            keeps_zero: false,
            spans: Spans::BEGIN,
            carriages: [None; AXES],
            rooms: machine.file.rooms(),
            homed: 0,
            number: 0,
            standing: None,
            probed: None,
            tool: 0,
        };
        checker.learn_rates();
        checker.habits.is_cold = machine.file.heaters.nozzle.is_some();
        checker
    }

    fn check_line(&mut self, raw: &[u8]) -> Finding {
        self.last = Done::default();
        self.habits.found.clear();
        let mut reader = LineReader::<128>::new(self.config.line_length);
        let mut sorter = Sorter::new();
        for byte in raw {
            if let Byte::Ordinary(byte) = sorter.sort(*byte) {
                reader.push(byte);
            }
        }
        self.wake()?;
        let whole = |status| refused(LineFault { status, column: 0 });
        let line = reader.line().map_err(whole)?;
        match line {
            [b'$', ..] => self.check_system(line),
            [] => Ok(()),
            _ => self.check_program(line),
        }
    }

    fn check_program(&mut self, line: &[u8]) -> Finding {
        self.end_jog();
        let mut commands = Commands::new();
        let start = *self.interpreter.position();
        let find = |code| self.own.m_code(code);
        let check = |call: &Call| self.own.check(call);
        let own = Codes::new(&find, &check);
        let length = |tool| self.own.tool_length(tool);
        let context = Context {
            tools: ToolTable::some(&length),
            ..self
                .config
                .context(&self.settings, &self.measures.reach, OwnCodes::some(&own))
        };
        let extent = self.interpreter.interpret(line, &context, &mut commands);
        let extent = extent.map_err(|fault| refused_by(&self.interpreter, fault))?;
        let mut rest = Commands::new();
        if extent == Extent::First {
            self.interpreter
                .interpret_rest(line, &context, &mut rest)
                .map_err(refused)?;
        }
        self.note_standing(line, &commands, &rest);
        self.in_machine_coordinates = is_in_machine_coordinates(line);
        if self.in_machine_coordinates {
            self.see_switches(line);
        }
        let shifts = |command| matches!(command, &Command::WorkOffset(_));
        self.keeps_zero = commands.iter().chain(&rest).any(shifts) && counts_from_here(line);
        let mut at = start;
        commands
            .iter()
            .chain(&rest)
            .try_for_each(|command| self.check_command(&mut at, command))
    }

    /// Checks the target of a command, starting from the end of the command before it. An arc is
    /// checked along its whole way.
    fn check_command(&mut self, at: &mut [Coordinate; AXES], command: &Command<AXES>) -> Finding {
        match command {
            Command::Line(travel) => self.go(at, travel, Way::Straight),
            Command::Probe { travel, .. } => {
                // A probe cuts nothing: its way is travel.
                let feed = Feed::Rapid;
                let (at_end, touched) = (travel.target, true);
                self.probed = Some(Probed {
                    at: at_end,
                    touched,
                });
                let start = *at;
                let gone = self.go(at, &Travel { feed, ..*travel }, Way::Probe);
                self.forget_way(&start, at);
                gone
            }
            Command::Arc { travel, arc } => self.go(at, travel, Way::Arc(arc)),
            Command::Cycle { travel, cycle } => {
                let clearance = self.settings.value(Setting::PeckClearance);
                let clearance = Coordinate::from_nanos(clearance.nanos());
                Strokes::new(at, travel, cycle, clearance)
                    .try_for_each(|stroke| self.check_command(at, &stroke))
            }
            Command::Pause => {
                self.last.paused = !self.is_checking();
                self.moves = false;
                Ok(())
            }
            Command::ProgramEnd => {
                self.last.ended = true;
                self.moves = false;
                self.see_spindle(&Spindle::default());
                Ok(())
            }
            Command::StoreTool { tool, length } => {
                self.moves = false;
                if self.is_checking() {
                    return Ok(());
                }
                let stored = self.own.set_tool_length(*tool, *length);
                stored.map(|_| ()).map_err(|status| refused(status.into()))
            }
            Command::Spindle(spindle) => {
                self.see_spindle(spindle);
                // M3 to M5 wait for the end of motion, except with a laser: its power may change in
                // motion.
                self.moves &= self.settings.is_on(Setting::Laser);
                Ok(())
            }
            Command::Dwell(seconds) => {
                self.see_dwell(*seconds);
                self.moves = false;
                Ok(())
            }
            Command::Coolant(_) | Command::StoreOffset { .. } => {
                self.moves = false;
                Ok(())
            }
            Command::Own(call) => {
                self.see_call(call);
                let changes = call.code == TOOL_CHANGE && !self.is_checking();
                self.last.paused |= changes;
                if changes {
                    self.tool = self.interpreter.modal().tool;
                }
                Ok(())
            }
            Command::WorkOffset(_) => {
                if !self.keeps_zero {
                    self.spans.begin();
                }
                Ok(())
            }
            Command::ParkingControl(_) | Command::OverrideControl(_) => Ok(()),
        }
    }

    fn go(&mut self, at: &mut [Coordinate; AXES], travel: &Travel<AXES>, way: Way<'_>) -> Finding {
        let start = std::mem::replace(at, travel.target);
        self.moves |= !self.is_checking();
        self.see_move(&start, travel);
        let kind = match travel.feed {
            Feed::Rapid => StrokeKind::Travel,
            Feed::PerMinute(_) | Feed::InverseTime(_) => {
                let is_laser = self.settings.is_on(Setting::Laser);
                let power = match is_laser && !travel.spindle.cutting {
                    true => 0.0,
                    false => self.power(&travel.spindle),
                };
                self.tooling.feed(&start, &travel.target, power, is_laser)
            }
        };
        if let Way::Arc(arc) = way {
            return self.bend(&start, travel, arc, kind);
        }
        self.draw_to(&travel.target, kind);
        self.check_length(&start, &travel.target)?;
        match way {
            Way::Probe => self
                .check_travel(&travel.target)
                .map_err(|(kind, detail)| match kind {
                    // It may touch before.
                    LineFaultKind::OutOfTravel if !self.settings.is_on(Setting::SoftLimits) => {
                        (LineFaultKind::MayLeaveTravel, detail)
                    }
                    kind => (kind, detail),
                }),
            Way::Straight | Way::Arc(_) => self.check_place(&travel.target),
        }
    }

    /// Notes a move, unless nothing moves.
    fn draw_to(&mut self, target: &[Coordinate; AXES], kind: StrokeKind) {
        if !self.is_checking() {
            self.path.go(mm(target), kind);
        }
    }

    /// The spindle's speed or the laser's power, as a share of full power.
    fn power(&self, spindle: &Spindle) -> f64 {
        let full = self.settings.value(Setting::MaxSpeed).nanos() as f64;
        match spindle.rotation {
            Rotation::Off => 0.0,
            Rotation::Clockwise | Rotation::Counterclockwise => {
                (spindle.speed.nanos() as f64 / full.max(1.0)).clamp(0.0, 1.0)
            }
        }
    }
}

/// X, Y and Z in mm.
fn mm<const AXES: usize>(at: &[Coordinate; AXES]) -> [f64; 3] {
    std::array::from_fn(|axis| at.get(axis).map_or(0.0, |axis| axis.nanos() as f64 * 1e-9))
}
