//! Prints what a machine would be told by the G-code on standard input: each line, and its
//! canonical commands below.
//!
//! ```text
//! $ printf 'G20 G1 X1 F10\nG2 X1\n' | cargo run -p leadscrew-machine --example print_commands
//! G20 G1 X1 F10
//!     FEED X25.4 Y0 Z0 F254
//! G2 X1
//! ^ error:35 The arc has no centre in its plane
//! ```
//!
//! `$J=` jogs and `$G` prints the modal state. Nothing is planned: there are no steps and no limits
//! here.

use leadscrew_machine::interpreter::{
    ArcMismatch, AxisKind, Commands, Context, Dialect, Fault, Interpreter, OwnCodes, ToolTable,
    MAX_WORD,
};
use leadscrew_machine::protocol::line_reader::{raw_column, LineReader, GRBL_LINE_LENGTH};
use std::io::{self, Read, Write};

fn main() -> io::Result<()> {
    let mut program = Vec::new();
    io::stdin().read_to_end(&mut program)?;
    io::stdout().write_all(print_commands(&program).as_bytes())
}

/// Prints the lines of a program and their commands, on a machine with three axes and all options.
pub(crate) fn print_commands(program: &[u8]) -> String {
    let mut interpreter = Interpreter::new();
    let mut printed = String::new();
    for raw in program.split(|byte| *byte == b'\n') {
        let raw = raw.trim_ascii_end();
        if !raw.is_empty() {
            printed += &format!("{}\n", raw.escape_ascii());
            printed += &answer(&mut interpreter, raw);
        }
    }
    printed
}

/// Carries out one line and prints its commands, or its fault.
fn answer(interpreter: &mut Interpreter<3>, raw: &[u8]) -> String {
    let dialect = Dialect {
        mist: true,
        parking_override: true,
        cycles: true,
        linuxcnc: true,
        tools: false,
    };
    let context = Context {
        axes: &[AxisKind::Linear; 3],
        dialect: &dialect,
        laser_mode: false,
        soft_limits: false,
        reach: &[MAX_WORD; 3],
        arcs: ArcMismatch::GRBL,
        own: OwnCodes::NONE,
        tools: ToolTable::NONE,
    };
    let mut reader = LineReader::<{ GRBL_LINE_LENGTH }>::new(GRBL_LINE_LENGTH);
    for byte in raw.iter().chain(b"\n") {
        reader.push(*byte);
    }
    let outcome = match reader.line() {
        Err(status) => Err(Fault { status, column: 0 }),
        Ok(b"$G") => Ok(vec![modal_words(interpreter)]),
        Ok(line) => match line.strip_prefix(b"$J=") {
            Some(words) => jog(interpreter, words, &context),
            None => carry_out(interpreter, line, &context),
        },
    };
    match outcome {
        Ok(commands) => commands
            .iter()
            .map(|line| format!("    {line}\n"))
            .collect(),
        Err(fault) => caret(raw, fault),
    }
}

fn carry_out(
    interpreter: &mut Interpreter<3>,
    line: &[u8],
    context: &Context<'_, 3>,
) -> Result<Vec<String>, Fault> {
    let mut commands = Commands::new();
    interpreter.interpret(line, context, &mut commands)?;
    Ok(commands.iter().map(ToString::to_string).collect())
}

fn jog(
    interpreter: &mut Interpreter<3>,
    words: &[u8],
    context: &Context<'_, 3>,
) -> Result<Vec<String>, Fault> {
    let jog = interpreter.jog(words, context).map_err(|fault| Fault {
        column: fault.column + "$J=".len(),
        ..fault
    })?;
    Ok(jog
        .into_iter()
        .map(|jog| {
            interpreter.set_position(jog.travel.target);
            format!("JOG{}", jog.travel)
        })
        .collect())
}

fn modal_words(interpreter: &Interpreter<3>) -> String {
    let modal = interpreter.modal();
    let (tool, feed, speed) = (modal.tool, modal.feed, modal.speed);
    format!("{modal} T{tool} F{feed} S{speed}")
}

fn caret(raw: &[u8], fault: Fault) -> String {
    let Fault { status, column } = fault;
    let column = raw_column(raw, column);
    format!("{:column$}^ error:{} {status}\n", "", status.number())
}
