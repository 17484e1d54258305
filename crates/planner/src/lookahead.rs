//! The queue of planned moves and its reverse pass, at constant cost a line.
//!
//! The squared speed `e_i` at the start of move *i* may not exceed its `cap_i`, nor what the moves from
//! there on can brake: `e_i = min(cap_i, e_(i+1) + g_i)` with `g_i = 2·a_i·L_i` and 0 after the last
//! move. With the potential `Φ_i = Σ g_k` over all `k < i` that is
//!
//! ```text
//!   e_i + Φ_i = min over j ≥ i of (cap_j + Φ_j)        (and Φ_end: rest after the last move)
//! ```
//!
//! a minimum over a sequence that grows at its end and shrinks at its front. The classic monotone queue
//! holds its candidates in rising order: a new move removes from the back those that are not smaller,
//! the front is the minimum. Each move enters and leaves once, so a line costs the same however many are
//! queued. The rest after the last move is not a candidate that removes others, because the next push
//! lifts it.
//!
//! Everything is in whole [`SpeedUnit`](crate::config::SpeedUnit)s: gains and caps are rounded down, so
//! that sums are exact and never promise more than the machine can brake. Potentials count up for ever:
//! 2³² moves of the largest gain fit 64 bits.
//!
//! The forward pass is one comparison, made when a move is taken for execution.

use crate::moves::PlannedMove;
use heapless::Deque;

/// Planned moves, the running one first, with the speed at which each may begin.
#[derive(Clone, Debug)]
pub(crate) struct LookAhead<const MOTORS: usize, const CAPACITY: usize> {
    moves: Deque<PlannedMove<MOTORS>, CAPACITY>,
    /// Moves that may be the minimum, as their number modulo 2¹⁶, their `cap + potential` rising.
    candidates: Deque<u16, CAPACITY>,
    /// Number of the first move, modulo 2¹⁶.
    first: u16,
    /// Whether the first move runs: its start no longer limits anything.
    running: bool,
    /// `Φ_end`: the potential after the last move.
    end: u64,
}

/// How far [`LookAhead::walk`] came.
pub(crate) struct Walked {
    /// Number of the move after the last one visited.
    pub(crate) next: u16,
    /// Moves visited.
    pub(crate) moves: usize,
}

impl<const MOTORS: usize, const CAPACITY: usize> LookAhead<MOTORS, CAPACITY> {
    /// Numbers of 16 bits must tell all moves apart.
    const FITS: () = assert!(CAPACITY > 0 && CAPACITY < 1 << 16);

