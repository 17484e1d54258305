//! Reads a file's statements, one for each line.

use super::fact::Source;
use super::format::Units;
use super::reader::{Mode, Reader, Stage, MOST_HITS, TOO_MANY};
use super::shape::Shape;
use super::word::{words, Word};
use super::wrong::Wrong;
use super::{comment, header, Drawing, Hit};
use crate::{Fault, Faults, Mm, Point};

impl Reader {
    /// Reads line `number`, from 1.
    pub(super) fn line(&mut self, number: usize, line: &str) {
        self.line = number;
        // A paper tape begins with NULs, and a DOS file may end with 0x1A.
        let padding = |c: char| matches!(c, '\0' | '\u{1a}');
        let before = (self.now, self.drawing.hits.len(), self.cuts.len());
        if let Err(wrong) = self.statement(line.trim_end_matches(padding)) {
            self.now = before.0;
            self.drawing.hits.truncate(before.1);
            self.cuts.truncate(before.2);
            self.faults
                .push(Fault::new(number, wrong.column, wrong.message));
        }
    }

    /// Returns the drawing, and the faults of all lines that were not understood.
    pub(super) fn finish(mut self) -> (Drawing, Faults) {
        if self.now.stage != Stage::Ended {
            let message =
                "the file ends here without M30: is it whole? (if it is, add the line M30)";
            self.faults.push(Fault::new(self.line, 1, message));
        }
        for (number, _) in self
            .drawing
            .tools
            .iter()
            .filter(|(_, tool)| tool.is_empty())
        {
            self.notes.add(format!(
                "T{number} has a diameter of 0, and no hole: it is left out"
            ));
        }
        self.drawing.notes = self.notes.0;
        (self.drawing, Faults(self.faults))
    }

    fn statement(&mut self, line: &str) -> Result<(), Wrong> {
        let (statement, remark) = line.split_once(';').unwrap_or((line, ""));
        self.said(&comment::read(remark), 1, Source::Comment)?;
        if let Some((number, diameter)) = comment::tool(remark) {
            self.listed.entry(number).or_insert((diameter, self.line));
        }
        let trimmed = statement.trim();
        // A `/` alone clears the links of tools.
        if matches!(trimmed, "" | "/") || is_parenthesised(trimmed) {
            return Ok(());
        }
        if trimmed == "%" {
            self.rewind();
            return Ok(());
        }
        if self.now.stage == Stage::Ended {
            return Err(Wrong::at(
                1,
                "this line stands behind the end of the program (M00, M30)",
            ));
        }
        if header::is_keyword(trimmed) {
            return self.keyword(trimmed);
        }
        self.words(&words(statement)?)
    }

    /// Reads `%`: it ends a header; at the start of a file it is a tape's rewind stop.
    fn rewind(&mut self) {
        if self.now.stage != Stage::Ended {
            self.now.stage = Stage::Body;
        }
    }

    fn words(&mut self, words: &[Word]) -> Result<(), Wrong> {
        let mut rest = words;
        while let [word, behind @ ..] = rest {
            match word.letter {
                'N' => word.whole().map(|_| ())?,
                'G' if matches!(word.whole()?, 92 | 93) => return self.zero_set(word, behind),
                'G' => self.g_code(word)?,
                'M' => self.m_code(word)?,
                'T' => return self.tool_statement(rest),
                'R' => return self.repeat(word, behind),
                'X' | 'Y' | 'A' | 'I' | 'J' => return self.coordinates(rest),
                'F' | 'S' => self.notes.add("F and S between holes are not used"),
                _ => return Err(word.wrong("not understood; A F G I J M N R S T X Y are")),
            }
            rest = behind;
        }
        Ok(())
    }

    fn m_code(&mut self, word: &Word) -> Result<(), Wrong> {
        match word.whole()? {
            48 => return self.begin_header(word),
            95 => self.rewind(),
            71 => self.unit(Units::Mm, word.column, Source::Code)?,
            72 => self.unit(Units::Inch, word.column, Source::Code)?,
            6 => {}
            15 => return self.lower(word),
            // Some programs lift a tool that is up: Altium twice, Allegro above each tool.
            16 | 17 => return self.lift(word),
            0 | 30 => {
                self.lift(word)?;
                self.now.stage = Stage::Ended;
            }
            1 | 2 | 8 | 25 | 31 => {
                return Err(word.wrong(
                    "patterns (step and repeat) are not read: write the board out hole by hole",
                ))
            }
            _ => {
                return Err(word
                    .wrong("not understood; M00, M06, M15 to M17, M30, M48, M71, M72 and M95 are"))
            }
        }
        Ok(())
    }

