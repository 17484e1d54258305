//! Puts the `memory.x` of the profile that is built where the linker of the firmware looks for it, and says how much is logged.
use std::{env, error::Error, fs, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=memory");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    // Unless it is named, defmt builds nothing in but errors.
    println!("cargo:rerun-if-env-changed=DEFMT_LOG");
    let level = env::var("DEFMT_LOG").unwrap_or_else(|_| "info".into());
    println!("cargo:rustc-env=DEFMT_LOG={level}");
    // As `src/profile.rs` chooses.
    let memory = if env::var_os("CARGO_FEATURE_SKR_2").is_some() {
        "memory/skr_2.x"
    } else {
        "memory/discovery.x"
    };
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let layout = [
        fs::read_to_string(memory)?,
        fs::read_to_string("memory/fast.x")?,
    ];
    fs::write(out.join("memory.x"), layout.concat())?;
    println!("cargo:rustc-link-search={}", out.display());
    Ok(())
}
