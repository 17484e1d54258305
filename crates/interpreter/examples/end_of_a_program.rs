//! Prints where a program on standard input ends and which modes it leaves behind, or its first
//! fault.
//!
//! ```text
//! $ printf 'G20G0X1Y2\nG91G1X0.5F10\n' | cargo run -p leadscrew-interpreter --example end_of_a_program
//! X38.1 Y50.8 Z0
//! G1 G54 G17 G20 G91 G94 M5 M9
//! ```
//!
//! The lines have to be without blanks and comments, in capitals.

use leadscrew_gcode::Number;
use leadscrew_interpreter::{
    ArcMismatch, AxisKind, Commands, Context, Dialect, Extent, Fault, Interpreter, OwnCodes,
    ToolTable, MAX_WORD,
};
use std::io;

fn main() -> io::Result<()> {
    let mut interpreter = Interpreter::<3>::new();
    for (index, line) in io::stdin().lines().enumerate() {
        if let Err(fault) = carry_out(&mut interpreter, line?.as_bytes()) {
            println!("line {}, {fault}", index + 1);
            return Ok(());
        }
    }
    let place = interpreter.position();
    let [x, y, z] = place.map(|of| Number::from_nanos(of.nanos()));
    println!("X{x} Y{y} Z{z}\n{}", interpreter.modal());
    Ok(())
}

/// Carries a line out on a machine with three axes that speaks Grbl's own words.
fn carry_out(interpreter: &mut Interpreter<3>, line: &[u8]) -> Result<(), Fault> {
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
    let extent = interpreter.interpret(line, &context, &mut Commands::new())?;
    assert_eq!(extent, Extent::Whole);
    Ok(())
}
