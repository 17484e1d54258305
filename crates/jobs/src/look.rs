//! Analyses a job for somebody who waits for the result: its path, the findings of a check, and
//! where its time goes.

use crate::check::read_through;
use crate::checker::{follow, Follow, RestError};
use crate::foreign::{unix_lines, Foreign};
use crate::machine::Machine;
use crate::order::{Job, Level, Resume};
use crate::profile::{limits_of, without_lead, ProfileReport};
use crate::rest::rest_of;
use crate::stream::Stream;
use leadscrew_gcode::Number;
use leadscrew_import::level::{self, Map};
use leadscrew_import::Faults;
use leadscrew_machine::settings::table::Setting;
use leadscrew_machine::settings::values::{Entry, Key};
use leadscrew_planner::Coordinate;
use leadscrew_sim::link::Rate;
use leadscrew_sim::profile::{Axes, Door, Limits, Place, Profile, Stops};
use leadscrew_sim::program::Next;
use leadscrew_sim::scene::MOVE_BYTES;
use leadscrew_sim::speed_profile::Recorder;
use leadscrew_sim::streamer::Lines;
use serde_json::{json, Value};
use std::io::{self, BufReader, Read};

/// Plain lines that a program may come to, as many as a page takes.
const MOST_LINES: usize = 1_000_000;

/// Moves in one [`Finding::Scene`] at most.
const AT_ONCE: usize = 100_000;

/// Bytes of a job that are read at a time. Before each read, the caller is asked whether to go on.
const READ: usize = 1024;

/// Bytes at the start of a job that show whether it is a file of another machine.
const HEAD: usize = 4096;

/// A result about a job. The kinds come in this order, and [`Finding::Progress`] many times; of a
/// job that is to be begun at a line comes [`Finding::Rest`] alone.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Finding {
    /// The job is a file of another machine, or is bent by a surface, and what follows is about the
    /// G-code made of it: JSON with its `text`, and `notes` for the user; or with `refused`, the
    /// words why there is none, and nothing follows. With `level` if it was to be bent.
    Taken(String),
    /// Moves of the job in work coordinates: [`Drawn`](leadscrew_sim::scene::Drawn)s.
    Scene(Vec<u8>),
    /// The output of `leadscrew check --json`, with extents in work coordinates as the scene's.
    ///
    /// With `zero_moved`, the way in mm by which the job itself moves its zero.
    Check(String),
    /// The plain lines of a program without an error, for whoever sends it: JSON with `lines`, and
    /// `numbers`, the line of the file of each; or with `refused`, the words why there are none.
    Plain(String),
    /// The share of the job that has been timed, percent.
    Progress(u8),
    /// The output of `leadscrew profile --json`. With `course`: lines and seconds in the order of time,
    /// line 0 at rest.
    Profile(String),
    /// The way to the place at which the job stands at a line: JSON with the lines, `preamble`;
    /// or with `refused`, the words why the job cannot be begun there; and `resume`, what was asked.
    Rest(String),
}

/// Analyses jobs for one machine.
#[derive(Clone, Debug)]
pub struct Workshop {
    /// The machine, whose switches and places are not known.
    file: Profile,
    /// The machine as its file has it, for jobs that home it.
    whole: Profile,
}

impl Workshop {
    /// Prepares the analysis of jobs for this machine. The present places of its carriages and
    /// switches are ignored.
    pub fn new(machine: &Profile) -> Self {
        let mut file = machine.clone();
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
        let whole = machine.clone();
        Self { file, whole }
    }

    /// Analyses a job and hands over each finding at once. Ends soon after `go_on` returns false.
    pub fn look(&self, job: &Job, go_on: &dyn Fn() -> bool, tell: &mut dyn FnMut(Finding)) {
        if let Some(resume) = &job.resume {
            return tell(Finding::Rest(self.rest(job, resume)));
        }
        if let Some(level) = &job.level {
            return match bent(job, level) {
                Ok((made, json)) => {
                    tell(Finding::Taken(json));
                    self.look_at(&made, go_on, tell);
                }
                Err(words) => tell(Finding::Taken(
                    json!({"refused": words, "level": true}).to_string(),
                )),
            };
        }
        match self.taken(job) {
            Ok(None) => self.look_at(job, go_on, tell),
            Ok(Some((made, json))) => {
                tell(Finding::Taken(json));
                self.look_at(&made, go_on, tell);
            }
            Err(words) => tell(Finding::Taken(json!({"refused": words}).to_string())),
        }
    }

