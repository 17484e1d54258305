//! The module of a machine that has a file: its axes, its first settings, its extensions.
use leadscrew_boards::{Board, Needs};
use leadscrew_heat::HeatConfig;
use leadscrew_machine::config::{AxisKind, MachineConfig};
use leadscrew_sim::{
    profile::{Belts, Profile},
    train::Train,
};
use leadscrew_toolchange::ToolChangeConfig;

/// Axes of the largest machine that a file describes: the configuration is made for so many, and cut.
const MOST: usize = 6;

/// Bytes of lines that are kept during a tool change: as many as a serial line's buffer takes.
const KEPT: usize = 1024;

/// The reference voltage of a board's converter where its file does not say, V.
const REFERENCE: f32 = 3.3;

/// An extension of the machine, as the firmware compiles it.
pub(crate) struct Extension {
    /// The condition under which the module of its pins is compiled, if it has any.
    pub(crate) cfg: Option<&'static str>,
    of_type: String,
    value: String,
}

/// A part of the machine that the firmware cannot drive.
pub(crate) fn unknown_part(profile: &Profile) -> Option<&'static str> {
    let parts = [
        (profile.motor_count() > 4, "fifth motor"),
        (
            profile.fan.fitted && !profile.heaters.is_any(),
            "fan without a heater",
        ),
    ];
    parts
        .into_iter()
        .find_map(|(has, part)| has.then_some(part))
}

/// The parts of a board that the machine uses.
pub(crate) fn needs(profile: &Profile) -> Needs {
    Needs {
        motors: profile.motor_count(),
        outputs: usize::from(profile.outputs.config().count),
        tool: profile.tool_switches.is_some(),
        heaters: profile.heaters.configs().len(),
        fan: profile.fan.fitted,
    }
}

/// The extensions of the machine on a board that has its sockets.
pub(crate) fn extensions(profile: &Profile, board: &Board) -> Vec<Extension> {
    let outputs = profile.outputs.config();
    let outputs = (outputs.count > 0).then(|| Extension {
        cfg: Some("outputs"),
        of_type: "leadscrew_outputs::Outputs<crate::outputs::OutputPins>".to_owned(),
        value: format!(
            "leadscrew_outputs::Outputs::new(leadscrew_outputs::{outputs:?}, crate::outputs::OutputPins)"
        ),
    });
    let heaters = profile.heaters.configs();
    let heat = (!heaters.is_empty()).then(|| {
        let reference = board.sockets.reference.unwrap_or(REFERENCE);
        let config = HeatConfig {
            reference,
            ..profile.heat_config()
        };
        let count = heaters.len();
        Extension {
            cfg: Some("heaters"),
            of_type: format!("leadscrew_heat::Heat<crate::heaters::HeatPins, {count}>"),
            // The Debug of these values is their source, where their names are in scope.
            value: format!(
                "{{ #[allow(unused_imports)] use leadscrew_heat::{{Gates, Heat, HeatConfig, HeaterConfig, Limits, Sensor::*}}; Heat::new({config:?}, {heaters:?}, crate::heaters::HeatPins::new()) }}"
            ),
        }
    });
    let tool = profile.tool_switches.zip(board.sockets.tool);
    let tool = tool.map(|(table, switches)| {
        let config = table.config();
        let (rate, most) = (number(config.rate), config.most_mm);
        let (lower, upper) = (switches.lower.literal(), switches.upper.literal());
        Extension {
            cfg: Some("tool_switches"),
            of_type: "leadscrew_ztool::ZTool<crate::tool::ToolPins, AXES>".to_owned(),
            value: format!(
                "leadscrew_ztool::ZTool::new(leadscrew_ztool::ZToolConfig {{ rate: {rate}, most_mm: {most:?} }}, crate::tool::ToolPins::new({lower}, {upper}))"
            ),
        }
    });
    let change = profile.tool_change.as_ref().map(|table| Extension {
        cfg: None,
        of_type: format!("leadscrew_toolchange::ToolChange<AXES, {KEPT}>"),
        value: format!(
            "leadscrew_toolchange::ToolChange::new({})",
            tool_change(table.config())
        ),
    });
    heat.into_iter()
        .chain(outputs)
        .chain(tool)
        .chain(change)
        .collect()
}

fn tool_change(config: ToolChangeConfig) -> String {
    let ToolChangeConfig {
        shown,
        clearance,
        spin_up,
        rate,
    } = config;
    let (clearance, spin_up, rate) = (number(clearance), number(spin_up), number(rate));
    format!(
        "leadscrew_toolchange::ToolChangeConfig {{ shown: leadscrew_machine::extension::Shown::{shown:?}, clearance: {clearance}, spin_up: {spin_up}, rate: {rate} }}"
    )
}

/// The module that the firmware includes.
pub(crate) fn module(profile: &Profile, extensions: &[Extension]) -> String {
    let (axes, motors) = (profile.axis_count(), profile.motor_count());
    let config = profile.config::<MOST>();
    let kinds = config.axes.iter().take(axes).map(|kind| match kind {
        AxisKind::Linear => "Linear",
        AxisKind::Rotary => "Rotary",
        AxisKind::Extruder => "Extruder",
    });
    let kinds = kinds.map(|kind| format!("leadscrew_machine::config::AxisKind::{kind}"));
    let (kind, value) = kinematics(profile);
    let (own_type, own_value) = nested(extensions);
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

/// The statements for all that a machine's file may choose beside axes and settings.
fn choices(config: &MachineConfig<MOST>) -> String {
    let MachineConfig {
        moves,
        homing_cycles,
        squaring,
        rules,
        options,
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
        ("line_numbers", options.line_numbers),
        ("single_axis_homing", options.single_axis_homing),
        ("parking_override", options.parking_override),
        ("tools", options.tools),
    ];
    for (name, on) in flags {
        text += &format!("    config.options.{name} = {on};\n");
    }
    text
}

/// All extensions as one: pairs of pairs.
fn nested(extensions: &[Extension]) -> (String, String) {
    match extensions {
        [] => ("()".to_owned(), "()".to_owned()),
        [one] => (one.of_type.clone(), one.value.clone()),
        [first, rest @ ..] => {
            let (types, values) = nested(rest);
            (
                format!("({}, {types})", first.of_type),
                format!("({}, {values})", first.value),
            )
        }
    }
}

fn number(number: leadscrew_gcode::Number) -> String {
    format!("leadscrew_gcode::Number::from_nanos({})", number.nanos())
}
