//! Makes the machine's build from its file.

use super::{
    Axes, Axis, AxisLetters, Belts, End, GantryAxis, Limits, OutputsTable, Place, Positive,
    Profile, SecondMotor, Stops, ToolSwitchesTable, MOST_AXES,
};
use leadscrew_machine::config::SwitchRules;
use leadscrew_machine::config::{
    AxisKind, Dialect, MachineConfig, Options, ParkingConfig, Squaring,
};
use leadscrew_outputs::OutputsConfig;
use leadscrew_planner::Train;

/// The most axes of a machine with a second motor.
const GANGED_AXES: usize = 4;

/// Letters of the axes except the extruder's, in order.
const LETTERS: [char; 6] = ['X', 'Y', 'Z', 'A', 'B', 'C'];

/// The letter of the extruder.
const EXTRUDER: char = 'E';

/// Bytes of unanswered lines that a sender may have sent, if the profile does not say.
const RECEIVE_BUFFER: u16 = 1024;

/// The range of an axis's carriage, mm on the axis' own scale.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Room {
    /// Its place at power-up.
    pub start: f64,
    /// The place at which its switch at the low end closes.
    pub low: Option<f64>,
    /// The place at which its switch at the high end closes.
    pub high: Option<f64>,
    /// True if it may pass its switches: they serve homing only.
    pub passes: bool,
    /// Steps of its motor in a millimetre.
    pub steps_per_mm: f64,
}

impl Profile {
    /// The number of axes: 3 to 6.
    pub fn axis_count(&self) -> usize {
        self.all_axes().count()
    }

    /// The gearing between its axes and motors.
    pub fn train(&self) -> Train {
        match (self.kinematics, &self.second_motor) {
            (Belts::CoreXy, _) => Train::Crossed,
            (Belts::Cartesian, Some(second)) => Train::Ganged(second.axis.number()),
            (Belts::Cartesian, None) => Train::Straight,
        }
    }

    /// The number of motors: one for each axis, and a second motor if there is one.
    pub fn motor_count(&self) -> usize {
        self.axis_count() + usize::from(self.second_motor.is_some())
    }

    /// Bytes of unanswered lines that a sender may have sent.
    pub fn receive_buffer(&self) -> u16 {
        self.receive_buffer.map_or(RECEIVE_BUFFER, |size| size.0)
    }

    /// The build of a machine with `AXES` axes. Its first settings stay in memory to the end of the
    /// program.
    pub fn config<const AXES: usize>(&self) -> MachineConfig<AXES> {
        MachineConfig {
            defaults: self.first_settings().leak(),
            ..self.bare_config()
        }
    }

    /// The same build with Grbl's first settings.
    pub fn bare_config<const AXES: usize>(&self) -> MachineConfig<AXES> {
        let mut config = MachineConfig::new();
        for ((kind, axis), letter) in config
            .axes
            .iter_mut()
            .zip(self.all_axes())
            .zip(self.letters())
        {
            *kind = match letter {
                EXTRUDER => AxisKind::Extruder,
                _ if axis.rotary => AxisKind::Rotary,
                _ => AxisKind::Linear,
            };
        }
        config.options = Options {
            door: self.door.fitted,
            line_numbers: self.options.line_numbers,
            single_axis_homing: self.options.single_axis_homing,
            parking: self.options.parking.then_some(ParkingConfig::GRBL),
        };
        config.dialect = Dialect {
            mist: self.options.mist,
            parking_override: self.options.parking_override,
            cycles: true,
            linuxcnc: true,
            tools: self.tool_change.is_some(),
        };
        if let Some(look_ahead) = self.look_ahead {
            config.moves = look_ahead.0;
        }
        if let Some(homing) = &self.homing.order {
            let mut cycles = homing.iter().map(|letters| letters.0);
            config.homing_cycles = config.homing_cycles.map(|_| cycles.next().unwrap_or(0));
        }
        config.rules = self.switch_rules();
        if let Some(first) = config.homing_cycles.first_mut() {
            *first |= config.rules.without_switch;
        }
        if let Some(second) = &self.second_motor {
            let own = second.squaring;
            let grbl = config.squaring;
            let or = |own: Option<Positive>, grbl: f32| own.map_or(grbl, |own| own.get() as f32);
            config.squaring = Squaring {
                tolerance: or(own.tolerance, grbl.tolerance),
                least_mm: or(own.least, grbl.least_mm),
                most_mm: or(own.most, grbl.most_mm),
            };
        }
        config
    }

    fn switch_rules(&self) -> SwitchRules {
        let mask = |holds: fn(&Axis) -> bool| {
            let axes = self.all_axes().enumerate();
            axes.fold(0, |mask, (axis, of)| mask | u8::from(holds(of)) << axis)
        };
        SwitchRules {
            named: self.switches.named,
            back_off_mm: self
                .switches
                .back_off_mm
                .map_or(0.0, |way| way.get() as f32),
            reported: self.switches.reported,
            drops_drivers: self.switches.stop_drops_drivers,
            without_switch: mask(|axis| axis.home == End::Zero),
            homing_only: mask(|axis| axis.stops == Stops::Homing),
            towards_low: mask(|axis| axis.stops == Stops::Towards && axis.limits.low.is_some()),
            towards_high: mask(|axis| axis.stops == Stops::Towards && axis.limits.high.is_some()),
        }
    }