    /// The job that is made of a file of another machine, and what pages are told of it; `None` for
    /// G-code.
    fn taken(&self, job: &Job) -> Result<Option<(Job, String)>, String> {
        let head = job.text.get(..HEAD).unwrap_or(&job.text);
        let Some(kind) = Foreign::of(head) else {
            return Ok(None);
        };
        let machine = Machine::from_listing(&job.settings, self.whole.clone());
        let made = kind.job(&job.name, &job.text, &machine)?;
        let text = made.lines.join("\n") + "\n";
        let told = json!({"text": text, "notes": made.notes}).to_string();
        let job = Job {
            text: text.into_bytes(),
            ..job.clone()
        };
        Ok(Some((job, told)))
    }

    /// Returns what pages are told of the rest of a job.
    fn rest(&self, job: &Job, resume: &Resume) -> String {
        let machine = Machine::from_listing(&job.settings, self.whole.clone());
        let mut told = match rest_of(&machine, &job.name, &job.text[..], &resume.ask()) {
            Ok(Ok(rest)) => json!({"preamble": rest.preamble}),
            Ok(Err(RestError::FromStart { axis, line })) => {
                let words = format!("line {line} counts {axis} from where the job began: name it");
                json!({ "refused": words })
            }
            Ok(Err(error)) => json!({"refused": error.to_string()}),
            Err(error) => json!({"refused": error.to_string()}),
        };
        told["resume"] = json!(resume);
        told.to_string()
    }

    fn look_at(&self, job: &Job, go_on: &dyn Fn() -> bool, tell: &mut dyn FnMut(Finding)) {
        let machine = Machine::from_listing(&job.settings, self.file.clone());
        let Ok(checked) = check(job, &machine) else {
            return;
        };
        for part in checked.scene.chunks(AT_ONCE * MOVE_BYTES) {
            tell(Finding::Scene(part.to_vec()));
        }
        tell(Finding::Check(checked.json));
        if checked.is_clean && checked.is_program {
            tell(Finding::Plain(plain_lines(job, &machine)));
        }
        if checked.is_clean && go_on() {
            let homes = homes(&job.text);
            let machine = match homes {
                true => Machine::from_listing(&job.settings, self.whole.clone()),
                false => machine,
            };
            time(job, &machine, homes, go_on, tell);
        }
    }
}

/// The job bent by a surface, and what pages are told of it.
fn bent(job: &Job, level: &Level) -> Result<(Job, String), String> {
    let map = Map::read(&level.heights, [0.0; 3]).map_err(|faults| words(&faults, "the map"))?;
    let text = unix_lines(&job.text);
    let tolerance = level.tolerance.clamp(0.0005, 1.0);
    let made = level::job(&text, &map, tolerance).map_err(|faults| words(&faults, "the job"))?;
    let text = made.lines.join("\n") + "\n";
    let note = format!("bent by a map, to {tolerance} mm; {}", map.accuracy());
    let told = json!({"text": text, "notes": [note], "level": true}).to_string();
    let job = Job {
        text: text.into_bytes(),
        ..job.clone()
    };
    Ok((job, told))
}

/// The first of these faults in words, and how many more there are.
fn words(faults: &Faults, name: &str) -> String {
    let Some(first) = faults.0.first() else {
        return format!("{name} cannot be used");
    };
    let more = match faults.0.len() {
        1 => String::new(),
        all => format!(", and {} more", all - 1),
    };
    format!("line {} of {name}: {}{more}", first.line, first.message)
}

/// The result of a check.
struct Checked {
    scene: Vec<u8>,
    json: String,
    is_clean: bool,
    is_program: bool,
}

/// Follows a job from the place of its zero; returns that place too, mm.
fn follow_job(job: &Job, machine: &Machine) -> io::Result<(Box<dyn Follow>, [f32; 3])> {
    let mut checker = follow(&job.name, machine);
    // A machine without homing does not know where its travel ends.
    if !machine.settings.is_on(Setting::Homing) {
        return Ok((checker, [0.0; 3]));
    }
    let origin: [f32; 3] = std::array::from_fn(|axis| job.origin.get(axis).copied().unwrap_or(0.0));
    let places = origin.map(Coordinate::from_mm);
    if places.contains(&None) {
        return Err(io::Error::other("work zero is no place in mm"));
    }
    checker.begin_at(places.map(Option::unwrap_or_default));
    Ok((checker, origin))
}

