//! The complaints of a check about a program that the machine would take: likely mistakes with the
//! laser, the spindle and the feed, and places that the machine cannot reach.

use leadscrew_jobs::{follow, read_through, settings_file, Machine};
use leadscrew_sim::profile::Profile;
use serde_json::Value;
use std::path::Path;

const LASER: &str = "[homing]\non = true\norder = [\"xy\"]\n[laser]\non = true\nfull_power = 1000\n\
                     [axes.x]\ntravel = 410\nrate_mm_min = 12000\nhome = \"low\"\nlimits = { low = 0 }\n\
                     [axes.y]\ntravel = 400\nrate_mm_min = 12000\nhome = \"low\"\nlimits = { low = 0 }\n";
const ROUTER: &str = "[homing]\non = true\npull_off_mm = 2\n[bounds]\nhard = true\n\
                      [axes.x]\ntravel = 400\nrate_mm_min = 3000\nhome = \"low\"\nlimits = { low = 0 }\n\
                      [axes.y]\ntravel = 400\nrate_mm_min = 3000\nhome = \"low\"\nlimits = { low = 0 }\n\
                      [axes.z]\ntravel = 80\nlimits = { high = 84 }\n";

/// The findings of a check: line and kind of each warning, line and code of each error.
fn found(file: &str, settings: &[&str], text: &str) -> Vec<(u64, String)> {
    let file = Profile::parse(Path::new("test.toml"), file).unwrap();
    let lines: Vec<_> = settings
        .iter()
        .map(|line| settings_file::option(line).unwrap())
        .collect();
    let machine = Machine::new(file, &lines).unwrap();
    let mut checker = follow("job.nc", &machine);
    let report = read_through(&mut *checker, "job.nc", text.as_bytes(), |_| {}).unwrap();
    let json = serde_json::to_value(report.json()).unwrap();
    let each = |list: &str, key: &str| -> Vec<(u64, String)> {
        let all = json[list].as_array().unwrap().iter();
        let name = |value: &Value| value.to_string().trim_matches('"').to_owned();
        all.map(|one| (one["line"].as_u64().unwrap(), name(&one[key])))
            .collect()
    };
    [each("errors", "code"), each("warnings", "kind")].concat()
}

fn expect(file: &str, settings: &[&str], text: &str, expected: &[(u64, &str)]) {
    let expected: Vec<_> = expected
        .iter()
        .map(|(line, kind)| (*line, (*kind).to_owned()))
        .collect();
    assert_eq!(found(file, settings, text), expected, "{text}");
}

#[test]
fn a_laser_that_stays_lit_is_told() {
    let cut = "G21 G90\nM3 S500\nG1 X20 F1000\nG1 Y20\n";
    expect(LASER, &[], cut, &[(4, "left_on")]);
    for end in ["M5", "M2", "M30", "G0 X0", "M4", "S0", "G1 X5 S0"] {
        expect(LASER, &[], &format!("{cut}{end}\n"), &[]);
    }
    expect(LASER, &[], &cut.replace("M3", "M4"), &[]);
    expect("", &["$110=2000", "$111=2000"], cut, &[]);
}

#[test]
fn power_beyond_its_range_is_told() {
    let job = |s: &str| format!("M4\nG1 X5 F1000 S{s}\nX9\nX10\nM5\n");
    expect(LASER, &[], &job("1200"), &[(2, "above_full_power")]);
    expect(LASER, &[], &job("1000"), &[]);
    expect(LASER, &[], &job("255"), &[(2, "eight_bit_power")]);
    expect(LASER, &[], &job("256"), &[]);
    expect(LASER, &["$30=255"], &job("255"), &[]);
}

#[test]
fn power_without_its_command_and_the_other_way_round_are_told() {
    expect(
        LASER,
        &[],
        "G1 X5 F1000 S800\nX9\n",
        &[(1, "power_without_start")],
    );
    expect(
        LASER,
        &[],
        "M4\nG1 X5 F1000\nX9\n",
        &[(1, "start_without_power")],
    );
    expect(LASER, &[], "M4 S0\nG1 X5 F1000\nX9 S800\nM5\nG1 X0\n", &[]);
    expect(
        "",
        &[],
        "M3\nG1 X5 F500\nM5\n",
        &[(1, "start_without_power")],
    );
    expect("", &[], "G1 X5 F500\n", &[]);
}

