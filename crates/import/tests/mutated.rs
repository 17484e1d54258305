//! Tests with damaged files. Each hole of a file is either read or reported as a fault, and a job
//! has as many holes as were read.

use leadscrew_import::drill::{jobs, Options, Speeds};
use leadscrew_import::excellon::{read_all, Drawing, Known, Shape};
use leadscrew_import::{align, print, rows, rp, Mm};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The number of damaged files.
const FILES: u64 = 10_000;

/// All files that other tests read undamaged: the project's own and the supplied ones.
fn originals() -> Vec<String> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = [here.join("tests/drl"), here.join("../../examples/sources")];
    let files = folders
        .iter()
        .flat_map(|folder| fs::read_dir(folder).unwrap());
    let mut paths: Vec<PathBuf> = files.map(|file| file.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|end| end == "drl"));
    paths.sort();
    assert!(paths.len() >= 15 + 3);
    paths
        .iter()
        .map(|path| fs::read_to_string(path).unwrap())
        .collect()
}

/// Marsaglia's xorshift, which gives the same files in each run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit.max(1) as u64) as usize
    }

    /// A file with one to three kinds of damage.
    fn damaged(&mut self, original: &str) -> String {
        let mut text = original.to_owned();
        for _ in 0..=self.below(3) {
            text = match self.below(8) {
                0..=4 => self.byte(&text),
                _ => self.line(&text),
            };
        }
        text
    }

    fn byte(&mut self, text: &str) -> String {
        const OTHERS: &[u8] = b"XYGMTRCFSIJAN0123456789.-+;%,( \n\rLZ";
        let mut bytes = text.as_bytes().to_vec();
        if bytes.is_empty() {
            return String::new();
        }
        let (at, other) = (self.below(bytes.len()), OTHERS[self.below(OTHERS.len())]);
        let mirrored = bytes.len() - 1 - at;
        match self.below(4) {
            0 => drop(bytes.remove(at)),
            1 => bytes.insert(at, other),
            2 => bytes[at] = other,
            _ => bytes.swap(at, mirrored),
        }
        String::from_utf8(bytes).unwrap()
    }

    fn line(&mut self, text: &str) -> String {
        let mut lines: Vec<&str> = text.split('\n').collect();
        let (at, other) = (self.below(lines.len()), self.below(lines.len()));
        match self.below(5) {
            0 => drop(lines.remove(at)),
            1 => lines.insert(at, lines[other]),
            2 => lines.swap(at, other),
            3 => lines.truncate(at + 1),
            _ => return lines[..at].join("\n") + &lines[at..].join("\n"),
        }
        lines.join("\n")
    }
}

/// The routing state left by the lines so far.
#[derive(Default)]
struct Mode {
    is_routing: bool,
    is_down: bool,
}

/// Returns how many holes a line asks for, judged by its letters alone. A coordinate is a hole, and
/// `R6` is six. While routing, lifting the tool ends a shape, and so does the end of the program.
/// Units, formats, tools and headers are ignored.
fn asked(line: &str, mode: &mut Mode) -> u64 {
    let line = line.split(';').next().unwrap().trim().to_ascii_uppercase();
    if line.starts_with('(') || line.contains(',') {
        return 0;
    }
    let letters = line.char_indices().filter(|(_, c)| c.is_ascii_alphabetic());
    let mut count = 0;
    for (at, letter) in letters {
        let digits = line[at + 1..]
            .trim_start()
            .chars()
            .take_while(char::is_ascii_digit);
        let number: Option<u64> = digits.collect::<String>().parse().ok();
        match (letter, number) {
            ('G', Some(0)) => mode.is_routing = true,
            ('G', Some(5 | 81)) => mode.is_routing = false,
            ('G', Some(92 | 93)) => return count,
            ('M', Some(15)) => mode.is_down = true,
            ('M', Some(16 | 17 | 30 | 0)) if mode.is_down => {
                mode.is_down = false;
                count += 1;
            }
            ('R', Some(times)) if !mode.is_routing => return count + times,
            ('X' | 'Y', _) if !mode.is_routing => return count + 1,
            ('X' | 'Y', _) => return count,
            _ => {}
        }
    }
    count
}

/// Reads a file, and compares the holes of each line with [`asked`].
fn compare(text: &str) -> (Drawing, usize) {
    let (drawing, faults) = read_all(text, &Known::default());
    let mut made = BTreeMap::<u32, u64>::new();
    for hit in &drawing.hits {
        *made.entry(hit.line).or_default() += 1;
    }
    let refused: BTreeSet<u32> = faults.0.iter().map(|fault| fault.line).collect();
    let mut mode = Mode::default();
    for (number, line) in (1..).zip(text.lines()) {
        let holes = made.remove(&number).unwrap_or(0);
        if refused.contains(&number) {
            // A correct last line may be reported as a fault, because the end of the file after it
            // is missing.
            assert!(
                holes == 0 || number as usize == text.lines().count(),
                "{line:?} in\n{text}"
            );
            continue;
        }
        assert_eq!(
            holes,
            asked(line, &mut mode),
            "line {number}, {line:?} in\n{text}"
        );
    }
    assert!(made.is_empty());
    (drawing, faults.0.len())
}

