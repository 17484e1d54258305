//! The `leadscrew` program.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    leadscrew_sim::cli::main()
}
