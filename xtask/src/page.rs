//! `cargo xtask page PAGE.html [MACHINE.toml]`: the page of a machine as one file, with the
//! simulator in it as WebAssembly.
use crate::{
    failure::Failure,
    shell,
    toolchain::{self, Toolchain, BROWSER},
};
use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

/// The simulator's package, and the profile for it in the workspace.
const PACKAGE: &str = "leadscrew-wasm";
const PROFILE: &str = "page";

/// The most that a page may weigh, bytes.
const MOST_BYTES: u64 = 1_500_000;

/// Builds the simulator and writes the page. `files` are the page's name, and the machine file if
/// there is one.
pub(crate) fn run(files: &[String]) -> Result<(), Failure> {
    let toolchain = Toolchain::find_for(BROWSER)?;
    let mut build = toolchain.cargo_with_std("build", BROWSER, &toolchain::target_dir())?;
    build
        .args(["--locked", "-p", PACKAGE, "--profile", PROFILE])
        .current_dir(toolchain::root());
    shell::run(&mut build)?;
    let module = toolchain::target_dir()
        .join(BROWSER)
        .join(PROFILE)
        .join("leadscrew_wasm.wasm");
    // File names are relative to the caller's folder.
    let here = env::current_dir().map_err(Failure::file(&PathBuf::from(".")))?;
    let mut write = Command::new("cargo");
    write
        .args(["run", "--quiet", "--example", "standalone", "--"])
        .arg(module)
        .args(files.iter().map(|file| here.join(file)))
        .current_dir(toolchain::root());
    shell::run(&mut write)?;
    files.first().map_or(Ok(()), |page| weigh(&here.join(page)))
}

/// Checks that the page is light.
fn weigh(page: &Path) -> Result<(), Failure> {
    let bytes = fs::metadata(page).map_err(Failure::file(page))?.len();
    if bytes <= MOST_BYTES {
        return Ok(());
    }
    Err(Failure::finding(format!(
        "{}: {bytes} bytes, at most {MOST_BYTES} wanted",
        page.display()
    )))
}
