//! Builds the firmware with the registry's cortex-m, but without its critical sections, which mask
//! every interrupt.
//!
//! stm32f4xx-hal requires cortex-m's feature `critical-section-single-core`, whose critical
//! sections would delay steps, too. The firmware has its own critical sections
//! (`crates/board-f407/src/critical.rs`), and a program can hold only one implementation. No
//! manifest can take back a feature that another package requires. So the firmware is built with a
//! copy of the package that lacks the two lines of [`MODULE`]. The copy is made under `target/`
//! from cargo's own download. Cargo's `paths` key puts it in place of the original, and
//! `Cargo.lock` stays as it is.
use crate::{failure::Failure, shell, toolchain};
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

const PACKAGE: &str = "cortex-m";
/// The part of `src/lib.rs` that is left out.
const MODULE: &str =
    "#[cfg(all(cortex_m, feature = \"critical-section-single-core\"))]\nmod critical_section;\n";

/// The values for `cargo --config`. Makes the copy if there is none yet. A panic names its file: the
/// folders of the packages, and that of `sources`, the library `core`, are left out of the names.
/// So the same sources make the same program, wherever cargo keeps them.
pub(crate) fn config(sources: Option<PathBuf>) -> Result<[String; 2], Failure> {
    let original = original()?;
    let name = original.file_name().unwrap_or_default();
    let copy = toolchain::target_dir().join("without-masking").join(name);
    if !copy.exists() {
        make(&original, &copy)?;
    }
    let copy = copy.canonicalize().map_err(Failure::file(&copy))?;
    let folders = [&original, &copy].map(|package| package.parent().map(Path::to_path_buf));
    let folders = folders.into_iter().chain([sources]).flatten();
    let flags: Vec<String> = folders
        .map(|folder| format!("--remap-path-prefix={}=", folder.display()))
        .collect();
    let (paths, target) = ([copy.display().to_string()], toolchain::TARGET);
    Ok([
        format!("paths={paths:?}"),
        format!("target.{target}.rustflags={flags:?}"),
    ])
}

/// The folder of the package that cargo has downloaded, now if necessary.
fn original() -> Result<PathBuf, Failure> {
    let mut cargo = Command::new("cargo");
    cargo.args(["metadata", "--format-version", "1", "--filter-platform"]);
    cargo.arg(toolchain::TARGET).current_dir(toolchain::root());
    let answer = shell::output(&mut cargo)?;
    manifest(&answer)
        .and_then(|path| path.parent().map(Path::to_path_buf))
        .ok_or_else(|| Failure::finding(format!("cargo metadata knows no package {PACKAGE}")))
}

/// The path of the package's manifest in the output of `cargo metadata`.
fn manifest(metadata: &str) -> Option<PathBuf> {
    let metadata: Value = serde_json::from_str(metadata).ok()?;
    let mut packages = metadata["packages"].as_array()?.iter();
    let package = packages.find(|package| package["name"] == PACKAGE)?;
    package["manifest_path"].as_str().map(PathBuf::from)
}

/// Makes the copy. It is made in another folder and then moved to its place, so that the copy in
/// its place is always complete.
fn make(original: &Path, copy: &Path) -> Result<(), Failure> {
    let unfinished = copy.with_file_name("unfinished");
    if unfinished.exists() {
        fs::remove_dir_all(&unfinished).map_err(Failure::file(&unfinished))?;
    }
    copy_folder(original, &unfinished)?;
    let library = unfinished.join("src/lib.rs");
    let text = fs::read_to_string(&library).map_err(Failure::file(&library))?;
    let less = without_module(&text).ok_or_else(|| {
        let library = original.join("src/lib.rs");
        Failure::finding(format!("{}: not exactly once: {MODULE}", library.display()))
    })?;
    fs::write(&library, less).map_err(Failure::file(&library))?;
    fs::rename(&unfinished, copy).map_err(Failure::file(copy))
}

fn without_module(library: &str) -> Option<String> {
    let (before, after) = library.split_once(MODULE)?;
    (!after.contains(MODULE)).then(|| format!("{before}{after}"))
}

fn copy_folder(from: &Path, to: &Path) -> Result<(), Failure> {
    fs::create_dir_all(to).map_err(Failure::file(to))?;
    for entry in fs::read_dir(from).map_err(Failure::file(from))? {
        let from = entry.map_err(Failure::file(from))?.path();
        let to = to.join(from.file_name().unwrap_or_default());
        if from.is_dir() {
            copy_folder(&from, &to)?;
        } else {
            fs::copy(&from, &to).map_err(Failure::file(&from))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_module_is_left_out_and_nothing_else() {
        let library = format!("pub mod asm;\n{MODULE}pub mod interrupt;\n");
        let less = without_module(&library).unwrap();
        assert_eq!(less, "pub mod asm;\npub mod interrupt;\n");
    }

    #[test]
    fn a_package_that_is_written_otherwise_is_refused() {
        assert_eq!(without_module("pub mod asm;\n"), None);
        assert_eq!(without_module(&MODULE.repeat(2)), None);
    }

    #[test]
    fn the_manifest_is_that_of_the_package() {
        let metadata = r#"{"packages":[{"name":"cortex-m-rt","manifest_path":"/a/Cargo.toml"},
            {"name":"cortex-m","manifest_path":"/b/Cargo.toml"}]}"#;
        assert_eq!(manifest(metadata), Some(PathBuf::from("/b/Cargo.toml")));
        assert_eq!(manifest(r#"{"packages":[]}"#), None);
    }
}
