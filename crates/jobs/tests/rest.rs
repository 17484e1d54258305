//! The rest of a job begins on a machine that stands elsewhere as an uninterrupted run would go on:
//! the machine itself says so, by `?`, `$G` and `$#` after the line at which the rest begins.

use leadscrew_gcode::Number;
use leadscrew_jobs::settings_file::option;
use leadscrew_jobs::{rest_of, Ask, Machine, Rest, RestError};
use leadscrew_planner::Coordinate;
use leadscrew_sim::profile::Profile;
use leadscrew_sim::replay::{replay, Case, Exchange};
use std::fs;
use std::path::Path;

const SETTINGS: [&str; 7] = [
    "$110=20000",
    "$111=20000",
    "$112=20000",
    "$120=2000",
    "$121=2000",
    "$122=2000",
    "$30=1000",
];

fn machine(settings: &[&str]) -> Machine {
    let all = SETTINGS.iter().chain(settings);
    let lines: Vec<_> = all.map(|setting| option(setting).unwrap()).collect();
    Machine::new(Profile::default(), &lines).unwrap()
}

fn ask(line: u64) -> Ask {
    Ask {
        line,
        clearance: None,
        spin_up: Number::from_int(0),
        start: None,
    }
}

fn rest(job: &str, settings: &[&str], ask: &Ask) -> Result<Rest, RestError> {
    rest_of(&machine(settings), "job.nc", job.as_bytes(), ask).unwrap()
}

/// Returns what the machine says after the lines: the reports after each of the marked ones.
fn told(settings: &[&str], lines: &[(String, bool)]) -> Vec<Vec<String>> {
    let mut ops = vec!["(boot)".to_owned(), "send $10=1\\n".to_owned()];
    ops.extend(
        SETTINGS
            .iter()
            .chain(settings)
            .map(|setting| format!("cmd {setting}")),
    );
    let mut asked = Vec::new();
    for (line, is_asked) in lines {
        ops.push(format!("cmd {line}"));
        if *is_asked {
            ops.push("idle".to_owned());
            asked.push(ops.len()..ops.len() + 4);
            ops.extend(["send ?", "wait 50", "cmd $G", "cmd $#"].map(str::to_owned));
        }
    }
    let exchanges = ops.into_iter().map(|op| Exchange {
        op,
        t_ms: None,
        recv: Vec::new(),
    });
    let case = Case {
        build: Default::default(),
        exchanges: exchanges.collect(),
        other: Default::default(),
    };
    let answered = replay(&case).unwrap().exchanges;
    for exchange in &answered {
        let wrong = exchange
            .recv
            .iter()
            .find(|line| line.starts_with("error") || line.starts_with("ALARM"));
        assert_eq!(wrong, None, "{}", exchange.op);
    }
    let of = |range: std::ops::Range<usize>| {
        let lines = answered[range].iter().flat_map(|exchange| &exchange.recv);
        // Which of the fields behind the third comes depends on how many reports came before.
        let same = |line: &String| match line.starts_with('<') {
            true => line
                .trim_end_matches('>')
                .split('|')
                .take(3)
                .collect::<Vec<_>>()
                .join("|"),
            false => line.clone(),
        };
        lines.map(same).collect()
    };
    asked.into_iter().map(of).collect()
}

/// The offsets in force before a job: nothing, or zeros that it does not set itself. `start` is the
/// work position at machine position 0, at which the job begins.
#[derive(Clone, Copy)]
struct Before {
    lines: &'static [&'static str],
    start: [i64; 3],
}

const NOTHING: Before = Before {
    lines: &[],
    start: [0; 3],
};
const SHIFTED: Before = Before {
    lines: &["G92 X3 Y-2 Z1"],
    start: [3, -2, 1],
};
const ALL: Before = Before {
    lines: &["G10 L2 P2 X1 Y1 Z-2", "G55", "G43.1 Z2", "G92 X7 Y5 Z4"],
    start: [7, 5, 4],
};

/// Compares the rest from each line with the uninterrupted run, whatever is in force before.
fn compare(job: &str, settings: &[&str]) {
    for before in [NOTHING, SHIFTED, ALL] {
        compare_after(before, None, job, settings);
    }
}

/// As [`compare`], for a job that counts from the place at which it begins.
fn compare_from_start(job: &str, settings: &[&str]) {
    for before in [NOTHING, SHIFTED, ALL] {
        let start = before
            .start
            .map(|mm| Coordinate::from_nanos(mm * 1_000_000_000));
        compare_after(before, Some(start), job, settings);
    }
}

