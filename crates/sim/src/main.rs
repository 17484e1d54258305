//! The `leadscrew` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    leadscrew_sim::cli::main()
}
