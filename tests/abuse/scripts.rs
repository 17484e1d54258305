//! Scripts that are likely to find faults. Each sets modes, does some work, interrupts it at any
//! moment, and leads back. Some scripts are cut or garbled.
//!
//! ```text
//!   build | modes  work ... | moment  interruption  moment  way back | the next episode ...     then cuts
//! ```
//!
//! Random bytes light, hold and park a laser in one of ten thousand scripts; these episodes do so
//! in one of ten.

use proptest::prelude::*;
use proptest::sample::select;
use std::ops::Range;

type Bytes = Vec<u8>;

/// Commands to the spindle, or to the laser.
const TOOLS: &[&[u8]] = &[
    b"$32=1\nM3S500G1F3000\n",
    b"$32=1\nM3S500G1F3000\n",
    b"$32=1\nM4S800G1F3000\n",
    b"$32=1\nM4S800G1F3000\n",
    b"$32=0\nM3S500G1F3000\n",
    b"M4S1000\n",
    b"M3\n",
    b"M5\n",
    b"G1F1000\n",
];

/// Other lasting words.
const MODES: &[&[u8]] = &[
    b"G91\n",
    b"G93\n",
    // Below the parking position of Z.
    b"G0Z-8\n",
    b"G0Z-8\n",
    b"M7\n",
    b"M8\n",
    b"M8\n",
    b"M56P0\n",
    b"$1=255\n",
    b"$3=5\n",
    b"$21=1\n",
    b"$31=100\n",
    b"$700=1\n",
    b"$703=500\n",
    b"$N0=M3S300G1F500X1\n",
    b"$H\n",
];

/// Motion. Soft limits begin at 0, the place of a machine that is not homed, so most moves go in
/// the negative direction.
const MOTION: &[&[u8]] = &[
    b"G1X-5Y-2F3000S500\n",
    b"G1X-2F600\n",
    b"G1X-4S900\nX-1S100\n",
    b"X-1Y-1\r\n",
    b"G0X-3\n",
    b"G0Z-2\n",
    b"G91G1Z-2F1000\nG90\n",
    b"G2X-2Y-2I-1J-1F2000\n",
    b"G93G2X-2Y-2I-1J-1F60\nG94\n",
    b"G1X-1S100\nX-1.1S200\nX-1.2S0\nX-1.3S900\nG0X-1.6S0\nG1X-1.8S300\nS0\n",
    b"G1X-2S800\nG0X-4\nG1X-6\nG0X-8\nG1X0\n",
    b"G1X-0.001\n",
    b"G28\n",
    b"G91G99G83X-1Z-2R-0.5Q0.3L3F3000\nG90\n",
    b"G81X-2Z-3R-1F2000\nY-1\nX-3L2\nG80\n",
    b"G18G98G86X-1Y-2R0P0.03F3000\nX-2M0\nG17G0\n",
    b"G89Z-2R-1P0.02F3000\nG73Z-3R-1Q0.05\nG85X-3R-2Z-4\nG1\n",
    b"G38.2Z-5F500\n",
    b"G38.3Z-2F1000\n",
    b"$J=G91X-5F3000\n",
    b"$J=G91X-2F3000\n$J=G91Y-2F3000\n$J=G91X1F3000\n",
    b"$H\n",
    b"G1X5Y2F3000\n",
    b"G1X500F6000\n",
];

/// Lines between motions.
const WORDS: &[&[u8]] = &[
    b"S0\n",
    b"S800\n",
    b"G0\n",
    b"G1\n",
    b"M3\n",
    b"M4\n",
    b"M5\n",
    b"M8\n",
    b"M9\n",
    b"G4P0.05\n",
    b"M0\n",
    b"M2\n",
    b"M30\n",
    b"%\n",
    b"M6T1\n",
    b"G92X1\n",
    b"G10L2P1X1\n",
    b"G43.1Z1\n",
    b"$C\n",
    b"$SLP\n",
    b"$$\n",
    b"$#\n",
    b"$G\n",
    b"$I\n",
    b"$RST=*\n",
    b"$RST=$\n",
    b"$32=1\n",
    b"$32=0\n",
    b"G77\n",
    b"G99\n",
    b"G80\n",
    b"G81R1L0\n",
    b"(a comment",
];

