//! Lasers at the simulated pins: rasters run at full speed, each step gets its energy, rapids and
//! rests are dark, and both directions of a raster burn in the same place.

use leadscrew_planner::Cartesian;
use leadscrew_sim::{Cycle, Memory, Rate, StepEvent};
use leadscrew_stepper::{MotorMask, Power};
use leadscrew_tests::{run_program, setup, Session};
use proptest::prelude::*;
use std::fmt::Write;
use std::num::NonZeroU32;

/// CPU cycles in a second.
const HZ: f64 = 168e6;

/// 80 steps/mm, 500 mm/s, and a laser with full power at S1000, which stays lit when its sender is
/// silent.
fn settings(acceleration: u32) -> String {
    format!("$100=80\n$101=80\n$110=30000\n$111=30000\n$120={acceleration}\n$121={acceleration}\n$32=1\n$30=1000\n$707=0\n")
}

const X: usize = 0;
const Y: usize = 1;

/// A row of `count` pixels of `size` µm in the positive direction at 450 mm/s.
fn row(count: u32, size: u32, line: impl Fn(&mut String, u32, String)) -> String {
    let mut program = String::from("M4S0\nF27000\n");
    for k in 1..=count {
        let at = k * size;
        line(&mut program, k, format!("X{}.{:03}", at / 1000, at % 1000));
    }
    program
}

/// The time from the first to the last step of a row of 600 mm that is sent over `rate`, s.
fn seconds(rate: Rate, program: &str) -> f64 {
    let mut setup = setup::<3>(1);
    setup.lines = vec![rate];
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream(&settings(500));
    session.stream(program);
    let run = session.finish();
    assert_eq!(run.net_steps(), [48_000, 0, 0]);
    let (first, last) = (run.steps[0].cycle, run.steps[run.steps.len() - 1].cycle);
    (last - first) as f64 / HZ
}

/// Checks that a row of 600 mm, burnt pixel by pixel, takes no longer than a single line.
fn runs_at_full_speed(rate: Rate, program: &str) {
    let at_best = seconds(rate, "M4S500\nG1X600F27000\n");
    let (reach, feed) = (600.0, 450.0);
    assert!(
        (at_best - (reach / feed + feed / 500.0)).abs() < 0.01,
        "{at_best}"
    );
    let taken = seconds(rate, program);
    assert!(taken <= at_best * 1.001, "{taken} s, one line {at_best} s");
}

#[test]
fn a_row_of_tenths_of_a_millimetre_runs_at_450_mm_s() {
    let program = row(6000, 100, |program, k, x| {
        writeln!(program, "G1{x}S{}", 100 + k * 37 % 900).unwrap();
    });
    runs_at_full_speed(Rate::NeverWaits, &program);
}

/// 9000 lines/s, which are burnt as they come.
#[test]
fn a_row_of_twentieths_runs_at_450_mm_s_over_a_serial_line_of_3_megabaud() {
    let program = row(12_000, 50, |program, k, x| {
        writeln!(program, "{x}S{}", 100 + k * 37 % 900).unwrap();
    });
    let program = program.replacen("F27000\n", "F27000\nG1\n", 1);
    let line = Rate::Baud(NonZeroU32::new(3_000_000).unwrap());
    runs_at_full_speed(line, &program);
}

/// 18 000 pixels a second are more than the controller can prepare: it slows the row down, so that
/// segments do not run out.
#[test]
fn a_row_that_asks_for_too_many_pixels_a_second_is_slowed_down() {
    let there = row(3000, 100, |program, k, x| {
        writeln!(program, "G1{x}S{}", 100 + k * 37 % 900).unwrap();
    });
    let mut program = there.replacen("F27000", "F110000", 1);
    for k in (0..3000).rev() {
        writeln!(program, "G1X{}.{}S{}", k / 10, k % 10, 100 + k * 53 % 900).unwrap();
    }
    let fast = "$0=3\n$110=120000\n$120=9000\n";
    for line in [
        Rate::NeverWaits,
        Rate::Baud(NonZeroU32::new(2_000_000).unwrap()),
    ] {
        let mut setup = setup::<3>(1);
        setup.lines = vec![line];
        let mut memory = Memory::new(&setup);
        let mut session = Session::new(&mut memory, &setup, Cartesian);
        session.stream(&(settings(500) + fast));
        session.stream(&program);
        let run = session.finish();
        assert_eq!(run.outcome.motors[X].pulses, 48_000);
        let peak = run.outcome.motors[X].peak_hz / 80.0;
        // Motion begins when 15 lines, or lines for 5 ms, have come, and the first row ends with
        // them. A row has one change of power less than it has pixels, so it may go faster than
        // 1200 mm/s.
        assert!((1200.0..1253.0).contains(&peak), "{peak} mm/s");
    }
}

