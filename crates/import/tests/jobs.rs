//! Checks the promises about drilling jobs on the lines of jobs.

use leadscrew_import::drill::{jobs, Mirror, Options, Speeds};
use leadscrew_import::excellon::{read, Drawing, Known};
use leadscrew_import::Mm;
use proptest::prelude::*;
use std::collections::BTreeSet;

fn mm(text: &str) -> Mm {
    text.parse().unwrap()
}

fn options() -> Options {
    Options {
        depth: mm("-1.8"),
        clearance: mm("2"),
        feed: mm("120"),
        mill_feed: None,
        peck: None,
        tool_feeds: false,
        spindle: None,
        mirror: None,
        from_corner: false,
        bits: Vec::new(),
        mills_slots: false,
        job_a_bit: false,
        cycles: false,
    }
}

const SPEEDS: Speeds = Speeds {
    rates: [3000.0, 1000.0, 328.0],
    accelerations: [200.0, 50.0, 50.0],
    spindle: 10_000.0,
};

fn drawing(text: &str) -> Drawing {
    read(text, &Known::default()).unwrap_or_else(|faults| panic!("{faults:?}"))
}

/// The lines of the one job of some files.
fn lines(files: &[&str], options: &Options) -> Vec<String> {
    let drawings: Vec<Drawing> = files.iter().map(|text| drawing(text)).collect();
    jobs(&drawings, options, &SPEEDS)
        .unwrap()
        .remove(0)
        .job
        .lines
}

fn notes(files: &[&str], options: &Options) -> String {
    let drawings: Vec<Drawing> = files.iter().map(|text| drawing(text)).collect();
    jobs(&drawings, options, &SPEEDS)
        .unwrap()
        .remove(0)
        .job
        .notes
        .join("\n")
}

const TWO: &str =
    "M48\nMETRIC\nT1C0.8F200S50\nT2C1.0\n%\nT1\nX10.0Y5.0\nX12.5Y5.0\nT2\nX3.0Y4.0\nM30\n";

#[test]
fn a_job_begins_clear_and_ends_over_its_zero_and_then_on_it() {
    let lines = lines(&[TWO], &options());
    let wanted = "(3 holes down to Z-1.8, clearance Z2)\nG21 G90 G94 G17\nG0 Z2\n\
        (T1 0.8 mm, 0.0315 inch: 2 holes)\nM5\nT1 M6 (T1 0.8 mm, 0.0315 inch)\nM3 S10000\nG4 P1\nG0 Z2\n\
        N1 G0 X12.5 Y5\nN1 G1 Z-1.8 F120\nN1 G0 Z2\nN2 G0 X10 Y5\nN2 G1 Z-1.8 F120\nN2 G0 Z2\n\
        (T2 1 mm, 0.0394 inch: 1 hole)\nM5\nT2 M6 (T2 1 mm, 0.0394 inch)\nM3 S10000\nG4 P1\nG0 Z2\n\
        N3 G0 X3 Y4\nN3 G1 Z-1.8 F120\nN3 G0 Z2\nM5\nG0 X0 Y0\nG1 Z0 F120\nM30";
    assert_eq!(lines.join("\n"), wanted);
}

#[test]
fn one_bit_needs_no_change_and_each_bit_may_have_a_file() {
    let options = Options {
        job_a_bit: true,
        ..options()
    };
    let made = jobs(&[drawing(TWO)], &options, &SPEEDS).unwrap();
    let bits: Vec<_> = made.iter().map(|job| job.bit).collect();
    assert_eq!(bits, [Some(1), Some(2)]);
    for job in &made {
        let text = job.job.lines.join("\n");
        assert!(
            !text.contains("M6") && text.ends_with("M30") && text.contains("N1 G0"),
            "{text}"
        );
    }
}

#[test]
fn pecks_go_out_of_the_hole_and_back_to_just_above_its_bottom() {
    let options = Options {
        peck: Some(mm("0.8")),
        ..options()
    };
    let lines = lines(&["%\nT1C.03\nX1.0Y1.0\nM30"], &options);
    let first: Vec<_> = lines
        .iter()
        .filter_map(|line| line.strip_prefix("N1 "))
        .collect();
    let wanted = [
        "G0 X25.4 Y25.4",
        "G1 Z-0.8 F120",
        "G0 Z2",
        "G0 Z-0.55",
        "G1 Z-1.6 F120",
        "G0 Z2",
        "G0 Z-1.35",
        "G1 Z-1.8 F120",
        "G0 Z2",
    ];
    assert_eq!(first, wanted);
}

