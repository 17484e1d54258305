//! A gantry with two motors on Y: skewed at power-up and square after homing, or too skewed to be
//! squared.

use leadscrew_machine::board::ChannelId;
use leadscrew_machine::state::{Lock, State};
use leadscrew_planner::Ganged;
use leadscrew_sim::profile::Profile;
use leadscrew_sim::Fixtures;
use leadscrew_sim::{Cycle, Host, Memory, Rate, Replies, Reply, Setup, Simulation, Stopped};
use leadscrew_sim::{Streamer, Streaming};
use std::path::Path;

const STEPS_PER_MM: i32 = 100;

type Gantry<'a> = Simulation<'a, Ganged<1>, (), 3, 4, 64>;

/// The lines that the machine has sent, without empty ones.
#[derive(Debug, Default)]
struct Heard(Vec<String>);

impl Replies for &mut Heard {
    fn reply(&mut self, reply: &Reply<'_>, _: Cycle) {
        self.0.extend(match reply {
            Reply::Ok { .. } => Some("ok".to_owned()),
            Reply::Error { code, .. } => Some(format!("error:{code}")),
            Reply::Alarm { code, .. } => Some(format!("ALARM:{code}")),
            Reply::Other(text) => {
                Some(String::from_utf8_lossy(text).into_owned()).filter(|text| !text.is_empty())
            }
        });
    }
}

/// A gantry whose second carriage is `skew` mm ahead of the first. The switch of Y is at 0, the
/// switch of the second motor at `second`.
fn profile(skew: f64, second: f64) -> Profile {
    let start = 20.0 + skew;
    let text = format!(
        r#"
        [homing]
        order = ["y"]
        [settings]
        "$21" = 1
        "$22" = 1
        "$23" = 2
        "$25" = 1500
        "$26" = 10
        "$27" = 2
        "$111" = 3000
        "$121" = 500
        [axes.y]
        steps_per_mm = {STEPS_PER_MM}
        travel = 80
        start = 20
        limits = {{ low = 0 }}
        [second_motor]
        axis = "y"
        start = {start}
        limits = {{ low = {second} }}
        "#
    );
    Profile::parse(Path::new("gantry.toml"), &text).unwrap()
}

/// Sends `lines` to the machine of a profile. Returns its answers, the places of Y's two carriages
/// (steps), and its state.
fn session(profile: &Profile, lines: &str) -> (Vec<String>, [i32; 2], State) {
    let mut heard = Heard::default();
    let streaming = Streaming {
        window: 128,
        keep_going: true,
    };
    let mut host = Streamer::new(lines.as_bytes(), streaming, &mut heard);
    let (places, state) = run(profile, &mut host);
    drop(host);
    (heard.0, places, state)
}

/// Runs the machine of a profile with `host` until nothing is left to happen.
fn run(profile: &Profile, host: &mut impl Host) -> ([i32; 2], State) {
    let setup = Setup::<3>::new(profile.config(), Rate::NeverWaits);
    let mut memory = Memory::new(&setup);
    let kinematics = Ganged { axis_of: [1] };
    let mut sim: Gantry<'_> = Simulation::new(&mut memory, &setup, kinematics, ());
    sim.place(profile.start());
    sim.mirror(profile.reversed());
    for switch in profile.plant_switches() {
        sim.add_switch(switch);
    }
    let stopped = sim.run_until(host, Cycle::from_micros(600_000_000));
    assert_eq!(stopped, Stopped::Quiet);
    let [_, first, _, second] = sim.board().plant.position();
    let state = sim.machine().state();
    let (outcome, ()) = sim.finish();
    assert!(outcome.violations.is_empty(), "{:?}", outcome.violations);
    ([first, second], state)
}

/// A host that asks for one status report.
#[derive(Default)]
struct Asker {
    asked: bool,
    heard: Vec<u8>,
}

impl Host for Asker {
    fn next_byte(&mut self, _: ChannelId) -> Option<u8> {
        (!std::mem::replace(&mut self.asked, true)).then_some(b'?')
    }

    fn receive(&mut self, _: ChannelId, byte: u8, _: Cycle) {
        self.heard.push(byte);
    }
}

