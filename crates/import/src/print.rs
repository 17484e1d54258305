//! Converts a printer's G-code, as slicers write it for Marlin.
//!
//! Moves, E, coordinates and heaters stay as they are. Commands that mean something else to Grbl
//! are translated. Commands that only tune a printer are dropped, with a note. Any other command is
//! a fault.

use crate::gcode_text::{comment, each_once};
use crate::{Fault, Faults, Job, Mm};
use leadscrew_gcode::{parse, Letter, Number, Word};
use std::collections::BTreeMap;

/// How a printer's file is read.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Options {
    /// The file's X, Y and Z at which the tool stands after `G28`. `None`: the machine's work
    /// coordinates are the file's.
    pub home: Option<[Mm; 3]>,
}

/// Makes a job of a printer's file.
///
/// # Errors
/// All commands that Grbl has no counterpart for.
pub fn job(text: &str, options: &Options) -> Result<Job, Faults> {
    let mut printer = Printer {
        home: options.home,
        ..Printer::default()
    };
    for (index, line) in text.lines().enumerate() {
        printer.line(index + 1, line);
    }
    if !printer.faults.is_empty() {
        return Err(Faults(printer.faults));
    }
    let dropped = printer.dropped.iter().map(|(code, lines)| {
        let (count, first) = (lines.len(), lines.first().copied().unwrap_or(0));
        format!("{code} is dropped: {count} lines, the first is line {first}")
    });
    Ok(Job {
        notes: printer.notes.into_iter().chain(dropped).collect(),
        lines: printer.lines,
    })
}

#[derive(Default)]
struct Printer {
    /// Where the tool stands after homing, in the file's coordinates.
    home: Option<[Mm; 3]>,
    /// Whether motion may be under way.
    moves: bool,
    lines: Vec<String>,
    notes: Vec<String>,
    /// Codes that were dropped, each with its lines.
    dropped: BTreeMap<String, Vec<usize>>,
    faults: Vec<Fault>,
}

/// Commands that move the machine.
const MOTION: [&str; 4] = ["G0", "G1", "G2", "G3"];

/// The mistake in a line, and its column, from 1.
type Wrong = (usize, String);

/// The treatment of a command.
enum Fate {
    /// It stays, and may have words of these letters.
    Stays(&'static [Letter]),
    /// It sets the places of axes, and has to name an axis: without one, printers disagree on its
    /// meaning.
    Places,
    /// It waits for the operator, and becomes M0: a Grbl controller would not wait at M1.
    Operator,
    /// A pause of `P` ms or `S` s.
    Pause,
    /// Homing.
    Home,
    /// Its text becomes a comment.
    Message,
    /// It waits until motion ends.
    Wait,
    /// It only tunes a printer, and is dropped.
    Dropped,
    /// It sets a percentage; 100 changes nothing.
    Percent,
}

impl Printer {
    fn line(&mut self, number: usize, line: &str) {
        let (command, remark) = line.split_once(';').unwrap_or((line, ""));
        if !remark.trim().is_empty() {
            self.lines.push(comment(remark));
        }
        if let Err((column, message)) = self.command(number, command) {
            self.faults.push(Fault::new(number, column, message));
        }
    }

    fn command(&mut self, number: usize, text: &str) -> Result<(), Wrong> {
        let text = without_checksum(text.trim_end())?.trim_end();
        let (start, code) = code(text);
        if start == text.len() {
            return Ok(());
        }
        let column = start + 1;
        let upper = code.to_ascii_uppercase();
        let fate = fate(&upper).ok_or_else(|| {
            let shown = if code.is_empty() { text.trim() } else { code };
            (column, format!("{shown} has no counterpart"))
        })?;
        let behind = &text[start + code.len()..];
        match fate {
            Fate::Stays(letters) => self.write(&understood(text, column, letters)?),
            Fate::Places => {
                let words =
                    understood(text, column, &[Letter::X, Letter::Y, Letter::Z, Letter::E])?;
                if words.len() == 1 {
                    return Err((column, format!("expected {code} with the places of axes")));
                }
                self.write(&words);
            }
            Fate::Operator => {
                understood(text, column, &[])?;
                self.lines.push("M0".to_owned());
            }
            Fate::Pause => return self.pause(text, column),
            Fate::Home => return self.home(behind, start + code.len()),
            Fate::Message => self.lines.push(comment(behind)),
            Fate::Wait => self.lines.push("G4 P0".to_owned()),
            Fate::Dropped => self.dropped.entry(upper).or_default().push(number),
            Fate::Percent if behind.trim() == "S100" => {
                self.dropped.entry(upper).or_default().push(number);
            }
            Fate::Percent => {
                return Err((column, format!("{code} other than S100 has no counterpart")))
            }
        }
        Ok(())
    }

