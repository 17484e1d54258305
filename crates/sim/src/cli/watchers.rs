//! What watches the pins during a run: the step list, the waveform, and what the picture is drawn from.

use super::report::LETTERS;
use crate::clock::{seconds, Cycle};
use crate::observer::{Observer, StepEvent};
use crate::output::picture::{SpeedChart, StrokeKind, Toolpath};
use crate::output::steps_csv::StepsCsv;
use crate::output::vcd::Waveform;
use leadscrew_machine::board::{PlannedMove, PortConfig};
use leadscrew_machine::outputs::spindle::SpindleScale;
use leadscrew_planner::MoveKind;
use leadscrew_stepper::{MotorMask, Power, PowerScale};
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// An output file that could not be made or written.
#[derive(Debug)]
pub(super) struct OutputError {
    path: PathBuf,
    error: io::Error,
}

impl OutputError {
    /// Makes sure that `path` can be written, before the work begins.
    ///
    /// # Errors
    /// Where it cannot.
    pub(super) fn probe(path: &Path) -> Result<(), Self> {
        Self::in_file(path, File::create(path).map(|_| ()))
    }

    /// Names the file that a failure belongs to.
    ///
    /// # Errors
    /// The failure.
    pub(super) fn in_file(path: &Path, result: io::Result<()>) -> Result<(), Self> {
        let path = path.to_owned();
        result.map_err(|error| Self { path, error })
    }
}

impl std::fmt::Display for OutputError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{}: cannot be written: {}",
            self.path.display(),
            self.error
        )
    }
}

impl std::error::Error for OutputError {}

/// A file that is written as the job goes on. After a failure nothing more is written, and the failure is told
/// at the end.
struct Sink<T> {
    path: PathBuf,
    writer: io::Result<T>,
}

impl<T> Sink<T> {
    fn create(
        path: &Path,
        begin: impl FnOnce(BufWriter<File>) -> io::Result<T>,
    ) -> Result<Self, OutputError> {
        let begun = File::create(path).map(BufWriter::new).and_then(begin);
        let path = path.to_owned();
        match begun {
            Ok(writer) => Ok(Self {
                path,
                writer: Ok(writer),
            }),
            Err(error) => Err(OutputError { path, error }),
        }
    }

    fn write(&mut self, write: impl FnOnce(&mut T) -> io::Result<()>) {
        if let Ok(writer) = &mut self.writer {
            if let Err(error) = write(writer) {
                self.writer = Err(error);
            }
        }
    }

    fn finish(self, finish: impl FnOnce(T) -> io::Result<()>) -> Result<(), OutputError> {
        let path = self.path;
        self.writer
            .and_then(finish)
            .map_err(|error| OutputError { path, error })
    }
}

/// Writes the step list as the job goes on.
pub(super) struct StepList {
    sink: Sink<StepsCsv<BufWriter<File>>>,
    scale: SpindleScale,
}

impl StepList {
    /// Creates the file; `scale` turns power back into S units.
    ///
    /// # Errors
    /// Where it cannot be created.
    pub(super) fn create(path: &Path, scale: SpindleScale) -> Result<Self, OutputError> {
        let sink = Sink::create(path, StepsCsv::new)?;
        Ok(Self { sink, scale })
    }

    /// Completes the file.
    ///
    /// # Errors
    /// The first failure since it was created.
    pub(super) fn finish(self) -> Result<(), OutputError> {
        self.sink.finish(StepsCsv::finish)
    }
}

impl Observer for StepList {
    fn step(&mut self, event: &StepEvent) {
        let power_s = f64::from(self.scale.speed(event.power));
        self.sink
            .write(|csv| csv.step(event.cycle.0, event.motors, event.negative, power_s));
    }
}

/// Writes the waveform as the job goes on.
pub(super) struct WaveformFile {
    sink: Sink<Waveform<BufWriter<File>>>,
    port: PortConfig,
    all: MotorMask,
    high: MotorMask,
}

/// Counts of the PWM timer at full power in the waveform.
const PWM_SCALE: PowerScale = PowerScale::new(u16::MAX);

