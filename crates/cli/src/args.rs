//! The command line.

use super::align::AlignArgs;
use super::baud::baud;
use super::board::BoardCommand;
use super::calibrate::CalibrateArgs;
use super::import::ImportCommand;
use super::level::LevelArgs;
use super::machine::MachineCommand;
use super::replay::ReplayArgs;
use super::resume::ResumeArgs;
use super::serve_args::ServeArgs;
use super::setting_args::SettingArgs;
use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use leadscrew_jobs::{time, Machine, Time};
use leadscrew_sim::link::Rate;
use leadscrew_sim::oven::HeatFault;
use std::io;
use std::num::NonZeroU32;
use std::path::PathBuf;

/// G-code in, step pulses out: a GRBL-compatible machine, simulated to the cycle.
#[derive(Parser, Debug)]
#[command(name = "leadscrew", version, about, arg_required_else_help = true)]
pub(super) struct Cli {
    /// The command.
    #[command(subcommand)]
    pub(super) command: Command,
}

/// The subcommands.
#[derive(Subcommand, Debug)]
pub(super) enum Command {
    /// Run a G-code file on the simulated machine.
    Run(JobArgs),
    /// Show where the time of a job goes: which limit binds when, and which settings would make it
    /// faster.
    Profile(ProfileArgs),
    /// Check G-code files: report every error in them, and likely mistakes; move nothing.
    Check(CheckArgs),
    /// Run a virtual machine that senders can connect to.
    Serve(ServeArgs),
    /// Replay a recorded conversation with Grbl, in virtual time, and print the answers of this
    /// machine.
    Replay(ReplayArgs),
    /// Convert a file for another machine to a job: drill holes, RP code, engraver rows, a
    /// printer's G-code.
    #[command(subcommand)]
    Import(ImportCommand),
    /// Turn and shift a job onto a board that lies askew.
    Align(AlignArgs),
    /// Bend a job so that its depth follows a surface that is not flat.
    Level(LevelArgs),
    /// Begin a job in its middle: bring the machine to the job's place at a line, then go on
    /// with that line.
    Resume(ResumeArgs),
    /// Work out an axis's steps per mm from a measured move.
    Calibrate(CalibrateArgs),
    /// Print completions for a shell: `leadscrew completions bash >
    /// /etc/bash_completion.d/leadscrew`.
    Completions {
        /// The shell.
        shell: Shell,
    },
    /// Print the manual page: `leadscrew man | man -l -`.
    Man(ManArgs),
    /// Begin a machine file, or print how a machine is wired to its board.
    #[command(subcommand)]
    Machine(MachineCommand),
    /// Boards for the firmware: check a board against its chip, begin a board file, make a board's
    /// record.
    #[command(subcommand)]
    Board(BoardCommand),
    /// Print the JSON schema of the output of --json, or of a machine file.
    Schema {
        /// The document that the schema describes.
        of: Shape,
    },
}

/// The documents that have a JSON schema.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(super) enum Shape {
    /// `leadscrew run --json`
    Run,
    /// `leadscrew check --json`
    Check,
    /// `leadscrew profile --json`
    Profile,
    /// A machine file
    Machine,
}

/// Controllers whose time can stand beside ours.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(super) enum Controller {
    /// Grbl 1.1
    Grbl,
}

impl Controller {
    /// Returns how long a job takes on a machine of this controller; `baud` of its line, if the
    /// user gives one.
    ///
    /// # Errors
    /// If the text cannot be read, which a text in memory always can.
    pub(super) fn time(
        self,
        machine: &Machine,
        baud: Option<NonZeroU32>,
        name: &str,
        text: &[u8],
    ) -> io::Result<Time> {
        match self {
            Self::Grbl => {
                let rate = Rate::Baud(baud.unwrap_or(GRBL_BAUD));
                time(&machine.as_grbl(), rate, name, text)
            }
        }
    }
}

/// The speed of Grbl's line, bits a second.
const GRBL_BAUD: NonZeroU32 = NonZeroU32::new(115_200).unwrap();

/// Options of `man`.
#[derive(Args, Debug)]
pub(super) struct ManArgs {
    /// Write the pages of all commands into this folder.
    #[arg(long, value_name = "FOLDER")]
    pub(super) folder: Option<PathBuf>,
}

