//! Converts a printer's G-code, as slicers write it for Marlin.
//!
//! Moves, E, coordinates and heaters stay as they are. Commands that mean something else to Grbl
//! are translated. Commands that only tune or tend a printer are dropped, with a note. Any other
//! command is a fault.

use crate::gcode_text::{comment, each_once};
use crate::{Fault, Faults, Job, Mm};
use leadscrew_gcode::{parse, Letter, Number, Word};
use std::collections::BTreeMap;

/// The way in which a printer's file is read.
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
    /// The tool's place after homing, in the file's coordinates.
    home: Option<[Mm; 3]>,
    /// True if the printer may still move.
    moves: bool,
    /// The place in the file's coordinates, as far as it is known.
    place: Place,
    lines: Vec<String>,
    notes: Vec<String>,
    /// Codes that were dropped, each with its lines.
    dropped: BTreeMap<String, Vec<usize>>,
    faults: Vec<Fault>,
}

/// The last X, Y and Z of a file in absolute coordinates; `None`: not known.
#[derive(Clone, Copy, Default)]
struct Place {
    axes: [Option<Number>; 3],
    /// True after `G91`: then a place is not known.
    is_relative: bool,
}

impl Place {
    /// Takes the words of a command that stays as it is.
    fn take(&mut self, words: &[Word]) {
        match words.first().map(Word::to_string).as_deref() {
            Some("G90") => self.is_relative = false,
            Some("G91") => self.is_relative = true,
            _ => {}
        }
        for word in words {
            let axis = [Letter::X, Letter::Y, Letter::Z]
                .iter()
                .position(|axis| *axis == word.letter());
            if let Some(place) = axis.and_then(|axis| self.axes.get_mut(axis)) {
                *place = (!self.is_relative).then_some(word.value());
            }
        }
    }
}

/// Commands that move the machine.
const MOTION: [&str; 4] = ["G0", "G1", "G2", "G3"];

/// The mistake in a line, and its column, from 1.
type Wrong = (usize, String);

