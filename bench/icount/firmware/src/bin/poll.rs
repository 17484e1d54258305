//! The longest single `Machine::poll`, with 1024 short moves queued, motion under way and a full
//! serial line.
//!
//! Region 0: polls that take a line, the most expensive of each kind. Region 1: polls that take
//! eight overrides. Region 2: polls that take eight holds, resumes and report requests. Region 3:
//! all polls while arcs, lists and offsets are worked off. Region 4: all polls while a circle in
//! short lines runs under a jerk limit.
#![no_std]
#![no_main]

use core::fmt::Write;
use heapless::String;
use icount_firmware::{count, done, session::Session};

/// Reports with all fields; moves of 4 µm and more, so that motion takes many segments; and a queue
/// that takes as many of them as fit.
const SETTINGS: &str =
    "$10=255\n$110=6000\n$111=6000\n$112=6000\n$120=500\n$121=500\n$122=500\n$32=1\n$30=1000\n$701=0\n$710=0\nG91M4S500F3000\n";

/// The time between two looks at the machine, timer counts: 100 µs, less than the machine asks for.
const A_WHILE: u64 = 8_400;

/// The lines that come between moves, one of each kind.
const LINES: [&str; 12] = [
    "N1234567G01X-0.123456789Y0.987654321Z-0.012345678F12345.6789S999.99999M4(a comment)\n",
    "G1X0.0001Y-0.0002Z0.0003\n",
    "N99999G17G21G90G94G54G40G49G80M9M4S123.456G91G1X0.12Y-0.34Z0.05F2345.67\n",
    "G93G1X0.3Y0.2Z0.1F1234.5\n",
    "G94F3000\n",
    "G2X0.3Y0.4I0.5J-0.1F3000\n",
    "G3X-0.3Y-0.4R0.61Z0.2\n",
    "G18G2X0.01Z0.01I0.3K-0.2\n",
    "G17G0X0.1Y0.1Z-0.1\n",
    "G1X0.05S12.34567\n",
    "G20G1X0.00123Y-0.0456\n",
    "G21(................................................................)G1X1e\n",
];

/// Fills the queue with moves back and forth, without letting time pass.
fn fill(session: &mut Session<'_>, moves: u32) {
    for k in 0..moves {
        let mut line = String::<40>::new();
        let y = k * 7 % 90;
        assert!(write!(line, "G1X0.{:03}Y-0.0{:02}\n", 100 + k % 200, y).is_ok());
        session.receive(&line);
        session.main_loop();
    }
}

fn run(session: &mut Session<'_>) {
    fill(session, 1000);
    wait(session, 4_000);
    assert!(session.machine.speed() > 1.0);
    for line in LINES {
        wait(session, 50);
        session.receive(line);
        while count::<0, _>(|| session.poll()) {}
    }
    fill(session, 1024);
    for byte in [0x91, 0x92, 0x93, 0x95, 0x97] {
        wait(session, 10);
        session.receive([byte; 8]);
        while count::<1, _>(|| session.poll()) {}
    }
    for bytes in [b"!?!?!?!?", b"~?~?~?~?"] {
        wait(session, 10);
        session.receive(bytes);
        while count::<2, _>(|| session.poll()) {}
    }
    assert!(session.shared.underruns() == 0);
    session.receive("\x18");
    while count::<2, _>(|| session.poll()) {}
    wait(session, 100);
    session.receive(
        "$X\nG91G17G94F6000M4S1\nG2X0.2Y0.1I20J10\n$#\nG10L20P1X1.2345Y3.4\nG92X1\nG1X1\n?",
    );
    for _ in 0..30_000 {
        session.pass_time(A_WHILE);
        while count::<3, _>(|| session.poll()) {}
    }
    assert!(session.machine.is_quiet());
    assert!(session.shared.underruns() == 0);
    under_a_jerk_limit(session);
}

/// A circle of 5 mm in lines of 0.1 mm, from rest to rest.
fn under_a_jerk_limit(session: &mut Session<'_>) {
    const LINES: usize = 314;
    session.receive("$705=5000\nG91G94F3000\n");
    session.main_loop();
    let mut way = [0.1f32, 0.0];
    for _ in 0..LINES {
        let mut line = String::<40>::new();
        assert!(write!(line, "G1X{:.4}Y{:.4}\n", way[0], way[1]).is_ok());
        session.receive(&line);
        session.main_loop();
        // A turn by 0.02: the length stays to 10⁻⁷.
        let [x, y] = way;
        way = [0.9998 * x - 0.02 * y, 0.02 * x + 0.9998 * y];
    }
    for _ in 0..20_000 {
        session.pass_time(A_WHILE);
        while count::<4, _>(|| session.poll()) {}
    }
    assert!(session.machine.is_quiet());
    assert!(session.shared.underruns() == 0);
}

/// Lets 100 µs pass, `times` times.
fn wait(session: &mut Session<'_>, times: u32) {
    for _ in 0..times {
        session.pass_time(A_WHILE);
        session.main_loop();
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    Session::with(SETTINGS, run);
    done()
}
