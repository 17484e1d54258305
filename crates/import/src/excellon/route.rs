//! Routing: `G00` moves above the board, `M15` lowers the tool, `G01` `G02` `G03` cut, `M16` lifts
//! it, `G05` drills again.

use super::bend::{by_centre, by_radius};
use super::reader::{Mode, Motion, Reader};
use super::shape::{Arc, Centre, Cut, Route, Shape};
use super::word::Word;
use super::wrong::Wrong;
use crate::Point;

impl Reader {
    /// Reads `G00` to `G03`, `G05` and `G81`.
    pub(super) fn set_mode(&mut self, word: &Word) -> Result<(), Wrong> {
        let motion = match word.whole()? {
            0 => Motion::Rapid,
            1 => Motion::Line,
            code @ (2 | 3) => Motion::Arc {
                is_clockwise: code == 2,
            },
            _ => {
                self.refuse_while_routing(word)?;
                self.now.mode = Mode::Drill;
                return Ok(());
            }
        };
        match &mut self.now.mode {
            Mode::Drill if motion != Motion::Rapid => {
                return Err(word.wrong("cuts before G00 has begun a path"));
            }
            Mode::Down(..) if motion == Motion::Rapid => {
                return Err(word.wrong("the tool is down: M16 has to lift it first"));
            }
            mode @ (Mode::Drill | Mode::Up(_)) => *mode = Mode::Up(motion),
            Mode::Down(cutting, _) => *cutting = motion,
        }
        Ok(())
    }

    /// Reads `M15`, which lowers the tool.
    pub(super) fn lower(&mut self, word: &Word) -> Result<(), Wrong> {
        let Mode::Up(motion) = self.now.mode else {
            return Err(word.wrong("lowers a router that is not above a path's start (G00)"));
        };
        self.now.mode = Mode::Down(motion, self.now.at);
        Ok(())
    }

    /// Reads `M16` and the end of the program, before which some programs write no `M16`: it lifts
    /// the tool if it is down. A path without a cut is a hole.
    pub(super) fn lift(&mut self, word: &Word) -> Result<(), Wrong> {
        let Mode::Down(motion, from) = self.now.mode else {
            return Ok(());
        };
        self.now.mode = Mode::Up(motion);
        let shape = match self.cuts.as_slice() {
            [] => Shape::Hole(from),
            [_, ..] => Shape::Route(Route {
                from,
                cuts: self.cuts.clone(),
            }),
        };
        self.hit(std::slice::from_ref(word), shape)?;
        self.cuts.clear();
        Ok(())
    }

    /// Refuses a statement while the router is down: a path has to end before another tool and
    /// before drilling.
    pub(super) fn refuse_while_routing(&self, word: &Word) -> Result<(), Wrong> {
        match self.now.mode {
            Mode::Down(..) => Err(word.wrong("the router is down: M16 has to lift it first")),
            Mode::Drill | Mode::Up(_) => Ok(()),
        }
    }

    /// Reads coordinates while routing.
    pub(super) fn route_to(&mut self, words: &[Word]) -> Result<(), Wrong> {
        let is_place = |word: &&Word| matches!(word.letter, 'X' | 'Y');
        let places: Vec<Word> = words.iter().filter(is_place).copied().collect();
        let bends: Vec<Word> = words
            .iter()
            .filter(|word| !is_place(word))
            .copied()
            .collect();
        let to = self.target(&places, self.now.at)?;
        let (motion, is_down) = match self.now.mode {
            Mode::Drill => return Ok(()),
            Mode::Up(motion) => (motion, false),
            Mode::Down(motion, _) => (motion, true),
        };
        let column = words.first().map_or(1, |word| word.column);
        let arc = match motion {
            Motion::Arc { is_clockwise } => {
                let centre = self.centre(&bends, to - self.now.at, column)?;
                Some(Arc {
                    is_clockwise,
                    centre,
                })
            }
            Motion::Rapid | Motion::Line => None,
        };
        match (motion, bends.first()) {
            (Motion::Rapid | Motion::Line, Some(word)) => {
                return Err(word.wrong("only an arc bends"))
            }
            (Motion::Rapid, None) if is_down => {
                return Err(Wrong::at(column, "a cut needs G01, G02 or G03"))
            }
            (Motion::Line | Motion::Arc { .. }, _) if !is_down => {
                return Err(Wrong::at(
                    column,
                    "a cut while the tool is up: M15 lowers it",
                ));
            }
            _ => {}
        }
        self.now.at = to;
        if is_down {
            self.cuts.push(Cut { to, arc });
        }
        Ok(())
    }

    /// Reads the centre of an arc that leads along `way`: `A` is the radius, `I` and `J` are the
    /// way from the start.
    fn centre(&mut self, bends: &[Word], way: Point, column: usize) -> Result<Centre, Wrong> {
        let mut number = |word: &Word| self.now.format.coordinate(word, &mut self.notes);
        match bends {
            [a] if a.letter == 'A' => {
                let radius = number(a)?;
                by_radius(radius, way).map_err(|message| a.wrong(message))
            }
            [i, j] if (i.letter, j.letter) == ('I', 'J') => {
                let centre = Point {
                    x: number(i)?,
                    y: number(j)?,
                };
                by_centre(centre, way).map_err(|message| i.wrong(message))
            }
            _ => Err(Wrong::at(
                column,
                "an arc needs A (radius) or I and J (centre)",
            )),
        }
    }
}
