//! `$ES`, `$EG`, `$EE`, `$EA` and `$SED=`: lists of settings, errors and alarms in the form that
//! senders of grblHAL read (its wiki, "Report extensions"). Fields stand between `|`, in brackets.

use crate::group::Group;
use crate::table::{Kind, Row};
use crate::values::Key;
use core::fmt;
use leadscrew_protocol::alarm::Alarm;
use leadscrew_protocol::report::AXIS_LETTERS;
use leadscrew_protocol::status::Status;

/// `[SETTING:`: number, group, name, unit, data type, format, least, most, whether it needs a
/// restart, whether it may be empty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SettingInfo {
    /// The setting's row of the table.
    pub row: Row,
    /// The axis of the setting, counted from 0.
    pub axis: Option<usize>,
    /// The letter of that axis.
    pub letter: char,
    /// The least value of a whole number: more than 0 for a step pulse.
    pub least: u8,
}

/// `[SETTINGGROUP:`: number, number of the group that it belongs to, title.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GroupInfo(pub Group);

/// `[SETTINGDESCR:`: number and description.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Description {
    /// The number after the `$`.
    pub number: u16,
    /// Its effect.
    pub text: &'static str,
}

/// `[ERRORCODE:`: number, an empty field, words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ErrorInfo {
    /// Its number.
    pub number: u8,
    /// Its short text.
    pub text: &'static str,
}

/// `[ALARMCODE:`: number, an empty field, words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AlarmInfo {
    /// Its number.
    pub number: u8,
    /// Its short text.
    pub text: &'static str,
}

impl From<Status> for ErrorInfo {
    fn from(of: Status) -> Self {
        Self {
            number: of.number(),
            text: of.text(),
        }
    }
}

impl From<Alarm> for AlarmInfo {
    fn from(of: Alarm) -> Self {
        Self {
            number: of.number(),
            text: of.text(),
        }
    }
}

impl fmt::Display for SettingInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let row = &self.row;
        let number = usize::from(row.number) + self.axis.unwrap_or(0);
        write!(f, "[SETTING:{number}|{}|", row.group.id())?;
        if self.axis.is_some() {
            write!(f, "{}-axis ", self.letter)?;
        }
        write!(f, "{}|{}|", row.name, row.unit)?;
        self.range(f, row.kind)?;
        f.write_str("|0|0]")
    }
}

impl SettingInfo {
    /// Describes a setting of GRBL's or of this project. `least`: the least value of a whole
    /// number.
    pub fn of(key: Key, least: u8) -> Self {
        let axis = match key {
            Key::Machine(_) => None,
            Key::Axis(_, axis) => Some(axis),
        };
        let letter = axis.and_then(|axis| AXIS_LETTERS.get(axis));
        Self {
            row: key.row(),
            axis,
            letter: letter.copied().unwrap_or('?'),
            least,
        }
    }

    /// Returns the same setting of an axis that turns: its unit counts degrees.
    #[must_use]
    pub fn of_turns(mut self) -> Self {
        self.row.unit = match self.row.unit {
            "step/mm" => "step/deg",
            "mm/min" => "deg/min",
            "mm/s2" => "deg/s2",
            "mm" => "deg",
            other => other,
        };
        self
    }

    /// Data type (0 switch, 1 bits, 4 axes, 5 whole, 6 decimal), format, least and most.
    fn range(&self, f: &mut fmt::Formatter<'_>, kind: Kind) -> fmt::Result {
        match kind {
            Kind::Switch => f.write_str("0|||"),
            Kind::Bits(names) => write!(f, "1|{names}||"),
            Kind::AxisMask => f.write_str("4|axes||"),
            Kind::Whole { max } => write!(f, "5|####0|{}|{max}", self.least),
            Kind::Decimal { places: 0, .. } => f.write_str("6|#######0|0|"),
            Kind::Decimal { zero: false, .. } => f.write_str("6|#######0.000|0.001|"),
            Kind::Decimal { .. } => f.write_str("6|#######0.000|0|"),
            Kind::Signed { most } => write!(f, "6|-##0.000|-{most}|{most}"),
        }
    }
}

impl fmt::Display for GroupInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[SETTINGGROUP:{}|0|{}]", self.0.id(), self.0.name())
    }
}

impl From<Key> for Description {
    fn from(key: Key) -> Self {
        Self {
            number: key.number(),
            text: key.row().description,
        }
    }
}

impl fmt::Display for Description {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[SETTINGDESCR:{}|{}]", self.number, self.text)
    }
}

impl fmt::Display for ErrorInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[ERRORCODE:{}||{}]", self.number, self.text)
    }
}

impl fmt::Display for AlarmInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[ALARMCODE:{}||{}]", self.number, self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_protocol::report::MAX_LINE;
    use std::string::{String, ToString};
    use std::vec::Vec;

    fn info(number: u16) -> String {
        let key = Key::from_number(number, 3).unwrap();
        SettingInfo::of(key, 1).to_string()
    }

    #[test]
    fn a_setting_has_the_fields_of_grblhal() {
        let cases = [
            (0, "[SETTING:0|1|Step pulse|us|5|####0|1|255|0|0]"),
            (3, "[SETTING:3|1|Direction invert|mask|4|axes|||0|0]"),
            (10, "[SETTING:10|7|Status report fields|mask|1|Machine position,Buffers,Line number,Time to finish|||0|0]"),
            (22, "[SETTING:22|3|Homing||0||||0|0]"),
            (30, "[SETTING:30|5|Maximum spindle speed|1/min|6|#######0|0||0|0]"),
            (101, "[SETTING:101|8|Y-axis Steps per millimetre|step/mm|6|#######0.000|0.001||0|0]"),
            (702, "[SETTING:702|3|Second motor offset|mm|6|-##0.000|-25|25|0|0]"),
        ];
        for (number, line) in cases {
            assert_eq!(info(number), line);
        }
    }

    #[test]
    fn every_line_has_its_fields_and_room() {
        let mut lines: Vec<(String, usize)> = Vec::new();
        for key in Key::all(9) {
            lines.push((SettingInfo::of(key, 0).to_string(), 10));
            lines.push((Description::from(key).to_string(), 2));
        }
        lines.extend(Group::ALL.map(|group| (GroupInfo(group).to_string(), 3)));
        lines.extend(
            Status::ALL
                .iter()
                .map(|of| (ErrorInfo::from(*of).to_string(), 3)),
        );
        lines.extend(
            Alarm::ALL
                .iter()
                .map(|of| (AlarmInfo::from(*of).to_string(), 3)),
        );
        for (line, fields) in lines {
            assert_eq!(line.split('|').count(), fields, "{line}");
            assert!(
                line.ends_with(']') && line.matches([']', '[']).count() == 2,
                "{line}"
            );
            assert!(line.len() <= MAX_LINE, "{line}");
        }
    }
}
