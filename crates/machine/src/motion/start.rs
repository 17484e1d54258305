//! When the program's motion begins out of rest: lines that a sender sends together are planned
//! together.

use crate::board::{Duration, Instant};

/// The number of planned moves with which motion begins; with fewer, no line waits for its answer.
/// Grbl plans as many.
pub(super) const DEPTH: usize = 15;

/// Motion begins after a silence of this length: the time of two characters at 115 200 baud, in
/// which a byte on its way is heard.
const SILENCE: Duration = Duration::from_ticks(200);

/// No sender waits for motion longer than this.
const LONGEST: Duration = Duration::from_ticks(5_000);

/// The conditions that motion waits for: this silence, this number of moves, or this time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Patience {
    silence: Duration,
    moves: usize,
    longest: Option<Duration>,
}

/// Whether motion may begin.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Phase {
    /// The line under way has more moves to come: motion waits until enough are planned.
    MoreToCome,
    /// Lines may still come: motion waits until this instant.
    Until(Instant),
    /// Motion has begun, or need not wait.
    Over,
}

/// The wait before the program's motion.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Start {
    patience: Patience,
    phase: Phase,
    /// When the wait is over at the latest.
    latest: Option<Instant>,
}

impl Start {
    /// A start without anything that waits. `silence`: `$701`, 0 for as little as Grbl waits.
    pub(super) fn new(silence: Duration) -> Self {
        let as_grbl = Patience {
            silence: SILENCE,
            moves: DEPTH,
            longest: Some(LONGEST),
        };
        let patience = Patience {
            silence,
            moves: usize::MAX,
            longest: None,
        };
        Self {
            patience: match silence.ticks() {
                0 => as_grbl,
                _ => patience,
            },
            phase: Phase::Over,
            latest: None,
        }
    }

    /// Notes that a move was planned. `begins`: it is the first one after rest. `more`: its line
    /// has further moves.
    pub(super) fn planned(&mut self, begins: bool, more: bool, now: Instant) {
        if begins {
            self.latest = self.patience.longest.map(|longest| now + longest);
        } else if self.phase == Phase::Over {
            return;
        }
        self.phase = match more {
            true => Phase::MoreToCome,
            false => Phase::Until(now + self.patience.silence),
        };
    }

    /// Puts motion off: a line has come that has not been carried out yet, or is coming.
    pub(super) fn put_off(&mut self, now: Instant) {
        if let Phase::Until(instant) = &mut self.phase {
            *instant = now + self.patience.silence;
        }
    }

    /// Ends the wait.
    pub(super) fn release(&mut self) {
        self.phase = Phase::Over;
    }

    /// When the wait is over by itself.
    pub(super) fn ends_at(&self) -> Option<Instant> {
        match (self.phase, self.latest) {
            (Phase::Until(instant), Some(latest)) => Some(instant.min(latest)),
            (Phase::Until(instant), None) => Some(instant),
            (Phase::MoreToCome | Phase::Over, _) => None,
        }
    }

    /// Whether motion may begin with `moves` planned.
    pub(super) fn is_over(&mut self, moves: usize, now: Instant) -> bool {
        let enough = moves >= self.patience.moves;
        if enough || self.ends_at().is_some_and(|end| now >= end) {
            self.release();
        }
        self.phase == Phase::Over
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(micros: u64) -> Instant {
        Instant::from_ticks(micros)
    }

    /// The wait of motion after the first of `moves` moves that come every `every` microseconds,
    /// µs.
    fn waits(silence_ms: u64, moves: usize, every: u64) -> u64 {
        let mut start = Start::new(Duration::from_ticks(silence_ms * 1_000));
        let mut planned = 0;
        (0..)
            .find(|now| {
                if planned < moves && now % every == 0 {
                    start.planned(planned == 0, false, at(*now));
                    planned += 1;
                }
                start.is_over(planned, at(*now))
            })
            .unwrap_or(u64::MAX)
    }

    #[test]
    fn motion_begins_in_a_silence_or_with_fifteen_moves() {
        assert_eq!(waits(0, 1, 100), 200);
        assert_eq!(waits(0, 3, 150), 500);
        assert_eq!(waits(0, 1000, 100), 1_400);
    }

    #[test]
    fn a_longer_silence_knows_no_other_end() {
        assert_eq!(waits(20, 1, 100), 20_000);
        assert_eq!(waits(20, 1000, 100), 119_900);
    }

    #[test]
    fn a_line_of_many_moves_is_waited_for_until_there_are_enough() {
        let mut start = Start::new(Duration::from_ticks(0));
        start.planned(true, true, at(0));
        assert!(!start.is_over(1, at(1_000_000)));
        assert!(start.is_over(DEPTH, at(1_000_000)));
        start.planned(false, true, at(1_000_001));
        assert!(start.is_over(1, at(1_000_001)), "it has begun");
    }

    #[test]
    fn lines_put_motion_off_for_five_milliseconds_at_most() {
        let mut start = Start::new(Duration::from_ticks(0));
        start.planned(true, false, at(0));
        for now in (0..5_000).step_by(100) {
            start.put_off(at(now));
            assert!(!start.is_over(1, at(now)), "{now}");
        }
        assert!(start.is_over(1, at(5_000)));
    }
}
