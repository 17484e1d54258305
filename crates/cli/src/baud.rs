//! The rate of a serial line on the command line.

use std::num::NonZeroU32;

/// Slowest and fastest serial line, bits a second.
const BAUD: std::ops::RangeInclusive<u32> = 300..=12_000_000;

pub(super) fn baud(text: &str) -> Result<NonZeroU32, String> {
    let number = text
        .parse()
        .ok()
        .filter(|number: &NonZeroU32| BAUD.contains(&number.get()));
    number.ok_or_else(|| {
        format!(
            "expected bits a second from {} to {}",
            BAUD.start(),
            BAUD.end()
        )
    })
}
