//! Sorts the bytes on standard input as a machine does: prints the lines, and the realtime commands
//! among them.
//!
//! ```text
//! $ printf 'g1 x1? (cut)\n$J=X1F100\n!' | cargo run -p leadscrew-protocol --example sort_bytes
//! Report
//! line: G1X1
//! line: $J=X1F100
//! Hold
//! ```

use leadscrew_protocol::line_reader::{LineReader, GRBL_LINE_LENGTH};
use leadscrew_protocol::realtime::{Byte, Sorter};
use std::io::{self, Read};

fn main() -> io::Result<()> {
    let mut reader = LineReader::<{ GRBL_LINE_LENGTH }>::new(GRBL_LINE_LENGTH);
    let mut sorter = Sorter::new();
    for byte in io::stdin().lock().bytes() {
        match sorter.sort(byte?) {
            Byte::Realtime(command) => println!("{command:?}"),
            Byte::Ordinary(byte) => {
                if reader.push(byte) {
                    match reader.line() {
                        Ok(line) => println!("line: {}", line.escape_ascii()),
                        Err(status) => println!("error:{} {status}", status.number()),
                    }
                    reader.clear();
                }
            }
            Byte::Unknown => println!("a byte that means nothing"),
        }
    }
    Ok(())
}
