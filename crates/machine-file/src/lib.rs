//! Machine files: a TOML file that describes a machine.
//!
//! ```text
//!         start                       places are millimetres on the axis' own scale
//!   low     |                 high
//!   --|-----#------------------|-->   # carriage at power-up; switches close at `low` and below, `high` and above
//!     |<------- travel ------->|
//! ```
//!
//! Every key may be left out: then the machine is a stock Grbl's, without any switch. The file
//! gives settings their first values, by name (`laser.lead_us = 250`) or by number
//! (`settings."$703" = 250`); a state file or a sender may change them.
//!
//! `examples/machines/` holds machine files with every key explained. `leadscrew schema machine`
//! prints their JSON schema.
#![forbid(unsafe_code)]

mod arrays;
mod contradiction;
mod error;
mod first;
mod fit;
mod heat;
mod named;
mod plan;
mod tools;
mod value;

pub use error::{ProfileError, Wrong};
pub use fit::NotInRecord;
pub use heat::{Body, Fan, HeaterTable, Heaters, SensorTable};
pub use named::{
    Bounds, DeadMan, Homing, Laser, Motors, Path as PathSettings, Reports, Spindle, Streaming,
};
pub use plan::Room;
pub use tools::{ShownAs, ToolChangeTable, ToolSwitchesTable};
pub use value::{
    AxisLetter, AxisLetters, BufferSize, Celsius, LookAhead, OutputCount, PerSecond, Place,
    Positive, SettingNumber, ValueError, Volts, Way,
};

use leadscrew_files::WRITTEN_BY_HAND;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;
use toml::Spanned;

/// The axes of the largest machine that a file can describe.
pub const MOST_AXES: usize = 6;

/// A simulated machine.
#[derive(Clone, PartialEq, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Profile {
    /// The name on the screen.
    pub name: String,
    /// The board: one that comes with the firmware, or a board's file beside this one. The
    /// simulator needs none.
    pub board: Option<String>,
    /// Bytes of unanswered lines that a sender may have sent; 1024 if it is left out.
    pub receive_buffer: Option<BufferSize>,
    /// Moves planned ahead; 1024 if it is left out.
    pub look_ahead: Option<LookAhead>,
    /// The belts of X and Y.
    pub kinematics: Belts,
    /// How home is found.
    pub homing: Homing,
    /// The motors.
    pub motors: Motors,
    /// Limits of the travel.
    pub bounds: Bounds,
    /// Corners, arcs, jerk, canned cycles.
    pub path: PathSettings,
    /// The spindle.
    pub spindle: Spindle,
    /// The laser.
    pub laser: Laser,
    /// How long what is on at rest stays on without its sender.
    pub dead_man: DeadMan,
    /// The reports to a sender.
    pub reports: Reports,
    /// How lines become motion.
    pub streaming: Streaming,
    /// Outputs that M62 to M65 switch.
    pub outputs: OutputsTable,
    /// Heaters.
    pub heaters: Heaters,
    /// A fan.
    pub fan: Fan,
    /// M6 and a tool table.
    pub tool_change: Option<ToolChangeTable>,
    /// A tool between two switches.
    pub tool_switches: Option<ToolSwitchesTable>,
    /// The values that `import drill` uses for this machine if its options are left out.
    pub drill: DrillTable,
    /// First values of settings by their numbers; they override values given by name.
    #[schemars(with = "BTreeMap<String, f64>")]
    pub settings: BTreeMap<SettingNumber, Spanned<f64>>,
    /// The axes; X, Y and Z are always there.
    pub axes: Axes,
    /// A second motor on X or Y, squared while homing.
    pub second_motor: Option<SecondMotor>,
    /// The plate under the probe.
    pub probe: Option<Probe>,
    /// The common properties of all switches.
    pub switches: Switches,
    /// Whether there is a safety door.
    pub door: Door,
    /// The options that stock Grbl fixes when it is compiled.
    pub options: Options,
}

/// Outputs that M62 to M65 switch.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputsTable {
    /// How many: `P0` to `P(count - 1)`.
    pub count: OutputCount,
    /// The outputs that are on after power-up, a reset, an alarm and the end of the program: a mask
    /// with one bit for each output.
    pub boot: u8,
    /// The outputs that stay as they are in a hold, one bit for each output; all others go off.
    pub stay: u8,
}

