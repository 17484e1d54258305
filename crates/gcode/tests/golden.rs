//! Reads `golden/lines.txt` and compares the words of each line with the text below it.
//!
//! The file is pairs of lines: `< ` and a line of G-code as written, `> ` and the block printed, or
//! the error. Escapes like `\t` and `\x80` stand for bytes that an editor would not show.

use leadscrew_gcode::parse;

const LINES: &str = include_str!("golden/lines.txt");

/// The byte string that an escaped text stands for: the inverse of `<[u8]>::escape_ascii`, as far
/// as needed.
fn unescape(text: &str) -> Vec<u8> {
    let mut parts = text.split('\\');
    let mut bytes = parts.next().unwrap_or_default().as_bytes().to_vec();
    for part in parts {
        let (escape, plain) = match part.as_bytes().first() {
            Some(b'x') => part.split_at(3),
            _ => part.split_at(1),
        };
        bytes.push(match escape {
            "t" => b'\t',
            "n" => b'\n',
            "r" => b'\r',
            _ => u8::from_str_radix(&escape[1..], 16).expect("an escape like \\x80"),
        });
        bytes.extend(plain.bytes());
    }
    bytes
}

fn answer(line: &[u8]) -> String {
    match parse(line) {
        Ok(block) => block.to_string(),
        Err(error) => format!("error: {error}"),
    }
}

#[test]
fn every_line_is_read_as_written_below_it() {
    let mut lines = LINES
        .lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'));
    let mut count = 0;
    while let Some(line) = lines.next() {
        let line = line.strip_prefix("< ").expect("a line of G-code");
        let expected = lines
            .next()
            .and_then(|line| line.strip_prefix('>'))
            .expect("what is read");
        assert_eq!(answer(&unescape(line)), expected.trim_start(), "{line}");
        count += 1;
    }
    assert!(count >= 30, "only {count} lines: has the file lost some?");
}