impl WaveformFile {
    /// Creates the file for a machine with `motors` motors.
    ///
    /// # Errors
    /// Where it cannot be created.
    pub(super) fn create(path: &Path, motors: usize) -> Result<Self, OutputError> {
        let names = &LETTERS[..motors.min(LETTERS.len())];
        let sink = Sink::create(path, |out| Waveform::new(out, names))?;
        Ok(Self {
            sink,
            port: PortConfig::default(),
            all: (0..motors).fold(MotorMask::NONE, |all, m| all.with(MotorMask::only(m))),
            high: MotorMask::NONE,
        })
    }

    /// Completes the file.
    ///
    /// # Errors
    /// The first failure since it was created.
    pub(super) fn finish(self) -> Result<(), OutputError> {
        self.sink.finish(Waveform::finish)
    }
}

/// The levels of pins of which those in `invert` are low where `active` says so.
fn levels(active: MotorMask, invert: MotorMask) -> MotorMask {
    MotorMask::from_bits(active.bits() ^ invert.bits())
}

impl Observer for WaveformFile {
    fn step(&mut self, event: &StepEvent) {
        self.high = self.high.with(event.motors);
        let pins = levels(self.high, self.port.step_invert);
        self.sink
            .write(|vcd| vcd.step(event.cycle.0, event.motors, pins));
    }

    fn pulse_end(&mut self, cycle: Cycle) {
        let ended = std::mem::take(&mut self.high);
        let pins = levels(self.high, self.port.step_invert);
        self.sink.write(|vcd| vcd.step(cycle.0, ended, pins));
    }

    fn direction(&mut self, cycle: Cycle, negative: MotorMask) {
        let (all, pins) = (self.all, levels(negative, self.port.direction_invert));
        self.sink.write(|vcd| vcd.direction(cycle.0, all, pins));
    }

    fn power(&mut self, cycle: Cycle, power: Power) {
        self.sink
            .write(|vcd| vcd.pwm(cycle.0, power.level(PWM_SCALE) as u16));
    }

    fn motors_enabled(&mut self, cycle: Cycle, on: bool) {
        let high = on == self.port.enable_invert;
        self.sink.write(|vcd| vcd.enable(cycle.0, high));
    }

    fn configured(&mut self, cycle: Cycle, port: &PortConfig) {
        self.port = *port;
        let (all, pins) = (self.all, levels(self.high, port.step_invert));
        self.sink.write(|vcd| vcd.step(cycle.0, all, pins));
    }
}

/// Collects the toolpath, and the speed where a picture is wanted.
pub(super) struct Sketch {
    /// Where the tool goes.
    pub(super) path: Toolpath,
    /// How fast it goes.
    pub(super) speed: Option<SpeedChart>,
    mm_per_step: Vec<f64>,
}

impl Sketch {
    /// Starts at the origin; `mm_per_step` of each motor. Without a picture, only distances are kept.
    pub(super) fn new(mm_per_step: Vec<f64>, picture: bool) -> Self {
        Self {
            path: Toolpath::new([0.0; 3], picture),
            speed: picture.then(SpeedChart::default),
            mm_per_step,
        }
    }
}

impl Observer for Sketch {
    fn step(&mut self, event: &StepEvent) {
        let Some(speed) = &mut self.speed else {
            return;
        };
        let way = |motor: usize| match self.mm_per_step.get(motor) {
            Some(mm) if event.motors.contains(motor) => *mm,
            Some(_) | None => 0.0,
        };
        speed.went(seconds(event.cycle - Cycle::ZERO), [way(0), way(1), way(2)]);
    }

    fn move_planned(&mut self, planned: &PlannedMove<'_>) {
        let mm = |axis: usize| {
            planned
                .target
                .get(axis)
                .map_or(0.0, |c| c.nanos() as f64 * 1e-9)
        };
        let kind = match planned.kind {
            MoveKind::Feed => StrokeKind::cut(planned.power.share().to_num()),
            MoveKind::Rapid | MoveKind::Jog | MoveKind::System => StrokeKind::Travel,
        };
        self.path.go([mm(0), mm(1), mm(2)], kind);
    }
}