/// Depths and feeds of a drill job, mm and mm/min. Each key gives the value of the option of
/// `import drill` with the same name.
#[derive(Clone, Copy, PartialEq, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DrillTable {
    /// Z of a hole's bottom, below zero.
    pub depth_mm: Option<Place>,
    /// Z between holes.
    pub clearance_mm: Option<Place>,
    /// How fast drill bits go down.
    pub feed_mm_min: Option<Positive>,
    /// How fast slots and routes are milled.
    pub mill_feed_mm_min: Option<Positive>,
    /// The greatest depth that is drilled or milled in one go.
    pub peck_mm: Option<Positive>,
}

/// The axes.
#[derive(Clone, PartialEq, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Axes {
    /// X.
    pub x: Axis,
    /// Y.
    pub y: Axis,
    /// Z.
    pub z: Axis,
    /// A fourth axis, if there is one.
    pub a: Option<Axis>,
    /// A fifth axis, beside A.
    pub b: Option<Axis>,
    /// A sixth axis, beside A and B.
    pub c: Option<Axis>,
    /// The filament of a 3D printer. Its motor's number comes after those of all other axes.
    pub e: Option<Axis>,
}

/// One axis.
#[derive(Clone, PartialEq, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Axis {
    /// Steps of its motor in a millimetre, as the screw or belt gives them; also the setting's
    /// first value.
    #[schemars(with = "Option<f64>")]
    pub steps_per_mm: Option<Spanned<Positive>>,
    /// Steps of a whole turn of its motor. With it, `run --json` also prints the turns.
    pub steps_per_rev: Option<Positive>,
    /// How far it can go, mm: the first value of `$130`, `$131`, …
    #[schemars(with = "Option<f64>")]
    pub travel: Option<Spanned<Positive>>,
    /// Its fastest motion, mm/min: the first value of `$110`, `$111`, …
    #[schemars(with = "Option<f64>")]
    pub rate_mm_min: Option<Spanned<Positive>>,
    /// How quickly it changes speed, mm/s²: the first value of `$120`, `$121`, …
    #[schemars(with = "Option<f64>")]
    pub acceleration_mm_s2: Option<Spanned<Positive>>,
    /// True if its motor turns the other way; it sets the motor's bit in `$3`.
    pub reversed: bool,
    /// True if its step pulses are inverted; it sets the motor's bit in `$2`.
    pub step_inverted: bool,
    /// The end at which it has its home; its bit in `$23` is set for `low`.
    pub home: End,
    /// The machine position of its home switch, mm: `$740`, `$741`, …, and its bit in `$719`. As in
    /// Grbl if it is left out: 0, or minus the travel.
    #[schemars(with = "Option<f64>")]
    pub home_place_mm: Option<Spanned<Place>>,
    /// How far it goes off its switch, mm: `$750`, `$751`, …; `homing.pull_off_mm` if it is left
    /// out.
    #[schemars(with = "Option<f64>")]
    pub home_pull_off_mm: Option<Spanned<Positive>>,
    /// How fast it searches for its switch, mm/min: `$760`, `$761`, …; `homing.seek_mm_min` if it
    /// is left out.
    #[schemars(with = "Option<f64>")]
    pub home_seek_mm_min: Option<Spanned<Positive>>,
    /// How fast it locates its switch, mm/min: `$770`, `$771`, …; `homing.feed_mm_min` if it is
    /// left out.
    #[schemars(with = "Option<f64>")]
    pub home_feed_mm_min: Option<Spanned<Positive>>,
    /// The carriage's place at power-up, mm.
    pub start: Place,
    /// The places of its limit switches.
    pub limits: Limits,
    /// Which motion its limit switches stop, if `bounds.hard` is on.
    pub stops: Stops,
    /// True if it is a rotary axis: its unit is then degrees instead of millimetres.
    pub rotary: bool,
    /// The board's socket of its motor and limit switch, if it is not the next one in the order
    /// x, y, z, spare, spare-2, spare-3.
    pub socket: Option<Socket>,
}

/// A board's socket for a motor and its limit switch.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Socket {
    /// The first in the board's file.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
    /// The first of the spare sockets, which the board's file lists in `[sockets]`.
    Spare,
    /// The second of them.
    #[serde(rename = "spare-2")]
    Spare2,
    /// The third of them.
    #[serde(rename = "spare-3")]
    Spare3,
}

/// An end of an axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum End {
    /// The end with its lowest coordinate.
    Low,
    /// The end with its highest coordinate.
    #[default]
    High,
    /// At its zero. The axis has no home switch: `$H` moves it to zero once the other axes are
    /// home.
    Zero,
}

