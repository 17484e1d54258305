//! The trail of the tool: every move that is planned, and how many of them have begun.
//!
//! ```text
//!   0 ........ done ......... planned        moves since power-up, of which the oldest may have been forgotten
//!     behind         ahead
//! ```

use leadscrew_machine::explain::PlannedMove;
use leadscrew_sim::clock::Cycle;
use leadscrew_sim::observer::{Observer, Taken};
use leadscrew_sim::scene::{Drawn, Tooling, Way};
use std::cell::RefCell;
use std::collections::VecDeque;

/// Moves that are kept; a page gets 20 bytes for each.
const KEPT: usize = 500_000;

/// Watches a machine and keeps its moves.
#[derive(Debug, Default)]
pub struct Trail {
    tooling: Tooling,
    moves: VecDeque<Drawn>,
    /// Moves that were forgotten: the number of the first move kept.
    first: u32,
    /// Moves that are finished: the number of the move under way.
    done: u32,
    /// The number of the last planned move that was joined into the move under way. The first of
    /// the joined moves has number `done` when the joined move begins.
    joined: u32,
    /// Moves that have not begun. For each: its number, and the steps of each motor. The steps of
    /// earlier moves that were joined with it are included.
    planned: VecDeque<(u32, Vec<u32>)>,
    /// The end of the last planned move.
    at: Option<[f32; 3]>,
    /// Changes when planned moves are dropped.
    pub edition: u32,
}

impl Trail {
    /// Makes a trail without a move.
    pub fn new(tooling: Tooling) -> Self {
        Self {
            tooling,
            ..Self::default()
        }
    }

    /// Returns the number of moves planned since power-up.
    pub fn planned(&self) -> u32 {
        self.first + self.moves.len() as u32
    }

    /// Returns the number of the oldest move that is kept.
    pub fn first(&self) -> u32 {
        self.first
    }

    /// Returns the number of moves that a carriage at `position` (mm) has finished, and the line of
    /// the move that it makes now; 0 if it makes none.
    pub fn progress(&mut self, position: [f32; 3]) -> (u32, u32) {
        while self.done < self.joined && self.is_passed(self.done, position) {
            self.done += 1;
        }
        let under_way = self.get(self.done).map_or(0, |one| one.line);
        (self.done, under_way)
    }

    /// Returns the moves from number `from` on, in the layout of pages, at most `most` of them.
    pub fn bytes(&self, from: u32, most: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        let skipped = from.saturating_sub(self.first) as usize;
        for one in self.moves.iter().skip(skipped).take(most) {
            one.write(&mut bytes);
        }
        bytes
    }

    /// Forgets the moves that are finished.
    pub fn clear(&mut self) {
        let behind = self.done.saturating_sub(self.first) as usize;
        self.moves.drain(..behind.min(self.moves.len()));
        self.first = self.done.max(self.first);
        // A first move needs a place to begin at.
        if let (Some(at), None) = (self.at, self.moves.front()) {
            self.jump(at);
        }
    }

    /// Notes that the machine rests at `position`, mm. Planned moves that have not begun are
    /// dropped.
    pub fn rest(&mut self, position: [f32; 3]) {
        let taken_back = self.planned.front().map(|(number, _)| *number);
        if let Some(number) = taken_back {
            let kept = number.saturating_sub(self.first) as usize;
            self.moves.truncate(kept);
            self.edition = self.edition.wrapping_add(1);
            self.planned.clear();
        }
        let there = |at: [f32; 3]| at.iter().zip(position).all(|(a, b)| (a - b).abs() < 0.02);
        if !self.at.is_some_and(there) {
            self.jump(position);
        }
        self.done = self.planned();
        self.joined = self.done;
    }

    fn jump(&mut self, to: [f32; 3]) {
        self.at = Some(to);
        self.push(Drawn {
            to,
            line: 0,
            way: Way::Jump,
            power: 0.0,
            tool_mm: 0.0,
        });
        self.done = self.done.max(self.planned());
        self.joined = self.done;
    }

    fn push(&mut self, one: Drawn) {
        if self.moves.len() == KEPT {
            self.moves.pop_front();
            self.first += 1;
        }
        self.moves.push_back(one);
    }

    fn get(&self, number: u32) -> Option<&Drawn> {
        self.moves.get(number.checked_sub(self.first)? as usize)
    }

    /// Returns true if a carriage at `position` has passed the end of move `number`.
    fn is_passed(&self, number: u32, position: [f32; 3]) -> bool {
        let before = number.checked_sub(1).and_then(|number| self.get(number));
        let (Some(from), Some(one)) = (before, self.get(number)) else {
            return true;
        };
        let along = |axis: usize| (one.to[axis] - from.to[axis]) * (position[axis] - one.to[axis]);
        along(0) + along(1) + along(2) >= 0.0
    }
}

