//! The command line.

use super::replay::ReplayArgs;
use super::serve_args::ServeArgs;
use clap::{Args, Parser, Subcommand};
use std::num::NonZeroU32;
use std::path::PathBuf;

/// G-code in, step pulses out: a GRBL-compatible machine, simulated to the cycle.
#[derive(Parser, Debug)]
#[command(name = "leadscrew", version, about, arg_required_else_help = true)]
pub(super) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub(super) command: Command,
}

/// The subcommands.
#[derive(Subcommand, Debug)]
pub(super) enum Command {
    /// Run a G-code file on the simulated machine.
    Run(JobArgs),
    /// Show where the time of a job goes: which limit binds when, and what to change to run it faster.
    Profile(ProfileArgs),
    /// Check a G-code file: report every error in it, move nothing.
    Check(JobArgs),
    /// Be a machine that senders can connect to.
    Serve(ServeArgs),
    /// Hold a recorded conversation with Grbl again, in virtual time, and print what this machine answers.
    Replay(ReplayArgs),
}

/// The machine's settings.
#[derive(Args, Debug)]
pub(super) struct SettingArgs {
    /// A file of settings, lines as `$$` prints them.
    #[arg(long, value_name = "FILE")]
    pub(super) settings: Option<PathBuf>,
    /// One setting, such as '$110=6000'; may be repeated, later ones win.
    #[arg(long = "set", value_name = "$N=VALUE")]
    pub(super) set: Vec<String>,
}

/// Options of `profile`.
#[derive(Args, Debug)]
pub(super) struct ProfileArgs {
    /// The G-code file; `-` reads standard input.
    pub(super) file: String,
    #[command(flatten)]
    pub(super) machine: SettingArgs,
    /// Speed of the serial line in bits per second; without it the line never waits.
    #[arg(long, value_name = "N", value_parser = baud)]
    pub(super) baud: Option<NonZeroU32>,
    /// Draw speed, acceleration, power and what binds along time as an SVG picture.
    #[arg(long, value_name = "FILE")]
    pub(super) svg: Option<PathBuf>,
    /// Write one row of CSV for each stretch in which one limit binds.
    #[arg(long, value_name = "FILE")]
    pub(super) csv: Option<PathBuf>,
    /// Do not run the job again to find out what would make it faster.
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

/// Options of `run` and `check`.
#[derive(Args, Debug)]
pub(super) struct JobArgs {
    /// The G-code file; `-` reads standard input.
    pub(super) file: String,
    #[command(flatten)]
    pub(super) machine: SettingArgs,
    /// Speed of the serial line in bits per second; without it the line never waits.
    #[arg(long, value_name = "N", value_parser = baud)]
    pub(super) baud: Option<NonZeroU32>,
    /// Print the outcome as JSON.
    #[arg(long)]
    pub(super) json: bool,
    /// Draw the toolpath and the speed as an SVG picture.
    #[arg(long, value_name = "FILE")]
    pub(super) svg: Option<PathBuf>,
    /// Write the pins' waveform as VCD (GTKWave opens it).
    #[arg(long, value_name = "FILE")]
    pub(super) vcd: Option<PathBuf>,
    /// Write one row of CSV for each step event.
    #[arg(long, value_name = "FILE")]
    pub(super) steps: Option<PathBuf>,
    /// Go on after an error.
    #[arg(long)]
    pub(super) keep_going: bool,
    /// Print nothing but errors.
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// Slowest and fastest serial line, bits a second.
const BAUD: std::ops::RangeInclusive<u32> = 300..=12_000_000;

pub(super) fn baud(text: &str) -> Result<NonZeroU32, String> {
    let number = text
        .parse()
        .ok()
        .filter(|number: &NonZeroU32| BAUD.contains(&number.get()));
    number.ok_or_else(|| {
        format!(
            "expected bits a second from {} to {}",
            BAUD.start(),
            BAUD.end()
        )
    })
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
