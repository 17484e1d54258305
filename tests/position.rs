//! Any program ends where exact arithmetic says, to the step.
//!
//! Beside the machine runs a [`Reference`] in whole 10⁻⁹ mm: positions, offsets and steps are sums
//! and products of decimals in `i128`, rounded once, at the end.

use leadscrew_planner::Cartesian;
use leadscrew_sim::Memory;
use leadscrew_tests::{run_program, setup, Session};
use proptest::prelude::*;
use std::fmt::Write;

/// One unit of the words below, which have four decimals, in 10⁻⁹ mm or inches.
const WORD: i128 = 100_000;

/// Odd scales, and high speeds so that the tests are quick.
const SETTINGS: &str = "$100=80.37\n$101=250.123\n$102=133.333\n$110=9000\n$111=9000\n$112=9000\n\
                        $120=2000\n$121=2000\n$122=2000\n";

/// The scales of [`SETTINGS`] in 10⁻⁹ steps/mm.
const SCALES: [i128; 3] = [80_370_000_000, 250_123_000_000, 133_333_000_000];

/// Values of the words X, Y, Z in units of 10⁻⁴; an axis may have none.
type Words = [Option<i32>; 3];

/// A line of a program.
#[derive(Clone, Debug)]
enum Line {
    Inches(bool),
    Relative(bool),
    /// G54 to G59.
    System(usize),
    Rapid(Words),
    Feed(Words, u16),
    /// G53 G0: machine coordinates.
    Machine(Words),
    G92(Words),
    /// G92.1
    ClearG92,
    /// G10 L2 P1 to P6.
    Origin(usize, Words),
    /// G10 L20 P1 to P6.
    OriginHere(usize, Words),
    Arc(Arc),
}

/// A relative arc in XY, with Z on the way.
#[derive(Clone, Copy, Debug)]
struct Arc {
    clockwise: bool,
    /// The words I and J.
    centre: [i32; 2],
    /// The number of quarter turns, 1 to 4.
    quarters: u8,
    z: Option<i32>,
    /// True if to write the radius instead of the centre; not for whole circles.
    by_radius: bool,
}

impl Arc {
    /// The vector from start to end: the vector from the centre to the start, turned by the number
    /// of quarters, less itself.
    fn travel(&self) -> [i32; 2] {
        let spoke = self.centre.map(|c| -c);
        let [mut x, mut y] = spoke;
        for _ in 0..self.quarters {
            (x, y) = if self.clockwise { (y, -x) } else { (-y, x) };
        }
        [x - spoke[0], y - spoke[1]]
    }

    /// A radius that is large enough: the sum of the sides is no less than the chord.
    fn radius(&self) -> Option<i32> {
        let [x, y] = self.travel();
        Some(x.abs() + y.abs()).filter(|radius| self.by_radius && *radius > 0)
    }
}

/// The state of a program, in exact arithmetic.
#[derive(Default)]
struct Reference {
    inches: bool,
    relative: bool,
    system: usize,
    position: [i128; 3],
    origins: [[i128; 3]; 6],
    g92: [i128; 3],
    text: String,
}

impl Reference {
    fn of(lines: &[Line]) -> Self {
        let mut reference = Self::default();
        for line in lines {
            reference.take(line);
        }
        reference
    }

    /// Steps of each motor: rounded half away from zero.
    fn steps(&self) -> [i64; 3] {
        const STEP: i128 = 1_000_000_000_000_000_000;
        std::array::from_fn(|axis| {
            let product = self.position[axis] * SCALES[axis];
            ((product.abs() + STEP / 2) / STEP * product.signum()) as i64
        })
    }

