//! Looks at jobs that are dropped on the page of `serve`: the findings of `check` and `profile`,
//! and the path.

use super::check::read_through;
use super::checker::follow;
use super::input::Job as Input;
use super::profile::{machine as limits_of, without_lead, ProfileReport};
use super::setting_args::Machine;
use super::stream::Stream;
use leadscrew_gcode::Number;
use leadscrew_machine::settings::table::Setting;
use leadscrew_machine::settings::values::{Entry, Key};
use leadscrew_planner::Coordinate;
use leadscrew_serve::browser::{Finding, Job, Workshop};
use leadscrew_sim::link::Rate;
use leadscrew_sim::profile::{Axes, Belts, Door, Limits, Place, Profile, Stops};
use leadscrew_sim::scene::MOVE_BYTES;
use leadscrew_sim::speed_profile::Recorder;
use std::io::{self, BufReader, Cursor, Read};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::Arc;
use std::time::Duration;

/// How often it is told how far a job has been timed.
const TELL: Duration = Duration::from_millis(100);

/// Moves that are handed over at a time.
const AT_ONCE: usize = 100_000;

/// Looks at jobs with this program's own `check` and `profile`.
pub(super) struct Desk {
    /// The machine of the page.
    file: Profile,
}

impl Desk {
    /// Checks and times jobs for this machine. The present places of its carriages and switches do not count.
    pub(super) fn new(machine: &Profile) -> Self {
        let mut file = machine.clone();
        // The recorder knows motors that turn one axis each.
        file.kinematics = Belts::Cartesian;
        (file.second_motor, file.probe) = (None, None);
        file.door = Door::default();
        let Axes {
            x,
            y,
            z,
            a,
            b,
            c,
            e,
        } = &mut file.axes;
        for axis in [x, y, z].into_iter().chain(a).chain(b).chain(c).chain(e) {
            axis.limits = Limits::default();
            axis.start = Place::default();
            axis.stops = Stops::default();
        }
        Self { file }
    }
}

impl Workshop for Desk {
    fn look(&self, job: &Job, go_on: &dyn Fn() -> bool, tell: &mut dyn FnMut(Finding)) {
        let machine = Machine::from_listing(&job.settings, self.file.clone());
        let Ok(checked) = check(job, &machine) else {
            return;
        };
        for part in checked.scene.chunks(AT_ONCE * MOVE_BYTES) {
            tell(Finding::Scene(part.to_vec()));
        }
        tell(Finding::Check(checked.json));
        if checked.is_clean && go_on() {
            time(job, &machine, go_on, tell);
        }
    }
}

/// The result of a check.
struct Checked {
    scene: Vec<u8>,
    json: String,
    is_clean: bool,
}

fn check(job: &Job, machine: &Machine) -> io::Result<Checked> {
    let mut checker = follow(&job.name, machine);
    let origin: [f32; 3] = std::array::from_fn(|axis| job.origin.get(axis).copied().unwrap_or(0.0));
    // Where the machine has no home, it does not know where its travel ends.
    let has_home = machine.settings.is_on(Setting::Homing);
    let zero = if has_home { origin } else { [0.0; 3] };
    if has_home {
        checker.begin_at(origin.map(Coordinate::from_mm));
    }
    checker.draw();
    let report = read_through(&mut *checker, &job.name, Cursor::new(&job.text), |_| {})?;
    let mut scene = Vec::with_capacity(checker.path().moves().len() * MOVE_BYTES);
    for one in checker.path().moves() {
        let mut one = *one;
        for (place, zero) in one.to.iter_mut().zip(zero) {
            *place -= zero;
        }
        one.write(&mut scene);
    }
    let json = serde_json::to_string(&report.json()).unwrap_or_default();
    Ok(Checked {
        scene,
        json,
        is_clean: report.error_count == 0,
    })
}

/// Runs the job on a machine of its own. Tells the progress, and at the end the uses of the time.
fn time(job: &Job, machine: &Machine, go_on: &dyn Fn() -> bool, tell: &mut dyn FnMut(Finding)) {
    let shared = Arc::new(Shared::default());
    let size = job.text.len().max(1);
    std::thread::scope(|scope| {
        let timed = scope.spawn(|| run(job, machine, &shared));
        while !timed.is_finished() {
            std::thread::sleep(TELL);
            if !go_on() {
                shared.stop.store(true, Ordering::Relaxed);
            }
            let done = shared.read.load(Ordering::Relaxed);
            tell(Finding::Progress((done * 100 / size).min(100) as u8));
        }
        if let Ok(Some(profile)) = timed.join() {
            tell(Finding::Profile(profile));
        }
    });
}

