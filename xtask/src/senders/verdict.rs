//! Checks whether a sender did its job.

use super::observer::{Rest, Sight};
use super::wire::{word, Wire};

/// The distance that the machine may have from a target at rest, mm: half a step, and the report's
/// third decimal.
const EXACT: f64 = 0.0075;

/// Something that must have happened.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Check {
    /// The machine answered every line with `ok`, and gave no other and no additional answer.
    AllOk,
    /// The machine moved.
    Ran,
    /// The machine rests at the target of the last line that moves, and is ready for more.
    EndsWhereSent,
    /// The machine stood in `Hold:0`, and went on from the same place.
    HeldAndResumed,
    /// A jog ended at this X, mm, before the job.
    JoggedTo(f64),
    /// The machine was locked, and then unlocked without homing.
    Unlocked,
    /// The machine was locked, homed, and then unlocked.
    Homed,
    /// This number of tool changes came, waited in `Hold:0`, and were resumed.
    ChangedTools(usize),
    /// Each probed point is on the plate of `bench.toml`, and each cut follows the plate.
    FollowsPlate,
    /// A reset in the hold left the machine unlocked and at the place of the hold, and it moves by
    /// a millimetre when asked to.
    StoppedInPlace,
}

impl Check {
    /// The fault, if the check fails.
    pub(super) fn fault(self, wire: &Wire, rest: &Rest) -> Option<String> {
        let holds = match self {
            Self::AllOk => return unanswered(wire),
            Self::Ran => wire.sights.iter().any(|sight| sight.state == "Run"),
            Self::EndsWhereSent => return elsewhere(wire, rest),
            Self::HeldAndResumed => held_and_resumed(wire, &wire.sights),
            Self::JoggedTo(x) => jogged_to(x, &wire.sights),
            Self::Unlocked => in_order(&wire.sights, &["Alarm", "Idle"]) && !homed(&wire.sights),
            Self::Homed => in_order(&wire.sights, &["Alarm", "Home", "Idle", "Run"]),
            Self::ChangedTools(count) => changed_tools(count, wire),
            Self::FollowsPlate => return off_the_plate(wire),
            Self::StoppedInPlace => return not_in_place(wire, rest),
        };
        (!holds).then(|| format!("{self:?} does not hold; states seen: {}", states(wire)))
    }
}

fn unanswered(wire: &Wire) -> Option<String> {
    let count = |begins: &str| {
        wire.answers
            .iter()
            .filter(|line| line.starts_with(begins))
            .count()
    };
    let (ok, sent) = (count("ok"), wire.sent.len());
    let bad = count("error:") + count("ALARM:");
    (bad > 0 || ok != sent || sent == 0)
        .then(|| format!("{ok} ok to {sent} lines, {bad} errors and alarms"))
}

fn elsewhere(wire: &Wire, rest: &Rest) -> Option<String> {
    let [x, y] = wire.last_target();
    let there = |sight: &Sight| sight.state == "Idle" && is_at(sight, [x, y]);
    let last = &rest.last;
    (!there(last)).then(|| format!("ends as {last:?}, not Idle at X{x} Y{y}"))
}

fn not_in_place(wire: &Wire, rest: &Rest) -> Option<String> {
    let held = wire.sights.iter().rfind(|sight| sight.state == "Hold:0");
    let Some(held) = held else {
        return Some(format!("no Hold:0; states seen: {}", states(wire)));
    };
    let last = &rest.last;
    let asked = in_order(&wire.realtime, &["!", "\\x18"]);
    let free = last.state == "Idle" && last.position == held.position;
    let target = [last.position[0] + 1.0, last.position[1]];
    let moved = rest
        .moved
        .as_ref()
        .is_some_and(|sight| is_at(sight, target));
    let good = asked && free && moved;
    (!good).then(|| format!("held as {held:?}, then {last:?}, then {:?}", rest.moved))
}

fn held_and_resumed(wire: &Wire, sights: &[Sight]) -> bool {
    let held = sights.iter().position(|sight| sight.state == "Hold:0");
    let moved_on = held.and_then(|held| {
        let place = &sights[held].position;
        let after = sights[held..]
            .iter()
            .find(|sight| sight.state != "Hold:0")?;
        // The machine may have moved for ten milliseconds between the two sights.
        let near = (after.position.iter().zip(place)).all(|(new, old)| (new - old).abs() < 3.0);
        Some(after.state == "Run" && near)
    });
    in_order(&wire.realtime, &["!", "~"]) && moved_on == Some(true)
}

fn changed_tools(count: usize, wire: &Wire) -> bool {
    let asked = |line: &&String| line.starts_with("[MSG:Tool ");
    let resumed = |byte: &&String| *byte == "~";
    wire.answers.iter().filter(asked).count() == count
        && wire.realtime.iter().filter(resumed).count() == count
        && in_order(&wire.sights, &["Run", "Hold:0", "Run", "Hold:0", "Run"])
}