    fn take(&mut self, line: &Line) {
        match line {
            Line::Inches(inches) => {
                self.inches = *inches;
                self.print(if *inches { "G20" } else { "G21" }, &[None; 3]);
            }
            Line::Relative(relative) => {
                self.relative = *relative;
                self.print(if *relative { "G91" } else { "G90" }, &[None; 3]);
            }
            Line::System(system) => {
                self.system = *system;
                self.print(&format!("G{}", 54 + system), &[None; 3]);
            }
            Line::Rapid(words) => self.go("G0", words),
            Line::Feed(words, feed) => {
                let feed = if self.inches { feed / 25 } else { *feed };
                self.go(&format!("G1F{feed}"), words);
            }
            Line::Machine(words) => {
                self.print("G53G0", words);
                self.set(words, |_, word| word, |reference| &mut reference.position);
            }
            Line::G92(words) => {
                self.print("G92", words);
                let (position, origin) = (self.position, self.origins[self.system]);
                let offset = |axis: usize, word| position[axis] - origin[axis] - word;
                self.set(words, offset, |reference| &mut reference.g92);
            }
            Line::ClearG92 => {
                self.print("G92.1", &[None; 3]);
                self.g92 = [0; 3];
            }
            Line::Origin(system, words) => {
                self.print(&format!("G10L2P{}", system + 1), words);
                self.set(
                    words,
                    |_, word| word,
                    |reference| &mut reference.origins[*system],
                );
            }
            Line::OriginHere(system, words) => {
                self.print(&format!("G10L20P{}", system + 1), words);
                let (position, g92) = (self.position, self.g92);
                let offset = |axis: usize, word| position[axis] - g92[axis] - word;
                self.set(words, offset, |reference| &mut reference.origins[*system]);
            }
            Line::Arc(arc) => self.arc(arc),
        }
    }

    fn go(&mut self, code: &str, words: &Words) {
        self.print(code, words);
        let (from, origin, g92) = (self.position, self.origins[self.system], self.g92);
        let relative = self.relative;
        let target = |axis: usize, word| match relative {
            true => from[axis] + word,
            false => origin[axis] + g92[axis] + word,
        };
        self.set(words, target, |reference| &mut reference.position);
    }

    fn arc(&mut self, arc: &Arc) {
        self.relative = true;
        let turn = if arc.clockwise { 2 } else { 3 };
        let feed = if self.inches { 240 } else { 6000 };
        let way = match arc.radius() {
            Some(radius) => format!("R{}", decimal(radius)),
            None => format!("I{}J{}", decimal(arc.centre[0]), decimal(arc.centre[1])),
        };
        let [x, y] = arc.travel();
        self.go(
            &format!("G91G{turn}F{feed}{way}"),
            &[Some(x), Some(y), arc.z],
        );
    }

    /// Sets each value of `which` whose axis has a word to the result of `value`.
    fn set(
        &mut self,
        words: &Words,
        value: impl Fn(usize, i128) -> i128,
        which: impl FnOnce(&mut Self) -> &mut [i128; 3],
    ) {
        let inches = self.inches;
        for (axis, place) in which(self).iter_mut().enumerate() {
            if let Some(word) = words[axis] {
                let word = i128::from(word) * WORD;
                *place = value(axis, if inches { word * 254 / 10 } else { word });
            }
        }
    }

    fn print(&mut self, code: &str, words: &Words) {
        self.text.push_str(code);
        for (letter, word) in ['X', 'Y', 'Z'].into_iter().zip(words) {
            if let Some(word) = word {
                write!(self.text, "{letter}{}", decimal(*word)).unwrap();
            }
        }
        self.text.push('\n');
    }
}

/// A number in units of 10⁻⁴ as a decimal.
fn decimal(word: i32) -> String {
    let sign = if word < 0 { "-" } else { "" };
    let magnitude = word.unsigned_abs();
    format!("{sign}{}.{:04}", magnitude / 10_000, magnitude % 10_000)
}

/// Words from −5 to 5 units, at least one of them.
fn words() -> impl Strategy<Value = Words> {
    let word = || prop::option::of(-50_000i32..=50_000);
    [word(), word(), word()].prop_filter("no word", |words| words.iter().any(Option::is_some))
}

fn arc() -> impl Strategy<Value = Arc> {
    let spoke = || -20_000i32..=20_000;
    let z = prop::option::of(spoke());
    let centre = [spoke(), spoke()].prop_filter("no radius", |[i, j]| i.abs().max(j.abs()) > 100);
    (any::<bool>(), centre, 1..=4u8, z, any::<bool>()).prop_map(
        |(clockwise, centre, quarters, z, by_radius)| Arc {
            clockwise,
            centre,
            quarters,
            z,
            by_radius,
        },
    )
}