#[test]
fn a_spindle_of_speed_zero_is_not_started() {
    let inch = "M48\nINCH\nT1C.03\n%\nT1\nX1.0Y1.0\nM30";
    let by_hand = Options {
        spindle: Some(0),
        ..options()
    };
    let lines = lines(&[inch], &by_hand);
    let starts = |line: &String| line.starts_with("M3 ") || line.starts_with("G4");
    assert!(!lines.iter().any(starts), "{lines:?}");
}

#[test]
fn feeds_of_the_file_are_taken_only_when_wanted_and_clipped() {
    let inch = "M48\nINCH\nT1C.03F200S60\n%\nT1\nX1.0Y1.0\nM30";
    assert!(lines(&[inch], &options()).contains(&"N1 G1 Z-1.8 F120".to_owned()));
    let options = Options {
        tool_feeds: true,
        ..options()
    };
    let lines = lines(&[inch], &options);
    assert!(lines.contains(&"N1 G1 Z-1.8 F328".to_owned()), "{lines:?}");
    assert!(lines.contains(&"M3 S10000".to_owned()), "{lines:?}");
    let notes = notes(&[inch], &options);
    assert!(
        notes.contains("5080 mm/min is more than $112=328"),
        "{notes}"
    );
    assert!(
        notes.contains("60000 rpm is more than $30=10000"),
        "{notes}"
    );
}

#[test]
fn files_of_one_board_share_bits_of_one_diameter() {
    let other = "M48\nMETRIC\nT1C1.0\nT2C3.2\n%\nT1\nX1.0Y1.0\nT2\nX2.0Y2.0\nM30\n";
    let lines = lines(&[TWO, other], &options());
    let changes: Vec<_> = lines.iter().filter(|line| line.contains("M6")).collect();
    let wanted = [
        "T1 M6 (T1 0.8 mm, 0.0315 inch)",
        "T2 M6 (T2 1 mm, 0.0394 inch)",
        "T3 M6 (T3 3.2 mm, 0.1260 inch)",
    ];
    assert_eq!(changes, wanted);
    assert!(lines.contains(&"(T2 1 mm, 0.0394 inch: 2 holes)".to_owned()));
    assert!(notes(&[TWO, other], &options()).contains("T2 of another file is T3"));
}

#[test]
fn each_tool_becomes_the_nearest_bit_and_that_is_said() {
    let options = Options {
        bits: vec![mm("1"), mm("0.6")],
        ..options()
    };
    let notes = notes(&[TWO], &options);
    assert!(
        notes.contains("T1: 0.8 mm is drilled with the bit of 1 mm"),
        "{notes}"
    );
    let lines = lines(&[TWO], &options);
    assert!(
        lines.contains(&"(T1 1 mm, 0.0394 inch: 3 holes)".to_owned()),
        "{lines:?}"
    );
}

#[test]
fn a_board_is_turned_over_and_put_to_its_corner() {
    let mirrored = Options {
        mirror: Some(Mirror::X),
        ..options()
    };
    assert!(lines(&[TWO], &mirrored).contains(&"N2 G0 X-10 Y5".to_owned()));
    let corner = Options {
        from_corner: true,
        ..mirrored
    };
    let lines = lines(&[TWO], &corner);
    assert!(
        lines.iter().any(|line| line.ends_with("G0 X0 Y1")),
        "{lines:?}"
    );
    assert!(
        lines.iter().any(|line| line.ends_with("G0 X9.5 Y0")),
        "{lines:?}"
    );
    assert!(notes(&[TWO], &corner).contains("X0 Y0 of the job is X-12.5 Y4"));
}

