//! Tests of `--machine FILE`, the description of a machine, with every command.

use crate::program::{leadscrew, report, stderr, stdout, unusable, Folder, SQUARE};

#[test]
fn a_new_machine_file_is_one_that_every_command_takes() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    let machines = ["router", "laser", "drill", "engraver", "plotter", "printer"];
    for like in machines {
        let file = folder.path(&format!("{like}.toml"));
        let file = file.to_str().unwrap();
        let output = leadscrew(&["machine", "new", "--like", like, "-o", file]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        for command in ["run", "check", "profile"] {
            let output = leadscrew(&[command, &job, "--machine", file]);
            assert_eq!(
                output.status.code(),
                Some(0),
                "{command}: {}",
                stderr(&output)
            );
        }
        unusable(
            &["machine", "new", "--like", like, "-o", file],
            &["is there already"],
        );
    }
}

#[test]
fn what_is_wrong_in_a_machine_file_is_told_with_its_line() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    let file = folder.file(
        "mine.toml",
        "[axes.x]\nsteps_per_mm = 80\n[laser]\nlead_us = \"long\"\n",
    );
    for command in ["run", "check", "profile"] {
        let parts = ["mine.toml:4: laser.lead_us: ", "expected a number"];
        unusable(&[command, &job, "--machine", &file], &parts);
    }
    unusable(
        &["serve", "--tcp", "0", "--machine", &file],
        &["mine.toml:4: laser.lead_us: "],
    );
}

#[test]
fn axes_rates_and_accelerations_are_the_file_s() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G1 X60 F3000\n");
    let slow = folder.file(
        "slow.toml",
        "[axes.x]\nrate_mm_min = 600\nacceleration_mm_s2 = 1000\n",
    );
    let fast = folder.file(
        "fast.toml",
        "[axes.x]\nrate_mm_min = 6000\nacceleration_mm_s2 = 1000\n",
    );
    let seconds = |file: &str| {
        report(&[&job, "--machine", file])["motion_seconds"]
            .as_f64()
            .unwrap()
    };
    // The way is 60 mm at 10 mm/s and at 50 mm/s, with ramps of 1000 mm/s².
    assert!((seconds(&slow) - 6.01).abs() < 0.01);
    assert!((seconds(&fast) - 1.25).abs() < 0.01);
}

#[test]
fn a_fourth_axis_moves_where_the_file_has_one() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G1 X1 A90 F600\n");
    let file = folder.file(
        "four.toml",
        "[axes.a]\nrotary = true\nsteps_per_mm = 10\nrate_mm_min = 6000\n",
    );
    assert_eq!(leadscrew(&["run", &job]).status.code(), Some(1));
    assert_eq!(leadscrew(&["check", &job]).status.code(), Some(1));
    let axes = &report(&[&job, "--machine", &file])["axes"];
    assert_eq!(axes["a"]["net_steps"], 900);
    assert_eq!(axes["x"]["position_mm"], 1.0);
    let check = leadscrew(&["check", &job, "--machine", &file]);
    assert_eq!(check.status.code(), Some(0), "{}", stderr(&check));
}

#[test]
fn six_axes_end_where_they_are_told() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G1 X1 Y2 Z3 A4 B5 C6 F600\nG1 A-1 C1\n");
    let file = folder.file("six.toml", "[axes.a]\n[axes.b]\n[axes.c]\n");
    let axes = &report(&[&job, "--machine", &file])["axes"];
    for (axis, place) in ["x", "y", "z", "a", "b", "c"]
        .into_iter()
        .zip([1.0, 2.0, 3.0, -1.0, 5.0, 1.0])
    {
        assert_eq!(axes[axis]["position_mm"], place, "{axis}");
    }
}

#[test]
fn crossed_belts_end_where_single_motors_do() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    let job_to = folder.file("to.nc", "G1 X7 Y3 F400\n");
    let file = folder.file("belts.toml", "kinematics = \"corexy\"\n");
    let there = report(&[&job_to, "--machine", &file]);
    assert_eq!(there["axes"]["x"]["position_mm"], 7.0);
    assert_eq!(there["axes"]["y"]["position_mm"], 3.0);
    // Motor 0 turns by the sum of X and Y, motor 1 by their difference.
    assert_eq!(there["axes"]["x"]["net_steps"], 2500);
    assert_eq!(there["axes"]["y"]["net_steps"], 1000);
    assert_eq!(
        report(&[&job, "--machine", &file])["axes"]["y"]["position_mm"],
        0.0
    );
}