/// Burns pixels of `size` µm at 450 mm/s, at 80 steps/mm, with powers from a tenth to full power in
/// random order. Compares the exposure of each with duty times time, from the step edge at which
/// the pixel begins to its last one. Returns the worst relative error.
fn worst_exposure(size: u32) -> f64 {
    let count = 80_000 / size;
    let grey = |k: u32| 100 + (k.wrapping_mul(2_654_435_761) >> 16) % 901;
    let program = row(count, size, |program, k, x| {
        writeln!(program, "G1{x}S{}", grey(k)).unwrap();
    });
    let run = run_program(&settings(5000), &program);
    let steps_in_pixel = size as usize * 80 / 1000;
    let edges: Vec<f64> = run.steps.iter().map(|step| step.cycle.0 as f64).collect();
    // Pixels from 25 mm to 55 mm: neither ramp, each 20 mm long, reaches them.
    let pixels = (25_000 / size..55_000 / size).map(|k| {
        let last = k as usize * steps_in_pixel - 1;
        let (from, to) = (edges[last - steps_in_pixel], edges[last]);
        let programmed = f64::from(grey(k)) / 1000.0 * (to - from);
        (exposure(&run.powers, from, to) / programmed - 1.0).abs()
    });
    pixels.fold(0.0, f64::max)
}

/// The integral of power over time from one cycle to another.
fn exposure(powers: &[(Cycle, Power)], from: f64, to: f64) -> f64 {
    let next = powers.partition_point(|(cycle, _)| cycle.0 as f64 <= from);
    let (mut sum, mut at) = (0.0, from);
    let mut share = powers[next - 1].1.share().to_num::<f64>();
    for (cycle, power) in &powers[next..] {
        let until = (cycle.0 as f64).min(to);
        sum += share * (until - at);
        (at, share) = (until, power.share().to_num());
        if until == to {
            break;
        }
    }
    sum
}

#[test]
fn a_pixel_has_its_own_exposure_whatever_its_neighbours_have() {
    for size in [100, 50] {
        let worst = worst_exposure(size);
        println!("pixels of {size} um: {:.2} % off at most", 100.0 * worst);
        assert!(worst <= 0.01, "{size} um: {worst}");
    }
}

/// A black and white picture as LaserGRBL writes it: rapids skip the white.
#[test]
fn a_row_with_gaps_runs_at_450_mm_s() {
    let program = row(6000, 100, |program, k, x| match k * k % 11 % 3 {
        0 => writeln!(program, "G0{x}S0").unwrap(),
        _ => writeln!(program, "G1{x}S{}", 300 + k % 600).unwrap(),
    });
    runs_at_full_speed(Rate::NeverWaits, &program);
}

/// The number in a field of the answer to `?`.
fn ask(session: &mut Session<'_, Cartesian, 3>, field: &str) -> f64 {
    session.send(0, "?");
    session.wait_us(2_000);
    let heard = session.heard(0);
    let report = heard.iter().rfind(|line| line.starts_with('<')).unwrap();
    let mut fields = report.trim_end_matches('>').split('|');
    let value = fields.find_map(|text| text.strip_prefix(field));
    let value = value.unwrap_or_else(|| panic!("no {field} in {report}"));
    value.split(',').next().unwrap().parse().unwrap()
}

