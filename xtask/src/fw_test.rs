//! `cargo fw-test`: builds the firmware and runs it in the emulator (`tests/firmware`).
//!
//! The program there says which images the asked checks need; only these are built. There are two
//! for the Discovery, which differ only in the rate of the serial line: 115200 baud, and 2 Mbaud
//! for checks that the line must not limit; one for each other board, with other frequencies of
//! power; one for each machine file; and images without pins, one for each start address. An image
//! whose sources have not changed since it was built is kept: cargo would build it anew, since the
//! one before was built with other variables.
use crate::{
    failure::Failure,
    fw::{self, machine, BOARD},
    shell,
    toolchain::{self, Toolchain},
};
use std::{
    collections::BTreeMap,
    env, fs,
    path::{Path, PathBuf},
    process::Command,
    time::{Instant, SystemTime, UNIX_EPOCH},
};

/// A build, by its name in `tests/firmware`.
struct Build {
    name: &'static str,
    /// The environment variables that the firmware reads while it is built.
    variables: &'static [(&'static str, &'static str)],
}

const fn build(name: &'static str, variables: &'static [(&'static str, &'static str)]) -> Build {
    Build { name, variables }
}

const FAST: (&str, &str) = ("LEADSCREW_BAUD", "2000000");

/// A Discovery with every output turned round, and a machine that uses them all.
const INVERTED: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../tests/firmware/every_output.toml"
);

/// The variable for builds that read the pins of a board with three motors from a record.
const WITHOUT_PINS: (&str, &str) = (fw::RECORD, "1");

/// All images.
const BUILDS: [Build; 22] = [
    build("record", &[WITHOUT_PINS]),
    build("record-behind", &[WITHOUT_PINS, (BOARD, "octopus")]),
    build(
        "record-behind-48",
        &[WITHOUT_PINS, (BOARD, "robin-nano-v3")],
    ),
    // Ticks may be 2 µs apart, which is 500 000 steps/s.
    build("uncapped", &[FAST, ("LEADSCREW_TICK_NS", "1400")]),
    build("octopus", &[(BOARD, "octopus")]),
    build("fly-407zg", &[(BOARD, "fly-407zg")]),
    build("spider", &[(BOARD, "spider")]),
    build("robin-nano-v3", &[(BOARD, "robin-nano-v3")]),
    build("six-axes", &[(fw::MACHINE, fw::SIX_AXES)]),
    build(
        "record-four",
        &[WITHOUT_PINS, (fw::MOTORS, "4"), (BOARD, "skr-2")],
    ),
    build("machine-file-000", &[machine!("000")]),
    build("machine-file-001", &[machine!("001")]),
    build("machine-file-002", &[machine!("002")]),
    build("machine-file-003", &[machine!("003")]),
    build("machine-file-004", &[machine!("004")]),
    build("inverted", &[(fw::MACHINE, INVERTED)]),
    build("fast", &[FAST]),
    build(
        "machine-003",
        &[(BOARD, "machine-003"), ("LEADSCREW_POWER_HZ", "50")],
    ),
    build("skr-2", &[(BOARD, "skr-2")]),
    build(
        "dual-y",
        &[(BOARD, "skr-2-dual-y"), ("LEADSCREW_POWER_HZ", "100000")],
    ),
    build(
        "core-xy",
        &[(BOARD, "skr-2-core-xy"), ("LEADSCREW_POWER_HZ", "1000")],
    ),
    build("usual", &[]),
];

/// Files, besides the sources that cargo names, whose change makes an image old.
const FURTHER: [&str; 4] = [
    "Cargo.lock",
    "Cargo.toml",
    ".cargo/config.toml",
    "xtask/src",
];

/// Builds what `arguments` need, and runs the tests; the arguments go to `fw-test`.
pub(crate) fn run(arguments: &[String]) -> Result<(), Failure> {
    let folder = toolchain::firmware_dir().join("fw-test");
    fs::create_dir_all(&folder).map_err(Failure::file(&folder))?;
    // All checks need all images.
    let asked = match arguments {
        [] => BUILDS.map(|build| build.name).join("\n"),
        some => shell::output(fw_test()?.arg("--needs").args(some))?,
    };
    let mut needed: Vec<&str> = asked.lines().collect();
    if !needed.is_empty() {
        let toolchain = Toolchain::find()?;
        for build in &BUILDS {
            if needed.contains(&build.name) {
                keep(&toolchain, build, &folder)?;
                needed.retain(|name| *name != build.name);
            }
        }
    }
    if let Some(name) = needed.first() {
        return Err(Failure::finding(format!("no image '{name}' is known")));
    }
    shell::run(fw_test()?.arg(&folder).args(arguments))
}

/// The program that runs the checks.
fn fw_test() -> Result<Command, Failure> {
    toolchain::program("fw-test")
}

