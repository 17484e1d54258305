//! Lines that bring a machine from anywhere to a program's place.

use super::standing::{base, Frame, Standing};
use super::Checker;
use leadscrew_gcode::{Letter, Number};
use leadscrew_machine::config::AxisKind;
use leadscrew_machine::extension::{Call, Words};
use leadscrew_machine::interpreter::{
    Distance, FeedMode, Motion, Retract, Rotation, Units, WorkSystem,
};
use leadscrew_machine::settings::table::Setting;
use leadscrew_planner::Coordinate;
use std::fmt;

/// A job to be begun in its middle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ask {
    /// The first line of the job that is run, from 1.
    pub line: u64,
    /// The height at which the tool goes there, Z in work coordinates, mm; without it, as high as
    /// the job has been.
    pub clearance: Option<Coordinate>,
    /// The time that the spindle is given to speed up, s. A beam needs no time.
    pub spin_up: Number,
    /// The job's start, work coordinates (G54), mm; needed by a job that counts from there.
    pub start: Option<[Coordinate; 3]>,
}

/// The reason why a job cannot be begun at a line.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum RestError {
    /// The job has parameters, expressions or O words, whose values only its beginning sets.
    Program,
    /// The job ends at this line.
    NoSuchLine(u64),
    /// The machine refuses a line before it: the complaint.
    Refused(String),
    /// The line goes on with an arc, a canned cycle or a probe, whose words stand in this line.
    GoesOn(u64),
    /// An axis got its place from the place at which the job began.
    FromStart {
        /// The axis's letter.
        axis: char,
        /// The line.
        line: u64,
    },
    /// An axis got its place in this line, in a way that only the machine of then knew.
    Lost {
        /// The axis's letter.
        axis: char,
        /// The line.
        line: u64,
    },
}

impl fmt::Display for RestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Program => f.write_str(
                "the job is a program (docs/programs.md): it can only be run from its beginning",
            ),
            Self::NoSuchLine(lines) => write!(f, "the job has {lines} lines"),
            Self::Refused(complaint) => {
                write!(f, "a line before it is refused: mend it first\n{complaint}")
            }
            Self::GoesOn(line) => write!(
                f,
                "the line goes on with the motion of line {line}: begin at line {line}"
            ),
            Self::FromStart { axis, line } => write!(
                f,
                "line {line} counts {axis} from where the job began: name that place with --start X,Y,Z"
            ),
            Self::Lost { axis, line } => write!(
                f,
                "only that run knew the place of {axis} since line {line}: begin at that line or before, or behind the next absolute {axis}"
            ),
        }
    }
}

impl std::error::Error for RestError {}

/// The axis along which the tool goes up and down: Z.
const TOOL: usize = 2;

impl<const AXES: usize> Checker<AXES> {
    /// Lines that bring a machine from anywhere to the program's place.
    pub(super) fn lines_to_here(&self, ask: &Ask) -> Result<Vec<String>, RestError> {
        let Some(standing) = &self.standing else {
            return Ok(Vec::new());
        };
        self.check_known(standing)?;
        let modal = self.interpreter.modal();
        let is_laser = self.settings.is_on(Setting::Laser);
        let mut lines = vec!["G21 G90 G94 G17 G80".to_owned()];
        // What the program does not set counts as it did for the program's beginning.
        lines.extend(standing.sets.length.then(|| "G49".to_owned()));
        lines.extend(standing.sets.shift.then(|| "G92.1".to_owned()));
        if let Some(tool) = standing.tool {
            lines.push(format!("(tool T{tool})"));
        }
        lines.extend(self.up(standing, ask));
        lines.extend(
            standing
                .calls
                .iter()
                .filter(|call| call.code != super::TOOL_CHANGE)
                .map(words_of),
        );
        if !is_laser && modal.rotation != Rotation::Off {
            lines.push(format!("{} S{}", modal.rotation, modal.speed));
            if ask.spin_up > Number::from_int(0) {
                lines.push(format!("G4 P{}", ask.spin_up));
            }
        }
        if modal.coolant != Default::default() {
            lines.push(modal.coolant.to_string());
        }
        lines.extend(self.over(standing));
        lines.extend(self.down(standing));
        lines.extend(standing.sets.system.then(|| modal.system.to_string()));
        lines.extend(self.offsets());
        lines.push(self.modes(is_laser));
        Ok(lines)
    }

