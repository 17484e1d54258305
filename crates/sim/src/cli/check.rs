//! `leadscrew check`: every error of a file in one go, soft limits included; nothing moves.
//!
//! Lines go through the machine's own line reader, interpreter and settings, and no further.

use super::args::JobArgs;
use super::complaint::{Complaint, Fault};
use super::input;
use super::report::check_json;
use super::said::say;
use super::setting_args::{instead, say_capped, settings, AXES};
use super::{unusable, Unusable};
use crate::streamer::Lines;
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::interpreter::{
    ArcShape, Command, Commands, Context, Fault as LineFault, Interpreter, Turn,
};
use leadscrew_machine::protocol::alarm::Alarm;
use leadscrew_machine::protocol::line_reader::{raw_column, LineReader};
use leadscrew_machine::protocol::status::Status;
use leadscrew_machine::protocol::system_command::{Activity, Circumstances, SystemCommand};
use leadscrew_machine::settings::table::{AxisSetting, Setting};
use leadscrew_machine::settings::values::{Entry, Settings};
use leadscrew_machine::soft_limits;
use leadscrew_planner::{Arc, Coordinate, StepsPerMm};
use std::io::BufRead;

/// What a jog begins with.
const JOG: &[u8] = b"$J=";

/// Checks the job; answers whether it has no error.
///
/// # Errors
/// Where an option or the input cannot be used.
pub(super) fn check(args: &JobArgs) -> Result<bool, Unusable> {
    let config = MachineConfig::<AXES>::new();
    let settings = settings(&args.machine, &config)?;
    if !args.quiet {
        say_capped(&settings, &config.step_timing);
    }
    let job = input::open(&args.file).map_err(unusable)?;
    let mut checker = Checker::new(&job.name, config, settings);
    let unreadable = |error| unusable(format!("{}: cannot be read: {error}", args.file));
    let lines = checker.check_all(job.text).map_err(unreadable)?;
    tell(args, &checker, lines)?;
    Ok(checker.count == 0)
}

fn tell(args: &JobArgs, checker: &Checker, lines: u64) -> Result<(), Unusable> {
    if args.json {
        say(check_json(&checker.file, lines, &checker.complaints))
    } else if !args.quiet {
        let verdict = match checker.count {
            0 => "no error".to_owned(),
            1 => "1 error".to_owned(),
            count => format!("{count} errors"),
        };
        say(format!("{}: {lines} lines, {verdict}", checker.file))
    } else {
        Ok(())
    }
}

/// What a line is found to be.
type Finding = Result<(), (LineFaultKind, Option<String>)>;

/// A fault with its column in the filtered line, or a limit without one.
enum LineFaultKind {
    Refused(LineFault),
    OutOfTravel,
}

/// Follows a program line by line without a machine.
pub(super) struct Checker {
    file: String,
    config: MachineConfig<AXES>,
    settings: Settings<AXES>,
    interpreter: Interpreter<AXES>,
    complaints: Vec<Complaint>,
    count: u64,
}

/// Errors that are kept for the JSON output.
const KEPT: usize = 10_000;

impl Checker {
    /// Begins a program called `file` on a machine as it is after power-up.
    pub(super) fn new(file: &str, config: MachineConfig<AXES>, settings: Settings<AXES>) -> Self {
        Self {
            file: file.to_owned(),
            config,
            settings,
            interpreter: Interpreter::new(),
            complaints: Vec::new(),
            count: 0,
        }
    }

    fn check_all(&mut self, text: impl BufRead) -> std::io::Result<u64> {
        let mut lines = Lines::new(text);
        let mut raw = Vec::new();
        while lines.next(&mut raw)? {
            if let Err((kind, detail)) = self.check_line(&raw) {
                self.complain(lines.number(), &raw, &kind, detail);
            }
        }
        Ok(lines.number())
    }

    /// Takes a line; answers whether the machine will refuse it.
    pub(super) fn refuses(&mut self, raw: &[u8]) -> bool {
        match self.check_line(raw) {
            Ok(()) | Err((LineFaultKind::OutOfTravel, _)) => false,
            Err((LineFaultKind::Refused(_), _)) => true,
        }
    }

    fn check_line(&mut self, raw: &[u8]) -> Finding {
        let mut reader = LineReader::<128>::new(self.config.line_length);
        for byte in raw.iter().filter(|byte| byte.is_ascii()) {
            reader.push(*byte);
        }
        let whole = |status| refused(LineFault { status, column: 0 });
        let line = reader.line().map_err(whole)?;
        match line {
            [b'$', b'J', b'=', jog @ ..] => self.check_jog(jog),
            [b'$', ..] => self.check_system(line),
            _ => self.check_program(line),
        }
    }

    fn check_program(&mut self, line: &[u8]) -> Finding {
        let mut commands = Commands::new();
        let start = *self.interpreter.position();
        let reach = self.reach();
        let context = context(&self.config, &self.settings, &reach);
        self.interpreter
            .interpret(line, &context, &mut commands)
            .map_err(refused)?;
        commands
            .iter()
            .try_for_each(|command| self.check_command(&start, command))
    }