#[test]
fn a_feed_above_the_rates_of_the_axes_is_told_once() {
    let rates = ["$110=1000", "$111=1000", "$112=300"];
    expect("", &rates, "G1 X5 F1100\nX9 F1200\n", &[(1, "above_rate")]);
    // Along the diagonal both axes together are faster than each of them.
    expect("", &rates, "G1 X5 Y5 F1400\n", &[]);
    expect(
        "",
        &rates,
        "G1 X5 F1000\nZ1 F300\nZ0 F400\n",
        &[(3, "above_rate")],
    );
    expect("", &rates, "G20\nG1 X5 F50\n", &[(2, "above_rate")]);
    expect(
        "",
        &rates,
        "G1 X5 F1000\n$110=500\nX0\n",
        &[(2, "setting"), (3, "above_rate")],
    );
}

#[test]
fn a_job_that_is_longer_than_the_travel_is_an_error_wherever_its_zero_is() {
    expect(LASER, &[], "G0 X-20\nG1 X390 F500\n", &[]);
    expect(
        LASER,
        &[],
        "G0 X-20\nG1 X430 F500\nX440\nG1 Y500\n",
        &[(2, "0"), (4, "0")],
    );
    expect(LASER, &[], "G0 X-220\nG2 X220 I220 F500\n", &[(2, "0")]);
    // Another zero, machine coordinates: nothing is known.
    expect(LASER, &[], "G0 X-20\nG92 X0\nG1 X390 F500\n", &[]);
    expect(LASER, &[], "G53 G0 X-400\nG0 X300\n", &[]);
    // A machine without homing does not know its travel.
    expect("", &[], "G0 X-20\nG1 X430 F500\n", &[]);
}

#[test]
fn places_are_known_after_homing() {
    expect(ROUTER, &[], "$H\nG21 G90\nG1 X60 F1000\n", &[(3, "1")]);
    expect(
        ROUTER,
        &[],
        "$H\nG21 G90\nG1 X-60 Y-300 F1000\nG0 Z-70\n",
        &[],
    );
    expect(LASER, &[], "$H\nG1 X60 F1000\n", &[(2, "outside_travel")]);
    expect(ROUTER, &["$20=1"], "$H\nG1 X60 F1000\n", &[(2, "2")]);
    expect(
        ROUTER,
        &[],
        "$H\nG10 L20 P1 X0 Y0 Z0\nG1 X60 F400\nZ-70\n",
        &[],
    );
}

#[test]
fn the_usual_first_line_of_a_cam_program_leads_onto_the_switch() {
    let onto = |line: u64| [(line, "onto_switch")];
    expect(ROUTER, &[], "G90 G94\nG28 G91 Z0\nG90\n", &onto(2));
    expect(ROUTER, &[], "$H\nG53 G0 Z0\nG53 Z0\n", &onto(2));
    expect(ROUTER, &[], "$H\nG53 G0 X-400\n", &onto(2));
    expect(
        ROUTER,
        &[],
        "$H\nG53 G0 Z-2\nG28.1\nG0 Z-9\nG28 G91 Z0\n",
        &[],
    );
    expect(ROUTER, &["$21=0"], "G28 G91 Z0\n", &[]);
}

