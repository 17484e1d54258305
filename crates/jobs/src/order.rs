//! A job as somebody hands it over who waits for its analysis.

use crate::checker::Ask;
use leadscrew_gcode::Number;
use leadscrew_planner::Coordinate;
use serde::{Deserialize, Serialize};
use std::num::NonZeroU32;

/// A job to be analysed.
#[derive(Clone, PartialEq, Default, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct Job {
    /// The name of its file.
    pub name: String,
    /// Its text.
    #[serde(skip)]
    pub text: Vec<u8>,
    /// The machine's settings, lines as `$$` prints them.
    pub settings: String,
    /// The place of work zero, machine position, axis by axis, mm.
    pub origin: Vec<f32>,
    /// The speed of its line, baud, if the machine has Grbl in place of this firmware: its times are
    /// then Grbl's.
    pub grbl: Option<NonZeroU32>,
    /// The place at which the job is to be begun, if only the way there is asked for.
    pub resume: Option<Resume>,
    /// The surface by which the job is bent first.
    pub level: Option<Level>,
}

/// A surface that a job is to follow, as `leadscrew level` takes it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Level {
    /// Its heights, `X,Y,Z` in each line, work coordinates, mm.
    pub heights: String,
    /// The greatest distance of a piece from the surface or from its arc, mm.
    pub tolerance: f64,
}

/// The place at which a job is begun that was broken off, as [`Ask`] has it in exact numbers.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Resume {
    /// The first line that is run, from 1.
    pub line: u64,
    /// The height at which the tool goes on its way there, Z in work coordinates, mm; without it,
    /// as high as the job has been.
    pub clearance: Option<f64>,
    /// The time for the spindle to speed up, s.
    pub spin_up: f64,
    /// The place at which the job began, in work coordinates, mm.
    pub start: Option<[f64; 3]>,
}

impl Job {
    /// Reads a job as [`Job::packed`] writes it; `None` for other bytes. Fields that are missing are
    /// empty.
    pub fn unpacked(bytes: &[u8]) -> Option<Self> {
        let end = bytes.iter().position(|byte| *byte == b'\n')?;
        let job: Self = serde_json::from_slice(&bytes[..end]).ok()?;
        let text = bytes[end + 1..].to_vec();
        Some(Self { text, ..job })
    }

    /// Returns a line of JSON, and the text.
    pub fn packed(&self) -> Vec<u8> {
        let header = serde_json::to_vec(self).unwrap_or_default();
        [&header, &b"\n"[..], &self.text].concat()
    }
}

impl Resume {
    /// The same in exact numbers, within what a machine's words take.
    pub(crate) fn ask(&self) -> Ask {
        Ask {
            line: self.line,
            clearance: self.clearance.map(|mm| Coordinate::from_nanos(nanos(mm))),
            spin_up: Number::from_nanos(nanos(self.spin_up.clamp(0.0, 3600.0))),
            start: self
                .start
                .map(|place| place.map(|mm| Coordinate::from_nanos(nanos(mm)))),
        }
    }
}

/// A value as whole thousandths, in units of 10^-9.
fn nanos(value: f64) -> i64 {
    (value.clamp(-999_999.0, 999_999.0) * 1000.0).round() as i64 * 1_000_000
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_is_read_as_it_was_written_and_what_is_missing_is_empty() {
        let job = Job {
            name: "a\n.nc".to_owned(),
            text: b"G0X1\nG0X2\n".to_vec(),
            settings: "$110=7\n".to_owned(),
            origin: vec![-7.0],
            grbl: NonZeroU32::new(115_200),
            resume: Some(Resume {
                line: 2,
                clearance: Some(5.0),
                spin_up: 3.0,
                start: None,
            }),
            level: Some(Level {
                heights: "0,0,0\n".to_owned(),
                tolerance: 0.005,
            }),
        };
        assert_eq!(Job::unpacked(&job.packed()), Some(job));
        let short = Job::unpacked(b"{\"name\": \"b\"}\nG0").unwrap();
        assert_eq!((&short.name[..], &short.text[..]), ("b", &b"G0"[..]));
        assert!(short.settings.is_empty() && short.grbl.is_none());
        assert!(short.resume.is_none() && short.level.is_none());
        assert_eq!(Job::unpacked(b"b.nc\nG0"), None);
    }

    #[test]
    fn numbers_of_a_page_are_those_of_the_command_line() {
        let resume = Resume {
            line: 3,
            clearance: Some(12.5),
            spin_up: 1e9,
            start: Some([0.1, f64::NAN, -1e12]),
        };
        let ask = resume.ask();
        assert_eq!(ask.clearance, Some(Coordinate::from_nanos(12_500_000_000)));
        assert_eq!(ask.spin_up, Number::from_int(3600));
        let start = ask.start.unwrap();
        assert_eq!(start[0], Coordinate::from_nanos(100_000_000));
        assert_eq!(start[1], Coordinate::from_nanos(0));
        assert_eq!(start[2], Coordinate::from_nanos(-999_999_000_000_000));
    }
}
