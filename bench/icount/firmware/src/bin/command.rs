//! From the bytes of a line to a checked command; nothing is planned. Region 0: all of that work.
//! Region 1: the interpreter's part.
#![no_std]
#![no_main]

use core::hint::black_box;
use icount_firmware::{count, done};
use leadscrew_machine::{
    interpreter::{
        ArcMismatch, AxisKind, Commands, Context, Dialect, Interpreter, OwnCodes, ToolTable,
        MAX_WORD,
    },
    protocol::line_reader::{LineReader, GRBL_LINE_LENGTH},
};

const LINE: &[u8] = b"G1X12.345Y-6.789F1500\n";

type Reader = LineReader<{ GRBL_LINE_LENGTH }>;

/// The main loop's state from line to line.
struct Machine<'a> {
    reader: Reader,
    interpreter: Interpreter<3>,
    context: Context<'a, 3>,
    commands: Commands<3>,
}

/// Filters the bytes, then carries out the line. Returns whether it was accepted.
#[inline(never)]
fn receive(machine: &mut Machine<'_>, bytes: &[u8]) -> bool {
    for byte in bytes {
        machine.reader.push(*byte);
    }
    match machine.reader.line() {
        Ok(line) => count::<1, _>(|| {
            interpret(
                &mut machine.interpreter,
                line,
                &machine.context,
                &mut machine.commands,
            )
        }),
        Err(_) => false,
    }
}

#[inline(never)]
fn interpret(
    interpreter: &mut Interpreter<3>,
    line: &[u8],
    context: &Context<'_, 3>,
    commands: &mut Commands<3>,
) -> bool {
    interpreter.interpret(line, context, commands).is_ok()
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let context = Context {
        axes: &[AxisKind::Linear; 3],
        dialect: &Dialect::GRBL,
        laser_mode: false,
        soft_limits: false,
        reach: &[MAX_WORD; 3],
        arcs: ArcMismatch::GRBL,
        own: OwnCodes::NONE,
        tools: ToolTable::NONE,
    };
    let mut machine = Machine {
        reader: Reader::new(GRBL_LINE_LENGTH),
        interpreter: Interpreter::new(),
        context: black_box(context),
        commands: Commands::new(),
    };
    for _ in 0..8 {
        machine.reader = Reader::new(GRBL_LINE_LENGTH);
        let accepted = count::<0, _>(|| receive(&mut machine, black_box(LINE)));
        assert!(accepted && machine.commands.iter().count() == 1);
    }
    done()
}
