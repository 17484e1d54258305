//! Reads statements of tools: `T1C0.8F200S100` defines a tool, `T1` selects it.

use super::format::Units;
use super::reader::{Reader, Stage};
use super::tool::{Tool, MOST_OF_MACHINES};
use super::word::Word;
use super::wrong::Wrong;
use crate::decimal::{self, NANOS_PER_MM};
use crate::Mm;

/// The highest number of a tool.
const MOST: u32 = 9999;
/// An `S` below this is in thousands of revolutions a minute.
const KRPM: i64 = 1000 * NANOS_PER_MM;

impl Reader {
    /// Reads a statement that begins with `T`.
    pub(super) fn tool_statement(&mut self, words: &[Word]) -> Result<(), Wrong> {
        let [name, properties @ ..] = words else {
            return Ok(());
        };
        let number = name.whole()?;
        if number > MOST {
            return Err(name.wrong("tools have numbers up to 9999"));
        }
        self.refuse_while_routing(name)?;
        if !properties.is_empty() {
            self.define(name, number, properties)?;
        }
        if properties.is_empty() || self.now.stage != Stage::Header {
            self.select(name, number)?;
        }
        Ok(())
    }

    fn define(&mut self, name: &Word, number: u32, properties: &[Word]) -> Result<(), Wrong> {
        let mut tool = Tool::default();
        for word in properties {
            self.property(&mut tool, word)?;
        }
        match self.drawing.tools.get(&number) {
            Some(before) if before.diameter != tool.diameter => {
                Err(name.wrong("is defined a second time, with another diameter"))
            }
            Some(_) | None => {
                self.insert(name, number, tool);
                Ok(())
            }
        }
    }

    /// Adds a tool. A number that no machine takes is noted with its place.
    fn insert(&mut self, name: &Word, number: u32, tool: Tool) {
        let is_new = self.drawing.tools.insert(number, tool).is_none();
        if is_new && number > MOST_OF_MACHINES {
            self.notes.add(format!(
                "line {}, column {}: machines know tools up to T{MOST_OF_MACHINES}; \
                 T{number} gets another number in the job",
                self.line, name.column
            ));
        }
    }

    fn property(&mut self, tool: &mut Tool, word: &Word) -> Result<(), Wrong> {
        match word.letter {
            'C' => tool.diameter = Some(self.diameter(word)?),
            'F' => tool.feed = self.feed(word)?,
            'S' => tool.speed = self.speed(word)?,
            letter @ ('B' | 'H' | 'Z') => self.notes.add(format!(
                "{letter} of a tool (B: way up, H: hits, Z: depth) is not used"
            )),
            _ => return Err(word.wrong("is no property of a tool")),
        }
        Ok(())
    }

    fn diameter(&mut self, word: &Word) -> Result<Mm, Wrong> {
        if !word.text.contains('.') {
            return Err(word.wrong("a diameter needs a point, such as C0.8"));
        }
        let units = self.units(word)?;
        let diameter = decimal::length(word.text, units.nanos());
        match diameter.map_err(|message| word.wrong(message))? {
            diameter if diameter >= Mm::ZERO => Ok(diameter),
            _ => Err(word.wrong("a diameter is not below 0")),
        }
    }

    /// Reads a feed in inches a minute. In a metric file, `F` is ignored with a note, because
    /// programs do not agree on its unit.
    fn feed(&mut self, word: &Word) -> Result<Option<Mm>, Wrong> {
        let units = self.units(word)?;
        let feed = decimal::length(word.text, units.nanos());
        let feed = feed.map_err(|message| word.wrong(message))?;
        match units {
            _ if feed <= Mm::ZERO => Ok(None),
            Units::Inch => Ok(Some(feed)),
            Units::Mm => {
                self.notes
                    .add("F of a metric file has no agreed unit and is not used");
                Ok(None)
            }
        }
    }

    fn speed(&self, word: &Word) -> Result<Option<u32>, Wrong> {
        let number = decimal::length(word.text, NANOS_PER_MM);
        let nanos = number.map_err(|message| word.wrong(message))?.nanos();
        let rpm = if nanos < KRPM { nanos * 1000 } else { nanos } / NANOS_PER_MM;
        Ok(u32::try_from(rpm).ok().filter(|rpm| *rpm > 0))
    }

    fn units(&mut self, word: &Word) -> Result<Units, Wrong> {
        let units = self.now.format.units(&mut self.notes);
        units.map_err(|message| word.wrong(message))
    }

    /// Selects a tool; `T0` puts the tool away. If the file defines no tool at all, the diameters
    /// are in a separate list.
    fn select(&mut self, name: &Word, number: u32) -> Result<(), Wrong> {
        self.begin_body();
        self.now.tool = (number > 0).then_some(number);
        if number == 0 || self.drawing.tools.contains_key(&number) {
            return Ok(());
        }
        if let Some((diameter, line)) = self.listed.get(&number).copied() {
            self.notes.add(format!(
                "T{number}: {diameter} mm, as the comment in line {line} says"
            ));
            let diameter = Some(diameter);
            let tool = Tool {
                diameter,
                ..Tool::default()
            };
            self.insert(name, number, tool);
            return Ok(());
        }
        let is_listed = |tool: &Tool| *tool == Tool::default();
        if self.drawing.tools.values().all(is_listed) {
            self.notes
                .add(format!("T{number}: the file does not say its diameter"));
            self.insert(name, number, Tool::default());
            return Ok(());
        }
        self.now.tool = None;
        Err(name.wrong("is not defined in this file"))
    }
}
