//! Tells the linker where `memory.x` is.
fn main() {
    println!("cargo:rustc-link-search={}", env!("CARGO_MANIFEST_DIR"));
    println!("cargo:rerun-if-changed=memory.x");
    // In this repository the firmware's flags hold here, too: they name these, and `defmt.x`.
    let flags = std::env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    if !flags.contains("-Tlink.x") {
        for argument in ["-Tlink.x", "--nmagic"] {
            println!("cargo:rustc-link-arg={argument}");
        }
    }
}