#[test]
fn a_slot_is_a_row_of_holes_or_a_cut() {
    let slot = "M48\nMETRIC\nT1C1.0\n%\nT1\nX10.0Y5.0G85X11.0Y5.0\nM30\n";
    let drilled: Vec<String> = lines(&[slot], &options())
        .into_iter()
        .filter(|line| line.contains(" X1"))
        .collect();
    assert_eq!(drilled, ["N1 G0 X10 Y5", "N1 G0 X10.5 Y5", "N1 G0 X11 Y5"]);
    let mill = Options {
        mills_slots: true,
        mill_feed: Some(mm("60")),
        peck: Some(mm("1")),
        ..options()
    };
    let milled = lines(&[slot], &mill);
    let milled: Vec<_> = milled
        .iter()
        .filter_map(|line| line.strip_prefix("N1 "))
        .collect();
    let wanted = [
        "G0 X10 Y5",
        "G1 Z-1 F120",
        "G1 X11 Y5 F60",
        "G1 Z-1.8 F120",
        "G1 X10 Y5 F60",
        "G0 Z2",
    ];
    assert_eq!(milled, wanted);
    let rack = drawing("%\nT1\nX010000Y010000G85X020000Y010000\nM30\n");
    let refused = jobs(&[rack], &options(), &SPEEDS).unwrap_err();
    assert!(refused.contains("--slots mill"), "{refused}");
}

#[test]
fn routes_are_milled_with_their_arcs() {
    let text = "M48\nMETRIC\nT1C2.0\n%\nT1\nG00X0Y0\nM15\nG02X5.0Y5.0A5.0\nG03X10.0Y10.0I0Y10.0J5.0\nM16\nM30\n";
    let text = text.replace("I0Y10.0J5.0", "I0J5.0");
    let made = lines(&[&text], &options());
    assert!(made.contains(&"N1 G2 X5 Y5 R5 F120".to_owned()), "{made:?}");
    assert!(
        made.contains(&"N1 G3 X10 Y10 I0 J5 F120".to_owned()),
        "{made:?}"
    );
    let mirrored = Options {
        mirror: Some(Mirror::Y),
        ..options()
    };
    let made = lines(&[&text], &mirrored);
    assert!(
        made.contains(&"N1 G3 X5 Y-5 R5 F120".to_owned()),
        "{made:?}"
    );
    assert!(
        made.contains(&"N1 G2 X10 Y-10 I0 J-5 F120".to_owned()),
        "{made:?}"
    );
}

#[test]
fn options_that_make_no_sense_are_refused() {
    let refused = |options: Options| jobs(&[drawing(TWO)], &options, &SPEEDS).unwrap_err();
    assert!(refused(Options {
        depth: mm("1.8"),
        ..options()
    })
    .contains("is it -1.8?"));
    assert!(refused(Options {
        clearance: mm("-2"),
        ..options()
    })
    .contains("--clearance"));
    assert!(refused(Options {
        feed: mm("0"),
        ..options()
    })
    .contains("--feed"));
    assert!(refused(Options {
        peck: Some(mm("0.000001")),
        ..options()
    })
    .contains("pecks"));
    assert!(jobs(&[drawing("%\nM30")], &options(), &SPEEDS)
        .unwrap_err()
        .contains("no hole"));
}

/// The time of a rapid from rest to rest, found by trying speeds up to the highest that each axis
/// allows, with the highest acceleration that each axis allows.
fn seconds(from: [f64; 2], to: [f64; 2]) -> f64 {
    let way = [to[0] - from[0], to[1] - from[1]];
    let length = way[0].hypot(way[1]);
    if length == 0.0 {
        return 0.0;
    }
    let least = |limits: [f64; 3]| {
        (0..2)
            .map(|axis| limits[axis] / (way[axis].abs() / length))
            .fold(f64::MAX, f64::min)
    };
    let (speed, acceleration) = (least(SPEEDS.rates) / 60.0, least(SPEEDS.accelerations));
    let peak = speed.min((length * acceleration).sqrt());
    2.0 * peak / acceleration + (length - peak * peak / acceleration) / peak
}

