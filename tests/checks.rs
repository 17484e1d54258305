//! The rules of the pins: pulse width and direction set-up, inverted levels, holds and resets in
//! motion.

use leadscrew_planner::Cartesian;
use leadscrew_sim::Memory;
use leadscrew_tests::{run_program, setup, Session};

/// 22 kHz at 250 steps/mm: even with the longest pulse there is time to set up a direction.
const FAST: &str = "$110=5280\n$111=5280\n$112=5280\n$120=1000\n$121=1000\n$122=1000\n";

/// The time by which a pulse may be longer than asked for, because an interrupt ends it, µs.
const INTERRUPT: f64 = 0.5;

/// The time within which the main loop acts on a reset, µs: less than two steps at 20 kHz.
const MAIN_LOOP: u64 = 20;

#[test]
fn pulses_are_as_wide_as_asked_and_directions_settle_as_long() {
    // Y reverses at each corner at full speed: a large `$11` lets it take corners fast.
    let settings = FAST.to_owned() + "$11=20\n$120=8000\n$121=8000\n";
    let zigzag = "G91\n".to_owned() + &"G1 X2 Y2 F9000\nX2 Y-2\n".repeat(4);
    for micros in 3..=20 {
        let outcome = run_program(&format!("$0={micros}\n{settings}"), &zigzag).outcome;
        let (pulse, settled) = (outcome.min_pulse_us, outcome.min_direction_setup_us);
        let (pulse, settled) = (pulse.unwrap(), settled.unwrap());
        let asked = f64::from(micros);
        assert!(
            (asked..asked + INTERRUPT).contains(&pulse),
            "$0={micros}: pulse {pulse} us"
        );
        assert!(settled < 60.0, "never turns round at speed: {settled} us");
        assert!(
            settled >= asked,
            "$0={micros}: direction {settled} us before the step"
        );
    }
}

#[test]
fn inverted_step_pins_pulse_low_and_inverted_directions_turn_the_other_way() {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream("$2=1\n$3=2");
    session.stream("G1 X1 Y1 Z-1 F300");
    assert_eq!(session.sim.counted_position(), [250, 250, -250]);
    assert_eq!(session.sim.board().plant.position(), [250, -250, -250]);
    let run = session.finish();
    assert_eq!(run.net_steps(), [250, 250, -250]);
    let pins = &run.pins;
    let pulses = pins.iter().filter(|pins| pins.pulse);
    let rests = pins.iter().filter(|pins| !pins.pulse);
    assert_eq!((pulses.clone().count(), rests.clone().count()), (250, 250));
    for pins in pulses {
        // All three motors step at once: inverted X is low, Y and Z are high. Y moves in the
        // positive direction, but its inverted direction pin is high.
        assert_eq!((pins.step, pins.direction), (0b110, 0b110), "{pins:?}");
    }
    for pins in rests {
        assert_eq!(pins.step, 0b001, "{pins:?}");
    }
}

#[test]
fn a_line_that_is_held_and_resumed_ends_at_its_exact_target() {
    for after_us in [100_000, 700_000, 1_000_003, 1_900_000] {
        let setup = setup::<3>(1);
        let mut memory = Memory::new(&setup);
        let mut session = Session::new(&mut memory, &setup, Cartesian);
        session.stream("$100=80.37\n$120=50");
        session.send(0, "G1 X17.3 Y3.1 F500\nG1 X0.123 Y-1\n");
        session.wait_us(after_us);
        session.send(0, "!");
        session.wait_us(1_000_000);
        let held = session.sim.counted_position();
        session.wait_us(1_000_000);
        assert_eq!(session.sim.counted_position(), held, "moves in a hold");
        assert!(held[0] > 0 && held[0] < 1390, "not in the middle: {held:?}");
        session.send(0, "~");
        session.until_quiet();
        assert_eq!(session.heard(0), ["ok", "ok"]);
        let run = session.finish();
        assert_eq!(run.net_steps(), [10, -250, 0]);
    }
}

#[test]
fn a_reset_in_motion_stops_at_once_and_the_position_is_where_the_carriage_is() {
    for after_us in [30_000, 77_777, 150_000] {
        let setup = setup::<3>(1);
        let mut memory = Memory::new(&setup);
        let mut session = Session::new(&mut memory, &setup, Cartesian);
        session.stream(FAST);
        session.send(0, "G1 X40 Y10 F4800\n");
        session.wait_us(after_us);
        session.heard(0);
        session.send(0, "\x18");
        session.wait_us(MAIN_LOOP);
        let stopped = session.sim.board().plant.position();
        session.until_quiet();
        assert_eq!(session.sim.board().plant.position(), stopped);
        assert_eq!(session.sim.counted_position(), stopped);
        assert!(stopped[0] > 0 && stopped[0] < 10_000, "{stopped:?}");
        let mpos = stopped.map(|steps| format!("{:.3}", f64::from(steps) / 250.0));
        assert_eq!(session.heard(0)[0], "ALARM:3");
        session.send(0, "?$X\nG91G1X1F600\n");
        session.until_quiet();
        let heard = session.heard(0);
        let expected = format!("<Alarm|MPos:{}", mpos.join(","));
        assert!(heard[0].starts_with(&expected), "{heard:?}, not {expected}");
        let run = session.finish();
        let net = stopped.map(i64::from);
        assert_eq!(run.net_steps(), [net[0] + 250, net[1], net[2]]);
    }
}
