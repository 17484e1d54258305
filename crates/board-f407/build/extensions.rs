//! The extensions of a machine that has a file, as source of the firmware.
use crate::machine::number;
use leadscrew_boards::Board;
use leadscrew_heat::{HeatConfig, Sensor};
use leadscrew_machine_file::Profile;

/// Bytes of lines that are kept during a tool change: as many as a serial line's buffer takes.
const KEPT: usize = 1024;

/// Numbered parameters above #30 and named ones that lines may set: 5 KB with all that goes with
/// them.
const PARAMETERS: (usize, usize) = (64, 16);

/// The reference voltage of a board's converter if its file does not say, V.
const REFERENCE: f32 = 3.3;

/// An extension, as the firmware compiles it.
pub(crate) struct Extension {
    /// The condition under which the module of its pins is compiled, if it has any.
    pub(crate) cfg: Option<&'static str>,
    of_type: String,
    value: String,
}

/// The extensions of the machine. The board has the sockets for them.
pub(crate) fn all(profile: &Profile, board: &Board) -> Vec<Extension> {
    let all = [
        heat(profile, board),
        outputs(profile),
        tool_switches(profile, board),
        tool_change(profile),
        expressions(profile),
    ];
    all.into_iter().flatten().collect()
}

/// The message about a heater whose sensor is an amplifier and cannot read above `hottest` on this
/// board: a broken wire would not be seen.
pub(crate) fn blind_sensor(profile: &Profile, board: &Board) -> Option<String> {
    let reference = reference(board);
    profile.heaters.configs().into_iter().find_map(|heater| {
        let full = heater.sensor.celsius(1.0, reference);
        let (name, hottest) = (heater.name, heater.limits.hottest);
        let is_blind = matches!(heater.sensor, Sensor::Linear { .. }) && full <= hottest;
        is_blind.then(|| {
            format!(
                "heater {name}: `hottest` is {hottest} °C, and at {reference} V its sensor reads {full:.0} °C at most: \
                 a broken wire would not be seen"
            )
        })
    })
}

/// The reference voltage of a board's converter, V.
fn reference(board: &Board) -> f32 {
    board.sockets.reference.unwrap_or(REFERENCE)
}

/// Type and value of all extensions as one: pairs of pairs.
pub(crate) fn nested(extensions: &[Extension]) -> (String, String) {
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

/// Heaters and a fan. The `Debug` text of a configuration is its source text if the names are in
/// scope.
fn heat(profile: &Profile, board: &Board) -> Option<Extension> {
    const NAMES: &str = "Gates, Heat, HeatConfig, HeaterConfig, Limits, Sensor::*";
    let heaters = profile.heaters.configs();
    let count = heaters.len();
    let config = HeatConfig {
        reference: reference(board),
        ..profile.heat_config()
    };
    let value = format!(
        "{{
        use leadscrew_heat::{{{NAMES}}};
        let heat = Heat::new({config:?}, {heaters:?}, crate::heaters::HeatPins::new());
        let Ok(heat) = heat else {{ panic!(\"a heater is not watched\") }};
        heat
    }}"
    );
    (count > 0).then(|| Extension {
        cfg: Some("heaters"),
        of_type: format!("leadscrew_heat::Heat<crate::heaters::HeatPins, {count}>"),
        value,
    })
}

/// Makes the extension of M62 to M65, if the machine has outputs.
fn outputs(profile: &Profile) -> Option<Extension> {
    let config = profile.outputs.config();
    (config.count > 0).then(|| Extension {
        cfg: Some("outputs"),
        of_type: "leadscrew_outputs::Outputs<crate::outputs::OutputPins>".to_owned(),
        value: format!(
            "{{
        use leadscrew_outputs::{{Outputs, OutputsConfig}};
        Outputs::new({config:?}, crate::outputs::OutputPins)
    }}"
        ),
    })
}

/// A tool between two switches.
fn tool_switches(profile: &Profile, board: &Board) -> Option<Extension> {
    let switches = board.sockets.tool?;
    let config = profile.tool_switches?.config();
    let (rate, most_mm) = (number(config.rate), config.most_mm);
    let (lower, upper) = (switches.lower.literal(), switches.upper.literal());
    Some(Extension {
        cfg: Some("tool_switches"),
        of_type: "leadscrew_ztool::ZTool<crate::tool::ToolPins, AXES>".to_owned(),
        value: format!(
            "{{
        use leadscrew_ztool::{{ZTool, ZToolConfig}};
        let config = ZToolConfig {{ rate: {rate}, most_mm: {most_mm:?} }};
        ZTool::new(config, crate::tool::ToolPins::new({lower}, {upper}))
    }}"
        ),
    })
}

/// M6 and a tool table.
fn tool_change(profile: &Profile) -> Option<Extension> {
    let config = profile.tool_change.as_ref()?.config();
    let shown = config.shown;
    let [clearance, spin_up, rate] = [config.clearance, config.spin_up, config.rate].map(number);
    Some(Extension {
        cfg: None,
        of_type: format!("leadscrew_toolchange::ToolChange<AXES, {KEPT}>"),
        value: format!(
            "{{
        use leadscrew_machine::extension::Shown;
        use leadscrew_toolchange::{{ToolChange, ToolChangeConfig}};
        ToolChange::new(ToolChangeConfig {{
            shown: Shown::{shown:?},
            clearance: {clearance},
            spin_up: {spin_up},
            rate: {rate},
        }})
    }}"
        ),
    })
}

/// Parameters and expressions in lines. The core coupled memory has no room for them.
fn expressions(profile: &Profile) -> Option<Extension> {
    let (numbered, named) = PARAMETERS;
    let memory = format!("leadscrew_program::Calculator<{numbered}, {named}>");
    profile.options.expressions.then(|| Extension {
        cfg: None,
        of_type: format!(
            "Option<leadscrew_program::Expressions<&'static mut {memory}, {numbered}, {named}>>"
        ),
        value: format!(
            "{{
        use leadscrew_program::{{Calculator, Expressions}};
        cortex_m::singleton!(: {memory} = Calculator::new()).map(Expressions::new)
    }}"
        ),
    })
}
