//! Finds out, from the numbers of a file, which zeros they leave out; and the unit of tools that
//! stand above it.
//!
//! A program that leaves out leading zeros never writes a leading zero, and the same holds for
//! trailing zeros. So a file with a leading zero keeps leading zeros. If this file has no trailing
//! zero, it leaves out trailing zeros.

use super::format::{Units, Zeros};
use super::word::words;

/// The zeros that the file keeps, and the line of the first number that shows this. `None` if
/// numbers show both kinds of zeros, or neither.
pub(super) fn zeros(text: &str) -> Option<(Zeros, usize)> {
    let (mut leading, mut trailing) = (None, None);
    for (index, line) in text.lines().enumerate() {
        for digits in coordinates(line) {
            if digits.starts_with('0') {
                leading = leading.or(Some(index + 1));
            }
            if digits.ends_with('0') {
                trailing = trailing.or(Some(index + 1));
            }
        }
    }
    match (leading, trailing) {
        (Some(line), None) => Some((Zeros::Leading, line)),
        (None, Some(line)) => Some((Zeros::Trailing, line)),
        (Some(_), Some(_)) | (None, None) => None,
    }
}

/// The unit that a file names above its first place, and its line. `None` if it names none there,
/// or two.
pub(super) fn unit(text: &str) -> Option<(Units, usize)> {
    let statements = text
        .lines()
        .map(|line| line.split(';').next().unwrap_or("").trim());
    let is_place = |line: &&str| line.contains(['X', 'Y']) && !line.starts_with("G9");
    let head = statements.take_while(|line| !is_place(line));
    let mut named = head.enumerate().filter_map(|(index, line)| {
        let unit = match line.split(',').next().unwrap_or("").trim() {
            "INCH" | "M72" => Units::Inch,
            "METRIC" | "M71" => Units::Mm,
            _ => return None,
        };
        Some((unit, index + 1))
    });
    let first = named.next()?;
    named.all(|(unit, _)| unit == first.0).then_some(first)
}

/// Digits of a line's coordinates that have no point and are not zero. Zeros show nothing, since
/// they are written alike in all formats.
fn coordinates(line: &str) -> impl Iterator<Item = &str> {
    let statement = line.split(';').next().unwrap_or("");
    let found = words(statement).unwrap_or_default().into_iter();
    let coordinates = found.filter(|word| matches!(word.letter, 'X' | 'Y' | 'I' | 'J' | 'A'));
    let digits = coordinates.map(|word| word.text.trim_start_matches(['+', '-']));
    digits.filter(|digits| !digits.contains('.') && digits.bytes().any(|byte| byte != b'0'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_on_one_side_show_that_the_other_side_has_none() {
        assert_eq!(zeros("T1\nX3000Y45"), Some((Zeros::Trailing, 2)));
        assert_eq!(zeros("X03Y0045\n"), Some((Zeros::Leading, 1)));
        assert_eq!(zeros("X0Y12\nX34Y00"), None);
        assert_eq!(zeros("X004000Y3"), None);
        assert_eq!(zeros("; X3000\nX1.0Y0.5\nT10"), None);
    }

    #[test]
    fn the_unit_above_the_first_place_counts_if_there_is_one() {
        let below = "M48\nT1C.8\n%\nM71\nX1\nM72";
        assert_eq!(unit(below), Some((Units::Mm, 4)));
        assert_eq!(unit("INCH,TZ\nM72"), Some((Units::Inch, 1)));
        assert_eq!(unit("INCH\nM71\nX1"), None);
        assert_eq!(unit("G93X0Y0\nM71\nG00X1"), Some((Units::Mm, 2)));
        for body in ["T1\nX1\nM71", "T1\nG00X1\nM71", "; M71\nT1"] {
            assert_eq!(unit(body), None, "{body}");
        }
    }
}
