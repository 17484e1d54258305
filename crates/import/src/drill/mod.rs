//! Makes a drilling job from holes.
//!
//! ```text
//! files -> board: tools of all files as bits, mirrored and moved
//!       -> order: travels as short as exchanging legs makes them
//!       -> job: G0 above the hole, G1 down, G0 up
//! ```

mod board;
mod job;
mod order;
mod speeds;

pub use speeds::Speeds;

use crate::excellon::Drawing;
use crate::{Job, Mm};
use board::Board;

/// The way in which a board is drilled. Heights are the job's Z: if zero is the board's surface, a
/// depth is below zero.
#[derive(Clone, PartialEq, Debug)]
pub struct Options {
    /// Z of a hole's bottom, mm.
    pub depth: Mm,
    /// Z between holes, mm.
    pub clearance: Mm,
    /// The feed at which bits go down, mm/min.
    pub feed: Mm,
    /// The feed at which slots and routes are milled, mm/min; `None` for the same as `feed`.
    pub mill_feed: Option<Mm>,
    /// The greatest depth that is drilled or milled in one go, mm.
    pub peck: Option<Mm>,
    /// Take feeds and speeds from the files if they have them.
    pub tool_feeds: bool,
    /// The speed at which the spindle turns, 1/min; `None` for the machine's highest speed.
    pub spindle: Option<u32>,
    /// The axis whose coordinates change their sign: the board is drilled from its other side.
    pub mirror: Option<Mirror>,
    /// True if X0 Y0 is the lower left corner of the holes, and not the files' zero.
    pub from_corner: bool,
    /// Diameters of the available bits, mm; each tool is replaced by the nearest one. Empty: the
    /// tools of the files are used.
    pub bits: Vec<Mm>,
    /// True if slots (`G85`) are milled, and not drilled as a row of holes.
    pub mills_slots: bool,
    /// True if there is one job for each bit, and not one job with `M6`.
    pub job_a_bit: bool,
    /// True if to write canned cycles: G81, or G83 with a peck.
    pub cycles: bool,
}

/// The coordinates that change their sign.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Mirror {
    /// X: the board was turned over like a page.
    X,
    /// Y.
    Y,
}

/// A job, and its bit's number if each bit has a job of its own.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DrillJob {
    /// The bit's number; `None` if the job has all bits.
    pub bit: Option<u32>,
    /// The job.
    pub job: Job,
}

/// Makes the job, or the jobs, of a board from all its files.
///
/// # Errors
/// An option that makes no sense, a board without holes, a slot that cannot be drilled.
pub fn jobs(
    files: &[Drawing],
    options: &Options,
    speeds: &Speeds,
) -> Result<Vec<DrillJob>, String> {
    check(options)?;
    let mut board = Board::new(files, options, speeds)?;
    if !options.job_a_bit {
        order::order(&mut board.groups, speeds, options);
        let job = job::job(&board, options)?;
        return Ok(vec![DrillJob { bit: None, job }]);
    }
    let boards = board.apart();
    let jobs = boards.into_iter().map(|mut board| {
        order::order(&mut board.groups, speeds, options);
        let bit = board.groups.first().map(|group| group.bit.number);
        Ok(DrillJob {
            bit,
            job: job::job(&board, options)?,
        })
    });
    jobs.collect()
}

/// The most pecks of a hole.
const MOST_PECKS: i64 = 1000;

fn check(options: &Options) -> Result<(), String> {
    let Options {
        depth, clearance, ..
    } = options;
    let lengths = [
        ("--feed", Some(options.feed)),
        ("--mill-feed", options.mill_feed),
        ("--peck", options.peck),
        ("--bits", options.bits.iter().min().copied()),
    ];
    let wrong = lengths
        .iter()
        .find(|(_, length)| length.is_some_and(|length| length <= Mm::ZERO));
    if let Some((name, _)) = wrong {
        return Err(format!("{name} must be more than 0"));
    }
    if *depth == Mm::ZERO {
        return Err("--depth 0 is not below Z0".to_owned());
    }
    if *depth > Mm::ZERO {
        return Err(format!(
            "--depth {depth} is not below Z0: is it {}?",
            -*depth
        ));
    }
    if depth >= clearance {
        return Err(format!(
            "--depth {depth} is not below --clearance {clearance}"
        ));
    }
    let is_tiny = |peck: Mm| peck.nanos() < (*clearance - *depth).nanos() / MOST_PECKS;
    if options.peck.is_some_and(is_tiny) {
        return Err(format!(
            "--peck would be more than {MOST_PECKS} pecks a hole"
        ));
    }
    Ok(())
}

/// A count with its noun: `1 hole`, `2 holes`.
fn counted(count: usize, name: &str) -> String {
    let end = if count == 1 { "" } else { "s" };
    format!("{count} {name}{end}")
}

/// The Z levels to which a bit goes one after the other; the last is the depth. The first peck
/// starts at Z0, or at the clearance if that is lower.
fn levels(options: &Options) -> Vec<Mm> {
    let Some(peck) = options.peck else {
        return vec![options.depth];
    };
    let surface = options.clearance.min(Mm::ZERO);
    let mut levels = Vec::new();
    let mut level = surface - peck;
    while level > options.depth {
        levels.push(level);
        level = level - peck;
    }
    levels.push(options.depth);
    levels
}
