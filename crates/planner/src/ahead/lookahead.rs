//! The queue of planned moves, and the highest speed at which each may begin, so that all limits of
//! the later moves can be kept.
//!
//! The squared speed `x_in` at the start of a move is bounded by its `cap`, and by the squared
//! speed `x_out` at its end: a move can brake by no more than a gain, which depends on the speed
//! (see `polygon`).
//!
//! ```text
//!   x_in = min(cap, x_out + gain(x_out))
//! ```
//!
//! That is a concave function. The line through its values at `x_out = 0` and at the highest
//! `x_out` is never above it:
//!
//! ```text
//!   x_in ≥ min(c, α·x_out + β)
//! ```
//!
//! Two such maps, one after the other, are again such a map. So a *block* of moves has a map of its
//! own, and each new move is added to it once:
//!
//! ```text
//!   min(c1, α1·min(c2, α2·x + β2) + β1) = min( min(c1, α1·c2 + β1),  α1·α2·x + (α1·β2 + β1) )
//! ```
//!
//! ```text
//!   running | next . . . . . . | . . . . . . . . | block | block | block | . . open     window
//!             <---- move by move, exact --------- <------ block by block ------- rest
//! ```
//!
//! Motion must be able to rest at the end of the last move. From there backwards the speeds at the
//! starts of moves are found block by block, as far as they have changed. For the moves right after
//! the running one, these speeds are found move by move, with the whole polygon. A further move
//! only raises these speeds, so a speed that was promised stays possible.
//!
//! The last move is *open*: the move after it is not known yet. The moves of a curve wait in the
//! window (see `window`) until their curvature is known.
//!
//! Everything is in whole [`SpeedUnit`](crate::config::SpeedUnit)s: gains and caps are rounded
//! down, so no plan needs more than the limits; if `α` is 1, as on straight lines, sums are
//! exact.
//!
//! An override changes all caps. That is done a few moves at a time, beginning at the running move.
//! Meanwhile the moves up to some place have new caps, and the later moves have old ones. Old and
//! new caps keep every limit of the machine; they differ in the speed asked for.

mod visit;

pub(crate) use super::map::Ends;
use super::map::{Map, Reach};
use crate::moves::PlannedMove;
use heapless::deque::DequeView;

/// The number of blocks of a [`Queue`](crate::Queue) that names no other: enough for 1024 moves in
/// blocks of sixteen.
pub const USUAL_BLOCKS: usize = 128;

/// The speeds of this many moves after the running one, or of up to a block more, are found move by
/// move. With 4, dense curves take 0.02 % longer; with 8, no longer than with 16. Each move takes
/// some 1200 cycles of a Cortex-M4F, in one call, while motion goes on.
const EXACT: usize = 8;

/// Binary logarithm of the number of moves in the largest block.
const MOST_BITS: u32 = 6;

/// The most moves that can be queued with this many blocks. Half of the blocks hold them all,
/// wherever the first move begins within its block.
pub(crate) const fn most_moves(blocks: usize) -> usize {
    (blocks / 2) << MOST_BITS
}

/// Binary logarithm of the number of moves in a block: of sixteen, or of more if there are more
/// than eight moves for each block.
fn block_bits(moves: usize, blocks: usize) -> u32 {
    let mut bits = 4;
    while moves >> bits > blocks / 2 {
        bits += 1;
    }
    bits
}

/// A block: moves whose numbers differ in their last bits only.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    /// The map from the squared speed at the block's end to the one at its start.
    map: Map,
    /// The squared speed at its start.
    reach: Reach,
}

impl Block {
    pub(crate) const EMPTY: Self = Self {
        map: Map::NONE,
        reach: Reach {
            v2: 0,
            bound_by_end: false,
        },
    };
}

/// Tells by how much moves can brake.
pub(crate) trait Braking<const AXES: usize, const MOTORS: usize> {
    /// Returns by how much the squared speed (units) can fall over a move that ends at the squared
    /// speed `v2`. `after` is the move after it, if there is one.
    fn gain(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
        after: Option<&PlannedMove<AXES, MOTORS>>,
        v2: u32,
    ) -> u32;

