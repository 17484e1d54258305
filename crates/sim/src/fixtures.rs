//! The parts of a simulation that follow from a machine's file: switches, plate, places.

use crate::contacts::Contacts;
use crate::plant::{Edges, Pin, Plate, Side, Switch};
use crate::profile::{
    Axes, Axis, Belts, Ends, Hole, Limits, Positive, Probe, Profile, ToolSwitchesTable,
};
use crate::scene::Tooling;
use crate::tool_pins::{ToolHeight, ToolSwitches};

/// The axis that the probe moves along.
const Z: usize = 2;

/// Grbl's travel, mm, for an axis whose file gives none.
const GRBL_TRAVEL: f64 = 200.0;

/// The things that stand around the motors of a machine. Implemented for a machine's file.
pub trait Fixtures {
    /// Returns true if any carriage works a switch.
    fn has_switches(&self) -> bool;

    /// The switches that carriages work.
    fn plant_switches(&self) -> Vec<Switch>;

    /// The shape of the plate that the probe meets; `None` if it is flat and everywhere.
    fn plate(&self) -> Option<Plate>;

    /// The contacts between the switches and the machine: they bounce, and the board filters its
    /// inputs as the firmware does.
    fn contacts(&self) -> Contacts;

    /// The carriages' places at power-up, in steps.
    fn start<const MOTORS: usize>(&self) -> [i32; MOTORS];

    /// The rule that tells which feed moves are cuts.
    fn tooling(&self) -> Tooling;
}

impl Fixtures for Profile {
    fn has_switches(&self) -> bool {
        !self.plant_switches().is_empty()
    }

    fn plant_switches(&self) -> Vec<Switch> {
        let mut switches = Vec::new();
        for (motor, axis) in self.all_axes().enumerate() {
            switches.extend(limit_switches(self, motor, axis, axis.limits));
        }
        if let Some(second) = &self.second_motor {
            let (motor, axis) = (self.axis_count(), self.axis_of(second));
            switches.extend(limit_switches(self, motor, axis, second.limits));
        }
        switches.extend(self.probe.map(|probe| Switch {
            pin: Pin::Probe,
            motor: Z,
            side: Side::AtOrBelow,
            place: steps(&self.axes.z, probe.plate_height.mm()),
            level: false,
        }));
        switches
    }

    fn plate(&self) -> Option<Plate> {
        let probe = self.probe?;
        let tilt = [probe.tilt_x.mm(), probe.tilt_y.mm()];
        let is_everywhere = probe.x.is_none() && probe.y.is_none() && probe.hole.is_none();
        let is_flat = tilt == [0.0; 2] && probe.bow.mm() == 0.0 && is_everywhere;
        let Axes { x, y, z, .. } = &self.axes;
        let span = [x, y].map(|axis| {
            axis.travel
                .as_ref()
                .map_or(GRBL_TRAVEL, |of| of.get_ref().get())
        });
        let scales = [x, y, z].map(Axis::scale);
        (!is_flat).then(|| Plate::new(tilt, probe.bow.mm(), span, scales).within(edges(&probe)))
    }

    fn contacts(&self) -> Contacts {
        Contacts {
            bounce_us: self.switches.bounce_us,
            filtered: true,
        }
    }

    fn start<const MOTORS: usize>(&self) -> [i32; MOTORS] {
        let second = self.second_motor.as_ref();
        let second = second.map(|second| steps(self.axis_of(second), second.start.mm()));
        let axes = self.all_axes().map(|axis| steps(axis, axis.start.mm()));
        let mut places = axes.chain(second);
        let mut motors = [0; MOTORS].map(|_: i32| places.next().unwrap_or(0));
        if let (Belts::CoreXy, [a, b, ..]) = (self.kinematics, motors.as_mut_slice()) {
            (*a, *b) = (*a + *b, *a - *b);
        }
        motors
    }

    fn tooling(&self) -> Tooling {
        Tooling {
            extruder: self.heat_config().gates.extruder_axis,
        }
    }
}

/// The switches of the tool.
pub(crate) fn tool_port(
    profile: &Profile,
    table: &ToolSwitchesTable,
    z: ToolHeight,
) -> ToolSwitches {
    ToolSwitches {
        z,
        lower: steps(&profile.axes.z, table.lower.mm()),
        upper: steps(&profile.axes.z, table.upper.mm()),
    }
}

/// Returns the ends of the plate under a probe.
fn edges(probe: &Probe) -> Edges {
    let ends = |of: Option<Ends>| of.map(|ends| [ends.low.mm(), ends.high.mm()]);
    let hole = |hole: Hole| ([hole.x.mm(), hole.y.mm()], hole.diameter.get());
    Edges {
        sides: [ends(probe.x), ends(probe.y)],
        hole: probe.hole.map(hole),
        tip: probe.tip.map_or(0.0, Positive::get),
    }
}

/// The limit switches at both ends of a motor's travel.
fn limit_switches(
    profile: &Profile,
    motor: usize,
    axis: &Axis,
    limits: Limits,
) -> impl Iterator<Item = Switch> {
    let limit = |side, mm| Switch {
        pin: Pin::Limit(motor),
        motor,
        side,
        place: steps(axis, mm),
        level: profile.switches.normally_closed,
    };
    let low = limits.low.map(|low| limit(Side::AtOrBelow, low.mm()));
    let high = limits.high.map(|high| limit(Side::AtOrAbove, high.mm()));
    low.into_iter().chain(high)
}

/// A place in steps of the carriage.
fn steps(axis: &Axis, mm: f64) -> i32 {
    (mm * axis.scale()).round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_machine::config::AxisKind;
    use std::path::Path;

    fn parse(text: &str) -> Profile {
        Profile::parse(Path::new("test.toml"), text).unwrap()
    }

    #[test]
    fn a_machine_without_a_file_has_no_switches_and_stands_at_zero() {
        let profile = parse("");
        let (switches, start) = (profile.plant_switches(), profile.start());
        assert_eq!((switches, start), (vec![], [0; 3]));
    }

    #[test]
    fn a_second_motor_comes_after_the_axes_with_the_scale_of_its_own() {
        let profile = parse(
            "[axes.x]\nsteps_per_mm = 80\nstart = 10\nlimits = { low = 0 }\n\
             [second_motor]\naxis = \"x\"\nstart = 8\nlimits = { low = 0.5 }\n",
        );
        assert_eq!(profile.start(), [800, 0, 0, 640]);
        let switches = profile.plant_switches();
        let own = switches.iter().find(|s| s.pin == Pin::Limit(3)).unwrap();
        assert_eq!((own.motor, own.side, own.place), (3, Side::AtOrBelow, 40));
    }

    #[test]
    fn switches_stand_where_the_profile_puts_them() {
        let profile = parse(
            "[axes.x]\nsteps_per_mm = 80\nstart = 10\nlimits = { low = -0.5, high = 400 }\n\
             [axes.a]\nrotary = true\n[probe]\nplate_height = -12\n",
        );
        let places: Vec<_> = profile
            .plant_switches()
            .iter()
            .map(|s| (s.pin, s.side, s.place))
            .collect();
        let expected = [
            (Pin::Limit(0), Side::AtOrBelow, -40),
            (Pin::Limit(0), Side::AtOrAbove, 32_000),
            (Pin::Probe, Side::AtOrBelow, -3_000),
        ];
        assert_eq!(places, expected);
        assert_eq!(profile.start(), [800, 0, 0, 0]);
        assert_eq!(profile.config::<4>().axes[3], AxisKind::Rotary);
    }
}
