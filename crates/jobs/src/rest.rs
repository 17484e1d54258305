//! The rest of a job: it begins with a line in the middle, on a machine that stands anywhere.
//!
//! The job is followed up to that line, as `check` does. A few lines then bring the machine to the
//! place at which an uninterrupted run would be: tool up, spindle and coolant on, over the place,
//! down, modes. The job's own lines follow as they are.

use crate::checker::{follow, names_motion, Ask, RestError};
use crate::machine::Machine;
use leadscrew_gcode::{words, Letter, Word};
use leadscrew_sim::program::Next;
use leadscrew_sim::streamer::Lines;
use std::io::{self, BufRead};

/// The rest of a job.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Rest {
    /// Lines that bring the machine to the job's place.
    pub preamble: Vec<String>,
    /// The job's own lines.
    pub lines: Vec<Vec<u8>>,
}

/// Makes the rest of a job called `name`.
///
/// # Errors
/// If its text cannot be read; within, why the job cannot be begun there.
pub fn rest_of(
    machine: &Machine,
    name: &str,
    text: impl BufRead,
    ask: &Ask,
) -> io::Result<Result<Rest, RestError>> {
    let mut checker = follow(name, machine);
    checker.stand(ask.start);
    let mut lines = Lines::new(text);
    let mut raw = Vec::new();
    loop {
        match lines.next(&mut raw, &())? {
            Next::Line => {}
            Next::End => return Ok(Err(RestError::NoSuchLine(lines.number()))),
            Next::Begins | Next::Fault(_) => return Ok(Err(RestError::Program)),
        }
        if lines.number() >= ask.line.max(1) {
            break;
        }
        let found = checker.check(lines.number(), &raw);
        if let Some(complaint) = found.filter(|complaint| !complaint.fault.is_remark()) {
            return Ok(Err(RestError::Refused(complaint.to_string())));
        }
    }
    let mut rest = vec![raw.clone()];
    loop {
        match lines.next(&mut raw, &())? {
            Next::Line => rest.push(raw.clone()),
            Next::End => break,
            Next::Begins | Next::Fault(_) => return Ok(Err(RestError::Program)),
        }
    }
    let preamble = match checker.preamble(ask) {
        Ok(preamble) => preamble,
        Err(error) => return Ok(Err(error)),
    };
    let begun = checker.motion_line().filter(|_| goes_on(&rest));
    if let Some(line) = begun {
        return Ok(Err(RestError::GoesOn(line)));
    }
    Ok(Ok(Rest {
        preamble,
        lines: rest,
    }))
}

/// Returns true if the first of these lines that moves an axis leaves its motion to a line before.
fn goes_on(lines: &[Vec<u8>]) -> bool {
    for line in lines.iter().filter(|line| !line.starts_with(b"$")) {
        let words: Vec<Word> = words(line).flatten().collect();
        if names_motion(&words) {
            return false;
        }
        let is_place = |word: &Word| matches!(word.letter().as_char(), 'A'..='C' | 'E' | 'I'..='K' | 'R' | 'X'..='Z');
        let stays = words.iter().any(|word| {
            word.letter() == Letter::G && matches!(word.value().trunc(), 10 | 28 | 30 | 43 | 92)
        });
        if words.iter().any(is_place) && !stays {
            return true;
        }
    }
    false
}