/// The treatment of a command.
enum Fate {
    /// It stays, and may have words of these letters.
    Stays(&'static [Letter]),
    /// An arc, or a helix of whole turns.
    Arc,
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
    /// It only tunes or tends a printer, and is dropped.
    Dropped,
    /// It sets a percentage, and is dropped; 100 changes nothing.
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
        if let Some(remark) = parenthesised(text) {
            self.lines.push(comment(remark));
            return Ok(());
        }
        let (start, code) = code(text);
        if start == text.len() {
            return Ok(());
        }
        let column = start + 1;
        let upper = canonical(code);
        let named = text[start..]
            .split_ascii_whitespace()
            .next()
            .unwrap_or_default();
        if is_host_command(named) {
            self.dropped
                .entry(named.to_owned())
                .or_default()
                .push(number);
            return Ok(());
        }
        let fate = fate(&upper).ok_or_else(|| {
            let shown = if code.is_empty() { text.trim() } else { code };
            (column, unknown(shown, named))
        })?;
        let behind = &text[start + code.len()..];
        match fate {
            Fate::Stays(letters) => self.write(&understood(text, column, letters)?),
            Fate::Arc => return self.arc(text, column),
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
            Fate::Percent => {
                let percent = behind.trim();
                if !matches!(percent, "" | "S100") {
                    let what = if upper == "M220" { "speed" } else { "flow" };
                    let note =
                        format!("{upper} {percent} is not carried out: the {what} stays at 100 %");
                    self.note(note);
                }
                self.dropped.entry(upper).or_default().push(number);
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
        self.place.take(words);
        self.lines.push(shown.join(" "));
    }

    /// Writes an arc. `P` is a count of whole turns: the helix by which slicers lift the nozzle. A
    /// Grbl controller takes no `P`, and a whole turn has to name its end.
    fn arc(&mut self, text: &str, column: usize) -> Result<(), Wrong> {
        use Letter::{E, F, I, J, P, R, X, Y, Z};
        let words = understood(text, column, &[X, Y, Z, I, J, R, E, F, P])?;
        let of = |letter| words.iter().find(|word| word.letter() == letter);
        let Some(turns) = of(P) else {
            self.write(&words);
            return Ok(());
        };
        let wrong = |message: &str| (turns.column() + 1, format!("{turns}: {message}"));
        if turns.value().nanos() != 1_000_000_000 {
            return Err(wrong("only a helix of one turn (P1) has a counterpart"));
        }
        let [x, y, _] = self.place.axes;
        let (Some(x), Some(y), false) = (x, y, self.place.is_relative) else {
            return Err(wrong("a helix needs an absolute X and Y before it"));
        };
        let is_elsewhere = |letter, place| of(letter).is_some_and(|word| word.value() != place);
        if is_elsewhere(X, x) || is_elsewhere(Y, y) {
            return Err(wrong("a helix of whole turns ends above its start"));
        }
        let rest = words
            .iter()
            .filter(|word| ![X, Y, P].contains(&word.letter()));
        let rest: Vec<String> = rest.map(Word::to_string).collect();
        let [code, rest @ ..] = rest.as_slice() else {
            return Ok(());
        };
        self.lines
            .push(format!("{code} X{x} Y{y} {}", rest.join(" ")));
        self.moves = true;
        self.place.take(&words);
        Ok(())
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
            // These letters tell a printer how to home: W without its mesh, O only if needed, R and
            // L with the nozzle raised.
            if b"WORL".contains(&letter) && is_number {
                continue;
            }
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
        self.note(note.to_owned());
        self.place.axes = [None; 3];
        Ok(())
    }

    /// Adds a sentence for the user, once.
    fn note(&mut self, note: String) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
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

/// Returns the place at which a line's command begins, after its `N` word; and the command's letter
/// and number.
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

/// The text of a line that is only a comment in parentheses.
fn parenthesised(text: &str) -> Option<&str> {
    let inside = text.trim().strip_prefix('(')?.strip_suffix(')')?;
    (!inside.contains(['(', ')'])).then_some(inside)
}

/// A command in capitals and without leading zeros: `g01` is `G1`.
fn canonical(code: &str) -> String {
    let (letter, number) = code.split_at(code.len().min(1));
    let digits = number.trim_start_matches('0');
    let is_whole = digits.starts_with(|digit: char| digit.is_ascii_digit());
    let zero = if number.is_empty() || is_whole {
        ""
    } else {
        "0"
    };
    format!("{}{zero}{digits}", letter.to_ascii_uppercase())
}

/// Says why a command is refused, and what helps. `named` is its first word.
fn unknown(code: &str, named: &str) -> String {
    let is_word = |c: char| c.is_ascii_alphabetic() || c == '_';
    if named.len() > 1 && named.chars().take(2).all(is_word) {
        return format!(
            "{named} is a macro that only the printer's host has: write its commands in its place"
        );
    }
    let why = match code {
        "G10" | "G11" => ": let the slicer write retractions as moves of E",
        _ if code.starts_with(['T', 't']) => ": there is one extruder, T0",
        _ => "",
    };
    format!("{code} has no counterpart{why}")
}

/// Returns true for a command in words that tunes or informs a printer's host.
fn is_host_command(name: &str) -> bool {
    const HOST: [&str; 7] = [
        "SET_VELOCITY_LIMIT",
        "SET_PRESSURE_ADVANCE",
        "SET_PRINT_STATS_INFO",
        "EXCLUDE_OBJECT",
        "TIMELAPSE_",
        "BED_MESH_",
        "SKEW_PROFILE",
    ];
    HOST.iter().any(|host| name.starts_with(host))
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

/// Commands that only tune or tend a printer: its motors, limits, controllers, mesh, counters,
/// lights, power and messages. `M141` and `M191` heat a chamber that no machine here has.
const DROPPED: [&str; 80] = [
    "G12", "G29", "G34", "G80", "M17", "M18", "M73", "M74", "M75", "M76", "M77", "M78", "M80",
    "M81", "M84", "M85", "M92", "M108", "M110", "M111", "M113", "M114", "M115", "M119", "M122",
    "M141", "M150", "M155", "M191", "M200", "M201", "M202", "M203", "M204", "M205", "M206", "M207",
    "M208", "M209", "M211", "M218", "M240", "M280", "M300", "M301", "M302", "M304", "M350", "M355",
    "M401", "M402", "M403", "M412", "M413", "M414", "M420", "M421", "M425", "M486", "M500", "M501",
    "M503", "M540", "M555", "M566", "M569", "M572", "M592", "M593", "M665", "M666", "M851",
    "M862.1", "M862.3", "M862.6", "M900", "M906", "M907", "M913", "T0",
];

/// The treatment of a command; `None` if Grbl has nothing like it.
fn fate(code: &str) -> Option<Fate> {
    use Letter::{E, F, P, S, T, X, Y, Z};
    let fate = match code {
        "G0" | "G1" => Fate::Stays(&[X, Y, Z, E, F]),
        "G2" | "G3" => Fate::Arc,
        "G92" => Fate::Places,
        "G17" | "G18" | "G19" | "G20" | "G21" | "G90" | "G91" | "M82" | "M83" => Fate::Stays(&[]),
        "M104" | "M109" | "M140" | "M190" => Fate::Stays(&[S, T]),
        "M105" | "M116" => Fate::Stays(&[]),
        "M106" => Fate::Stays(&[S, P]),
        "M107" => Fate::Stays(&[P]),
        "M0" | "M1" | "M600" | "M601" => Fate::Operator,
        "M2" | "M30" => Fate::Stays(&[]),
        "G4" => Fate::Pause,
        "G28" => Fate::Home,
        "M117" | "M118" => Fate::Message,
        "M400" => Fate::Wait,
        "M220" | "M221" => Fate::Percent,
        _ if DROPPED.contains(&code) => Fate::Dropped,
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
            job("G28 Q", &Options::default()).unwrap_err().0[0].column,
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
        let text = "G5 X1\nG1 X1 H2\n  M98 P1\nG1 X--1\n@pause\nT1\nM106 S1 M107\n G92";
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
    fn codes_may_have_leading_zeros_and_lines_may_be_comments() {
        assert_eq!(made("M00\nM01\ng01 X1"), ["M0", "M0", "G1 X1"]);
        assert_eq!(made("M02\nG00 Y2\nM0107"), ["M2", "G0 Y2", "M107"]);
        assert_eq!(
            made("(layer 2!)\n ( ) \nG28 W ; all"),
            ["(layer 2.)", "()", "(all)", "$H"]
        );
    }

    #[test]
    fn a_spiral_lift_is_a_whole_turn_that_names_its_end() {
        assert_eq!(
            made("G1 X10 Y20.5 F3000\nG17\nG3 Z0.6 I-1.2 J0 P1 F9000\nG1 X20"),
            [
                "G1 X10 Y20.5 F3000",
                "G17",
                "G3 X10 Y20.5 Z0.6 I-1.2 J0 F9000",
                "G1 X20"
            ]
        );
        for wrong in [
            "G3 Z0.6 I-1 J0 P1",
            "G1 X1 Y2 F100\nG28\nG3 Z0.6 I-1 J0 P1",
            "G1 X1 Y2 F100\nG91\nG3 Z0.6 I-1 J0 P1",
            "G1 X1 Y2 F100\nG3 Z0.6 I-1 J0 P2",
            "G1 X1 Y2 F100\nG3 X3 Z0.6 I-1 J0 P1",
        ] {
            let Faults(faults) = job(wrong, &Options::default()).unwrap_err();
            assert_eq!(faults.len(), 1, "{wrong}");
            assert!(faults[0].message.starts_with('P'), "{wrong}: {faults:?}");
        }
    }

    #[test]
    fn the_usual_starts_of_slicers_profiles_are_taken() {
        let text = "M201 X1000 Y1000\nM204 P1000 R1000 T1000\nM862.3 P \"MK3\"\nM115 U3.9.3\nG28 W\n\
                    G80\nG29\nM420 S1\nM900 K0.05\nM221 S95\nM141 S0\nSET_VELOCITY_LIMIT ACCEL=500\n\
                    EXCLUDE_OBJECT_START NAME=a_1\nM500\nM412 S1";
        let job = job(text, &Options::default()).unwrap();
        assert_eq!(job.lines, ["$H"]);
        let said = |word: &str| job.notes.iter().any(|note| note.contains(word));
        for word in [
            "M862.3",
            "G29",
            "SET_VELOCITY_LIMIT",
            "M221 S95 is not carried out: the flow",
        ] {
            assert!(said(word), "{word}: {:?}", job.notes);
        }
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

    #[test]
    fn a_refused_command_says_what_helps() {
        for (line, part) in [
            ("PRINT_START BED=60", "PRINT_START is a macro"),
            ("_purge", "_purge is a macro"),
            ("G10", "moves of E"),
            ("T1", "one extruder"),
            ("M1002 gcode_claim_action : 2", "M1002 has no counterpart"),
        ] {
            let faults = job(line, &Options::default()).expect_err(line);
            assert!(faults.0[0].message.contains(part), "{line}: {faults:?}");
        }
        assert_eq!(made("M80\nM355 S1\nM280 P0 S160\nM566 X1\nM81"), [""; 0]);
    }
}
