//! Machines that behave as their machine files describe.

use crate::served::Served;

/// A gantry that is square at power-up, and whose second switch closes `apart` mm below the first.
fn gantry(apart: f64, squaring: &str) -> String {
    format!(
        "[homing]\norder = [\"y\"]\n[settings]\n\"$22\"=1\n\"$23\"=2\n\"$24\"=300\n\"$25\"=3000\n\"$26\"=10\n\"$27\"=2\n\
         \"$111\"=3000\n\"$121\"=500\n[axes.y]\nsteps_per_mm = 100\ntravel = 80\nstart = 10\nlimits = {{ low = 0 }}\n\
         [second_motor]\naxis = \"y\"\nstart = 10\nlimits = {{ low = -{apart} }}\n{squaring}\n"
    )
}

/// The tolerance is 5 % of the travel, which is 4 mm.
#[test]
fn a_gantry_is_squared_or_refused_as_its_profile_says() {
    let table = [
        (3.9, "", true),
        (4.2, "", false),
        (3.9, "squaring = { most = 3 }", false),
        (4.2, "squaring = { tolerance = 0.1 }", true),
        (4.2, "squaring = { least = 5 }", true),
    ];
    for (apart, squaring, is_square) in table {
        let served = Served::tcp(&gantry(apart, squaring), 20.0);
        let mut client = served.connect();
        let heard = client.say("$H");
        let alarm = heard.iter().any(|line| line == "ALARM:10");
        assert_eq!(alarm, !is_square, "{apart} mm, {squaring}: {heard:?}");
        if alarm {
            client.expect("Grbl 1.1h ['$' for help]");
            client.expect("[MSG:'$H'|'$X' to unlock]");
        }
        let report = client.wait_for(if is_square { "Idle" } else { "Alarm" });
        let home = report.contains("|MPos:0.000,-78.000,0.000|");
        assert_eq!(home, is_square, "{apart} mm, {squaring}: {report}");
        let build = client.say("$I");
        assert!(build[1].starts_with("[OPT:V2,"), "{build:?}");
    }
}

#[test]
fn crossed_belts_home_and_move_as_their_profile_says() {
    let belts = "kinematics = \"corexy\"\n[homing]\norder = [\"xy\"]\n[settings]\n\"$22\"=1\n\"$23\"=3\n\"$24\"=300\n\"$25\"=3000\n\
                 \"$26\"=10\n\"$27\"=2\n\"$110\"=3000\n\"$111\"=3000\n\"$120\"=500\n\"$121\"=500\n\
                 [axes.x]\nsteps_per_mm = 100\ntravel = 80\nstart = 10\nlimits = { low = 0 }\n\
                 [axes.y]\nsteps_per_mm = 100\ntravel = 60\nstart = 20\nlimits = { low = 0 }\n";
    let served = Served::tcp(belts, 20.0);
    let mut client = served.connect();
    assert_eq!(client.say("$H"), [""; 0]);
    let report = client.wait_for("Idle");
    assert!(report.contains("|MPos:-78.000,-58.000,0.000|"), "{report}");
    let build = client.say("$I");
    assert!(build[1].starts_with("[OPT:VC,"), "{build:?}");
    assert_eq!(client.say("$J=G91X5.5Y-1F2000"), [""; 0]);
    let report = client.wait_for("Idle");
    assert!(report.contains("|MPos:-72.500,-59.000,0.000|"), "{report}");
}

#[test]
fn a_sender_sees_temperatures_and_the_state_of_a_tool_change_as_the_profile_says() {
    for (shown, state) in [("hold", "Hold:0"), ("tool", "Tool")] {
        let profile = format!(
            "[heaters.nozzle]\nsensor = \"ad595\"\n[fan]\nfitted = true\n[tool_change]\nshown = \"{shown}\"\n"
        );
        let served = Served::tcp(&profile, 20.0);
        let mut client = served.connect();
        assert!(client.wait_for("Idle").contains("|Heat:N,22.0,0.0|T:0"));
        assert_eq!(client.say("M106 S128"), [""; 0]);
        client.send(b"M109 S60\n");
        assert!(client.wait_for("Run").contains(",60.0"));
        client.expect("ok");
        client.send(b"T3 M6 (0.8 mm)\n");
        client.expect("[MSG:Tool 3: 0.8 mm, then ~]");
        client.wait_for(state);
        client.send(b"~");
        client.expect("ok");
        let report = client.wait_for("Idle");
        assert!(report.contains("|T:3"), "{report}");
    }
}
