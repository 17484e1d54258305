//! The tool change of a machine file.

use super::value::{Place, Positive, Way};
use leadscrew_gcode::Number;
use leadscrew_machine::extension::Shown;
use leadscrew_toolchange::ToolChangeConfig;
use leadscrew_ztool::ZToolConfig;
use schemars::JsonSchema;
use serde::Deserialize;

/// M6 and a tool table, if the file has this table.
#[derive(Clone, Copy, PartialEq, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ToolChangeTable {
    /// The state that senders see during a tool change, while the operator works on the machine.
    pub shown: ShownAs,
    /// How far above the higher end of its way back the tool first rises, mm: the first value of
    /// `$860`.
    pub clearance_mm: Option<Way>,
    /// How long the spindle runs up before Z goes down, ms: the first value of `$861`.
    pub spin_up_ms: Option<u16>,
    /// How fast the tool moves back, mm/min: the first value of `$862`.
    pub rate_mm_min: Option<Positive>,
}

/// A tool that M3 moves down until a switch closes, and M5 moves up until another one closes;
/// fitted if the file has this table.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToolSwitchesTable {
    /// The lower switch closes at this place and below, mm on the scale of Z.
    pub lower: Place,
    /// The upper switch closes at this place and above.
    pub upper: Place,
    /// How fast the tool goes, mm/min.
    pub rate_mm_min: Positive,
    /// How far the tool moves without reaching a switch before an alarm, mm.
    pub most_mm: Positive,
}

impl ToolSwitchesTable {
    /// The configuration of the extension.
    pub fn config(&self) -> ZToolConfig {
        ZToolConfig {
            rate: Number::from_nanos((self.rate_mm_min.get() * 1e9).round() as i64),
            most_mm: self.most_mm.get() as f32,
        }
    }
}

/// A state that senders see.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ShownAs {
    /// `Hold:0`, which every sender knows.
    #[default]
    Hold,
    /// `Tool`, for senders that know it.
    Tool,
}

impl ToolChangeTable {
    /// The configuration of the extension.
    pub fn config(&self) -> ToolChangeConfig {
        let usual = ToolChangeConfig::DEFAULT;
        let number = |value: f64| Number::from_nanos((value * 1e9).round() as i64);
        ToolChangeConfig {
            shown: match self.shown {
                ShownAs::Hold => Shown::Hold,
                ShownAs::Tool => Shown::Tool,
            },
            clearance: self
                .clearance_mm
                .map_or(usual.clearance, |way| number(way.mm())),
            spin_up: self
                .spin_up_ms
                .map_or(usual.spin_up, |ms| Number::from_int(ms.into())),
            rate: self
                .rate_mm_min
                .map_or(usual.rate, |rate| number(rate.get())),
        }
    }
}
