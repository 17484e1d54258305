//! Runs any text as a program, and sends its lines as a sender does: nothing panics or hangs, and
//! an error names a place in the text.
#![no_main]

use leadscrew_program::{is_program, Calculator, Item, Program, Step, Value, World};
use libfuzzer_sys::fuzz_target;

/// Lines that a program may run. After as many it is ended.
const MOST: u64 = 500;

/// Knows one number for everything.
struct All;

impl World for All {
    fn read(&self, _: Item) -> Option<Value> {
        Some(Value::from_int(-3))
    }
}

fuzz_target!(|text: &[u8]| {
    let mut rest = text;
    let mut program = Program::<4, 4, 8, 4, 64>::new(MOST);
    let mut steps = 0;
    let error = loop {
        steps += 1;
        assert!(steps <= MOST + 100, "it hangs");
        match program.step(&mut rest, &All) {
            Ok(Step::Line(line)) => assert!(line.len() <= 64),
            Ok(Step::Branch(_) | Step::Busy) => {}
            Ok(Step::End) => break None,
            Err(error) => break Some(error),
        }
    };
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
});