/// Returns what pages are told of a program's plain lines.
fn plain_lines(job: &Job, machine: &Machine) -> String {
    let told = match run_through(job, machine) {
        Ok((lines, numbers)) => json!({"lines": lines, "numbers": numbers}),
        Err(words) => json!({ "refused": words }),
    };
    told.to_string()
}

/// Runs a program for its plain lines, and the line of the file of each.
fn run_through(job: &Job, machine: &Machine) -> Result<(Vec<String>, Vec<u64>), String> {
    let words = |error: io::Error| error.to_string();
    let (mut checker, _) = follow_job(job, machine).map_err(words)?;
    let mut source = Lines::new(&job.text[..]);
    let (mut lines, mut numbers, mut line) = (Vec::new(), Vec::new(), Vec::new());
    loop {
        match source.next(&mut line, checker.world()).map_err(words)? {
            Next::Line => {}
            Next::Begins => continue,
            Next::Fault(fault) => return Err(fault.kind.to_string()),
            Next::End => break,
        }
        let number = source.number();
        checker.check(number, &line);
        if lines.len() == MOST_LINES {
            return Err(format!("it comes to more than {MOST_LINES} plain lines"));
        }
        lines.push(String::from_utf8_lossy(&line).into_owned());
        numbers.push(number);
    }
    match source.asks() {
        Some(line) => Err(format!(
            "line {line} reads a place, an offset, a tool or a probe, which are not known before \
             the machine is there"
        )),
        None => Ok((lines, numbers)),
    }
}

fn check(job: &Job, machine: &Machine) -> io::Result<Checked> {
    let (mut checker, begin) = follow_job(job, machine)?;
    checker.draw();
    let mut report = read_through(&mut *checker, &job.name, &job.text[..], |_| {})?;
    // A program may set its zero itself, such as by G92 behind $H.
    let zero = checker.zero();
    report.count_from(zero);
    let mut scene = Vec::with_capacity(checker.path().moves().len() * MOVE_BYTES);
    for one in checker.path().moves() {
        let mut one = *one;
        for (place, zero) in one.to.iter_mut().zip(zero) {
            *place -= zero;
        }
        one.write(&mut scene);
    }
    let mut json = serde_json::to_value(report.json()).unwrap_or_default();
    json["zero_moved"] = json!([0, 1, 2].map(|axis: usize| zero[axis] - begin[axis]));
    let json = json.to_string();
    Ok(Checked {
        scene,
        json,
        is_clean: report.error_count == 0,
        is_program: report.is_program(),
    })
}

/// Returns true if a job homes the machine.
fn homes(text: &[u8]) -> bool {
    let begins = |line: &[u8]| {
        let mut bare = line.iter().filter(|byte| !byte.is_ascii_whitespace());
        bare.next() == Some(&b'$') && matches!(bare.next(), Some(b'H' | b'h'))
    };
    text.split(|byte| matches!(byte, b'\n' | b'\r')).any(begins)
}

/// Runs the job on a machine of its own, as `run` does if it `homes`. Reports the progress, and
/// at the end where the time went.
fn time(
    job: &Job,
    machine: &Machine,
    homes: bool,
    go_on: &dyn Fn() -> bool,
    tell: &mut dyn FnMut(Finding),
) {
    let mut settings = without_lead(machine).settings;
    // A job that does not home begins at machine position 0 here: it takes the same time wherever it
    // begins.
    let unknown = [Setting::SoftLimits, Setting::Homing];
    for setting in unknown.into_iter().filter(|_| !homes) {
        settings.load(Entry {
            number: Key::Machine(setting).number(),
            value: Number::from_int(0),
        });
    }
    let (machine, rate) = match job.grbl {
        Some(baud) => (machine.with(&settings).as_grbl(), Rate::Baud(baud)),
        None => (machine.with(&settings), Rate::NeverWaits),
    };
    let stream = Stream {
        machine: &machine,
        rate,
        keep_going: false,
        feed_percent: 100,
        keep_answers: true,
        warn: false,
        only_times: false,
        knows_place: false,
        tell: |_| {},
    };
    let text = Watched {
        size: job.text.len(),
        rest: &job.text,
        told: 0,
        go_on,
        tell,
    };
    let recorder = Recorder::new(limits_of(&machine));
    let done = stream.run(&job.name, BufReader::with_capacity(READ, text), recorder);
    // A job that was given up has no result.
    if let Ok(done) = done {
        let report = ProfileReport::new(&job.name, machine.file.letters(), done, true);
        let mut json: Value = serde_json::from_str(&report.json(true)).unwrap_or_default();
        json["course"] = json!(report.course());
        tell(Finding::Profile(json.to_string()));
    }
}

