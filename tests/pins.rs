//! Signals that no recording with Grbl shows: laser power, the drivers' enable pin, step and
//! direction levels, at every edge.

use leadscrew_machine::config::MachineConfig;
use leadscrew_planner::Cartesian;
use leadscrew_sim::clock::CPU_HZ;
use leadscrew_sim::plant::Pin;
use leadscrew_sim::trouble::LateReason;
use leadscrew_sim::{Cycle, Memory};
use leadscrew_stepper::PowerScale;
use leadscrew_tests::{run_program, setup, Run, Session, Signal};

type Desk<'a> = Session<'a, Cartesian, 3>;

/// Steps in a millimetre by a new machine's settings.
const MM: usize = 250;

const LASER: &str = "$32=1\n$707=0\n$110=3000\n$111=3000\n$120=100\n$121=100\n";

/// Calls `then` with a laser machine.
fn with_laser(then: impl FnOnce(&mut Desk<'_>)) -> Run<3> {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream(LASER);
    then(&mut session);
    session.finish()
}

/// All changes of power in order, thousandths of full power.
fn powers(run: &Run<3>) -> Vec<u32> {
    power_changes(run)
        .into_iter()
        .map(|(_, power)| power)
        .collect()
}

fn power_changes(run: &Run<3>) -> Vec<(Cycle, u32)> {
    let powers = run
        .signals
        .iter()
        .filter_map(|(cycle, signal)| match signal {
            Signal::Power(power) => Some((*cycle, *power)),
            Signal::EnableHigh(_) | Signal::Flood(_) => None,
        });
    powers.collect()
}

/// Powers at which the steps were made, thousandths.
fn step_powers(run: &Run<3>) -> Vec<u32> {
    run.steps
        .iter()
        .map(|event| event.power.level(PowerScale::new(1000)))
        .collect()
}

#[test]
fn under_m3_each_step_has_the_power_of_its_line_and_a_rapid_has_none() {
    let run = run_program(
        LASER,
        "M3S500\nG0X1\nG1X2F600\nS800X3\nG0X4\nG1S300X5\nM5\n",
    );
    let expected = [0, 500, 800, 0, 300].map(|power| vec![power; MM]).concat();
    assert_eq!(step_powers(&run), expected);
    assert_eq!(powers(&run), [500, 800, 0, 300, 0]);
}

#[test]
fn under_m3_the_laser_is_on_at_rest_while_the_program_is_cutting() {
    let run = with_laser(|session| {
        for line in ["M3S500", "G1X1F600", "G0", "G1", "S300", "S0", "S200", "M5"] {
            assert_eq!(session.say(&format!("{line}\n")), ["ok"], "{line}");
        }
    });
    // Off in G0 (no edge), on at the cut and after it, off, on, 300, off, 200, off.
    assert_eq!(powers(&run), [500, 0, 500, 300, 0, 200, 0]);
}

/// The speed from each step event to the next one, mm/s. Motor 0 must make all of them.
fn speeds(run: &Run<3>) -> Vec<f64> {
    let pairs = run.steps.windows(2);
    pairs
        .map(|pair| CPU_HZ as f64 / (pair[1].cycle - pair[0].cycle) as f64 / MM as f64)
        .collect()
}

/// Checks that under M4, at every step, the power is S times the ratio of the speed to the feed.
fn assert_scaled(run: &Run<3>, s: f64, feed_mm_s: f64) {
    let speeds = speeds(run);
    let powers = step_powers(run);
    // The motion begins and ends at rest: the first and the last interval show no speed.
    for index in 2..speeds.len() - 2 {
        let expected = s * (speeds[index] / feed_mm_s).min(1.0);
        let found = f64::from(powers[index + 1]);
        assert!(
            (found - expected).abs() <= 0.03 * s,
            "step {index}: {found} at {} mm/s, not {expected}",
            speeds[index]
        );
    }
}

#[test]
fn under_m4_the_power_follows_the_speed_at_every_step_and_is_off_at_rest() {
    let run = run_program(LASER, "M4S800\nG1X10F1200\n");
    assert_scaled(&run, 800.0, 20.0);
    let top = step_powers(&run).into_iter().max();
    assert!(top >= Some(799), "{top:?}");
    let (off, power) = *power_changes(&run).last().unwrap();
    let last_step = run.steps.last().unwrap().cycle;
    assert_eq!(power, 0);
    assert!(off <= last_step + Cycle::from_micros(1_000).0, "{off}");
}

#[test]
fn under_m4_a_rapid_is_dark() {
    let run = run_program(LASER, "M4S800\nG0X4\nG1X8F1200\nG0X9\nM5\n");
    let powers = step_powers(&run);
    assert!(powers[..4 * MM].iter().all(|power| *power == 0));
    assert!(powers[4 * MM + MM..8 * MM - MM]
        .iter()
        .all(|power| *power > 100));
    assert!(powers[8 * MM + 1..].iter().all(|power| *power == 0));
}

#[test]
fn a_jog_has_the_power_of_g1_whatever_the_motion_mode_as_in_grbl() {
    // G1: the power is on before, during and after the jog, without an edge. G0: it goes on with
    // the jog, as the recording `laser_m3_g0_jog` shows, and off at its end; Grbl leaves it
    // on.
    let cut = with_laser(|session| {
        for line in ["M3S500", "G1X1F600", "$J=X2F600"] {
            assert_eq!(session.say(&format!("{line}\n")), ["ok"], "{line}");
        }
    });
    assert_eq!(step_powers(&cut), vec![500; 2 * MM]);
    assert_eq!(powers(&cut), [500]);
    let rapid = with_laser(|session| {
        for line in ["M3S500", "G0X1", "$J=X2F600"] {
            assert_eq!(session.say(&format!("{line}\n")), ["ok"], "{line}");
        }
    });
    assert_eq!(step_powers(&rapid), [[0; MM], [500; MM]].concat());
    assert_eq!(powers(&rapid), [500, 0]);
    // A jog that goes nowhere lights nothing.
    let still = with_laser(|session| {
        for line in ["M3S500", "G0X1", "$J=X1F600"] {
            assert_eq!(session.say(&format!("{line}\n")), ["ok"], "{line}");
        }
    });
    assert!(powers(&still).is_empty());
    let scaled = with_laser(|session| {
        for line in ["M4S500", "G1F600", "$J=X4F600"] {
            assert_eq!(session.say(&format!("{line}\n")), ["ok"], "{line}");
        }
    });
    assert_scaled(&scaled, 500.0, 10.0);
    assert_eq!(powers(&scaled).last(), Some(&0));
}

#[test]
fn a_hold_switches_the_laser_off_once_it_stands_and_a_resume_on_again() {
    for mode in ["M3", "M4"] {
        let mut held = Cycle::ZERO;
        let mut resumed = Cycle::ZERO;
        let run = with_laser(|session| {
            session.send(0, format!("{mode}S500\nG1X10F1200\n"));
            session.wait_us(300_000);
            session.send(0, "!");
            session.wait_us(400_000);
            held = session.sim.now();
            session.wait_us(400_000);
            resumed = session.sim.now();
            session.send(0, "~");
            session.until_quiet();
            let heard = session.heard(0);
            assert_eq!(heard, ["ok", "ok", "[MSG:Restoring spindle]"], "{mode}");
            session.say("M5\n");
        });
        let changes = power_changes(&run);
        let before = changes.iter().rfind(|(cycle, _)| *cycle < held);
        assert_eq!(before.map(|(_, power)| *power), Some(0), "{mode}");
        let between = |cycle: Cycle| held <= cycle && cycle < resumed;
        assert!(!changes.iter().any(|(cycle, _)| between(*cycle)), "{mode}");
        assert_eq!(run.net_steps()[0], 10 * MM as i64);
        match mode {
            "M3" => {
                // The last step of the hold is long, but it gets no more energy than one step.
                let last = run.steps.iter().rposition(|event| event.cycle < held);
                let mut by_step = step_powers(&run);
                assert!(by_step.remove(last.unwrap()) <= 500);
                assert_eq!(by_step, vec![500; 10 * MM - 1]);
                let mut levels = powers(&run);
                levels.retain(|level| [0, 500].contains(level));
                assert_eq!(levels, [500, 0, 500, 0]);
            }
            _ => {
                let pause = run.steps.iter().position(|event| event.cycle > resumed);
                let (first, second) = run.steps.split_at(pause.unwrap());
                for steps in [first, second] {
                    let part = Run {
                        outcome: run.outcome.clone(),
                        steps: steps.to_vec(),
                        pins: Vec::new(),
                        signals: Vec::new(),
                        powers: Vec::new(),
                    };
                    assert_scaled(&part, 500.0, 20.0);
                }
            }
        }
    }
}

#[test]
fn a_reset_and_a_limit_switch_take_the_power_off_before_another_step() {
    for limit in [false, true] {
        let mut cut = Cycle::ZERO;
        let run = with_laser(|session| {
            session.stream("$21=1");
            session.send(0, "M3S500\nG1X10F1200\n");
            session.wait_us(300_000);
            cut = session.sim.now();
            if limit {
                session.sim.set_pin(Pin::Limit(0), false);
            } else {
                session.send(0, "\x18");
            }
            session.until_quiet();
        });
        let changes = power_changes(&run);
        assert_eq!(powers(&run), [500, 0]);
        // Steps come every 200 µs: the interrupt for the next step switches the laser off instead.
        let off = changes[1].0;
        assert!(
            off <= cut + Cycle::from_micros(250).0,
            "{limit}: {off}, not {cut}"
        );
        assert!(
            run.steps.last().unwrap().cycle <= off,
            "{limit}: a step in the dark"
        );
    }
}

#[test]
fn segments_that_run_out_in_motion_are_counted_and_end_in_the_dark_with_an_alarm() {
    let mut setup = setup::<3>(1);
    // The main loop hangs for longer than the committed motion lasts.
    setup.costs.report = CPU_HZ as u32 / 50;
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream(LASER);
    session.send(0, "M3S500\nG1X10F1200\n");
    session.wait_us(300_000);
    assert_eq!(session.heard(0), ["ok", "ok"]);
    session.send(0, "?");
    session.until_quiet();
    let heard = session.heard(0);
    assert!(heard.iter().any(|line| line == "ALARM:3"), "{heard:?}");
    let stopped = session.sim.counted_position();
    session.send(0, "~G0X1\n");
    session.until_quiet();
    assert_eq!(session.heard(0), ["error:9"]);
    assert_eq!(session.sim.counted_position(), stopped, "moves in Alarm");
    let run = session.finish_late();
    let late = run.outcome.late.first();
    assert_eq!(run.outcome.late.count(), 1);
    assert_eq!(late[0].reason, LateReason::Underrun);
    let changes = power_changes(&run);
    assert_eq!(powers(&run), [500, 0]);
    // The interrupt that finds no segment switches off.
    assert!(changes[1].0 <= late[0].cycle + Cycle::from_micros(2).0);
    assert!((1..10 * MM as i64).contains(&run.net_steps()[0]));
}

/// Sixteen of the moves are planned or wait for room when the segments run out.
#[test]
fn what_was_to_come_when_segments_ran_out_is_refused_at_once_and_never_moves() {
    let mut setup = setup::<3>(1);
    setup.machine = MachineConfig::grbl();
    setup.costs.report = CPU_HZ as u32 / 50;
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream("G91\n");
    let moves = 40;
    session.send(0, "G1X5F500\n".repeat(moves));
    session.wait_us(2_000_000);
    session.send(0, "?");
    session.wait_us(50_000);
    let mut heard = session.heard(0);
    heard.retain(|line| !line.starts_with('<') && line != "ALARM:3");
    assert_eq!(heard.len(), moves, "{heard:?}");
    let refused = heard.iter().filter(|line| *line == "error:9").count();
    assert!((20..moves - 10).contains(&refused), "{heard:?}");
    let stopped = session.sim.counted_position();
    assert!(stopped[0] > 0);
    assert_eq!(session.say("$X\n"), ["[MSG:Caution: Unlocked]", "ok"]);
    assert_eq!(session.sim.counted_position(), stopped, "moves by itself");
    assert_eq!(session.say("G1X1F500\n"), ["ok"]);
    let moved = session.sim.counted_position()[0] - stopped[0];
    assert_eq!(moved, 250, "from where it stopped");
}

/// The levels of the enable pin in order, and when each began.
fn enables(run: &Run<3>) -> Vec<(Cycle, bool)> {
    let levels = run
        .signals
        .iter()
        .filter_map(|(cycle, signal)| match signal {
            Signal::EnableHigh(high) => Some((*cycle, *high)),
            Signal::Power(_) | Signal::Flood(_) => None,
        });
    let mut levels: Vec<_> = levels.collect();
    levels.dedup_by_key(|(_, high)| *high);
    levels
}

#[test]
fn drivers_are_enabled_at_every_step_and_for_the_set_time_after_the_last() {
    for (invert, delay_ms) in [
        (0, 0),
        (0, 25),
        (1, 25),
        (1, 0),
        (0, 254),
        (0, 255),
        (1, 255),
    ] {
        let on = invert == 1;
        let run = run_program(
            &format!("$1={delay_ms}\n$4={invert}\n"),
            "G1X0.4F300\nG4P0.5\nX0.1\nG4P0.5\n",
        );
        let levels = enables(&run);
        let level_at = |cycle: Cycle| {
            let before = levels.iter().rfind(|(since, _)| *since <= cycle);
            before.expect("a level from power-up on").1
        };
        for event in &run.steps {
            assert_eq!(level_at(event.cycle), on, "$1={delay_ms} $4={invert}");
        }
        let after = |event: usize| run.steps[event].cycle;
        for last in [after(99), after(run.steps.len() - 1)] {
            let off = levels
                .iter()
                .find(|(since, high)| *since > last && *high != on);
            match (delay_ms, off) {
                (255, None) => {}
                (255, Some((since, _))) => panic!("$1=255: off at {since}"),
                (_, None) => panic!("$1={delay_ms}: never off"),
                (_, Some((since, _))) => {
                    // The step interrupt stops one tick after the last step, and only then the main
                    // loop sees it.
                    let least = Cycle::from_micros(delay_ms * 1000).0;
                    let span = *since - last;
                    let slack = Cycle::from_micros(2_000).0 + 20_000 * 168;
                    assert!(
                        (least..least + slack).contains(&span),
                        "$1={delay_ms}: {span} cycles"
                    );
                }
            }
        }
    }
}

#[test]
fn every_edge_of_every_pin_is_inverted_by_its_bit_alone() {
    let program = "G91\nG1X0.1Y-0.06Z0.03F400\nX-0.1Y0.1\nZ-0.05X0.02\nY-0.04\n";
    let plain = run_program("", program);
    assert!(plain.pins.len() > 100);
    for mask in 0..8u8 {
        let steps = run_program(&format!("$2={mask}\n"), program);
        let turned = run_program(&format!("$3={mask}\n"), program);
        for run in [&steps, &turned] {
            assert_eq!(run.pins.len(), plain.pins.len());
            assert_eq!(run.steps.len(), plain.steps.len());
        }
        for (index, pins) in plain.pins.iter().enumerate() {
            let (step, direction) = (steps.pins[index], turned.pins[index]);
            assert_eq!(step.step, pins.step ^ mask, "$2={mask}, edge {index}");
            assert_eq!(step.direction, pins.direction, "$2={mask}, edge {index}");
            assert_eq!(
                direction.direction,
                pins.direction ^ mask,
                "$3={mask}, edge {index}"
            );
            assert_eq!(direction.step, pins.step, "$3={mask}, edge {index}");
        }
    }
}
