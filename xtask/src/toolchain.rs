//! Finds a compiler for the microcontroller and builds with it.
//!
//! There are two kinds of compilers, tried in this order:
//! 1. rustup's toolchain with the target installed: a plain build.
//! 2. a compiler with the sources of `core` beside it (Debian: `rustc-web`, `rust-web-src`): `core`
//!    is built too. That needs `-Zbuild-std`, which a stable compiler only takes with
//!    `RUSTC_BOOTSTRAP=1`. The code for the F407 has no frame pointers then: it takes 2 % less flash,
//!    and 2 % fewer instructions.
use crate::{failure::Failure, shell};
use serde_json::Value;
use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

/// Cortex-M4 with the single-precision FPU, hard-float calls.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";

/// WebAssembly in a browser.
pub(crate) const BROWSER: &str = "wasm32-unknown-unknown";

/// A compiler that can build for [`TARGET`].
pub(crate) enum Toolchain {
    /// The target's libraries are installed.
    Prebuilt,
    /// The sources of `core` are installed instead.
    FromSource {
        /// Path of the compiler.
        rustc: &'static str,
        /// Path of the cargo that belongs to it.
        cargo: &'static str,
        /// Path of the linker.
        linker: PathBuf,
    },
}

impl Toolchain {
    /// Finds a compiler for [`TARGET`], and prints on standard error which one it is.
    ///
    /// # Errors
    /// When there is none; the error has the commands that install one.
    pub(crate) fn find() -> Result<Self, Failure> {
        Self::find_for(TARGET)
    }

    /// Finds a compiler for `target`, and prints on standard error which one it is.
    ///
    /// # Errors
    /// As [`Self::find`].
    pub(crate) fn find_for(target: &str) -> Result<Self, Failure> {
        if has_prebuilt_core("rustc", target) {
            eprintln!("compiler: rustc, with its prebuilt {target} libraries");
            return Ok(Toolchain::Prebuilt);
        }
        let (rustc, cargo) = [("rustc", "cargo"), ("/usr/bin/rustc", "/usr/bin/cargo")]
            .into_iter()
            .find(|(rustc, _)| has_core_sources(rustc))
            .ok_or_else(|| Failure::NoCompiler(target.to_owned()))?;
        let linker = find_linker(target);
        eprintln!(
            "compiler: {rustc}, building core from source; linker: {}",
            linker.display()
        );
        Ok(Toolchain::FromSource {
            rustc,
            cargo,
            linker,
        })
    }

    /// The folder of the sources of `core`, if they are compiled.
    pub(crate) fn sources(&self) -> Option<PathBuf> {
        match self {
            Self::Prebuilt => None,
            Self::FromSource { rustc, .. } => Some(sysroot(rustc)?.join(LIBRARY)),
        }
    }

    /// A `cargo build` for [`TARGET`] with artefacts in `target_dir`; the caller adds packages and
    /// a profile.
    ///
    /// # Errors
    /// As [`Self::cargo`].
    pub(crate) fn build(&self, target_dir: &Path) -> Result<Command, Failure> {
        self.cargo("build", TARGET, target_dir)
    }

    /// `cargo VERB` for `target`, as [`Self::build`].
    ///
    /// # Errors
    /// When the compiler does not describe [`TARGET`].
    pub(crate) fn cargo(
        &self,
        verb: &str,
        target: &str,
        target_dir: &Path,
    ) -> Result<Command, Failure> {
        self.cargo_with("core", verb, target, target_dir)
    }

    /// As [`Self::cargo`], for a package that needs the standard library. Debian's compiler has the
    /// sources of the standard library, and of the packages that this library needs.
    ///
    /// # Errors
    /// As [`Self::cargo`].
    pub(crate) fn cargo_with_std(
        &self,
        verb: &str,
        target: &str,
        target_dir: &Path,
    ) -> Result<Command, Failure> {
        self.cargo_with("std,panic_abort", verb, target, target_dir)
    }

    fn cargo_with(
        &self,
        libraries: &str,
        verb: &str,
        target: &str,
        target_dir: &Path,
    ) -> Result<Command, Failure> {
        let mut command = match self {
            Toolchain::Prebuilt => Command::new("cargo"),
            Toolchain::FromSource { cargo, .. } => Command::new(cargo),
        };
        command.arg(verb).arg("--target-dir").arg(target_dir);
        command.arg("--target");
        match self {
            Toolchain::FromSource { rustc, .. } if target == TARGET => command
                .arg(without_frame_pointers(rustc)?)
                .arg("-Zjson-target-spec"),
            _ => command.arg(target),
        };
        if let Toolchain::FromSource { rustc, linker, .. } = self {
            command
                .arg(format!("-Zbuild-std={libraries}"))
                .env("RUSTC_BOOTSTRAP", "1")
                .env("RUSTC", rustc)
                .env(linker_variable(target), linker)
                // rustup's cargo, which runs this program, has set the variable. It would lead
                // /usr/bin/cargo back to rustup.
                .env_remove("RUSTUP_TOOLCHAIN");
        }
        Ok(command)
    }
}