    /// A wrong key in the tables of extensions, and the expected value.
    fn contradiction_of_extensions(&self) -> Option<(&'static str, &'static str)> {
        let is_upside_down = |table: &ToolSwitchesTable| table.upper <= table.lower;
        if self.tool_switches.as_ref().is_some_and(is_upside_down) {
            let expected = "expected the upper switch above the lower one";
            return Some(("tool_switches", expected));
        }
        let mut ends = self.probe.iter().flat_map(|probe| [probe.x, probe.y]);
        if ends.any(|of| of.is_some_and(|ends| ends.high <= ends.low)) {
            let expected = "expected the low end of the plate below the high one";
            return Some(("probe", expected));
        }
        self.contradiction_of_heaters()
    }

    /// A wrong key about the axis E, and the expected value.
    fn contradiction_of_extruder(&self) -> Option<(&'static str, &'static str)> {
        let order = self.homing.order.iter().flatten();
        let mut all = order.fold(0, |all, letters| all | letters.0);
        all &= AxisLetters::EXTRUDER;
        if all != 0 {
            return Some(("homing", "expected no e in `order`: filament has no home"));
        }
        if self.axis_count() > MOST_AXES {
            return Some(("axes", "expected six axes at most"));
        }
        let has_places =
            |e: &Axis| e.rotary || e.home != End::default() || e.limits != Limits::default();
        self.axes.e.as_ref().is_some_and(has_places).then_some((
            "axes.e",
            "expected filament: without `rotary`, `home` and `limits`",
        ))
    }

    /// An axis whose two limit switches would be closed at the same time, and the expected value.
    fn contradiction_of_limits(&self) -> Option<(&'static str, &'static str)> {
        let tables = self.letters().into_iter().map(table);
        let limits = self.all_axes().map(|axis| axis.limits);
        let second = self
            .second_motor
            .as_ref()
            .map(|second| ("second_motor", second.limits));
        let mut all = tables.zip(limits).chain(second);
        let are_swapped = |limits: Limits| {
            let ends = limits.low.zip(limits.high);
            ends.is_some_and(|(low, high)| low >= high)
        };
        let (table, _) = all.find(|(_, limits)| are_swapped(*limits))?;
        Some((table, "expected the low limit switch below the high one"))
    }

    /// A key that contradicts other keys, and the expected value.
    pub(super) fn contradiction(&self) -> Option<(&'static str, &'static str)> {
        if self.axes.c.is_some() && self.axes.b.is_none()
            || self.axes.b.is_some() && self.axes.a.is_none()
        {
            return Some((
                "axes",
                "expected axes in the order x, y, z, a, b, c without a gap",
            ));
        }
        let found = self
            .contradiction_of_extruder()
            .or_else(|| self.contradiction_of_order())
            .or_else(|| self.contradiction_of_limits())
            .or_else(|| self.contradiction_of_drill());
        if found.is_some() {
            return found;
        }
        let knows_no_end = |axis: &Axis| {
            let Limits { low, high } = axis.limits;
            axis.stops == Stops::Towards && low.is_some() == high.is_some()
        };
        if self.all_axes().any(knows_no_end) {
            return Some((
                "axes",
                "expected one limit switch, low or high, on an axis with `stops = \"towards\"`: both ends share an input",
            ));
        }
        if self.axis_count() > GANGED_AXES && self.second_motor.is_some() {
            return Some(("second_motor", "expected 3 or 4 axes beside a second motor"));
        }
        let steps = |axis: &Axis| axis.steps_per_mm.as_ref().map(|steps| *steps.get_ref());
        let expected = match self.kinematics {
            Belts::Cartesian => return self.contradiction_of_extensions(),
            Belts::CoreXy if self.second_motor.is_some() => {
                "expected `cartesian` beside a second motor"
            }
            Belts::CoreXy if steps(&self.axes.x) != steps(&self.axes.y) => {
                "expected X and Y with the same steps_per_mm on crossed belts"
            }
            Belts::CoreXy => return self.contradiction_of_extensions(),
        };
        Some(("kinematics", expected))
    }

    /// The rooms of the axes' carriages, in order; `None` for an axis without a limit switch.
    pub fn rooms(&self) -> Vec<Option<Room>> {
        let room = |axis: &Axis| Room {
            start: axis.start.mm(),
            low: axis.limits.low.map(Place::mm),
            high: axis.limits.high.map(Place::mm),
            passes: axis.stops == Stops::Homing,
            steps_per_mm: axis.scale(),
        };
        let has_end = |axis: &Axis| axis.limits.low.is_some() || axis.limits.high.is_some();
        let all = self.all_axes();
        all.map(|axis| has_end(axis).then(|| room(axis))).collect()
    }

