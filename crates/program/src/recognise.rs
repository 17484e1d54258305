//! Tells lines of programs from plain ones.

use crate::cursor::Cursor;
use crate::head::Head;
use leadscrew_gcode::{words, Letter};

/// Returns true if a line needs this crate: it has a parameter, an expression, an O word, M98, M99
/// or G65. Plain G-code and lines that begin with `$` or `[` do not.
///
/// Of a plain line without comments each byte is looked at once, 16 at a time if the processor
/// can.
#[inline]
pub fn is_program(line: &[u8]) -> bool {
    let mut may_be = false;
    for byte in line {
        may_be |= matches!(byte, b'#' | b'[' | b'O' | b'o' | b'P' | b'p');
    }
    may_be && is_program_after_all(line)
}

#[cold]
fn is_program_after_all(line: &[u8]) -> bool {
    match line.trim_ascii_start().first() {
        None | Some(b'$' | b'[' | b'%') => false,
        Some(_) => {
            Head::bare(line).is_some()
                || has_values(line)
                || words(line).map_while(Result::ok).any(|word| {
                    let code = (word.letter(), word.value().nanos() / 1_000_000_000);
                    matches!(code, (Letter::M, 98 | 99) | (Letter::G, 65))
                })
        }
    }
}

/// Returns true if a line has a parameter or an expression outside its comments.
pub(crate) fn has_values(line: &[u8]) -> bool {
    let is_one = |byte: &u8| matches!(byte, b'#' | b'[');
    if !line.iter().any(is_one) {
        return false;
    }
    let mut cursor = Cursor::new(line);
    while let Some(byte) = cursor.peek() {
        if is_one(&byte) {
            return true;
        }
        cursor.pass();
    }
    false
}
