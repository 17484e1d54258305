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
//! a minimum over a sequence that grows at its end and shrinks at its front. The classic monotone queue holds its candidates
//! in rising order: a new move removes from the back those that are not smaller (found by doubling and halving, so that no
//! line costs much more than another), the front is the minimum. Each move enters and leaves once, so a line costs the same
//! however many are queued. The rest after the last move is not a candidate that removes others, because the next push lifts
//! it.
//!
//! Everything is in whole [`SpeedUnit`](crate::config::SpeedUnit)s: gains and caps are rounded down, so
//! that sums are exact and never promise more than the machine can brake. Potentials count up for ever:
//! 2³² moves of the largest gain fit 64 bits.
//!
//! An override changes all caps. That is done in slices, from the running end: at each moment the plan keeps the new
//! caps of the moves up to some place and the old ones of those after it (see `candidates`). Both keep every limit of the
//! machine; they differ in the speed asked for.
//!
//! The forward pass is one comparison, made when a move is taken for execution.

use crate::candidates::Candidates;
use crate::moves::PlannedMove;
use heapless::deque::DequeView;

/// Planned moves, the running one first, with the speed at which each may begin.
#[derive(Debug)]
pub(crate) struct LookAhead<'q, const MOTORS: usize> {
    moves: &'q mut DequeView<PlannedMove<MOTORS>>,
    /// Moves that may be the minimum, as their number modulo 2¹⁶, their `cap + potential` rising.
    candidates: Candidates<'q>,
    /// Number of the first move, modulo 2¹⁶.
    first: u16,
    /// Whether the first move runs: its start no longer limits anything.
    running: bool,
    /// `Φ_end`: the potential after the last move.
    end: u64,
    /// How many moves at the front have their new caps, while caps change.
    renewed: Option<usize>,
}

/// How far [`LookAhead::walk`] came.
pub(crate) struct Walked {
    /// Number of the move after the last one visited.
    pub(crate) next: u16,
    /// Moves visited.
    pub(crate) moves: usize,
}

