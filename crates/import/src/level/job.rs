//! Rewrites a job with Z above a surface.

use super::Map;
use crate::gcode_text::{comments, each_once, ABSOLUTE_MM};
use crate::{Fault, Faults, Job};
use leadscrew_gcode::{words, Letter, Number, Word};
use std::f64::consts::TAU;

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

struct Bender<'a> {
    map: &'a Map,
    tolerance: f64,
    is_relative: bool,
    is_inch: bool,
    motion: Motion,
    /// Where the job is, mm; `None` for a coordinate that it has not given yet.
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

    /// A move to machine coordinates or a stored place: as it is, in mm. Where it ends is not known.
    fn machine_move(&mut self, code: &str, words: &[Word], others: &[String]) -> Vec<String> {
        const LETTERS: [Letter; 3] = [Letter::X, Letter::Y, Letter::Z];
        let unit = if self.is_inch { INCH } else { 1.0 };
        let mut parts = vec![
            if self.is_relative { "G91" } else { "G90" }.to_owned(),
            code.to_owned(),
        ];
        let given = LETTERS.map(|letter| value(words, letter));
        for ((at, letter), given) in self.at.iter_mut().zip(LETTERS).zip(given) {
            parts
                .extend(given.map(|value| format!("{}{}", letter.as_char(), number(value * unit))));
            *at = at.filter(|_| {
                given.is_none() && LETTERS.iter().any(|letter| value(words, *letter).is_some())
            });
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
            let wrong = |message: &str| Err((word.column() + 1, format!("{word} {message}")));
            match word.letter() {
                Letter::G => {}
                Letter::X
                | Letter::Y
                | Letter::Z
                | Letter::I
                | Letter::J
                | Letter::K
                | Letter::N => continue,
                Letter::R if matches!(self.motion, Motion::Arc { .. }) => continue,
                Letter::F => continue,
                _ => {
                    others.push(word.to_string());
                    continue;
                }
            }
            match word.value().nanos() / 100_000_000 {
                0 => self.motion = Motion::Rapid,
                10 => self.motion = Motion::Feed,
                20 => self.motion = Motion::Arc { clockwise: true },
                30 => self.motion = Motion::Arc { clockwise: false },
                170 | 940 => {}
                200 => self.is_inch = true,
                210 => self.is_inch = false,
                900 => self.is_relative = false,
                910 => self.is_relative = true,
                911 => {}
                800 => {
                    self.motion = Motion::None;
                    others.push(word.to_string());
                }
                280 => stored = Some("G28"),
                300 => stored = Some("G30"),
                530 => stored = Some("G53 G0"),
                540..=599 if self.system.is_some_and(|system| system != word.value()) => {
                    return wrong(
                        "chooses other work coordinates, in which the surface lies elsewhere",
                    )
                }
                540..=599 => {
                    self.system = Some(word.value());
                    others.push(word.to_string());
                }
                180 | 190 => return wrong("chooses a plane whose arcs are not bent"),
                930 => return wrong("gives each line a time, which a bent line does not keep"),
                901 => return wrong("gives centres of arcs as places; only G91.1 is bent"),
                382..=385 => return wrong("probes: what it finds is not bent"),
                730..=899 => return wrong("is a canned cycle: write its strokes as G0 and G1"),
                100 | 920 | 921 | 281 | 301 | 431 => {
                    return wrong(
                        "sets a zero within the job: heights would count from another one",
                    )
                }
                _ => others.push(word.to_string()),
            }
        }
        if let Some(feed) = value(words, Letter::F) {
            let unit = if self.is_inch { INCH } else { 1.0 };
            others.push(format!("F{}", number(feed * unit)));
        }
        if stored == Some("G53 G0") && self.motion == Motion::Feed {
            stored = Some("G53 G1");
        }
        Ok((others, stored))
    }

    fn bend(&mut self, words: &[Word], others: &[String]) -> Result<Vec<String>, Wrong> {
        let unit = if self.is_inch { INCH } else { 1.0 };
        let length = |letter| value(words, letter).map(|value| value * unit);
        let given = [Letter::X, Letter::Y, Letter::Z].map(length);
        let column = words.first().map_or(1, |word| word.column() + 1);
        let from = self.at;
        for ((at, given), letter) in self.at.iter_mut().zip(given).zip(['X', 'Y', 'Z']) {
            *at = match (given, self.is_relative, *at) {
                (Some(way), true, Some(at)) => Some(at + way),
                (Some(_), true, None) => {
                    return Err((
                        column,
                        format!(
                            "where {letter} is, the job has not said yet: move it in G90 first"
                        ),
                    ))
                }
                (Some(place), false, _) => Some(place),
                (None, _, at) => at,
            };
        }
        let code = match self.motion {
            Motion::Rapid => "G0",
            Motion::Feed | Motion::Arc { .. } => "G1",
            Motion::None => return Err((column, "no motion is chosen".to_owned())),
        };
        let mut lines = Vec::new();
        let mut put = |text: String| {
            let head = match lines.is_empty() {
                true => others
                    .iter()
                    .map(|word| format!("{word} "))
                    .chain([format!("{code} ")])
                    .collect(),
                false => String::new(),
            };
            lines.push(head + &text);
        };
        let [Some(x), Some(y), Some(z)] = self.at else {
            // A place that is not whole yet, as the tool's way up at the start: it goes as it is.
            if self.motion != Motion::Rapid {
                return Err((
                    column,
                    "where the tool is, the job has not said yet: give X, Y and Z first".to_owned(),
                ));
            }
            let words = self.at.iter().zip(['X', 'Y', 'Z']).zip(given);
            let words = words.filter_map(|((at, letter), given)| {
                given.and(at.map(|at| format!("{letter}{}", number(at))))
            });
            put(words.collect::<Vec<_>>().join(" "));
            return Ok(lines);
        };
        let to = [x, y, z];
        let [Some(x), Some(y), Some(z)] = from else {
            if self.motion != Motion::Rapid {
                return Err((
                    column,
                    "where the tool is, the job has not said yet: give X, Y and Z first".to_owned(),
                ));
            }
            put(self.shown(to));
            return Ok(lines);
        };
        let from = [x, y, z];
        let corners = match self.motion {
            Motion::Arc { clockwise } => {
                let centre = [length(Letter::I), length(Letter::J)];
                arc(
                    from,
                    to,
                    centre,
                    length(Letter::R),
                    clockwise,
                    self.tolerance,
                )
                .map_err(|message| (column, message.to_owned()))?
            }
            Motion::Rapid | Motion::Feed | Motion::None => vec![to],
        };
        let mut begin = from;
        for end in corners {
            let outside = [begin, end]
                .into_iter()
                .find(|at| !self.map.covers([at[0], at[1]]));
            if let (Some(at), true) = (outside, code == "G1") {
                let [(left, right), (front, back)] = self.map.bounds();
                return Err((column, format!(
                    "X{:.3} Y{:.3} lies outside the map, X{left} to X{right}, Y{front} to Y{back}: probe a larger grid",
                    at[0], at[1]
                )));
            }
            let flat = |at: [f64; 3]| [at[0], at[1]];
            for part in self.map.cuts(flat(begin), flat(end), self.tolerance) {
                let at = [0, 1, 2].map(|axis| begin[axis] + part * (end[axis] - begin[axis]));
                put(self.shown(at));
            }
            begin = end;
        }
        Ok(lines)
    }

    /// The words of a place, above the surface.
    fn shown(&self, [x, y, z]: [f64; 3]) -> String {
        let z = z + self.map.height([x, y]);
        format!("X{} Y{} Z{}", number(x), number(y), number(z))
    }
}

