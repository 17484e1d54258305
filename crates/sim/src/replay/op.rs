//! The operations of a conversation.
//!
//! | operation | meaning | time |
//! |---|---|---|
//! | `(boot)` | power-up | 30 ms |
//! | `wait MS` | nothing happens | MS |
//! | `send TEXT`, `sendln TEXT` | bytes, bytes and LF | none: they leave while time passes |
//! | `cmd TEXT` | `sendln`, then the next `ok` or `error:N` | 20 s at most |
//! | `resp N` | N more answers, `ok` or `error:N` | 60 s at most |
//! | `idle` | until the machine has nothing to do | 25 ms to 120 s |
//! | `quiet MS` | until the machine's last byte is MS ago | |
//! | `pin NAME LEVEL` | an input's level, 1 is open | none |
//! | `switch NAME AXIS ge/le STEPS [LEVEL]` | an input has LEVEL (0) on that side of the place, the opposite on the other | none |
//! | `noswitch` | removes the switches, levels stay | none |
//! | `setpos X Y Z` | puts the carriages there (steps); switches notice with the next step | none |
//! | `mcureset` | power cycle | none |
//!
//! TEXT is everything after the first blank; `\n`, `\r`, `\t` and `\xHH` stand for bytes.

use crate::plant::{Pin, Side, Switch};
use std::fmt;
use std::str::{FromStr, SplitWhitespace};
use std::time::Duration;

/// An operation on the machine.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Op {
    /// The first power-up, until the machine listens.
    Boot,
    /// Lets time pass.
    Wait(Duration),
    /// Sends bytes.
    Send(Vec<u8>),
    /// Sends bytes, which contain the line end, and waits for an answer.
    Command(Vec<u8>),
    /// Waits for this number of answers.
    Answers(u32),
    /// Waits until the machine has nothing to do.
    Idle,
    /// Waits until the machine has sent nothing for this time.
    Quiet(Duration),
    /// Sets the level of an input.
    Pin(Pin, bool),
    /// Adds a switch.
    Switch(Switch),
    /// Removes all switches.
    NoSwitch,
    /// Puts the carriages elsewhere, steps.
    Place([i32; 3]),
    /// Switches the machine off and on.
    PowerCycle,
}

/// The reason why a text is not an operation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum BadOp {
    /// There is no operation of this name.
    Unknown,
    /// `\` is not followed by `n`, `r`, `t` or `x` and two hexadecimal digits.
    Escape,
    /// Not a time in milliseconds from 0 to an hour.
    Span,
    /// Not a number of answers or steps.
    Number,
    /// There is no such input.
    Pin,
    /// Not a level: 0 or 1.
    Level,
    /// Not an axis: `x`, `y`, `z`, 0, 1 or 2.
    Axis,
    /// Not a side: `ge` or `le`.
    Side,
    /// More words than the operation takes.
    TooMuch,
}

impl fmt::Display for BadOp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unknown => "there is no such operation",
            Self::Escape => "after `\\` expected n, r, t, or x and two hexadecimal digits",
            Self::Span => "expected milliseconds, 0 to 3600000",
            Self::Number => "expected a whole number",
            Self::Pin => "expected limit_x, limit_y, limit_z, probe, reset, hold, door or start",
            Self::Level => "expected 0 or 1",
            Self::Axis => "expected x, y, z, 0, 1 or 2",
            Self::Side => "expected ge or le",
            Self::TooMuch => "there is more than the operation takes",
        })
    }
}

impl std::error::Error for BadOp {}

impl FromStr for Op {
    type Err = BadOp;

    fn from_str(op: &str) -> Result<Self, BadOp> {
        let (name, text) = op.split_once(' ').unwrap_or((op, ""));
        let mut words = text.split_whitespace();
        let op = match name {
            "send" => return bytes(text).map(Self::Send),
            "sendln" => return line(text).map(Self::Send),
            "cmd" => return line(text).map(Self::Command),
            "(boot)" => Self::Boot,
            "wait" => Self::Wait(span(&mut words)?),
            "resp" => Self::Answers(number(&mut words)?),
            "idle" => Self::Idle,
            "quiet" => Self::Quiet(span(&mut words)?),
            "pin" => Self::Pin(pin(&mut words)?, level(words.next().ok_or(BadOp::Level)?)?),
            "switch" => Self::Switch(switch(&mut words)?),
            "noswitch" => Self::NoSwitch,
            "setpos" => Self::Place([
                number(&mut words)?,
                number(&mut words)?,
                number(&mut words)?,
            ]),
            "mcureset" => Self::PowerCycle,
            _ => return Err(BadOp::Unknown),
        };
        words.next().map_or(Ok(op), |_| Err(BadOp::TooMuch))
    }
}

/// The longest time, ms.
const LONGEST: f64 = 3_600_000.0;

fn span(words: &mut SplitWhitespace<'_>) -> Result<Duration, BadOp> {
    let ms = words.next().and_then(|word| word.parse().ok());
    let ms = ms.filter(|ms| (0.0..=LONGEST).contains(ms));
    ms.map(|ms: f64| Duration::from_secs_f64(ms / 1e3))
        .ok_or(BadOp::Span)
}

