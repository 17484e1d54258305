//! A printer's axis E, measured at the edges of its motors: the feed, E's own limits, corners, and
//! `G92 E0` during motion.

use leadscrew_sim::clock::seconds;
use leadscrew_sim::powered::Powered;
use leadscrew_sim::profile::Profile;
use leadscrew_sim::PowerUp;
use leadscrew_sim::{Answers, Observer, Rate, StepEvent, Streamer, Streaming};
use std::path::Path;

/// 80 steps/mm on X and Y, 100 on E.
const MACHINE: &str = "
[axes.x]
steps_per_mm = 80
rate_mm_min = 6000
acceleration_mm_s2 = 1000
[axes.y]
steps_per_mm = 80
rate_mm_min = 6000
acceleration_mm_s2 = 1000
[axes.z]
steps_per_mm = 400
[axes.e]
steps_per_mm = 100
rate_mm_min = 1500
acceleration_mm_s2 = 100
";

const X: usize = 0;
const E: usize = 3;
const E_STEPS_PER_MM: f64 = 100.0;

/// The times at which each motor steps, s, and whether it steps backwards.
#[derive(Default)]
struct Edges([Vec<(f64, bool)>; 4]);

impl Observer for Edges {
    fn step(&mut self, event: &StepEvent) {
        let now = seconds(event.cycle.0);
        for (motor, edges) in self.0.iter_mut().enumerate() {
            if event.motors.contains(motor) {
                edges.push((now, event.negative.contains(motor)));
            }
        }
    }
}

impl Edges {
    /// From the first step of a motor to its last one, s.
    fn time(&self, motor: usize) -> f64 {
        let (first, last) = (self.0[motor].first(), self.0[motor].last());
        last.unwrap().0 - first.unwrap().0
    }

    /// Steps forward less steps back.
    fn net(&self, motor: usize) -> i64 {
        let signs = self.0[motor]
            .iter()
            .map(|(_, back)| 1 - 2 * i64::from(*back));
        signs.sum()
    }

    /// The speed of E from each of its steps on, measured over four steps, mm/s.
    fn speeds_of_e(&self) -> Vec<f64> {
        let four = |steps: &[(f64, bool)]| 4.0 / E_STEPS_PER_MM / (steps[4].0 - steps[0].0);
        self.0[E].windows(5).map(four).collect()
    }
}

/// Runs a job on a machine. Returns the edges of its motors, and the errors.
fn run(machine: &str, job: &str) -> (Edges, Answers) {
    let file = Profile::parse(Path::new("printer.toml"), machine).unwrap();
    let supply = file.supply(Rate::NeverWaits);
    let streaming = Streaming {
        window: 128,
        keep_going: false,
    };
    let mut edges = Edges::default();
    let mut host = Streamer::new(job.as_bytes(), streaming, Answers::default());
    let work = &mut |powered: &mut dyn Powered| powered.settle(&mut host);
    file.power_up(supply, &mut edges, work);
    (edges, host.finish().unwrap())
}

/// The edges of a job that has no errors.
fn edges(job: &str) -> Edges {
    let (edges, answers) = run(MACHINE, job);
    assert!(answers.errors.is_empty(), "{:?}", answers.errors);
    assert_eq!(answers.alarm, None);
    edges
}

#[track_caller]
fn assert_near(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{found}, not {expected}"
    );
}

#[test]
fn the_feed_is_that_of_the_other_axes_and_of_e_where_it_moves_alone() {
    // E goes 50 mm at 10 mm/s, and ramps: E alone allows 100 mm/s².
    let line = edges("G1 X30 Y40 E50 F600\n");
    assert_near(line.time(X), 5.1, 0.03);
    assert_eq!((line.net(X), line.net(E)), (2400, 5000));
    let alone = edges("G1 E50 F600\n");
    assert_near(alone.time(E), 5.1, 0.03);
}