fn compare_after(before: Before, start: Option<[Coordinate; 3]>, job: &str, settings: &[&str]) {
    let lines: Vec<&str> = job.lines().collect();
    let zeros = || before.lines.iter().map(|line| ((*line).to_owned(), false));
    let whole: Vec<_> = zeros()
        .chain(lines.iter().map(|line| ((*line).to_owned(), true)))
        .collect();
    let expected = told(settings, &whole);
    let mut compared = 0;
    for number in 1..=lines.len() {
        let rest = match rest(
            job,
            settings,
            &Ask {
                start,
                ..ask(number as u64)
            },
        ) {
            Ok(rest) => rest,
            Err(RestError::GoesOn(line)) if line < number as u64 => continue,
            Err(error) => panic!("line {number}: {error}"),
        };
        // Axes that the job has not moved stay where they are.
        let placed = |axis| rest.preamble.iter().any(|line| line.contains(axis));
        let elsewhere = ['X', 'Y', 'Z'].map(|axis| match placed(axis) {
            true => format!("{axis}-7"),
            false => String::new(),
        });
        let mut begin = vec![format!("G53 G0 {}", elsewhere.join(" "))];
        begin.extend(
            rest.preamble
                .iter()
                .flat_map(|line| line.lines().map(str::to_owned)),
        );
        let begin = begin.into_iter().map(|line| (line, false));
        let mut begin: Vec<_> = zeros().chain(begin).collect();
        begin.push((lines[number - 1].to_owned(), true));
        let found = told(settings, &begin);
        // In place of an arc's mode there is none until a line names its motion.
        let is_open = rest
            .preamble
            .last()
            .is_some_and(|line| line.contains("G80"));
        let modes = |said: &[String]| {
            let arcs = said.iter().map(|line| match is_open {
                true => line
                    .replace("[GC:G80", "[GC:G3")
                    .replace("[GC:G2 ", "[GC:G3 "),
                false => line.clone(),
            });
            arcs.collect::<Vec<_>>()
        };
        let (found, expected) = (modes(&found[0]), modes(&expected[number - 1]));
        assert_eq!(found, expected, "line {number}: {:#?}", rest.preamble);
        assert_eq!(rest.lines.len(), lines.len() - number + 1);
        compared += 1;
    }
    assert!(compared > 3, "{compared}");
}

fn example(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../examples")
        .join(name);
    fs::read_to_string(path).unwrap()
}

#[test]
fn a_laser_s_job_goes_on_at_each_line() {
    compare(&example("heart.nc"), &["$32=1"]);
}

#[test]
fn a_pocket_goes_on_at_each_line() {
    compare(&example("pocket.nc"), &[]);
}

#[test]
fn holes_go_on_at_each_line() {
    compare(&example("drill_dip14.nc"), &[]);
}

#[test]
fn an_engraving_goes_on_at_each_line() {
    compare_from_start(&example("heart_as_printed.nc"), &[]);
}

#[test]
fn a_square_goes_on_at_each_line() {
    compare(&example("print_square.nc"), &[]);
}

#[test]
fn units_planes_offsets_and_modes_come_back() {
    let job = "G21 G90 G94\nG0 X0 Y0 Z5\nM3 S800\nM8\nG1 Z-1 F120\nG18\nG2 X4 Z-1 I2 K0 F300\nG3 X8 I2\nG17\n\
               G20\nG1 X0.5 F20\nG91\nX0.1\nY0.2\nG90 G21\nG92 X3 Y4\nG1 X5 F200\nG43.1 Z2\nG1 Z3\nG55\nG0 X1 Y2 Z4\nM9\nM4 S300\n\
               G93 G1 X2 F30\nX3 F20\nG94 F100\nX1\nG53 G0 Z5\nX2\nG28\nG0 X1 Y1\nG49\nG92.1\nM5\nG80\n";
    compare_after(NOTHING, None, job, &[]);
}

