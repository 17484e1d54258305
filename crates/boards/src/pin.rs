//! Pins and their names, such as `PA9`, and the inputs on them.
use serde::{de, Deserialize, Deserializer};
use std::{fmt, str::FromStr};

/// A pin of the chip.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Pin {
    /// The port, `A` to `G`.
    pub port: char,
    /// The pin's number in the port, 0 to 15.
    pub number: u8,
}

/// A text that names no pin.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct UnknownPin(String);

impl fmt::Display for UnknownPin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` is no pin: PA0 to PG15", self.0)
    }
}

impl std::error::Error for UnknownPin {}

impl FromStr for Pin {
    type Err = UnknownPin;

    fn from_str(text: &str) -> Result<Self, UnknownPin> {
        let unknown = || UnknownPin(text.to_owned());
        let rest = text.strip_prefix('P').ok_or_else(unknown)?;
        let port = rest
            .chars()
            .next()
            .filter(|port| ('A'..='G').contains(port));
        let digits = rest
            .get(1..)
            .filter(|digits| !digits.starts_with('0') || *digits == "0");
        let number = digits.and_then(|digits| digits.parse().ok());
        match (port, number) {
            (Some(port), Some(number @ 0..16)) => Ok(Pin { port, number }),
            _ => Err(unknown()),
        }
    }
}

impl fmt::Display for Pin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "P{}{}", self.port, self.number)
    }
}

impl<'de> Deserialize<'de> for Pin {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pin_is_a_port_and_a_number_below_16() {
        let pin: Pin = "PG15".parse().unwrap();
        assert_eq!((pin.port, pin.number), ('G', 15));
        assert_eq!(pin.to_string(), "PG15");
        for wrong in [
            "", "P", "PA", "PA16", "PH0", "A0", "pa0", "PA-1", "PA 1", "PA01", "Pä1",
        ] {
            assert!(wrong.parse::<Pin>().is_err(), "{wrong}");
        }
    }
}

/// An input with a switch.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// The pin.
    pub pin: Pin,
    /// The supply to which a closed switch connects the pin.
    #[serde(default)]
    pub closes: Closes,
}

/// The supply to which a closed switch connects its pin.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Closes {
    /// Ground: the pin is pulled up.
    #[default]
    ToGround,
    /// 3.3 V: the pin is pulled down.
    ToSupply,
}