    /// The highest squared speed at the end of a move that `after` follows, and the gains there,
    /// whatever the overrides.
    fn ends(&self, planned: &PlannedMove<AXES, MOTORS>, after: &PlannedMove<AXES, MOTORS>) -> Ends;

    /// Returns true if the jerk is limited. Then the methods below are asked, and not those above.
    fn is_eased(&self) -> bool;

    /// As [`Braking::gain`] for the move at `index` of `path`, with the limits of the moves near it;
    /// `None` if its turn is not known.
    fn eased_gain(&self, path: &Path<'_, AXES, MOTORS>, index: usize, v2: u32) -> Option<u32>;

    /// As [`Braking::ends`] for the move at `index` of `path`, with the limits of the moves near it.
    fn eased_ends(&self, path: &Path<'_, AXES, MOTORS>, index: usize) -> Ends;

    /// The limits of the move at `index` of `path` by the moves near it.
    fn near(&self, path: &Path<'_, AXES, MOTORS>, index: usize) -> Option<Near>;
}

/// The limits of a move by the moves near it, with a jerk limit.
pub(crate) struct Near {
    /// The highest squared speed at its start, units.
    pub(crate) start: u32,
    /// The values to keep with the move (see [`PlannedMove::near`]).
    pub(crate) kept: Option<([f32; 2], f32)>,
}

/// The moves whose turns are known, the first of the queue first.
pub(crate) struct Path<'m, const AXES: usize, const MOTORS: usize> {
    moves: &'m DequeView<PlannedMove<AXES, MOTORS>>,
    settled: usize,
    is_closed: bool,
}

impl<const AXES: usize, const MOTORS: usize> Path<'_, AXES, MOTORS> {
    /// The move at `index`, if its turn is known.
    pub(crate) fn at(&self, index: usize) -> Option<&PlannedMove<AXES, MOTORS>> {
        self.moves.get(index).filter(|_| index < self.settled)
    }

    /// Returns true if motion rests at the end of the last move, whatever comes after it.
    pub(crate) const fn ends(&self) -> bool {
        self.is_closed
    }
}

/// The moves that have changed since speeds were found.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Stale {
    Nothing,
    /// Moves were added at the end, or the last one grew. The moves before some place are
    /// unchanged.
    End,
    /// Anything may have changed.
    All,
}

impl Stale {
    /// The changes of both.
    fn max(self, other: Self) -> Self {
        match (self, other) {
            (Self::All, _) | (_, Self::All) => Self::All,
            (Self::End, _) | (_, Self::End) => Self::End,
            (Self::Nothing, Self::Nothing) => Self::Nothing,
        }
    }
}

/// Planned moves, the running one first, with the speed at which each may begin.
#[derive(Debug)]
pub(crate) struct LookAhead<'q, const AXES: usize, const MOTORS: usize> {
    moves: &'q mut DequeView<PlannedMove<AXES, MOTORS>>,
    /// Their number is a power of two.
    blocks: &'q mut [Block],
    block_bits: u32,
    /// Number of the first move, modulo 2¹⁶.
    first: u16,
    /// True if the first move runs: its start no longer limits anything.
    running: bool,
    /// With a jerk limit: how many moves, from the first one on, the plan has passed. Segments of
    /// them are still to be made.
    behind: usize,
    /// The number of moves, from the first one on, that are in the plan.
    planned: usize,
    /// The turns at the starts of how many moves are known. Without a jerk limit these moves are in
    /// the plan.
    settled: usize,
    /// The number of the move that is to begin at rest, although its turn may not be known yet.
    rests: Option<u16>,
    /// The moves that have changed since speeds were found.
    stale: Stale,
    /// The number of the first move whose speed was not found move by move.
    walked: u16,
    /// The number of the last planned move at the time when speeds were last found.
    found: u16,
    /// While caps change: how many moves, from the first one on, have their new caps.
    renewed: Option<usize>,
}

impl<'q, const AXES: usize, const MOTORS: usize> LookAhead<'q, AXES, MOTORS> {
    /// An empty queue in `room`, which holds moves, and `blocks`.
    pub(crate) fn new(
        room: &'q mut DequeView<PlannedMove<AXES, MOTORS>>,
        blocks: &'q mut [Block],
    ) -> Self {
        room.clear();
        Self {
            block_bits: block_bits(room.storage_capacity(), blocks.len()),
            moves: room,
            blocks,
            first: 0,
            running: false,
            behind: 0,
            planned: 0,
            settled: 0,
            rests: None,
            stale: Stale::All,
            walked: 0,
            found: 0,
            renewed: None,
        }
    }

