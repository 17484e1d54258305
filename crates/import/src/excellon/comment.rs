//! Comments in which programs state how they write numbers.
//!
//! KiCad writes `; FORMAT={2:4/ absolute / inch / suppress leading zeros}`, Altium writes
//! `;FILE_FORMAT=4:4`.

use super::format::{Digits, Format, Units, Zeros};

/// Takes the statements about the format from a comment; other comments are ignored.
pub(super) fn read(comment: &str, format: &mut Format) {
    let comment = comment.trim();
    if let Some(digits) = comment.strip_prefix("FILE_FORMAT=") {
        format.said.digits = digits.trim().parse().ok().or(format.said.digits);
    }
    let braces = comment.strip_prefix("FORMAT={");
    if let Some(inside) = braces.and_then(|rest| rest.strip_suffix('}')) {
        inside
            .split('/')
            .for_each(|part| property(part.trim(), format));
    }
}

fn property(text: &str, format: &mut Format) {
    match text {
        "inch" => format.set_units(Units::Inch),
        "metric" => format.set_units(Units::Mm),
        "suppress leading zeros" => format.said.zeros = Some(Zeros::Trailing),
        "suppress trailing zeros" => format.said.zeros = Some(Zeros::Leading),
        _ => {
            let digits: Option<Digits> = text.parse().ok();
            format.said.digits = digits.or(format.said.digits);
        }
    }
}