impl<'q, const MOTORS: usize> LookAhead<'q, MOTORS> {
    /// No moves, in room for them and for as many candidates.
    pub(crate) fn new(
        room: &'q mut DequeView<PlannedMove<MOTORS>>,
        candidates: &'q mut [u16],
    ) -> Self {
        room.clear();
        Self {
            moves: room,
            candidates: Candidates::new(candidates),
            first: 0,
            running: false,
            end: 0,
            renewed: None,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.moves.storage_len()
    }

    /// How many moves there is room for.
    pub(crate) fn capacity(&self) -> usize {
        self.moves.storage_capacity()
    }

    /// The move that runs, if one does.
    pub(crate) fn running(&self) -> Option<&PlannedMove<MOTORS>> {
        self.moves.front().filter(|_| self.running)
    }

    /// The first move that does not run.
    pub(crate) fn next(&self) -> Option<&PlannedMove<MOTORS>> {
        self.moves.get(usize::from(self.running))
    }

    /// Appends a move that can brake `gain` and whose `cap` is set; hands it back where there is no room. Not while
    /// caps change.
    pub(crate) fn push(
        &mut self,
        mut planned: PlannedMove<MOTORS>,
        gain: u32,
    ) -> Result<(), PlannedMove<MOTORS>> {
        planned.potential = self.end;
        let (number, key) = (self.number(self.moves.storage_len()), planned.key());
        self.moves.push_back(planned)?;
        self.end = self.end.wrapping_add(u64::from(gain));
        self.add_candidate(number, key);
        Ok(())
    }

    /// The last move, where it does not run.
    pub(crate) fn last_waiting(&self) -> Option<&PlannedMove<MOTORS>> {
        let waiting = self.moves.storage_len() > usize::from(self.running);
        self.moves.back().filter(|_| waiting)
    }

    /// Takes back the last move, which does not run. What is pushed in its place may have no higher `cap`: so a move that was no
    /// candidate is none afterwards. Not while caps change.
    pub(crate) fn take_last(&mut self) {
        if let Some(last) = self.moves.pop_back() {
            self.end = last.potential;
            let number = self.number(self.moves.storage_len());
            self.candidates.drop_last(number);
        }
    }

    /// Puts the same move made longer in the place of the last one, which does not run. It begins as before, and its `gain` is no
    /// smaller: what is planned stays right.
    pub(crate) fn lengthen_last(&mut self, longer: PlannedMove<MOTORS>, gain: u32) {
        if let Some(last) = self.moves.back_mut() {
            self.end = longer.potential.wrapping_add(u64::from(gain));
            *last = longer;
        }
    }

    /// Lowers limits of the last `count` moves that do not run: `lower` is given each of them, and answers what it can
    /// brake where that becomes less. Not while caps change. Linear in `count`.
    ///
    /// `cap` may not grow: so a move that was no candidate is none afterwards.
    pub(crate) fn lower_last(
        &mut self,
        count: usize,
        lower: impl Fn(&mut PlannedMove<MOTORS>) -> Option<u32>,
    ) {
        let len = self.moves.storage_len();
        let from = len.saturating_sub(count).max(usize::from(self.running));
        let first = self.first;
        self.candidates
            .keep(|number| usize::from(number.wrapping_sub(first)) < from);
        // What the moves so far have lost of their gains; of the one before its potential as it was, with its new gain, and its key.
        let (mut lost, mut before, mut last) = (0, None, None);
        let loss = |before: Option<(u64, u32)>, after: u64| {
            before.map_or(0, |(potential, gain)| {
                after
                    .wrapping_sub(potential)
                    .saturating_sub(u64::from(gain))
            })
        };
        for index in from..len {
            let Some(planned) = self.moves.get_mut(index) else {
                break;
            };
            let potential = planned.potential;
            lost += loss(before, potential);
            planned.potential = potential.wrapping_sub(lost);
            before = lower(planned).map(|gain| (potential, gain));
            let key = planned.key();
            let number = self.number(index);
            if last.is_some_and(|last| last < key) {
                self.candidates.push(number);
            } else {
                self.add_candidate(number, key);
            }
            last = Some(key);
        }
        lost += loss(before, self.end);
        self.end = self.end.wrapping_sub(lost);
    }

    /// Whether the moves before the last `count` ones suffice to stop from the squared speed `committed` (units) at which the
    /// running one ends: then nothing that becomes of the last ones takes back what it was promised.
    pub(crate) fn stops_before_last(&self, count: usize, committed: u32) -> bool {
        let (Some(next), Some(from)) = (
            self.next(),
            self.moves
                .get(self.moves.storage_len().saturating_sub(count)),
        ) else {
            return true;
        };
        let before = from.potential.wrapping_sub(next.potential);
        // Where `from` runs, or is the next one, there is nothing before it.
        (before >= u64::from(committed) || committed <= 1) && before < 1 << 63
    }

    /// Ends the move that runs, if one does, and starts the next one.
    pub(crate) fn start_next(&mut self) -> Option<&PlannedMove<MOTORS>> {
        self.finish();
        self.candidates.leave(self.first);
        self.running = !self.moves.is_empty();
        self.running()
    }

    /// Removes the move that runs, if one does.
    pub(crate) fn finish(&mut self) {
        if self.running {
            self.moves.pop_front();
            self.first = self.first.wrapping_add(1);
            self.running = false;
            self.renewed = self.renewed.map(|count| count.saturating_sub(1));
        }
    }

    /// The largest squared speed, in units, at which the running move may end (so that all that follows
    /// can be kept).
    pub(crate) fn exit_limit(&self) -> u32 {
        let Some(next) = self.next() else {
            return 0;
        };
        let to_rest = self.end.wrapping_sub(next.potential);
        let keys = self.candidates.first().into_iter().flatten();
        let limit = keys
            .filter_map(|number| self.key(number))
            .fold(to_rest, |limit, key| {
                limit.min(key.wrapping_sub(next.potential))
            });
        u32::try_from(limit).unwrap_or(u32::MAX)
    }

    /// The move whose start keeps the next move's start from being faster; `None` where it is the rest at the queue's
    /// end.
    pub(crate) fn slow_start(&self) -> Option<&PlannedMove<MOTORS>> {
        let keys = self.candidates.first().into_iter().flatten();
        let keyed = keys.filter_map(|number| Some((self.key(number)?, number)));
        let (_, number) = keyed.min().filter(|(key, _)| *key < self.end)?;
        self.moves.get(usize::from(number.wrapping_sub(self.first)))
    }

    /// All moves, the one that was queued last first.
    pub(crate) fn latest(&self) -> impl Iterator<Item = &PlannedMove<MOTORS>> {
        self.moves.iter().rev()
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
        let begin = if asked > self.moves.storage_len() {
            waiting // it has begun since
        } else {
            asked.max(waiting)
        };
        let end = begin.saturating_add(most).min(self.moves.storage_len());
        let mut places = self.candidates.places(|number| self.index(number) < begin);
        for index in begin..end {
            let Some(planned) = self.moves.get(index) else {
                break;
            };
            self.candidates.skip(&mut places, self.number(index));
            let after = self
                .moves
                .get(index + 1)
                .map_or(self.end, |next| next.potential);
            let keys = self.candidates.at_places(places).into_iter().flatten();
            let limit = keys
                .filter_map(|number| self.key(number))
                .fold(self.end, u64::min)
                .wrapping_sub(after);
            visit(planned, u32::try_from(limit).unwrap_or(u32::MAX));
        }
        Walked {
            next: self.number(end),
            moves: end.saturating_sub(begin),
        }
    }

    fn index(&self, number: u16) -> usize {
        usize::from(number.wrapping_sub(self.first))
    }

    /// Begins to set every cap anew: an override has changed. Go on with [`LookAhead::renew`].
    pub(crate) fn begin_renewal(&mut self) {
        let (moves, first) = (&*self.moves, self.first);
        let key = |number: u16| key_of(moves, number.wrapping_sub(first));
        self.candidates.join(key);
        self.candidates.begin_anew();
        self.renewed = Some(0);
    }

    /// Whether caps change.
    pub(crate) const fn is_renewing(&self) -> bool {
        self.renewed.is_some()
    }

    /// Sets the caps of up to `count` further moves anew: `cap` is given each of them with the one before it.
    pub(crate) fn renew(
        &mut self,
        count: usize,
        cap: impl Fn(Option<&PlannedMove<MOTORS>>, &PlannedMove<MOTORS>) -> u32,
    ) {
        let Some(from) = self.renewed else { return };
        let to = from.saturating_add(count).min(self.moves.storage_len());
        for index in from..to {
            let before = index.checked_sub(1).and_then(|index| self.moves.get(index));
            let cap = self
                .moves
                .get(index)
                .map_or(0, |planned| cap(before, planned));
            let number = self.number(index);
            self.candidates.leave(number);
            let Some(planned) = self.moves.get_mut(index) else {
                break;
            };
            planned.cap = cap;
            let key = planned.key();
            if index > 0 || !self.running {
                self.add_candidate(number, key);
            }
        }
        self.renewed = (to < self.moves.storage_len()).then_some(to);
    }

    /// Forgets all moves.
    pub(crate) fn clear(&mut self) {
        self.moves.clear();
        self.candidates.clear();
        self.running = false;
        self.renewed = None;
    }

    /// Makes the move `number`, the last one that has one, a candidate with its `key`.
    fn add_candidate(&mut self, number: u16, key: u64) {
        let (moves, first) = (&*self.moves, self.first);
        self.candidates
            .keep(|other| key_of(moves, other.wrapping_sub(first)) < Some(key));
        self.candidates.push(number);
    }

    fn number(&self, index: usize) -> u16 {
        self.first.wrapping_add(index as u16)
    }

    /// `cap + Φ` of the move with this number.
    fn key(&self, number: u16) -> Option<u64> {
        key_of(self.moves, number.wrapping_sub(self.first))
    }
}

fn key_of<const MOTORS: usize>(moves: &DequeView<PlannedMove<MOTORS>>, index: u16) -> Option<u64> {
    moves.get(usize::from(index)).map(PlannedMove::key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Feed, Move, MoveKind, MovePower, Queue};
    use leadscrew_stepper::Outputs;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn look_ahead<const MOVES: usize>(room: &mut Queue<1, MOVES>) -> LookAhead<'_, 1> {
        LookAhead::new(room.moves.as_mut_view(), &mut room.candidates)
    }

