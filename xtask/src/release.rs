//! `cargo xtask release`: the files that are released for each board, and for boards with a record,
//! with their checksums. Images without pins are named by the motors that they drive and by their
//! start: `record-3-08008000`.
//!
//! | file | for |
//! |---|---|
//! | `NAME.elf` | probe-rs: the firmware with its symbols, but without debug information, which contains this computer's paths |
//! | `NAME.bin` | dfu-util, a bootloader's memory card: from the board's `start` on |
//! | `SHA256SUMS` | whoever wants to know whether theirs are the same |
//!
//! `--twice` makes the files a second time, in a copy of the repository at another path, without
//! earlier builds, and compares both. The same sources and compiler must give the same files, bit
//! for bit, at any path.
use crate::{
    failure::Failure,
    fw, shell,
    toolchain::{self, Toolchain},
};
use leadscrew_boards::BOARDS;
use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

/// Builds without pins: the name, and the variables that choose motors and start.
const RECORDS: [(&str, &[(&str, &str)]); 6] = [
    ("record-3-08000000", &[RECORD]),
    ("record-3-08008000", &[RECORD, BEHIND_32]),
    ("record-3-0800c000", &[RECORD, BEHIND_48]),
    ("record-4-08000000", &[RECORD, FOUR]),
    ("record-4-08008000", &[RECORD, FOUR, FOUR_BEHIND_32]),
    ("record-4-0800c000", &[RECORD, FOUR, BEHIND_48]),
];
const RECORD: (&str, &str) = (fw::RECORD, "1");
const FOUR: (&str, &str) = (fw::MOTORS, "4");
/// The image for a chip of 512 KiB serves one of 1 MiB as well.
const BEHIND_32: (&str, &str) = (fw::BOARD, "octopus");
/// Four motors have no room on a chip of 512 KiB.
const FOUR_BEHIND_32: (&str, &str) = (fw::BOARD, "skr-2");
const BEHIND_48: (&str, &str) = (fw::BOARD, "robin-nano-v3");

/// The argument that asks for the comparison.
const TWICE: &str = "--twice";

/// Makes the files of the named images, or of all images if none is named. With `--twice` among
/// the names, compares them with the files of a copy.
pub(crate) fn run(arguments: &[String]) -> Result<(), Failure> {
    let asked = |word: &&String| word.as_str() == TWICE;
    let names: Vec<String> = arguments
        .iter()
        .filter(|word| !asked(word))
        .cloned()
        .collect();
    let folder = toolchain::firmware_dir().join(FOLDER);
    let files = make(&names, &folder)?;
    if arguments.iter().any(|word| asked(&word)) {
        compare(&files, &folder, &make_in_copy(&names)?)?;
    }
    Ok(())
}

/// The name of the files' folder, in the folder of the profile's results.
const FOLDER: &str = "release";

/// Makes the files in `folder`. Returns their names.
fn make(names: &[String], folder: &Path) -> Result<Vec<String>, Failure> {
    let images = images();
    let is_image = |name: &String| images.iter().any(|(one, _)| one == name);
    if let Some(name) = names.iter().find(|name| !is_image(name)) {
        let known: Vec<&str> = images.iter().map(|(name, _)| *name).collect();
        let known = known.join(" ");
        return Err(Failure::finding(format!(
            "no image is called {name}; there are: {known}"
        )));
    }
    let toolchain = Toolchain::find()?;
    fs::create_dir_all(folder).map_err(Failure::file(folder))?;
    let wanted = |name: &str| names.is_empty() || names.iter().any(|one| one == name);
    let mut files = Vec::new();
    for (name, variables) in images.iter().filter(|(name, _)| wanted(name)) {
        let elf = fw::build_with(&toolchain, &[], variables)?;
        let (kept, image) = (format!("{name}.elf"), format!("{name}.bin"));
        copy(&["--strip-debug"], &elf, &folder.join(&kept))?;
        copy(
            &["-O", "binary", "--gap-fill", "0xFF"],
            &elf,
            &folder.join(&image),
        )?;
        files.extend([kept, image]);
    }
    let sums = shell::output(Command::new("sha256sum").args(&files).current_dir(folder))?;
    let path = folder.join("SHA256SUMS");
    fs::write(&path, &sums).map_err(Failure::file(&path))?;
    println!("{}\n{sums}", folder.display());
    Ok(files)
}

/// The variables of a build.
type Variables = Vec<(&'static str, &'static str)>;

