//! Holes to a drilling job.
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

/// How a board is drilled. Heights are Z of the job: a depth is below zero where zero is the
/// board's surface.
#[derive(Clone, PartialEq, Debug)]
pub struct Options {
    /// Z of a hole's bottom, mm.
    pub depth: Mm,
    /// Z between holes, mm.
    pub clearance: Mm,
    /// How fast bits go down, mm/min.
    pub feed: Mm,
    /// How fast slots and routes are milled, mm/min; `feed` where there is none.
    pub mill_feed: Option<Mm>,
    /// The deepest that is drilled or milled in one go, mm.
    pub peck: Option<Mm>,
    /// Take feeds and speeds from the files where they have them.
    pub tool_feeds: bool,
    /// How fast the spindle turns, 1/min; as fast as the machine can where there is none.
    pub spindle: Option<u32>,
    /// The axis whose coordinates change their sign: the board is drilled from its other side.
    pub mirror: Option<Mirror>,
    /// X0 Y0 is the corner of the holes and not the files' zero.
    pub from_corner: bool,
    /// Diameters of the bits that there are, mm; each tool becomes the nearest of them. Empty: as
    /// the files have them.
    pub bits: Vec<Mm>,
    /// Mill slots (`G85`) in place of drilling them as a row of holes.
    pub mills_slots: bool,
    /// One job a bit, in place of one with `M6`.
    pub job_a_bit: bool,
    /// Write canned cycles: G81, and G83 where there is a peck.
    pub cycles: bool,
}

/// Which coordinates change their sign.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Mirror {
    /// X: the board was turned over like a page.
    X,
    /// Y.
    Y,
}

/// A job and the number of its bit, where there is a job for each.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DrillJob {
    /// The bit's number; `None` where the job has all bits.
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
    if *depth >= Mm::ZERO {
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
    if options
        .peck
        .is_some_and(|peck| peck.nanos() < (*clearance - *depth).nanos() / MOST_PECKS)
    {
        return Err(format!(
            "--peck would be more than {MOST_PECKS} pecks a hole"
        ));
    }
    let lengths = [
        ("--feed", Some(options.feed)),
        ("--mill-feed", options.mill_feed),
        ("--peck", options.peck),
        ("--bits", options.bits.iter().min().copied()),
    ];
    let wrong = lengths
        .iter()
        .find(|(_, length)| length.is_some_and(|length| length <= Mm::ZERO));
    wrong.map_or(Ok(()), |(name, _)| {
        Err(format!("{name} must be more than 0"))
    })
}

/// `1 hole`, `2 holes`.
fn counted(count: usize, name: &str) -> String {
    let end = if count == 1 { "" } else { "s" };
    format!("{count} {name}{end}")
}

/// Levels to which a bit goes one after the other, the last of them the depth. The first is counted
/// from Z0, or from the clearance where that is lower.
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
