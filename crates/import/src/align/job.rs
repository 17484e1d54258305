//! Rewrites a job with X, Y, I and J turned.

use super::fit::{Fit, Place};
use crate::gcode_text::{comments, each_once};
use crate::{Fault, Faults, Job};
use leadscrew_gcode::{words, Letter, Number, Word};

/// Turns and shifts a job. Lines without X, Y, I or J stay as they are.
///
/// # Errors
/// All lines whose meaning would change: other planes, zeros set within the job, and coordinates
/// that are not known.
pub fn job(text: &str, fit: &Fit) -> Result<Job, Faults> {
    let mut turner = Turner::new(fit);
    let (mut lines, mut faults) = (Vec::new(), Vec::new());
    for (index, line) in text.lines().enumerate() {
        match turner.line(line.trim_end()) {
            Ok(line) => lines.push(line),
            Err((column, message)) => faults.push(Fault::new(index + 1, column, message)),
        }
    }
    if !faults.is_empty() {
        return Err(Faults(faults));
    }
    Ok(Job {
        lines,
        notes: Vec::new(),
    })
}

type Wrong = (usize, String);

/// The work coordinate system of a job that has chosen none.
const DEFAULT_SYSTEM: Number = Number::from_int(54);
/// Millimetres in an inch.
const INCH: f64 = 25.4;

/// The modal state that X and Y depend on.
struct Turner<'a> {
    fit: &'a Fit,
    is_relative: bool,
    is_inch: bool,
    is_arc: bool,
    /// The job's place, mm; `None` for a coordinate that it has not given yet.
    at: [Option<f64>; 2],
    /// The sum of the rounding errors of relative moves, mm; the next move makes up for it.
    owed: Place,
    /// The work coordinate system of the job's places, such as `G54`; `None` before the first.
    system: Option<Number>,
}

impl<'a> Turner<'a> {
    fn new(fit: &'a Fit) -> Self {
        Self {
            fit,
            is_relative: false,
            is_inch: false,
            is_arc: false,
            at: [None; 2],
            owed: [0.0; 2],
            system: None,
        }
    }

    fn line(&mut self, line: &str) -> Result<String, Wrong> {
        if line.starts_with('$') {
            return self.system_command(line);
        }
        let code = line.trim_start();
        if code == "%" {
            return Ok(line.to_owned());
        }
        let found: Result<Vec<Word>, _> = words(line.as_bytes()).collect();
        let found = found.map_err(|error| (error.column + 1, error.kind.to_string()))?;
        each_once(&found)?;
        let is_machine = self.modes(&found)?;
        if is_machine {
            return Ok(line.to_owned());
        }
        let turned = self.turned(&found)?;
        Ok(turned.map_or_else(|| line.to_owned(), |words| rebuilt(&words, line)))
    }

    /// Takes a line such as `$H`. A jog is refused, since its target would not be turned.
    fn system_command(&mut self, line: &str) -> Result<String, Wrong> {
        if line.starts_with("$J") {
            return Err((1, "a jog within a job is not turned".to_owned()));
        }
        self.at = [None; 2];
        Ok(line.to_owned())
    }

    /// Takes the G words. Returns whether X and Y of this line are machine coordinates.
    fn modes(&mut self, words: &[Word]) -> Result<bool, Wrong> {
        let names_place = words
            .iter()
            .any(|word| matches!(word.letter(), Letter::X | Letter::Y));
        let mut is_machine = false;
        for word in words.iter().filter(|word| word.letter() == Letter::G) {
            let wrong = |message: &str| Err((word.column() + 1, format!("{word} {message}")));
            match word.value().nanos() / 100_000_000 {
                0 | 10 | 382..=385 | 730..=899 => self.is_arc = false,
                20 | 30 => self.is_arc = true,
                200 => self.is_inch = true,
                210 => self.is_inch = false,
                900 => self.is_relative = false,
                910 => self.is_relative = true,
                540..=599 if self.system.is_some_and(|system| system != word.value()) => {
                    return wrong(
                        "chooses other work coordinates, in which the board lies elsewhere",
                    );
                }
                540..=599 => self.system = Some(word.value()),
                180 | 190 => return wrong("chooses a plane that is turned"),
                901 => return wrong("gives centres of arcs as places; only G91.1 is turned"),
                100 | 280 | 300 | 520 | 920 | 281 | 301 if names_place => {
                    return wrong("sets or names a place of X and Y that is not turned");
                }
                530 => is_machine = true,
                _ => {}
            }
            // The job does not tell where these motions end.
            if matches!(
                word.value().nanos() / 100_000_000,
                280 | 300 | 530 | 382..=385
            ) {
                self.at = [None; 2];
            }
        }
        Ok(is_machine)
    }

