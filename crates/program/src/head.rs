//! The O word at the beginning of a line.

use crate::cursor::Cursor;
use crate::expression::Reader;
use crate::fault::{ErrorKind, Expected, Fault};
use crate::label::{Keyword, Label};

/// An O word, read up to the end of its keyword.
#[derive(Clone, Copy)]
pub(crate) struct Head<'t> {
    pub(crate) label: Label,
    pub(crate) keyword: Keyword,
    /// The text that follows the keyword.
    pub(crate) cursor: Cursor<'t>,
    /// The O.
    start: Cursor<'t>,
}

impl<'t> Head<'t> {
    /// A fault of the O word as a whole.
    pub(crate) fn fault(&self, kind: ErrorKind) -> Fault {
        self.start.fault(kind)
    }

    /// Reads the O word of a line, unless it has none, is wrong, or its number is calculated.
    pub(crate) fn bare(line: &'t [u8]) -> Option<Self> {
        let mut cursor = Cursor::new(line);
        let start = begin(&mut cursor)?;
        let label = label(&mut cursor).ok()??;
        Self::with(label, start, cursor).ok()
    }

    fn with(label: Label, start: Cursor<'t>, cursor: Cursor<'t>) -> Result<Self, Fault> {
        let mut cursor = cursor;
        cursor.peek();
        let word = cursor;
        let keyword = Keyword::from_bytes(cursor.letters().as_bytes())
            .ok_or_else(|| word.fault(ErrorKind::UnknownKeyword))?;
        Ok(Self {
            label,
            keyword,
            cursor,
            start,
        })
    }
}

/// Passes over the block delete, the line number and the O. `None`: the line has no O word.
fn begin<'t>(cursor: &mut Cursor<'t>) -> Option<Cursor<'t>> {
    cursor.take(b'/');
    if cursor.take(b'N') {
        cursor.digits();
    }
    cursor.peek();
    let start = *cursor;
    cursor.take(b'O').then_some(start)
}

/// Reads a number or a name; `None` if the number is calculated.
fn label(cursor: &mut Cursor<'_>) -> Result<Option<Label>, Fault> {
    if cursor.take(b'<') {
        return cursor.name().map(|name| Some(Label::Name(name)));
    }
    if let Some(number) = cursor.digits() {
        return Ok(Some(Label::Number(number)));
    }
    match cursor.peek() {
        Some(b'#' | b'[') => Ok(None),
        _ => Err(cursor.expected(Expected::Label)),
    }
}

impl<'t> Reader<'t, '_> {
    /// Reads the O word of a line. `None`: the line has none.
    pub(crate) fn head(&mut self) -> Result<Option<Head<'t>>, Fault> {
        let Some(start) = begin(&mut self.cursor) else {
            return Ok(None);
        };
        let label = match label(&mut self.cursor)? {
            Some(label) => label,
            None => {
                let number = self.value()?.whole();
                let number = number.and_then(|number| u32::try_from(number).ok());
                Label::Number(number.ok_or_else(|| start.fault(ErrorKind::NotWhole))?)
            }
        };
        Head::with(label, start, self.cursor).map(Some)
    }
}