#[test]
fn crossed_belts_take_the_time_of_single_motors_and_have_the_same_limits() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G21\nG1 X9 Y3 F900\nG2 X5 Y-1 I-4\nG0 X-9\nY20\n");
    let crossed = folder.file("belts.toml", "kinematics = \"corexy\"\n");
    let single = folder.file("single.toml", "");
    let profile = |machine: &str| -> serde_json::Value {
        let args = [
            "profile",
            "--json",
            "--no-trials",
            &job,
            "--machine",
            machine,
        ];
        serde_json::from_str(&stdout(&leadscrew(&args))).unwrap()
    };
    let [crossed, single] = [&crossed, &single].map(|machine| profile(machine));
    let seconds = |profile: &serde_json::Value, limit: &str| {
        let limits = profile["limits"].as_array().unwrap().iter();
        let shares = limits.filter(|one| one["limit"] == limit);
        shares
            .map(|one| one["seconds"].as_f64().unwrap())
            .sum::<f64>()
    };
    let total = |profile: &serde_json::Value| profile["job_seconds"].as_f64().unwrap();
    assert!((total(&crossed) - total(&single)).abs() < 0.01);
    for limit in ["rate X", "rate Y", "acceleration X", "acceleration Y"] {
        let [there, here] = [seconds(&crossed, limit), seconds(&single, limit)];
        assert!(here > 0.1, "{limit}: {here}");
        assert!((there - here).abs() < 0.05, "{limit}: {there} {here}");
    }
}

#[test]
fn a_second_motor_has_a_wire_of_its_own_in_the_waveform() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G1 Y1 F400\n");
    let file = folder.file("gantry.toml", "[second_motor]\naxis = \"y\"\nstart = 0\n");
    let vcd = folder.path("job.vcd");
    report(&[&job, "--machine", &file, "--vcd", vcd.to_str().unwrap()]);
    let wave = std::fs::read_to_string(vcd).unwrap();
    let steps = wave
        .lines()
        .filter(|line| line.starts_with("$var") && line.contains("step"));
    assert_eq!(steps.count(), 4);
}

#[test]
fn settings_of_a_job_win_over_the_machine_s() {
    let folder = Folder::new();
    let file = folder.file("mine.toml", "[axes.x]\nsteps_per_mm = 80\n");
    let calibrate = |more: &[&str]| {
        let args = [
            "calibrate",
            "x",
            "--commanded",
            "100",
            "--measured",
            "50",
            "--machine",
            &file,
        ];
        let output = leadscrew(&[&args, more].concat());
        stdout(&output).trim().to_owned()
    };
    assert_eq!(calibrate(&[]), "$100=160");
    assert_eq!(calibrate(&["--set", "$100=10"]), "$100=20");
}

#[test]
fn the_schema_of_a_machine_file_names_settings_and_axes() {
    let schema = stdout(&leadscrew(&["schema", "machine"]));
    let schema: serde_json::Value = serde_json::from_str(&schema).unwrap();
    let text = schema.to_string();
    for key in ["lead_us", "steps_per_mm", "second_motor", "plate_height"] {
        assert!(text.contains(&format!("\"{key}\"")), "{key}");
    }
}

#[test]
fn a_switch_stops_any_motion_or_motion_towards_it_or_none_as_the_file_says() {
    let folder = Folder::new();
    let machine = |name: &str, stops: &str| {
        let axis = format!("[axes.x]\nlimits = {{ low = 0 }}\nstops = \"{stops}\"\n");
        folder.file(name, format!("[bounds]\nhard = true\n{axis}"))
    };
    let [any, towards, homing] =
        ["any", "towards", "homing"].map(|stops| machine(&format!("{stops}.toml"), stops));
    // At power-up the carriage is on its switch, at machine position 0.
    let leaves = folder.file("leaves.nc", "G1 X5 F500\nX3\n");
    let comes = folder.file("comes.nc", "G1 X5 F500\nX-4\n");
    let run = |job: &str, file: &str| {
        let output = leadscrew(&["run", job, "--machine", file]);
        (output.status.code(), stderr(&output))
    };
    let (code, said) = run(&leaves, &any);
    assert_eq!(code, Some(1));
    assert!(said.contains("error:9"), "{said}");
    assert_eq!(run(&leaves, &towards).0, Some(0));
    let (code, said) = run(&comes, &towards);
    assert_eq!(code, Some(1));
    assert!(said.contains("ALARM:1"), "{said}");
    assert_eq!(run(&comes, &homing).0, Some(0));
    let there = report(&[&comes, "--machine", &homing]);
    assert_eq!(there["axes"]["x"]["position_mm"], -4.0);
}

#[test]
fn homing_without_a_way_to_go_ends_by_itself() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "$H\nG21 G90\nG0 X-1\n");
    let axes = ["x", "y", "z"].map(|axis| format!("[axes.{axis}]\nhome = \"zero\"\n"));
    let zero = format!("[homing]\non = true\n{}", axes.concat());
    let zero = folder.file("zero.toml", zero);
    let there = report(&[&job, "--machine", &zero]);
    assert_eq!(there["axes"]["x"]["position_mm"], -1.0);
    // With no way off the switches, homing fails at the first of them.
    let router = folder.path("router.toml");
    let router = router.to_str().unwrap();
    leadscrew(&["machine", "new", "--like", "router", "-o", router]);
    let output = leadscrew(&["run", &job, "--machine", router, "--set", "$27=0"]);
    let said = stderr(&output);
    assert!(said.contains("job.nc:1: ALARM:8"), "{said}");
}
