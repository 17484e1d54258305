//! Reads G-code: one line of text in, its words with exact decimal values out.
//!
//! The crate knows the *spelling* of G-code, not its meaning: there are no units, axes or modal
//! groups here, and any letter may carry any number, any number of times. It allocates nothing and
//! fits a microcontroller.
//!
//! # The grammar
//!
//! ```text
//! line     = [ "/" ] { word } [ "*" checksum ]
//!          | "%"
//! word     = letter number
//! letter   = "A" … "Z" | "a" … "z"
//! number   = [ "+" | "-" ] ( digits [ "." [ digits ] ] | "." digits )
//! checksum = 0 … 255, the exclusive or of all bytes before the "*"
//! gap      = { blank | "(" any text [ ")" ] | ";" any text up to the end of the line }
//! ```
//!
//! A gap may stand anywhere, even inside a number, and means nothing: `G0 X1 0` is `G0X10`. A blank
//! is every byte up to 0x20 but CR and LF. Comments do not nest: inside `( )` a `;` is text, and
//! after a `;` a `(` is text. A `(` left open lasts to the end of the line. There are no exponents:
//! `X1E2` is the words `X1` and `E2`. A number beyond the range of [`Number`] is read as the end of
//! that range, [`Number::MAX`] or its negative. The caller decides whether a letter takes such a
//! number.
//!
//! A line comes without its line end. Not even a comment swallows a CR or LF: two lines passed as
//! one are an error, and never a silently forgotten second line.
//!
//! The letters, numbers and comments are those of RS274/NGC (Kramer, Proctor, Messina: "The NIST
//! RS274/NGC Interpreter, Version 3", NISTIR 6556, section 3.3); `;` comments and checksums are the
//! custom of later machines.
//!
//! # Two ways in
//!
//! - [`words`] hands out one word after the other and costs no more than reading them. A machine
//!   checks each word before it asks for the next, so that of two faults on a line the left one is
//!   reported.
//! - [`parse`] collects the whole line in a [`Block`] with its line number, block delete, checksum
//!   and demarcation.
//!
//! ```
//! use leadscrew_gcode::{parse, words, ErrorKind, Letter, Number};
//!
//! let block = parse(b"N20 g1 x-12.345 (to the edge) F1500").unwrap();
//! assert_eq!(block.line_number(), Some(Number::from_int(20)));
//! assert_eq!(block.words()[2].letter(), Letter::X);
//! assert_eq!(block.words()[2].value(), Number::from_nanos(-12_345_000_000));
//! assert_eq!(block.to_string(), "N20 G1 X-12.345 F1500");
//!
//! let error = words(b"G1 X1.2.3").find_map(Result::err).unwrap();
//! assert_eq!((error.kind, error.column), (ErrorKind::UnexpectedByte(b'.'), 7));
//! ```
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

mod block;
mod error;
mod line;
mod word;

pub use block::{parse, Block, DEFAULT_WORDS};
pub use error::{Error, ErrorKind};
pub use line::{leading_number, words, Words};
pub use word::{Letter, Number, Word};

/// The examples of the package's README, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
