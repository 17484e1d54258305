//! `leadscrew serve`: a virtual machine on lines that senders can open, until Ctrl-C.

use super::serve_args::ServeArgs;
use super::{unusable, Unusable};
use leadscrew_files::spare;
use leadscrew_machine::config::CHANNELS;
use leadscrew_serve::{
    serve, Allowed, NoStateFile, Plain, Screen, Service, StateFile, Surroundings, WireLog,
};
use leadscrew_sim::link::Rate;
use leadscrew_sim::profile::{Profile, ProfileError};
use std::fmt;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// The axes of the largest machine that is served.
const MOST_SERVED: usize = 4;

/// The reason why `serve` cannot begin.
#[derive(Debug)]
pub(super) enum ServeError {
    /// The machine file cannot be used.
    Profile(ProfileError),
    /// More lines than a machine has.
    TooManyLines(usize),
    /// More axes than `serve` can drive.
    TooManyAxes(usize),
    /// The state file's path is no place for one.
    State(NoStateFile),
    /// An output would replace another file.
    Paths(String),
    /// The log cannot be written.
    Log(PathBuf, io::Error),
    /// Ctrl-C cannot be caught.
    Signal(ctrlc::Error),
    /// The terminal cannot be used.
    Terminal(io::Error),
}

impl fmt::Display for ServeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Profile(error) => error.fmt(f),
            Self::TooManyLines(count) => {
                write!(f, "{count} lines, but a machine has {CHANNELS} at most")
            }
            Self::TooManyAxes(count) => {
                write!(
                    f,
                    "{count} axes, but serve has machines of {MOST_SERVED} at most"
                )
            }
            Self::State(error) => error.fmt(f),
            Self::Paths(error) => f.write_str(error),
            Self::Log(file, error) => write!(
                f,
                "{}: cannot be written: {error}",
                leadscrew_files::shown(file)
            ),
            Self::Signal(error) => write!(f, "Ctrl-C cannot be caught: {error}"),
            Self::Terminal(error) => write!(f, "the terminal cannot be used: {error}"),
        }
    }
}

impl std::error::Error for ServeError {}

/// True if Ctrl-C was pressed.
static STOP: AtomicBool = AtomicBool::new(false);

/// Serves until Ctrl-C.
pub(super) fn run(args: &ServeArgs) -> Result<bool, Unusable> {
    try_run(args).map(|()| true).map_err(unusable)
}

fn try_run(args: &ServeArgs) -> Result<(), ServeError> {
    let service = service(args)?;
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed)).map_err(ServeError::Signal)?;
    let begun = Instant::now();
    let clock = || begun.elapsed();
    let (clock, stop) = (&clock, &STOP);
    if io::stdout().is_terminal() && io::stdin().is_terminal() {
        let mut screen = Screen::new(&service.profile).map_err(ServeError::Terminal)?;
        serve(
            service,
            Surroundings {
                clock,
                stop,
                panel: &mut screen,
            },
        );
    } else {
        let mut plain = Plain::new(io::stdout());
        serve(
            service,
            Surroundings {
                clock,
                stop,
                panel: &mut plain,
            },
        );
    }
    Ok(())
}

fn service(args: &ServeArgs) -> Result<Service, ServeError> {
    let lines = args.lines();
    if lines.len() > CHANNELS {
        return Err(ServeError::TooManyLines(lines.len()));
    }
    let profile = args.machine.as_deref().map(Profile::load).transpose();
    let profile = profile.map_err(ServeError::Profile)?.unwrap_or_default();
    if profile.axis_count() > MOST_SERVED {
        return Err(ServeError::TooManyAxes(profile.axis_count()));
    }
    let state = args.state_file().map_err(ServeError::State)?;
    let paths = state.as_ref().map(StateFile::path).into_iter();
    let inputs: Vec<&Path> = args.machine.iter().map(PathBuf::as_path).collect();
    spare(&inputs, paths.chain(args.log.as_deref())).map_err(ServeError::Paths)?;
    Ok(Service {
        allowed: allowed(args),
        state,
        rate: args.baud.map_or(Rate::NeverWaits, Rate::Baud),
        speed: args.speed,
        log: args.log.clone().map(open_log).transpose()?,
        profile,
        lines,
    })
}

fn allowed(args: &ServeArgs) -> Allowed {
    let allowed = Allowed::new(args.allow.clone());
    match args.token.clone() {
        Some(token) => allowed.with_token(token),
        None => allowed,
    }
}

fn open_log(file: PathBuf) -> Result<WireLog, ServeError> {
    match leadscrew_files::open_log(&file) {
        Ok(log) => Ok(WireLog::new(log)),
        Err(error) => Err(ServeError::Log(file, error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        serve: ServeArgs,
    }

    #[test]
    fn there_are_no_more_lines_than_a_machine_has() {
        let five = "serve --tcp 1 --tcp 2 --tcp 3 --ws 4 --ws 5".split(' ');
        let args = Line::parse_from(five).serve;
        assert!(matches!(service(&args), Err(ServeError::TooManyLines(5))));
    }
}
