//! Prints a checksum of the moves and segments of random programs. The planner's example
//! `same_bits` prints the same checksum on the host.
#![no_std]
#![no_main]

#[path = "../../../../../crates/planner/examples/same_bits/program.rs"]
mod program;

use cortex_m_semihosting::hprintln;
use icount_firmware::done;

#[cortex_m_rt::entry]
fn main() -> ! {
    hprintln!("{:016x}", program::checksum());
    done()
}
