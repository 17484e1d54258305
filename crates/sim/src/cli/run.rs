//! `leadscrew run`: streams a file through the machine's own serial protocol and tells what came of it.

use super::args::JobArgs;
use super::check::Checker;
use super::complaint::{Complaint, Fault};
use super::input::{self, Job};
use super::report::Report;
use super::setting_args::{as_defaults, settings, AXES};
use super::watchers::{OutputError, Sketch, StepList, WaveformFile};
use super::{unusable, Unusable};
use crate::clock::Cycle;
use crate::event_loop::{Simulation, Stopped};
use crate::link::{Host, Rate};
use crate::observer::Observer;
use crate::output::picture::{draw, Caption};
use crate::setup::{Memory, Setup};
use crate::streamer::{Replies, Reply, Streamer, Streaming};
use indicatif::{ProgressBar, ProgressStyle};
use leadscrew_machine::board::ChannelId;
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::machine::LineFault;
use leadscrew_machine::outputs::spindle::SpindleScale;
use leadscrew_machine::protocol::alarm::Alarm;
use leadscrew_machine::protocol::line_reader::raw_column;
use leadscrew_machine::protocol::status::Status;
use leadscrew_machine::settings::table::{AxisSetting, Setting};
use leadscrew_machine::settings::values::Settings;
use leadscrew_machine::state::State;
use leadscrew_planner::Cartesian;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{self, BufRead, IsTerminal};
use std::rc::Rc;
use std::time::Instant;

/// Moves planned ahead, as on the board.
const MOVES: usize = 1024;

/// Errors that are kept in full.
const KEPT_ERRORS: usize = 100;

/// Runs the job; answers whether it met neither an error nor an alarm.
///
/// # Errors
/// Where an option or the input cannot be used, or an output not be written.
pub(super) fn run(args: &JobArgs) -> Result<bool, Unusable> {
    let begin = Instant::now();
    let mut config = MachineConfig::<AXES>::new();
    let settings = settings(args, &config)?;
    config.defaults = as_defaults(&settings);
    let job = input::open(&args.file).map_err(unusable)?;
    let outputs = Outputs::create(args, &settings).map_err(unusable)?;
    let mut report = simulate(args, &config, &settings, job, outputs)?;
    report.wall_seconds = begin.elapsed().as_secs_f64();
    tell(args, &report);
    Ok(report.is_clean())
}

/// All that watches a run.
struct Outputs {
    steps: Option<StepList>,
    vcd: Option<WaveformFile>,
    sketch: Sketch,
}

impl Outputs {
    fn create(args: &JobArgs, settings: &Settings<AXES>) -> Result<Self, OutputError> {
        let scale = SpindleScale {
            max: settings.value(Setting::MaxSpeed).to_f32(),
            min: settings.value(Setting::MinSpeed).to_f32(),
        };
        let steps = args
            .steps
            .as_deref()
            .map(|path| StepList::create(path, scale))
            .transpose()?;
        let vcd = args
            .vcd
            .as_deref()
            .map(|path| WaveformFile::create(path, AXES))
            .transpose()?;
        if let Some(path) = &args.svg {
            OutputError::probe(path)?;
        }
        let mm_per_step = steps_per_mm(settings).map(f64::recip).to_vec();
        Ok(Self {
            steps,
            vcd,
            sketch: Sketch::new(mm_per_step, args.svg.is_some()),
        })
    }
}

fn steps_per_mm(settings: &Settings<AXES>) -> [f64; AXES] {
    settings
        .axes(AxisSetting::StepsPerMm)
        .map(|steps| steps.nanos() as f64 / 1e9)
}

/// Faults that the machine has found and not yet answered, in order: an answer has no column.
type Faults = Rc<RefCell<VecDeque<LineFault>>>;

/// Collects the faults.
struct FaultWatch(Faults);

impl Observer for FaultWatch {
    fn refused(&mut self, _: Cycle, fault: &LineFault) {
        self.0.borrow_mut().push_back(*fault);
    }
}

