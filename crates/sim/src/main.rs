//! leadscrew.
fn main() {}
