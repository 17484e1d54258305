//! A piece of a few steps becomes part of the last queued move (see `short`).

use super::Planner;
use crate::real::norm2;
use crate::short::Short;
use crate::strokes::Piece;
use crate::{Feed, Kinematics, Move};

/// The last queued move, taken back, and one more piece.
pub(super) struct Joined<const AXES: usize, const MOTORS: usize> {
    /// Steps of both.
    pub(super) delta: [i32; MOTORS],
    /// Steps of the dominant motor.
    pub(super) events: u32,
    /// How far each axis was asked to go by the piece, mm.
    pub(super) way: [f32; AXES],
    /// Its [`corner`](crate::moves::PlannedMove::corner) as it was.
    pub(super) corner: u32,
    /// Its [`cap`](crate::moves::PlannedMove::cap) as it was.
    pub(super) cap: u32,
}

impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Takes the last queued move back, for one more by `delta` steps to be joined to it. `None`, and nothing has changed, where the two
    /// are not as good as one.
    pub(super) fn join(
        &mut self,
        of: &Move<AXES>,
        delta: &[i32; MOTORS],
    ) -> Option<Joined<AXES, MOTORS>> {
        self.short.as_ref()?;
        self.join_short(of, delta)
    }

    #[inline(never)] // few lines come here
    fn join_short(
        &mut self,
        of: &Move<AXES>,
        delta: &[i32; MOTORS],
    ) -> Option<Joined<AXES, MOTORS>> {
        let last = self.queue.last_waiting()?;
        let asked = self.asked(delta);
        let vector = self.kinematics.axes_mm(&asked.way);
        let piece = Piece {
            length2: norm2(&vector),
            vector,
            top_v2: last.top_v2(),
            is_chord: false,
        };
        if !last.goes_on_with(of)
            || !self.is_short(last.length * last.length)
            || !self.is_short(piece.length2)
            || !self.strokes.has_room(&piece, &self.limits)
        {
            return None;
        }
        let short = self.short.as_ref()?.joined(delta, &asked)?;
        // Where the running move relies on the last one to stop, another one could brake less.
        let committed = self.limits.unit.units(self.committed_v2);
        if !self.queue.stops_before_last(1, committed.saturating_add(1)) {
            return None;
        }
        let joined = Joined {
            delta: short.delta(),
            events: short.events(),
            way: vector,
            corner: last.corner,
            cap: last.cap,
        };
        self.queue.take_last();
        self.strokes.take_back_last();
        self.short = Some(short);
        Some(joined)
    }

    /// Notes the move by `delta` steps as the last one, for the next one to be joined to it where both are short. Answers how far each
    /// axis was asked to go by it where it is, mm.
    pub(super) fn begin_short(
        &mut self,
        of: &Move<AXES>,
        delta: &[i32; MOTORS],
        length: f32,
    ) -> Option<[f32; AXES]> {
        let plain = matches!(of.feed, Feed::PerMinute(_)) && of.curve.is_none();
        if plain && self.is_short(length * length) {
            return Some(self.begin_with(delta));
        }
        self.short = None;
        None
    }

    #[inline(never)] // few lines come here
    fn begin_with(&mut self, delta: &[i32; MOTORS]) -> [f32; AXES] {
        let asked = self.asked(delta);
        self.short = Some(Short::new(delta, &asked));
        self.kinematics.axes_mm(&asked.way)
    }

    /// Whether a move, the square of whose length is `length2` mm², is so short that its direction says little.
    fn is_short(&self, length2: f32) -> bool {
        length2 < self.limits.stroke2
    }
}
