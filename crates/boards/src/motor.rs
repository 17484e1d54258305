//! A motor, as the board's file describes it: with a driver that counts steps, or with windings
//! that the board switches itself.
use crate::{Input, Pin};
use serde::Deserialize;

/// Lines of a motor with five phases.
const LINES: usize = 5;

/// An axis.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Deserialize)]
pub enum Axis {
    /// The first axis.
    X,
    /// The second axis.
    Y,
    /// The third axis.
    Z,
}

/// A motor, and the axis that it moves.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(try_from = "MotorText")]
pub struct Motor {
    /// The axis; with crossed belts X and Y are the two belts.
    pub axis: Axis,
    /// Its pins.
    pub socket: MotorSocket,
}

/// A motor's pins.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(try_from = "SocketText")]
pub struct MotorSocket {
    /// The pins that move it.
    pub drive: Drive,
    /// Its limit switch.
    pub limit: Option<Input>,
}

/// The pins that move a motor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Drive {
    /// A driver that counts steps.
    Driver {
        /// The pin for step pulses.
        step: Pin,
        /// The direction pin: high is negative, unless `$3` inverts it.
        direction: Pin,
    },
    /// The lines of five phases: high when current is to flow.
    Windings([Pin; LINES]),
}

impl Drive {
    /// Its pins with their purpose.
    pub(crate) fn pins(self) -> Vec<(String, Pin)> {
        match self {
            Self::Driver { step, direction } => {
                vec![
                    ("step".to_owned(), step),
                    ("direction".to_owned(), direction),
                ]
            }
            Self::Windings(lines) => {
                let lines = lines.into_iter().zip(1..);
                lines
                    .map(|(pin, number)| (format!("line {number}"), pin))
                    .collect()
            }
        }
    }
}

/// The keys of `[[motor]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MotorText {
    axis: Axis,
    step: Option<Pin>,
    direction: Option<Pin>,
    lines: Option<[Pin; LINES]>,
    limit: Option<Input>,
}

/// The keys of a motor in `[sockets]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SocketText {
    step: Option<Pin>,
    direction: Option<Pin>,
    lines: Option<[Pin; LINES]>,
    limit: Option<Input>,
}

impl TryFrom<MotorText> for Motor {
    type Error = &'static str;

    fn try_from(text: MotorText) -> Result<Self, Self::Error> {
        let MotorText {
            axis,
            step,
            direction,
            lines,
            limit,
        } = text;
        let socket = SocketText {
            step,
            direction,
            lines,
            limit,
        };
        Ok(Self {
            axis,
            socket: socket.try_into()?,
        })
    }
}

impl TryFrom<SocketText> for MotorSocket {
    type Error = &'static str;

    fn try_from(text: SocketText) -> Result<Self, Self::Error> {
        let drive = match (text.step, text.direction, text.lines) {
            (Some(step), Some(direction), None) => Drive::Driver { step, direction },
            (None, None, Some(lines)) => Drive::Windings(lines),
            _ => return Err("a motor has `step` and `direction`, or `lines`"),
        };
        let limit = text.limit;
        Ok(Self { drive, limit })
    }
}
