//! `cargo xtask release`: the files that are handed out for each board, with their sums.
//!
//! | file | for |
//! |---|---|
//! | `NAME.elf` | probe-rs: the firmware with its symbols, without what only a debugger wants, which has this computer's paths in it |
//! | `NAME.bin` | dfu-util, a bootloader's memory card: from the board's `start` on |
//! | `SHA256SUMS` | whoever wants to know whether theirs are the same |
use crate::{
    failure::Failure,
    fw, shell,
    toolchain::{self, Toolchain},
};
use leadscrew_boards::BOARDS;
use std::{fs, path::Path, process::Command};

/// Makes the files of the named boards; of all where none is named.
pub(crate) fn run(names: &[String]) -> Result<(), Failure> {
    let toolchain = Toolchain::find()?;
    let folder = toolchain::firmware_dir().join("release");
    fs::create_dir_all(&folder).map_err(Failure::file(&folder))?;
    let wanted = |name: &str| names.is_empty() || names.iter().any(|one| one == name);
    let mut files = Vec::new();
    for (name, _) in BOARDS.iter().filter(|(name, _)| wanted(name)) {
        let elf = fw::build_with(&toolchain, &[], &[(fw::BOARD, *name)])?;
        let (kept, image) = (format!("{name}.elf"), format!("{name}.bin"));
        copy(&["--strip-debug"], &elf, &folder.join(&kept))?;
        copy(
            &["-O", "binary", "--gap-fill", "0xFF"],
            &elf,
            &folder.join(&image),
        )?;
        files.extend([kept, image]);
    }
    let sums = shell::output(Command::new("sha256sum").args(&files).current_dir(&folder))?;
    let path = folder.join("SHA256SUMS");
    fs::write(&path, &sums).map_err(Failure::file(&path))?;
    println!("{}\n{sums}", folder.display());
    Ok(())
}

fn copy(options: &[&str], from: &Path, to: &Path) -> Result<(), Failure> {
    let mut objcopy = Command::new("arm-none-eabi-objcopy");
    shell::run(objcopy.args(options).arg(from).arg(to))
}
