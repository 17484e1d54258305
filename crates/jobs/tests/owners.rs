//! The wishes of owners beyond Grbl, in a machine file: what a check, a run and a time say of it.

use leadscrew_jobs::{follow, time, Machine, Stream};
use leadscrew_sim::link::Rate;
use leadscrew_sim::profile::Profile;
use std::path::Path;

fn machine(file: &str) -> Machine {
    Machine::new(Profile::parse(Path::new("test.toml"), file).unwrap(), &[]).unwrap()
}

/// The faults that a check finds, as text.
fn check(file: &str, text: &str) -> Vec<String> {
    let mut checker = follow("job.nc", &machine(file));
    let mut faults = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        faults.extend(
            checker
                .check(number, line.as_bytes())
                .map(|fault| fault.to_string()),
        );
    }
    faults
}

/// Returns how a run ends.
fn run(file: &str, text: &str) -> String {
    let machine = machine(file);
    let stream = Stream {
        machine: &machine,
        rate: Rate::NeverWaits,
        keep_going: false,
        feed_percent: 100,
        keep_answers: false,
        warn: false,
        only_times: false,
        knows_place: true,
        tell: |_| {},
    };
    stream
        .run("job.nc", text.as_bytes(), ())
        .unwrap()
        .end
        .words()
}

/// A router whose Z has its switch at the top, 40 mm above its place; `z` is more of Z.
fn router(z: &str) -> String {
    format!(
        "[bounds]\nhard = true\nsoft = true\n[homing]\non = true\norder = [\"z\"]\nseek_mm_min = 3000\n\
         feed_mm_min = 300\ndebounce_ms = 2\n[axes.z]\ntravel = 80\nrate_mm_min = 3000\n\
         acceleration_mm_s2 = 500\nstart = 60\nlimits = {{ high = 100 }}\n{z}"
    )
}

#[test]
fn the_usual_first_line_of_cam_is_safe_after_homing_if_zero_is_below_the_switch() {
    let job = "$H\nG90 G94\nG17\nG21\nG28 G91 Z0\nG90\nM2\n";
    let end = run(&router(""), job);
    assert!(end.starts_with("stopped by ALARM:1"), "{end}");
    let own = router("home_place_mm = 3\n");
    assert_eq!(run(&own, job), "done");
    assert_eq!(check(&own, job), [""; 0]);
}

#[test]
fn a_check_has_the_travel_where_the_owner_s_zero_puts_it() {
    let own = router("home_place_mm = 3\n");
    let beyond = |line: &str| check(&own, line).concat();
    assert_eq!(beyond("G53 G0 Z3\nG53 G0 Z-77\n"), "");
    for (line, words) in [
        (
            "G53 G0 Z3.1\n",
            "Z would be at 3.100 mm, its travel is -77.000 to 3",
        ),
        (
            "G53 G0 Z-77.1\n",
            "Z would be at -77.100 mm, its travel is -77.000 to 3",
        ),
    ] {
        let told = beyond(line);
        assert!(told.contains(words), "{told}");
    }
    // Positive space: the low end has the switch, and it is zero.
    let positive = router("home = \"low\"\nhome_place_mm = 0\n");
    assert_eq!(check(&positive, "G53 G0 Z0\nG53 G0 Z80\n"), [""; 0]);
    assert_eq!(check(&positive, "G53 G0 Z80.1\nG53 G0 Z-0.1\n").len(), 2);
}

#[test]
fn a_check_and_a_run_take_arcs_as_far_as_the_machine_does() {
    let arc = "G2 X2 Y0 I1.02 J0 F3000\n";
    let told = check("", arc).concat();
    let words = "the radii of the arc at its ends differ by 0.04 mm";
    assert!(told.contains(words), "{told}");
    assert!(run("", arc).starts_with("stopped by error:33"));
    for allowed in ["arc_mismatch_mm = 0.05", "arc_mismatch_percent = 4"] {
        let file = format!("[path]\n{allowed}\n");
        assert_eq!(check(&file, arc), [""; 0]);
        assert_eq!(run(&file, arc), "done");
    }
}

#[test]
fn a_check_ends_jogs_at_the_travel_if_the_machine_does() {
    let jogs = "$J=G91 Z-500 F1000\n$J=G90 G53 Z-80 F1000\n$J=G91 Z1 F100\n";
    assert_eq!(check(&router(""), jogs).len(), 1);
    let ends = router("").replace("[bounds]\n", "[bounds]\njogs_end = true\n");
    assert_eq!(check(&ends, jogs), [""; 0]);
}

#[test]
fn the_time_of_a_job_has_the_times_of_its_spindle() {
    let job = "M3 S6000\nG1 X1 F600\nS8000\nM5\nM2\n";
    let took = |spindle: &str| {
        let file = format!("[spindle]\nmax_rpm = 10000\n{spindle}");
        time(&machine(&file), Rate::NeverWaits, "job.nc", job.as_bytes()).unwrap()
    };
    let with = took("run_up_s = 1\nrun_up_s_by_1000_rpm = 0.5\nrun_down_s = 2\n");
    let longer = with.job_seconds - took("").job_seconds;
    assert!((longer - (1.0 + 3.0 + 1.0 + 2.0)).abs() < 0.05, "{longer}");
}

#[test]
fn a_wrong_value_is_told_with_its_range() {
    for (file, words) in [
        ("[path]\narc_mismatch_mm = -1\n", "0 or more"),
        ("[spindle]\nrun_up_s = -2\n", "0 or more"),
        (
            "[axes.x]\nhome_place_mm = 2000000\n",
            "between -1e6 and 1e6 mm",
        ),
        ("[axes.x]\nhome_seek_mm_min = 0\n", "above 0"),
        ("[bounds]\njogs_end = 3\n", "true or false"),
    ] {
        let told = match Profile::parse(Path::new("test.toml"), file) {
            Err(wrong) => wrong.to_string(),
            Ok(file) => Machine::new(file, &[]).unwrap_err().to_string(),
        };
        assert!(told.contains(words), "{file}: {told}");
    }
}
