//! The types of a machine file's values. They are checked while the file is read, so that errors
//! can give the line.

use schemars::JsonSchema;
use serde::Deserialize;
use std::fmt;

/// Why a value is refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ValueError {
    /// Not above 0, or not finite.
    NotPositive,
    /// Not finite, or more than a kilometre.
    NotALength,
    /// Not from 0 to 1000 events a second.
    NotARate,
    /// Not the name of a setting.
    NotASetting,
    /// A letter that is no axis, or a letter that occurs twice.
    NotAxes,
    /// Not the letter of one axis.
    NotAnAxis,
    /// A buffer that is too small for one line, or larger than the machine's.
    NotABuffer,
    /// A look-ahead out of range.
    NotALookAhead,
    /// More outputs than there can be.
    NotACount,
    /// Not finite, below absolute zero, or hotter than any heater.
    NotATemperature,
    /// Not finite, or more than a sensor's amplifier puts out.
    NotAVoltage,
    /// Below 0, not finite, or more than a kilometre.
    NotAWay,
}

impl fmt::Display for ValueError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotPositive => "expected a number above 0 and below 1e6",
            Self::NotALength => "expected a length between -1e6 and 1e6 mm",
            Self::NotARate => "expected between 0 and 1000 a second",
            Self::NotASetting => "expected the name of a setting, such as \"$110\"",
            Self::NotAxes => "expected axes that home together, such as \"z\" or \"xy\"",
            Self::NotAnAxis => "expected the letter of one axis, such as \"a\" or \"e\"",
            Self::NotABuffer => "expected 128 to 1024 bytes",
            Self::NotALookAhead => "expected 2 to 1024 moves",
            Self::NotACount => "expected 0 to 8 outputs",
            Self::NotATemperature => "expected between -273 and 2000 degrees",
            Self::NotAVoltage => "expected between -100 and 100 V",
            Self::NotAWay => "expected a length between 0 and 1e6 mm",
        })
    }
}

impl std::error::Error for ValueError {}

/// The letters of all axes, in the order of a mask's bits.
const LETTERS: &str = "xyzabce";

/// The largest length in a profile, mm: a kilometre.
const FAR: f64 = 1e6;

/// A number above 0, such as a length in mm, or steps per mm.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Deserialize, JsonSchema)]
#[serde(try_from = "f64")]
pub struct Positive(f64);

/// A place on an axis, mm.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Default, Deserialize, JsonSchema)]
#[serde(try_from = "f64")]
pub struct Place(f64);

/// Events a second, 0 for never.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Default, Deserialize, JsonSchema)]
#[serde(try_from = "f64")]
pub struct PerSecond(f64);

/// A temperature, °C.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Deserialize, JsonSchema)]
#[serde(try_from = "f64")]
pub struct Celsius(f32);

impl Celsius {
    /// °C.
    pub fn get(self) -> f32 {
        self.0
    }
}

impl TryFrom<f64> for Celsius {
    type Error = ValueError;
    fn try_from(celsius: f64) -> Result<Self, ValueError> {
        (-273.0..=2000.0)
            .contains(&celsius)
            .then_some(Self(celsius as f32))
            .ok_or(ValueError::NotATemperature)
    }
}

/// A voltage, V.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Deserialize, JsonSchema)]
#[serde(try_from = "f64")]
pub struct Volts(f32);

impl Volts {
    /// V.
    pub fn get(self) -> f32 {
        self.0
    }
}

impl TryFrom<f64> for Volts {
    type Error = ValueError;
    fn try_from(volts: f64) -> Result<Self, ValueError> {
        (-100.0..=100.0)
            .contains(&volts)
            .then_some(Self(volts as f32))
            .ok_or(ValueError::NotAVoltage)
    }
}

/// A length that is not negative, mm.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Deserialize, JsonSchema)]
#[serde(try_from = "f64")]
pub struct Way(f64);

impl Way {
    /// Millimetres.
    pub fn mm(self) -> f64 {
        self.0
    }
}

impl TryFrom<f64> for Way {
    type Error = ValueError;
    fn try_from(mm: f64) -> Result<Self, ValueError> {
        (0.0..=FAR)
            .contains(&mm)
            .then_some(Self(mm))
            .ok_or(ValueError::NotAWay)
    }
}

