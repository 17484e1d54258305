//! Parameters and expressions in the lines of a sender.

use leadscrew_machine::board::ChannelId;
use leadscrew_program::{Program, Step};
use leadscrew_sim::powered::Powered;
use leadscrew_sim::profile::Profile;
use leadscrew_sim::PowerUp;
use leadscrew_sim::{Cycle, Host, Rate};
use std::collections::VecDeque;
use std::path::Path;

const PLAIN: &str = "
[axes.x]
rate_mm_min = 6000
acceleration_mm_s2 = 1000
[axes.y]
rate_mm_min = 6000
acceleration_mm_s2 = 1000
[axes.z]
rate_mm_min = 6000
acceleration_mm_s2 = 1000
[probe]
plate_height = -5
";

fn with_expressions() -> String {
    format!("{PLAIN}[options]\nexpressions = true\n")
}

/// Sends bytes, and keeps the lines that it hears.
#[derive(Default)]
struct Desk {
    bytes: VecDeque<u8>,
    incoming: String,
    heard: Vec<String>,
}

impl Host for Desk {
    fn next_byte(&mut self, _: ChannelId) -> Option<u8> {
        self.bytes.pop_front()
    }

    fn receive(&mut self, _: ChannelId, byte: u8, _: Cycle) {
        match byte {
            b'\r' => {}
            b'\n' => self.heard.push(std::mem::take(&mut self.incoming)),
            other => self.incoming.push(char::from(other)),
        }
    }
}

struct Session<'a> {
    machine: &'a mut dyn Powered,
    desk: Desk,
}

impl Session<'_> {
    /// Sends bytes; returns what is heard within a second.
    fn say(&mut self, bytes: &str) -> Vec<String> {
        self.desk.heard.clear();
        self.desk.bytes.extend(bytes.as_bytes());
        let end = self.machine.now() + Cycle::from_micros(1_000_000).0;
        self.machine.wait_until(&mut self.desk, end);
        std::mem::take(&mut self.desk.heard)
    }

    /// Sends a line; returns its answer.
    fn line(&mut self, line: &str) -> String {
        let heard = self.say(&format!("{line}\n"));
        let mut answers = heard
            .into_iter()
            .filter(|line| line == "ok" || line.starts_with("error") || line.starts_with("ALARM"));
        answers.next_back().unwrap_or_default()
    }

    /// The machine's place, machine position.
    fn place(&mut self) -> String {
        let heard = self.say("?");
        let report = heard.iter().find(|line| line.starts_with('<')).unwrap();
        let mut fields = report.split('|');
        let place = fields.find_map(|field| field.strip_prefix("MPos:"));
        place.unwrap().to_owned()
    }
}

