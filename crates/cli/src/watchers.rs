//! The observers of the pins during a run: the step list, the waveform, and the data of the
//! picture.

use crate::steps_csv::StepsCsv;
use crate::vcd::Waveform;
use leadscrew_files::{Output, OutputError, Pen};
use leadscrew_machine::board::PortConfig;
use leadscrew_machine::explain::{Committed, PlannedMove};
use leadscrew_machine::tool::SpindleScale;
use leadscrew_planner::Coordinate;
use leadscrew_sim::clock::Cycle;
use leadscrew_sim::observer::{Observer, StepEvent, Taken};
use leadscrew_sim::scene::{Tooling, Toolpath};
use leadscrew_sim::speed_profile::Recorder;
use leadscrew_stepper::{MotorMask, Power, PowerScale};
use std::io;
use std::path::Path;

/// A file that is written while the job runs. After a failure nothing more is written, and the
/// failure is reported at the end.
struct Sink<T> {
    output: Output,
    writer: io::Result<T>,
}

impl<T> Sink<T> {
    fn create(path: &Path, begin: impl FnOnce(Pen) -> io::Result<T>) -> Result<Self, OutputError> {
        let output = Output::create(path)?;
        let writer = begin(output.pen());
        Ok(Self { output, writer })
    }

    fn write(&mut self, write: impl FnOnce(&mut T) -> io::Result<()>) {
        if let Ok(writer) = &mut self.writer {
            if let Err(error) = write(writer) {
                self.writer = Err(error);
            }
        }
    }

    fn finish(self, finish: impl FnOnce(T) -> io::Result<()>) -> Result<(), OutputError> {
        self.output.complete(self.writer.and_then(finish))
    }
}

/// Writes the step list while the job runs.
pub(super) struct StepList {
    sink: Sink<StepsCsv<Pen>>,
    scale: SpindleScale,
}

impl StepList {
    /// Creates the file; `scale` converts power to S units.
    ///
    /// # Errors
    /// If it cannot be created.
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

/// Writes the waveform while the job runs.
pub(super) struct WaveformFile {
    sink: Sink<Waveform<Pen>>,
    port: PortConfig,
    all: MotorMask,
    high: MotorMask,
}

/// Counts of the PWM timer at full power in the waveform.
const PWM_SCALE: PowerScale = PowerScale::new(u16::MAX);

impl WaveformFile {
    /// Creates the file for a machine with a motor for each letter and `outputs` synchronised
    /// outputs.
    ///
    /// # Errors
    /// If it cannot be created.
    pub(super) fn create(path: &Path, names: &[char], outputs: u8) -> Result<Self, OutputError> {
        let sink = Sink::create(path, |out| Waveform::new(out, names, outputs))?;
        Ok(Self {
            sink,
            port: PortConfig::default(),
            all: (0..names.len()).fold(MotorMask::NONE, |all, m| all.with(MotorMask::only(m))),
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

/// The electrical levels of pins: high for the motors in `active`. The levels of the motors in
/// `invert` are inverted.
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

    fn outputs(&mut self, cycle: Cycle, levels: u8) {
        self.sink.write(|vcd| vcd.outputs(cycle.0, levels));
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

/// The distance that a planned move covers along all axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Way {
    /// [`PlannedMove::line`].
    pub(super) line: u64,
    /// Its length, mm.
    pub(super) mm: f64,
}

/// Collects the toolpath, and the speed if a picture needs it.
pub(super) struct Sketch {
    /// The path of the tool.
    pub(super) path: Toolpath,
    tooling: Tooling,
    /// The recorder of the speed; `None` if it is not needed.
    pub(super) speed: Option<Recorder>,
    /// One entry for each move of the path, except its start.
    pub(super) ways: Vec<Way>,
}

impl Sketch {
    /// Starts at the origin. `recorder` collects the speed. Without `picture` only distances are
    /// kept.
    pub(super) fn new(tooling: Tooling, recorder: Option<Recorder>, picture: bool) -> Self {
        Self {
            tooling,
            path: Toolpath::new([0.0; 3], picture),
            speed: recorder,
            ways: Vec::new(),
        }
    }

    fn measure(&mut self, planned: &PlannedMove<'_>) {
        // The path has moves that the job does not plan: the machine has moved on its own.
        let jumps = self.path.moves().len() - 1 - self.ways.len();
        let line = planned.line.into();
        self.ways
            .extend(std::iter::repeat_n(Way { line, mm: 0.0 }, jumps));
        let ways = planned.begin.iter().zip(planned.target);
        let square: f64 = ways
            .map(|(from, to)| ((to.nanos() - from.nanos()) as f64 * 1e-9).powi(2))
            .sum();
        self.ways.push(Way {
            line,
            mm: square.sqrt(),
        });
    }
}

impl Observer for Sketch {
    fn segments_made(&mut self, segments: u32, committed: &dyn Fn() -> Committed) {
        self.speed.segments_made(segments, committed);
    }

    fn segment_taken(&mut self, cycle: Cycle, taken: Option<&Taken<'_>>) {
        self.speed.segment_taken(cycle, taken);
    }

    fn move_planned(&mut self, planned: &PlannedMove<'_>) {
        self.speed.move_planned(planned);
        let kind = self.tooling.planned(planned);
        self.path.resume_at(mm(planned.begin));
        if self.path.is_drawn() {
            self.measure(planned);
        }
        self.path.line = planned.line;
        self.path.go(mm(planned.target), kind);
    }
}

/// X, Y and Z in mm.
fn mm(place: &[Coordinate]) -> [f64; 3] {
    let of = |axis: &Coordinate| axis.nanos() as f64 * 1e-9;
    std::array::from_fn(|axis| place.get(axis).map_or(0.0, of))
}
