//! Prints a checksum of what the planner makes of random programs, to be held against the one that
//! a Cortex-M4F computes: `cargo xtask icount` does so. (`docs/motion.md`, section 8.)

mod program;

fn main() {
    println!("{:016x}", program::checksum());
}