/// The motion that a limit switch stops.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Stops {
    /// Any motion, as in Grbl. While a switch is closed, only jogs can move away from it.
    #[default]
    Any,
    /// Motion towards the axis's only switch. Motion away from it goes on, in programs too.
    Towards,
    /// Only homing.
    Homing,
}

/// Where an axis has limit switches; both are wired to one input, as on Grbl's boards.
#[derive(Clone, Copy, PartialEq, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// The place of the switch at the low end: closed here and below.
    pub low: Option<Place>,
    /// The place of the switch at the high end: closed here and above.
    pub high: Option<Place>,
}

/// A second motor on an axis, with a carriage and switches of its own: the other side of a gantry.
///
/// Its number, and so its bit in `$2` and `$3`, comes after the numbers of the axes.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SecondMotor {
    /// The axis that it helps to move. Both have the same scale.
    pub axis: GantryAxis,
    /// Its carriage's place at power-up, mm on the axis's scale. It differs from the start of
    /// the axis if the gantry is skewed.
    pub start: Place,
    /// True if it turns the other way; it sets the motor's bit in `$3`.
    #[serde(default)]
    pub reversed: bool,
    /// The places of its limit switches.
    #[serde(default)]
    pub limits: Limits,
    /// How far its switch may be from the first motor's switch.
    #[serde(default)]
    pub squaring: Squaring,
    /// Its socket; the next free one if it is left out, as for an axis.
    pub socket: Option<Socket>,
}

/// How far one of the two motors may go on without reaching its switch while homing; a longer way
/// is ALARM:10. Values that are left out are Grbl's.
#[derive(Clone, Copy, PartialEq, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Squaring {
    /// The tolerance as a share of the axis's travel: 0.05 is 5 %.
    pub tolerance: Option<Positive>,
    /// The least tolerance, mm.
    pub least: Option<Positive>,
    /// The largest tolerance, mm.
    pub most: Option<Positive>,
}

/// The belts of X and Y.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Belts {
    /// One motor for each axis.
    #[default]
    Cartesian,
    /// Two crossed belts, each moved by both motors. The motors' steps are the `steps_per_mm` of X
    /// and Y, which must be the same.
    CoreXy,
}

/// An axis that may have two motors.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum GantryAxis {
    /// X.
    X,
    /// Y.
    Y,
}

/// The plate under the probe, below the Z axis.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// The height of the plate: Z makes contact at this place and below.
    pub plate_height: Place,
    /// How far the plate rises per millimetre of X, mm.
    #[serde(default)]
    pub tilt_x: Place,
    /// How far the plate rises per millimetre of Y, mm.
    #[serde(default)]
    pub tilt_y: Place,
    /// How far the middle of the travel stands above its edges, mm.
    #[serde(default)]
    pub bow: Place,
    /// Where the plate ends in X; without it, it is everywhere.
    pub x: Option<Ends>,
    /// Where the plate ends in Y; without it, it is everywhere.
    pub y: Option<Ends>,
    /// A round hole through the plate.
    pub hole: Option<Hole>,
    /// The diameter of the probe's tip, mm; without it, it is a point.
    pub tip: Option<Positive>,
}

/// The ends of something along an axis.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ends {
    /// The low end.
    pub low: Place,
    /// The high end.
    pub high: Place,
}

/// A round hole.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hole {
    /// Its middle in X.
    pub x: Place,
    /// Its middle in Y.
    pub y: Place,
    /// Its diameter, mm.
    pub diameter: Positive,
}

/// The common properties of all switches.
#[derive(Clone, Copy, PartialEq, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Switches {
    /// True if limit switches are normally closed, so that they open when they are worked (setting:
    /// `$5=1`).
    pub normally_closed: bool,
    /// How often per second a wrong level is seen on the limit inputs, for example from a cable
    /// beside the spindle's.
    pub glitches: PerSecond,
    /// How long a wrong level lasts, microseconds; 5 if it is left out.
    pub glitch_us: Option<u16>,
    /// How long a limit switch or the probe bounces at each edge, microseconds.
    pub bounce_us: u16,
    /// When a limit switch stops the machine, a message names the switch and its end. The position
    /// is kept, and `$X` unlocks.
    pub named: bool,
    /// With `named`: how far X and Y go back after the stop, mm. Z never goes back.
    pub back_off_mm: Option<Positive>,
    /// Status reports have a field such as `Sw:X+,Z-` for the closed switches.
    pub reported: bool,
    /// A reset (0x18) during motion and the reset input switch the motor drivers off at once.
    pub stop_drops_drivers: bool,
}

