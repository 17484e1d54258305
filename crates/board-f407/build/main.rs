//! Makes the board's module and the linker's memory map from the board's file, and sets how much is
//! logged.
//!
//! `LEADSCREW_MACHINE` names a machine's file (`cargo fw --machine`). Without it, axes and first
//! settings come from the board's file. `LEADSCREW_BOARD` names the board: one of `crates/boards`,
//! or a file (`cargo fw --board`). Without it, it is the one that the machine's file names, or else
//! the Discovery. With `LEADSCREW_RECORD` (`cargo fw --record`) the image has no pins, and reads
//! them from the board's record.
mod extensions;
mod machine;

use leadscrew_boards::{Board, BOARDS};
use leadscrew_machine_file::Profile;
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
    println!("cargo:rerun-if-env-changed=LEADSCREW_RECORD");
    println!("cargo:rerun-if-env-changed=LEADSCREW_MOTORS");
    println!(
        "cargo:rustc-check-cfg=cfg(captures, four_motors, heaters, outputs, record, tool_switches, windings)"
    );
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    // Unless this variable is set, defmt builds in nothing but errors.
    println!("cargo:rerun-if-env-changed=DEFMT_LOG");
    let level = env::var("DEFMT_LOG").unwrap_or_else(|_| "info".into());
    println!("cargo:rustc-env=DEFMT_LOG={level}");
    let machine = env::var_os("LEADSCREW_MACHINE").map(PathBuf::from);
    let machine = machine.map(|file| Machine::load(&file)).transpose()?;
    let board = board(machine.as_ref())?;
    if env::var_os("LEADSCREW_RECORD").is_some() {
        return for_record(&board, machine.is_some());
    }
    // `cargo xtask thumb` has a limit of its own for machines with many axes.
    let axes = machine.as_ref().map_or(0, |of| of.profile.axis_count());
    let axes = format!("__axes_of_file = {axes};\n");
    let (board, machine) = match &machine {
        None => (board.bare(), board.machine_module()),
        Some(machine) => for_machine(&board, machine)?,
    };
    if !board.captures().is_empty() {
        println!("cargo:rustc-cfg=captures");
    }
    if board.switches_windings() {
        println!("cargo:rustc-cfg=windings");
    }
    write(&(machine + &board.pins_module()), &(board.memory() + &axes))
}

/// Writes the board's module and the linker's memory map to the folder in which the compiler looks
/// for them.
fn write(module: &str, memory: &str) -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out.join("board.rs"), module)?;
    let memory = memory.to_owned() + &fs::read_to_string("memory/fast.x")?;
    fs::write(out.join("memory.x"), memory)?;
    println!("cargo:rustc-link-search={}", out.display());
    Ok(())
}

/// Builds an image that reads its board from a record. It has four motors if `LEADSCREW_MOTORS`
/// asks for them (`cargo fw --record --motors 4`), or if the board's file moves its axes by other
/// than three motors. Otherwise only the start of the board's file counts.
fn for_record(board: &Board, has_machine: bool) -> Result<(), Box<dyn Error>> {
    if has_machine || !board.captures().is_empty() {
        return Err(
            "a machine's file, and a board that captures its own edges, are compiled in: without --record".into(),
        );
    }
    let four = match env::var("LEADSCREW_MOTORS").as_deref() {
        Err(_) => board.machine().kinematics != 0,
        Ok("4") => true,
        Ok(_) => return Err("--motors of an image with a record is 4, or is left out".into()),
    };
    let memory = board
        .record_memory(four)
        .ok_or("the board has no sector for its record, or no room for the program behind it")?;
    println!("cargo:rustc-cfg=record");
    if four {
        println!("cargo:rustc-cfg=four_motors");
    }
    write("", &memory)
}

/// A machine's file.
struct Machine {
    file: PathBuf,
    profile: Profile,
}

impl Machine {
    fn load(file: &Path) -> Result<Self, Box<dyn Error>> {
        println!("cargo:rerun-if-changed={}", file.display());
        let (file, profile) = (file.to_owned(), Profile::load(file)?);
        Ok(Self { file, profile })
    }
}

/// The board that was asked for, or else the one that the machine's file names, or else the
/// Discovery. An error if its file has a mistake.
fn board(machine: Option<&Machine>) -> Result<Board, Box<dyn Error>> {
    let (asked, folder) = match (env::var("LEADSCREW_BOARD"), machine) {
        (Ok(asked), _) => (asked, Path::new("")),
        (Err(_), Some(Machine { file, profile })) if profile.board.is_some() => {
            let folder = file.parent().unwrap_or(Path::new(""));
            (profile.board.clone().unwrap_or_default(), folder)
        }
        (Err(_), _) => ("discovery".to_owned(), Path::new("")),
    };
    if !BOARDS.iter().any(|(name, _)| *name == asked) {
        println!("cargo:rerun-if-changed={}", folder.join(&asked).display());
    }
    let board = Board::find(&asked, folder)?;
    for warning in board.warnings() {
        println!("cargo:warning={asked}: {warning}");
    }
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
fn for_machine(board: &Board, machine: &Machine) -> Result<(Board, String), Box<dyn Error>> {
    if !board.captures().is_empty() {
        return Err("a board that captures its own edges has no machine's file".into());
    }
    let Machine { file, profile } = machine;
    let unfit = |why: &dyn std::fmt::Display| format!("{}: {why}", file.display());
    if profile.fan.fitted && !profile.heaters.is_any() {
        return Err(unfit(&"the firmware has no fan without a heater").into());
    }
    let board = profile.fitted(board).map_err(|why| unfit(&why))?;
    if let Some(heater) = extensions::blind_sensor(profile, &board) {
        return Err(unfit(&heater).into());
    }
    let extensions = extensions::all(profile, &board);
    for cfg in extensions.iter().filter_map(|extension| extension.cfg) {
        println!("cargo:rustc-cfg={cfg}");
    }
    let module = machine::module(profile, &extensions);
    Ok((board, module))
}
