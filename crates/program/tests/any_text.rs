//! Any text comes to an end without a panic, within the lines it was given.

use leadscrew_program::{is_program, Calculator, Error, ErrorKind, Program, Step, Value, World};
use proptest::prelude::*;

/// Pieces of programs: in random order they reach farther than random bytes.
const PIECES: [&str; 64] = [
    "o1",
    "o2",
    "o<a>",
    " sub",
    " endsub",
    " call",
    " return",
    " if",
    " elseif",
    " else",
    " endif",
    " while",
    " endwhile",
    " do",
    " repeat",
    " endrepeat",
    " break",
    " continue",
    "[",
    "]",
    "#1",
    "#<a>",
    "#<_b>",
    "#5063",
    "=",
    "\n",
    "\n",
    "\n",
    "\r\n",
    "+",
    "-",
    "*",
    "/",
    "**",
    " MOD ",
    " EQ ",
    " AND ",
    "ATAN",
    "EXISTS",
    "SQRT",
    "LN",
    "EXP",
    "TAN",
    "FIX",
    "ROUND",
    "0",
    "1",
    "2.5",
    "99999999999999999999",
    ".",
    "X",
    "G1",
    "M98 P1",
    " L2",
    "M99",
    "G65 P2 A1",
    "M2",
    "(",
    ")",
    ";",
    "#",
    "<",
    "%",
    "/N5 ",
];

/// Knows one number for everything.
struct All;

impl World for All {
    fn read(&self, _: leadscrew_program::Item) -> Option<Value> {
        Some(Value::from_int(-3))
    }
}

/// Runs a text; returns its error, if it has one.
fn end(text: &[u8]) -> Option<Error> {
    let mut text = text;
    let mut program = Program::<4, 4, 8, 4, 64>::new(500);
    for _ in 0..600 {
        match program.step(&mut text, &All) {
            Ok(Step::Line(line)) => assert!(line.len() <= 64),
            Ok(Step::Branch(_) | Step::Busy) => {}
            Ok(Step::End) => return None,
            Err(error) => return Some(error),
        }
    }
    panic!("more steps than lines");
}

fn check(text: &[u8]) {
    let error = end(text);
    if let Some(error) = error {
        let lines = text.split(|byte| matches!(byte, b'\n' | b'\r')).count();
        assert!((1..=lines).contains(&(error.line as usize)), "{error}");
        assert!(error.column <= text.len(), "{error}");
    }
    let mut calculator = Calculator::<8, 4>::new();
    let mut plain = heapless::Vec::<u8, 64>::new();
    for line in text.split(|byte| *byte == b'\n') {
        is_program(line);
        match calculator.line(line, &All, &mut plain) {
            Ok(()) => calculator.keep(),
            Err(error) => assert!(error.column <= line.len(), "{error}"),
        }
    }
}

proptest! {
    #[test]
    fn pieces_of_programs_come_to_an_end(pieces in prop::collection::vec(0..PIECES.len(), 0..60)) {
        let text: String = pieces.iter().map(|piece| PIECES[*piece]).collect();
        check(text.as_bytes());
    }

    #[test]
    fn bytes_come_to_an_end(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        check(&bytes);
    }
}

#[test]
fn a_loop_without_an_end_is_ended_by_the_limit() {
    let error = end(b"o1 while [1]\nG4 P0\no1 endwhile\n").unwrap();
    assert_eq!(error.kind, ErrorKind::Endless);
}
