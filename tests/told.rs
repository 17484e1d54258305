//! Reports tell what the pin of spindle or laser does, after a setting has changed it at rest.

use leadscrew_planner::Cartesian;
use leadscrew_sim::Memory;
use leadscrew_tests::{setup, Session};

type Desk<'a> = Session<'a, Cartesian, 3>;

/// Lines that switch a tool on at rest.
const TOOLS: [(&str, &str); 3] = [
    ("laser, M3", "$32=1\n$707=0\nM3S500G1X1F6000\n"),
    ("laser, M4", "$32=1\n$707=0\nM4S500G1X1F6000\n"),
    ("spindle", "M3S500\n"),
];

/// Lines that change a setting, with `$30`, `$31` and whether a laser is there afterwards (`None`:
/// as before).
const CHANGES: [(&str, f64, f64, Option<bool>); 11] = [
    ("$30=1000\n", 1000.0, 0.0, None),
    ("$30=200\n", 200.0, 0.0, None),
    ("$30=2000\n", 2000.0, 0.0, None),
    ("$31=100\n", 1000.0, 100.0, None),
    ("$31=600\n", 1000.0, 600.0, None),
    ("$30=0\n", 0.0, 0.0, None),
    ("$32=0\n", 1000.0, 0.0, Some(false)),
    ("$32=1\n", 1000.0, 0.0, Some(true)),
    ("$707=1\n", 1000.0, 0.0, None),
    ("$4=1\n", 1000.0, 0.0, None),
    ("$RST=$\n", 1000.0, 0.0, Some(false)),
];

/// Bytes that lead from Idle into a state, and the state.
const STATES: [(&[u8], &str); 8] = [
    (b"", "Idle"),
    (b"!", "Hold:0"),
    (b"\x84", "Door:0"),
    (b"M0\n", "Hold:0"),
    (b"$C\n", "Check"),
    (b"$SLP\n", "Sleep"),
    (b"$J=X9F60\n", "Jog"),
    (b"G1X9F60\n", "Run"),
];

/// The state, S, and the field of accessories if the report has one.
fn report(session: &mut Desk<'_>) -> (String, f64, Option<String>) {
    session.heard(0);
    session.send(0, "?");
    session.wait_us(5_000);
    let heard = session.heard(0);
    let report = heard.iter().find(|line| line.starts_with('<')).unwrap();
    let fields: Vec<_> = report.trim_matches(['<', '>']).split('|').collect();
    let of = |name: &str| fields.iter().find_map(|field| field.strip_prefix(name));
    let speed = of("FS:")
        .unwrap()
        .split(',')
        .nth(1)
        .unwrap()
        .parse()
        .unwrap();
    let overrides = of("Ov:").map(|_| of("A:").unwrap_or("").to_owned());
    (fields[0].to_owned(), speed, overrides)
}

/// A tool is on, a setting is changed, a state is entered: then `judge` sees what is reported and
/// what is put out, a share of full power.
fn walk(judge: impl Fn(&str, Shown)) {
    for (tool, on) in TOOLS {
        for change in CHANGES {
            for (bytes, state) in STATES {
                let setup = setup::<3>(1);
                let mut memory = Memory::new(&setup);
                let mut session = Session::new(&mut memory, &setup, Cartesian);
                session.send(0, on);
                session.wait_us(1_000_000);
                session.send(0, change.0);
                session.wait_us(50_000);
                session.send(0, bytes);
                session.wait_us(300_000);
                let power = session.sim.board().power().share().to_num::<f64>();
                let (shown, speed, accessories) = report(&mut session);
                let case = format!("{tool}, {:?}, {state}", change.0);
                assert_eq!(shown, state, "{case}");
                let is_laser = change.3.unwrap_or(tool != "spindle");
                judge(
                    &case,
                    Shown {
                        power,
                        speed,
                        accessories,
                        is_laser,
                        change,
                        state,
                    },
                );
            }
        }
    }
}

struct Shown {
    power: f64,
    speed: f64,
    accessories: Option<String>,
    is_laser: bool,
    change: (&'static str, f64, f64, Option<bool>),
    state: &'static str,
}

/// Real Grbl goes on reporting the speed of a spindle that `$30` or `$31` has stopped (recorded:
/// `round2/smax_while_on`). That is kept while the machine is idle, and for a spindle alone.
fn is_as_recorded(shown: &Shown) -> bool {
    let scale = shown.change.0.starts_with("$30") || shown.change.0.starts_with("$31");
    scale && !shown.is_laser && shown.state == "Idle"
}

#[test]
fn the_reported_power_is_the_pin_s_after_each_setting_in_each_state() {
    walk(|case, shown| {
        if is_as_recorded(&shown) {
            assert_eq!((shown.power, shown.speed), (0.0, 500.0), "{case}");
            return;
        }
        assert_eq!(
            shown.speed > 0.0,
            shown.power > 0.0,
            "{case}: S{} {}",
            shown.speed,
            shown.power
        );
        let (_, most, least, _) = shown.change;
        if shown.power > 0.0 && most > least && shown.speed > least {
            let share = (shown.speed - least) / (most - least);
            assert!(
                (share - shown.power).abs() < 0.01,
                "{case}: {share} {}",
                shown.power
            );
        }
    });
}

#[test]
fn the_reported_direction_is_that_of_a_spindle_that_turns() {
    walk(|case, shown| {
        if let Some(accessories) = &shown.accessories {
            let turns = accessories.contains('S') || accessories.contains('C');
            assert_eq!(turns, shown.power > 0.0, "{case}: {accessories:?}");
        }
    });
}
