//! The complaint of a run when the carriage of its machine would leave the frame.

use leadscrew_jobs::{Machine, Stream};
use leadscrew_sim::link::Rate;
use leadscrew_sim::profile::Profile;
use std::path::Path;

/// A laser with a switch at the low end of X; the frame ends 410 mm away from it.
const LASER: &str =
    "[homing]\non = true\norder = [\"xy\"]\nfeed_mm_min = 500\nseek_mm_min = 6000\n\
                     pull_off_mm = 2\n\
                     [axes.x]\ntravel = 410\nrate_mm_min = 12000\nacceleration_mm_s2 = 2000\n\
                     home = \"low\"\nstart = 35\nlimits = { low = 0 }\n\
                     [axes.y]\ntravel = 400\nrate_mm_min = 12000\nacceleration_mm_s2 = 2000\n\
                     home = \"low\"\nstart = 50\nlimits = { low = 0 }\n";

/// Runs a job. Returns how it ended, where X stands then on its own scale, and what was told.
fn run(file: &str, keep_going: bool, text: &str) -> (String, f64, Vec<String>) {
    let file = Profile::parse(Path::new("test.toml"), file).unwrap();
    let machine = Machine::new(file, &[]).unwrap();
    let stream = Stream {
        machine: &machine,
        rate: Rate::NeverWaits,
        keep_going,
        feed_percent: 100,
        keep_answers: false,
        warn: false,
        only_times: false,
        knows_place: true,
        tell: |_| {},
    };
    let done = stream.run("job.nc", text.as_bytes(), ()).unwrap();
    let told = done.errors.iter().map(ToString::to_string).collect();
    let went = done.outcome.motors[0].net_steps as f64 / 250.0;
    (done.end.words(), 35.0 + went, told)
}

#[test]
fn a_run_ends_before_the_line_that_leads_out_of_the_frame() {
    // The carriage stands at 35 mm: 375 mm are left.
    let (end, at, told) = run(LASER, false, "G0 X100\nG0 X375\nG0 X375.1\nG0 X0\n");
    let words = "stopped by error (the carriage leaves its frame) at line 3";
    assert_eq!((end.as_str(), at), (words, 410.0));
    assert_eq!(told.len(), 1);
    let place = "X would be at 410.100 mm on the axis' own scale, its frame ends at 410.000 mm";
    assert!(told[0].contains(place), "{}", told[0]);
    // The low end has a switch, and hard limits are off: nothing else would stop it.
    let (end, at, _) = run(LASER, false, "G0 X-35\nG0 X-36\n");
    assert!(end.ends_with("frame) at line 2"), "{end}");
    assert_eq!(at, 0.0);
    // It is told once, and the job goes on if it is to.
    let (end, _, told) = run(LASER, true, "G0 X380\nX390\nX0\n");
    assert_eq!((end.as_str(), told.len()), ("done, 1 line refused", 1));
}

#[test]
fn a_run_knows_the_place_after_homing() {
    // 2 mm from the switch the machine counts -408.
    let (end, at, told) = run(LASER, false, "$H\nG0 X0\n");
    assert_eq!((end.as_str(), &told[..]), ("done", &[][..]));
    assert!((at - 410.0).abs() < 0.05, "{at}");
    let (end, at, _) = run(LASER, false, "$H\nG92 X0\nG0 X400\nG0 X409\n");
    assert!(end.ends_with("frame) at line 4"), "{end}");
    assert!((at - 402.0).abs() < 0.05, "{at}");
}

#[test]
fn a_switch_that_stops_motion_speaks_for_itself() {
    let hard = format!("{LASER}limits.high = 404\n").replace(
        "limits = { low = 0 }\nlimits.high",
        "limits = { low = 0, high",
    );
    let hard = hard.replace("high = 404\n", "high = 404 }\n");
    let hard = format!("[bounds]\nhard = true\n{hard}");
    let (end, _, told) = run(&hard, false, "G0 Y380\n");
    assert_eq!(
        (end.as_str(), &told[..]),
        ("stopped by ALARM:1 at line 1", &[][..])
    );
    let soft = hard.replace("hard = true", "hard = false");
    let (end, _, _) = run(&soft, false, "G0 Y380\n");
    assert!(
        end.ends_with("(the carriage leaves its frame) at line 1"),
        "{end}"
    );
}

#[test]
fn a_machine_without_switches_may_go_anywhere() {
    let (end, at, _) = run("", false, "G0 X9000 F1\n");
    assert_eq!((end.as_str(), at), ("done", 9035.0));
    // A scale of its own tells nothing of the place.
    let own = LASER.replace("[axes.x]\n", "[settings]\n\"$100\" = 100\n[axes.x]\n");
    let (end, _, _) = run(&own, false, "G0 X400\n");
    assert_eq!(end, "done");
}

#[test]
fn a_switch_for_homing_alone_may_be_passed_and_the_far_end_may_not() {
    let homing = LASER.replace("low = 0 }\n", "low = 0 }\nstops = \"homing\"\n");
    let homing = format!("[bounds]\nhard = true\n{homing}");
    assert_eq!(run(&homing, false, "G0 X-36\n").0, "done");
    let (end, _, _) = run(&homing, false, "G0 X376\n");
    assert!(
        end.ends_with("(the carriage leaves its frame) at line 1"),
        "{end}"
    );
}

#[test]
fn a_run_knows_the_place_after_homing_to_a_zero_of_the_owner_s() {
    // The switch is at 10: 2 mm from it the machine counts 12, and the frame ends at 420.
    let own = LASER.replace("travel = 410\n", "travel = 410\nhome_place_mm = 10\n");
    let (end, at, told) = run(&own, false, "$H\nG53 G0 X420\n");
    assert_eq!((end.as_str(), &told[..]), ("done", &[][..]));
    assert!((at - 410.0).abs() < 0.05, "{at}");
    let (end, _, told) = run(&own, false, "$H\nG53 G0 X420.1\n");
    assert!(end.ends_with("at line 2"), "{end}");
    assert!(told[0].contains("X would be at 410.1"), "{}", told[0]);
    // Homing leaves the switch by the axis' own way.
    let off = own.replace(
        "home_place_mm = 10\n",
        "home_place_mm = 10\nhome_pull_off_mm = 5\n",
    );
    let (_, at, _) = run(&off, false, "$H\n");
    assert!((at - 5.0).abs() < 0.05, "{at}");
}

#[test]
fn a_run_goes_on_from_where_a_probe_has_touched() {
    // The plate is 8.5 mm up; the probe's way would end far below the frame.
    let file = "[homing]\non = true\norder = [\"z\"]\nfeed_mm_min = 500\nseek_mm_min = 2000\n\
                pull_off_mm = 2\n[probe]\nplate_height = 8.5\n[axes.z]\ntravel = 80\n\
                rate_mm_min = 2000\nacceleration_mm_s2 = 200\nstart = 60\nlimits = { high = 84 }\n";
    let job = "$H\nG38.2 Z-100 F900\nG10 L20 P1 Z0\nG0 Z10\nG0 Z70\nG0 Z80\n";
    let (end, _, told) = run(file, false, job);
    let words = "stopped by error (the carriage leaves its frame) at line 6";
    assert_eq!(end, words, "{told:?}");
    assert!(told[0].contains("Z would be at 88.5"), "{}", told[0]);
}
