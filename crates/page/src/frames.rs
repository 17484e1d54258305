//! The frames between pages and the program that runs the machine. The first byte of a frame is its
//! kind.
//!
//! ```text
//!   to a page      tag, content                          one WebSocket message each; numbers little-endian
//!   from a page    tag, length (u32), content            in messages of any size
//! ```

use leadscrew_jobs::Finding;
use leadscrew_machine::board::SpindleOutput;
use leadscrew_sim::powered::Snapshot;
use serde_json::{json, Value};

/// The longest content of a frame from a page, bytes: a job of 32 MB, as pages take it, and its
/// name.
const LONGEST: usize = 33_000_000;

/// The content of a frame to a page.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Tag {
    /// Bytes on a serial line of the machine: channel; 1 if the machine sent them, else 0; a byte
    /// 0; the number of answers before them (u32); the bytes.
    Wire = 1,
    /// The machine's state at an instant.
    State = 2,
    /// Moves: 3 bytes 0, the number of the first move (u32), and 20 bytes for each move. They
    /// replace the planned moves from this number on.
    Moves = 3,
    /// The machine's parts, as JSON.
    Hello = 4,
    /// The rights of the page, as JSON.
    Role = 5,
    /// A message, text.
    Note = 6,
    /// Moves of the job that is analysed: 7 bytes 0, and 20 bytes for each move.
    Scene = 7,
    /// The output of `leadscrew check --json` for the job.
    Check = 8,
    /// The output of `leadscrew profile --json` for the job.
    Profile = 9,
    /// The share of the job that has been timed, in percent, as text.
    Progress = 10,
    /// All settings, as JSON.
    Settings = 11,
    /// The G-code that was made of a dropped file of another machine, or why there is none, as JSON.
    Taken = 12,
    /// The way to a line of the job, or the reason why there is none, as JSON.
    Rest = 13,
    /// The plain lines of a program, or why there are none, as JSON.
    Plain = 14,
}

/// Makes a frame of a tag and its content.
pub(crate) fn frame(tag: Tag, content: &[u8]) -> Vec<u8> {
    let mut frame = Vec::with_capacity(1 + content.len());
    frame.push(tag as u8);
    frame.extend_from_slice(content);
    frame
}

/// Makes the frame for bytes on a serial line of the machine.
pub(crate) fn wire(channel: usize, from_machine: bool, answers: u32, bytes: &[u8]) -> Vec<u8> {
    let mut content = vec![channel as u8, u8::from(from_machine), 0];
    content.extend(answers.to_le_bytes());
    content.extend_from_slice(bytes);
    frame(Tag::Wire, &content)
}

/// Makes the frame for moves from number `first` on.
pub(crate) fn moves(first: u32, bytes: &[u8]) -> Vec<u8> {
    let mut content = vec![0; 3];
    content.extend(first.to_le_bytes());
    content.extend_from_slice(bytes);
    frame(Tag::Moves, &content)
}

/// Makes the frame for a finding about a job.
pub fn finding(finding: &Finding) -> Vec<u8> {
    match finding {
        Finding::Taken(json) => frame(Tag::Taken, json.as_bytes()),
        Finding::Scene(moves) => scene(moves),
        Finding::Check(json) => frame(Tag::Check, json.as_bytes()),
        Finding::Plain(json) => frame(Tag::Plain, json.as_bytes()),
        Finding::Profile(json) => frame(Tag::Profile, json.as_bytes()),
        Finding::Rest(json) => frame(Tag::Rest, json.as_bytes()),
        Finding::Progress(percent) => frame(Tag::Progress, percent.to_string().as_bytes()),
    }
}

/// Makes the frame for moves of a job.
fn scene(bytes: &[u8]) -> Vec<u8> {
    let mut content = vec![0; 7];
    content.extend_from_slice(bytes);
    frame(Tag::Scene, &content)
}

/// The progress of the machine through its lines and moves.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(crate) struct Progress {
    /// Lines answered since power-up.
    pub(crate) answers: u32,
    /// The line whose move is under way; 0 for none.
    pub(crate) line: u32,
    /// Moves planned since power-up.
    pub(crate) planned: u32,
    /// Moves that are finished.
    pub(crate) done: u32,
}