/// The profile as JSON; `None` where it was given up.
fn run(job: &Job, machine: &Machine, shared: &Arc<Shared>) -> Option<String> {
    let mut settings = without_lead(machine).settings;
    // The job begins at machine position 0 here: its time is the same wherever it begins.
    for setting in [Setting::SoftLimits, Setting::Homing] {
        settings.load(Entry {
            number: Key::Machine(setting).number(),
            value: Number::from_int(0),
        });
    }
    let machine = machine.with(&settings);
    let stream = Stream {
        machine: &machine,
        rate: Rate::NeverWaits,
        keep_going: false,
        quiet: true,
        mute: true,
        feed_percent: 100,
        keep_answers: true,
        warn: false,
    };
    let text = Watched {
        text: Cursor::new(job.text.clone()),
        shared: Arc::clone(shared),
    };
    let input = Input {
        name: job.name.clone(),
        size: Some(job.text.len() as u64),
        text: Box::new(BufReader::new(text)),
    };
    let recorder = Recorder::new(limits_of(&machine));
    let done = stream.run(input, recorder).ok()?;
    Some(ProfileReport::new(&job.name, machine.file.letters(), done).json(true))
}

/// The state shared by the thread that runs a job and the thread that waits for it.
#[derive(Default)]
struct Shared {
    read: AtomicUsize,
    stop: AtomicBool,
}

/// A job's text that notes how much of it was read, and ends where it is to.
struct Watched {
    text: Cursor<Vec<u8>>,
    shared: Arc<Shared>,
}

impl Read for Watched {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if self.shared.stop.load(Ordering::Relaxed) {
            return Err(io::ErrorKind::ConnectionAborted.into());
        }
        let count = self.text.read(bytes)?;
        self.shared.read.fetch_add(count, Ordering::Relaxed);
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(text: &str, settings: &str, origin: [f32; 3]) -> Vec<Finding> {
        look_for("", text, settings, origin)
    }

    /// Looks at a job for the machine of this file.
    fn look_for(file: &str, text: &str, settings: &str, origin: [f32; 3]) -> Vec<Finding> {
        let file = Profile::parse(std::path::Path::new("test.toml"), file).unwrap();
        let job = Job {
            name: "test.nc".to_owned(),
            text: text.as_bytes().to_vec(),
            settings: settings.to_owned(),
            origin: origin.to_vec(),
        };
        let mut found = Vec::new();
        Desk::new(&file).look(&job, &|| true, &mut |finding| found.push(finding));
        found
    }

    fn check_of(found: &[Finding]) -> serde_json::Value {
        let json = found.iter().find_map(|finding| match finding {
            Finding::Check(json) => Some(json),
            _ => None,
        });
        serde_json::from_str(json.unwrap()).unwrap()
    }

    #[test]
    fn a_job_is_drawn_checked_and_timed_in_this_order() {
        let found = look("G1X10F300\n", "", [0.0; 3]);
        let Finding::Scene(scene) = &found[0] else {
            panic!("{found:?}")
        };
        assert_eq!(scene.len(), 2 * MOVE_BYTES);
        assert!(check_of(&found)["errors"].as_array().unwrap().is_empty());
        let Some(Finding::Profile(json)) = found.last() else {
            panic!("{found:?}")
        };
        let profile: serde_json::Value = serde_json::from_str(json).unwrap();
        // 10 mm at 5 mm/s, with ramps of 10 mm/s².
        let ideal = 10.0 / 5.0 + 5.0 / 10.0;
        let seconds = profile["job_seconds"].as_f64().unwrap();
        assert!((seconds - ideal).abs() < 0.05, "{seconds} {ideal}");
    }

    #[test]
    fn a_job_with_errors_is_drawn_and_not_timed() {
        let found = look("G1X10\n", "", [0.0; 3]);
        assert_eq!(check_of(&found)["errors"][0]["line"], 1);
        assert!(!found
            .iter()
            .any(|finding| matches!(finding, Finding::Profile(_))));
    }

    #[test]
    fn soft_limits_count_from_where_work_zero_is() {
        let settings = "$22=1\n$20=1\n$130=200\n";
        let inside = look("G0X50\n", settings, [-100.0, -100.0, -10.0]);
        assert!(check_of(&inside)["errors"].as_array().unwrap().is_empty());
        let outside = look("G0X150\n", settings, [-100.0, -100.0, -10.0]);
        assert_eq!(check_of(&outside)["errors"][0]["line"], 1);
    }

    #[test]
    fn a_job_is_looked_at_for_the_machine_of_the_page() {
        let file = "[axes.e]\nlimits = {}\n[outputs]\ncount = 1\n[axes.x]\nlimits = { low = 0 }\n";
        let job = "M83\nM62P0\nG1X10E1F300\n";
        let errors = |found: &[Finding]| check_of(found)["errors"].as_array().unwrap().len();
        let found = look_for(file, job, "$21=1\n", [0.0; 3]);
        assert_eq!(errors(&found), 0, "{found:?}");
        assert!(
            matches!(found.last(), Some(Finding::Profile(_))),
            "{found:?}"
        );
        assert_eq!(errors(&look(job, "", [0.0; 3])), 3);
    }

    #[test]
    fn a_job_that_is_given_up_ends_soon() {
        let job = Job {
            name: "long.nc".to_owned(),
            text: "G1X1F500\nX0\n".repeat(100_000).into_bytes(),
            settings: String::new(),
            origin: vec![0.0; 3],
        };
        let begun = std::time::Instant::now();
        Desk::new(&Profile::default()).look(
            &job,
            &|| begun.elapsed() < Duration::from_millis(300),
            &mut |_| {},
        );
        assert!(
            begun.elapsed() < Duration::from_secs(20),
            "{:?}",
            begun.elapsed()
        );
    }
}
