//! A job bent by a map that the simulated probe made of a tilted, bowed plate: its depth over the
//! plate, measured at the edges of the motors.

use leadscrew_import::level::{job, Map};
use leadscrew_machine::board::ChannelId;
use leadscrew_sim::powered::Powered;
use leadscrew_sim::profile::Profile;
use leadscrew_sim::{Cycle, Host, Observer, PowerUp, Rate, StepEvent};
use std::collections::VecDeque;
use std::path::Path;

const MACHINE: &str = "
[axes.x]
steps_per_mm = 80
travel = 200
rate_mm_min = 6000
acceleration_mm_s2 = 1000
[axes.y]
steps_per_mm = 80
travel = 100
rate_mm_min = 6000
acceleration_mm_s2 = 1000
[axes.z]
steps_per_mm = 400
rate_mm_min = 3000
acceleration_mm_s2 = 1000
[probe]
plate_height = -5
tilt_x = 0.01
tilt_y = -0.02
bow = 0.4
";

const STEPS_PER_MM: [f64; 3] = [80.0, 80.0, 400.0];

/// The plate of [`MACHINE`], mm.
fn plate([x, y]: [f64; 2]) -> f64 {
    let along = |share: f64| 4.0 * share * (1.0 - share);
    -5.0 + 0.01 * x - 0.02 * y + 0.4 * along(x / 200.0) * along(y / 100.0)
}

/// Sends each line when the line before it is answered.
#[derive(Default)]
struct Sender {
    lines: VecDeque<String>,
    bytes: VecDeque<u8>,
    waits: bool,
    heard: String,
}

impl Host for Sender {
    fn next_byte(&mut self, _: ChannelId) -> Option<u8> {
        if self.bytes.is_empty() && !self.waits {
            self.bytes.extend(self.lines.pop_front()?.bytes());
            self.bytes.push_back(b'\n');
            self.waits = true;
        }
        self.bytes.pop_front()
    }

    fn receive(&mut self, _: ChannelId, byte: u8, _: Cycle) {
        self.heard.push(char::from(byte));
        self.waits &= !self.heard.ends_with("ok\r\n");
    }

    fn is_done(&self) -> bool {
        self.lines.is_empty() && !self.waits
    }
}

/// The distance of the tool from its depth below the plate, at each step of X or Y that it makes
/// below the plate.
struct Depths {
    depth: f64,
    steps: [i64; 3],
    cuts: usize,
    worst: f64,
}

impl Observer for Depths {
    fn step(&mut self, event: &StepEvent) {
        for (motor, steps) in self.steps.iter_mut().enumerate() {
            if event.motors.contains(motor) {
                *steps += if event.negative.contains(motor) {
                    -1
                } else {
                    1
                };
            }
        }
        let [x, y, z] = [0, 1, 2].map(|axis| self.steps[axis] as f64 / STEPS_PER_MM[axis]);
        let below = plate([x, y]) - z;
        if below > self.depth / 2.0 && (event.motors.contains(0) || event.motors.contains(1)) {
            self.cuts += 1;
            self.worst = self.worst.max((below - self.depth).abs());
        }
    }
}

/// Sends these lines to the machine; returns what it says.
fn heard(lines: impl Iterator<Item = String>, observer: &mut Depths) -> String {
    let file = Profile::parse(Path::new("plate.toml"), MACHINE).unwrap();
    let mut sender = Sender {
        lines: lines.collect(),
        ..Sender::default()
    };
    let supply = file.supply(Rate::NeverWaits);
    let work = &mut |powered: &mut dyn Powered| powered.settle(&mut sender);
    file.power_up(supply, observer, work);
    let wrong = ["error", "ALARM"]
        .iter()
        .any(|one| sender.heard.contains(one));
    assert!(!wrong, "{}", sender.heard);
    sender.heard
}

fn depths(depth: f64) -> Depths {
    Depths {
        depth,
        steps: [0; 3],
        cuts: 0,
        worst: 0.0,
    }
}

/// The map that the probe makes at places so far apart in X and Y, mm.
fn probed([across, along]: [usize; 2]) -> Map {
    let mut lines = vec!["G21 G90".to_owned()];
    for y in (10..=90).step_by(along) {
        for x in (10..=190).step_by(across) {
            lines.push(format!("G0 X{x} Y{y}"));
            lines.push("G38.2 Z-9 F60".to_owned());
            lines.push("G0 Z0".to_owned());
        }
    }
    let heard = heard(lines.into_iter(), &mut depths(0.2));
    let reports = heard.lines().filter(|line| line.starts_with("[PRB:"));
    Map::read(&reports.collect::<Vec<_>>().join("\n"), [0.0; 3]).unwrap()
}

#[test]
fn a_bent_job_is_as_deep_below_a_tilted_bowed_plate_as_half_a_step_and_the_map_s_error() {
    let tolerance = 0.005;
    let text = "G21 G90\nG0 X20 Y20 Z3\nG1 Z-0.2 F600\nX180 Y50 F3000\nG2 X120 Y50 I-30\n\
                G20 G91\nG1 X-2.5 Y0.8\nG90 G21\nY82\nG3 X56.5 Y82 I5\nG0 Z3\nX10 Y10\n";
    // The flat job is off by the plate, so that the bound is no matter of course.
    let mut flat = depths(0.2);
    let beside = |line: &str| line.replace("Z-0.2", "Z-5.2").replace("Z3", "Z-2");
    heard(text.lines().map(beside), &mut flat);
    assert!(flat.worst > 0.5, "{}", flat.worst);
    for spacing in [[10, 10], [20, 20], [45, 40]] {
        let map = probed(spacing);
        let error = map.error().unwrap();
        let bent = job(text, &map, tolerance).unwrap();
        let mut cut = depths(0.2);
        heard(bent.lines.into_iter(), &mut cut);
        let most = 0.5 / STEPS_PER_MM[2] + tolerance + error;
        println!("{spacing:?} mm: {:.4} of {most:.4} mm", cut.worst);
        assert!(cut.cuts > 20_000, "{}", cut.cuts);
        assert!(cut.worst <= most, "{spacing:?}: {} {most}", cut.worst);
        assert!(error < 0.15, "{error}");
    }
}
