//! Statements that consist of whole words: `METRIC,TZ`, `FMAT,2`, `ICI,OFF`.

use super::fact::Source;
use super::format::{Digits, Known, Units, Zeros};
use super::reader::Reader;
use super::wrong::Wrong;

/// Returns true if a statement consists of whole words, and not of letters with numbers.
pub(super) fn is_keyword(statement: &str) -> bool {
    let letters = statement.bytes().take_while(u8::is_ascii_alphabetic);
    letters.count() > 1 || statement.contains(',')
}

impl Reader {
    /// Reads a statement of whole words. Statements about the drilling machine itself (broken
    /// tools, tool changers) are ignored, since they do not concern holes.
    pub(super) fn keyword(&mut self, statement: &str) -> Result<(), Wrong> {
        let upper = statement.to_ascii_uppercase();
        let (name, value) = upper.split_once(',').unwrap_or((&upper, ""));
        let column = name.len() + 2;
        match (name.trim(), value.trim()) {
            ("INCH", value) => self.measure(Units::Inch, value, column, Source::Keyword),
            ("METRIC", value) => self.measure(Units::Mm, value, column, Source::Keyword),
            ("M72", value) => self.measure(Units::Inch, value, column, Source::Code),
            ("M71", value) => self.measure(Units::Mm, value, column, Source::Code),
            ("ICI", "" | "ON") => {
                self.now.is_incremental = true;
                Ok(())
            }
            ("ICI", "OFF") => {
                self.now.is_incremental = false;
                Ok(())
            }
            ("M47", message) => {
                self.notes
                    .add(format!("message to the operator: {message}"));
                Ok(())
            }
            ("FMAT", "2") | ("VER", "1") => Ok(()),
            // Counters of the machine, which a header sets back.
            ("R", "C" | "CP" | "CR" | "D" | "H") => Ok(()),
            ("DETECT" | "ATC" | "TCST" | "AFS" | "SBK", _) => Ok(()),
            ("FMAT" | "VER" | "ICI", _) => Err(Wrong::at(
                column,
                "is not understood; FMAT,2 VER,1 ICI,OFF are",
            )),
            _ => Err(Wrong::at(
                1,
                "not understood; METRIC, INCH, FMAT, VER and ICI are",
            )),
        }
    }

    /// Reads `INCH`, `METRIC,TZ` or `METRIC,LZ,000.000`.
    fn measure(
        &mut self,
        units: Units,
        value: &str,
        column: usize,
        source: Source,
    ) -> Result<(), Wrong> {
        self.unit(units, 1, source)?;
        for part in value.split(',').filter(|part| !part.is_empty()) {
            let mut said = Known::default();
            match part.trim() {
                "LZ" => said.zeros = Some(Zeros::Leading),
                "TZ" => said.zeros = Some(Zeros::Trailing),
                part => said.digits = Some(picture(part, column)?),
            }
            self.said(&said, column, source)?;
        }
        Ok(())
    }

    /// Takes the unit that a command at `column` names.
    pub(super) fn unit(
        &mut self,
        units: Units,
        column: usize,
        source: Source,
    ) -> Result<(), Wrong> {
        let said = Known {
            units: Some(units),
            ..Known::default()
        };
        self.said(&said, column, source)
    }
}

/// Reads the pattern of a number: `000.000` means 3.3 digits.
fn picture(text: &str, column: usize) -> Result<Digits, Wrong> {
    let zeros = |part: &str| part.bytes().all(|byte| byte == b'0') && part.len() <= 9;
    match text.split_once('.') {
        Some((whole, decimals)) if zeros(whole) && zeros(decimals) && text.len() > 1 => {
            Ok(Digits {
                whole: whole.len(),
                decimals: decimals.len(),
            })
        }
        Some(_) | None => Err(Wrong::at(
            column,
            "expected LZ, TZ or digits such as 000.000",
        )),
    }
}
