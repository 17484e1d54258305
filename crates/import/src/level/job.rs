//! Rewrites a job with Z above a surface.

use super::{arc, Map};
use crate::gcode_text::{comments, each_once, ABSOLUTE_MM};
use crate::{Fault, Faults, Job};
use leadscrew_gcode::{words, Letter, Number, Word};

/// Millimetres in an inch.
const INCH: f64 = 25.4;

/// Bends a job by the heights of a map. Each piece follows the surface, and each chord its arc, to
/// `tolerance` mm.
///
/// # Errors
/// All lines that cannot be bent: cuts outside the map, other planes, canned cycles, probes, zeros
/// that the job sets, coordinates that are not known.
pub fn job(text: &str, map: &Map, tolerance: f64) -> Result<Job, Faults> {
    let mut bender = Bender::new(map, tolerance);
    let (mut lines, mut faults) = (vec![ABSOLUTE_MM.to_owned()], Vec::new());
    for (index, line) in text.lines().enumerate() {
        match bender.line(line.trim_end()) {
            Ok(bent) => lines.extend(bent),
            Err((column, message)) => faults.push(Fault::new(index + 1, column, message)),
        }
    }
    match faults.is_empty() {
        true => Ok(Job {
            lines,
            notes: Vec::new(),
        }),
        false => Err(Faults(faults)),
    }
}

type Wrong = (usize, String);

#[derive(Clone, Copy, PartialEq, Eq)]
enum Motion {
    Rapid,
    Feed,
    /// An arc in the XY plane.
    Arc {
        clockwise: bool,
    },
    /// G80 and others, which leave axis words without a meaning here.
    None,
}

/// The treatment of a G word.
enum Mode {
    /// It is in force, and each line is written so that it needs none.
    Taken,
    /// It stays in the line.
    Stays,
    /// These words go to a stored place, or to machine coordinates.
    Stored(&'static str),
}

/// A place, mm.
type Point = [f64; 3];

const AXES: [Letter; 3] = [Letter::X, Letter::Y, Letter::Z];

struct Bender<'a> {
    map: &'a Map,
    tolerance: f64,
    is_relative: bool,
    is_inch: bool,
    motion: Motion,
    /// The job's place, mm; `None` for a coordinate that it has not given yet.
    at: [Option<f64>; 3],
    /// The work coordinate system of the job's places, if it has named one.
    system: Option<Number>,
}

impl<'a> Bender<'a> {
    fn new(map: &'a Map, tolerance: f64) -> Self {
        Self {
            map,
            tolerance,
            is_relative: false,
            is_inch: false,
            motion: Motion::Rapid,
            at: [None; 3],
            system: None,
        }
    }

    fn line(&mut self, line: &str) -> Result<Vec<String>, Wrong> {
        if line.starts_with('$') {
            self.at = [None; 3];
            return match line.starts_with("$J") {
                true => Err((1, "a jog within a job is not bent".to_owned())),
                false => Ok(vec![line.to_owned()]),
            };
        }
        if line.trim_start() == "%" {
            return Ok(vec![line.to_owned()]);
        }
        let found: Result<Vec<Word>, _> = words(line.as_bytes()).collect();
        let found = found.map_err(|error| (error.column + 1, error.kind.to_string()))?;
        if found.is_empty() {
            return Ok(vec![line.to_owned()]);
        }
        each_once(&found)?;
        let (others, stored) = self.modes(&found)?;
        let mut lines = match stored {
            Some(code) => self.machine_move(code, &found, &others),
            None if self.moves(&found) => self.bend(&found, &others)?,
            None => Vec::from_iter((!others.is_empty()).then(|| others.join(" "))),
        };
        let said = comments(line).join(" ");
        match lines.first_mut() {
            Some(first) if !said.is_empty() => *first = format!("{first} {said}"),
            None if !said.is_empty() => lines.push(said),
            Some(_) | None => {}
        }
        Ok(lines)
    }

    fn moves(&self, words: &[Word]) -> bool {
        let turns = matches!(self.motion, Motion::Arc { .. });
        words.iter().any(|word| match word.letter() {
            Letter::X | Letter::Y | Letter::Z => true,
            Letter::I | Letter::J => turns,
            _ => false,
        })
    }