#[test]
fn a_job_that_is_farther_from_its_zero_than_the_travel_is_an_error() {
    // An axis of 410 mm; work zero lies somewhere in it.
    for job in [
        "G21 G90\nG1 X450 F3000\n",
        "G21 G90\nG0 X-411\n",
        "G91\nG0 X300\nX111\n",
        "G20\nG0 X17\n",
        "G0 X450\nX460\n",
        "G0 X300\nG3 X300 Y20 I60 J10 F500\n",
    ] {
        let [(_, code)] = &found(LASER, &[], job)[..] else {
            panic!("{job}: {:?}", found(LASER, &[], job));
        };
        assert_eq!(code, "0", "{job}");
    }
    let fits = [
        "G0 X410\n",
        "G0 X-410\n",
        "G20\nG0 X16\n",
        // The program sets a zero: it may lie outside.
        "G92 X100\nG0 X450\n",
        "G10 L2 P1 X-500\nG0 X450\n",
        "G55\nG0 X450\n",
        // A probe ends where it touches; nothing moves in check mode.
        "G38.3 X-450 F100\n",
        "$C\nG0 X450\n",
    ];
    for job in fits {
        expect(LASER, &[], job, &[]);
    }
}

#[test]
fn a_travel_that_somebody_has_set_is_known_without_homing() {
    let named = "[axes.x]\ntravel = 300\nrate_mm_min = 3000\n";
    expect(named, &[], "G0 X310\n", &[(1, "0")]);
    expect("", &["$130=300"], "G0 X310\n", &[(1, "0")]);
    expect("", &["$130=300"], "G0 X300 Y500\n", &[]);
    let turns = "[axes.a]\nrotary = true\ntravel = 360\n";
    expect(turns, &[], "G0 A3600\n", &[]);
}

#[test]
fn g28_and_g30_without_axes_lead_onto_the_switch_too() {
    for line in ["G30", "G28", "G28 Z0"] {
        let job = format!("$H\n{line}\nM2\n");
        let found = found(ROUTER, &[], &job);
        assert!(
            found.contains(&(2, "onto_switch".to_owned())),
            "{line}: {found:?}"
        );
    }
}

#[test]
fn m3_with_its_s_is_not_told_to_lack_it_whatever_follows() {
    expect(LASER, &[], "M3 S500\nG0 X10\nM5\nM2\n", &[]);
    expect(LASER, &[], "M3 S500\nG1 X10\nM5\nM2\n", &[(2, "22")]);
}

#[test]
fn a_jog_that_soft_limits_do_not_stop_runs_into_the_switch() {
    expect(ROUTER, &[], "$H\n$J=G91 X500 F1000\n", &[(2, "1")]);
    expect(ROUTER, &["$20=1"], "$H\n$J=G91 X500 F1000\n", &[(2, "15")]);
}

#[test]
fn the_place_where_a_probe_touches_is_not_guessed() {
    let job = "$H\nG38.2 Z-100 F100\nG10 L20 P1 Z8.5\nG0 Z10\nG0 Z-40\nM2\n";
    expect(ROUTER, &[], job, &[(2, "outside_travel")]);
    expect(ROUTER, &["$20=1"], "$H\nG38.2 Z-100 F100\n", &[(2, "2")]);
}

#[test]
fn a_shift_by_g92_does_not_make_room() {
    let job = |shift: &str| format!("G0 X300\n{shift}\nG0 X300\n");
    for shift in ["G92 X0", "G10 L20 P1 X0"] {
        expect(ROUTER, &[], &job(shift), &[(3, "0")]);
    }
    for shift in ["G55", "G92.1", "G10 L2 P1 X0"] {
        expect(ROUTER, &[], &job(shift), &[]);
    }
}

#[test]
fn filament_through_a_cold_nozzle_and_a_dwell_of_minutes_are_told() {
    let printer = "[axes.e]\n[heaters.nozzle]\nsensor = { thermistor = { ohms_25 = 100000, beta = \
                   3950, pull_up_ohms = 4700 } }\n";
    let job = |start: &str| format!("{start}\nG1 X9 F300\nG1 X10 E1\nG1 X12 E2\n");
    expect(printer, &[], &job(""), &[(3, "cold_nozzle")]);
    expect(printer, &[], &job("M104 S0"), &[(3, "cold_nozzle")]);
    expect(printer, &[], &job("M109 S200"), &[]);
    expect(
        ROUTER,
        &[],
        "M3 S500\nG4 P500\nG4 P300\n",
        &[(2, "long_dwell")],
    );
    expect(ROUTER, &[], "M3 S500\nG4 P10\n", &[]);
}