    /// The line whose motion goes on, if it is one that only its own words begin.
    pub(super) fn line_of_motion(&self) -> Option<u64> {
        let standing = self.standing.as_ref()?;
        match self.interpreter.modal().motion {
            Motion::Arc(_) | Motion::Cycle(_) | Motion::Probe(_) => Some(standing.motion_line),
            Motion::Rapid | Motion::Feed | Motion::Cancelled => None,
        }
    }

    /// Checks that each axis can be found again. Filament gets its coordinate where it is.
    fn check_known(&self, standing: &Standing<AXES>) -> Result<(), RestError> {
        for (index, axis) in self.letters.iter().copied().enumerate().take(AXES) {
            let lost = match standing.frames[index] {
                Frame::Lost(loss) => Some(loss),
                Frame::Untouched | Frame::Work(_) | Frame::Machine | Frame::Stored(_) => None,
            };
            let lost = lost.or(standing.g92_lost[index]);
            let Some(loss) = lost.filter(|_| self.config.axes[index] != AxisKind::Extruder) else {
                continue;
            };
            let line = loss.line;
            return Err(match loss.from_start {
                true => RestError::FromStart { axis, line },
                false => RestError::Lost { axis, line },
            });
        }
        Ok(())
    }

    /// The tool goes up, as high as the program has been or as it is asked for.
    fn up(&self, standing: &Standing<AXES>, ask: &Ask) -> Option<String> {
        match standing.frames.get(TOOL)? {
            Frame::Untouched | Frame::Lost(_) => {
                let system = standing.system(WorkSystem::default());
                ask.clearance.map(|z| format!("{system}G0 Z{}", number(z)))
            }
            Frame::Work(system) => {
                let z = ask.clearance.or(standing.highest)?;
                Some(format!("{}G0 Z{}", standing.system(*system), number(z)))
            }
            Frame::Machine => Some(format!("G53 G0 Z{}", number(self.at(TOOL)))),
            Frame::Stored(code) => Some(format!("G91 G{code} Z0")),
        }
    }

    /// The tool goes over its place: axes by the words that brought them there.
    fn over(&self, standing: &Standing<AXES>) -> Vec<String> {
        let axes =
            (0..AXES).filter(|axis| *axis != TOOL && self.config.axes[*axis] != AxisKind::Extruder);
        let axes: Vec<usize> = axes.collect();
        let by = |frame: Frame| {
            let axes = axes
                .iter()
                .filter(move |axis| standing.frames[**axis] == frame);
            let words: Vec<String> = axes.map(|axis| self.word(standing, *axis)).collect();
            (!words.is_empty()).then(|| words.join(" "))
        };
        let mut lines = Vec::new();
        for code in [28, 30] {
            lines.extend(by(Frame::Stored(code)).map(|words| format!("G91 G{code} {words}")));
        }
        lines.push("G90".to_owned());
        lines.extend(by(Frame::Machine).map(|words| format!("G53 G0 {words}")));
        for system in WorkSystem::ALL {
            let name = standing.system(system);
            lines.extend(by(Frame::Work(system)).map(|words| format!("{name}G0 {words}")));
        }
        lines
    }

    /// The word that brings an axis to its place, by its frame.
    fn word(&self, standing: &Standing<AXES>, axis: usize) -> String {
        let place = match standing.frames[axis] {
            Frame::Machine => self.at(axis),
            Frame::Work(_) => base(&self.interpreter, &standing.frames, axis).unwrap_or_default(),
            Frame::Stored(_) | Frame::Untouched | Frame::Lost(_) => Coordinate::ZERO,
        };
        format!("{}{}", self.letters[axis], number(place))
    }

