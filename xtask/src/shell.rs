//! Runs other programs.
use crate::failure::Failure;
use std::{
    io,
    process::{Command, ExitStatus, Output},
};

/// Runs a command with our own standard streams.
///
/// # Errors
/// When it cannot be started or does not succeed.
pub(crate) fn run(command: &mut Command) -> Result<(), Failure> {
    let status = command.status().map_err(not_started(command))?;
    check(command, status, String::new())
}

/// Runs a command and returns its standard output.
///
/// # Errors
/// When it cannot be started or does not succeed; the error has its standard error.
pub(crate) fn output(command: &mut Command) -> Result<String, Failure> {
    succeed(command).map(|output| String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Runs a command and returns its standard error.
///
/// # Errors
/// When it cannot be started or does not succeed; the error has its standard error.
pub(crate) fn error_output(command: &mut Command) -> Result<String, Failure> {
    succeed(command).map(|output| String::from_utf8_lossy(&output.stderr).into_owned())
}

fn succeed(command: &mut Command) -> Result<Output, Failure> {
    let output = command.output().map_err(not_started(command))?;
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    check(command, output.status, words)?;
    Ok(output)
}

fn check(command: &Command, status: ExitStatus, words: String) -> Result<(), Failure> {
    if status.success() {
        return Ok(());
    }
    let program = name(command);
    Err(Failure::NotDone {
        program,
        status,
        words,
    })
}

fn not_started(command: &Command) -> impl FnOnce(io::Error) -> Failure {
    let program = name(command);
    move |error| Failure::NotStarted { program, error }
}

fn name(command: &Command) -> String {
    command.get_program().to_string_lossy().into_owned()
}