#[test]
fn free_moves_fall_with_the_pixels_planned_and_come_back_as_they_are_made() {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream(&settings(500));
    session.stream("$10=3\n");
    assert_eq!(ask(&mut session, "Bf:"), 1024.0);
    let mut free = vec![1024.0];
    session.send(0, "M4G1F60\n");
    for part in 0..50 {
        // 80 pixels of 0.1 mm at 1 mm/s, no more than the receive buffer takes. A full queue has
        // 4608.
        let pixels = (1..=80).map(|k| format!("X{:.1}S{}\n", f64::from(part * 80 + k) * 0.1, k));
        session.send(0, pixels.collect::<String>());
        session.wait_us(20_000);
        free.push(ask(&mut session, "Bf:"));
    }
    let falls = free.windows(2).map(|pair| pair[0] - pair[1]);
    assert!(
        falls.clone().all(|fall| (15.0..20.0).contains(&fall)),
        "{free:?}"
    );
    session.wait_us(60_000_000);
    let later = ask(&mut session, "Bf:");
    assert!(later > free[50] + 100.0, "{later} {free:?}");
    session.send(0, "\x18");
    session.until_quiet();
    assert_eq!(ask(&mut session, "Bf:"), 1024.0);
    session.finish();
}

#[test]
fn the_line_under_way_is_that_of_the_pixel_under_way() {
    let mut setup = setup::<3>(1);
    setup.machine.options.line_numbers = true;
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream(&settings(500));
    let row = (1..=40).map(|k| format!("N{}G1X{k}S{}F600\n", k * 10, k * 20));
    session.send(0, row.fold("M4\n".to_owned(), |all, line| all + &line));
    session.wait_us(100_000);
    for _ in 0..30 {
        let line = ask(&mut session, "Ln:") / 10.0;
        let x = ask(&mut session, "MPos:");
        // Lines are answered 4 ms apart, and 2 ms of motion are committed.
        assert!((line - 1.01..line + 0.06).contains(&x), "N{line} at {x}");
        session.wait_us(107_000);
    }
    session.until_quiet();
    session.finish();
}

/// Three rows and the rapids between them: only the rapids move Y, or X beyond 10 mm.
fn picture() -> String {
    let mut program = String::from("M4\n");
    for (row, y) in [0.5, 1.0, 1.5].iter().enumerate() {
        writeln!(program, "G0Y{y}").unwrap();
        let back = row % 2 == 1;
        for k in 1..=20 {
            let at = if back { 20 - k } else { k };
            writeln!(
                program,
                "G1X{}.{}F3000S{}",
                at / 2,
                at % 2 * 5,
                50 + k * 311 % 900
            )
            .unwrap();
        }
        if !back {
            writeln!(program, "G0X12\nG0X10").unwrap();
        }
    }
    program
}

/// The steps that only a rapid makes.
fn dark(steps: &[StepEvent]) -> impl Iterator<Item = (usize, &StepEvent)> {
    let mut x = 0;
    steps.iter().enumerate().filter(move |(_, event)| {
        if event.motors.contains(X) {
            x += if event.negative.contains(X) { -1 } else { 1 };
        }
        event.motors.contains(Y) || x > 800 || x == 800 && event.negative.contains(X)
    })
}

/// The simulator checks the other rules of the laser, before and after each turn of the main loop.
#[test]
fn the_laser_is_off_in_every_rapid_whatever_interrupts_the_job() {
    let program = picture();
    let whole = run_program(&settings(500), &program);
    assert!(dark(&whole.steps).count() > 200);
    assert!(dark(&whole.steps).all(|(_, event)| event.power == Power::OFF));
    let lit = whole.steps.iter().filter(|event| event.power > Power::OFF);
    assert!(lit.count() > 2000);
    for (k, event) in whole.steps.iter().enumerate().step_by(71) {
        let (byte, after) = [
            (&b"!"[..], &b"~"[..]),
            (b"\x84", b"~"),
            (b"\x91\x91\x97", b"\x90\x95"),
            (b"\x9A\x9A", b"\x99"),
            (b"\x18", b"$X\n"),
        ][k % 5];
        let mut memory = Memory::new(&setup::<3>(1));
        let mut session = Session::new(&mut memory, &setup::<3>(1), Cartesian);
        session.stream(&settings(500));
        session.send(0, &program);
        session.wait_us((event.cycle - session.sim.now()) / 168);
        session.send(0, byte);
        session.wait_us(700_000);
        session.send(0, after);
        session.until_quiet();
        let run = session.finish();
        assert!(
            dark(&run.steps).all(|(_, event)| event.power == Power::OFF),
            "{k}"
        );
    }
}

