//! A recorded conversation as it is stored in a file.

use leadscrew_machine::config::{AxisKind, Dialect, MachineConfig, Options, ParkingConfig};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// A conversation with a machine.
#[derive(Clone, PartialEq, Debug, Deserialize, Serialize)]
#[serde(expecting = "an object with `exchanges`")]
pub struct Case {
    /// The options that the machine was built with.
    #[serde(default)]
    pub build: Build,
    /// The operations and their answers, in order.
    pub exchanges: Vec<Exchange>,
    /// Name, group, purpose and other keys: copied to the output unchanged.
    #[serde(flatten)]
    pub other: Map<String, Value>,
}

/// One operation, and the lines that ended before the next operation.
#[derive(Clone, PartialEq, Debug, Deserialize, Serialize)]
pub struct Exchange {
    /// The operation: an [`super::Op`].
    pub op: String,
    /// The time at which it began, ms of virtual time since the first power-up. Power-up itself may
    /// lack it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub t_ms: Option<f64>,
    /// The lines that came, without line ends; including empty lines.
    #[serde(default)]
    pub recv: Vec<String>,
}

/// The options with which the recorded Grbl was compiled.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Build {
    /// With Grbl's default options.
    #[default]
    Default,
    /// Mist coolant.
    M7,
    /// Mist coolant, safety door, line numbers in reports, homing of single axes.
    Ext,
    /// Safety door and parking; M56 forbids and allows parking.
    Park,
}

/// The axes of the recorded Grbl.
const AXES: usize = 3;

/// The moves that Grbl plans ahead in a build in which each move also keeps its line number.
const MOVES_WITH_LINE_NUMBERS: usize = 14;

impl Build {
    /// Returns the configuration of a machine with this build, which has the first three of `N`
    /// axes.
    pub fn config<const N: usize>(self) -> MachineConfig<N> {
        let mut config = MachineConfig::grbl();
        config.axes.iter_mut().skip(AXES).for_each(|kind| {
            *kind = AxisKind::Absent;
        });
        config.options = self.options();
        config.dialect = Dialect {
            mist: matches!(self, Self::M7 | Self::Ext),
            parking_override: self == Self::Park,
            ..config.dialect
        };
        if config.options.line_numbers {
            config.moves = MOVES_WITH_LINE_NUMBERS;
        }
        config
    }

    fn options(self) -> Options {
        let stock = Options::default();
        match self {
            Self::Default | Self::M7 => stock,
            Self::Ext => Options {
                door: true,
                line_numbers: true,
                single_axis_homing: true,
                ..stock
            },
            Self::Park => Options {
                door: true,
                parking: Some(ParkingConfig::GRBL),
                ..stock
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_replayed_is_handed_on() {
        let text =
            r#"{"name":"a","build":"ext","timing":true,"exchanges":[{"op":"(boot)","recv":[""]}]}"#;
        let case: Case = serde_json::from_str(text).unwrap();
        assert_eq!(case.build, Build::Ext);
        let again: Value = serde_json::to_value(&case).unwrap();
        assert_eq!(again, serde_json::from_str::<Value>(text).unwrap());
    }

    #[test]
    fn a_build_that_nobody_recorded_is_refused() {
        let error = serde_json::from_str::<Case>(r#"{"build":"own","exchanges":[]}"#).unwrap_err();
        assert!(error.to_string().contains("own"), "{error}");
    }
}
