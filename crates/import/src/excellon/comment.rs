//! Comments in which programs state how they write numbers.
//!
//! KiCad writes `; FORMAT={2:4/ absolute / inch / suppress leading zeros}`, Altium writes
//! `;FILE_FORMAT=4:4`. Allegro states its tools in comments alone, such as `;T01 Holesize 1. =
//! 12.000000 Tolerance = +0.000000/-0.000000 PLATED MILS Quantity = 241`.

use super::format::{Known, Units, Zeros};
use crate::decimal::{self, NANOS_PER_INCH, NANOS_PER_MM};
use crate::Mm;

/// The units in which comments state diameters, each in 1e-9 mm.
const SIZES: [(&str, i64); 5] = [
    ("MILS", NANOS_PER_INCH / 1000),
    ("INCH", NANOS_PER_INCH),
    ("INCHES", NANOS_PER_INCH),
    ("MM", NANOS_PER_MM),
    ("MICRONS", NANOS_PER_MM / 1000),
];

/// Reads the facts that a comment states about the format. Other comments state none.
pub(super) fn read(comment: &str) -> Known {
    let comment = comment.trim();
    let mut said = Known::default();
    if let Some(digits) = comment.strip_prefix("FILE_FORMAT=") {
        said.digits = digits.trim().parse().ok();
    }
    let braces = comment.strip_prefix("FORMAT={");
    if let Some(inside) = braces.and_then(|rest| rest.strip_suffix('}')) {
        inside
            .split('/')
            .for_each(|part| property(part.trim(), &mut said));
    }
    said
}

/// The number and the diameter of the tool that a comment states.
pub(super) fn tool(comment: &str) -> Option<(u32, Mm)> {
    let (tool, size) = comment.trim().split_once(" Holesize ")?;
    let number = tool.strip_prefix('T')?.parse().ok()?;
    let (digits, rest) = size.split_once('=')?.1.trim().split_once(' ')?;
    let mut words = rest.split_ascii_whitespace();
    let unit = words.find_map(|word| SIZES.iter().find(|(name, _)| *name == word))?;
    let diameter = decimal::length(digits, unit.1).ok()?;
    (diameter > Mm::ZERO).then_some((number, diameter))
}

fn property(text: &str, said: &mut Known) {
    match text {
        "inch" => said.units = Some(Units::Inch),
        "metric" => said.units = Some(Units::Mm),
        "suppress leading zeros" => said.zeros = Some(Zeros::Trailing),
        "suppress trailing zeros" => said.zeros = Some(Zeros::Leading),
        _ => said.digits = text.parse().ok().or(said.digits),
    }
}