    /// A move to machine coordinates or a stored place: as it is, in mm. Its end is not known.
    fn machine_move(&mut self, code: &str, words: &[Word], others: &[String]) -> Vec<String> {
        let mut parts = vec![
            if self.is_relative { "G91" } else { "G90" }.to_owned(),
            code.to_owned(),
        ];
        let given = AXES.map(|letter| self.length(words, letter));
        let names_axis = given.iter().any(Option::is_some);
        for ((at, letter), given) in self.at.iter_mut().zip(AXES).zip(given) {
            parts.extend(given.map(|mm| format!("{}{}", letter.as_char(), number(mm))));
            *at = at.filter(|_| names_axis && given.is_none());
        }
        parts.extend_from_slice(others);
        let line = parts.join(" ");
        match self.is_relative {
            true => vec![line, "G90".to_owned()],
            false => vec![line],
        }
    }

    /// Takes the modes. Returns the words that stay, and the words of a move to a stored place or to
    /// machine coordinates.
    fn modes(&mut self, words: &[Word]) -> Result<(Vec<String>, Option<&'static str>), Wrong> {
        let (mut others, mut stored) = (Vec::new(), None);
        for word in words {
            match word.letter() {
                Letter::G => match self.mode(word).map_err(|reason| told(word, reason))? {
                    Mode::Taken => {}
                    Mode::Stays => others.push(word.to_string()),
                    Mode::Stored(code) => stored = Some(code),
                },
                Letter::I | Letter::J | Letter::K | Letter::N | Letter::F => {}
                Letter::R if matches!(self.motion, Motion::Arc { .. }) => {}
                letter if AXES.contains(&letter) => {}
                _ => others.push(word.to_string()),
            }
        }
        others.extend(
            self.length(words, Letter::F)
                .map(|feed| format!("F{}", number(feed))),
        );
        if stored == Some("G53 G0") && self.motion == Motion::Feed {
            stored = Some("G53 G1");
        }
        Ok((others, stored))
    }