    pub(crate) const fn new() -> Self {
        let () = Self::FITS;
        Self {
            moves: Deque::new(),
            candidates: Deque::new(),
            first: 0,
            running: false,
            end: 0,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.moves.len()
    }

    /// The move that runs, if one does.
    pub(crate) fn running(&self) -> Option<&PlannedMove<MOTORS>> {
        self.moves.front().filter(|_| self.running)
    }

    /// The first move that does not run.
    pub(crate) fn next(&self) -> Option<&PlannedMove<MOTORS>> {
        self.moves.get(usize::from(self.running))
    }

    /// Appends a move that can brake `gain` and whose `cap` is set; hands it back where there is no room.
    pub(crate) fn push(
        &mut self,
        mut planned: PlannedMove<MOTORS>,
        gain: u32,
    ) -> Result<(), PlannedMove<MOTORS>> {
        planned.potential = self.end;
        self.moves.push_back(planned)?;
        self.end = self.end.wrapping_add(u64::from(gain));
        self.add_candidate(self.moves.len() - 1);
        Ok(())
    }

    /// The last move, where it does not run.
    pub(crate) fn last_waiting(&self) -> Option<&PlannedMove<MOTORS>> {
        let waiting = self.moves.len() > usize::from(self.running);
        self.moves.back().filter(|_| waiting)
    }

    /// Puts the same move made longer in the place of the last one, which does not run. It begins as before, and its `gain` is no
    /// smaller: what is planned stays right.
    pub(crate) fn lengthen_last(&mut self, longer: PlannedMove<MOTORS>, gain: u32) {
        if let Some(last) = self.moves.back_mut() {
            self.end = longer.potential.wrapping_add(u64::from(gain));
            *last = longer;
        }
    }

    /// Ends the move that runs, if one does, and starts the next one.
    pub(crate) fn start_next(&mut self) -> Option<&PlannedMove<MOTORS>> {
        self.finish();
        if self.candidates.front() == Some(&self.first) {
            self.candidates.pop_front();
        }
        self.running = !self.moves.is_empty();
        self.running()
    }

    /// Removes the move that runs, if one does.
    pub(crate) fn finish(&mut self) {
        if self.running {
            self.moves.pop_front();
            self.first = self.first.wrapping_add(1);
            self.running = false;
        }
    }

    /// The largest squared speed, in units, at which the running move may end (so that all that follows
    /// can be kept).
    pub(crate) fn exit_limit(&self) -> u32 {
        let Some(next) = self.next() else {
            return 0;
        };
        let to_rest = self.end.wrapping_sub(next.potential);
        let capped = self.candidates.front().and_then(|number| self.key(*number));
        let limit = capped.map_or(to_rest, |key| to_rest.min(key.wrapping_sub(next.potential)));
        u32::try_from(limit).unwrap_or(u32::MAX)
    }

    /// The move whose start keeps the next move's start from being faster; `None` where it is the rest at the queue's
    /// end.
    pub(crate) fn slow_start(&self) -> Option<&PlannedMove<MOTORS>> {
        let number = *self.candidates.front()?;
        self.key(number).filter(|key| *key < self.end)?;
        self.moves.get(usize::from(number.wrapping_sub(self.first)))
    }

    /// The move that was queued last.
    pub(crate) fn newest(&self) -> Option<&PlannedMove<MOTORS>> {
        self.moves.back()
    }

    /// The number of the first move that does not run.
    pub(crate) fn first_waiting(&self) -> u16 {
        self.first.wrapping_add(u16::from(self.running))
    }

    /// Visits up to `most` moves that do not run, from number `from` on, each with the largest squared speed, in units, at which
    /// it may end. Those before the first that waits are left out.
    pub(crate) fn walk(
        &self,
        from: u16,
        most: usize,
        mut visit: impl FnMut(&PlannedMove<MOTORS>, u32),
    ) -> Walked {
        let waiting = usize::from(self.running);
        let asked = usize::from(from.wrapping_sub(self.first));
        let begin = if asked > self.moves.len() {
            waiting // it has begun since
        } else {
            asked.max(waiting)
        };
        let end = begin.saturating_add(most).min(self.moves.len());
        let mut candidate = self.candidate_after(begin);
        for index in begin..end {
            let Some(planned) = self.moves.get(index) else {
                break;
            };
            if self
                .candidates
                .get(candidate)
                .map(|number| self.index(*number))
                == Some(index)
            {
                candidate += 1;
            }
            let after = self
                .moves
                .get(index + 1)
                .map_or(self.end, |next| next.potential);
            let key = self
                .candidates
                .get(candidate)
                .and_then(|number| self.key(*number));
            let limit = key
                .map_or(self.end, |key| key.min(self.end))
                .wrapping_sub(after);
            visit(planned, u32::try_from(limit).unwrap_or(u32::MAX));
        }
        Walked {
            next: self.first.wrapping_add(end as u16),
            moves: end.saturating_sub(begin),
        }
    }

    /// The place among the candidates of the first one from move `index` on, by bisection.
    fn candidate_after(&self, index: usize) -> usize {
        let (mut low, mut high) = (0, self.candidates.len());
        while low < high {
            let middle = (low + high) / 2;
            let before = self
                .candidates
                .get(middle)
                .is_some_and(|number| self.index(*number) < index);
            if before {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        low
    }

    fn index(&self, number: u16) -> usize {
        usize::from(number.wrapping_sub(self.first))
    }

    /// Sets every cap anew, in order, and rebuilds the candidates: an override has changed. Linear in
    /// the length.
    pub(crate) fn set_caps(&mut self, mut cap: impl FnMut(&PlannedMove<MOTORS>) -> u32) {
        self.candidates.clear();
        let skipped = usize::from(self.running);
        for planned in self.moves.iter_mut() {
            planned.cap = cap(planned);
        }
        for index in skipped..self.moves.len() {
            self.add_candidate(index);
        }
    }

    /// Forgets all moves.
    pub(crate) fn clear(&mut self) {
        self.moves.clear();
        self.candidates.clear();
        self.running = false;
    }

    fn add_candidate(&mut self, index: usize) {
        let number = self.first.wrapping_add(index as u16);
        let Some(key) = self.key(number) else { return };
        while self.candidates.back().and_then(|last| self.key(*last)) >= Some(key) {
            self.candidates.pop_back();
        }
        // There is room: no more candidates than moves.
        let _ = self.candidates.push_back(number);
    }

    /// `cap + Φ` of the move with this number.
    fn key(&self, number: u16) -> Option<u64> {
        let index = usize::from(number.wrapping_sub(self.first));
        let planned = self.moves.get(index)?;
        Some(planned.potential.wrapping_add(u64::from(planned.cap)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Feed, Move, MoveKind, MovePower};
    use leadscrew_stepper::Outputs;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn planned(cap: u32) -> PlannedMove<1> {
        let of = Move::<1> {
            target: [crate::Coordinate::ZERO],
            feed: Feed::Rapid,
            power: MovePower::Off,
            speed_limit: None,
            outputs: Outputs(0),
            line_number: None,
            kind: MoveKind::Rapid,
        };
        PlannedMove {
            cap,
            ..PlannedMove::new(&of, [1])
        }
    }

    /// The reverse pass as everybody writes it, over `(cap, gain)`: the start speed of the first move.
    fn reverse_pass(moves: &[(u32, u32)]) -> u64 {
        moves.iter().rev().fold(0, |exit, (cap, gain)| {
            u64::from(*cap).min(exit + u64::from(*gain))
        })
    }

    #[test]
    fn an_empty_queue_ends_at_rest() {
        let mut queue = LookAhead::<1, 4>::new();
        assert_eq!(queue.exit_limit(), 0);
        assert!(queue.push(planned(9), 5).is_ok());
        queue.start_next();
        assert_eq!(queue.exit_limit(), 0);
    }

    #[test]
    fn a_full_queue_hands_the_move_back() {
        let mut queue = LookAhead::<1, 2>::new();
        assert!(queue.push(planned(1), 1).is_ok());
        assert!(queue.push(planned(2), 1).is_ok());
        assert_eq!(
            queue.push(planned(3), 1),
            Err(planned(3)).map_err(|mut p| {
                p.potential = 2;
                p
            })
        );
    }

    proptest! {
        /// Against the reverse pass, with pushes, starts and changed caps in any order.
        #[test]
        fn every_start_speed_is_that_of_a_full_reverse_pass(
            steps in prop::collection::vec((0u8..10, 0u32..2000, 0u32..500), 1..300),
        ) {
            let mut queue = LookAhead::<1, 64>::new();
            queue.first = 65_500; // numbers wrap on the way
            let mut model: Vec<(u32, u32)> = Vec::new();
            let mut running = false;
            for (what, cap, gain) in steps {
                match what {
                    0 => if let Some(longer) = queue.last_waiting().copied() {
                        let (_, old) = model.last_mut().unwrap();
                        *old += gain;
                        queue.lengthen_last(longer, *old);
                    },
                    1..=5 => if queue.push(planned(cap), gain).is_ok() { model.push((cap, gain)); },
                    6..=8 => {
                        if running { model.remove(0); }
                        running = queue.start_next().is_some();
                    }
                    _ => {
                        queue.set_caps(|planned| planned.cap / 2);
                        for (cap, _) in &mut model { *cap /= 2; }
                    }
                }
                let next = usize::from(running).min(model.len());
                prop_assert_eq!(u64::from(queue.exit_limit()), reverse_pass(&model[next..]));
                prop_assert_eq!(queue.len(), model.len());
            }
        }
    }
}