/// The text of a job for a reader. It reports how much was read, and ends early if `go_on`
/// returns false.
struct Watched<'a> {
    size: usize,
    rest: &'a [u8],
    /// The percentage that was reported last.
    told: u8,
    go_on: &'a dyn Fn() -> bool,
    tell: &'a mut dyn FnMut(Finding),
}

impl Read for Watched<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if !(self.go_on)() {
            return Err(io::ErrorKind::ConnectionAborted.into());
        }
        let done = (self.size - self.rest.len()) * 100 / self.size.max(1);
        if done > usize::from(self.told) {
            self.told = done as u8;
            (self.tell)(Finding::Progress(self.told));
        }
        self.rest.read(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::num::NonZeroU32;
    use std::time::Duration;

    fn look(text: &str, settings: &str, origin: [f32; 3]) -> Vec<Finding> {
        look_for("", text, settings, origin)
    }

    /// Analyses a job for the machine of this file.
    fn look_for(file: &str, text: &str, settings: &str, origin: [f32; 3]) -> Vec<Finding> {
        let file = Profile::parse(std::path::Path::new("test.toml"), file).unwrap();
        let job = Job {
            name: "test.nc".to_owned(),
            text: text.as_bytes().to_vec(),
            settings: settings.to_owned(),
            origin: origin.to_vec(),
            ..Job::default()
        };
        let mut found = Vec::new();
        Workshop::new(&file).look(&job, &|| true, &mut |finding| found.push(finding));
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
        let course = profile["course"].as_array().unwrap().iter();
        let whole: f64 = course.map(|part| part[1].as_f64().unwrap()).sum();
        assert!((whole - profile["job_seconds"].as_f64().unwrap()).abs() < 1e-6);
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
    fn a_job_that_homes_is_timed_and_drawn_with_the_machine_s_switches() {
        let file = "[homing]\non = true\nfeed_mm_min = 200\nseek_mm_min = 2000\n[axes.x]\nstart = -5\nlimits = { high = 0 }\n\
                    [axes.y]\nstart = -5\nlimits = { high = 0 }\n[axes.z]\nstart = -5\nlimits = { high = 0 }\n";
        let found = look_for(
            file,
            " $h\nG91G1X-10F300\n",
            "$22=1\n$24=200\n$25=2000\n",
            [0.0; 3],
        );
        let Finding::Scene(scene) = &found[0] else {
            panic!("{found:?}")
        };
        assert!(scene.len() >= 2 * MOVE_BYTES);
        let Some(Finding::Profile(json)) = found.last() else {
            panic!("{found:?}")
        };
        let profile: serde_json::Value = serde_json::from_str(json).unwrap();
        // The cut alone takes 2.5 s, and no axis homes within a second.
        let seconds = profile["job_seconds"].as_f64().unwrap();
        assert!(seconds > 3.5, "{seconds}");
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
    fn a_job_that_sets_its_zero_is_told_in_its_own_coordinates() {
        // G92 says that machine position 0 is X10: zero is at -10.
        for (settings, origin) in [("", [0.0; 3]), ("$22=1\n$130=200\n", [-50.0, 0.0, 0.0])] {
            let found = look("G53G0X0\nG92X10\nG1X5F300\n", settings, origin);
            let checked = check_of(&found);
            let x = &checked["extents"]["x"];
            assert_eq!([&x["min"], &x["max"]], [5.0, 10.0], "{checked}");
            assert_eq!(checked["zero_moved"][0], -10.0 - origin[0], "{checked}");
            assert_eq!(checked["zero_moved"][2], 0.0, "{checked}");
        }
    }

    /// The plain lines that pages are told.
    fn plain_of(found: &[Finding]) -> Option<serde_json::Value> {
        let json = found.iter().find_map(|finding| match finding {
            Finding::Plain(json) => Some(json),
            _ => None,
        });
        json.map(|json| serde_json::from_str(json).unwrap())
    }

    #[test]
    fn a_program_comes_with_its_plain_lines_unless_it_reads_the_machine() {
        let holes = "G21\no1 repeat [2]\n#1=[#1+5] (next)\nG0X#1\no1 endrepeat\nM2\nG0X99\n";
        let plain = plain_of(&look(holes, "", [0.0; 3])).unwrap();
        let lines: Vec<&str> = plain["lines"]
            .as_array()
            .unwrap()
            .iter()
            .filter_map(|line| line.as_str())
            .collect();
        assert_eq!(lines, ["G21", "G0X5", "G0X10", "M2"]);
        assert_eq!(plain["numbers"], json!([1, 4, 4, 6]));
        // A mode is one of its own lines; a place is not.
        let modes = plain_of(&look("G0X[1+#<_metric>]\n", "", [0.0; 3])).unwrap();
        assert_eq!(modes["lines"], json!(["G0X2"]));
        for asks in ["#5420", "#<_abs_x>", "#5221", "#5061", "#5400"] {
            let plain = plain_of(&look(&format!("G21\nG0X[1+{asks}]\n"), "", [0.0; 3])).unwrap();
            let words = plain["refused"].as_str().unwrap();
            assert!(words.starts_with("line 2 reads a place"), "{asks}: {words}");
        }
        for none in ["G0X1\n", "G0X[1/0]\n", "#1=1\nG1X2\n"] {
            assert_eq!(plain_of(&look(none, "", [0.0; 3])), None, "{none}");
        }
        let endless = "o1 while [1]\nG0X1\no1 endwhile\n";
        assert_eq!(plain_of(&look(endless, "", [0.0; 3])), None);
    }

    #[test]
    fn a_drill_file_is_taken_as_a_job_or_refused_with_what_the_machine_lacks() {
        let holes = "M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y2.0\nX5.0Y2.0\nM30\n";
        let file = "[tool_change]\n[drill]\ndepth_mm = -1.8\nfeed_mm_min = 120\n";
        let found = look_for(file, holes, "", [0.0; 3]);
        let Finding::Taken(json) = &found[0] else {
            panic!("{found:?}")
        };
        let taken: serde_json::Value = serde_json::from_str(json).unwrap();
        let text = taken["text"].as_str().unwrap();
        assert!(text.contains("Z-1.8"), "{text}");
        let lines = text.lines().count() as u64;
        assert!(taken["notes"][0].as_str().unwrap().contains("Excellon"));
        let checked = check_of(&found[1..]);
        assert_eq!(
            (&checked["lines"], &checked["error_count"]),
            (&lines.into(), &0.into())
        );
        let found = look(holes, "", [0.0; 3]);
        let [Finding::Taken(json)] = &found[..] else {
            panic!("{found:?}")
        };
        assert!(
            json.contains("refused") && json.contains("depth_mm"),
            "{json}"
        );
    }

    #[test]
    fn extents_are_those_of_the_picture() {
        let settings = "$22=1\n$130=200\n$131=200\n";
        let found = look("G1X50F300\n", settings, [-100.0, -50.0, -10.0]);
        let extents = &check_of(&found)["extents"];
        let of = |axis: &str, end: &str| extents[axis][end].as_f64().unwrap();
        assert!(
            of("x", "min").abs() < 1e-6 && (of("x", "max") - 50.0).abs() < 1e-6,
            "{extents}"
        );
        assert!(
            of("y", "max").abs() < 1e-6 && of("z", "min").abs() < 1e-6,
            "{extents}"
        );
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
    fn a_job_for_a_board_with_grbl_takes_as_long_as_grbl_took() {
        // Recorded: tests/conformance/traces/laser_raster_m4.json.
        let folder = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../tests/conformance/traces"
        );
        let read = |name: &str| std::fs::read_to_string(format!("{folder}/{name}")).unwrap();
        let recorded: serde_json::Value =
            serde_json::from_str(&read("laser_raster_m4.json")).unwrap();
        let settings = recorded["settings"].as_object().unwrap().iter();
        let job = Job {
            text: read("laser_raster_m4.nc").into_bytes(),
            settings: settings
                .map(|(key, value)| format!("{key}={value}\n"))
                .collect(),
            grbl: NonZeroU32::new(115_200),
            ..Job::default()
        };
        let mut seconds = [0.0; 2];
        for (seconds, grbl) in seconds.iter_mut().zip([job.grbl, None]) {
            let job = Job {
                grbl,
                ..job.clone()
            };
            Workshop::new(&Profile::default()).look(&job, &|| true, &mut |finding| {
                if let Finding::Profile(json) = finding {
                    let profile: serde_json::Value = serde_json::from_str(&json).unwrap();
                    *seconds = profile["job_seconds"].as_f64().unwrap();
                }
            });
        }
        let grbl = recorded["first_to_last_step_s"].as_f64().unwrap();
        assert!((seconds[0] / grbl - 1.0).abs() < 0.03, "{seconds:?} {grbl}");
        assert!((seconds[1] / grbl - 1.0).abs() > 0.05, "{seconds:?} {grbl}");
    }

    #[test]
    fn the_rest_of_a_job_is_what_the_command_line_makes() {
        let text = "G21 G90\nM3 S9000\nG0 X5 Y5 Z2\nG1 Z-1 F300\nG1 X25 F900\nM5\n";
        let rest = |line, text: &str| {
            let job = Job {
                text: text.as_bytes().to_vec(),
                resume: Some(Resume {
                    line,
                    clearance: Some(4.0),
                    spin_up: 2.0,
                    start: None,
                }),
                ..Job::default()
            };
            let mut found = Vec::new();
            Workshop::new(&Profile::default())
                .look(&job, &|| true, &mut |finding| found.push(finding));
            let [Finding::Rest(json)] = &found[..] else {
                panic!("{found:?}")
            };
            serde_json::from_str::<serde_json::Value>(json).unwrap()
        };
        let preamble = rest(5, text)["preamble"].to_string();
        for part in ["S9000", "G4 P2", "X5 Y5", "Z-1"] {
            assert!(preamble.contains(part), "{part}: {preamble}");
        }
        let refused = rest(9, text)["refused"].to_string();
        assert!(refused.contains("the job has 6 lines"), "{refused}");
        let from = rest(3, "G91\nG1X5F100\nX5\n")["refused"].to_string();
        assert!(from.contains("from where the job began"), "{from}");
        assert!(!from.contains("--start"), "{from}");
    }

    #[test]
    fn a_job_is_bent_by_a_map_and_then_checked_or_refused_in_words() {
        let look = |text: &str, heights: &str| {
            let job = Job {
                text: text.as_bytes().to_vec(),
                level: Some(Level {
                    heights: heights.to_owned(),
                    tolerance: 0.005,
                }),
                ..Job::default()
            };
            let mut found = Vec::new();
            Workshop::new(&Profile::default())
                .look(&job, &|| true, &mut |finding| found.push(finding));
            let Finding::Taken(json) = &found[0] else {
                panic!("{found:?}")
            };
            let taken: serde_json::Value = serde_json::from_str(json).unwrap();
            assert_eq!(taken["level"], true);
            (taken, found)
        };
        let text = "G0 X0 Y0 Z1\nG1 Z-1 F100\nX10 Y10\n";
        let (taken, found) = look(text, "0,0,0\n10,0,1\n0,10,1\n10,10,2\n");
        let bent = taken["text"].as_str().unwrap();
        assert!(bent.ends_with("G1 X10 Y10 Z1\n"), "{bent}");
        assert!(taken["notes"][0]
            .as_str()
            .unwrap()
            .contains("three columns"));
        assert_eq!(check_of(&found)["extents"]["z"]["max"], 1.0);
        for (text, heights, why) in [
            (text, "", "line 1 of the map: no place stands in it"),
            (text, "0,0,0\n1,0,0\n", "line 1 of the map: expected a grid"),
            (
                text,
                "0,0,0\n5,0,0\n0,5,0\n5,5,0\n",
                "line 3 of the job: X10.000 Y10.000 lies outside",
            ),
            ("G18\nG19\n", "0,0,0\n5,0,0\n0,5,0\n5,5,0\n", "and 1 more"),
        ] {
            let (taken, found) = look(text, heights);
            let words = taken["refused"].as_str().unwrap();
            assert!(words.contains(why), "{words}");
            assert_eq!(found.len(), 1, "the job stays as it is");
        }
    }

    #[test]
    fn a_job_that_is_given_up_ends_soon() {
        let job = Job {
            name: "long.nc".to_owned(),
            text: "G1X1F500\nX0\n".repeat(100_000).into_bytes(),
            settings: String::new(),
            origin: vec![0.0; 3],
            ..Job::default()
        };
        let begun = std::time::Instant::now();
        Workshop::new(&Profile::default()).look(
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