    fn begin_header(&mut self, word: &Word) -> Result<(), Wrong> {
        if !self.drawing.hits.is_empty() {
            return Err(word.wrong("a second header behind holes"));
        }
        self.now.format.has_header = true;
        self.now.stage = Stage::Header;
        Ok(())
    }

    fn g_code(&mut self, word: &Word) -> Result<(), Wrong> {
        match word.whole()? {
            0..=3 | 5 | 81 => return self.set_mode(word),
            40 => {}
            90 => self.now.is_incremental = false,
            91 => self.now.is_incremental = true,
            41 | 42 => return Err(word.wrong("compensation for the cutter's width is not read")),
            _ => {
                return Err(
                    word.wrong("not understood; G00 to G03, G05, G40, G81, G85 and G90 to G93 are")
                )
            }
        }
        Ok(())
    }

    /// Reads `G93`. `G93X0Y0` changes nothing; any other zero would move all holes and is refused.
    fn zero_set(&mut self, word: &Word, coordinates: &[Word]) -> Result<(), Wrong> {
        let target = self.target(coordinates, Point::ORIGIN)?;
        if target == Point::ORIGIN && !self.now.is_incremental {
            return Ok(());
        }
        Err(word.wrong("another zero within the file is not read"))
    }

    /// Reads coordinates: a hole, a slot or a move of the router.
    fn coordinates(&mut self, words: &[Word]) -> Result<(), Wrong> {
        self.begin_body();
        if self.now.mode != Mode::Drill {
            return self.route_to(words);
        }
        let slot = words.iter().position(|word| word.letter == 'G');
        let (first, second) = words.split_at(slot.unwrap_or(words.len()));
        let from = self.target(first, self.now.at)?;
        let [canned, second @ ..] = second else {
            return self.hit(first, Shape::Hole(from));
        };
        if canned.whole()? != 85 {
            return Err(canned.wrong("not understood behind a hole; G85, a slot, is"));
        }
        if second.is_empty() {
            return Err(canned.wrong("a slot needs its other end"));
        }
        let to = self.target(second, from)?;
        self.hit(first, Shape::Slot { from, to })
    }

    /// Reads a repeat such as `R5X100`: five more holes like the last hole, each at this distance
    /// from the hole before.
    fn repeat(&mut self, count: &Word, step: &[Word]) -> Result<(), Wrong> {
        let times = count.whole()?;
        let last = self.drawing.hits.last();
        let is_here =
            |hit: &Hit| hit.shape == Shape::Hole(self.now.at) && self.now.tool == Some(hit.tool);
        if self.now.mode != Mode::Drill || !last.is_some_and(is_here) {
            return Err(count.wrong("repeats the hole before it, and there is none"));
        }
        let room = MOST_HITS - self.drawing.hits.len();
        if usize::try_from(times).map_or(true, |times| times > room) {
            return Err(count.wrong(TOO_MANY));
        }
        let step = self.step(count, step)?;
        let end = |at: Mm, step: Mm| {
            i128::from(at.nanos()) + i128::from(step.nanos()) * i128::from(times)
        };
        let ends = [end(self.now.at.x, step.x), end(self.now.at.y, step.y)];
        if ends
            .iter()
            .any(|end| end.abs() > i128::from(Mm::LIMIT.nanos()))
        {
            return Err(count.wrong("goes further than 100 m"));
        }
        for _ in 0..times {
            self.hit(std::slice::from_ref(count), Shape::Hole(self.now.at + step))?;
        }
        Ok(())
    }

    fn step(&mut self, count: &Word, step: &[Word]) -> Result<Point, Wrong> {
        if step.is_empty() {
            return Err(count.wrong("a repeat needs its step, such as R5X100"));
        }
        let was_incremental = std::mem::replace(&mut self.now.is_incremental, true);
        let way = self.target(step, Point::ORIGIN);
        self.now.is_incremental = was_incremental;
        way
    }
}

fn is_parenthesised(text: &str) -> bool {
    text.starts_with('(') && text.ends_with(')')
}
