//! The tools that a program asks for.

use leadscrew_gcode::{words, Letter};
use leadscrew_machine::protocol::line_reader::LineReader;

/// Bytes of a line's buffer: more than any line that a machine takes.
const LINE: usize = 256;

/// Adds the tools (T words) of a line that are not among `tools` yet.
pub fn note_tools(tools: &mut Vec<u32>, raw: &[u8]) {
    if !raw.iter().any(|byte| matches!(byte, b'T' | b't')) {
        return;
    }
    let mut reader = LineReader::<LINE>::new(LINE);
    for byte in raw.iter().filter(|byte| byte.is_ascii()) {
        reader.push(*byte);
    }
    let Ok(line) = reader.line() else { return };
    for word in words(line).map_while(Result::ok) {
        let number = u32::try_from(word.value().nanos() / 1_000_000_000);
        match (word.letter(), number) {
            (Letter::T, Ok(tool)) if !tools.contains(&tool) => tools.push(tool),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tools_are_listed_once_in_the_order_in_which_they_come() {
        let mut tools = Vec::new();
        for line in ["T3", "(T9) G0X1", "t1 ; T8", "G1X1T3", "$T5", "T2 M6"] {
            note_tools(&mut tools, line.as_bytes());
        }
        assert_eq!(tools, [3, 1, 2]);
    }
}
