//! Comments in which programs state how they write numbers.
//!
//! KiCad writes `; FORMAT={2:4/ absolute / inch / suppress leading zeros}`, Altium writes
//! `;FILE_FORMAT=4:4`.

use super::format::{Known, Units, Zeros};

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

fn property(text: &str, said: &mut Known) {
    match text {
        "inch" => said.units = Some(Units::Inch),
        "metric" => said.units = Some(Units::Mm),
        "suppress leading zeros" => said.zeros = Some(Zeros::Trailing),
        "suppress trailing zeros" => said.zeros = Some(Zeros::Leading),
        _ => said.digits = text.parse().ok().or(said.digits),
    }
}