fn number<T: FromStr>(words: &mut SplitWhitespace<'_>) -> Result<T, BadOp> {
    words
        .next()
        .and_then(|word| word.parse().ok())
        .ok_or(BadOp::Number)
}

fn pin(words: &mut SplitWhitespace<'_>) -> Result<Pin, BadOp> {
    match words.next() {
        Some("limit_x") => Ok(Pin::Limit(0)),
        Some("limit_y") => Ok(Pin::Limit(1)),
        Some("limit_z") => Ok(Pin::Limit(2)),
        Some("probe") => Ok(Pin::Probe),
        Some("reset") => Ok(Pin::Reset),
        Some("hold") => Ok(Pin::Hold),
        Some("door") => Ok(Pin::Door),
        Some("start") => Ok(Pin::Start),
        Some(_) | None => Err(BadOp::Pin),
    }
}

fn level(word: &str) -> Result<bool, BadOp> {
    match word {
        "0" => Ok(false),
        "1" => Ok(true),
        _ => Err(BadOp::Level),
    }
}

fn switch(words: &mut SplitWhitespace<'_>) -> Result<Switch, BadOp> {
    Ok(Switch {
        pin: pin(words)?,
        motor: match words.next() {
            Some("x" | "X" | "0") => 0,
            Some("y" | "Y" | "1") => 1,
            Some("z" | "Z" | "2") => 2,
            Some(_) | None => return Err(BadOp::Axis),
        },
        side: match words.next() {
            Some("ge") => Side::AtOrAbove,
            Some("le") => Side::AtOrBelow,
            Some(_) | None => return Err(BadOp::Side),
        },
        place: number(words)?,
        level: words.next().map_or(Ok(false), level)?,
    })
}

fn line(text: &str) -> Result<Vec<u8>, BadOp> {
    let mut bytes = bytes(text)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// The bytes that a text stands for.
fn bytes(text: &str) -> Result<Vec<u8>, BadOp> {
    let mut bytes = Vec::new();
    let mut parts = text.split('\\');
    bytes.extend(parts.next().unwrap_or_default().bytes());
    for part in parts {
        let (byte, length) = escaped(part).ok_or(BadOp::Escape)?;
        bytes.push(byte);
        bytes.extend(part.bytes().skip(length));
    }
    Ok(bytes)
}

/// The byte that an escape stands for, and the number of characters that the escape takes. `part`
/// is the text after the `\`.
fn escaped(part: &str) -> Option<(u8, usize)> {
    match part.bytes().next()? {
        b'n' => Some((b'\n', 1)),
        b'r' => Some((b'\r', 1)),
        b't' => Some((b'\t', 1)),
        b'x' => Some((u8::from_str_radix(part.get(1..3)?, 16).ok()?, 3)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_keeps_its_blanks_and_escapes_stand_for_bytes() {
        let sent = |op: &str| match op.parse() {
            Ok(Op::Send(bytes) | Op::Command(bytes)) => bytes,
            other => panic!("{other:?}"),
        };
        assert_eq!(sent("send  G0 X1 "), b" G0 X1 ");
        assert_eq!(sent(r"sendln $$\r\t\x18\x9a!"), b"$$\r\t\x18\x9a!\n");
        assert_eq!(sent("cmd"), b"\n");
    }

    #[test]
    fn every_operation_is_understood() {
        let switch = Switch {
            pin: Pin::Probe,
            motor: 2,
            side: Side::AtOrBelow,
            place: -500,
            level: true,
        };
        let table = [
            ("(boot)", Op::Boot),
            ("wait 1.5", Op::Wait(Duration::from_micros(1500))),
            ("resp 3", Op::Answers(3)),
            ("idle", Op::Idle),
            ("quiet 100", Op::Quiet(Duration::from_millis(100))),
            ("pin limit_y 0", Op::Pin(Pin::Limit(1), false)),
            ("switch probe z le -500 1", Op::Switch(switch)),
            (
                "switch probe 2 le -500",
                Op::Switch(Switch {
                    level: false,
                    ..switch
                }),
            ),
            ("noswitch", Op::NoSwitch),
            ("setpos 1 -2 3", Op::Place([1, -2, 3])),
            ("mcureset", Op::PowerCycle),
        ];
        for (text, op) in table {
            assert_eq!(text.parse(), Ok(op), "{text}");
        }
    }

    #[test]
    fn what_is_not_an_operation_is_refused_with_the_reason() {
        let table = [
            ("jump 3", BadOp::Unknown),
            (r"send a\q", BadOp::Escape),
            (r"send a\x1", BadOp::Escape),
            ("wait -1", BadOp::Span),
            ("wait NaN", BadOp::Span),
            ("resp x", BadOp::Number),
            ("pin limit_a 0", BadOp::Pin),
            ("pin probe 2", BadOp::Level),
            ("switch probe w le 1", BadOp::Axis),
            ("switch probe z lt 1", BadOp::Side),
            ("idle 5", BadOp::TooMuch),
        ];
        for (text, why) in table {
            assert_eq!(text.parse::<Op>(), Err(why), "{text}");
        }
    }
}