/// The safety door.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Door {
    /// True if there is a safety door.
    pub fitted: bool,
    /// True if it is open at power-up.
    pub open: bool,
}

/// The options that stock Grbl fixes when it is compiled.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Options {
    /// M7 and the mist valve.
    pub mist: bool,
    /// Line numbers in status reports.
    pub line_numbers: bool,
    /// `$HX`, `$HY`, `$HZ`.
    pub single_axis_homing: bool,
    /// Z parks while the door is open.
    pub parking: bool,
    /// M56 forbids and allows parking.
    pub parking_override: bool,
    /// Lines may have parameters and expressions.
    pub expressions: bool,
}

impl Profile {
    /// Reads a profile from a file.
    ///
    /// # Errors
    /// [`ProfileError`], with file, line and key.
    pub fn load(file: &Path) -> Result<Self, ProfileError> {
        let bytes = leadscrew_files::read(file, WRITTEN_BY_HAND);
        let bytes = bytes.map_err(|error| ProfileError::Unreadable(file.to_owned(), error))?;
        let text = Wrong::text(file, &bytes).map_err(ProfileError::Wrong)?;
        Self::parse(file, text).map_err(ProfileError::Wrong)
    }

    /// Reads a profile from the text of `file`.
    ///
    /// # Errors
    /// [`Wrong`], with file, line and key.
    pub fn parse(file: &Path, text: &str) -> Result<Self, Wrong> {
        let wrong = |key, error: &toml::de::Error| Wrong::new(file, text, key, error);
        let document =
            toml::Deserializer::parse(text).map_err(|error| wrong(String::new(), &error))?;
        let profile: Self = serde_path_to_error::deserialize(document).map_err(|error| {
            let path = error.path().to_string();
            // The parser keeps the place of a setting's value in a structure of its own, which adds
            // `.$__` to the path.
            let key = path.split(".$__").next().unwrap_or_default();
            wrong(key.trim_start_matches('.').to_owned(), error.inner())
        })?;
        if let Some((key, start)) = arrays::misplaced(text) {
            let message = "invalid type: sequence, expected a table".to_owned();
            return Err(Wrong::at(file, text, start, key, message));
        }
        if let Some((key, message)) = profile.contradiction() {
            return Err(Wrong::at_key(file, text, key, message));
        }
        match profile.refused_setting() {
            None => Ok(profile),
            Some((named, message)) => Err(Wrong::at(file, text, named.at, named.key, message)),
        }
    }
}