/// Powers the machine of a file up and lends it to `test`.
fn session(file: &str, test: impl FnOnce(&mut Session<'_>)) {
    let file = Profile::parse(Path::new("machine.toml"), file).unwrap();
    let mut test = Some(test);
    file.power_up(file.supply(Rate::NeverWaits), &mut (), &mut |machine| {
        let desk = Desk::default();
        let mut session = Session { machine, desk };
        session.say("");
        if let Some(test) = test.take() {
            test(&mut session);
        }
    });
}

/// Lines, and the machine's place after each.
const LINES: [(&str, &str); 16] = [
    ("G0 X[1 + 2 * 3]", "7.000,0.000,0.000"),
    (
        "#1 = [10 / 4] (a comment / with a slash)",
        "7.000,0.000,0.000",
    ),
    ("G0 X#1 Y-#1", "2.500,-2.500,0.000"),
    ("G0 X[ATAN[1]/[1] / 10]", "4.500,-2.500,0.000"),
    ("/G0 X[#1/[1/2]]", "5.000,-2.500,0.000"),
    ("#<depth> = 1.5 #31 = 8", "5.000,-2.500,0.000"),
    ("g1 z-#<depth> f[#31 * 100]", "5.000,-2.500,-1.500"),
    ("G91 X#31 #31 = [#31 + 1]", "13.000,-2.500,-1.500"),
    ("X[#31]", "22.000,-2.500,-1.500"),
    ("G90 G2 X22 I[SQRT[4]]", "22.000,-2.500,-1.500"),
    ("G92 X[1 - 1] Y#0001", "22.000,-2.500,-1.500"),
    ("G0 X[#5420 + 1]", "23.000,-2.500,-1.500"),
    ("G92.1", "23.000,-2.500,-1.500"),
    ("G0 X[#<_abs_x> - 3] Z[#5422 + 1.5]", "20.000,-2.500,0.000"),
    ("G#30 Y[EXISTS[#<none>]]", "20.000,0.000,0.000"),
    ("M[3 + 2] G0 X#100", "0.000,0.000,0.000"),
];

#[test]
fn a_line_moves_the_machine_to_where_its_numbers_come_to() {
    session(&with_expressions(), |session| {
        for (line, place) in LINES {
            assert_eq!(session.line(line), "ok", "{line}");
            assert_eq!(session.place(), place, "{line}");
        }
    });
}

#[test]
fn a_stream_moves_the_machine_as_the_same_file_does_as_a_program() {
    let mut file = with_expressions();
    file.push_str("[settings]\n\"$10\" = 1\n");
    // Lines that read a place need a machine, which the program has not here.
    let lines = || {
        LINES
            .iter()
            .filter(|(line, _)| !line.contains("542") && !line.contains("abs"))
    };
    let text: String = lines().map(|(line, _)| format!("{line}\n")).collect();
    let mut program = Program::<1, 1, 8, 8, 128>::new(100);
    let (mut source, mut plain) = (text.as_bytes(), Vec::new());
    loop {
        match program.step(&mut source, &()).unwrap() {
            Step::Line(line) => plain.push(String::from_utf8(line.to_vec()).unwrap()),
            Step::Branch(_) | Step::Busy => {}
            Step::End => break,
        }
    }
    let mut places = Vec::new();
    for lines in [lines().map(|(line, _)| (*line).to_owned()).collect(), plain] {
        session(&file, |session| {
            let answers: Vec<String> = lines.iter().map(|line| session.line(line)).collect();
            assert!(answers.iter().all(|answer| answer == "ok"), "{answers:?}");
            places.push(session.place());
        });
    }
    assert_eq!(places[0], places[1]);
}

#[test]
fn a_machine_whose_file_does_not_ask_for_it_refuses_such_lines_by_name() {
    session(PLAIN, |session| {
        for (line, _) in LINES.iter().filter(|(line, _)| line.contains(['#', '['])) {
            assert_eq!(session.line(line), "error:206", "{line}");
        }
        assert_eq!(session.place(), "0.000,0.000,0.000");
    });
}

#[test]
fn a_line_that_is_wrong_is_told_why_and_sets_and_moves_nothing() {
    session(&with_expressions(), |session| {
        session.line("#1 = 7");
        for (line, answer) in [
            ("#1 = [1 / 0]", "error:241"),
            ("#1 = 8 G0 X[SQRT[-1]]", "error:241"),
            ("#1 = 8 #5 = [1 +]", "error:240"),
            ("#1 = 8 G0 X[[[[[[[[[1]]]]]]]]]", "error:240"),
            ("#1 = 8 X[NONE[1]]", "error:240"),
            ("#1 = 8 X#<unset>", "error:242"),
            ("#1 = 8 #5061 = 1", "error:242"),
            ("#1 = 8 #5603 = 1", "error:242"),
            ("#1 = 8 X#5400", "error:242"),
            ("#1 = 8 G1 X#1", "error:22"),
            ("#1 = 8 G[999]", "error:20"),
            ("#1 = 8 M98 P#1", "error:205"),
            ("O[1 + 1] CALL", "error:205"),
            ("O<a> CALL [1]", "error:205"),
            ("G65 P#1", "error:205"),
            ("$J=G91X#1F100", "error:206"),
            ("$N0=G0X#1", "error:206"),
        ] {
            assert_eq!(session.line(line), answer, "{line}");
        }
        assert_eq!(session.place(), "0.000,0.000,0.000");
        session.line("G0 X#1 Y#5");
        assert_eq!(session.place(), "7.000,0.000,0.000");
    });
}

#[test]
fn the_memory_for_parameters_is_bounded_and_a_full_one_is_told() {
    session(&with_expressions(), |session| {
        for number in 31..95 {
            assert_eq!(session.line(&format!("#{number}={number}")), "ok");
        }
        // The line sets all or nothing.
        assert_eq!(session.line("#31=0 #95=1"), "error:243");
        assert_eq!(session.line("#31=[#31+1] #31=5"), "ok");
        for name in 0..16 {
            assert_eq!(session.line(&format!("#<name{name}>={name}")), "ok");
        }
        assert_eq!(session.line("#<name0>=5 #<another>=1"), "error:243");
        assert_eq!(session.line("G0 X[#31+#<name0>] Y[#94/10]"), "ok");
        assert_eq!(session.place(), "5.000,9.400,0.000");
        let long: String = "#1=1".repeat(17);
        assert_eq!(session.line(&long), "error:243");
    });
}

#[test]
fn a_reset_forgets_parameters_and_the_end_of_a_program_does_not() {
    session(&with_expressions(), |session| {
        for line in ["#1=1 #40=2 #<a>=3", "M2"] {
            assert_eq!(session.line(line), "ok");
        }
        session.line("G0 X#1 Y#40 Z#<a>");
        assert_eq!(session.place(), "1.000,2.000,3.000");
        session.say("\x18");
        assert_eq!(session.line("G0 X#1 Y#40"), "ok");
        assert_eq!(session.place(), "0.000,0.000,3.000");
        assert_eq!(session.line("G0 Z#<a>"), "error:242");
    });
}

#[test]
fn a_probe_is_known_to_the_line_after_it() {
    session(&with_expressions(), |session| {
        assert_eq!(session.line("G0 Z#5063 X#5070"), "ok");
        assert_eq!(session.line("G38.2 Z-12 F1000"), "ok");
        assert_eq!(session.line("G10 L20 P1 Z[#5063 - #5063]"), "ok");
        assert_eq!(session.line("G0 Z[#5063 + 2] X#5070"), "ok");
        // The zero is on the plate now, and the contact at 0 of it.
        let place = session.place();
        let z: f64 = place.rsplit(',').next().unwrap().parse().unwrap();
        assert!((z + 3.0).abs() < 0.01, "{place}");
        assert!(place.starts_with("1.000,"), "{place}");
    });
}

#[test]
fn check_mode_calculates_too_and_moves_nothing() {
    session(&with_expressions(), |session| {
        session.say("$C\n");
        assert_eq!(session.line("#1=[1+1] G0X#1"), "ok");
        assert_eq!(session.line("G0X[#1/0]"), "error:241");
        session.say("$C\n");
        assert_eq!(session.place(), "0.000,0.000,0.000");
    });
}
