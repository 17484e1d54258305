//! Tells the linker which of the HAL's scripts to take.
fn main() {
    println!("cargo:rustc-link-arg=-Tlinkall.x");
}