#[test]
fn a_skewed_gantry_is_square_after_homing_and_stays_so() {
    for skew in [2.0, -2.0] {
        let (heard, [first, second], state) = session(&profile(skew, 0.0), "$H\n");
        assert!(
            !heard.iter().any(|line| line.starts_with("ALARM")),
            "{heard:?}"
        );
        assert_eq!(state, State::Idle);
        assert_eq!(first, second, "skewed by {skew} mm");
        // The carriages stand a pull-off away from the switches, which close at 0.
        assert_eq!(first, 2 * STEPS_PER_MM);
        let program = "$H\nG90G1Y-30F2000\nG0X1Y-70\nG91G1Y5.003F700\n";
        let (_, [first, second], _) = session(&profile(skew, 0.0), program);
        assert_eq!(first, second, "after moves");
        // Machine position 0 is the travel away from the switch; -64.997 mm are -6500 steps.
        assert_eq!(first, 80 * STEPS_PER_MM - 6_500);
    }
}

#[test]
fn motors_that_are_mounted_the_other_way_round_square_the_gantry_too() {
    for (first_reversed, second_reversed) in [(true, false), (false, true), (true, true)] {
        let mut profile = profile(2.0, 0.0);
        profile.axes.y.reversed = first_reversed;
        let second = profile.second_motor.as_mut();
        second.unwrap().reversed = second_reversed;
        let (heard, [first, second], _) = session(&profile, "$H\nG90G1Y-30F2000\n");
        assert_eq!(heard.last().unwrap(), "ok", "{heard:?}");
        assert_eq!([first, second], [50 * STEPS_PER_MM; 2]);
    }
    // Without its bit in `$3` the mirrored motor goes away from its switch.
    let mut profile = profile(2.0, 0.0);
    profile.second_motor.as_mut().unwrap().reversed = true;
    let (heard, ..) = session(&profile, "$3=0\n$H\n");
    assert!(heard.contains(&"ALARM:10".to_owned()), "{heard:?}");
}

#[test]
fn the_second_motor_goes_on_after_its_switch_by_its_offset() {
    for (offset, steps) in [("0.75", -75), ("-0.5", 50)] {
        let program = format!("$702={offset}\n$H\nG90G0Y-30\n");
        let (heard, [first, second], state) = session(&profile(1.0, 0.0), &program);
        assert_eq!(state, State::Idle, "{heard:?}");
        assert_eq!(second - first, steps, "{offset} mm");
    }
}

#[test]
fn two_switches_too_far_apart_are_alarm_10() {
    // The tolerance is 5 % of 80 mm, which is 4 mm.
    let (heard, _, state) = session(&profile(0.0, -3.9), "$H\n");
    assert_eq!(state, State::Idle, "{heard:?}");
    let (heard, [first, second], state) = session(&profile(0.0, -4.2), "$H\n");
    assert!(heard.contains(&"ALARM:10".to_owned()), "{heard:?}");
    assert_eq!(state, State::Alarm(Lock::Unlockable));
    assert_eq!(first, 0, "stopped at its switch");
    assert!((-410..=-400).contains(&second), "{second}");
}

#[test]
fn a_skew_that_homing_took_out_does_not_come_back_after_its_alarm() {
    let program = "$H\n$X\n$21=0\nG91G1Y10F500\n";
    let (heard, before, _) = session(&profile(0.0, -4.2), "$H\n");
    let (_, after, _) = session(&profile(0.0, -4.2), program);
    assert!(heard.contains(&"ALARM:10".to_owned()));
    assert_eq!(after, before.map(|steps| steps + 10 * STEPS_PER_MM));
}

#[test]
fn each_motor_has_its_own_direction_bit() {
    let program = "$22=0\n$3=8\n$X\nG91G1Y3F500\n";
    let (_, [first, second], _) = session(&profile(0.0, 0.0), program);
    assert_eq!([first, second], [2_300, 1_700]);
}

#[test]
fn reports_show_the_second_motor_s_switch_as_its_axis_s() {
    let mut host = Asker::default();
    run(&profile(-21.0, 0.0), &mut host);
    let heard = String::from_utf8(host.heard).unwrap();
    assert!(heard.contains("<Alarm|MPos:0.000,0.000,0.000|"), "{heard}");
    let pins = heard.split("|Pn:").nth(1).unwrap();
    assert!(pins.starts_with("Y|") || pins.starts_with("Y>"), "{heard}");
}
