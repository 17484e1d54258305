//! Makes the board's module and the linker's memory of its file, and says how much is logged.
//!
//! `LEADSCREW_BOARD` names the board: one of `crates/boards`, or a file (`cargo fw --board`). Without it, it is the Discovery.
//! `LEADSCREW_MACHINE` names a machine's file (`cargo fw --machine`). Without it, the board's file has axes and first settings.
mod extensions;
mod machine;

use leadscrew_boards::{Board, BOARDS};
use leadscrew_sim::profile::Profile;
use std::{
    env,
    error::Error,
    fs,
    path::{Path, PathBuf},
};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=memory");
    println!("cargo:rerun-if-env-changed=LEADSCREW_BOARD");
    println!("cargo:rerun-if-env-changed=LEADSCREW_MACHINE");
    println!("cargo:rustc-check-cfg=cfg(heaters, outputs, tool_switches)");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    // Unless it is named, defmt builds nothing in but errors.
    println!("cargo:rerun-if-env-changed=DEFMT_LOG");
    let level = env::var("DEFMT_LOG").unwrap_or_else(|_| "info".into());
    println!("cargo:rustc-env=DEFMT_LOG={level}");
    let board = board()?;
    let (board, machine) = match env::var("LEADSCREW_MACHINE") {
        Err(_) => (board.bare(), board.machine_module()),
        Ok(file) => for_machine(&board, Path::new(&file))?,
    };
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out.join("board.rs"), machine + &board.pins_module())?;
    let memory = board.memory() + &fs::read_to_string("memory/fast.x")?;
    fs::write(out.join("memory.x"), memory)?;
    println!("cargo:rustc-link-search={}", out.display());
    Ok(())
}

/// The board that was asked for, with nothing wrong about it.
fn board() -> Result<Board, Box<dyn Error>> {
    let asked = env::var("LEADSCREW_BOARD").unwrap_or_else(|_| "discovery".into());
    let text = match BOARDS.iter().find(|(name, _)| *name == asked) {
        Some((_, text)) => (*text).to_owned(),
        None => {
            println!("cargo:rerun-if-changed={asked}");
            fs::read_to_string(&asked).map_err(|error| format!("{asked}: {error}"))?
        }
    };
    let board = Board::read(&text).map_err(|error| format!("{asked}: {error}"))?;
    let findings: Vec<String> = board
        .check()
        .iter()
        .map(|one| format!("{asked}: {one}"))
        .collect();
    match findings.is_empty() {
        true => Ok(board),
        false => Err(findings.join("\n").into()),
    }
}

/// The board with the sockets that the machine uses, and the machine's module.
fn for_machine(board: &Board, file: &Path) -> Result<(Board, String), Box<dyn Error>> {
    println!("cargo:rerun-if-changed={}", file.display());
    let profile = Profile::load(file)?;
    let unfit = |why: &dyn std::fmt::Display| format!("{}: {why}", file.display());
    if let Some(part) = machine::unknown_part(&profile) {
        return Err(unfit(&format_args!("the firmware has no {part}")).into());
    }
    let board = board
        .fitted(machine::needs(&profile))
        .map_err(|why| unfit(&why))?;
    if let Some(heater) = extensions::blind_sensor(&profile, &board) {
        return Err(unfit(&heater).into());
    }
    let extensions = extensions::all(&profile, &board);
    for cfg in extensions.iter().filter_map(|extension| extension.cfg) {
        println!("cargo:rustc-cfg={cfg}");
    }
    let module = machine::module(&profile, &extensions);
    Ok((board, module))
}
