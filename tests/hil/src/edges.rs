//! The edges of a signal as the board has captured them.
use crate::{
    failure::{fail, Failure},
    wires::Signal,
};

/// Counts of the board's timers in a microsecond.
pub(crate) const PER_US: f64 = 84.0;

/// The rising and falling edges of a signal, in order.
#[derive(Clone, Debug)]
pub(crate) struct Edges {
    signal: Signal,
    /// The number of edges that the board has captured.
    pub(crate) all: usize,
    /// The level before the first edge.
    level: bool,
    /// True if an edge came that was not captured.
    lost: bool,
    /// The counts of the edges. The timer wraps around after 51 s; these counts go on.
    counts: Vec<u64>,
}

/// A pulse: from a rising edge to the next falling one, counts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Pulse {
    pub(crate) rise: u64,
    pub(crate) fall: u64,
}

/// A line of `M121`.
struct Line<'a> {
    wire: usize,
    first: usize,
    all: usize,
    lost: bool,
    level: bool,
    counts: &'a str,
}

fn parse(line: &str) -> Option<Line<'_>> {
    let (head, counts) = line
        .strip_prefix("[EDGES:")?
        .strip_suffix(']')?
        .split_once(':')?;
    let mut words = head.split(',').map(|word| word.parse::<usize>().ok());
    let mut next = || words.next().flatten();
    Some(Line {
        wire: next()?,
        first: next()?,
        all: next()?,
        lost: next()? != 0,
        level: next()? != 0,
        counts,
    })
}

impl Edges {
    /// Reads the first line of `M121` among other lines.
    pub(crate) fn read(heard: &[String], signal: Signal) -> Result<Self, Failure> {
        let Some(first) = heard.iter().find_map(|line| parse(line)) else {
            return fail(format!("no edges in {heard:?}"));
        };
        let mut edges = Edges {
            signal,
            all: first.all,
            level: first.level,
            lost: first.lost,
            counts: Vec::new(),
        };
        for line in heard {
            edges.add(line)?;
        }
        Ok(edges)
    }

    /// Adds the edges of one more line; other lines are ignored.
    pub(crate) fn add(&mut self, line: &str) -> Result<(), Failure> {
        let Some(found) = parse(line) else {
            return Ok(());
        };
        let expected = (self.signal.number(), self.counts.len());
        if (found.wire, found.first) != expected {
            return fail(format!("{line}: not the edges from {expected:?} on"));
        }
        for word in found.counts.as_bytes().chunks(8) {
            let word = std::str::from_utf8(word)?;
            let count = u32::from_str_radix(word, 16)?;
            let last = self.counts.last().copied().unwrap_or(0);
            let passed = count.wrapping_sub(last as u32);
            self.counts.push(last + u64::from(passed));
        }
        Ok(())
    }

    /// Fails unless all edges are there and none was lost.
    pub(crate) fn ensure_whole(&self) -> Result<(), Failure> {
        let (signal, got) = (self.signal, self.counts.len());
        if self.lost {
            return fail(format!("{signal}: an edge was not captured, behind {got}"));
        }
        if got != self.all {
            return fail(format!("{signal}: {got} edges came, of {}", self.all));
        }
        Ok(())
    }

    /// The whole pulses, in order.
    pub(crate) fn pulses(&self) -> Vec<Pulse> {
        let from = usize::from(self.level);
        let edges = self.counts.get(from..).unwrap_or_default();
        let pairs = edges.chunks_exact(2);
        pairs
            .map(|pair| Pulse {
                rise: pair[0],
                fall: pair[1],
            })
            .collect()
    }

    /// The counts of all edges.
    pub(crate) fn counts(&self) -> &[u64] {
        &self.counts
    }

    /// The level at a count.
    pub(crate) fn level_at(&self, count: u64) -> bool {
        let before = self.counts.partition_point(|edge| *edge <= count);
        self.level ^ (before % 2 != 0)
    }

    /// Gives the counts the same origin as the counts of `other`, which was captured at the same
    /// time. The first edges of both must be no more than 25 s apart.
    pub(crate) fn beside(mut self, other: &Edges) -> Self {
        let (Some(&ours), Some(&theirs)) = (self.counts.first(), other.counts.first()) else {
            return self;
        };
        let apart = (ours as u32).wrapping_sub(theirs as u32).cast_signed();
        let place = theirs as i64 + i64::from(apart);
        let shift = place - ours as i64;
        for count in &mut self.counts {
            *count = (*count as i64 + shift) as u64;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edges(lines: &[&str]) -> Result<Edges, Failure> {
        let lines: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
        let edges = Edges::read(&lines, Signal::StepX)?;
        edges.ensure_whole().map(|()| edges)
    }

    #[test]
    fn counts_go_on_where_the_timer_comes_round() {
        let found = edges(&[
            "ok",
            "[EDGES:0,0,3,0,0:fffffff000000010]",
            "[EDGES:0,2,3,0,0:00000020]",
        ]);
        let found = found.unwrap();
        assert_eq!(found.counts, [0xFFFF_FFF0, 0x1_0000_0010, 0x1_0000_0020]);
        let pulse = Pulse {
            rise: 0xFFFF_FFF0,
            fall: 0x1_0000_0010,
        };
        assert_eq!(found.pulses(), [pulse]);
        assert!(found.level_at(0xFFFF_FFF0) && !found.level_at(0x1_0000_0010));
    }

    #[test]
    fn a_signal_that_begins_high_has_its_first_pulse_behind_its_first_fall() {
        let found = edges(&["[EDGES:0,0,3,0,1:000000010000000500000009]"]).unwrap();
        assert_eq!(found.pulses(), [Pulse { rise: 5, fall: 9 }]);
        assert!(found.level_at(0) && !found.level_at(1));
    }

    #[test]
    fn a_lost_edge_a_missing_line_and_another_wires_are_told() {
        let cases: [&[&str]; 4] = [
            &["[EDGES:0,0,1,1,0:00000001]"],
            &["[EDGES:0,0,2,0,0:00000001]"],
            &["[EDGES:1,0,1,0,0:00000001]"],
            &["[EDGES:0,0,1,0,0:0000000x]"],
        ];
        for lines in cases {
            assert!(edges(lines).is_err(), "{lines:?}");
        }
    }

    #[test]
    fn two_signals_come_to_one_scale_where_the_timer_has_come_round_between_them() {
        let one = edges(&["[EDGES:0,0,1,0,0:fffffff0]"]).unwrap();
        let other = edges(&["[EDGES:0,0,1,0,0:00000010]"]).unwrap();
        assert_eq!(other.beside(&one).counts, [0x1_0000_0010]);
    }
}
