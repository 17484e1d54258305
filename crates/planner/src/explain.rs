//! The bounds of motion, to explain a job, not to run it.
//!
//! Nothing here is stored: each call reads the queue.

use crate::built::CURVES;
use crate::moves::PlannedMove;
use crate::space::polygon::cap;
use crate::space::zones::fastest;
use crate::{Kinematics, Planner};

/// The values that a queued move was planned with.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Outline<const MOTORS: usize> {
    /// Signed steps of each motor.
    pub steps: [i32; MOTORS],
    /// Length of the path, mm.
    pub length: f32,
    /// Highest acceleration along the path, mm/s².
    pub acceleration: f32,
    /// Highest speed along the path whatever the override, mm/s.
    pub rate: f32,
    /// Speed along the path as programmed, mm/s.
    pub feed: f32,
}

/// The reason why the running move slows down: the place ahead that bounds its speed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Ahead {
    /// The end of all that is queued, at which motion must be able to rest.
    QueueEnd {
        /// True if the queue is full, so that no further move fits.
        full: bool,
    },
    /// A corner.
    Corner,
    /// The curvature of the path: an arc, or a curve of short moves.
    Curve,
    /// A move that is slower.
    SlowerMove,
}

impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Returns the values that the last queued move was planned with; `None` if nothing is queued.
    pub fn newest(&self) -> Option<Outline<MOTORS>> {
        let planned = self.queue().newest()?;
        Some(Outline {
            steps: planned.delta,
            length: planned.length,
            acceleration: planned.acceleration,
            rate: planned.rate,
            feed: planned.feed,
        })
    }

    /// Returns the bound of the speed at the end of the running move, or of the move that has just
    /// been handed out.
    pub fn ahead(&self) -> Ahead {
        match self.queue().slow_start(&self.axis_limits()) {
            Some(planned) if planned.cap < planned.corner => Ahead::SlowerMove,
            Some(planned) if self.is_curve(planned) => Ahead::Curve,
            Some(_) => Ahead::Corner,
            None => Ahead::QueueEnd {
                full: !self.has_room(),
            },
        }
    }

    /// Returns true if the curvature bounds the speed at the start of a move, and not the corner.
    fn is_curve(&self, planned: &PlannedMove<AXES, MOTORS>) -> bool {
        if !CURVES {
            return false;
        }
        let v2 = match self.ease() {
            Some(_) => fastest(planned.law()[0]),
            None => cap(&planned.bend),
        };
        self.unit().units(v2) <= planned.corner
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::{pixels, queue, to, Rig, RigQueue};
    use crate::{Cartesian, Config, Segmenter};
    use std::vec::Vec;

    fn planner() -> Planner<'static, Cartesian, 2, 2> {
        Planner::new(
            Config::default(),
            Cartesian,
            queue::<_, 2, 3>(),
            pixels::<1>(),
        )
        .unwrap()
    }

    /// The reason why the first of these moves slows down. Each has two coordinates and a feed in
    /// mm/s.
    fn ahead(moves: &[(f64, f64, f32)]) -> Ahead {
        let mut planner = planner();
        for (x, y, feed) in moves {
            planner.push(&to(*x, *y, *feed)).unwrap();
        }
        Segmenter::<2, 2>::new().next(&mut planner).unwrap();
        planner.ahead()
    }

    #[test]
    fn a_move_slows_down_for_the_corner_the_slower_move_or_the_end_whichever_binds() {
        let end = Ahead::QueueEnd { full: false };
        assert_eq!(ahead(&[(10.0, 0.0, 5.0)]), end);
        assert_eq!(ahead(&[(10.0, 0.0, 5.0), (10.0, 10.0, 5.0)]), Ahead::Corner);
        assert_eq!(
            ahead(&[(10.0, 0.0, 5.0), (20.0, 0.0, 2.0)]),
            Ahead::SlowerMove
        );
        assert_eq!(ahead(&[(1.0, 0.0, 5.0), (1.01, 0.0, 5.0)]), end);
    }

    #[test]
    fn a_circle_of_short_moves_is_a_curve_and_has_no_corner() {
        let circle: Vec<(f64, f64, f32)> = (1..32)
            .map(|k| (f64::from(k) * 0.05).sin_cos())
            .map(|(sin, cos)| (2.0 * sin, 2.0 * (1.0 - cos), 50.0))
            .collect();
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(Config::default(), &mut queue);
        for (x, y, feed) in &circle {
            rig.planner.push(&to(*x, *y, *feed)).unwrap();
        }
        let mut seen = Vec::new();
        while rig.step().is_some() {
            seen.push(rig.planner.ahead());
        }
        assert!(seen.contains(&Ahead::Curve), "{seen:?}");
        assert!(!seen.contains(&Ahead::Corner), "{seen:?}");
    }

    #[test]
    fn a_full_queue_is_told_from_one_with_room() {
        let moves = [(1.0, 0.0, 5.0), (1.2, 0.0, 5.0), (1.4, 0.0, 5.0)];
        assert_eq!(ahead(&moves), Ahead::QueueEnd { full: true });
    }

    #[test]
    fn the_outline_has_the_limits_along_the_path() {
        let mut planner = planner();
        assert_eq!(planner.newest(), None);
        planner.push(&to(3.0, 4.0, 5.0)).unwrap();
        let outline = planner.newest().unwrap();
        assert_eq!(outline.steps, [750, 1000]);
        assert_eq!((outline.length, outline.feed), (5.0, 5.0));
        // 10 mm/s² and 500 mm/min on Y, which takes four fifths of the path.
        assert!((outline.acceleration - 12.5).abs() < 1e-4);
        assert!((outline.rate * 60.0 - 625.0).abs() < 1e-2);
    }
}