impl Observer for Trail {
    fn move_planned(&mut self, planned: &PlannedMove<'_>) {
        let mm = |axis: usize| planned.target.get(axis).map_or(0.0, |at| at.to_mm());
        let to = [mm(0), mm(1), mm(2)];
        let kind = self.tooling.planned(planned);
        self.planned.push_back((
            self.planned(),
            planned
                .steps
                .iter()
                .map(|steps| steps.unsigned_abs())
                .collect(),
        ));
        self.at = Some(to);
        self.push(Drawn {
            to,
            line: planned.line,
            way: kind.way(),
            power: kind.power(),
            tool_mm: 0.0,
        });
    }

    fn segment_taken(&mut self, _: Cycle, taken: Option<&Taken<'_>>) {
        let Some(steps) = taken.and_then(|taken| taken.line) else {
            return;
        };
        let found = self.planned.iter().position(|(_, of)| of == steps);
        if let Some(last) = found {
            let first = self.planned.front().map(|(number, _)| *number);
            let number = self.planned.drain(..=last).next_back();
            self.done = first.unwrap_or(self.done);
            self.joined = number.map_or(self.done, |(number, _)| number);
        }
    }
}

/// An observer that writes a trail which others can read meanwhile.
pub struct Watcher<'t>(pub &'t RefCell<Trail>);

impl Observer for Watcher<'_> {
    fn move_planned(&mut self, planned: &PlannedMove<'_>) {
        self.0.borrow_mut().move_planned(planned);
    }

    fn segment_taken(&mut self, cycle: Cycle, taken: Option<&Taken<'_>>) {
        self.0.borrow_mut().segment_taken(cycle, taken);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_planner::{Coordinate, MoveKind};
    use leadscrew_sim::scene::MOVE_BYTES;
    use leadscrew_stepper::Power;

    fn plan(trail: &mut Trail, x: f32, steps: i32, line: u32) {
        trail.move_planned(&PlannedMove {
            begin: &[],
            target: &[Coordinate::from_mm(x).unwrap()],
            kind: MoveKind::Feed,
            power: Power::FULL,
            is_laser: false,
            speed_limit: None,
            line,
            steps: &[steps],
            acceleration: 1.0,
            rate: 1.0,
            feed: 1.0,
        });
    }

    fn take(trail: &mut Trail, steps: u32) {
        trail.segment_taken(
            Cycle::ZERO,
            Some(&Taken {
                line: Some(&[steps]),
                step_events: 1,
                ends_event: true,
                power: [1.0; 2],
            }),
        );
    }

    #[test]
    fn the_move_under_way_is_told_and_what_lies_behind() {
        let mut trail = Trail::default();
        trail.rest([0.0; 3]);
        plan(&mut trail, 1.0, 250, 7);
        plan(&mut trail, 3.0, -500, 8);
        assert_eq!((trail.planned(), trail.progress([0.0; 3])), (3, (1, 7)));
        take(&mut trail, 250);
        assert_eq!(trail.progress([0.5, 0.0, 0.0]), (1, 7));
        take(&mut trail, 500);
        assert_eq!(trail.progress([1.5, 0.0, 0.0]), (2, 8));
        trail.rest([3.0, 0.0, 0.0]);
        assert_eq!(trail.progress([3.0, 0.0, 0.0]), (3, 0));
    }

    #[test]
    fn pixels_that_were_joined_pass_one_by_one() {
        let mut trail = Trail::default();
        trail.rest([0.0; 3]);
        for (pixel, steps) in [(1, 250), (2, 500), (3, 750)] {
            plan(&mut trail, pixel as f32, steps, pixel);
        }
        take(&mut trail, 750);
        assert_eq!(trail.progress([0.5, 0.0, 0.0]), (1, 1));
        assert_eq!(trail.progress([1.5, 0.0, 0.0]), (2, 2));
        assert_eq!(trail.progress([2.5, 0.0, 0.0]), (3, 3));
    }

    #[test]
    fn what_a_reset_takes_back_is_gone_and_the_path_goes_on_from_the_carriage() {
        let mut trail = Trail::default();
        trail.rest([0.0; 3]);
        plan(&mut trail, 1.0, 250, 1);
        plan(&mut trail, 2.0, 300, 2);
        take(&mut trail, 250);
        trail.rest([0.4, 0.0, 0.0]);
        let bytes = trail.bytes(0, 100);
        let ways: Vec<u8> = bytes.chunks(MOVE_BYTES).map(|one| one[16]).collect();
        assert_eq!(ways, [Way::Jump as u8, Way::Cut as u8, Way::Jump as u8]);
        assert_eq!((trail.edition, trail.planned()), (1, 3));
    }

    #[test]
    fn a_cleared_trail_keeps_what_is_ahead() {
        let mut trail = Trail::default();
        trail.rest([0.0; 3]);
        plan(&mut trail, 1.0, 250, 1);
        plan(&mut trail, 2.0, 300, 2);
        take(&mut trail, 300);
        trail.progress([1.5, 0.0, 0.0]);
        trail.clear();
        assert_eq!((trail.first(), trail.planned()), (2, 3));
    }
}