fn line() -> impl Strategy<Value = Line> {
    prop_oneof![
        1 => any::<bool>().prop_map(Line::Inches),
        2 => any::<bool>().prop_map(Line::Relative),
        1 => (0..6usize).prop_map(Line::System),
        3 => words().prop_map(Line::Rapid),
        8 => (words(), 600..6000u16).prop_map(|(words, feed)| Line::Feed(words, feed)),
        1 => words().prop_map(Line::Machine),
        1 => words().prop_map(Line::G92),
        1 => Just(Line::ClearG92),
        1 => (0..6usize, words()).prop_map(|(system, words)| Line::Origin(system, words)),
        1 => (0..6usize, words()).prop_map(|(system, words)| Line::OriginHere(system, words)),
        4 => arc().prop_map(Line::Arc),
    ]
}

proptest! {
    #[test]
    fn a_program_ends_where_exact_arithmetic_says(lines in prop::collection::vec(line(), 1..30)) {
        let reference = Reference::of(&lines);
        let run = run_program(SETTINGS, &reference.text);
        prop_assert_eq!(run.net_steps(), reference.steps(), "{}", reference.text);
    }
}

#[test]
fn thousands_of_relative_moves_end_where_their_sum_says() {
    const MOVES: usize = 4000;
    let program = "G91G1F6000\n".to_owned() + &"X0.1Y-0.1\n".repeat(MOVES);
    let run = run_program(SETTINGS, &program);
    let lines = vec![Line::Feed([Some(1000), Some(-1000), None], 6000); MOVES];
    let relative = [vec![Line::Relative(true)], lines].concat();
    assert_eq!(run.net_steps(), Reference::of(&relative).steps());
    assert_eq!(run.net_steps()[0], 32_148);
}

/// The text of `field` in a report.
fn reported(session: &mut Session<'_, Cartesian, 3>, field: &str) -> String {
    let heard = session.say("?\n");
    let report = heard.iter().find(|line| line.starts_with('<'));
    let report = report.expect("a report").trim_end_matches('>');
    let mut fields = report.split('|').filter_map(|of| of.strip_prefix(field));
    fields.next().expect(field).to_owned()
}

/// At X10 with 250 steps/mm the machine has counted 2500 steps, which would be 5 mm with 500
/// steps/mm.
#[test]
fn another_number_of_steps_in_a_millimetre_moves_nothing() {
    for (change, line, steps, place) in [
        ("$100=500\n", "G91G0X1\n", 500, "6.000,0.000,0.000"),
        ("$100=500\n", "$J=G91X1F500\n", 500, "6.000,0.000,0.000"),
        ("$100=500\n", "G0X10\n", 2500, "10.000,0.000,0.000"),
        ("$100=500\n", "G2X6Y1R1F500\n", 500, "6.000,1.000,0.000"),
        ("$100=125\n", "G91G0X1\n", 125, "21.000,0.000,0.000"),
        ("$100=125\n$RST=$\n", "G91G0X1\n", 250, "11.000,0.000,0.000"),
        ("$101=500\n", "G91G0X1\n", 250, "11.000,0.000,0.000"),
    ] {
        let setup = setup::<3>(1);
        let mut memory = Memory::new(&setup);
        let mut session = Session::new(&mut memory, &setup, Cartesian);
        session.say("$10=1\n");
        session.say("G0X10\n");
        session.until_quiet();
        session.stream(change);
        assert_eq!(session.sim.counted_position(), [2500, 0, 0], "{change}");
        let before = reported(&mut session, "MPos:");
        session.say("G10L20P1X0\n");
        let origin = session.say("$#\n");
        assert!(origin[0].contains(&before), "{origin:?}: {before}");
        session.say("G10L2P1X0\n");
        session.say(line);
        session.until_quiet();
        assert_eq!(reported(&mut session, "MPos:"), place, "{change}{line}");
        let moved = session.sim.counted_position()[0] - 2500;
        assert_eq!(moved, steps, "{change}{line}");
    }
}
