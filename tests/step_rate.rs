//! The highest step rate. With every pulse width three motors run at it: no event is late, no step
//! is lost, each direction is set up in time. A setting that asks for more is answered with the
//! highest value that works.

use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::step_timing::StepTiming;
use leadscrew_planner::Cartesian;
use leadscrew_sim::Memory;
use leadscrew_tests::{run_program, setup, Session};

/// Settings with 1000 steps/mm that ask for more steps/s than the board can make.
fn fast(pulse_us: u8) -> String {
    let axis = |axis: u32| {
        format!(
            "${}=1000\n${}=100000\n${}=20000\n",
            100 + axis,
            110 + axis,
            120 + axis
        )
    };
    format!("$0={pulse_us}\n$11=0.05\n{}{}{}", axis(0), axis(1), axis(2))
}

/// All motors together, then moves with odd ratios that reverse at full speed.
const PROGRAM: &str = "G91G1X20Y20Z20F99999\nX-20Y-19.9Z-7\nX20Y0.3Z-0.2\nX20Y-0.3Z0.2\nX-17Y-20Z3\nX-17Y20.1Z-3\nX-6Z-12.8\n";

#[test]
fn at_the_highest_rate_of_every_pulse_width_nothing_is_late_and_no_step_is_lost() {
    for pulse_us in [1, 2, 3, 4, 5, 10, 20, 50, 255] {
        // The run fails if an event is late, a step is lost or a direction is set up too late.
        let run = run_program(&fast(pulse_us), PROGRAM);
        let highest = f64::from(StepTiming::F407.highest_rate(pulse_us, 3));
        let peak = run.outcome.peak_step_hz;
        // The peak is measured over 16 steps. The interrupt that ends a pulse, 64 cycles, may delay
        // the last edge.
        assert!(
            (0.99..=1.006).contains(&(peak / highest)),
            "{pulse_us} us: {peak} of {highest} steps/s"
        );
        println!("$0={pulse_us}: {peak:.0} steps/s, three motors");
    }
}

#[test]
fn a_board_said_to_be_faster_than_it_is_has_late_events() {
    let mut setup = setup::<3>(1);
    setup.machine = MachineConfig {
        step_timing: StepTiming {
            // 1.7 µs for three motors: less than the time of a tick that loads a segment.
            tick_ns: 1_100,
            pulse_end_ns: 0,
            setup_ns: 0,
            ..StepTiming::F407
        },
        ..MachineConfig::new()
    };
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream(&fast(1));
    session.stream(PROGRAM);
    assert!(!session.sim.outcome().late.is_empty());
}

#[test]
fn settings_are_accepted_one_by_one_and_words_name_the_rate_that_works() {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    for (line, heard) in [
        ("$700=1", &["ok"][..]),
        ("$0=1", &["ok"]),
        ("$110=88888", &["ok"]),
        (
            "$110=88889",
            &["[MSG:Step rate: $110 can be 88888.800 at most]", "ok"],
        ),
        (
            "$0=10",
            &["[MSG:Step rate: $110 can be 21818.160 at most]", "ok"],
        ),
        (
            "$100=1000",
            &["[MSG:Step rate: $110 can be 5454.540 at most]", "ok"],
        ),
        ("$111=500", &["ok"]),
        ("$110=5454", &["ok"]),
    ] {
        assert_eq!(session.say(&format!("{line}\n")), heard, "{line}");
    }
    for (line, words) in [
        (
            "$110=22222201",
            "[MSG:Step rate: $110 can be 5454.540 at most]",
        ),
        (
            "$102=370370.1",
            "[MSG:Step rate: $102 can be 370370.000 at most]",
        ),
    ] {
        let heard = session.say(&format!("{line}\n"));
        assert_eq!(heard.first().map(String::as_str), Some(words), "{line}");
        assert_eq!(heard.last().map(String::as_str), Some("error:12"), "{line}");
    }
}
