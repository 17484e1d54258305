//! Tells the linker where `memory.x` and `device.x` are.
fn main() {
    println!("cargo:rustc-link-search={}", env!("CARGO_MANIFEST_DIR"));
    for script in ["memory.x", "device.x"] {
        println!("cargo:rerun-if-changed={script}");
    }
    for argument in ["-Tlink.x", "--nmagic"] {
        println!("cargo:rustc-link-arg={argument}");
    }
}