fn mm(text: &str) -> Mm {
    text.parse().unwrap()
}

/// The number of holes in the job of a drawing, by their line numbers.
fn drilled(drawing: Drawing) -> usize {
    let options = Options {
        depth: mm("-1.8"),
        clearance: mm("2"),
        feed: mm("100"),
        mill_feed: None,
        peck: Some(mm("1")),
        tool_feeds: true,
        spindle: None,
        mirror: None,
        from_corner: true,
        bits: Vec::new(),
        mills_slots: true,
        job_a_bit: false,
        cycles: false,
    };
    let speeds = Speeds {
        rates: [328.0; 3],
        accelerations: [50.0; 3],
        spindle: 1000.0,
    };
    let jobs = jobs(&[drawing], &options, &speeds).unwrap();
    let numbers = jobs[0]
        .job
        .lines
        .iter()
        .filter_map(|line| line.strip_prefix('N'));
    let numbers: BTreeSet<usize> = numbers
        .map(|line| line.split(' ').next().unwrap().parse().unwrap())
        .collect();
    assert_eq!(numbers.last().copied(), Some(numbers.len()));
    numbers.len()
}

/// The number of shapes that are not one in the place of another, by one bit.
fn places(drawing: &Drawing) -> usize {
    let places = drawing.hits.iter().map(|hit| {
        let bit = match drawing.tools[&hit.tool].diameter {
            Some(diameter) => format!("{diameter} mm"),
            None => format!("T{}", hit.tool),
        };
        let mut ends = [hit.shape.from(), hit.shape.to()].map(|end| format!("{} {}", end.x, end.y));
        ends.sort();
        let path = match &hit.shape {
            Shape::Hole(_) | Shape::Slot { .. } => String::new(),
            Shape::Route(route) => format!("{route:?}"),
        };
        (bit, ends, matches!(hit.shape, Shape::Hole(_)), path)
    });
    places.collect::<BTreeSet<_>>().len()
}

#[test]
fn each_hole_of_a_damaged_file_is_drilled_or_refused() {
    let originals = originals();
    for original in &originals {
        assert_eq!(compare(original).1, 0, "{original}");
    }
    let mut dice = Dice(0x5eed);
    let (mut whole, mut refused) = (0, 0);
    for _ in 0..FILES {
        let original = &originals[dice.below(originals.len())];
        let text = dice.damaged(original);
        let (drawing, faults) = compare(&text);
        if faults > 0 {
            refused += 1;
        } else if drawing.hits.len() < 300 && !drawing.hits.is_empty() {
            whole += 1;
            let holes = places(&drawing);
            assert_eq!(drilled(drawing), holes, "{text}");
        }
    }
    // Both kinds must have come up often, or the test shows nothing.
    assert!(
        whole > FILES / 10 && refused > FILES / 2,
        "{whole} {refused}"
    );
}

/// Text that resembles a file: letters, digits and marks of files in any order, and some that no
/// file has.
fn scrambled() -> impl Strategy<Value = String> {
    let piece = prop_oneof![
        "[XYZGMTRCFSIJAEN]-?[0-9]{0,7}(\\.[0-9]{0,4})?",
        Just("\n".to_owned()),
        Just("M48\nINCH,TZ\nT1C.1\n%\nT1\n".to_owned()),
        Just("RPcode.V.1.0.0\n".to_owned()),
        "\\PC{0,3}",
        "[ \t,;%()$]",
    ];
    proptest::collection::vec(piece, 0..60).prop_map(|pieces| pieces.concat())
}

proptest! {
    #[test]
    fn no_reader_is_upset_by_any_text(text in scrambled()) {
        let (drawing, _) = read_all(&text, &Known::default());
        prop_assert!(drawing.hits.len() <= 100_000);
        let part = rp::Options {
            feed: mm("1"), lift: mm("1"), on: String::new(), off: String::new(), is_incremental: true, nozzle: None, bed: None,
        };
        let _ = rp::job(&text, &part);
        let engraving = rows::Options {
            scale: mm("0.1"), feed: mm("1"), plunge: mm("1"), lift: mm("1"), spindle: 1, has_switches: false,
        };
        let _ = rows::job(&text, &engraving);
        let _ = print::job(&text, &print::Options::default());
        let pair = |nominal, measured| align::Pair { nominal, measured };
        let pairs = [pair([0.0, 0.0], [1.0, 2.0]), pair([9.0, 0.0], [9.0, 4.0])];
        let _ = align::job(&text, &align::Fit::new(&pairs, true).unwrap());
    }
}