    /// The tool goes down to its place, at the program's feed if it has one.
    fn down(&self, standing: &Standing<AXES>) -> Option<String> {
        let Frame::Work(system) = *standing.frames.get(TOOL)? else {
            return None;
        };
        let word = self.word(standing, TOOL);
        let system = standing.system(system);
        Some(match self.feed() {
            Some(feed) => format!("{system}G1 {word} F{feed}"),
            None => format!("{system}G0 {word}"),
        })
    }

    /// The feed in force, mm/min.
    fn feed(&self) -> Option<Number> {
        let modal = self.interpreter.modal();
        let feed = Some(modal.feed).filter(|feed| *feed > Number::from_int(0));
        feed.filter(|_| modal.feed_mode == FeedMode::PerMinute)
    }

    /// G92 and tool length, which a reset has forgotten.
    fn offsets(&self) -> Vec<String> {
        let offsets = self.interpreter.offsets();
        let mut lines = Vec::new();
        if offsets.tool_length() != Coordinate::ZERO {
            lines.push(format!("G43.1 Z{}", number(offsets.tool_length())));
        }
        let zero = self.interpreter.work_offset();
        let shifted = (0..AXES).filter(|axis| {
            offsets.g92()[*axis] != Coordinate::ZERO
                || self.config.axes[*axis] == AxisKind::Extruder
        });
        let words: Vec<String> = shifted
            .map(|axis| {
                format!(
                    "{}{}",
                    self.letters[axis],
                    number(self.at(axis) - zero[axis])
                )
            })
            .collect();
        if !words.is_empty() {
            lines.push(format!("G92 {}", words.join(" ")));
        }
        lines
    }

    /// The modes that the next line finds.
    fn modes(&self, is_laser: bool) -> String {
        let modal = self.interpreter.modal();
        let mut words = vec![modal.plane.to_string(), modal.distance.to_string()];
        match modal.motion {
            Motion::Rapid => words.push("G0".to_owned()),
            Motion::Feed => words.push("G1".to_owned()),
            // These take their motion from the next line.
            Motion::Arc(_) | Motion::Probe(_) | Motion::Cycle(_) | Motion::Cancelled => {
                words.push("G80".to_owned())
            }
        }
        if modal.retract != Retract::default() {
            words.push("G99".to_owned());
        }
        words.extend(self.feed().map(|feed| format!("F{feed}")));
        if modal.feed_mode == FeedMode::InverseTime {
            // G1 beside G93 needs an F, which counts for this line alone.
            words.push(format!("G93 F{}", modal.feed));
        }
        if is_laser && modal.rotation != Rotation::Off {
            words.push(modal.rotation.to_string());
        }
        words.push(format!("S{}", modal.speed));
        let mut line = words.join(" ");
        // F counts in the units of its line.
        if modal.units == Units::Inches {
            line.push_str("\nG20");
        }
        if let Some(extrusion) = modal.extrusion {
            line.push_str(match extrusion {
                Distance::Absolute => "\nM82",
                Distance::Incremental => "\nM83",
            });
        }
        line
    }

    fn at(&self, axis: usize) -> Coordinate {
        self.interpreter
            .position()
            .get(axis)
            .copied()
            .unwrap_or_default()
    }
}

/// A coordinate as a word's number, mm or degrees.
fn number(at: Coordinate) -> Number {
    Number::from_nanos(at.nanos())
}

/// An extension's M code with its words.
fn words_of(call: &Call) -> String {
    let words = Words::LETTERS.iter().filter_map(|letter| {
        let value = call.words.get(*letter)?;
        (*letter != Letter::T).then(|| format!(" {}{value}", letter.as_char()))
    });
    format!("M{}{}", call.code, words.collect::<String>())
}
