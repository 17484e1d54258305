//! Real senders against `leadscrew serve`: installs them under `target/senders`, then lets each run
//! its jobs.
//!
//! ```text
//!   sender --pty, tcp, ws--> leadscrew serve <--tcp-- Observer      asks for the state every few milliseconds
//!                                 |                      |
//!                              wire log --> verdict <----'          with the sender's own exit code
//! ```
//!
//! The scripts in `tests/senders` drive the senders' own code. What they say is not taken on trust:
//! the verdict is from the bytes on their line and from what a second client has seen the machine
//! do.

mod observer;
mod place;
mod runs;
mod verdict;
mod wire;

use crate::{failure::Failure, shell};
use place::Place;
use runs::{Run, Sender, RUNS};
use std::process::Command;

/// Runs the senders that are named, all where none is.
///
/// # Errors
/// When one cannot be installed, or a run does not end as it should.
pub(crate) fn run_all(names: &[String]) -> Result<(), Failure> {
    let wanted =
        |sender: Sender| names.is_empty() || names.iter().any(|name| name == sender.name());
    let runs: Vec<&Run> = RUNS.iter().filter(|run| wanted(run.sender)).collect();
    let place = Place::new()?;
    shell::run(Command::new("cargo").args(["build", "-p", "leadscrew"]))?;
    if runs.is_empty() {
        return Err(Failure::finding(format!(
            "no sender of these names: {}",
            names.join(" ")
        )));
    }
    if runs.iter().any(|run| run.sender != Sender::Cncjs) {
        place.install_python()?;
    }
    if runs.iter().any(|run| run.sender == Sender::Cncjs) {
        place.install_node()?;
    }
    let failures = runs.iter().filter_map(|run| place.perform(run).err());
    let findings: Vec<String> = failures.map(|failure| failure.to_string()).collect();
    if findings.is_empty() {
        return Ok(());
    }
    Err(Failure::Findings(findings))
}