    fn planned(cap: u32) -> PlannedMove<1> {
        let of = Move::<1> {
            target: [crate::Coordinate::ZERO],
            feed: Feed::Rapid,
            power: MovePower::Off,
            curve: None,
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
        let mut room = Queue::<1, 4>::new();
        let mut queue = look_ahead(&mut room);
        assert_eq!(queue.exit_limit(), 0);
        assert!(queue.push(planned(9), 5).is_ok());
        queue.start_next();
        assert_eq!(queue.exit_limit(), 0);
    }

    #[test]
    fn a_full_queue_hands_the_move_back() {
        let mut room = Queue::<1, 2>::new();
        let mut queue = look_ahead(&mut room);
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
        /// Against the reverse pass, with pushes, starts, lowered ends and caps that change bit by bit, in any order.
        #[test]
        fn every_start_speed_is_that_of_a_full_reverse_pass(
            steps in prop::collection::vec((0u8..10, 0u32..2000, 0u32..500), 1..300),
        ) {
            let mut room = Queue::<1, 64>::new();
        let mut queue = look_ahead(&mut room);
            queue.first = 65_500; // numbers wrap on the way
            let mut model: Vec<(u32, u32)> = Vec::new();
            let mut running = false;
            let mut to_do = 0; // moves at the end whose caps are to change
            let change = |cap: u32| (cap * 7 + 13) % 2000;
            for (what, cap, gain) in steps {
                match what {
                    0 => if let (Some(longer), false) = (queue.last_waiting().copied(), queue.is_renewing()) {
                        let (_, old) = model.last_mut().unwrap();
                        *old += gain;
                        queue.lengthen_last(PlannedMove { length: *old as f32, ..longer }, *old);
                    },
                    1..=5 => if !queue.is_renewing() && queue.push(planned(cap), gain).is_ok() {
                        queue.moves.back_mut().unwrap().length = gain as f32;
                        model.push((cap, gain));
                    },
                    6..=7 => {
                        if running { model.remove(0); to_do = to_do.min(model.len()); }
                        running = queue.start_next().is_some();
                    }
                    8 => if !queue.is_renewing() {
                        let count = cap as usize % 6;
                        queue.lower_last(count, |planned| {
                            planned.cap /= 2;
                            planned.length = (planned.length * 0.75).trunc();
                            Some(planned.length as u32)
                        });
                        let from = model.len().saturating_sub(count).max(running.into());
                        for (cap, gain) in model.iter_mut().skip(from) { *cap /= 2; *gain = *gain * 3 / 4; }
                    },
                    _ => {
                        queue.begin_renewal();
                        to_do = model.len();
                    }
                }
                queue.renew(3, |_, planned| change(planned.cap));
                let done = model.len() - to_do;
                for (cap, _) in model.iter_mut().skip(done).take(3) { *cap = change(*cap); }
                to_do = to_do.saturating_sub(3);
                prop_assert_eq!(queue.is_renewing(), to_do > 0);
                let next = usize::from(running).min(model.len());
                prop_assert_eq!(u64::from(queue.exit_limit()), reverse_pass(&model[next..]));
                prop_assert_eq!(queue.len(), model.len());
            }
        }
    }
}
