//! Puts the `memory.x` of the profile that is built where the linker of the firmware looks for it.
use std::{env, error::Error, fs, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=memory");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    // As `src/profile.rs` chooses.
    let memory = if env::var_os("CARGO_FEATURE_SKR_2").is_some() {
        "memory/skr_2.x"
    } else {
        "memory/discovery.x"
    };
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::copy(memory, out.join("memory.x"))?;
    println!("cargo:rustc-link-search={}", out.display());
    Ok(())
}