/// Reads a job's lines. Returns for each hole its tool, where the tool goes down, and where it
/// comes up.
fn visits(lines: &[String]) -> Vec<(String, [f64; 2], [f64; 2])> {
    let mut visits: Vec<(String, [f64; 2], [f64; 2])> = Vec::new();
    let (mut tool, mut number) = (String::new(), String::new());
    for line in lines {
        if line.contains("M6") {
            tool = line.clone();
        }
        let words: Vec<&str> = line.split(' ').collect();
        let value = |letter| {
            words
                .iter()
                .find_map(|word| word.strip_prefix(letter)?.parse().ok())
        };
        let (Some(x), Some(y), true) = (value('X'), value('Y'), line.starts_with('N')) else {
            continue;
        };
        match visits.last_mut() {
            Some(visit) if number == words[0] => visit.2 = [x, y],
            _ => visits.push((tool.clone(), [x, y], [x, y])),
        }
        number = words[0].to_owned();
    }
    visits
}

/// The time of all legs, from X0 Y0 and back to X0 Y0.
fn travel(visits: &[(String, [f64; 2], [f64; 2])]) -> f64 {
    let ends = std::iter::once([0.0, 0.0]).chain(visits.iter().map(|visit| visit.2));
    let starts = visits.iter().map(|visit| visit.1).chain([[0.0, 0.0]]);
    ends.zip(starts).map(|(from, to)| seconds(from, to)).sum()
}

fn board() -> impl Strategy<Value = String> {
    let place = || (0..600, 0..600);
    let hole = (0..3, place(), place(), 0..4).prop_map(|(tool, (x, y), (u, v), kind)| {
        let place = |x, y| format!("X{}.{}Y{}.{}", x / 10, x % 10, y / 10, y % 10);
        let slot = if kind == 0 {
            "G85".to_owned() + &place(u, v)
        } else {
            String::new()
        };
        format!("T{}\n{}{slot}\n", tool + 1, place(x, y))
    });
    proptest::collection::vec(hole, 1..40).prop_map(|holes| {
        let head = "M48\nMETRIC\nT1C0.8\nT2C1.0\nT3C1.2\n%\n";
        head.to_owned() + &holes.concat() + "M30\n"
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases / 3))]
    #[test]
    fn no_exchange_of_two_legs_saves_time(board in board(), pecks in any::<bool>()) {
        let peck = pecks.then(|| mm("0.9"));
        let options = Options { mills_slots: true, peck, ..options() };
        let visits = visits(&lines(&[&board], &options));
        let holes: Vec<&str> = board.split_once("%\n").unwrap().1.lines().collect();
        // What is asked for twice is drilled once.
        let asked: BTreeSet<_> = holes.chunks_exact(2).collect();
        prop_assert_eq!(visits.len(), asked.len());
        let now = travel(&visits);
        for first in 0..visits.len() {
            let same = visits.iter().skip(first).take_while(|visit| visit.0 == visits[first].0).count();
            for last in first..first + same {
                let mut other = visits.clone();
                other[first..=last].reverse();
                other[first..=last].iter_mut().for_each(|visit| std::mem::swap(&mut visit.1, &mut visit.2));
                let saved = now - travel(&other);
                prop_assert!(saved < 1e-6, "{} to {} the other way saves {} s", first, last, saved);
            }
        }
    }
}

/// X and Y have equal speeds here, so the diagonal takes no longer than the longer side.
#[test]
fn of_two_ways_of_equal_time_the_shorter_one_is_taken() {
    let board = "M48\nMETRIC\nT1C3.2\n%\nT1\nX5.0Y5.0\nX55.0Y105.0\nX5.0Y105.0\nX55.0Y5.0\nM30\n";
    let speeds = Speeds {
        rates: [328.0; 3],
        accelerations: [50.0; 3],
        ..SPEEDS
    };
    let job = jobs(&[drawing(board)], &options(), &speeds)
        .unwrap()
        .remove(0)
        .job;
    let holes = visits(&job.lines);
    let legs = holes.windows(2).map(|pair| (pair[0].2, pair[1].1));
    let length: f64 = legs.map(|(a, b)| (b[0] - a[0]).hypot(b[1] - a[1])).sum();
    // Three sides of the rectangle.
    assert_eq!(length, 200.0, "{holes:?}");
}