/// Builds an ELF, unless it is as its sources are, and copies it to `folder` before the next build
/// replaces it.
fn keep(toolchain: &Toolchain, build: &Build, folder: &Path) -> Result<(), Failure> {
    let kept = folder.join(build.name);
    let stamp = kept.with_extension("made");
    let how = how(build)?;
    if is_current(&kept, &stamp, &how) {
        return Ok(());
    }
    let (began, started) = (SystemTime::now(), Instant::now());
    let elf = fw::build_with(toolchain, &[], build.variables)?;
    fs::copy(&elf, &kept).map_err(Failure::file(&kept))?;
    let sources = elf.with_extension("d");
    let sources = fs::read_to_string(&sources).map_err(Failure::file(&sources))?;
    let nanos = began
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_nanos());
    fs::write(&stamp, format!("{nanos}\n{how}\n{sources}")).map_err(Failure::file(&stamp))?;
    eprintln!("{}: {:.0} s", build.name, started.elapsed().as_secs_f64());
    Ok(())
}

/// Returns how an image is built, besides from its sources, in one line.
fn how(build: &Build) -> Result<String, Failure> {
    let compiler = |rustc: &str| shell::output(Command::new(rustc).arg("-vV")).unwrap_or_default();
    let own = env::vars().filter(|(name, _)| {
        name.starts_with("LEADSCREW_")
            || name.starts_with("CARGO_PROFILE")
            || name.contains("RUSTFLAGS")
            || name == "DEFMT_LOG"
    });
    let own: BTreeMap<String, String> = own.collect();
    Ok(format!(
        "{:?} {own:?} {:?} {:?}",
        build.variables,
        compiler("rustc"),
        compiler("/usr/bin/rustc")
    ))
}

/// Returns true if an image was built in this way, from sources that have not changed since.
fn is_current(kept: &Path, stamp: &Path, how: &str) -> bool {
    let Ok(text) = fs::read_to_string(stamp) else {
        return false;
    };
    let mut lines = text.splitn(3, '\n');
    let (Some(began), Some(was), Some(sources)) = (lines.next(), lines.next(), lines.next()) else {
        return false;
    };
    let began: u128 = began.parse().unwrap_or(0);
    let manifests = fs::read_dir(toolchain::root().join("crates"))
        .into_iter()
        .flatten();
    let manifests = manifests.flatten().map(|one| one.path().join("Cargo.toml"));
    let further = FURTHER.map(|file| toolchain::root().join(file));
    let files = sources_of(sources).chain(manifests.filter(|file| file.exists()));
    let is_older = |file: PathBuf| changed(&file).is_some_and(|nanos| nanos < began);
    was == how && kept.exists() && files.chain(further).all(is_older)
}

/// The sources in cargo's list of what an ELF depends on; a blank in a name has a backslash before
/// it. What a build has made itself is left out.
fn sources_of(list: &str) -> impl Iterator<Item = PathBuf> {
    let made = fs::canonicalize(toolchain::target_dir()).unwrap_or_default();
    let (_, files) = list.split_once(": ").unwrap_or_default();
    let files = files.replace("\\ ", "\0");
    let files: Vec<PathBuf> = files
        .split_whitespace()
        .map(|file| PathBuf::from(file.replace('\0', " ")))
        .filter(|file| !fs::canonicalize(file).is_ok_and(|file| file.starts_with(&made)))
        .collect();
    files.into_iter()
}

/// Returns when a file, or the newest one in a folder, was changed, ns since 1970; none if it is
/// not there.
fn changed(file: &Path) -> Option<u128> {
    let about = fs::metadata(file).ok()?;
    let own = about
        .modified()
        .ok()?
        .duration_since(UNIX_EPOCH)
        .ok()?
        .as_nanos();
    if !about.is_dir() {
        return Some(own);
    }
    let inside = fs::read_dir(file).ok()?;
    let inside = inside.flatten().filter_map(|one| changed(&one.path()));
    inside.chain([own]).max()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// A stamp of an image that began to be built now from `source`.
    fn stamped(folder: &Path, source: &Path, how: &str) -> (PathBuf, PathBuf) {
        let (kept, stamp) = (folder.join("usual"), folder.join("usual.made"));
        let began = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap()
            .as_nanos();
        fs::write(&kept, b"elf").unwrap();
        fs::write(
            &stamp,
            format!("{began}\n{how}\nboard-f407: {}\n", source.display()),
        )
        .unwrap();
        (kept, stamp)
    }

    #[test]
    fn an_image_is_kept_until_its_source_or_its_making_changes() {
        let folder = env::temp_dir().join(format!("leadscrew-kept-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let source = folder.join("a source.rs");
        fs::write(&source, "1").unwrap();
        let (kept, stamp) = stamped(
            &folder,
            Path::new(&source.display().to_string().replace(' ', "\\ ")),
            "how",
        );
        assert!(is_current(&kept, &stamp, "how"));
        assert!(!is_current(&kept, &stamp, "otherwise"));
        // A file system's clock ticks; the build before it may have begun in the same tick.
        let later = SystemTime::now() + Duration::from_secs(1);
        let changed = fs::File::options().write(true).open(&source).unwrap();
        changed.set_modified(later).unwrap();
        assert!(!is_current(&kept, &stamp, "how"));
        fs::remove_file(&source).unwrap();
        assert!(!is_current(&kept, &stamp, "how"));
        fs::remove_dir_all(&folder).unwrap();
    }
}