    /// Returns how many moves are queued, the running one included.
    pub(crate) fn len(&self) -> usize {
        self.moves.storage_len()
    }

    /// Returns how many moves there is room for.
    pub(crate) fn capacity(&self) -> usize {
        self.moves.storage_capacity()
    }

    /// Returns how many moves are planned that do not run.
    pub(crate) fn waiting(&self) -> usize {
        self.planned.saturating_sub(self.begun())
    }

    /// Returns how many moves the plan has begun, from the first one on.
    const fn begun(&self) -> usize {
        self.behind + self.running as usize
    }

    /// The move that runs, if one does.
    pub(crate) fn running(&self) -> Option<&PlannedMove<AXES, MOTORS>> {
        self.moves.get(self.behind).filter(|_| self.running)
    }

    /// The first move that the plan has begun: its segments come next.
    pub(crate) fn front(&self) -> Option<&PlannedMove<AXES, MOTORS>> {
        self.moves.front().filter(|_| self.begun() > 0)
    }

    /// The index of the move that runs, or of the next one.
    pub(crate) const fn at(&self) -> usize {
        self.behind
    }

    /// The moves whose turns are known.
    pub(crate) fn path(&self) -> Path<'_, AXES, MOTORS> {
        let next = self.number(self.settled);
        Path {
            moves: self.moves,
            settled: self.settled,
            is_closed: self.rests == Some(next),
        }
    }

    /// The first move that does not run, if it is planned.
    pub(crate) fn next(&self) -> Option<&PlannedMove<AXES, MOTORS>> {
        self.moves.get(self.begun()).filter(|_| self.waiting() > 0)
    }

    /// Appends a move that is not planned yet. The caller has checked that there is room.
    pub(crate) fn push(&mut self, planned: &PlannedMove<AXES, MOTORS>) {
        let _room = self.moves.push_back(*planned);
    }

    /// The last move whose turn is known.
    pub(crate) fn last_settled(&self) -> Option<&PlannedMove<AXES, MOTORS>> {
        self.moves.get(self.settled.checked_sub(1)?)
    }

    /// The turn at the start of one more move is known. `begin` sets the limits there; later only
    /// overrides change them. It takes the move, and whether that begins at rest whatever its turn.
    pub(crate) fn settle(&mut self, begin: impl FnOnce(&mut PlannedMove<AXES, MOTORS>, bool)) {
        let rests = self.rests == Some(self.number(self.settled));
        let Some(of) = self.moves.get_mut(self.settled) else {
            return;
        };
        begin(of, rests);
        if rests {
            self.rests = None;
        }
        self.settled += 1;
    }

    /// Returns true if some queued move is not planned.
    pub(crate) fn is_unplanned(&self) -> bool {
        self.planned < self.moves.storage_len()
    }

    /// The two moves that meet at the next turn to be known.
    pub(crate) fn next_turn(&self) -> [Option<&PlannedMove<AXES, MOTORS>>; 2] {
        let before = self.settled.checked_sub(1);
        [before, Some(self.settled)].map(|index| self.moves.get(index?))
    }

    /// Returns true if the turns of all moves are known.
    pub(crate) fn is_settled(&self) -> bool {
        self.settled == self.moves.storage_len()
    }

    /// The index of the first move that is not planned.
    pub(crate) const fn next_to_plan(&self) -> usize {
        self.planned
    }

    /// Makes motion rest at the end of the last queued move, whatever comes after it.
    pub(crate) fn close(&mut self) {
        self.rests = Some(self.number(self.moves.storage_len()));
    }

    /// Bounds the squared speed (units) at the end of the first move that is not planned.
    pub(crate) fn slow_down(&mut self, v2: u32) {
        let index = self.planned + 1;
        if let Some(after) = self.moves.get_mut(index).filter(|_| index < self.settled) {
            after.corner = after.corner.min(v2);
            after.cap = after.cap.min(v2);
        }
    }

    /// Plans the first move that is not planned yet, with a jerk limit. `near`: the limits of the
    /// move by the moves near it.
    #[inline(never)]
    pub(crate) fn plan_near(&mut self, braking: &impl Braking<AXES, MOTORS>, near: Near) {
        if self.planned < self.settled {
            self.keep_near(self.planned, near);
            self.plan(braking);
        }
    }

    /// Without a jerk limit: the turn at the start of one more move is known, and the move is planned.
    /// `begin` sets the limits there.
    #[inline(always)] // two calls would take 35 more instructions for each line
    pub(crate) fn plan_settled(
        &mut self,
        braking: &impl Braking<AXES, MOTORS>,
        begin: impl FnOnce(&mut PlannedMove<AXES, MOTORS>),
    ) {
        let Some(of) = self.moves.get_mut(self.planned) else {
            return;
        };
        begin(of);
        self.settled = self.planned + 1;
        self.plan(braking);
    }

    /// Plans the first move that is not planned yet; its turn is known.
    #[inline(always)]
    fn plan(&mut self, braking: &impl Braking<AXES, MOTORS>) {
        if let Some(open) = self.planned.checked_sub(1) {
            self.fold(open, braking);
        }
        self.planned += 1;
        self.stale = self.stale.max(Stale::End);
    }

    /// Bounds the speed at the start of the move at `index` by the moves near it, with a jerk limit.
    fn keep_near(&mut self, index: usize, near: Near) {
        if let Some(of) = self.moves.get_mut(index) {
            of.cap = of.cap.min(near.start);
            of.set_near(near.kept);
        }
    }

    /// Adds the move at `index`, which another move follows, to the map of its block.
    fn fold(&mut self, index: usize, braking: &impl Braking<AXES, MOTORS>) {
        let (Some(of), Some(after)) = (self.moves.get(index), self.moves.get(index + 1)) else {
            return;
        };
        let ends = match braking.is_eased() {
            true => self.eased_ends(index, braking),
            false => braking.ends(of, after),
        };
        let map = Map::new(of.cap, ends);
        let number = self.number(index);
        let begins = number & self.mask() == 0;
        let at = self.block_at(self.block_of(number));
        if let Some(block) = self.blocks.get_mut(at) {
            block.map = if begins { map } else { block.map.before(map) };
        }
    }

    /// The last queued move, unless it is the running one, and whether its turn is known.
    pub(crate) fn last_waiting(&self) -> Option<(&PlannedMove<AXES, MOTORS>, bool)> {
        let waiting = self.moves.storage_len() > self.begun();
        let last = self.moves.back().filter(|_| waiting)?;
        Some((last, self.is_settled()))
    }

    /// The last move, which does not run, to be made longer. The longer move begins as before and
    /// can brake at least as much, so planned speeds stay valid.
    pub(crate) fn lengthen_last(&mut self) -> Option<&mut PlannedMove<AXES, MOTORS>> {
        if self.planned == self.moves.storage_len() {
            self.stale = self.stale.max(Stale::End);
        }
        self.moves.back_mut()
    }

    /// Ends the move that runs, if one does, and starts the next one.
    pub(crate) fn start_next(&mut self) -> Option<&PlannedMove<AXES, MOTORS>> {
        self.finish();
        self.running = self.planned > self.behind;
        self.running()
    }

    /// Removes the move that runs, if one does.
    pub(crate) fn finish(&mut self) {
        if self.running {
            self.pass();
            self.retire();
        }
    }

    /// Notes that the plan has come to the end of the move that runs.
    pub(crate) fn pass(&mut self) {
        self.behind += usize::from(self.running);
        self.running = false;
    }

    /// Removes the first move, which the plan has passed.
    pub(crate) fn retire(&mut self) {
        if self.behind > 0 {
            self.moves.pop_front();
            self.behind -= 1;
            self.planned -= 1;
            self.settled -= 1;
            self.first = self.first.wrapping_add(1);
            self.renewed = self.renewed.map(|count| count.saturating_sub(1));
        }
    }

    /// The largest squared speed, in units, at which the running move may end so that all later
    /// limits can be kept, as it was found last.
    pub(crate) fn exit_limit(&self) -> u32 {
        self.next().map_or(0, |next| next.entry)
    }

    /// Returns true if [`LookAhead::exit_limit`] would be higher if motion could go on after the
    /// last planned move.
    pub(crate) fn is_bound_by_end(&self) -> bool {
        self.next().is_none_or(|next| next.bound_by_end)
    }

    /// The move that was queued last.
    pub(crate) fn newest(&self) -> Option<&PlannedMove<AXES, MOTORS>> {
        self.moves.back()
    }

    /// All moves, the one that was queued last first.
    #[cfg(test)]
    pub(crate) fn latest(&self) -> impl Iterator<Item = &PlannedMove<AXES, MOTORS>> {
        self.moves.iter().rev()
    }

    /// The first move that does not run, planned or not.
    pub(crate) fn next_queued(&self) -> Option<&PlannedMove<AXES, MOTORS>> {
        self.moves.get(self.begun())
    }

    /// The number of the first move that does not run.
    pub(crate) fn first_waiting(&self) -> u16 {
        self.first.wrapping_add(self.begun() as u16)
    }

    /// Begins to set every cap anew: an override has changed. Go on with [`LookAhead::renew`].
    pub(crate) fn begin_renewal(&mut self) {
        self.renewed = Some(self.behind);
    }

    /// Returns true if caps are being changed for new overrides.
    pub(crate) const fn is_renewing(&self) -> bool {
        self.renewed.is_some()
    }

    /// Sets the caps of one more block of moves anew, of `most` moves at most. `cap` takes each move together with the move
    /// before it.
    pub(crate) fn renew(
        &mut self,
        braking: &impl Braking<AXES, MOTORS>,
        most: usize,
        cap: impl Fn(Option<&PlannedMove<AXES, MOTORS>>, &PlannedMove<AXES, MOTORS>) -> u32,
    ) {
        let Some(from) = self.renewed else { return };
        let into = usize::from(self.number(from) & self.mask());
        let most = most.min((1 << self.block_bits) - into);
        let (to, eased) = (
            (from + most).min(self.moves.storage_len()),
            braking.is_eased(),
        );
        for index in from..to {
            let before = index.checked_sub(1).and_then(|index| self.moves.get(index));
            let cap = self.moves.get(index).map_or(0, |of| cap(before, of));
            if let Some(of) = self.moves.get_mut(index) {
                of.cap = cap;
            }
            if eased && index < self.planned {
                if let Some(near) = braking.near(&self.path(), index) {
                    self.keep_near(index, near);
                }
            }
            if index + 1 < self.planned {
                self.fold(index, braking);
            }
        }
        self.stale = Stale::All;
        self.renewed = (to < self.moves.storage_len()).then_some(to);
    }

    /// Forgets all moves.
    pub(crate) fn clear(&mut self) {
        self.moves.clear();
        self.running = false;
        (self.behind, self.planned, self.settled) = (0, 0, 0);
        self.rests = None;
        self.stale = Stale::All;
        self.renewed = None;
    }

    /// The number of the move at `index`, modulo 2¹⁶.
    fn number(&self, index: usize) -> u16 {
        self.first.wrapping_add(index as u16)
    }

    /// The bits of a move's number that tell its place in its block.
    fn mask(&self) -> u16 {
        (1 << self.block_bits) - 1
    }

    /// The number of the block that the move `number` lies in.
    fn block_of(&self, number: u16) -> u16 {
        number >> self.block_bits
    }

    /// The index at which a block is kept.
    fn block_at(&self, block: u16) -> usize {
        usize::from(block) & self.blocks.len().wrapping_sub(1)
    }
}