fn value(words: &[Word], letter: Letter) -> Option<f64> {
    let word = words.iter().find(|word| word.letter() == letter)?;
    Some(word.value().nanos() as f64 / 1e9)
}

/// A number rounded to 0.0001.
fn number(value: f64) -> Number {
    Number::from_nanos((value * 1e4).round() as i64 * 100_000)
}

/// The ends of the chords of an arc or helix, by its centre or radius.
fn arc(
    from: [f64; 3],
    to: [f64; 3],
    centre: [Option<f64>; 2],
    radius: Option<f64>,
    clockwise: bool,
    tolerance: f64,
) -> Result<Vec<[f64; 3]>, &'static str> {
    let way = match radius {
        Some(radius) => centre_of(from, to, radius, clockwise)?,
        None if centre == [None; 2] => return Err("an arc needs I and J, or R"),
        None => centre.map(|part| part.unwrap_or(0.0)),
    };
    let middle = [from[0] + way[0], from[1] + way[1]];
    let radius = way[0].hypot(way[1]);
    let end = [to[0] - middle[0], to[1] - middle[1]];
    let begin = (-way[1]).atan2(-way[0]);
    let turn = end[1].atan2(end[0]) - begin;
    let is_round = (to[0] - from[0]).hypot(to[1] - from[1]) < 1e-6;
    let turn = match (clockwise, is_round) {
        (true, true) => -TAU,
        (false, true) => TAU,
        (true, false) => -(-turn).rem_euclid(TAU),
        (false, false) => turn.rem_euclid(TAU),
    };
    // A chord of the angle a is r (1 - cos(a / 2)) from its arc.
    let most = 2.0 * (1.0 - (tolerance / radius.max(tolerance)).min(1.0)).acos();
    let chords = (turn.abs() / most.max(0.01)).ceil().max(1.0) as u32;
    let corner = |chord: u32| {
        let part = f64::from(chord) / f64::from(chords);
        let (sin, cos) = (begin + turn * part).sin_cos();
        [
            middle[0] + radius * cos,
            middle[1] + radius * sin,
            from[2] + part * (to[2] - from[2]),
        ]
    };
    Ok((1..chords).map(corner).chain([to]).collect())
}

/// The way from the start of an arc to its centre, from its radius: negative for the longer arc.
fn centre_of(
    from: [f64; 3],
    to: [f64; 3],
    radius: f64,
    clockwise: bool,
) -> Result<[f64; 2], &'static str> {
    let half = [(to[0] - from[0]) / 2.0, (to[1] - from[1]) / 2.0];
    let length = half[0].hypot(half[1]);
    if length < 1e-6 {
        return Err("an arc by R ends elsewhere than it begins");
    }
    let height = radius * radius - length * length;
    if height < -1e-3 {
        return Err("R is too short for this arc");
    }
    let side = if clockwise == (radius > 0.0) {
        1.0
    } else {
        -1.0
    };
    let height = side * height.max(0.0).sqrt() / length;
    Ok([half[0] + half[1] * height, half[1] - half[0] * height])
}