    /// Writes a command again without its line number, which only protects the line on its way to a
    /// printer.
    fn write(&mut self, words: &[Word]) {
        let shown: Vec<String> = words.iter().map(Word::to_string).collect();
        let command = shown.first().map(String::as_str);
        self.moves |= command.is_some_and(|command| MOTION.contains(&command));
        self.lines.push(shown.join(" "));
    }

    /// Writes a pause: `G4 P500` (ms) and `G4 S2` (s) both become `G4 P` in seconds. The
    /// command stands at `column`, from 1.
    fn pause(&mut self, text: &str, column: usize) -> Result<(), Wrong> {
        let words = words(text)?;
        let expected = || (column, "expected G4 P (ms) or G4 S (s)".to_owned());
        let [_, word] = words.as_slice() else {
            return Err(expected());
        };
        let seconds = match word.letter() {
            Letter::S => Some(word.value()),
            Letter::P => thousandth(word.value()),
            _ => None,
        };
        let seconds = seconds.ok_or_else(expected)?;
        if seconds.nanos() < 0 {
            let message = format!("{word}: a pause is not less than 0");
            return Err((word.column() + 1, message));
        }
        self.lines.push(format!("G4 P{seconds}"));
        Ok(())
    }

    /// Writes homing: `G28` homes all axes, `G28 X Y` only those named.
    fn home(&mut self, axes: &str, offset: usize) -> Result<(), Wrong> {
        let mut letters = Vec::new();
        for axis in axes.split_ascii_whitespace() {
            let mut bytes = axis.bytes();
            let letter = bytes.next().map_or(b' ', |byte| byte.to_ascii_uppercase());
            let is_number = bytes.all(|b| b.is_ascii_digit() || b == b'.');
            let column = offset + (axis.as_ptr() as usize - axes.as_ptr() as usize) + 1;
            if !b"XYZ".contains(&letter) || !is_number {
                return Err((column, format!("{axis} is not understood with G28")));
            }
            let letter = char::from(letter);
            if letters.contains(&letter) {
                return Err((
                    column,
                    format!("{axis}: {letter} stands twice in this line"),
                ));
            }
            letters.push(letter);
        }
        // `$H` is refused while the machine moves; a pause waits for the end of motion.
        if std::mem::take(&mut self.moves) {
            self.lines.push("G4 P0".to_owned());
        }
        if matches!(letters.len(), 0 | 3) {
            letters = vec!['X', 'Y', 'Z'];
            self.lines.push("$H".to_owned());
        } else {
            let single = letters.iter().map(|letter| format!("$H{letter}"));
            self.lines.extend(single);
        }
        let note = match self.home {
            Some(home) => {
                self.lines.push(here_is(&home, &letters));
                "G28 is $H, and G92 with the coordinates of --home behind it"
            }
            None => "G28 is $H: where the axes are after it, is what the machine's homing says",
        };
        let note = note.to_owned();
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
        Ok(())
    }
}

/// The line that sets the coordinates of axes which have just been homed.
fn here_is(home: &[Mm; 3], letters: &[char]) -> String {
    let mut line = "G92".to_owned();
    for (letter, place) in "XYZ".chars().zip(home) {
        if letters.contains(&letter) {
            line.push_str(&format!(" {letter}{place}"));
        }
    }
    line
}

/// A numbered line without its checksum, which only protects the line on its way to a printer.
fn without_checksum(text: &str) -> Result<&str, Wrong> {
    let is_numbered = text.trim_start().starts_with(['N', 'n']);
    let Some((line, checksum)) = text.rsplit_once('*').filter(|_| is_numbered) else {
        return Ok(text);
    };
    let sum = line.bytes().fold(0, |sum, byte| sum ^ byte);
    match checksum.trim().parse::<u8>() {
        Ok(stated) if stated != sum => Err((
            line.len() + 1,
            format!("the checksum should be {sum}, the line says {stated}"),
        )),
        Ok(_) => Ok(line),
        // The text of a message may have a `*`.
        Err(_) => Ok(text),
    }
}

/// Where a line's command begins, after its `N` word; and the command's letter and number.
fn code(text: &str) -> (usize, &str) {
    let skip = |from: usize| from + (text.len() - from - text[from..].trim_start().len());
    let mut start = skip(0);
    if text[start..].starts_with(['N', 'n']) {
        start = skip(start + word_length(&text[start..]));
    }
    (start, &text[start..start + word_length(&text[start..])])
}

/// The length of the letter and number at the beginning of a text; 0 if it begins with something
/// else.
fn word_length(text: &str) -> usize {
    let mut bytes = text.bytes();
    if !bytes.next().is_some_and(|byte| byte.is_ascii_alphabetic()) {
        return 0;
    }
    1 + bytes
        .take_while(|b| b.is_ascii_digit() || *b == b'.')
        .count()
}

/// The words of a line except its line number.
fn words(text: &str) -> Result<Vec<Word>, Wrong> {
    let block =
        parse(text.as_bytes()).map_err(|error| (error.column + 1, error.kind.to_string()))?;
    let words = block.words().iter().copied();
    Ok(words.filter(|word| word.letter() != Letter::N).collect())
}

/// The words of a command that may have words of these letters.
fn understood(text: &str, column: usize, letters: &[Letter]) -> Result<Vec<Word>, Wrong> {
    let words = words(text)?;
    let [command, rest @ ..] = words.as_slice() else {
        return Err((
            column,
            "not understood; a command such as G1 X10 is".to_owned(),
        ));
    };
    if let Some(word) = rest.iter().find(|word| !letters.contains(&word.letter())) {
        return Err((
            word.column() + 1,
            format!("{word} is not understood with {command}"),
        ));
    }
    each_once(&words)?;
    Ok(words)
}

/// A thousandth of a number; `None` if it cannot be represented exactly.
fn thousandth(number: Number) -> Option<Number> {
    let nanos = number.nanos();
    (nanos % 1000 == 0).then(|| Number::from_nanos(nanos / 1000))
}

/// The treatment of a command; `None` if Grbl has nothing like it.
fn fate(code: &str) -> Option<Fate> {
    use Letter::{E, F, I, J, P, R, S, T, X, Y, Z};
    let fate = match code {
        "G0" | "G00" | "G1" | "G01" => Fate::Stays(&[X, Y, Z, E, F]),
        "G2" | "G02" | "G3" | "G03" => Fate::Stays(&[X, Y, Z, I, J, R, E, F]),
        "G92" => Fate::Places,
        "G17" | "G18" | "G19" | "G20" | "G21" | "G90" | "G91" | "M82" | "M83" => Fate::Stays(&[]),
        "M104" | "M109" | "M140" | "M190" => Fate::Stays(&[S, T]),
        "M105" | "M116" => Fate::Stays(&[]),
        "M106" => Fate::Stays(&[S, P]),
        "M107" => Fate::Stays(&[P]),
        "M0" | "M1" => Fate::Operator,
        "M2" | "M30" => Fate::Stays(&[]),
        "G4" | "G04" => Fate::Pause,
        "G28" => Fate::Home,
        "M117" | "M118" => Fate::Message,
        "M400" => Fate::Wait,
        "M220" | "M221" => Fate::Percent,
        "M17" | "M18" | "M84" | "M73" | "M75" | "M77" | "M110" | "M115" | "M155" | "M201"
        | "M203" | "M204" | "M205" | "M300" | "M413" | "M486" | "M593" | "M900" | "T0" => {
            Fate::Dropped
        }
        _ => return None,
    };
    Some(fate)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(text: &str) -> Vec<String> {
        job(text, &Options::default())
            .unwrap_or_else(|faults| panic!("{faults:?}"))
            .lines
    }

    #[test]
    fn a_slicers_file_keeps_its_moves_and_heat() {
        let text = "G21 ; millimeters\nM82\nM104 S210\nG28\nM109 S210\nG92 E0\nG1 X10.5Y2 E.35 F1800\nM106 S255\n";
        assert_eq!(
            made(text),
            [
                "(millimeters)",
                "G21",
                "M82",
                "M104 S210",
                "$H",
                "M109 S210",
                "G92 E0",
                "G1 X10.5 Y2 E0.35 F1800",
                "M106 S255",
            ]
        );
    }

    #[test]
    fn pauses_are_in_seconds_and_messages_are_comments_that_command_nothing() {
        assert_eq!(
            made("G4 P1500\nG4 S2\nM117 50% done!\nM400"),
            ["G4 P1.5", "G4 P2", "(50% done.)", "G4 P0"]
        );
        assert_eq!(made("M0\nM1 ; look"), ["M0", "(look)", "M0"]);
    }

    #[test]
    fn single_axes_are_homed_singly() {
        assert_eq!(made("G28 X0 Y"), ["$HX", "$HY"]);
        assert_eq!(made("g28 x y z"), ["$H"]);
        assert_eq!(
            made("G28\nG1 X5 F600\nG28 X0 Y0\nG28 Z"),
            ["$H", "G1 X5 F600", "G4 P0", "$HX", "$HY", "$HZ"]
        );
        assert_eq!(
            job("G28 W", &Options::default()).unwrap_err().0[0].column,
            5
        );
    }

    #[test]
    fn where_the_tool_stands_after_homing_may_be_told() {
        let home = ["2", "-1.5", "0"].map(|mm| mm.parse().unwrap());
        let options = Options { home: Some(home) };
        let lines = |text| job(text, &options).unwrap().lines;
        assert_eq!(lines("G28"), ["$H", "G92 X2 Y-1.5 Z0"]);
        assert_eq!(lines("G28 Y X0"), ["$HY", "$HX", "G92 X2 Y-1.5"]);
        let notes = job("G28", &options).unwrap().notes;
        assert_eq!(notes.len(), 1);
        assert!(notes[0].contains("--home"), "{notes:?}");
    }

    #[test]
    fn what_tunes_a_printer_is_dropped_and_said() {
        let job = job(
            "M204 P800\nM204 T1000\nM84 X Y E\nM220 S100",
            &Options::default(),
        )
        .unwrap();
        assert!(job.lines.is_empty());
        assert_eq!(
            job.notes[0],
            "M204 is dropped: 2 lines, the first is line 1"
        );
        assert_eq!(job.notes.len(), 3);
    }

    #[test]
    fn numbers_and_checksums_are_taken_off_and_verified() {
        assert_eq!(made("N3 G1 X5*102"), ["G1 X5"]);
        // As a host sent these lines to a printer.
        assert_eq!(made("N1 G28*18"), ["$H"]);
        assert_eq!(made("N2 G28 X Y*16"), ["$HX", "$HY"]);
        assert_eq!(made("N7 M117 hello*97"), ["(hello)"]);
        assert_eq!(made("N13 M220 S100*83\nN3 T0*57"), [""; 0]);
        for wrong in ["N1 G28*19", "N5 M84*27", "N7 M117 hello*0"] {
            let faults = job(wrong, &Options::default()).unwrap_err().0;
            assert!(
                faults[0].message.contains("the checksum should be"),
                "{wrong}"
            );
        }
        assert_eq!(
            job("N3 G1 X5*103", &Options::default())
                .unwrap_err()
                .0
                .len(),
            1
        );
    }

    #[test]
    fn anything_else_is_a_fault_with_its_place() {
        let text = "G29\nG1 X1 H2\n  M220 S90\nG1 X--1\n@pause\nT1\nM106 S1 M107\n G92";
        let Faults(faults) = job(text, &Options::default()).unwrap_err();
        let places: Vec<_> = faults
            .iter()
            .map(|fault| (fault.line, fault.column))
            .collect();
        assert_eq!(places[..3], [(1, 1), (2, 7), (3, 3)]);
        assert_eq!(faults.len(), 8);
        assert_eq!((faults[7].line, faults[7].column), (8, 2));
    }

    #[test]
    fn a_pause_below_zero_and_a_word_that_stands_twice_are_refused() {
        for (text, column) in [
            ("G4 P-5", 4),
            (" G4 S-1", 5),
            ("G1 X1 X2 F1000", 7),
            ("N4 M109 S200 S300", 14),
            ("G92 E0 E1", 8),
            ("G28 X0 Y x", 10),
            ("G4 P1 P2", 1),
            ("  G4", 3),
        ] {
            let Faults(faults) = job(text, &Options::default()).unwrap_err();
            assert_eq!(faults.len(), 1, "{text}");
            assert_eq!((faults[0].line, faults[0].column), (1, column), "{text}");
        }
        assert_eq!(made("G4 P0"), ["G4 P0"]);
    }
}
