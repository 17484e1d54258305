//! A raster at 10 000 lines a second through the whole machine: `G1X123.45S752`, pixels of 0.05 mm
//! at 500 mm/s.
//!
//! Region 0: the main loop's work for one line, from its bytes in the receive queue to `ok`, and
//! its work for the segments of the 100 µs that the line takes. The step interrupt runs between the
//! samples and is not counted.
#![no_std]
#![no_main]

use core::fmt::Write;
use heapless::String;
use icount_firmware::{count, done, session::Session};

/// The timer counts in the 100 µs of a line.
const A_LINE: u64 = 8400;
/// Lines planned before motion begins.
const AHEAD: u32 = 1500;
/// The lines until the row is at its speed: 25 mm at 5000 mm/s².
const SPEEDING_UP: u32 = 1000;
const COUNTED: u32 = 2000;

const SETTINGS: &str = "$0=3\n$110=30000\n$120=5000\n$32=1\n$30=1000\nM4S0F30000\n";

/// Sends pixel `k` of the row.
fn pixel(session: &mut Session<'_>, k: u32) {
    let mut line = String::<20>::new();
    let at = k * 5;
    let power = 100 + k * 37 % 900;
    assert!(write!(line, "G1X{:03}.{:02}S{:03}\n", at / 100, at % 100, power).is_ok());
    assert!(line.len() == 14);
    session.receive(&line);
}

fn answered(session: &Session<'_>, lines: u32) {
    assert!(session.bench.answers == lines);
}

#[cortex_m_rt::entry]
fn main() -> ! {
    Session::with(SETTINGS, run);
    done()
}

fn run(session: &mut Session<'_>) {
    // All lines come at one instant: motion waits for a pause of the sender.
    for k in 1..=AHEAD {
        pixel(session, k);
        session.main_loop();
    }
    answered(session, AHEAD);
    for _ in 0..200 {
        session.pass_time(A_LINE);
        session.main_loop();
    }
    for k in AHEAD + 1..=AHEAD + SPEEDING_UP {
        session.pass_time(A_LINE);
        pixel(session, k);
        session.main_loop();
    }
    for k in AHEAD + SPEEDING_UP + 1..=AHEAD + SPEEDING_UP + COUNTED {
        session.pass_time(A_LINE);
        pixel(session, k);
        count::<0, _>(|| session.main_loop());
    }
    answered(session, AHEAD + SPEEDING_UP + COUNTED);
    assert!(session.shared.underruns() == 0);
    assert!((session.machine.speed() - 500.0).abs() < 1.0);
}
