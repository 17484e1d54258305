//! The module of a machine that has a file: its axes, its first settings, its options.
use crate::extensions::{self, Extension};
use leadscrew_machine::config::{AxisKind, MachineConfig};
use leadscrew_machine_file::{Belts, Profile};
use leadscrew_planner::Train;

/// The most axes that a file describes. The configuration is made for all of them; the module has
/// the machine's own.
const MOST: usize = 6;

/// The module that the firmware includes.
pub(crate) fn module(profile: &Profile, extensions: &[Extension]) -> String {
    let (axes, motors) = (profile.axis_count(), profile.motor_count());
    let config = profile.config::<MOST>();
    let kinds = config.axes.iter().take(axes).map(|kind| match kind {
        AxisKind::Linear => "Linear",
        AxisKind::Rotary => "Rotary",
        AxisKind::Extruder => "Extruder",
        AxisKind::Absent => "Absent",
    });
    let kinds = kinds.map(|kind| format!("leadscrew_machine::config::AxisKind::{kind}"));
    let (kind, value) = kinematics(profile);
    let (own_type, own_value) = extensions::nested(extensions);
    format!(
        "pub(crate) const AXES: usize = {axes};
pub(crate) const MOTORS: usize = {motors};
pub(crate) type Kinematics = leadscrew_planner::{kind};
pub(crate) const fn kinematics() -> Kinematics {{
    leadscrew_planner::{value}
}}
const DEFAULTS: &[Entry] = &[{}];
pub(crate) const fn config() -> MachineConfig<AXES> {{
    let mut config = MachineConfig::new();
    config.axes = [{}];
    config.defaults = DEFAULTS;
{}    config
}}
pub(crate) type Own = {own_type};
pub(crate) fn own() -> Own {{
    {own_value}
}}
",
        entries(profile),
        kinds.collect::<Vec<_>>().join(", "),
        choices(&config),
    )
}

/// Type and value of the kinematics.
fn kinematics(profile: &Profile) -> (String, String) {
    match (profile.train(), profile.kinematics) {
        (Train::Ganged(axis), _) => (
            "Ganged<1>".to_owned(),
            format!("Ganged {{ axis_of: [{axis}] }}"),
        ),
        (_, Belts::CoreXy) => ("CoreXy".to_owned(), "CoreXy".to_owned()),
        (_, Belts::Cartesian) => ("Cartesian".to_owned(), "Cartesian".to_owned()),
    }
}

/// The first settings.
fn entries(profile: &Profile) -> String {
    let entries = profile.first_settings().into_iter().map(|entry| {
        let (of, value) = (entry.number, number(entry.value));
        format!("Entry {{ number: {of}, value: {value} }}, ")
    });
    entries.collect()
}

/// The statements for all choices of a machine's file besides axes and settings.
fn choices(config: &MachineConfig<MOST>) -> String {
    let MachineConfig {
        moves,
        homing_cycles,
        squaring,
        rules,
        options,
        dialect,
        ..
    } = config;
    let parking = options.parking.map_or("None", |_| {
        "Some(leadscrew_machine::config::ParkingConfig::GRBL)"
    });
    let mut text = format!(
        "    config.moves = {moves};
    config.homing_cycles = {homing_cycles:?};
    config.squaring = leadscrew_machine::config::{squaring:?};
    config.rules = leadscrew_machine::config::{rules:?};
    config.options.parking = {parking};
"
    );
    let flags = [
        ("options.line_numbers", options.line_numbers),
        ("options.single_axis_homing", options.single_axis_homing),
        ("dialect.parking_override", dialect.parking_override),
        ("dialect.tools", dialect.tools),
    ];
    for (name, on) in flags {
        text += &format!("    config.{name} = {on};\n");
    }
    text
}

/// A number as source.
pub(crate) fn number(number: leadscrew_gcode::Number) -> String {
    format!("leadscrew_gcode::Number::from_nanos({})", number.nanos())
}
