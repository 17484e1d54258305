//! The shape of the machine: axes and motors, their number and kind, serial lines, startup lines.
//! Also checks that repeated runs agree to the cycle.

use leadscrew_machine::config::AxisKind;
use leadscrew_planner::{Cartesian, CoreXy};
use leadscrew_sim::{Memory, Rate};
use leadscrew_tests::{setup, Session};
use std::num::NonZeroU32;

/// The value of the report's field `name`.
fn field<'a>(report: &'a str, name: &str) -> &'a str {
    let fields = report.trim_matches(['<', '>']).split('|');
    let mut found = fields.filter_map(|field| field.strip_prefix(name)?.strip_prefix(':'));
    found
        .next_back()
        .unwrap_or_else(|| panic!("no {name}: {report}"))
}

/// The answer to `?` on line 0.
fn report(
    session: &mut Session<'_, impl leadscrew_planner::Kinematics<3, 3> + Clone, 3>,
) -> String {
    session.send(0, "?");
    session.until_quiet();
    session.heard(0).pop().unwrap()
}

const BELTS: &str = "$100=80\n$101=80\n$102=400\n$110=600\n$111=6000\n$112=600\n\
                     $120=500\n$121=500\n$122=500\n";

#[test]
fn crossed_belts_turn_by_sum_and_difference_and_reports_are_of_axes() {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, CoreXy);
    session.stream(BELTS);
    session.stream("G1 X10 Y-3 Z1 F500\nG2 X12 Y-1 R2\nG0 X5 Y2");
    assert_eq!(field(&report(&mut session), "MPos"), "5.000,2.000,1.000");
    let run = session.finish();
    assert_eq!(run.net_steps(), [(5 + 2) * 80, (5 - 2) * 80, 400]);
}

#[test]
fn limits_bind_axes_not_the_motors_of_crossed_belts() {
    let peaks = |program: &str| {
        let setup = setup::<3>(1);
        let mut memory = Memory::new(&setup);
        let mut session = Session::new(&mut memory, &setup, CoreXy);
        session.stream(BELTS);
        session.stream(program);
        session.finish().outcome.motors.map(|motor| motor.peak_hz)
    };
    let near = |rate: f64, wanted: f64| (rate - wanted).abs() <= 0.01 * wanted;
    // X may go at 10 mm/s, Y at 100 mm/s. Along X, both motors turn as fast as X.
    let [a, b, _] = peaks("G0 X20");
    assert!(near(a, 800.0) && near(b, 800.0), "{a} {b}");
    // Along the diagonal X is still the limit: only motor A turns, as fast as X and Y together.
    let [a, b, _] = peaks("G0 X20 Y20");
    assert!(near(a, 1600.0) && b == 0.0, "{a} {b}");
    // Along Y, Y's limit holds for both motors.
    let [a, b, _] = peaks("G0 Y40");
    assert!(near(a, 8000.0) && near(b, 8000.0), "{a} {b}");
}

#[test]
fn a_rotary_axis_has_degrees_in_inches_too() {
    let mut setup = setup::<4>(1);
    setup.machine.axes[3] = AxisKind::Rotary;
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream("$103=10\n$113=6000\n$123=500\n$110=6000\n$120=500");
    session.stream("G20 G0 X1 A90\nG91 G1 A-45 X0.5 F40");
    session.send(0, "?");
    session.until_quiet();
    let millimetres = session.heard(0).pop().unwrap();
    assert_eq!(field(&millimetres, "MPos"), "38.100,0.000,0.000,45.000");
    session.stream("$13=1");
    session.send(0, "?");
    session.until_quiet();
    let inches = session.heard(0).pop().unwrap();
    assert_eq!(field(&inches, "MPos"), "1.5000,0.0000,0.0000,45.000");
    let run = session.finish();
    assert_eq!(run.net_steps(), [9525, 0, 0, 450]);
}