/// Writes the description that `rustc` has of [`TARGET`], but without frame pointers, and returns
/// the path of this file. A frame pointer takes a register in every function. No option of the
/// compiler removes frame pointers if its description of a target asks for them.
fn without_frame_pointers(rustc: &str) -> Result<PathBuf, Failure> {
    let mut query = Command::new(rustc);
    query
        .args(["-Zunstable-options", "--print", "target-spec-json"])
        .args(["--target", TARGET])
        .env("RUSTC_BOOTSTRAP", "1");
    let text = shell::output(&mut query)?;
    let mut description: Value =
        serde_json::from_str(&text).map_err(|_| Failure::unreadable(rustc, text))?;
    description["frame-pointer"] = "may-omit".into();
    let path = target_dir().join(format!("{TARGET}.json"));
    let text = format!("{description:#}");
    // Another build may be reading it.
    if fs::read_to_string(&path).ok().as_ref() != Some(&text) {
        fs::create_dir_all(target_dir()).map_err(Failure::file(target_dir()))?;
        fs::write(&path, text).map_err(Failure::file(&path))?;
    }
    path.canonicalize().map_err(Failure::file(&path))
}

/// The variable in which cargo expects the linker of `target`.
fn linker_variable(target: &str) -> String {
    let target = target.to_uppercase().replace('-', "_");
    format!("CARGO_TARGET_{target}_LINKER")
}

/// The folder of the workspace. Cargo sets a variable with this program's folder when it runs it.
pub(crate) fn root() -> PathBuf {
    let own =
        env::var_os("CARGO_MANIFEST_DIR").map_or_else(|| PathBuf::from("xtask"), PathBuf::from);
    own.join("..")
}

/// The folder for artefacts: `CARGO_TARGET_DIR`, or `target` in the workspace.
pub(crate) fn target_dir() -> PathBuf {
    env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// The folder with the results of a build for [`TARGET`] with the profile `firmware`.
pub(crate) fn firmware_dir() -> PathBuf {
    target_dir().join(TARGET).join("firmware")
}

/// Builds a program of the workspace for the desk, as the tests are built: what they share is
/// compiled once. Returns how it is run.
///
/// # Errors
/// When it cannot be built.
pub(crate) fn program(name: &str) -> Result<Command, Failure> {
    let mut build = Command::new("cargo");
    build.args(["build", "--quiet", "--workspace", "--bin", name]);
    shell::run(build.current_dir(root()))?;
    Ok(Command::new(target_dir().join("debug").join(name)))
}

fn has_prebuilt_core(rustc: &str, target: &str) -> bool {
    let query = ["--print", "target-libdir", "--target", target];
    let Ok(dir) = shell::output(Command::new(rustc).args(query)) else {
        return false;
    };
    fs::read_dir(dir.trim()).is_ok_and(|entries| {
        entries
            .flatten()
            .any(|entry| entry.file_name().to_string_lossy().starts_with("libcore-"))
    })
}

/// The sources of the libraries in a compiler's folder.
const LIBRARY: &str = "lib/rustlib/src/rust/library";

fn has_core_sources(rustc: &str) -> bool {
    sysroot(rustc).is_some_and(|dir| dir.join(LIBRARY).join("core/src/lib.rs").exists())
}

fn sysroot(rustc: &str) -> Option<PathBuf> {
    let path = shell::output(Command::new(rustc).args(["--print", "sysroot"])).ok()?;
    Some(PathBuf::from(path.trim()))
}

/// The linker that rustup ships with its compiler. If it is missing, as with Debian's compiler,
/// the GNU linker, or LLVM's for a browser.
fn find_linker(target: &str) -> PathBuf {
    let other = match target {
        BROWSER => "wasm-ld",
        _ if target.starts_with("riscv") => "ld.lld",
        _ => "arm-none-eabi-ld",
    };
    let host = concat!("lib/rustlib/", env!("HOST_TRIPLE"), "/bin/rust-lld");
    sysroot("rustc")
        .map(|dir| dir.join(host))
        .filter(|path| path.exists())
        .unwrap_or_else(|| PathBuf::from(other))
}