/// Unless segments run out, the power goes off at once with a stop, though the next step may be a
/// second away.
#[test]
fn a_reset_in_a_slow_move_switches_the_laser_off_at_once() {
    for mode in ["M3", "M4"] {
        let setup = setup::<3>(1);
        let mut memory = Memory::new(&setup);
        let mut session = Session::new(&mut memory, &setup, Cartesian);
        session.stream(&settings(500));
        session.send(0, format!("{mode}S800\nG1X1F1\n"));
        session.wait_us(2_500_000);
        assert!(session.sim.board().power() > Power::OFF, "{mode}");
        session.send(0, "\x18");
        session.wait_us(1_000);
        assert_eq!(session.sim.board().power(), Power::OFF, "{mode}");
        session.until_quiet();
        session.finish();
    }
}

#[test]
fn a_laser_at_rest_is_off_while_held_and_comes_back() {
    for (hold, resume) in [("M0\n", "~"), ("!", "~")] {
        let setup = setup::<3>(1);
        let mut memory = Memory::new(&setup);
        let mut session = Session::new(&mut memory, &setup, Cartesian);
        session.stream(&settings(500));
        session.stream("M3S800\nG1X1F6000\n");
        let lit = session.sim.board().power();
        assert!(lit > Power::OFF);
        session.send(0, hold);
        session.wait_us(100_000);
        assert_eq!(session.sim.board().power(), Power::OFF, "{hold}");
        session.send(0, resume);
        session.until_quiet();
        assert_eq!(session.sim.board().power(), lit, "{hold}");
        session.finish();
    }
}

/// Returns the places at which the laser goes on or off, in steps of X, if it follows its power pin
/// after `delay_us`.
fn burnt(steps: &[StepEvent], delay_us: u64) -> Vec<f64> {
    let mut x = 0i32;
    let mut track: Vec<(u64, i32)> = Vec::new();
    let (mut lit, mut edges) = (false, Vec::new());
    for event in steps {
        if lit != (event.power > Power::OFF) {
            lit = !lit;
            edges.push(track.last().map_or(0, |(at, _)| *at) + delay_us * 168);
        }
        x += if event.negative.contains(X) { -1 } else { 1 };
        track.push((event.cycle.0, x));
    }
    let place = |at: u64| {
        let next = track
            .partition_point(|(time, _)| *time < at)
            .clamp(1, track.len() - 1);
        let ((before, from), (after, to)) = (track[next - 1], track[next]);
        let part = (at.min(after) - before) as f64 / (after - before) as f64;
        f64::from(from) + part * f64::from(to - from)
    };
    edges.into_iter().map(place).collect()
}

#[test]
fn both_directions_of_a_raster_burn_in_the_same_place_with_the_laser_s_delay_set() {
    // Marks from 10 to 11 mm, 12.5 to 13 mm and 20 to 20.1 mm.
    let there = "G1X10F12000S0\nX11S500\nX12.5S0\nX13S900\nX20S0\nX20.1S300\nX30S0\n";
    let back = "X20.1S0\nX20S300\nX13S0\nX12.5S900\nX11S0\nX10S500\nX0S0\n";
    for delay in [0, 150, 500, 1000] {
        for lead in [0, delay] {
            let settings = format!("{}$703={lead}\n", settings(2000));
            let run = run_program(&settings, &format!("M3\n{there}{back}"));
            let edges = burnt(&run.steps, delay);
            assert_eq!(edges.len(), 12);
            let apart = (0..6).map(|k| (edges[k] - edges[11 - k]).abs());
            let apart = apart.fold(0.0, f64::max);
            if lead == delay {
                assert!(apart <= 1.05, "{delay} us: {apart} steps apart");
            } else {
                let due = 2.0 * 200.0 * 80.0 * delay as f64 * 1e-6;
                assert!((apart - due).abs() < 1.1, "{delay} us: {apart} steps apart");
            }
        }
    }
}

/// A longer step than this may have several powers, cycles: 0.9 ms.
const SLOW: f64 = 151_200.0;

/// The cycles after a step's edge within which its first power is put out.
const SETTLING: u64 = 1000;