/// Interruptions, each with the bytes that undo it. Time passes between the two.
const INTERRUPTIONS: &[(&[u8], &[u8])] = &[
    (b"!", b"~"),
    (b"\x84", b"~"),
    (b"\xE7", b"\xE7~"),
    (b"\xE7", b"\xE7\xF0~\xF6\xE7\xF4\xE7~"),
    (b"\x85", b""),
    (b"\x18", b"$X\n"),
    (b"!\xF5\x9E", b"~"),
    (b"!\xF5\x9E", b"\x9E\xF2~"),
    (b"!\xF5\x84", b"~"),
    (b"\x84\xF5!", b"~"),
    (b"!\xF6", b"\x18"),
    (b"\xA0", b""),
    (b"\xA1", b""),
    (b"\x90\x91\x99\x9A\x97", b""),
    (b"\x95\x9A", b""),
    (b"\xE0", b"\xE0\x18$X\n"),
    (b"\xE2", b"\xE2"),
    (b"\xE3", b"\xE3"),
    (b"\xE4", b"\xE4$X\n"),
    (b"\xE5", b"\xE5\xE6\xE6"),
    (b"?", b"~"),
];

fn one_of(from: &'static [&'static [u8]]) -> impl Strategy<Value = Bytes> {
    select(from).prop_map(<[u8]>::to_vec)
}

fn some_of(from: &'static [&'static [u8]], count: Range<usize>) -> impl Strategy<Value = Bytes> {
    prop::collection::vec(one_of(from), count).prop_map(|all| all.concat())
}

/// A wait: no bytes or up to three, each of which lets 1, 2, 4 … 128 ms pass.
fn moment() -> impl Strategy<Value = Bytes> {
    prop::collection::vec(0xF0..=0xF7u8, 0..4)
}

/// An interruption, followed by the bytes that undo it, by the bytes that undo another
/// interruption, or by neither.
fn interruption() -> impl Strategy<Value = Bytes> {
    let pair = || select(INTERRUPTIONS);
    (pair(), pair(), moment(), 0..8u8).prop_map(|(this, other, time, which)| {
        let back = match which {
            0 => b"",
            1 => other.1,
            _ => this.1,
        };
        [this.0, &time, back].concat()
    })
}

fn episode() -> impl Strategy<Value = Bytes> {
    let work = prop_oneof![2 => one_of(MOTION), 1 => one_of(WORDS)];
    let work = prop::collection::vec(work, 1..5).prop_map(|all| all.concat());
    let interruptions = prop::collection::vec((interruption(), moment()), 0..3).prop_map(|all| {
        all.into_iter()
            .flat_map(|(what, then)| [what, then].concat())
            .collect()
    });
    (
        some_of(TOOLS, 0..2),
        some_of(MODES, 0..3),
        work,
        moment(),
        interruptions,
    )
        .prop_map(|(tool, modes, work, time, what): (_, _, _, _, Bytes)| {
            [tool, modes, work, time, what].concat()
        })
}

/// Bytes that no sender intends: any bytes, a change of line, a change of an input.
fn noise() -> impl Strategy<Value = Bytes> {
    prop_oneof![
        prop::collection::vec(any::<u8>(), 0..8),
        Just(vec![0xFF]),
        (0xE0..=0xE7u8).prop_map(|byte| vec![byte]),
        some_of(WORDS, 0..8),
    ]
}

/// Takes out at most `length` bytes at `place`.
fn cut(script: &mut Bytes, place: prop::sample::Index, length: usize) {
    let from = place.index(script.len() + 1);
    let to = script.len().min(from + length);
    script.drain(from..to);
}

/// A script for [`leadscrew_tests::abuse::endure`].
pub(crate) fn script() -> impl Strategy<Value = Bytes> {
    let phrase = prop_oneof![6 => episode(), 1 => noise()];
    let cuts = prop::collection::vec((any::<prop::sample::Index>(), 1..16usize), 0..3);
    (0..0x40u8, prop::collection::vec(phrase, 0..6), cuts).prop_map(|(build, phrases, cuts)| {
        let mut script = phrases.concat();
        for (place, length) in cuts {
            cut(&mut script, place, length);
        }
        script.insert(0, build);
        script
    })
}