    /// Takes a G word, by its number in tenths.
    fn mode(&mut self, word: &Word) -> Result<Mode, &'static str> {
        match word.value().nanos() / 100_000_000 {
            0 => self.motion = Motion::Rapid,
            10 => self.motion = Motion::Feed,
            20 => self.motion = Motion::Arc { clockwise: true },
            30 => self.motion = Motion::Arc { clockwise: false },
            170 | 940 | 911 => {}
            200 => self.is_inch = true,
            210 => self.is_inch = false,
            900 => self.is_relative = false,
            910 => self.is_relative = true,
            800 => {
                self.motion = Motion::None;
                return Ok(Mode::Stays);
            }
            280 => return Ok(Mode::Stored("G28")),
            300 => return Ok(Mode::Stored("G30")),
            530 => return Ok(Mode::Stored("G53 G0")),
            540..=599 if self.system.is_some_and(|system| system != word.value()) => {
                return Err("chooses other work coordinates, in which the surface lies elsewhere")
            }
            540..=599 => {
                self.system = Some(word.value());
                return Ok(Mode::Stays);
            }
            180 | 190 => return Err("chooses a plane whose arcs are not bent"),
            930 => return Err("gives each line a time, which a bent line does not keep"),
            901 => return Err("gives centres of arcs as places; only G91.1 is bent"),
            382..=385 => return Err("probes: what it finds is not bent"),
            730..=899 => return Err("is a canned cycle: write its strokes as G0 and G1"),
            100 | 281 | 301 | 431 | 520 | 920..=923 => {
                return Err("sets a zero within the job: heights would count from another one")
            }
            _ => return Ok(Mode::Stays),
        }
        Ok(Mode::Taken)
    }

    fn bend(&mut self, words: &[Word], others: &[String]) -> Result<Vec<String>, Wrong> {
        let column = words.first().map_or(1, |word| word.column() + 1);
        let wrong = |message: String| (column, message);
        let from = self.at;
        self.advance(words).map_err(wrong)?;
        let code = match self.motion {
            Motion::Rapid => "G0",
            Motion::Feed | Motion::Arc { .. } => "G1",
            Motion::None => return Err(wrong("no motion is chosen".to_owned())),
        };
        let pieces = match (whole(from), whole(self.at)) {
            (Some(from), Some(to)) => self.pieces(from, to, words).map_err(wrong)?,
            _ if self.motion != Motion::Rapid => {
                let unknown = "where the tool is, the job has not said yet: give X, Y and Z first";
                return Err(wrong(unknown.to_owned()));
            }
            (None, Some(to)) => vec![self.shown(to)],
            // The way up at the start, say: it goes as it is.
            (_, None) => vec![self.given(words)],
        };
        let mut lines = pieces;
        if let Some(first) = lines.first_mut() {
            let head: Vec<&str> = others.iter().map(String::as_str).chain([code]).collect();
            *first = format!("{} {first}", head.join(" "));
        }
        Ok(lines)
    }

    /// A length of the line, mm.
    fn length(&self, words: &[Word], letter: Letter) -> Option<f64> {
        let unit = if self.is_inch { INCH } else { 1.0 };
        value(words, letter).map(|value| value * unit)
    }

    /// Goes to the line's target.
    fn advance(&mut self, words: &[Word]) -> Result<(), String> {
        for (axis, letter) in AXES.into_iter().enumerate() {
            let Some(given) = self.length(words, letter) else {
                continue;
            };
            self.at[axis] = match (self.is_relative, self.at[axis]) {
                (false, _) => Some(given),
                (true, Some(at)) => Some(at + given),
                (true, None) => {
                    let letter = letter.as_char();
                    return Err(format!(
                        "where {letter} is, the job has not said yet: move it in G90 first"
                    ));
                }
            };
        }
        Ok(())
    }

    /// The words of the line's own axes, at their places.
    fn given(&self, words: &[Word]) -> String {
        let named = AXES.into_iter().zip(self.at);
        let named = named.filter(|(letter, _)| value(words, *letter).is_some());
        let places =
            named.filter_map(|(letter, at)| Some(format!("{}{}", letter.as_char(), number(at?))));
        places.collect::<Vec<_>>().join(" ")
    }

    /// The ends of the pieces of a motion, above the surface.
    fn pieces(&self, from: Point, to: Point, words: &[Word]) -> Result<Vec<String>, String> {
        let corners = match self.motion {
            Motion::Arc { clockwise } => {
                let centre = [Letter::I, Letter::J].map(|letter| self.length(words, letter));
                let radius = self.length(words, Letter::R);
                arc::chords(from, to, centre, radius, clockwise, self.tolerance)?
            }
            Motion::Rapid | Motion::Feed | Motion::None => vec![to],
        };
        let (mut pieces, mut begin) = (Vec::new(), from);
        for end in corners {
            let mut ends = [begin, end].into_iter();
            let outside = ends.find(|[x, y, _]| !self.map.covers([*x, *y]));
            if let Some([x, y, _]) = outside.filter(|_| self.motion != Motion::Rapid) {
                let [(left, right), (front, back)] = self.map.bounds();
                return Err(format!(
                    "X{x:.3} Y{y:.3} lies outside the map, X{left} to X{right}, Y{front} to Y{back}: \
                     probe a larger grid"
                ));
            }
            let flat = |[x, y, _]: Point| [x, y];
            for part in self.map.cuts(flat(begin), flat(end), self.tolerance) {
                let at = [0, 1, 2].map(|axis| begin[axis] + part * (end[axis] - begin[axis]));
                pieces.push(self.shown(at));
            }
            begin = end;
        }
        Ok(pieces)
    }

    /// The words of a place, above the surface.
    fn shown(&self, [x, y, z]: Point) -> String {
        let z = z + self.map.height([x, y]);
        format!("X{} Y{} Z{}", number(x), number(y), number(z))
    }
}

/// A fault at a word.
fn told(word: &Word, reason: &str) -> Wrong {
    (word.column() + 1, format!("{word} {reason}"))
}

/// A place of which all coordinates are known.
fn whole(at: [Option<f64>; 3]) -> Option<Point> {
    let [x, y, z] = at;
    Some([x?, y?, z?])
}

fn value(words: &[Word], letter: Letter) -> Option<f64> {
    let word = words.iter().find(|word| word.letter() == letter)?;
    Some(word.value().nanos() as f64 / 1e9)
}

/// A number rounded to 0.0001.
fn number(value: f64) -> Number {
    Number::from_nanos((value * 1e4).round() as i64 * 100_000)
}
