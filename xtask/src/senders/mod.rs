//! Tests `leadscrew serve` with real senders: installs them under `target/senders`, and lets each
//! run its jobs.
//!
//! ```text
//!   sender --pty, tcp, ws--> leadscrew serve <--tcp-- Observer      asks for the state every few milliseconds
//!                                 |                      |
//!                              wire log --> verdict <----'          with the sender's own exit code
//! ```
//!
//! The scripts in `tests/senders` drive the senders' own code. The verdict does not trust the
//! senders' reports. It comes from the bytes on a sender's line, and from the machine's states that
//! the sender and a second client were told.

mod observer;
mod place;
mod runs;
mod verdict;
mod wire;

use crate::{failure::Failure, shell};
use place::Place;
use runs::{Run, Sender, RUNS};
use std::process::Command;

/// Runs the named senders, or all if none is named.
///
/// # Errors
/// When a sender cannot be installed, or a run does not end as it should.
pub(crate) fn run_all(names: &[String]) -> Result<(), Failure> {
    let wanted =
        |sender: Sender| names.is_empty() || names.iter().any(|name| name == sender.name());
    let runs: Vec<&Run> = RUNS.iter().filter(|run| wanted(run.sender)).collect();
    let place = Place::new()?;
    shell::run(Command::new("cargo").args(["build", "-p", "leadscrew-cli"]))?;
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