fn simulate(
    args: &JobArgs,
    config: &MachineConfig<AXES>,
    settings: &Settings<AXES>,
    job: Job,
    outputs: Outputs,
) -> Result<Report<AXES>, Unusable> {
    let rate = args.baud.map_or(Rate::NeverWaits, Rate::Baud);
    let setup = Setup::new(*config, rate);
    let window = setup.receive_buffer;
    let mut memory = Memory::new(&setup);
    let faults = Faults::default();
    let watch = FaultWatch(Rc::clone(&faults));
    let files = (outputs.steps, outputs.vcd);
    let observer = ((files, outputs.sketch), watch);
    let mut simulation: Simulation<'_, _, _, AXES, AXES, MOVES> =
        Simulation::new(&mut memory, &setup, Cartesian, observer);

    let bar = progress_bar(args, job.size);
    let checker = (!args.keep_going).then(|| Checker::new(&job.name, *config, settings.clone()));
    let complaints = Complaints::new(&job.name, faults, checker, args.quiet);
    let streaming = Streaming {
        window,
        keep_going: args.keep_going,
    };
    let text = io::BufReader::new(bar.wrap_read(job.text));
    let mut operator = Operator::new(Streamer::new(text, streaming, complaints));
    if settings.is_on(Setting::Homing) {
        operator.say(b"$X\n");
    }
    operate(&mut simulation, &mut operator);
    bar.finish_and_clear();

    let lines = operator.streamer.lines();
    let complaints = operator
        .streamer
        .finish()
        .map_err(|error| unusable(format!("{}: cannot be read: {error}", job.name)))?;
    let (outcome, (((steps, vcd), sketch), _)) = simulation.finish();
    if let Some(steps) = steps {
        steps.finish().map_err(unusable)?;
    }
    if let Some(vcd) = vcd {
        vcd.finish().map_err(unusable)?;
    }
    let report = Report {
        file: job.name,
        lines,
        errors: complaints.errors,
        error_count: complaints.count,
        alarm: complaints.alarm,
        outcome,
        steps_per_mm: steps_per_mm(settings),
        cut_mm: sketch.path.cut_mm(),
        travel_mm: sketch.path.travel_mm(),
        baud: args.baud,
        wall_seconds: 0.0,
    };
    draw_picture(args, settings, &sketch, &report).map_err(unusable)?;
    Ok(report)
}

/// Lets the machine work until the program is done and motion rests. A program pause (M0) is resumed at once: nobody
/// stands at this machine.
fn operate<O: Observer, F: Replies, R: BufRead>(
    simulation: &mut Simulation<'_, Cartesian, O, AXES, AXES, MOVES>,
    operator: &mut Operator<R, F>,
) {
    loop {
        let going = |operator: &Operator<R, F>| !operator.is_done();
        match simulation.run_while(operator, Cycle::NEVER, going) {
            Stopped::Quiet if matches!(simulation.machine().state(), State::Hold(_)) => {
                operator.say(b"~");
            }
            Stopped::Quiet | Stopped::Reached | Stopped::Condition => break,
        }
    }
    simulation.run_until(operator, Cycle::NEVER);
}

/// Who sends: a program, and now and then a word in between.
struct Operator<R, F> {
    streamer: Streamer<R, F>,
    words: VecDeque<u8>,
    /// Answers to the operator's own lines that are still to come: not the program's.
    own_answers: usize,
    answer: Vec<u8>,
}

impl<R: BufRead, F: Replies> Operator<R, F> {
    fn new(streamer: Streamer<R, F>) -> Self {
        Self {
            streamer,
            words: VecDeque::new(),
            own_answers: 0,
            answer: Vec::new(),
        }
    }

    fn say(&mut self, words: &[u8]) {
        self.own_answers += words.iter().filter(|byte| **byte == b'\n').count();
        self.words.extend(words);
    }

    fn is_done(&self) -> bool {
        self.words.is_empty() && self.own_answers == 0 && self.streamer.is_done()
    }
}

impl<R: BufRead, F: Replies> Host for Operator<R, F> {
    fn next_byte(&mut self, channel: ChannelId) -> Option<u8> {
        let word = self.words.pop_front();
        word.or_else(|| self.streamer.next_byte(channel))
    }

