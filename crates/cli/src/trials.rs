//! Finds how much time a change of settings saves, by running the job again with it.

use super::course::{Course, Text};
use leadscrew_gcode::Number;
use leadscrew_jobs::{Machine, Trial, TIMING};
use leadscrew_machine::settings::table::Setting;
use leadscrew_machine::settings::values::StepLimits;
use leadscrew_machine::settings::values::{Entry, Key, Settings};
use leadscrew_sim::clock::seconds;
use leadscrew_sim::profile::MOST_AXES;
use leadscrew_sim::speed_profile::{Limit, Share, Slow, SpeedLimit};
use std::collections::BTreeSet;

/// The least share of the time for which a limit must bind to be tried.
const WORTH_TRYING: f64 = 0.01;

/// A change that can be tried.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Change {
    /// Settings whose values are doubled.
    Double(Vec<u16>),
    /// The highest feed override.
    Feed,
    /// Grbl's corner rule. With it, curves that consist of short moves exceed the acceleration.
    GrblCorners,
}

/// The highest feed override, per cent.
const MOST_FEED: u8 = 200;

/// Tries the changes one by one. Returns the savings, the largest first; changes that save nothing
/// are left out.
pub(super) fn trials(
    course: &Course,
    text: &Text,
    machine: &Machine,
    job_cycles: u64,
    shares: &[Share],
) -> Vec<Trial> {
    let changes = changes(shares, job_cycles);
    let try_out = |change: &Change| try_out(&course.silent(), text, machine, job_cycles, change);
    let found: Vec<Option<Trial>> = std::thread::scope(|scope| {
        let running: Vec<_> = changes
            .iter()
            .map(|change| scope.spawn(move || try_out(change)))
            .collect();
        let results = running.into_iter().map(|thread| thread.join());
        results.map(|result| result.ok().flatten()).collect()
    });
    let mut trials: Vec<Trial> = found.into_iter().flatten().collect();
    trials.sort_by(|one, other| other.seconds_saved.total_cmp(&one.seconds_saved));
    trials
}

/// The changes that raise the limits which bind for long, and one that raises all accelerations
/// together.
fn changes(shares: &[Share], job_cycles: u64) -> BTreeSet<Change> {
    let least = job_cycles as f64 * WORTH_TRYING;
    let binding = shares.iter().filter(|share| share.cycles as f64 >= least);
    let mut changes: BTreeSet<Change> = binding.flat_map(|share| of_limit(share.limit)).collect();
    let accelerations: BTreeSet<u16> = changes
        .iter()
        .flat_map(|change| match change {
            Change::Double(numbers) => numbers.clone(),
            Change::Feed | Change::GrblCorners => Vec::new(),
        })
        .filter(|number| (120..130).contains(number))
        .collect();
    if accelerations.len() > 1 {
        changes.insert(Change::Double(accelerations.into_iter().collect()));
    }
    changes
}

fn of_limit(limit: Limit) -> Vec<Change> {
    let single = |number: usize| Change::Double(vec![number as u16]);
    match limit {
        Limit::Speed(limit) => of_speed(limit),
        Limit::Acceleration(axis, slow) => {
            let mut changes = vec![single(120 + axis)];
            changes.extend(of_slow(slow));
            changes
        }
        Limit::Slow(slow) => of_slow(slow),
        Limit::Rest | Limit::Cycle => Vec::new(),
    }
}

fn of_speed(limit: SpeedLimit) -> Vec<Change> {
    match limit {
        SpeedLimit::Feed => vec![Change::Feed],
        SpeedLimit::Rate(axis) => vec![Change::Double(vec![110 + axis as u16])],
        SpeedLimit::Arc | SpeedLimit::Curve => {
            vec![Change::Double(vec![120, 121]), Change::GrblCorners]
        }
        SpeedLimit::StepRate => Vec::new(),
    }
}

fn of_slow(slow: Slow) -> Vec<Change> {
    match slow {
        Slow::Corner => vec![Change::Double(vec![11]), Change::GrblCorners],
        Slow::Stop | Slow::LookAhead | Slow::NoLine => Vec::new(),
        Slow::Move(limit) => of_speed(limit),
    }
}

/// Runs the job with `change`; `None` if the machine refuses it or it saves nothing.
fn try_out(
    course: &Course,
    text: &Text,
    machine: &Machine,
    job_cycles: u64,
    change: &Change,
) -> Option<Trial> {
    let mut changed = machine.settings.clone();
    let limits = TIMING.limits(machine.axes());
    let (words, percent) = match change {
        Change::Feed => (format!("feed override at {MOST_FEED} %"), MOST_FEED),
        Change::Double(numbers) => {
            let words: Option<Vec<String>> = numbers
                .iter()
                .map(|number| double(&mut changed, *number, limits))
                .collect();
            (words?.join(", "), 100)
        }
        Change::GrblCorners => (grbl_corners(&mut changed)?, 100),
    };
    let done = course
        .run(text, &machine.with(&changed), percent, ())
        .ok()?;
    let saved = job_cycles.checked_sub(done.outcome.job_cycles)?;
    (saved > 0 && done.error_count == 0 && done.alarm.is_none()).then(|| Trial {
        change: words,
        seconds_saved: seconds(saved),
    })
}

/// Chooses Grbl's corner rule; returns a description. `None` if it is chosen already.
fn grbl_corners(settings: &mut Settings<MOST_AXES>) -> Option<String> {
    let number = Setting::GrblCorners.row().number;
    let is_off = !settings.is_on(Setting::GrblCorners);
    let value = Number::from_int(1);
    (is_off && settings.load(Entry { number, value })).then(|| {
        format!("${number}=1 (now 0), Grbl's corner rule: arcs and curves exceed the acceleration")
    })
}

/// Doubles a setting; returns a description. `None` if the machine refuses it.
fn double(settings: &mut Settings<MOST_AXES>, number: u16, limits: StepLimits) -> Option<String> {
    let before = settings.get(Key::from_number(number, MOST_AXES)?);
    let value = Number::from_nanos(before.nanos().checked_mul(2)?);
    settings.set(Entry { number, value }, limits).ok()?;
    let [value, before] = [value, before].map(|number| number.nanos() as f64 / 1e9);
    Some(format!("${number}={value} (now {before})"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn share(limit: Limit, cycles: u64) -> Share {
        Share { limit, cycles }
    }

    #[test]
    fn what_binds_for_long_is_tried_and_accelerations_together_too() {
        let shares = [
            share(Limit::Acceleration(0, Slow::Corner), 500),
            share(Limit::Acceleration(1, Slow::Stop), 300),
            share(Limit::Speed(SpeedLimit::Feed), 195),
            share(Limit::Speed(SpeedLimit::Rate(2)), 5),
        ];
        let double = |numbers: &[u16]| Change::Double(numbers.to_vec());
        let expected = [
            double(&[11]),
            double(&[120]),
            double(&[120, 121]),
            double(&[121]),
            Change::Feed,
            Change::GrblCorners,
        ];
        assert_eq!(changes(&shares, 1000), BTreeSet::from(expected));
    }

    #[test]
    fn a_setting_is_doubled_and_named_with_its_value_now() {
        let mut settings = Settings::<MOST_AXES>::default();
        let limits = TIMING.limits(3);
        let words = double(&mut settings, 121, limits);
        assert_eq!(words.as_deref(), Some("$121=20 (now 10)"));
        assert_eq!(double(&mut settings, 999, limits), None);
    }
}
