//! Prints the checksum that the planner's example `same_bits` prints on the host: moves and
//! segments of random programs.
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