/// The example of the package's README, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Profile, Wrong> {
        Profile::parse(Path::new("router.toml"), text)
    }

    fn complaint(text: &str) -> String {
        parse(text)
            .expect_err("a profile that is wrong")
            .to_string()
    }

    #[test]
    fn nothing_is_required() {
        assert_eq!(parse("").unwrap(), Profile::default());
    }

    #[test]
    fn every_key_is_read() {
        let profile = parse(
            r#"
            name = "shop"
            receive_buffer = 128
            look_ahead = 15
            kinematics = "cartesian"
            [homing]
            order = ["z", "xy"]
            on = true
            pull_off_mm = 2
            [laser]
            lead_us = 250
            [settings]
            "$110" = 5000
            "$11" = 0.02
            [axes.x]
            steps_per_mm = 80
            travel = 400
            start = 120.5
            limits = { low = -1, high = 401 }
            [axes.a]
            rotary = true
            [second_motor]
            axis = "y"
            start = 88
            squaring = { tolerance = 0.1, least = 1, most = 5 }
            [probe]
            plate_height = -20
            x = { low = 10, high = 60 }
            hole = { x = 30, y = 20, diameter = 8 }
            tip = 3
            [switches]
            normally_closed = true
            glitches = 0.5
            glitch_us = 3
            bounce_us = 500
            [door]
            fitted = true
            open = true
            [options]
            mist = true
            line_numbers = true
            single_axis_homing = true
            parking = true
            parking_override = true
            expressions = true
            "#,
        );
        let profile = profile.unwrap();
        assert_eq!(*profile.settings[&SettingNumber(11)].get_ref(), 0.02);
        assert_eq!(profile.second_motor.unwrap().axis, GantryAxis::Y);
        assert_eq!(profile.axes.x.limits.high.unwrap().mm(), 401.0);
        assert_eq!(
            profile.homing.order.unwrap(),
            [AxisLetters(0b100), AxisLetters(0b011)]
        );
        assert!(profile.axes.a.unwrap().rotary && profile.door.open);
        assert_eq!(profile.switches.bounce_us, 500);
    }

    #[test]
    fn complaints_name_file_line_key_and_what_was_expected() {
        let table = [
            ("[axes.x]\ntravel = \"far\"", "router.toml:2: axes.x.travel: invalid type: string \"far\", expected a number"),
            ("\n[axes.x]\ntravel = -3", "router.toml:3: axes.x.travel: expected a number above 0 and below 1e6"),
            ("[settings]\n\"$110\" = \"fast\"", "router.toml:2: settings.$110: invalid type: string \"fast\", expected a number"),
            ("name = 5", "router.toml:1: name: invalid type: integer `5`, expected a string"),
            ("look_ahead = \"far\"", "router.toml:1: look_ahead: invalid type: string \"far\", expected a whole number"),
            ("[settings]\nsteps = 1", "router.toml:2: settings.steps: expected the name of a setting, such as \"$110\""),
            ("[homing]\norder = [\"z\", \"xq\"]", "router.toml:2: homing.order[1]: expected axes that home together, such as \"z\" or \"xy\""),
            ("[door]\nfited = true", "router.toml:2: door.fited: unknown field `fited`, expected `fitted` or `open`"),
            ("[second_motor]\naxis = \"z\"", "router.toml:2: second_motor.axis: unknown variant `z`, expected `x` or `y`"),
            ("kinematics = \"delta\"", "router.toml:1: kinematics: unknown variant `delta`, expected `cartesian` or `corexy`"),
            ("\nkinematics = \"corexy\"\n[second_motor]\naxis = \"y\"\nstart = 0", "router.toml:2: kinematics: expected `cartesian` beside a second motor"),
            ("kinematics = \"corexy\"\n[axes.x]\nsteps_per_mm = 80", "router.toml:1: kinematics: expected X and Y with the same steps_per_mm on crossed belts"),
            ("[second_motor]\naxis = \"y\"\nstart = 0\nsquaring = { least = -1 }", "router.toml:4: second_motor.squaring.least: expected a number above 0 and below 1e6"),
            ("[switches]\nbounce_us = -1", "router.toml:2: switches.bounce_us: invalid value: integer `-1`, expected a whole number"),
            ("[probe]", "router.toml:1: probe: missing field `plate_height`"),
            ("[probe]\nplate_height = 0\ny = { low = 5, high = 5 }", "router.toml:1: probe: expected the low end of the plate below the high one"),
            ("[probe]\nplate_height = 0\ntip = 0", "router.toml:3: probe.tip: expected a number above 0 and below 1e6"),
            ("[heaters.bed]\nsensor = \"ad595\"", "router.toml:1: heaters: expected a nozzle beside a bed"),
            ("\n[heaters.nozzle]\nsensor = \"ad\"", "router.toml:3: heaters.nozzle.sensor: unknown variant `ad`, expected one of `ad595`, `amplifier`, `thermistor`"),
            ("[heaters]\nextruder = \"a\"", "router.toml:1: heaters: expected the letter of one of its axes as `extruder`"),
            ("[heaters.nozzle]\nsensor = \"ad595\"\nmost = 1e9", "router.toml:3: heaters.nozzle.most: expected between -273 and 2000 degrees"),
            ("[heaters.nozzle]\nsensor = \"ad595\"\nhottest = 270", "router.toml:1: heaters.nozzle: expected `coldest`, `most` and `hottest` in ascending order"),
            ("[heaters.nozzle]\nsensor = { amplifier = { offset_v = nan, gain_v_k = 0.01 } }", "router.toml:2: heaters.nozzle.sensor.amplifier.offset_v: expected between -100 and 100 V"),
            ("[tool_change]\nclearance_mm = -5", "router.toml:2: tool_change.clearance_mm: expected a length between 0 and 1e6 mm"),
            ("[axes.x]\nlimits = { low = 0, high = 9 }\n[axes.y]\nlimits = { low = 9, high = 0 }", "router.toml:3: axes.y: expected the low limit switch below the high one"),
            ("[second_motor]\naxis = \"y\"\nstart = 0\nlimits = { low = 5, high = 5 }", "router.toml:1: second_motor: expected the low limit switch below the high one"),
            ("[tool_switches]\nlower = 2\nupper = 1\nrate_mm_min = 1\nmost_mm = 1", "router.toml:1: tool_switches: expected the upper switch above the lower one"),
            ("[heaters]\nextruder = \"q\"", "router.toml:2: heaters.extruder: expected the letter of one axis, such as \"a\" or \"e\""),
            ("[heaters]\nextruder = \"xy\"", "router.toml:2: heaters.extruder: expected the letter of one axis, such as \"a\" or \"e\""),
            ("[axes.x]\nhome = \"low\"\n[homing]\norder = [\"z\", \"a\"]", "router.toml:3: homing: expected axes that the machine has in `order`"),
            ("[homing]\norder = [\"z\", \"xz\"]", "router.toml:1: homing: expected each axis once in `order`"),
            ("[axes.a]\n[axes.b]\n[homing]\norder = [\"z\", \"x\", \"y\", \"a\", \"b\"]", "router.toml:3: homing: expected four cycles at most in `order`"),
            ("[heaters.nozzle]\nsensor = \"ad595\"\nextrusion = 280", "router.toml:1: heaters.nozzle: expected `extrusion` up to `most`"),
            ("[heaters.nozzle]\nsensor = \"ad595\"\n[heaters.bed]\nsensor = \"ad595\"\nextrusion = 150", "router.toml:3: heaters.bed: expected `extrusion` up to `most`"),
            ("[axes.e]\n[heaters.nozzle]\nsensor = \"ad595\"\nmost = 160", "router.toml:2: heaters.nozzle: expected `extrusion` up to `most`"),
            ("[heaters.nozzle]\nsensor = \"ad595\"\nhysteresis_k = 31", "router.toml:1: heaters.nozzle: expected `hysteresis` above 0, and at most `band`"),
            ("[axes.x]\nlimits = [0, 1]", "router.toml:2: axes.x.limits: invalid type: sequence, expected a table"),
            ("probe = []", "router.toml:1: probe: invalid length 0, expected a table"),
            ("[axes.x]\nlimits = 5", "router.toml:2: axes.x.limits: invalid type: integer `5`, expected a table"),
            ("[drill]\ndepth_mm = 3", "router.toml:1: drill: expected `depth_mm` below 0"),
            ("[drill]\ndepth_mm = -1\nclearance_mm = -2", "router.toml:1: drill: expected `depth_mm` below `clearance_mm`"),
            ("[laser]\nlead_us = 99999", "router.toml:2: laser.lead_us: The value is out of range: expected 0 to 1000 us"),
            ("[motors]\nstep_pulse_us = 1000", "router.toml:2: motors.step_pulse_us: The value is out of range: expected 1 to 255 us"),
            ("[settings]\n\"$2\" = 256", "router.toml:2: settings.$2: The value is out of range: expected 0 to 255"),
            ("[path]\narc_tolerance_mm = 0", "router.toml:2: path.arc_tolerance_mm: The value is out of range: expected more than 0 mm"),
            ("[spindle]\nmax_rpm = -1", "router.toml:2: spindle.max_rpm: The value may not be negative: expected 0 or more 1/min"),
            ("[homing]\nsecond_motor_offset_mm = 50000", "router.toml:2: homing.second_motor_offset_mm: The value is out of range: expected -25 to 25 mm"),
            ("[tool_change]\nshown = \"t\"", "router.toml:2: tool_change.shown: unknown variant `t`, expected `hold` or `tool`"),
        ];
        for (text, expected) in table {
            assert_eq!(complaint(text), expected);
        }
    }

    #[test]
    fn what_is_no_toml_is_shown_with_its_line() {
        let complaint = complaint("name = \"x\"\n\n[axes.x\n");
        assert!(complaint.starts_with("router.toml:3: "), "{complaint}");
    }

    #[test]
    fn what_is_no_text_is_shown_with_its_line() {
        let complaint = Wrong::text(Path::new("router.toml"), b"name = 1\n\n\xff\n").unwrap_err();
        assert_eq!(
            complaint.to_string(),
            "router.toml:3: expected text in UTF-8"
        );
    }

    #[test]
    fn a_file_that_is_not_there_is_named() {
        let error = Profile::load(Path::new("/nowhere/at/all.toml"))
            .unwrap_err()
            .to_string();
        assert!(
            error.starts_with("/nowhere/at/all.toml: cannot be read: "),
            "{error}"
        );
    }
}