    /// Checks where a command goes: an arc along all of its way.
    fn check_command(&self, start: &[Coordinate; AXES], command: &Command<AXES>) -> Finding {
        match command {
            Command::Line(travel) | Command::Probe { travel, .. } => {
                self.check_travel(&travel.target)
            }
            Command::Arc { travel, arc } => self
                .chords(start, &travel.target, arc)
                .try_for_each(|chord| self.check_travel(&chord)),
            Command::Spindle(_)
            | Command::Coolant(_)
            | Command::ParkingControl(_)
            | Command::Dwell(_)
            | Command::StoreOffset { .. }
            | Command::WorkOffset(_)
            | Command::Pause
            | Command::ProgramEnd => Ok(()),
        }
    }

    /// The chords of an arc, as the machine cuts it.
    fn chords(
        &self,
        start: &[Coordinate; AXES],
        target: &[Coordinate; AXES],
        arc: &ArcShape,
    ) -> Arc<AXES> {
        let tolerance = self.settings.value(Setting::ArcTolerance).to_f32();
        let clockwise = arc.turn == Turn::Clockwise;
        Arc::new(
            *start,
            *target,
            arc.centre,
            arc.plane.axes(),
            clockwise,
            tolerance,
        )
    }

    fn check_jog(&mut self, jog: &[u8]) -> Finding {
        let reach = self.reach();
        let context = context(&self.config, &self.settings, &reach);
        let refused = |fault: LineFault| {
            let column = fault.column + JOG.len();
            refused(LineFault { column, ..fault })
        };
        match self.interpreter.jog(jog, &context).map_err(refused)? {
            Some(jog) => {
                let column = JOG.len();
                let refuse = |(_, detail)| {
                    let status = Status::JogOutOfTravel;
                    (LineFaultKind::Refused(LineFault { status, column }), detail)
                };
                self.check_travel(&jog.travel.target).map_err(refuse)?;
                self.interpreter.set_position(jog.travel.target);
                Ok(())
            }
            None => Ok(()),
        }
    }

    fn check_system(&mut self, line: &[u8]) -> Finding {
        let now = Circumstances {
            activity: Activity::Idle,
            homing: self.settings.is_on(Setting::Homing),
            single_axis_homing: self.config.options.single_axis_homing,
        };
        let command = SystemCommand::parse(line, &now).map_err(refused)?;
        if let SystemCommand::Set { number, value } = command {
            let entry = Entry { number, value };
            let timing = &self.config.step_timing;
            if let Err(status) = self.settings.set(entry, timing.limits(AXES)) {
                let fault = command.locate(status.into(), line);
                let words = || instead(&self.settings, timing, number).trim().to_owned();
                let detail = (status == Status::StepRateTooHigh).then(words);
                return Err((LineFaultKind::Refused(fault), detail));
            }
        }
        Ok(())
    }

    /// Whether a target lies within the travel, where soft limits are on.
    fn check_travel(&self, target: &[Coordinate; AXES]) -> Finding {
        if !self.settings.is_on(Setting::SoftLimits) {
            return Ok(());
        }
        let travel = self.travel();
        if soft_limits::allow(target, &travel) {
            return Ok(());
        }
        Err((LineFaultKind::OutOfTravel, Some(beyond(target, &travel))))
    }

    fn travel(&self) -> [Coordinate; AXES] {
        let travel = self.settings.axes(AxisSetting::Travel);
        let reach = self.reach();
        std::array::from_fn(|axis| Coordinate::from_nanos(travel[axis].nanos()).min(reach[axis]))
    }

    /// How far steps can be counted: as the machine itself limits coordinates.
    fn reach(&self) -> [Coordinate; AXES] {
        let steps = self.settings.axes(AxisSetting::StepsPerMm);
        steps.map(|steps| StepsPerMm::from_nanos(steps.nanos()).coordinate(1 << 30))
    }

    fn complain(&mut self, line: u64, raw: &[u8], kind: &LineFaultKind, detail: Option<String>) {
        let (fault, column) = match kind {
            LineFaultKind::Refused(fault) => (
                Fault::Error(fault.status),
                Some(raw_column(raw, fault.column)),
            ),
            LineFaultKind::OutOfTravel => (Fault::Alarm(Alarm::SoftLimit), None),
        };
        let complaint = Complaint {
            file: self.file.clone(),
            line,
            column,
            fault,
            text: String::from_utf8_lossy(raw).into_owned(),
            detail,
        };
        eprintln!("{complaint}");
        self.count += 1;
        if self.complaints.len() < KEPT {
            self.complaints.push(complaint);
        }
    }
}

fn refused(fault: LineFault) -> (LineFaultKind, Option<String>) {
    (LineFaultKind::Refused(fault), None)
}

fn context<'a>(
    config: &'a MachineConfig<AXES>,
    settings: &Settings<AXES>,
    reach: &'a [Coordinate; AXES],
) -> Context<'a, AXES> {
    Context {
        axes: &config.axes,
        options: &config.options,
        laser_mode: settings.is_on(Setting::Laser),
        soft_limits: settings.is_on(Setting::SoftLimits),
        reach,
    }
}

/// Says which axis would leave its travel, and by how much.
fn beyond(target: &[Coordinate; AXES], travel: &[Coordinate; AXES]) -> String {
    let axes = super::report::LETTERS.iter().zip(target.iter().zip(travel));
    let parts: Vec<String> = axes
        .filter(|(_, (at, travel))| **at > Coordinate::ZERO || **at < Coordinate::ZERO - **travel)
        .map(|(name, (at, travel))| {
            format!(
                "{name} would be at {:.3} mm, its travel is {:.3} to 0",
                at.to_mm(),
                -travel.to_mm()
            )
        })
        .collect();
    parts.join("; ")
}