/// All images: the name, and the variables of the build.
fn images() -> Vec<(&'static str, Variables)> {
    let boards = BOARDS.map(|(name, _)| (name, vec![(fw::BOARD, name)]));
    let records = RECORDS.map(|(name, variables)| (name, variables.to_vec()));
    boards.into_iter().chain(records).collect()
}

/// Makes the files once more, from a copy of the repository's files. Returns the folder with the
/// results.
fn make_in_copy(names: &[String]) -> Result<PathBuf, Failure> {
    // The copy must not be below this repository: cargo would read its settings from there as well.
    let copy = env::temp_dir().join("leadscrew-at-another-place");
    if copy.exists() {
        fs::remove_dir_all(&copy).map_err(Failure::file(&copy))?;
    }
    let root = toolchain::root();
    let listed = shell::output(
        Command::new("git")
            .args(["ls-files", "-z"])
            .current_dir(&root),
    )?;
    for file in listed.split_terminator('\0') {
        let (from, to) = (root.join(file), copy.join(file));
        let parent = to.parent().unwrap_or(&copy);
        fs::create_dir_all(parent).map_err(Failure::file(parent))?;
        fs::copy(&from, &to).map_err(Failure::file(&from))?;
    }
    let copy = copy.canonicalize().map_err(Failure::file(&copy))?;
    let own = env::current_exe().map_err(Failure::file("this program"))?;
    let mut again = Command::new(own);
    // These variables name the workspace and its results for the second run (`toolchain::root`).
    again
        .arg("release")
        .args(names)
        .env("CARGO_MANIFEST_DIR", copy.join("xtask"))
        .env("CARGO_TARGET_DIR", copy.join("target"));
    shell::run(&mut again)?;
    Ok(copy
        .join("target")
        .join(toolchain::TARGET)
        .join("firmware")
        .join(FOLDER))
}

/// Checks that each file is the same in both folders.
fn compare(files: &[String], one: &Path, other: &Path) -> Result<(), Failure> {
    let mut findings = Vec::new();
    for file in files {
        let read = |folder: &Path| {
            let path = folder.join(file);
            fs::read(&path).map_err(Failure::file(&path))
        };
        let (first, second) = (read(one)?, read(other)?);
        match difference(&first, &second) {
            None => println!("{file}: the same {} bytes twice", first.len()),
            Some(place) => findings.push(format!(
                "{file}: {} bytes, and {} in another folder; the first that differs is at {place:#x}",
                first.len(),
                second.len()
            )),
        }
    }
    match findings.is_empty() {
        true => Ok(()),
        false => Err(Failure::Findings(findings)),
    }
}

/// The offset at which two files begin to differ.
fn difference(one: &[u8], other: &[u8]) -> Option<usize> {
    let differs = one.iter().zip(other).position(|(a, b)| a != b);
    differs.or((one.len() != other.len()).then(|| one.len().min(other.len())))
}

fn copy(options: &[&str], from: &Path, to: &Path) -> Result<(), Failure> {
    let mut objcopy = Command::new("arm-none-eabi-objcopy");
    shell::run(objcopy.args(options).arg(from).arg(to))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_that_is_none_is_told_with_those_that_are() {
        let said = make(&["nope".to_owned()], Path::new("/nonexistent")).unwrap_err();
        let said = said.to_string();
        for name in ["nope", "discovery", "record-4-08008000"] {
            assert!(said.contains(name), "{said}");
        }
    }

    #[test]
    fn a_byte_or_a_length_is_a_difference() {
        assert_eq!(difference(b"firmware", b"firmware"), None);
        assert_eq!(difference(b"firmware", b"firmWare"), Some(4));
        assert_eq!(difference(b"firmware", b"firm"), Some(4));
        assert_eq!(difference(b"", b"f"), Some(0));
    }

    #[test]
    fn files_that_differ_are_named() {
        let folder = env::temp_dir().join(format!("leadscrew-release-{}", std::process::id()));
        let (one, other) = (folder.join("one"), folder.join("other"));
        for (place, text) in [(&one, "1"), (&other, "2")] {
            fs::create_dir_all(place).unwrap();
            fs::write(place.join("same.bin"), "0").unwrap();
            fs::write(place.join("board.bin"), text).unwrap();
        }
        let files = ["same.bin".to_owned(), "board.bin".to_owned()];
        assert!(compare(&files[..1], &one, &other).is_ok());
        let found = compare(&files, &one, &other).unwrap_err().to_string();
        assert!(found.starts_with("board.bin: 1 bytes"), "{found}");
        fs::remove_dir_all(folder).unwrap();
    }
}