#[test]
fn six_axes_move_at_once_and_each_has_its_settings() {
    let setup = setup::<6>(1);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream("$105=100\n$115=1200\n$125=200");
    let settings = session.say("$$\n");
    for row in [
        "$105=100.000",
        "$115=1200.000",
        "$125=200.000",
        "$135=200.000",
    ] {
        assert!(
            settings.iter().any(|line| line == row),
            "{row}: {settings:?}"
        );
    }
    session.stream("G1 X1 Y-1 Z2 A-2 B3 C-3 F600");
    session.send(0, "?");
    session.until_quiet();
    let report = session.heard(0).pop().unwrap();
    assert_eq!(
        field(&report, "MPos"),
        "1.000,-1.000,2.000,-2.000,3.000,-3.000"
    );
    let run = session.finish();
    assert_eq!(run.net_steps(), [250, -250, 500, -500, 750, -300]);
    let ends = [0, 1, 2, 3, 4, 5].map(|motor| {
        let mut cycles = run
            .steps
            .iter()
            .filter(|event| event.motors.contains(motor));
        let first = cycles.next().unwrap().cycle;
        (first, cycles.next_back().unwrap().cycle)
    });
    let latest_start = ends.map(|(first, _)| first).into_iter().max();
    let earliest_end = ends.map(|(_, last)| last).into_iter().min();
    assert!(latest_start < earliest_end, "one after the other: {ends:?}");
}

#[test]
fn an_answer_returns_to_its_line_and_a_message_goes_to_all() {
    let setup = setup::<3>(2);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    assert_eq!(session.heard(1), ["Grbl 1.1h ['$' for help]"]);
    session.send(1, "G21\nG77\n");
    session.until_quiet();
    assert_eq!(session.heard(1), ["ok", "error:20"]);
    assert!(session.heard(0).is_empty());
    assert_eq!(session.say("$C\n"), ["[MSG:Enabled]", "ok"]);
    assert_eq!(session.heard(1), ["[MSG:Enabled]"]);
    session.finish();
}

#[test]
fn one_line_owns_the_job_and_the_other_waits_until_it_is_done() {
    let setup = setup::<3>(2);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.heard(1);
    session.send(0, "G1 X4 F500\n");
    session.wait_us(100_000);
    session.send(1, "$G\nG1 X1 F500\n");
    session.wait_us(200_000);
    assert_eq!(session.heard(0), ["ok"]);
    let heard = session.heard(1);
    assert!(heard[0].starts_with("[GC:G1 "), "{heard:?}");
    assert_eq!(heard[1..], ["ok"], "G1 has been taken");
    session.send(0, "G1 X3\n");
    session.until_quiet();
    assert_eq!(session.heard(0), ["ok"]);
    assert_eq!(session.heard(1), ["ok"]);
    let run = session.finish();
    assert_eq!(run.net_steps(), [250, 0, 0]);
    assert_eq!(run.outcome.motors[0].pulses, 1000 + 250 + 500);
}

#[test]
fn realtime_bytes_act_from_either_line() {
    let setup = setup::<3>(2);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.heard(1);
    session.send(0, "G1 X10 F500\n");
    session.wait_us(1_000_000);
    session.send(1, "!");
    session.wait_us(2_000_000);
    session.send(1, "?");
    session.wait_us(1_000);
    let held = session.heard(1);
    assert!(held[0].starts_with("<Hold:0|"), "{held:?}");
    assert_eq!(session.heard(0), ["ok"]);
    session.send(1, "~");
    session.wait_us(500_000);
    session.send(0, "?");
    session.wait_us(1_000);
    let running = session.heard(0);
    assert!(running[0].starts_with("<Run|"), "{running:?}");
    assert!(session.heard(1).is_empty());
    session.send(1, "\x18");
    session.until_quiet();
    for line in [0, 1] {
        assert_eq!(session.heard(line)[0], "ALARM:3");
    }
    session.finish();
}

#[test]
fn a_startup_line_runs_after_a_reset_and_everybody_hears_of_it() {
    let setup = setup::<3>(2);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.heard(1);
    assert_eq!(session.say("$N0=G91G0X1\n"), ["ok"]);
    session.send(0, "\x18");
    session.until_quiet();
    for line in [0, 1] {
        let heard = session.heard(line);
        assert_eq!(heard, ["Grbl 1.1h ['$' for help]", ">G91G0X1:ok"]);
    }
    assert_eq!(session.finish().net_steps(), [250, 0, 0]);
}

#[test]
fn the_same_job_twice_steps_on_the_same_cycles() {
    let steps = || {
        let mut setup = setup::<3>(1);
        setup.lines = vec![Rate::Baud(NonZeroU32::new(115_200).unwrap())];
        let mut memory = Memory::new(&setup);
        let mut session = Session::new(&mut memory, &setup, Cartesian);
        session.stream(BELTS);
        session.stream(include_str!("golden/arc.nc"));
        session.stream(&"G91 G1 X0.3 Y0.1 F400\nX-0.2 Z0.05\n".repeat(100));
        session.finish().steps
    };
    let first = steps();
    assert!(first.len() > 1000, "only {} steps", first.len());
    assert!(first == steps(), "not the same twice");
}