impl<const AXES: usize, const MOTORS: usize> LookAhead<'_, AXES, MOTORS> {
    /// Finds anew how fast the planned moves may begin, as far as that has changed: block by block
    /// from the end of the plan backwards, then move by move up to the running move. It stops when
    /// the speeds are as they were.
    pub(crate) fn find(&mut self, braking: &impl Braking<AXES, MOTORS>) {
        let next = self.begun();
        let Some(open) = self.planned.checked_sub(1).filter(|open| *open >= next) else {
            return;
        };
        let near = self.near_end(next, open);
        if self.stale == Stale::Nothing && self.number(near) == self.walked {
            return;
        }
        let after = self.find_blocks(near, open, braking);
        self.walk(next, near, after, braking);
        self.stale = Stale::Nothing;
        self.walked = self.number(near);
        self.found = self.number(open);
    }

    /// The index of the move up to which speeds are found move by move: the first move of a block,
    /// at least [`EXACT`] moves after `next`; or the open move, if that comes earlier.
    fn near_end(&self, next: usize, open: usize) -> usize {
        let least = next + EXACT - 1;
        let into = usize::from(self.number(least) & self.mask());
        (least + (1 << self.block_bits) - into).min(open)
    }

    /// The speed at the start of the move `near`, from the speed of the open move, block by block.
    fn find_blocks(
        &mut self,
        near: usize,
        open: usize,
        braking: &impl Braking<AXES, MOTORS>,
    ) -> Reach {
        let eased = match braking.is_eased() {
            true => Some(self.eased_gain(open, 0, braking)),
            false => None,
        };
        let Some(last) = self.moves.get_mut(open) else {
            return Reach::default();
        };
        let gain = match eased {
            Some(gain) => gain,
            None => braking.gain(last, None, 0),
        };
        let mut reach = Reach::bounded(gain.into(), last.cap, true);
        (last.entry, last.bound_by_end) = (reach.v2, reach.bound_by_end);
        if near == open {
            return reach;
        }
        let (from, to) = (self.number(open), self.block_of(self.number(near)));
        let mut block = self.block_of(from);
        let mut whole = from & self.mask() == 0;
        loop {
            let at = self.block_at(block);
            let Some(of) = self.blocks.get(at) else {
                return reach;
            };
            if !whole {
                reach = of.map.reach(reach);
            }
            whole = false;
            let same = of.reach == reach && self.stale == Stale::End && self.was_found(block);
            if let Some(of) = self.blocks.get_mut(at) {
                of.reach = reach;
            }
            if block == to {
                return reach;
            }
            if same {
                let at = self.block_at(to);
                return self.blocks.get(at).map_or(reach, |of| of.reach);
            }
            block = block.wrapping_sub(1) & (u16::MAX >> self.block_bits);
        }
    }

    /// The speeds at the starts of the moves from `next` to `near`, move by move, as far as they
    /// have changed.
    fn walk(
        &mut self,
        next: usize,
        near: usize,
        after: Reach,
        braking: &impl Braking<AXES, MOTORS>,
    ) {
        let (known, eased) = (self.known(self.walked), braking.is_eased());
        let mut reach = after;
        for index in (next..near).rev() {
            let Some(of) = self.moves.get(index) else {
                return;
            };
            let gain = match eased {
                true => self.eased_gain(index, reach.v2, braking),
                false => braking.gain(of, self.moves.get(index + 1), reach.v2),
            };
            reach = Reach::bounded(
                u64::from(reach.v2) + u64::from(gain),
                of.cap,
                reach.bound_by_end,
            );
            let Some(of) = self.moves.get_mut(index) else {
                return;
            };
            let same = (of.entry, of.bound_by_end) == (reach.v2, reach.bound_by_end);
            if same && index < known && self.stale != Stale::All {
                return;
            }
            (of.entry, of.bound_by_end) = (reach.v2, reach.bound_by_end);
        }
    }

    /// As [`Braking::eased_gain`] for the planned move at `index`.
    #[inline(never)]
    fn eased_gain(&self, index: usize, v2: u32, braking: &impl Braking<AXES, MOTORS>) -> u32 {
        braking.eased_gain(&self.path(), index, v2).unwrap_or(0)
    }

    /// As [`Braking::eased_ends`] for the planned move at `index`.
    #[inline(never)]
    fn eased_ends(&self, index: usize, braking: &impl Braking<AXES, MOTORS>) -> Ends {
        braking.eased_ends(&self.path(), index)
    }

    /// Returns true if the speed at the start of a block was found the last time.
    fn was_found(&self, block: u16) -> bool {
        let start = (block << self.block_bits).wrapping_sub(self.first);
        usize::from(start) < self.known(self.found)
    }

    /// The index of the move with this number; 0 if that move has gone.
    fn known(&self, number: u16) -> usize {
        (number.wrapping_sub(self.first) as i16).max(0) as usize
    }
}