#[test]
fn an_arc_has_its_feed_too_and_e_ends_with_it() {
    let half = edges("G2 X20 Y0 I10 J0 E31.4159 F600\n");
    assert_near(half.time(E), std::f64::consts::PI + 0.1, 0.03);
    assert_eq!((half.net(X), half.net(E)), (1600, 3142));
}

#[test]
fn e_bounds_rate_and_acceleration_of_a_move() {
    // At most 25 mm/s and 100 mm/s²: 50 mm in 2.25 s, less the time before the first step.
    let line = edges("G1 X100 E50 F6000\n");
    assert_near(line.time(E), 2.25, 0.03);
    let fastest = line.speeds_of_e().into_iter().fold(0.0, f64::max);
    assert_near(fastest, 25.0, 0.15);
}

#[test]
fn e_bounds_the_corner_where_it_begins_on_a_straight_path() {
    let line = edges("G1 X50 F1500\nX100 E50\n");
    let speeds = line.speeds_of_e();
    // The junction deviation allows 3.6 mm/s along X and E together when the flow begins: 2.6 mm/s
    // of E.
    assert!(speeds[0] < 6.0, "{}", speeds[0]);
    let fastest = speeds.into_iter().fold(0.0, f64::max);
    assert_near(fastest, 25.0, 0.15);
    let steady = edges("G1 X50 E50 F1500\nX100 E100\n");
    assert_near(steady.time(X), 4.25, 0.03);
}

#[test]
fn filament_is_counted_anew_without_a_stop() {
    let pieces = |line: fn(u32) -> String| -> String { (1..=20).map(line).collect() };
    let relative = edges(&format!(
        "M83\nG1 F3000\n{}",
        pieces(|k| format!("X{} E.5\n", 5 * k))
    ));
    let absolute = edges(&format!(
        "G1 F3000\n{}",
        pieces(|k| format!("G92 E0\nX{} E.5\n", 5 * k))
    ));
    assert_eq!((relative.net(E), absolute.net(E)), (1000, 1000));
    // The way is 100 mm at 50 mm/s without a stop. With 20 stops it would take two seconds more.
    assert_near(relative.time(X), 2.05, 0.1);
    assert_near(absolute.time(X), relative.time(X), 0.001);
}

#[test]
fn filament_goes_back_and_forth() {
    let retract = edges("M83\nG1 X10 E1 F1200\nE-.8 F1500\nG0 X20\nG1 E.8 F1500\nX30 E1 F1200\n");
    assert_eq!(retract.net(E), 200);
    assert_eq!(retract.0[E].iter().filter(|(_, back)| *back).count(), 80);
}

#[test]
fn soft_limits_and_g28_do_not_concern_filament() {
    let machine = format!("{MACHINE}[settings]\n\"$20\" = 1\n\"$22\" = 1\n\"$133\" = 10\n");
    let job = "$X\nG1 X-1 E60 F1200\nG28\nG92 E0\nG1 E5 F600\n";
    let (edges, answers) = run(&machine, job);
    assert!(
        answers.errors.is_empty() && answers.alarm.is_none(),
        "{answers:?}"
    );
    assert_eq!((edges.net(X), edges.net(E)), (0, 6500));
}

#[test]
fn a_cold_nozzle_does_not_extrude_and_the_carriage_may_go() {
    let machine = format!("{MACHINE}[heaters.nozzle]\nsensor = \"ad595\"\n");
    let (cold, answers) = run(&machine, "G1 X10 F1200\nG1 X20 E1\n");
    assert_eq!((cold.net(X), cold.net(E)), (800, 0));
    assert!(!answers.errors.is_empty());
    let (warm, answers) = run(&machine, "M109 S200\nG1 X20 E1 F1200\n");
    assert!(answers.errors.is_empty(), "{:?}", answers.errors);
    assert_eq!((warm.net(X), warm.net(E)), (1600, 100));
}