/// Makes the frame for the machine's state at an instant. `quiet`: nothing is under way. `last`: the
/// alarm in force and the message that asks for something, each empty if there is none.
pub(crate) fn state(
    machine: &Snapshot,
    progress: Progress,
    (quiet, normally_closed): (bool, bool),
    last: [&str; 2],
) -> Vec<u8> {
    let levels = &machine.switches;
    // One motor for each axis, and a second motor.
    let motors = machine.position.len() + 1;
    let pressed = |motor: usize| levels.limits.contains(motor) == normally_closed;
    let bits = |pressed: &mut dyn Iterator<Item = bool>| {
        pressed
            .enumerate()
            .fold(0, |all, (bit, on)| all | u8::from(on) << bit)
    };
    let limits = bits(&mut (0..motors).map(pressed));
    let highs = [
        levels.probe,
        levels.door,
        levels.hold,
        levels.start,
        levels.reset,
    ];
    let buttons = bits(&mut highs.into_iter().map(|high| !high));
    let mut bytes = vec![Tag::State as u8, u8::from(quiet)];
    bytes.extend(machine.overrides);
    bytes.extend([limits, buttons, machine.position.len() as u8]);
    bytes.extend(machine.now.seconds().to_le_bytes());
    bytes.extend(machine.feed.to_le_bytes());
    bytes.extend(machine.power.to_le_bytes());
    for number in [
        progress.answers,
        progress.line,
        progress.planned,
        progress.done,
    ] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend(machine.seconds_queued.to_le_bytes());
    let spindle = match machine.spindle {
        SpindleOutput::Off => 0,
        SpindleOutput::Clockwise => 1,
        SpindleOutput::CounterClockwise => 2,
    };
    let coolant = u8::from(machine.coolant.flood) | u8::from(machine.coolant.mist) << 1;
    bytes.extend([spindle, coolant, 0, 0]);
    for place in machine.position.iter().chain(&machine.work_offset) {
        bytes.extend(place.to_le_bytes());
    }
    let text = format!("{}{}\n{}\n{}", machine.state, machine.own, last[0], last[1]);
    bytes.extend(text.as_bytes());
    bytes
}

/// Makes the frame for the rights of a page and the senders that are connected.
pub(crate) fn role(controls: bool, senders: &[String]) -> Vec<u8> {
    text(
        Tag::Role,
        &json!({"controls": controls, "senders": senders}),
    )
}

/// Makes a frame with JSON.
pub(crate) fn text(tag: Tag, value: &Value) -> Vec<u8> {
    frame(tag, value.to_string().as_bytes())
}

/// A message from a page.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Said {
    /// Bytes for the machine.
    Wire(Vec<u8>),
    /// A switch was pressed.
    Key(u8),
    /// A job is to be analysed, packed as [`leadscrew_jobs::Job::packed`] does. If it has no settings,
    /// it is for this machine.
    Job(Vec<u8>),
    /// The moves shown so far are to be removed.
    Clear,
}

/// Joins the pieces, of any size, in which frames from a page arrive.
#[derive(Default)]
pub struct SaidReader(Vec<u8>);

/// Bytes that the page never sends.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Nonsense;

impl SaidReader {
    /// Takes `bytes`; hands each complete message to `each`.
    ///
    /// # Errors
    /// [`Nonsense`] at a tag or a length that no page sends.
    pub fn read(&mut self, bytes: &[u8], mut each: impl FnMut(Said)) -> Result<(), Nonsense> {
        self.0.extend_from_slice(bytes);
        let mut at = 0;
        while let Some((tag, length)) = header(&self.0[at..]) {
            if length > LONGEST {
                return Err(Nonsense);
            }
            let begin = at + HEADER;
            let Some(content) = self.0.get(begin..begin + length) else {
                break;
            };
            each(said(tag, content)?);
            at = begin + length;
        }
        self.0.drain(..at);
        Ok(())
    }
}

/// Bytes before a frame's content.
const HEADER: usize = 5;

fn header(bytes: &[u8]) -> Option<(u8, usize)> {
    match bytes {
        [tag, a, b, c, d, ..] => Some((*tag, u32::from_le_bytes([*a, *b, *c, *d]) as usize)),
        [..] => None,
    }
}

fn said(tag: u8, content: &[u8]) -> Result<Said, Nonsense> {
    match (tag, content) {
        (1, bytes) => Ok(Said::Wire(bytes.to_vec())),
        (2, [key]) => Ok(Said::Key(*key)),
        (3, job) => Ok(Said::Job(job.to_vec())),
        (4, []) => Ok(Said::Clear),
        _ => Err(Nonsense),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(pieces: &[&[u8]]) -> (Vec<Said>, bool) {
        let (mut reader, mut all) = (SaidReader::default(), Vec::new());
        let good = pieces
            .iter()
            .all(|piece| reader.read(piece, |said| all.push(said)).is_ok());
        (all, good)
    }

    #[test]
    fn frames_are_put_together_wherever_they_are_cut() {
        let bytes = [
            &[1, 3, 0, 0, 0][..],
            b"$$\n",
            &[2, 1, 0, 0, 0, 16],
            &[4, 0, 0, 0, 0],
            &[3, 4, 0, 0, 0],
            b"a\nG0",
        ]
        .concat();
        let expected = vec![
            Said::Wire(b"$$\n".to_vec()),
            Said::Key(16),
            Said::Clear,
            Said::Job(b"a\nG0".to_vec()),
        ];
        let single: Vec<&[u8]> = bytes.chunks(1).collect();
        assert_eq!(read(&[&bytes]), (expected.clone(), true));
        assert_eq!(read(&single), (expected, true));
    }

    #[test]
    fn what_no_page_sends_ends_the_conversation() {
        for nonsense in [
            &[9, 0, 0, 0, 0][..],
            &[1, 255, 255, 255, 255],
            &[2, 0, 0, 0, 0],
            &[4, 1, 0, 0, 0, 7],
        ] {
            assert_eq!(read(&[nonsense]), (vec![], false));
        }
    }
}