/// The height of the plate of `tests/senders/bench.toml`, mm.
fn plate([x, y]: [f64; 2]) -> f64 {
    -1.0 + 0.02 * x - 0.01 * y
}

/// Describes the first probed point that is not on the plate, or the first cut of `flat.nc` that is
/// not 0.2 mm below it.
fn off_the_plate(wire: &Wire) -> Option<String> {
    const POINTS: usize = 12;
    const DEPTH: f64 = 0.2;
    let probed: Vec<[f64; 3]> = wire
        .answers
        .iter()
        .filter_map(|line| probed(line))
        .collect();
    let cuts: Vec<[f64; 3]> = wire.sent.iter().filter_map(|line| cut(line)).collect();
    if probed.len() != POINTS || cuts.len() < POINTS / 2 {
        return Some(format!("{} points, {} cuts", probed.len(), cuts.len()));
    }
    let below =
        |depth: f64| move |[x, y, z]: &[f64; 3]| (z + depth - plate([*x, *y])).abs() > EXACT;
    let off = probed.into_iter().find(below(0.0));
    let off = off.or_else(|| cuts.into_iter().find(below(DEPTH)));
    off.map(|place| format!("{place:?} is off the plate"))
}

/// The position in `[PRB:x,y,z:1]`.
fn probed(line: &str) -> Option<[f64; 3]> {
    let places = line.strip_prefix("[PRB:")?.strip_suffix(":1]")?;
    let places: Vec<f64> = places.split(',').flat_map(str::parse).collect();
    places.try_into().ok()
}

/// The end point of a `G1` that names all three axes.
fn cut(line: &str) -> Option<[f64; 3]> {
    let line = line.strip_prefix("G1")?;
    Some([word(line, 'X')?, word(line, 'Y')?, word(line, 'Z')?])
}

fn jogged_to(x: f64, sights: &[Sight]) -> bool {
    let run = sights.iter().position(|sight| sight.state == "Run");
    let before = &sights[..run.unwrap_or(sights.len())];
    let jog = before.iter().position(|sight| sight.state == "Jog");
    let after = &before[jog.unwrap_or(before.len())..];
    after
        .iter()
        .any(|sight| sight.state == "Idle" && is_at(sight, [x, 0.0]))
}

fn homed(sights: &[Sight]) -> bool {
    sights.iter().any(|sight| sight.state == "Home")
}

fn is_at(sight: &Sight, target: [f64; 2]) -> bool {
    let off = |(place, target): (&f64, f64)| (place - target).abs();
    sight
        .position
        .iter()
        .zip(target)
        .map(off)
        .all(|off| off <= EXACT)
}

/// Returns true if the items `wanted` come in this order; others may be between them.
fn in_order<T: AsRef<str>>(all: &[T], wanted: &[&str]) -> bool {
    let mut rest = all.iter().map(AsRef::as_ref);
    wanted.iter().all(|wanted| rest.any(|one| one == *wanted))
}

impl AsRef<str> for Sight {
    fn as_ref(&self) -> &str {
        &self.state
    }
}

