//! An uneven plate under the probe, measured point by point as a sender's auto-level does.

use leadscrew_machine::board::ChannelId;
use leadscrew_sim::plant::Plate;
use leadscrew_sim::powered::Powered;
use leadscrew_sim::profile::Profile;
use leadscrew_sim::Fixtures;
use leadscrew_sim::PowerUp;
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

/// Sends each line when the line before it is answered, and keeps all that the machine sends.
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

/// Sends these lines to a machine; returns all that it sends.
fn heard(machine: &str, lines: VecDeque<String>) -> String {
    let file = Profile::parse(Path::new("plate.toml"), machine).unwrap();
    let mut sender = Sender {
        lines,
        bytes: VecDeque::new(),
        waits: false,
        heard: String::new(),
    };
    let supply = file.supply(Rate::NeverWaits);
    let work = &mut |powered: &mut dyn Powered| powered.settle(&mut sender);
    file.power_up(supply, &mut (), work);
    sender.heard
}

/// The places of contact that were reported, mm.
fn contacts(heard: &str) -> Vec<[f64; 3]> {
    let reports = heard
        .lines()
        .filter_map(|line| line.strip_prefix("[PRB:")?.strip_suffix(":1]"));
    reports.map(place).collect()
}

/// Reads three coordinates with commas between them.
fn place(text: &str) -> [f64; 3] {
    let places = text.split(',').map(|place| place.parse().unwrap());
    places.collect::<Vec<f64>>().try_into().unwrap()
}

/// The Z at which the probe makes contact at each of these places, mm.
fn found(machine: &str, places: &[[f64; 2]]) -> Vec<f64> {
    let lines = places.iter().flat_map(|[x, y]| {
        let line = format!("G0 X{x} Y{y}\n");
        [line, "G38.2 Z-12 F200\n".into(), "G0 Z0\n".into()]
    });
    let heard = heard(machine, lines.collect());
    let found = contacts(&heard);
    assert_eq!(found.len(), places.len(), "{heard}");
    found.into_iter().map(|[_, _, z]| z).collect()
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
    // Tilt and bow, computed by hand: at the middle the bow has its full height, at a quarter of
    // the travel three quarters of it.
    let heights = [
        -5.0,
        -3.0,
        -7.0,
        -5.0 + 1.0 - 1.0 + 0.4,
        -5.0 + 0.5 - 1.0 + 0.3,
    ];
    for (found, height) in found(MACHINE, &places).iter().zip(heights) {
        // The tolerance is a step of Z plus the way of Z during the input's filter time.
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

/// The height of [`MACHINE`]'s plate above its height at X0 Y0, mm: its tilt, and a bow of 0.4 mm
/// over 200 mm by 100 mm.
fn height([x, y]: [f64; 2]) -> f64 {
    let along = |share: f64| 4.0 * share * (1.0 - share);
    0.01 * x - 0.02 * y + 0.4 * along(x / 200.0) * along(y / 100.0)
}

#[test]
fn the_lines_of_bcnc_s_auto_level_find_the_plate_s_heights_in_work_coordinates() {
    let grid = [10.0, 55.0, 100.0, 145.0, 190.0];
    let rows = [10.0, 50.0, 90.0];
    let places: Vec<[f64; 2]> = rows.iter().flat_map(|y| grid.map(|x| [x, *y])).collect();
    // After connecting, the sender asks for settings, modes and parameters, and for reports all the
    // time. Then it sets Z0 on the plate.
    let mut lines: VecDeque<String> = ["$$", "$I", "$G", "$#", "G38.2Z-12.0000F60"]
        .map(str::to_owned)
        .into();
    lines.extend(["G10L20P1Z0", "$#", "G0Z3.0000", "G0X10.0000Y10.0000"].map(str::to_owned));
    for [x, y] in &places {
        lines.push_back("G0Z3.0000".to_owned());
        lines.push_back(format!("G0X{x:.4}Y{y:.4}"));
        lines.push_back("G4P0".to_owned()); // waits until motion rests
        lines.push_back("G38.2Z-3.0000F120".to_owned());
        lines.push_back("$G".to_owned());
    }
    lines.extend(["G0Z3.0000", "G0X10.0000Y10.0000", "$#"].map(str::to_owned));
    let lines = lines.into_iter().map(|line| format!("?{line}\n"));
    let heard = heard(MACHINE, lines.collect());
    assert!(
        !heard.contains("error") && !heard.contains("ALARM"),
        "{heard}"
    );
    let mut found = contacts(&heard);
    found.dedup(); // `$#` repeats the last one
    let mut origin = heard.lines().filter_map(|line| line.strip_prefix("[G54:"));
    let [_, _, zero] = place(origin.next_back().unwrap().trim_end_matches(']'));
    // The first contact sets Z0. The reports are in machine coordinates, as is G54.
    assert_eq!(found.len(), 1 + places.len(), "{heard}");
    for (place, [x, y, z]) in places.iter().zip(&found[1..]) {
        assert_eq!([*x, *y], *place);
        let found = z - zero;
        assert!(
            (found - height(*place)).abs() <= 0.006,
            "{found} at {place:?}"
        );
    }
}