#[test]
fn cycles_say_once_how_and_then_only_where() {
    let cycles = Options {
        cycles: true,
        ..options()
    };
    let text = "M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y5.0\nX2.5Y5.0\nG00X3.0Y5.0\nM15\nG01X4.0Y5.0\nM16\nG05\nX5.0Y5.0\nM30\n";
    let (mut holes, mut routes, mut in_cycle) = (0, 0, false);
    for line in lines(&[text], &cycles) {
        let words = line.split_once(' ').map_or("", |(_, words)| words);
        if words.starts_with("G98 G81 X") {
            assert!(!in_cycle && words.ends_with(" Z-1.8 R2 F120"), "{line}");
            (in_cycle, holes) = (true, holes + 1);
        } else if line == "G80" {
            assert!(in_cycle);
            in_cycle = false;
        } else if in_cycle {
            assert!(words.starts_with('X'), "{line}");
            holes += 1;
        } else if words == "G1 X4 Y5 F120" {
            routes += 1;
        }
    }
    assert_eq!((holes, routes, in_cycle), (3, 1, false));
}

#[test]
fn pecks_become_the_word_of_g83() {
    let cycles = Options {
        cycles: true,
        peck: Some(mm("0.6")),
        ..options()
    };
    let job = lines(&[TWO], &cycles);
    let begun: Vec<&String> = job.iter().filter(|line| line.contains("G83")).collect();
    assert_eq!(begun.len(), 2, "{job:?}");
    assert!(
        begun.iter().all(|line| line.contains("Z-1.8 R2 Q0.6 F")),
        "{begun:?}"
    );
}

#[test]
fn a_tool_whose_number_no_machine_takes_gets_another_one() {
    let high = "M48\nMETRIC,TZ\nT255C1.0\n T300C0.8\nT7C2.0\n%\nT300\nX1.0Y1.0\nT7\nX2.0Y2.0\n\
                T255\nX3.0Y3.0\nM30\n";
    let job = lines(&[high], &options()).join("\n");
    assert!(!job.contains("T300"), "{job}");
    assert!(job.contains("T1 M6 (T1 0.8 mm"), "{job}");
    assert!(job.contains("T255 M6") && job.contains("T7 M6"), "{job}");
    assert!(notes(&[high], &options()).contains("T300 is T1 of the job"));
    let said = drawing(high).notes.join("\n");
    assert!(said.contains("line 4, column 2: "), "{said}");
    // Without a list of diameters too.
    let bare = "T1\nX1.0Y1.0\nT256\nX2.0Y2.0\nT1\nX3.0Y3.0\nT256\nX4.0Y4.0\nM30\n";
    let said = drawing(bare).notes.join("\n");
    assert_eq!(said.matches("line 3, column 1: ").count(), 1, "{said}");
    assert!(lines(&[bare], &options()).join("\n").contains("T2 M6"));
    let tools = |prefix: &str, end: &str| -> String {
        let one = |tool: u32| format!("T{tool}{}\n", end.replace('#', &tool.to_string()));
        (1..=256)
            .map(one)
            .fold(prefix.to_owned(), |all, one| all + &one)
    };
    let many = format!(
        "{}%\n{}M30\n",
        tools("M48\nMETRIC\n", "C#.0"),
        tools("", "\nX1.0Y1.0")
    );
    let refused = jobs(&[drawing(&many)], &options(), &SPEEDS).unwrap_err();
    assert!(refused.contains("more than 255 tools"), "{refused}");
}

#[test]
fn a_hole_that_stands_twice_is_drilled_once_and_that_is_said() {
    let twice =
        "M48\nMETRIC\nT1C0.8\nT2C0.8\nT3C2.0\n%\nT1\nX1.0Y1.0\nX1.0Y1.0\nX5.0Y1.0G85X6.0Y1.0\n\
                 X6.0Y1.0G85X5.0Y1.0\nT2\nX1.0Y1.0\nT3\nX1.0Y1.0\nM30\n";
    let options = Options {
        mills_slots: true,
        ..options()
    };
    let lines = lines(&[twice], &options);
    let down = lines.iter().filter(|line| line.contains("G1 Z-1.8"));
    assert_eq!(down.count(), 3, "{lines:?}");
    let notes = notes(&[twice], &options);
    assert!(
        notes.contains("T1: left out 3 holes in the place of another one"),
        "{notes}"
    );
}