#[test]
fn a_zero_that_the_job_sets_itself_ends_the_one_before() {
    // A printer sets its filament axis to 0 by G92. This is not a zero of the work.
    let file = Profile::parse(Path::new("printer.toml"), "[axes.e]\nlimits = {}\n").unwrap();
    let machine = Machine::new(file, &[]).unwrap();
    let first = |job: &str, line| {
        let rest = rest_of(&machine, "job.nc", job.as_bytes(), &ask(line)).unwrap();
        rest.unwrap().preamble.join("\n")
    };
    let job = "G0 X1 Y1 Z1\nG92 E0\nX2\nG92 X0\nX3\nG43.1 Z1\nX4\nG54\nX5\n";
    let kept = first(job, 3);
    assert!(kept.contains("\nG92 E0\n"), "{kept}");
    for word in ["G92.1", "G49", "G54"] {
        assert!(!kept.contains(word), "{word}: {kept}");
    }
    assert!(first(job, 5).contains("\nG92.1\n") && !first(job, 5).contains("G49"));
    assert!(first(job, 7).contains("\nG49\n") && !first(job, 7).contains("G54"));
    assert!(first(job, 9).contains("G54 G0 X6 Y1"), "{}", first(job, 9));
}

#[test]
fn a_place_that_only_the_run_knew_is_named_with_its_remedy() {
    let refused = |job: &str, line| rest(job, &[], &ask(line)).unwrap_err().to_string();
    assert_eq!(
        refused("G91\nG0 X1\nX2\n", 3),
        "line 2 counts X from where the job began: name that place with --start X,Y,Z"
    );
    assert_eq!(
        refused("G92 X0\nG0 X1\nX2\n", 3),
        "line 1 counts X from where the job began: name that place with --start X,Y,Z"
    );
    assert_eq!(
        refused("G0 Z1\nG38.3 Z-5 F50\nG1 X1 F100\n", 3),
        "only that run knew the place of Z since line 2: begin at that line or before, or behind the next absolute Z"
    );
    assert_eq!(
        refused("G0 X1\nG2 X3 I1 F100\nX5 I1\n", 3),
        "the line goes on with the motion of line 2: begin at line 2"
    );
    assert_eq!(refused("G0 X1\n", 3), "the job has 1 lines");
    assert!(refused("G0 X1\nG1 X2\nX3\n", 3).starts_with("a line before it is refused"));
}

#[test]
fn zero_that_was_set_at_a_probe_is_a_known_place() {
    let job = "G38.3 Z-5 F50\nG10 L20 P1 Z1.5\nG1 X1 F100\n";
    let rest = rest(job, &[], &ask(3)).unwrap();
    assert!(
        rest.preamble.contains(&"G54 G1 Z1.5 F50".to_owned()),
        "{:#?}",
        rest.preamble
    );
}

#[test]
fn a_job_that_counts_from_its_start_goes_on_if_the_start_is_named() {
    let start = [1, 2, 3].map(|mm| Coordinate::from_nanos(mm * 1_000_000_000));
    let ask = Ask {
        start: Some(start),
        ..ask(4)
    };
    let rest = rest("G91\nG0 X1\nG92 Y0\nG1 X2 Y1 F100\n", &[], &ask).unwrap();
    let text = rest.preamble.join("\n");
    assert!(text.contains("G0 X2 Y2"), "{text}");
    assert!(text.contains("G92 Y0"), "{text}");
}

#[test]
fn the_tool_goes_up_first_and_down_last_and_the_spindle_gets_its_time() {
    let ask = Ask {
        spin_up: Number::from_int(4),
        ..ask(5)
    };
    let rest = rest("G0 Z5\nM3 S900\nG0 X10 Y10\nG1 Z-2 F100\nX20\n", &[], &ask).unwrap();
    let order = ["G0 Z5", "M3 S900", "G4 P4", "G0 X10 Y10", "G1 Z-2 F100"];
    let places: Vec<_> = order
        .iter()
        .map(|line| rest.preamble.iter().position(|other| other == line))
        .collect();
    assert!(
        places.iter().all(Option::is_some) && places.is_sorted(),
        "{places:?} {:#?}",
        rest.preamble
    );
}

#[test]
fn a_beam_is_lit_only_where_the_job_goes_on() {
    let rest = rest("M4 S900\nG0 X10\nG1 X20 F500\nX30\n", &["$32=1"], &ask(4)).unwrap();
    let lit = rest.preamble.iter().position(|line| line.contains("M4"));
    assert_eq!(lit, Some(rest.preamble.len() - 1));
}

#[test]
fn a_program_is_not_begun_in_its_middle() {
    for job in [
        "#1=5\nG1X#1F100\nX2\n",
        "G1X1F100\nX2\no1 repeat [2]\nX3\no1 endrepeat\n",
    ] {
        assert_eq!(rest(job, &[], &ask(2)), Err(RestError::Program), "{job}");
    }
}
