//! The diameters of tools, as CAM programs write them into comments. With them a picture shows cuts
//! in their width.
//!
//! | comment | who writes it |
//! |---|---|
//! | `(T1 D=6. CR=0. - ZMIN=-4.5 - flat end mill)` | Autodesk |
//! | `(T2 0.8636 mm, 0.0340 inch: 46 holes)` | `leadscrew import drill` |
//! | `(TOOL/MILL,3.175, 0, 0, 0)` | Carbide Create |
//! | `(MSG, Change to Tool Dia = 0.8000)`, `(TOOL DIAMETER: 0.8 mm)` | FlatCAM and many others |
//! | `(MSG, Change tool bit to drill size 0.8mm)` | pcb2gcode |
//! | `(T1 : 3.0)` | CamBam |
//! | `(End Mill {1/4 inch})` | Vectric |
//! | `(cutter 6 mm)`, `(3.175mm End Mill)` | people |

use leadscrew_gcode::{words, Letter};

/// The largest diameter that is accepted, mm; a larger one is ignored.
const WIDEST: f64 = 100.0;

/// Names of tools that may stand beside a size.
const NOUNS: [&str; 6] = ["mill", "drill", "bit", "cutter", "router", "tool"];

/// A length as a comment gives it.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Size {
    Mm(f64),
    /// In the unit that the program uses at that line, mm or inches.
    Program(f64),
}

/// Follows a program to find the size of the tool in use.
#[derive(Clone, Debug, Default)]
pub struct ToolSizes {
    /// Sizes that comments gave to numbered tools.
    known: Vec<(u32, Size)>,
    in_use: Option<Size>,
    tool: Option<u32>,
    inches: bool,
}

impl ToolSizes {
    /// Takes a line of the program. Returns the diameter of the tool in use after it, mm; 0 if
    /// it is not known.
    pub fn read(&mut self, line: &[u8]) -> f32 {
        let has_words = line
            .iter()
            .any(|byte| matches!(byte, b'T' | b't' | b'G' | b'g'));
        if line.iter().any(|byte| matches!(byte, b'(' | b';')) {
            self.read_comments(&String::from_utf8_lossy(line).to_ascii_lowercase());
        }
        if has_words {
            self.read_words(line);
        }
        self.diameter()
    }

    fn diameter(&self) -> f32 {
        let mm = match self.in_use {
            Some(Size::Mm(mm)) => mm,
            Some(Size::Program(value)) if self.inches => value * 25.4,
            Some(Size::Program(value)) => value,
            None => 0.0,
        };
        if mm <= WIDEST {
            mm as f32
        } else {
            0.0
        }
    }

    fn read_words(&mut self, line: &[u8]) {
        for word in words(line).map_while(Result::ok) {
            let nanos = word.value().nanos();
            match (word.letter(), u32::try_from(nanos / 1_000_000_000)) {
                (Letter::G, Ok(20)) => self.inches = true,
                (Letter::G, Ok(21)) => self.inches = false,
                (Letter::T, Ok(tool)) if self.tool != Some(tool) => {
                    let known = self.known.iter().find(|(number, _)| *number == tool);
                    // The comment with the size may come before the T word and may name no tool
                    // number.
                    self.in_use = known
                        .map(|(_, size)| *size)
                        .or(self.in_use.filter(|_| self.known.is_empty()));
                    self.tool = Some(tool);
                }
                _ => {}
            }
        }
    }

    fn read_comments(&mut self, line: &str) {
        let mut rest = line;
        while let Some(at) = rest.find(['(', ';']) {
            let (comment, behind) = match rest.as_bytes().get(at) {
                Some(b'(') => rest[at + 1..]
                    .split_once(')')
                    .unwrap_or((&rest[at + 1..], "")),
                _ => (&rest[at + 1..], ""),
            };
            self.note(comment.trim());
            rest = behind;
        }
    }

    fn note(&mut self, comment: &str) {
        let Some(size) = size_in(comment) else {
            return;
        };
        match numbered(comment) {
            Some((tool, _)) => {
                self.known.retain(|(number, _)| *number != tool);
                self.known.push((tool, size));
                if self.tool.is_none_or(|in_use| in_use == tool) {
                    self.in_use = Some(size);
                }
            }
            None => self.in_use = Some(size),
        }
    }
}

/// The diameter in a comment, which is in lower case.
fn size_in(comment: &str) -> Option<Size> {
    let behind = |word: &str| comment.find(word).map(|at| &comment[at + word.len()..]);
    let diameter = behind("dia").map(|rest| rest.strip_prefix("meter").unwrap_or(rest));
    let places = [
        behind("tool/mill,"),
        diameter,
        letter_d(comment),
        behind("drill size"),
        numbered(comment).map(|(_, rest)| rest),
    ];
    let told = places.into_iter().flatten().find_map(|rest| {
        let rest = rest.trim_start_matches([' ', ':', '=', ',', '-', '.']);
        length(rest).map(|(size, _)| size)
    });
    told.or_else(|| {
        let braces = behind("{").and_then(|rest| length(rest.trim_start()));
        braces.map(|(size, _)| size)
    })
    .or_else(|| beside_a_noun(comment))
}

/// The text after a `d=` that no letter or digit precedes.
fn letter_d(comment: &str) -> Option<&str> {
    let at = comment.find("d=")?;
    let alone = !comment[..at].ends_with(|before: char| before.is_ascii_alphanumeric());
    alone.then(|| &comment[at + 2..])
}

