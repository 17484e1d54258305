//! A piece of a few steps becomes part of the last queued move (see `short`).

use super::append::piece;
use super::Planner;
use crate::moves::PlannedMove;
use crate::path::short::Short;
use crate::real::norm2;
use crate::{Feed, Kinematics, Move};

impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Makes a short move by `delta` steps part of the last queued move, if that is short too and
    /// not planned yet. `None`, and nothing has changed, if one move cannot stand for both.
    #[inline(never)] // few lines come here
    pub(super) fn join(&mut self, of: &Move<AXES>, delta: &[i32; MOTORS]) -> Option<()> {
        let short = self.short.as_ref()?;
        let (last, is_planned) = self.queue.last_waiting()?;
        let fits = !is_planned && last.goes_on_with(of) && of.curve.is_none();
        let more2 = norm2(&self.axes_mm(*delta));
        if !fits || !self.is_short(last.length * last.length) || !self.is_short(more2) {
            return None;
        }
        let way = self.window.as_ref()?.way_on(&of.target);
        let joined = short.joined(delta, &way, self.limits.short2)?;
        let mut planned = PlannedMove::new(of, joined.delta());
        let direction = self.plan(&mut planned, of, joined.events());
        let is_short = self.is_short(planned.length * planned.length);
        let piece = piece(&planned, direction, of);
        let window = self.window.as_mut()?;
        window.join_last(&piece, is_short, joined.pieces.is_bent, &of.target);
        self.lengthen_newest(planned);
        self.short = Some(joined);
        self.begin_row(of, joined.delta());
        self.settle();
        Some(())
    }

    /// Notes the last queued move, which makes `delta` steps, so that the next one can be joined
    /// with it if both are short.
    pub(super) fn begin_short(&mut self, of: &Move<AXES>, delta: &[i32; MOTORS], is_short: bool) {
        let plain = matches!(of.feed, Feed::PerMinute(_)) && of.curve.is_none();
        let window = self.window.as_ref().filter(|_| plain && is_short);
        self.short = window.map(|window| Short::new(delta, window.last_way()));
    }

    /// Whether a move has too few steps to give a direction. `length2` is the square of its length,
    /// mm².
    pub(super) fn is_short(&self, length2: f32) -> bool {
        length2 < self.limits.short2
    }
}