    /// The axis that a second motor helps to move.
    pub fn axis_of(&self, second: &SecondMotor) -> &Axis {
        match second.axis {
            GantryAxis::X => &self.axes.x,
            GantryAxis::Y => &self.axes.y,
        }
    }

    /// The axes, in order.
    pub fn all_axes(&self) -> impl Iterator<Item = &Axis> {
        let Axes {
            x,
            y,
            z,
            a,
            b,
            c,
            e,
        } = &self.axes;
        [x, y, z].into_iter().chain(a).chain(b).chain(c).chain(e)
    }

    /// The letters of the axes, in order: the extruder's is the last.
    pub fn letters(&self) -> Vec<char> {
        let extruder = usize::from(self.axes.e.is_some());
        let others = self.axis_count() - extruder;
        let letters = LETTERS.into_iter().take(others);
        letters.chain((extruder == 1).then_some(EXTRUDER)).collect()
    }

    /// The letters of the axes that turn.
    pub fn turning(&self) -> Vec<char> {
        let axes = self.letters().into_iter().zip(self.all_axes());
        axes.filter_map(|(letter, axis)| axis.rotary.then_some(letter))
            .collect()
    }

    /// Steps of a whole turn of each axis's motor, if the file says it.
    pub fn steps_per_rev(&self) -> Vec<Option<f64>> {
        let turns = self.all_axes().map(|axis| axis.steps_per_rev);
        turns.map(|steps| steps.map(Positive::get)).collect()
    }

    /// The letters of the motors. A second motor has the first letter that no axis has.
    pub fn motor_letters(&self) -> Vec<char> {
        let mut letters = self.letters();
        let free = LETTERS.into_iter().find(|of| !letters.contains(of));
        letters.extend(free.filter(|_| self.second_motor.is_some()));
        letters
    }

    /// The number of the axis with this letter, a capital.
    pub(super) fn axis_of_letter(&self, letter: char) -> Option<usize> {
        self.letters().iter().position(|of| *of == letter)
    }
}

impl OutputsTable {
    /// The configuration of the extension for M62 to M65.
    pub fn config(&self) -> OutputsConfig {
        OutputsConfig {
            count: self.count.0,
            boot: self.boot,
            stay: self.stay,
        }
    }
}

impl Axis {
    /// Steps of its motor in a millimetre: the file's, or else Grbl's.
    pub fn scale(&self) -> f64 {
        const GRBL: f64 = 250.0;
        let own = self.steps_per_mm.as_ref();
        own.map_or(GRBL, |steps| steps.get_ref().get())
    }
}

impl GantryAxis {
    /// Its number, from 0.
    pub fn number(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
        }
    }
}

/// The table of an axis in the file.
fn table(letter: char) -> &'static str {
    match letter {
        'X' => "axes.x",
        'Y' => "axes.y",
        'Z' => "axes.z",
        'A' => "axes.a",
        'B' => "axes.b",
        'C' => "axes.c",
        _ => "axes",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_gcode::Number;
    use leadscrew_machine::protocol::status::Status;
    use leadscrew_machine::settings::table::{AxisSetting, Setting};
    use leadscrew_machine::settings::values::Settings;
    use std::path::Path;

    fn parse(text: &str) -> Profile {
        Profile::parse(Path::new("test.toml"), text).unwrap()
    }

    #[test]
    fn a_profile_without_keys_is_a_stock_grbl_without_switches() {
        let profile = parse("");
        let config = profile.config::<3>();
        assert_eq!(config, MachineConfig::new());
    }

    #[test]
    fn what_an_axis_has_becomes_its_first_settings_and_the_settings_win() {
        let profile = parse(
            "[axes.y]\nsteps_per_mm = 228.571\ntravel = 300\n[switches]\nnormally_closed = true\n\
             [settings]\n\"$131\" = 290.5\n\"$20\" = 1\n\"$22\" = 1\n",
        );
        let config = profile.config::<3>();
        let settings = Settings::<3>::new(config.defaults);
        let steps = settings.axes(AxisSetting::StepsPerMm);
        assert_eq!(steps[1], Number::from_nanos(228_571_000_000));
        assert_eq!(
            settings.axes(AxisSetting::Travel)[1],
            Number::from_nanos(290_500_000_000)
        );
        assert!(settings.is_on(Setting::LimitInvert) && settings.is_on(Setting::SoftLimits));
    }

    #[test]
    fn a_setting_that_the_machine_refuses_is_named_with_its_line() {
        let parse = |text| Profile::parse(Path::new("test.toml"), text).unwrap_err();
        let complaint = parse("[settings]\n\"$1\" = 25\n\"$0\" = 0.9\n");
        assert_eq!((complaint.line, complaint.key.as_str()), (3, "settings.$0"));
        assert_eq!(complaint.message, Status::StepPulseTooShort.text());
        assert_eq!(parse("[settings]\n\"$999\" = 1").key, "settings.$999");
        assert_eq!(parse("[settings]\n\"$20\" = 1").key, "settings.$20");
    }
}
