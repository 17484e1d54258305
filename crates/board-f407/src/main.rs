//! board.
fn main() {}