/// The tool number that a comment begins with, as in `t7 ...`, and the text after it.
fn numbered(comment: &str) -> Option<(u32, &str)> {
    let rest = comment.strip_prefix('t')?;
    let end = rest
        .find(|byte: char| !byte.is_ascii_digit())
        .unwrap_or(rest.len());
    let number = rest[..end].parse().ok()?;
    Some((number, &rest[end..]))
}

/// A length with its unit right before or after a tool's name: `cutter 6 mm`, `3 mm flat end mill`.
fn beside_a_noun(comment: &str) -> Option<Size> {
    let digit = |at: &usize| comment.as_bytes().get(*at).is_some_and(u8::is_ascii_digit);
    let mut at = 0;
    while let Some(begin) = (at..comment.len()).find(digit) {
        let (size, rest) = length(&comment[begin..])?;
        let before = comment[..begin].trim_end_matches([' ', ':', '=']);
        let named_before = NOUNS.iter().any(|noun| before.ends_with(noun));
        let behind = rest.split([',', ';', '.']).next().unwrap_or("");
        let named_behind = behind
            .split_whitespace()
            .take(4)
            .any(|word| NOUNS.iter().any(|noun| word.contains(noun)));
        if matches!(size, Size::Mm(_)) && (named_before || named_behind) {
            return Some(size);
        }
        at = comment.len() - rest.len();
    }
    None
}

/// The positive length at the start of a text, such as `0.8`, `.125"`, `1/4 inch` or `3 mm`, and
/// the text after it.
fn length(text: &str) -> Option<(Size, &str)> {
    let (mut value, mut rest) = decimal(text)?;
    if let Some((below, behind)) = rest.strip_prefix('/').and_then(decimal) {
        (value, rest) = (value / below, behind);
    }
    let unit = rest.trim_start();
    let inch = ["inch", "in", "\""]
        .iter()
        .find_map(|word| unit.strip_prefix(word));
    let (size, behind) = match (unit.strip_prefix("mm"), inch) {
        (Some(behind), _) => (Size::Mm(value), behind),
        (None, Some(behind)) => (Size::Mm(value * 25.4), behind),
        (None, None) => (Size::Program(value), rest),
    };
    (value.is_finite() && value > 0.0).then_some((size, behind))
}

fn decimal(text: &str) -> Option<(f64, &str)> {
    let end = text
        .find(|byte: char| !byte.is_ascii_digit() && byte != '.')
        .unwrap_or(text.len());
    let number = text[..end].trim_end_matches('.');
    Some((number.parse().ok()?, &text[end..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The diameter after these lines, µm.
    fn after(lines: &[&str]) -> i64 {
        let mut sizes = ToolSizes::default();
        let last = lines.iter().map(|line| sizes.read(line.as_bytes())).last();
        (last.unwrap_or_default() * 1000.0).round() as i64
    }

    #[test]
    fn the_comments_of_programs_are_understood() {
        for (comment, micrometres) in [
            ("(T1 D=6. CR=0. - ZMIN=-4.5 - flat end mill)", 6000),
            ("(T2 0.8636 mm, 0.0340 inch: 46 holes)", 864),
            ("(TOOL/MILL,3.175, 0, 0, 0)", 3175),
            ("(MSG, Change to Tool Dia = 0.8000)", 800),
            ("(TOOL DIAMETER: 0.8 mm)", 800),
            ("; tool diameter=1/8\"", 3175),
            ("(MSG, Change tool bit to drill size 0.9mm)", 900),
            ("(T1 : 3.0)", 3000),
            ("(End Mill {1/4 inch})", 6350),
            (
                "(Pocket 40 x 30 x 4.5 mm, corners of radius 6 mm, cutter 6 mm)",
                6000,
            ),
            ("(3.175mm flat End Mill)", 3175),
        ] {
            assert_eq!(after(&[comment]), micrometres, "{comment}");
        }
    }

    #[test]
    fn other_lengths_are_no_diameters() {
        for comment in [
            "(50 holes down to Z-1.8, clearance Z1)",
            "(Drill 14 holes, feed 300 mm/min)",
            "(depth 3 mm)",
            "(tool 3)",
            "(Stock 100 x 50 mm)",
            "(cutter 900 mm)",
            "(T1)",
            "(speed=12000)",
        ] {
            assert_eq!(after(&[comment]), 0, "{comment}");
        }
    }

    #[test]
    fn a_size_holds_until_another_tool_is_chosen() {
        let list = ["(T1 D=6. end mill)", "(T2 D=3. drill)"];
        assert_eq!(after(&[list[0], list[1], "T1 M6", "G1 X3"]), 6000);
        assert_eq!(after(&[list[0], list[1], "T1 M6", "T2 M6"]), 3000);
        assert_eq!(after(&[list[0], list[1], "T1 M6", "T3 M6"]), 0);
        assert_eq!(after(&["(tool dia: 2)", "T5 M6", "G1X1"]), 2000);
    }

    #[test]
    fn a_size_without_a_unit_has_the_programs() {
        assert_eq!(after(&["(T1 D=0.25)", "G20", "T1 M6"]), 6350);
        assert_eq!(after(&["(T1 D=0.25 mm)", "G20", "T1 M6"]), 250);
    }
}