    /// The line's words with turned X, Y, I and J and a scaled R; `None` if the line has none of
    /// these.
    fn turned(&mut self, words: &[Word]) -> Result<Option<Vec<String>>, Wrong> {
        let unit = if self.is_inch { INCH } else { 1.0 };
        let value = |letter| {
            let word = words.iter().find(|word| word.letter() == letter)?;
            Some(word.value().nanos() as f64 / 1e9 * unit)
        };
        let place = [value(Letter::X), value(Letter::Y)];
        let centre = [value(Letter::I), value(Letter::J)];
        let mut place = self.place(place, words)?;
        let way = centre.map(|part| part.unwrap_or(0.0));
        let mut centre = centre
            .iter()
            .any(Option::is_some)
            .then(|| self.fit.way(way));
        let scales = self.is_arc && self.fit.length() != 1.0;
        let radius = value(Letter::R).filter(|_| scales);
        if place.is_none() && centre.is_none() && radius.is_none() {
            return Ok(None);
        }
        let mut shown = Vec::new();
        for word in words {
            match word.letter() {
                Letter::X | Letter::Y => shown.extend(self.pair(['X', 'Y'], place.take())),
                Letter::I | Letter::J => shown.extend(self.pair(['I', 'J'], centre.take())),
                Letter::R if scales => {
                    let length = radius.unwrap_or(0.0) * self.fit.length();
                    shown.push(format!("R{}", self.number(length)));
                }
                _ => shown.push(word.to_string()),
            }
        }
        Ok(Some(shown))
    }

    /// The turned target of a line's X and Y, or their turned way.
    fn place(&mut self, words: [Option<f64>; 2], line: &[Word]) -> Result<Option<Place>, Wrong> {
        if words == [None; 2] {
            return Ok(None);
        }
        self.system.get_or_insert(DEFAULT_SYSTEM);
        if self.is_relative {
            let way = words.map(|part| part.unwrap_or(0.0));
            for (at, way) in self.at.iter_mut().zip(way) {
                *at = at.map(|at| at + way);
            }
            return Ok(Some(self.repaid(self.fit.way(way))));
        }
        let named = [words[0].or(self.at[0]), words[1].or(self.at[1])];
        let column = line
            .iter()
            .find(|word| matches!(word.letter(), Letter::X | Letter::Y));
        let column = column.map_or(1, |word| word.column() + 1);
        let [Some(x), Some(y)] = named else {
            let missing = if named[0].is_none() { 'X' } else { 'Y' };
            return Err((
                column,
                format!("where {missing} is, the job has not said yet: add it to this line"),
            ));
        };
        self.at = named;
        self.owed = [0.0; 2];
        Ok(Some(self.fit.place([x, y])))
    }

    /// A way plus the remainder of earlier rounding, so that many short ways end at the right
    /// place.
    fn repaid(&mut self, way: Place) -> Place {
        let wanted = [way[0] + self.owed[0], way[1] + self.owed[1]];
        let unit = if self.is_inch { INCH } else { 1.0 };
        let written = wanted.map(|part| self.number(part).nanos() as f64 / 1e9 * unit);
        self.owed = [wanted[0] - written[0], wanted[1] - written[1]];
        wanted
    }

    fn pair(&self, letters: [char; 2], place: Option<Place>) -> Vec<String> {
        let words = place
            .into_iter()
            .flat_map(|place| letters.into_iter().zip(place));
        words
            .map(|(letter, length)| format!("{letter}{}", self.number(length)))
            .collect()
    }

    /// A length in the job's unit, rounded to 0.0001 mm or 0.00001 inch.
    fn number(&self, mm: f64) -> Number {
        let (length, nanos) = match self.is_inch {
            true => (mm / INCH, 10_000.0),
            false => (mm, 100_000.0),
        };
        Number::from_nanos(((length * 1e9 / nanos).round() * nanos) as i64)
    }
}

/// A line with new words and its own comments.
fn rebuilt(words: &[String], line: &str) -> String {
    let comments = comments(line);
    let parts = words.iter().map(String::as_str).chain(comments);
    let skips = if line.trim_start().starts_with('/') {
        "/"
    } else {
        ""
    };
    format!("{skips}{}", parts.collect::<Vec<_>>().join(" "))
}
