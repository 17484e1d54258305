//! The extensions of a machine that its file asks for.

use crate::fixtures::tool_port;
use crate::output_pins::OutputPins;
use crate::oven::{HeatFault, HeatWires, Oven};
use crate::profile::Profile;
use crate::tool_pins::{ToolHeight, ToolSwitches};
use leadscrew_heat::{Fault, Heat};
use leadscrew_machine::extension::OwnCode;
use leadscrew_outputs::{Outputs, OutputsConfig};
use leadscrew_program::{Calculator, Expressions, ERRORS};
use leadscrew_toolchange::ToolChange;
use leadscrew_ztool::{ZTool, NO_SWITCH};

/// Returns the words for an error of an extension.
pub fn error_of(number: u8) -> Option<&'static OwnCode> {
    let mut errors = leadscrew_heat::errors().chain(&ERRORS);
    errors.find(|code| code.number == number)
}

/// Returns the words for an alarm of an extension.
pub fn alarm_of(number: u8) -> Option<&'static OwnCode> {
    let mut alarms = Fault::ALL
        .iter()
        .map(|fault| fault.alarm())
        .chain([&NO_SWITCH]);
    alarms.find(|code| code.number == number)
}

/// The most heaters that a machine can have: nozzle and bed.
pub const HEATERS: usize = 2;

/// Bytes of lines that are kept during a tool change: the size of the largest receive buffer.
const KEPT: usize = 1024;

/// Numbered parameters above #30 and named ones that lines may set, as on an F407.
const PARAMETERS: (usize, usize) = (64, 16);

/// Parameters and expressions in lines. They are large, and most machines have none.
type Calculates = Expressions<
    Box<Calculator<{ PARAMETERS.0 }, { PARAMETERS.1 }>>,
    { PARAMETERS.0 },
    { PARAMETERS.1 },
>;

/// Heaters, outputs, a tool change, a tool between two switches, and expressions; `None` for each
/// that the file does not have.
pub type Own<const AXES: usize> = (
    (
        (Option<Heat<Oven, HEATERS>>, Option<Outputs<OutputPins>>),
        (
            Option<ToolChange<AXES, KEPT>>,
            Option<ZTool<ToolSwitches, AXES>>,
        ),
    ),
    Option<Calculates>,
);

/// The pins that extensions own.
#[derive(Clone, Debug, Default)]
pub struct OwnPins {
    /// The pins of M62 to M65.
    pub outputs: OutputPins,
    /// Works the switches of the tool.
    pub tool: ToolHeight,
}

/// Returns the machine's extensions. The caller gives the outputs; they may be more than the file
/// has.
pub fn extension<const AXES: usize>(
    profile: &Profile,
    outputs: OutputsConfig,
    fault: Option<HeatFault>,
    pins: OwnPins,
) -> Own<AXES> {
    let outputs = (outputs.count > 0).then(|| Outputs::new(outputs, pins.outputs));
    let tools = profile.tool_change.as_ref();
    let tools = tools.map(|table| ToolChange::new(table.config()));
    let switched = profile.tool_switches.as_ref();
    let switched =
        switched.map(|table| ZTool::new(table.config(), tool_port(profile, table, pins.tool)));
    let lines = profile.options.expressions;
    let lines = lines.then(|| Expressions::new(Box::default()));
    (((heat(profile, fault), outputs), (tools, switched)), lines)
}

fn heat(profile: &Profile, fault: Option<HeatFault>) -> Option<Heat<Oven, HEATERS>> {
    if !profile.heaters.is_any() && !profile.fan.fitted {
        return None;
    }
    let config = profile.heat_config();
    let oven = Oven::new(
        &profile.heaters.bodies(),
        config.reference,
        HeatWires {
            supply_relay: profile.heaters.supply_relay,
            fault_input: profile.heaters.fault_input,
        },
        fault,
    );
    // A file with heaters that this refuses is refused when it is read.
    Heat::new(config, profile.heaters.configs(), oven).ok()
}