/// Options of `profile`.
#[derive(Args, Debug)]
pub(super) struct ProfileArgs {
    /// The G-code file; `-` reads standard input.
    pub(super) file: PathBuf,
    #[command(flatten)]
    pub(super) machine: SettingArgs,
    /// Speed of the serial line in bits per second; without it the line never waits.
    #[arg(long, value_name = "N", value_parser = baud)]
    pub(super) baud: Option<NonZeroU32>,
    /// Draw speed, acceleration, power and the limit in force along time as an SVG picture; `-`
    /// writes to standard output.
    #[arg(long, value_name = "FILE")]
    pub(super) svg: Option<PathBuf>,
    /// Write one row of CSV for each stretch in which one limit binds; `-` writes to standard
    /// output.
    #[arg(long, value_name = "FILE")]
    pub(super) csv: Option<PathBuf>,
    /// With --json: add the time that each line moves the machine.
    #[arg(long, requires = "json")]
    pub(super) line_times: bool,
    /// Do not run the job again to find faster settings.
    #[arg(long)]
    pub(super) no_trials: bool,
    /// Print the outcome as JSON.
    #[arg(long)]
    pub(super) json: bool,
    /// Go on after an error.
    #[arg(long)]
    pub(super) keep_going: bool,
    /// Print nothing but errors.
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// Options of `check`.
#[derive(Args, Debug)]
pub(super) struct CheckArgs {
    /// G-code files, and folders of them; `-` reads standard input.
    #[arg(required = true, value_name = "FILE")]
    pub(super) files: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) machine: SettingArgs,
    /// Work zero in machine coordinates, for example -200,-150,-40: moves that leave the
    /// travel from there are reported, with soft limits or without.
    #[arg(long, value_name = "X,Y,Z", value_parser = origin, allow_hyphen_values = true)]
    pub(super) origin: Option<[f32; 3]>,
    /// Tell how long each job takes, as `run` does, without making its steps.
    #[arg(long)]
    pub(super) time: bool,
    /// Tell how long the job takes on another controller, too: 15 moves planned ahead, its corner
    /// rule, no rows, 128 bytes at 115 200 baud.
    #[arg(long = "as", value_name = "WHAT", requires = "time")]
    pub(super) like: Option<Controller>,
    /// Draw the toolpath as an SVG picture; `-` writes to standard output.
    #[arg(long, value_name = "FILE")]
    pub(super) svg: Option<PathBuf>,
    /// Print the findings as JSON.
    #[arg(long, conflicts_with = "github")]
    pub(super) json: bool,
    /// Print the findings as annotations of a GitHub workflow.
    #[arg(long)]
    pub(super) github: bool,
    /// Print nothing but errors.
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// Options of `run`.
#[derive(Args, Debug)]
pub(super) struct JobArgs {
    /// G-code files, and folders of them, run one after the other; `-` reads standard input.
    #[arg(required = true, value_name = "FILE")]
    pub(super) files: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) machine: SettingArgs,
    /// Speed of the serial line in bits per second; without it the line never waits.
    #[arg(long, value_name = "N", value_parser = baud)]
    pub(super) baud: Option<NonZeroU32>,
    /// Tell how long the job takes on another controller, too: 15 moves planned ahead, its corner
    /// rule, no rows, 128 bytes at 115 200 baud (or --baud).
    #[arg(long = "as", value_name = "WHAT")]
    pub(super) like: Option<Controller>,
    /// How many outputs M62 to M65 switch, 0 to 8; the waveform and the JSON show them. Without it
    /// as many as the machine's file has.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=8))]
    pub(super) outputs: Option<u8>,
    /// Let the first heater fail S seconds after power-up. HOW is a fault of its sensor (open,
    /// shorted, frozen) or of its relay (stuck), or a fault that another controller reports
    /// (external). Example: open@40.
    #[arg(long, value_name = "HOW@S")]
    pub(super) heat_fault: Option<HeatFault>,
    /// Print the outcome as JSON.
    #[arg(long)]
    pub(super) json: bool,
    /// Draw the toolpath and the speed as an SVG picture; `-` writes to standard output.
    #[arg(long, value_name = "FILE")]
    pub(super) svg: Option<PathBuf>,
    /// Write the job as a web page that needs no network: the toolpath, to be zoomed and turned,
    /// and a slider along its time; `-` writes to standard output.
    #[arg(long, value_name = "FILE")]
    pub(super) html: Option<PathBuf>,
    /// Write the pins' waveform as VCD (GTKWave opens it); `-` writes to standard output.
    #[arg(long, value_name = "FILE")]
    pub(super) vcd: Option<PathBuf>,
    /// Write one row of CSV for each step event; `-` writes to standard output.
    #[arg(long, value_name = "FILE")]
    pub(super) steps: Option<PathBuf>,
    /// Go on after an error.
    #[arg(long)]
    pub(super) keep_going: bool,
    /// Print nothing but errors.
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// Reads three coordinates in mm.
fn origin(text: &str) -> Result<[f32; 3], String> {
    let numbers: Option<Vec<f32>> = text
        .split(',')
        .map(|part| part.trim().parse().ok())
        .collect();
    let numbers = numbers.filter(|numbers| numbers.iter().all(|number| number.abs() < 1e5));
    let three = numbers.and_then(|numbers| numbers.try_into().ok());
    three.ok_or_else(|| "expected X,Y,Z in mm, such as -200,-150,-40".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_well_formed() {
        Cli::command().debug_assert();
    }

    #[test]
    fn settings_may_be_repeated() {
        let args = [
            "leadscrew",
            "run",
            "-",
            "--set",
            "$110=6000",
            "--set",
            "$111=6000",
        ];
        let Command::Run(job) = Cli::parse_from(args).command else {
            panic!("not run")
        };
        assert_eq!(job.machine.set, ["$110=6000", "$111=6000"]);
    }
}
