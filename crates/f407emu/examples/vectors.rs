//! Carries out the test cases that `oracle/difftest.py` makes, and writes the state after each.
//!
//! `vectors FOLDER` reads `ram.bin` (32 KB) and `in.bin`, writes `out.bin`. A case is 52 words: r0
//! to r14, flags, s0 to s31, FPSCR, two words of code, the count of instructions. A result:
//! outcome, r0 to r14, PC, flags, s0 to s31, FPSCR, checksum of the RAM.
use leadscrew_f407emu::oracle::{Bench, Outcome, State, RAM};
use std::{env, error::Error, fs, path::Path};

const WORDS: usize = 52;
/// The bits of FPSCR that are compared: the cumulative flags are not modelled.
const FPSCR_COMPARED: u32 = 0xF7C0_0000;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = env::args().nth(1).ok_or("usage: vectors FOLDER")?;
    let folder = Path::new(&folder);
    let ram = fs::read(folder.join("ram.bin"))?;
    let cases = fs::read(folder.join("in.bin"))?;
    let mut bench = Bench::new();
    let mut results = Vec::new();
    for case in cases.chunks_exact(4 * WORDS) {
        bench.ram().copy_from_slice(&ram[..RAM]);
        for word in result(&mut bench, case) {
            results.extend(word.to_le_bytes());
        }
    }
    fs::write(folder.join("out.bin"), results)?;
    Ok(())
}

fn result(bench: &mut Bench, case: &[u8]) -> Vec<u32> {
    let words: Vec<u32> = case.chunks_exact(4).map(word).collect();
    let mut state = State {
        r: std::array::from_fn(|index| words[index]),
        apsr: words[15],
        s: std::array::from_fn(|index| words[16 + index]),
        fpscr: words[48],
        pc: 0,
    };
    let code = std::array::from_fn(|index| case[4 * 49 + index]);
    let outcome = match bench.run(code, words[51], &mut state) {
        Outcome::Done => 0,
        Outcome::Undefined => 1,
        Outcome::Fault => 2,
    };
    let mut result = vec![outcome];
    result.extend(state.r);
    result.extend([state.pc, state.apsr]);
    result.extend(state.s);
    result.extend([state.fpscr & FPSCR_COMPARED, checksum(bench.ram())]);
    result
}

fn word(bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .rev()
        .fold(0, |word, &byte| word << 8 | u32::from(byte))
}

/// CRC-32 as in zlib.
fn checksum(bytes: &[u8]) -> u32 {
    const POLYNOMIAL: u32 = 0xEDB8_8320;
    let table: [u32; 256] = std::array::from_fn(|index| {
        (0..8).fold(index as u32, |crc, _| {
            crc >> 1 ^ if crc & 1 != 0 { POLYNOMIAL } else { 0 }
        })
    });
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        table[(crc as u8 ^ byte) as usize] ^ crc >> 8
    })
}
