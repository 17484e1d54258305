//! Region 0: from the bytes of a line to its words.
#![no_std]
#![no_main]

use core::hint::black_box;
use icount_firmware::{count, done};
use leadscrew_gcode::{words, Number};

const LINE: &[u8] = b"G1X12.345Y-6.789F1500";

/// Reads every word. The black box keeps the compiler from leaving out their values.
#[inline(never)]
fn read(line: &[u8]) -> Option<Number> {
    let mut last = None;
    for word in words(line) {
        last = Some(black_box(word.ok()?).value());
    }
    last
}

#[cortex_m_rt::entry]
fn main() -> ! {
    for _ in 0..8 {
        let last = count::<0, _>(|| read(black_box(LINE)));
        assert_eq!(last, Some(Number::from_int(1500)));
    }
    done()
}