/// The number of a setting, written `"$110"`.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Deserialize, JsonSchema)]
#[serde(try_from = "String")]
pub struct SettingNumber(pub u16);

/// Axes as a mask, written as their letters: X, Y, Z, A, B, C in bits 0 to 5, E in bit 6.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize, JsonSchema)]
#[serde(try_from = "String")]
pub struct AxisLetters(pub u8);

/// One axis, written as its letter.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize, JsonSchema)]
#[serde(try_from = "String")]
pub struct AxisLetter(char);

/// Bytes of unanswered lines that a sender may have sent.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize, JsonSchema)]
#[serde(try_from = "u16")]
pub struct BufferSize(pub u16);

/// Moves planned ahead.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize, JsonSchema)]
#[serde(try_from = "usize")]
pub struct LookAhead(pub usize);

/// How many outputs there are.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize, JsonSchema)]
#[serde(try_from = "u16")]
pub struct OutputCount(pub u8);

impl AxisLetters {
    /// The mask of E alone.
    pub(super) const EXTRUDER: u8 = 1 << 6;
}

impl AxisLetter {
    /// The letter, a capital.
    pub fn capital(self) -> char {
        self.0.to_ascii_uppercase()
    }
}

impl TryFrom<u16> for OutputCount {
    type Error = ValueError;
    fn try_from(count: u16) -> Result<Self, ValueError> {
        let count = u8::try_from(count).ok().filter(|count| *count <= 8);
        count.map(Self).ok_or(ValueError::NotACount)
    }
}

impl Positive {
    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl Place {
    /// Millimetres.
    pub fn mm(self) -> f64 {
        self.0
    }
}

impl PerSecond {
    /// Events a second.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl TryFrom<f64> for Positive {
    type Error = ValueError;
    fn try_from(number: f64) -> Result<Self, ValueError> {
        let good = number > 0.0 && number < FAR;
        good.then_some(Self(number)).ok_or(ValueError::NotPositive)
    }
}

impl TryFrom<f64> for Place {
    type Error = ValueError;
    fn try_from(mm: f64) -> Result<Self, ValueError> {
        (mm.abs() <= FAR)
            .then_some(Self(mm))
            .ok_or(ValueError::NotALength)
    }
}

impl TryFrom<f64> for PerSecond {
    type Error = ValueError;
    fn try_from(rate: f64) -> Result<Self, ValueError> {
        (0.0..=1000.0)
            .contains(&rate)
            .then_some(Self(rate))
            .ok_or(ValueError::NotARate)
    }
}

impl TryFrom<String> for SettingNumber {
    type Error = ValueError;
    fn try_from(name: String) -> Result<Self, ValueError> {
        let number = name
            .strip_prefix('$')
            .and_then(|digits| digits.parse().ok());
        number.map(Self).ok_or(ValueError::NotASetting)
    }
}

impl TryFrom<String> for AxisLetters {
    type Error = ValueError;
    fn try_from(letters: String) -> Result<Self, ValueError> {
        let mut mask = 0u8;
        for letter in letters.chars() {
            let axis = LETTERS.find(letter).ok_or(ValueError::NotAxes)?;
            if mask >> axis & 1 == 1 {
                return Err(ValueError::NotAxes);
            }
            mask |= 1 << axis;
        }
        (mask != 0).then_some(Self(mask)).ok_or(ValueError::NotAxes)
    }
}

impl TryFrom<String> for AxisLetter {
    type Error = ValueError;
    fn try_from(letters: String) -> Result<Self, ValueError> {
        let mut all = letters.chars();
        let only = all.next().filter(|letter| LETTERS.contains(*letter));
        let only = only.filter(|_| all.next().is_none());
        only.map(Self).ok_or(ValueError::NotAnAxis)
    }
}

impl TryFrom<u16> for BufferSize {
    type Error = ValueError;
    fn try_from(bytes: u16) -> Result<Self, ValueError> {
        (128..=1024)
            .contains(&bytes)
            .then_some(Self(bytes))
            .ok_or(ValueError::NotABuffer)
    }
}

impl TryFrom<usize> for LookAhead {
    type Error = ValueError;
    fn try_from(moves: usize) -> Result<Self, ValueError> {
        (2..=1024)
            .contains(&moves)
            .then_some(Self(moves))
            .ok_or(ValueError::NotALookAhead)
    }
}
