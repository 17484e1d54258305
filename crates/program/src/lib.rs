//! Runs programs in G-code: parameters, expressions, O words and subprograms, as LinuxCNC has them.
//! A program's text comes in, plain lines come out, which any interpreter of G-code reads.
//!
//! ```text
//!   o100 while [#1 LT 3]        Program::step            G1 X0 F300
//!     G1 X[#1 * 10] F300    ----------------------->     G1 X10 F300
//!     #1 = [#1 + 1]          World: positions, probe     G1 X20 F300
//!   o100 endwhile            Texts: other files
//! ```
//!
//! # The grammar
//!
//! Blanks and comments stand anywhere and mean nothing; small letters are capitals.
//!
//! ```text
//! line       = [ "/" ] [ "N" digits ] ( flow | { word | assignment } )
//! word       = letter value
//! assignment = parameter "=" value
//! value      = [ "+" | "-" ] value | decimal | parameter | "[" expression "]" | function
//! parameter  = "#" value | "#<" name ">"
//! expression = value { operator value }
//! function   = "ATAN[" expression "]/[" expression "]" | "EXISTS[" parameter "]"
//!            | ( "ABS" | "ACOS" | "ASIN" | "COS" | "EXP" | "FIX" | "FUP" | "LN" | "ROUND" | "SIN"
//!            |   "SQRT" | "TAN" ) "[" expression "]"
//! operator   = "**" | "*" | "/" | "MOD" | "+" | "-"          strongest first: ** · * / MOD · + -
//!            | "EQ" | "NE" | "GT" | "GE" | "LT" | "LE"       · comparisons
//!            | "AND" | "OR" | "XOR"                          · logic; equals from left to right
//! flow       = "O" ( digits | "<" name ">" | "#" … | "[" … ) keyword
//! keyword    = "sub" | ( "endsub" | "return" ) [ "[" expression "]" ] | "call" { "[" expression "]" }
//!            | ( "if" | "elseif" | "while" | "repeat" ) "[" expression "]"
//!            | "else" | "endif" | "endwhile" | "do" | "endrepeat" | "break" | "continue"
//! ```
//!
//! `M98 P L`, `M99`, `G65 P` with letters as arguments, and `O100` alone on its line are the same
//! things as Fanuc spells them. An assignment counts from the next line on.
//!
//! # Numbers
//!
//! A [`Value`] is a decimal with 18 places, calculated with integers alone. Functions give 12
//! places, comparisons see 12, EQ and NE take numbers for equal that differ by less than 0.0001, as
//! LinuxCNC does. A word that was calculated is written with six places.
//!
//! # Bounds
//!
//! A [`Program`] allocates nothing; its five sizes are constants of its type. Each
//! [`step`](Program::step) reads one line and returns, so that a reset acts at any time, and a
//! program ends with an error after a number of lines that its owner sets.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

mod calculator;
mod call;
mod cursor;
mod expression;
mod fault;
mod flow;
mod frames;
mod functions;
mod head;
mod label;
#[cfg(feature = "machine")]
mod machine;
mod numbered;
mod parameters;
mod plain;
mod program;
mod recognise;
mod texts;
mod value;
mod world;

pub use calculator::Calculator;
pub use fault::{Error, ErrorKind, Expected, Math};
pub use label::{Label, Name, NAME_LENGTH};
#[cfg(feature = "machine")]
pub use machine::{Expressions, ERRORS};
pub use program::{Program, Step};
pub use recognise::is_program;
pub use texts::Texts;
pub use value::Value;
pub use world::{Item, World};

/// The examples of the package's README, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
