//! From the moves to the step interrupt: segments are made and handed over, but never more than
//! 2 ms of them.
//!
//! A segment comes from the planner. The [`PowerRule`](super::PowerRule) gives it the power that goes out. The
//! [`Feeder`](super::Feeder) puts it into the stepper's queue. [`Drivers`](super::Drivers) are enabled before the step timer is
//! started.

use super::feeder::Hunger;
use super::{Driver, Motion, Track};
use crate::board::{Board, Instant};
use crate::work::Work;
use leadscrew_planner::Kinematics;
use leadscrew_stepper::Segment;

/// The most segments made between two lines when motion may run out of segments. With one segment
/// only, motion does stop wherever a line and a segment together take longer to make than the
/// segment lasts.
const AT_ONCE: usize = 4;

impl<K, const AXES: usize, const MOTORS: usize> Motion<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS> + Clone,
{
    /// Finds out how much of the committed motion is left. Called at the start of a turn of the
    /// main loop.
    pub(crate) fn look(&mut self, now: Instant) {
        self.feeder.look(now);
    }

    /// Commits one segment if there is room. A line that waits is taken before the next segment, so
    /// that this segment takes the line's move into account. If segments may run out, they are
    /// committed before the line, [`AT_ONCE`] at most; so it is before motion begins, since a ramp
    /// may begin with segments that are over before the next turn. Returns whether the step timer is to be
    /// started. `may_start`: whether the program may begin to move now.
    pub(crate) fn prepare(&mut self, now: Instant, may_start: bool, work: &mut Work) -> bool {
        self.end_stop();
        self.program.planner.renew();
        if self.stopping || !self.may_feed(now, may_start) {
            return false;
        }
        for _ in 0..AT_ONCE {
            if !self.feeder.has_room() || !self.commit::<false>(work) || self.feeder.has_enough() {
                break;
            }
        }
        self.feeder.is_to_start()
    }

    /// As [`Motion::prepare`] in the middle of the program's motion, with long segments. Returns
    /// whether a move has ended.
    pub(crate) fn carry_on(&mut self, work: &mut Work) -> bool {
        let moves = self.program.planner.len();
        for _ in 0..AT_ONCE {
            if !self.feeder.has_room() || !self.commit::<true>(work) || self.feeder.has_enough() {
                break;
            }
        }
        self.program.planner.len() != moves
    }

    /// Returns true if the step interrupt makes the program's moves, and no hold or stop slows them
    /// down.
    pub(crate) fn goes_on(&self) -> bool {
        let runs = self.driver == Driver::Program && self.shared.is_running();
        runs && !self.stopping && !self.program.segmenter.is_held()
    }

    fn may_feed(&mut self, now: Instant, may_start: bool) -> bool {
        match self.driver {
            Driver::Aside => true,
            Driver::Program if !self.is_at_rest() => true,
            Driver::Program => may_start && self.is_released(now),
        }
    }

    fn is_released(&mut self, now: Instant) -> bool {
        if !self.wants_more() {
            self.release();
        }
        self.start.is_over(self.program.planner.len(), now)
    }

    /// Commits the next segment; returns whether there was one. `LONG`: it may be a whole cruise.
    fn commit<const LONG: bool>(&mut self, work: &mut Work) -> bool {
        let Some(mut segment) = self.next_segment::<LONG>() else {
            return false;
        };
        self.power.apply(&mut segment);
        self.power_out = segment.power;
        self.feeder.push(segment);
        work.segments = work.segments.wrapping_add(1);
        true
    }

    fn next_segment<const LONG: bool>(&mut self) -> Option<Segment<MOTORS>> {
        match self.driver {
            Driver::Program => {
                let Track { planner, segmenter } = &mut self.program;
                let room = self.feeder.room();
                self.lead.next(room.into(), || match LONG {
                    true => segmenter.next_long(planner),
                    false => segmenter.next(planner),
                })
            }
            Driver::Aside => self.aside.segmenter.next(&mut self.aside.planner),
        }
    }

    /// Starts the step timer, if [`Motion::prepare`] has returned `true`.
    pub(crate) fn start<B: Board>(&mut self, board: &mut B, now: Instant) {
        self.feeder.start(board, now);
    }

    /// Returns when [`Motion::prepare`] wants to be called again, should no interrupt come before.
    pub(crate) fn hunger(&mut self, now: Instant, may_start: bool) -> Hunger {
        if self.stopping || !self.may_feed(now, may_start) || !self.has_moves() {
            Hunger::None
        } else {
            self.feeder.hunger(now)
        }
    }

    fn has_moves(&self) -> bool {
        match self.driver {
            Driver::Program => {
                let waits = self.program.segmenter.is_held() || self.is_program_idle();
                !(waits && self.lead.is_empty())
            }
            Driver::Aside => !(self.aside.planner.is_empty() && self.aside.segmenter.is_idle()),
        }
    }

    /// Returns true if motion may run out of segments: they come before anything that takes long.
    pub(crate) fn is_short(&self) -> bool {
        self.feeder.is_short()
    }

    /// Returns true if segments ran out in motion since this was asked last.
    pub(crate) fn take_underrun(&mut self) -> bool {
        let before = self.underruns;
        self.underruns = self.shared.underruns();
        self.underruns != before
    }

    /// Returns true if the step interrupt does not come although there is motion to be made. Told
    /// once in a tenth of a second.
    pub(crate) fn take_stall(&mut self) -> bool {
        self.feeder.take_stall() && !(self.stopping && self.is_program_idle())
    }

    /// Returns when [`Motion::take_stall`] is to be asked, should no interrupt come before.
    pub(crate) fn look_at(&self, now: Instant) -> Option<Instant> {
        self.feeder.look_at(now)
    }

    fn end_stop(&mut self) {
        if self.stopping && self.feeder.is_at_rest() {
            self.stopping = false;
            self.shared.set_stop(false);
        }
    }
}
