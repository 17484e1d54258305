//! Passes on the host for which the program was built: rustup keeps its linker in a folder of that
//! name.
fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let host = std::env::var("HOST").unwrap_or_default();
    println!("cargo:rustc-env=HOST_TRIPLE={host}");
}
