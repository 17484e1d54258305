//! An uneven plate under the probe: found point by point, as a sender's auto-level does.

use leadscrew_machine::board::ChannelId;
use leadscrew_sim::plant::Plate;
use leadscrew_sim::powered::{Powered, Supply};
use leadscrew_sim::profile::Profile;
use leadscrew_sim::{Cycle, Host, Rate};
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

/// Sends line after line, each when the one before it is answered, and keeps what it hears.
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

/// What the probe finds at each of these places: Z in mm.
fn found(machine: &str, places: &[[f64; 2]]) -> Vec<f64> {
    let file = Profile::parse(Path::new("plate.toml"), machine).unwrap();
    let lines = places.iter().flat_map(|[x, y]| {
        let line = format!("G0 X{x} Y{y}\n");
        [line, "G38.2 Z-12 F200\n".into(), "G0 Z0\n".into()]
    });
    let mut sender = Sender {
        lines: lines.collect(),
        bytes: VecDeque::new(),
        waits: false,
        heard: String::new(),
    };
    let supply = Supply {
        first: None,
        lines: 1,
        rate: Rate::NeverWaits,
        outputs: file.outputs.config(),
        sensor_fault: None,
        carriages: None,
    };
    let work = &mut |powered: &mut dyn Powered| powered.settle(&mut sender);
    file.power_up(supply, &mut (), work);
    let heard = &sender.heard;
    let found: Vec<f64> = heard
        .lines()
        .filter_map(|line| line.strip_prefix("[PRB:")?.strip_suffix(":1]"))
        .map(|place| place.rsplit(',').next().unwrap().parse().unwrap())
        .collect();
    assert_eq!(found.len(), places.len(), "{heard}");
    found
}

#[test]
fn each_point_of_an_uneven_plate_is_found_at_its_height() {
    let places = [
        [0.0, 0.0],
        [200.0, 0.0],
        [0.0, 100.0],
        [100.0, 50.0],
        [50.0, 50.0],
    ];
    // Tilt and bow by hand: the bow is all in the middle, three quarters of it at a quarter of the way.
    let heights = [
        -5.0,
        -3.0,
        -7.0,
        -5.0 + 1.0 - 1.0 + 0.4,
        -5.0 + 0.5 - 1.0 + 0.3,
    ];
    for (found, height) in found(MACHINE, &places).iter().zip(heights) {
        // A step of Z and what the input's filter takes.
        assert!((found - height).abs() <= 0.005, "{found} {height}");
    }
}

#[test]
fn a_flat_plate_is_as_high_everywhere() {
    let flat = MACHINE
        .replace("0.01\n", "0\n")
        .replace("-0.02", "0")
        .replace("0.4", "0");
    let file = Profile::parse(Path::new("plate.toml"), &flat).unwrap();
    assert_eq!(file.plate(), None::<Plate>);
    for found in found(&flat, &[[0.0, 0.0], [150.0, 80.0]]) {
        assert!((found + 5.0).abs() <= 0.005, "{found}");
    }
}