fn states(wire: &Wire) -> String {
    let mut states: Vec<&str> = wire.sights.iter().map(AsRef::as_ref).collect();
    states.dedup();
    states.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sight(state: &str, x: f64) -> Sight {
        let (state, position) = (state.to_owned(), vec![x, 0.0, 0.0]);
        Sight { state, position }
    }

    fn sights(states: &[(&str, f64)]) -> Vec<Sight> {
        states.iter().map(|(state, x)| sight(state, *x)).collect()
    }

    fn rest(states: &[(&str, f64)]) -> Rest {
        let last = sights(states).pop().unwrap_or_else(|| sight("Alarm", 0.0));
        let moved = Some(sight("Idle", last.position[0] + 1.0));
        Rest { last, moved }
    }

    fn wire(realtime: &[&str]) -> Wire {
        let owned = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect();
        Wire {
            sent: owned(&["G1X1", "G1X5"]),
            realtime: owned(realtime),
            answers: owned(&["ok", "ok"]),
            sights: Vec::new(),
        }
    }

    fn holds(check: Check, realtime: &[&str], states: &[(&str, f64)]) -> bool {
        let wire = Wire {
            sights: sights(states),
            ..wire(realtime)
        };
        check.fault(&wire, &rest(states)).is_none()
    }

    #[test]
    fn an_ok_too_few_or_too_many_an_error_and_silence_are_faults() {
        let answers = |answers: &[&str]| {
            let answers = answers.iter().map(|text| (*text).to_owned()).collect();
            unanswered(&Wire {
                answers,
                ..wire(&[])
            })
        };
        assert_eq!(answers(&["ok", "ok", "[MSG:Pgm End]"]), None);
        assert!(answers(&["ok"]).is_some() && answers(&["ok"; 3]).is_some());
        assert!(answers(&["ok", "error:9"]).is_some());
        assert!(answers(&["ok", "ok", "ALARM:1"]).is_some());
        assert!(unanswered(&Wire::default()).is_some());
    }

    #[test]
    fn a_job_ends_idle_at_the_last_target() {
        assert!(holds(Check::EndsWhereSent, &[], &[("Idle", 5.0)]));
        assert!(!holds(Check::EndsWhereSent, &[], &[("Idle", 4.98)]));
        assert!(!holds(Check::EndsWhereSent, &[], &[("Alarm", 5.0)]));
        assert!(!holds(Check::EndsWhereSent, &[], &[]));
    }

    #[test]
    fn each_tool_change_is_asked_for_and_resumed() {
        let states: Vec<(&str, f64)> = ["Idle", "Run", "Hold:0", "Run", "Hold:0", "Run", "Idle"]
            .map(|state| (state, 0.0))
            .into();
        let mut wire = wire(&["?", "~", "~"]);
        wire.answers = vec!["[MSG:Tool 1, then ~]".into(), "[MSG:Tool 2, then ~]".into()];
        wire.sights = sights(&states);
        assert!(changed_tools(2, &wire));
        wire.sights.truncate(4);
        assert!(!changed_tools(2, &wire));
        wire.sights = sights(&states);
        wire.answers.pop();
        assert!(!changed_tools(2, &wire));
    }

    #[test]
    fn points_beside_the_plate_and_cuts_that_do_not_follow_it_are_found() {
        let good = Wire {
            answers: vec!["[PRB:10.000,20.000,-1.000:1]".into(); 12],
            sent: vec!["G1X30Y0Z-0.6F300".into(); 6],
            ..Wire::default()
        };
        assert_eq!(off_the_plate(&good), None);
        let mut wrong = good.answers.clone();
        wrong[5] = "[PRB:10.000,20.000,-1.010:1]".into();
        let (sent, answers) = (good.sent.clone(), wrong);
        assert!(off_the_plate(&Wire {
            sent,
            answers,
            ..Wire::default()
        })
        .is_some());
        let mut sent = good.sent.clone();
        sent[5] = "G1X30Y0Z-0.2".into();
        let answers = good.answers.clone();
        assert!(off_the_plate(&Wire {
            sent,
            answers,
            ..Wire::default()
        })
        .is_some());
        assert!(off_the_plate(&Wire::default()).is_some());
    }

    #[test]
    fn a_hold_is_seen_and_goes_on_from_its_place() {
        let held = |states: &[_]| holds(Check::HeldAndResumed, &["?", "!", "~"], states);
        assert!(held(&[
            ("Run", 1.0),
            ("Hold:0", 2.0),
            ("Run", 2.5),
            ("Idle", 5.0)
        ]));
        assert!(!held(&[("Run", 1.0), ("Hold:0", 2.0)]));
        assert!(!held(&[("Run", 1.0), ("Hold:0", 2.0), ("Run", 5.5)]));
        assert!(!held(&[("Run", 1.0), ("Hold:0", 2.0), ("Alarm", 2.0)]));
        assert!(!held(&[("Run", 1.0), ("Idle", 5.0)]));
    }

    #[test]
    fn a_stop_leaves_the_machine_free_where_it_was_held() {
        let stopped = |states: &[_]| holds(Check::StoppedInPlace, &["!", "\\x18"], states);
        assert!(stopped(&[("Run", 1.0), ("Hold:0", 2.0), ("Idle", 2.0)]));
        assert!(!stopped(&[("Run", 1.0), ("Hold:0", 2.0), ("Idle", 2.1)]));
        assert!(!stopped(&[("Run", 1.0), ("Hold:0", 2.0), ("Alarm", 2.0)]));
        assert!(!stopped(&[("Run", 1.0), ("Idle", 2.0)]));
    }

    #[test]
    fn jogs_homing_and_unlocking_are_seen() {
        let jog = Check::JoggedTo(3.0);
        assert!(holds(
            jog,
            &[],
            &[("Jog", 1.0), ("Idle", 3.0), ("Run", 1.0)]
        ));
        assert!(!holds(jog, &[], &[("Idle", 3.0), ("Run", 1.0)]));
        assert!(!holds(
            jog,
            &[],
            &[("Jog", 1.0), ("Run", 1.0), ("Idle", 3.0)]
        ));
        let home = [("Alarm", 0.0), ("Home", 0.0), ("Idle", 1.0), ("Run", 2.0)];
        assert!(holds(Check::Homed, &[], &home) && !holds(Check::Unlocked, &[], &home));
        let unlock = [("Alarm", 0.0), ("Idle", 1.0), ("Run", 2.0)];
        assert!(holds(Check::Unlocked, &[], &unlock) && !holds(Check::Homed, &[], &unlock));
    }
}