    fn receive(&mut self, channel: ChannelId, byte: u8, now: Cycle) {
        if self.own_answers == 0 {
            return self.streamer.receive(channel, byte, now);
        }
        if byte != b'\n' {
            return self.answer.push(byte);
        }
        if self.answer.starts_with(b"ok") || self.answer.starts_with(b"error") {
            self.own_answers -= 1;
        }
        self.answer.clear();
    }
}

/// Turns refusals into complaints, and prints each as it comes.
struct Complaints {
    file: String,
    faults: Faults,
    /// Reads ahead of the machine, so that nothing is sent after the first line that it will refuse.
    checker: Option<Checker>,
    errors: Vec<Complaint>,
    count: u64,
    alarm: Option<Complaint>,
    quiet: bool,
}

impl Complaints {
    fn new(file: &str, faults: Faults, checker: Option<Checker>, quiet: bool) -> Self {
        Self {
            file: file.to_owned(),
            faults,
            checker,
            errors: Vec::new(),
            count: 0,
            alarm: None,
            quiet,
        }
    }

    fn complaint(&self, line: u64, column: Option<usize>, fault: Fault, text: &[u8]) -> Complaint {
        Complaint {
            file: self.file.clone(),
            line,
            column,
            fault,
            text: String::from_utf8_lossy(text).into_owned(),
            detail: None,
        }
    }

    fn refused(&mut self, line: u64, code: u8, text: &[u8]) {
        let fault = self.faults.borrow_mut().pop_front();
        let status = fault
            .map(|fault| fault.status)
            .or_else(|| Status::from_number(code));
        let Some(status) = status else { return };
        let column = fault.map(|fault| raw_column(text, fault.column));
        let complaint = self.complaint(line, column, Fault::Error(status), text);
        self.count += 1;
        if self.errors.len() < KEPT_ERRORS {
            eprintln!("{complaint}");
            self.errors.push(complaint);
        } else if self.count == KEPT_ERRORS as u64 + 1 && !self.quiet {
            eprintln!("leadscrew: further errors are counted, not shown");
        }
    }
}

impl Replies for Complaints {
    fn reply(&mut self, reply: &Reply<'_>, _: Cycle) {
        match *reply {
            Reply::Error { line, code, text } => self.refused(line, code, text),
            Reply::Alarm { code, line, text } => {
                let Some(alarm) = Alarm::from_number(code) else {
                    return;
                };
                let complaint = self.complaint(line, None, Fault::Alarm(alarm), text);
                eprintln!("{complaint}");
                self.alarm.get_or_insert(complaint);
            }
            Reply::Ok { .. } | Reply::Other(_) => {}
        }
    }

    fn is_last(&mut self, line: &[u8]) -> bool {
        self.checker
            .as_mut()
            .is_some_and(|checker| checker.refuses(line))
    }
}

/// A bar with the time left, on a terminal; otherwise one that is not seen.
fn progress_bar(args: &JobArgs, size: Option<u64>) -> ProgressBar {
    if args.quiet || !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = match size {
        Some(size) => ProgressBar::new(size),
        None => ProgressBar::new_spinner(),
    };
    let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {eta} left");
    match style {
        Ok(style) if size.is_some() => bar.with_style(style),
        Ok(_) | Err(_) => bar,
    }
}

fn draw_picture(
    args: &JobArgs,
    settings: &Settings<AXES>,
    sketch: &Sketch,
    report: &Report<AXES>,
) -> Result<(), OutputError> {
    let (Some(path), Some(speed)) = (&args.svg, &sketch.speed) else {
        return Ok(());
    };
    let caption = Caption {
        title: report.title(),
        summary: report.caption(),
        full_power_s: f64::from(settings.value(Setting::MaxSpeed).to_f32()),
    };
    OutputError::in_file(path, svg::save(path, &draw(&sketch.path, speed, &caption)))
}

fn tell(args: &JobArgs, report: &Report<AXES>) {
    if args.json {
        println!("{}", report.json());
    } else if !args.quiet {
        print!("{report}");
    }
}