/// The energy put out between two steps, in cycles of full power.
fn burnt_between(powers: &[(Cycle, Power)], from: Cycle, until: Cycle) -> f64 {
    let begun = powers.partition_point(|(at, _)| *at <= from + SETTLING);
    let changes = powers[begun.saturating_sub(1)..].iter();
    let ends = changes.clone().skip(1).map(|(at, _)| *at);
    let begins = [from].into_iter().chain(ends.clone());
    let pieces = changes.zip(begins.zip(ends.chain([until])));
    let pieces = pieces.map(|((_, power), (begin, end))| {
        let cycles = end.min(until).0.saturating_sub(begin.0);
        power.share().to_num::<f64>() * cycles as f64
    });
    pieces.sum()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases / 10))]

    /// Checks the energy, duty times interval, of every step at the pins. The planner's own tests
    /// check more.
    #[test]
    fn each_step_on_a_row_gets_its_energy(
        pixels in prop::collection::vec((1u32..400, 20u32..=1000), 1..60), feed in 60u32..24_000,
        acceleration in 20u32..8000, bytes in prop::collection::vec((0u64..400_000, prop::sample::select(&b"\x92\x94!"[..])), 0..4),
    ) {
        let mut program = format!("M4\nG1F{feed}\n");
        let mut at = 0;
        for (steps, power) in &pixels {
            at += steps;
            writeln!(program, "X{}.{:04}S{power}", at / 80, at % 80 * 125).unwrap();
        }
        let mut memory = Memory::new(&setup::<3>(1));
        let mut session = Session::new(&mut memory, &setup::<3>(1), Cartesian);
        session.stream(&settings(acceleration));
        session.send(0, &program);
        for (wait, byte) in bytes {
            session.wait_us(wait);
            session.send(0, [byte]);
            if byte == b'!' {
                session.wait_us(1_500_000);
                session.send(0, "~");
            }
        }
        session.until_quiet();
        let run = session.finish();
        let steps = &run.steps;
        prop_assert_eq!(steps.len() as u32, at);
        let powers = pixels.iter().flat_map(|(steps, power)| std::iter::repeat_n(*power, *steps as usize));
        for (pair, power) in steps.windows(2).zip(powers.skip(1)) {
            let interval = (pair[1].cycle - pair[0].cycle) as f64;
            // A held step lasts as long as the hold. A step shorter than 100 timer counts (200
            // cycles) is not checked.
            if !(200.0..0.5 * HZ).contains(&interval) {
                continue;
            }
            let due = f64::from(power) / 1000.0 / 80.0 / (f64::from(feed) / 60.0) * HZ;
            // The power changes a little after a step. That matters only if steps are fast and
            // have one power each.
            let energy = if interval > SLOW {
                burnt_between(&run.powers, pair[0].cycle, pair[1].cycle)
            } else {
                pair[1].power.share().to_num::<f64>() * interval
            };
            prop_assert!((energy / due - 1.0).abs() < 0.01, "{} of {} counts", energy / due, interval / 2.0);
            prop_assert_eq!(pair[1].motors, MotorMask::only(X));
        }
    }
}

/// A hold decelerates to rest within a step, so that the step takes tens of milliseconds.
#[test]
fn under_m3_the_last_step_of_a_hold_burns_no_more_than_a_step_at_the_programmed_feed() {
    for (steps_per_mm, feed, acceleration) in [(250, 500, 10), (80, 500, 10), (80, 6000, 500)] {
        for interruption in [b'!', 0x84] {
            let setup = setup::<3>(1);
            let mut memory = Memory::new(&setup);
            let mut session = Session::new(&mut memory, &setup, Cartesian);
            session.stream(&format!(
                "$32=1\n$110=6000\n$100={steps_per_mm}\n$120={acceleration}\n"
            ));
            session.send(0, format!("M3S1000\nG1X900F{feed}\n"));
            session.wait_us(2_000_000);
            session.send(0, [interruption]);
            session.wait_us(3_000_000);
            let run = session.finish();
            let [.., before, last] = &run.steps[..] else {
                panic!("no steps");
            };
            let burnt = burnt_between(&run.powers, before.cycle, last.cycle);
            let due = 60.0 * HZ / f64::from(steps_per_mm * feed);
            let taken = (last.cycle - before.cycle) as f64;
            assert!(taken > 4.0 * due, "{taken} {due}");
            assert!(burnt < 1.02 * due, "{burnt} {due}");
        }
    }
}
