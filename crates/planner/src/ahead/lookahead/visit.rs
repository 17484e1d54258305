//! Looks at planned moves without changing them: for reports and for the explanation of a job.

use super::{Braking, LookAhead};
use crate::moves::PlannedMove;

/// The most moves that one call visits: `Machine::poll` makes the call, and must not take long.
const VISITED: usize = 4;

impl<const AXES: usize, const MOTORS: usize> LookAhead<'_, AXES, MOTORS> {
    /// The slow move ahead: the limit at its start bounds the speed at the start of the next move
    /// to run. `None` if the rest at the end of the plan bounds it.
    pub(crate) fn slow_start(
        &self,
        braking: &impl Braking<AXES, MOTORS>,
    ) -> Option<&PlannedMove<AXES, MOTORS>> {
        let next = self.begun();
        if self.is_bound_by_end() {
            return None;
        }
        let open = self.planned.checked_sub(1)?;
        let near = self.near_end(next, open);
        let mut moves = (next..=near).filter_map(|index| self.moves.get(index));
        if let Some(found) = moves.find(|of| of.entry == of.cap) {
            return Some(found);
        }
        // The slow move lies in the first block whose speed at the start does not depend on its
        // end.
        let mut from = near;
        while from < open {
            let end = (from + (1 << self.block_bits)).min(open);
            if let Some(found) = self.slow_in(from, end, braking) {
                return Some(found);
            }
            from = end;
        }
        self.moves.get(open)
    }

    /// The first of the moves `from..end` at which the cap bounds the speed.
    fn slow_in(
        &self,
        from: usize,
        end: usize,
        braking: &impl Braking<AXES, MOTORS>,
    ) -> Option<&PlannedMove<AXES, MOTORS>> {
        let mut v2 = self.speed_at(end);
        let mut found = None;
        for index in (from..end).rev() {
            let of = self.moves.get(index)?;
            let gain = match braking.is_eased() {
                true => self.eased_gain(index, v2, braking),
                false => braking.gain(of, self.moves.get(index + 1), v2),
            };
            v2 = v2.saturating_add(gain);
            if v2 >= of.cap {
                v2 = of.cap;
                found = Some(of);
            }
        }
        found
    }

    /// The squared speed (units) at the start of the move at `index`, which is the first one of a
    /// block or the open one.
    fn speed_at(&self, index: usize) -> u32 {
        let number = self.number(index);
        if number & self.mask() == 0 {
            let at = self.block_at(self.block_of(number));
            self.blocks.get(at).map_or(0, |of| of.reach.v2)
        } else {
            self.moves.get(index).map_or(0, |of| of.entry)
        }
    }

    /// Visits up to [`VISITED`] moves of one block, beginning with number `from`; the running move
    /// and earlier ones are left out. Returns the number of the move to go on with, if there is
    /// one.
    ///
    /// `visit` takes the index of each move, the move, the move after it, and the largest squared speed (units) at which
    /// it may end. `guess` completes a move that is not planned yet; it takes that move and how
    /// many such moves come before it.
    pub(crate) fn visit_block(
        &self,
        from: u16,
        braking: &impl Braking<AXES, MOTORS>,
        guess: impl Fn(usize, &PlannedMove<AXES, MOTORS>) -> PlannedMove<AXES, MOTORS>,
        mut visit: impl FnMut(
            usize,
            &PlannedMove<AXES, MOTORS>,
            Option<&PlannedMove<AXES, MOTORS>>,
            u32,
        ),
    ) -> Option<u16> {
        let (waiting, len) = (self.begun(), self.moves.storage_len());
        let asked = usize::from(from.wrapping_sub(self.first));
        let begin = if asked > len {
            waiting // the move has begun since
        } else {
            asked.max(waiting)
        };
        let into = usize::from(self.number(begin) & self.mask());
        let end = (begin + (1 << self.block_bits) - into).min(len);
        let at = |index: usize| {
            let of = self.moves.get(index)?;
            let unplanned = index.checked_sub(self.settled);
            Some(unplanned.map_or(*of, |count| guess(count, of)))
        };
        let known = end + usize::from(self.is_inside(end)) * (len - end);
        let mut v2 = if known == end { self.speed_at(end) } else { 0 };
        // The moves to visit, with the speeds at their ends. Each move is asked for once: a guess is
        // costly.
        let mut near = [(None, 0); VISITED + 1];
        let mut after = None;
        for index in (begin..=known).rev() {
            let of = at(index);
            if let Some(place) = near.get_mut(index - begin) {
                *place = (of, v2);
            }
            if let Some(of) = of.as_ref().filter(|_| index < known) {
                let eased = braking.is_eased();
                let eased = eased.then(|| braking.eased_gain(&self.path(), index, v2));
                let gain = eased.flatten();
                let gain = gain.unwrap_or_else(|| braking.gain(of, after.as_ref(), v2));
                v2 = v2.saturating_add(gain).min(of.cap);
            }
            after = of;
        }
        let stop = end.min(begin + VISITED);
        for (index, pair) in (begin..stop).zip(near.windows(2)) {
            if let [(Some(of), limit), (next, _)] = pair {
                visit(index, of, next.as_ref(), *limit);
            }
        }
        (stop > begin && stop < len).then(|| self.number(stop))
    }

    /// Returns true if the speed at the start of a block has to be found move by move from the end
    /// of the queue: it has not been found yet, or the block is near the end of the plan. The block
    /// begins at `index`.
    fn is_inside(&self, index: usize) -> bool {
        let near_end = index + (1 << self.block_bits) >= self.planned;
        near_end || !self.was_found(self.block_of(self.number(index)))
    }
}
