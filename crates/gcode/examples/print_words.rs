//! Prints the words of G-code lines from standard input, or a caret under the fault.
//!
//! ```text
//! $ printf 'g1 x10 (cut) f600\nG1 X1.2.3\n' | cargo run -p leadscrew-gcode --example print_words
//! 1: G1 X10 F600
//! 2: G1 X1.2.3
//!           ^ column 8: expected a letter, found `.`
//! ```

use std::io::{self, BufRead};

use leadscrew_gcode::{words, Error, Word};

fn main() -> io::Result<()> {
    for (index, line) in io::stdin().lock().split(b'\n').enumerate() {
        print(index + 1, line?.trim_ascii_end());
    }
    Ok(())
}

fn print(number: usize, line: &[u8]) {
    match words(line).collect::<Result<Vec<Word>, Error>>() {
        Ok(words) => {
            let words: Vec<String> = words.iter().map(Word::to_string).collect();
            println!("{number}: {}", words.join(" "));
        }
        Err(error) => {
            let before = format!("{number}: {}", line[..error.column].escape_ascii());
            println!("{before}{}", line[error.column..].escape_ascii());
            println!("{:1$}^ {error}", "", before.len());
        }
    }
}
