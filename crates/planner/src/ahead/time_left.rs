//! The time to finish the queued moves, added up a few moves at a time.
//!
//! The look-ahead finds how fast the next moves may begin; for moves far ahead it finds only the
//! speeds at the borders of blocks. Here the speed at the start of every move is found, and with it
//! the ramps of the move. In this calculation each part of a move counts as a single step.
//!
//! With a jerk limit the sum is an estimate: the plan slows down a little before slow places, which
//! is left out.
//!
//! Moves may begin and be queued while the sum is under way. The time of a move that ends meanwhile
//! still counts: an error of some milliseconds.

use crate::ahead::lookahead::Path;
use crate::moves::PlannedMove;
use crate::planner::nominal;
use crate::real::{min, sqrt};
use crate::space::axis_limits::AxisLimits;
use crate::space::axis_limits::Whereabouts;
use crate::speed::plan::{Place, Plan};
use crate::speed::profile::Trapezoid;
use crate::{Kinematics, Planner, Segmenter};

/// A sum under way.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TimeLeft {
    /// Number of the move that comes next, as the queue counts them.
    next: u16,
    /// Speed at the start of that move, mm/s.
    speed: f32,
    seconds: f32,
}

impl TimeLeft {
    /// Returns the time added up so far, s.
    pub const fn seconds(&self) -> f32 {
        self.seconds
    }
}

impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Begins a sum with the rest of the move that `segmenter` runs.
    pub fn time_left(&self, segmenter: &Segmenter<AXES, MOTORS>) -> TimeLeft {
        let (mut seconds, mut speed, left) = segmenter.rest_of_part(self.ease());
        let queue = self.queue();
        if let Some(running) = queue.running().filter(|_| left > 0) {
            let over = Over {
                path: &queue.path(),
                index: queue.at(),
                planned: running,
                after: queue.next(),
                limit_v2: self.unit().v2(queue.exit_limit()),
                nominal: nominal(self.overrides(), running),
            };
            let at = Whereabouts {
                v2: speed * speed,
                steps: left,
                way: 0.0,
                at_start: false,
            };
            let (more, end) = over.from(at, &self.axis_limits(), self.stands());
            (seconds, speed) = (seconds + more, end);
        }
        TimeLeft {
            next: queue.first_waiting(),
            speed,
            seconds,
        }
    }

    /// The time for which the plan stands at a rest until the tool rests too, seconds.
    fn stands(&self) -> f32 {
        self.ease().map_or(0.0, |ease| ease.seconds)
    }

    /// Adds the times of up to 4 further moves. Returns whether more moves are left.
    ///
    /// Called from the main loop. Takes some 1300 instructions for a move on a curve.
    pub fn add_time(&self, left: &mut TimeLeft) -> bool {
        let (overrides, unit) = (self.overrides(), self.unit());
        let (mut speed, mut seconds) = (left.speed, left.seconds);
        let (axis_limits, queue) = (self.axis_limits(), self.queue());
        let (path, stands) = (queue.path(), self.stands());
        let guess = |count: usize, of: &_| self.guess(count, of);
        let visit = |index, planned: &_, after: Option<&_>, limit| {
            let over = Over {
                path: &path,
                index,
                planned,
                after,
                limit_v2: unit.v2(limit),
                nominal: nominal(overrides, planned),
            };
            let at = Whereabouts::start(planned, speed * speed);
            let (time, end) = over.from(at, &axis_limits, stands);
            seconds += time;
            speed = end;
        };
        let next = queue.visit_block(left.next, &axis_limits, guess, visit);
        *left = TimeLeft {
            next: next.unwrap_or(left.next),
            speed,
            seconds,
        };
        next.is_some()
    }
}

/// A move with its index, the one after it, the limit at its end (mm²/s²) and its nominal speed
/// (mm/s).
struct Over<'m, const AXES: usize, const MOTORS: usize> {
    path: &'m Path<'m, AXES, MOTORS>,
    index: usize,
    planned: &'m PlannedMove<AXES, MOTORS>,
    after: Option<&'m PlannedMove<AXES, MOTORS>>,
    limit_v2: f32,
    nominal: f32,
}

impl<const AXES: usize, const MOTORS: usize> Over<'_, AXES, MOTORS> {
    /// The seconds that the move takes from a place on, part by part, and the speed at its end,
    /// mm/s. At a rest the plan stands for the time `stands`, seconds.
    fn from<K>(
        &self,
        mut at: Whereabouts,
        axis_limits: &AxisLimits<'_, K, AXES, MOTORS>,
        stands: f32,
    ) -> (f32, f32)
    where
        K: Kinematics<AXES, MOTORS>,
    {
        let per_mm = self.planned.steps_per_mm();
        let (mut seconds, mut speed) = (0.0, sqrt(at.v2));
        loop {
            let (path, limit_v2) = (self.path, self.limit_v2);
            let course = axis_limits
                .eased_course(path, self.index, at, limit_v2)
                .unwrap_or_else(|| axis_limits.course(self.planned, self.after, at, limit_v2));
            let nominal = min(self.nominal, sqrt(course.top_v2));
            let part = Stretch {
                length: at.steps_to(course.steps_after) / per_mm,
                up: course.up,
                down: course.down,
                nominal,
                entry: speed,
                limit_v2: course.exit_v2,
            };
            let (time, end) = part.sharp();
            (seconds, speed) = (seconds + time, end);
            if course.steps_after == 0 {
                let rests = speed <= 0.0;
                return (seconds + if rests { stands } else { 0.0 }, speed);
            }
            at = Whereabouts {
                v2: speed * speed,
                steps: course.steps_after,
                way: 0.0,
                at_start: false,
            };
        }
    }
}

/// A part of a move. The length is in mm, accelerations are in mm/s², speeds in mm/s, and the limit
/// at the part's end in mm²/s².
struct Stretch {
    length: f32,
    up: f32,
    down: f32,
    nominal: f32,
    entry: f32,
    limit_v2: f32,
}

impl Stretch {
    /// Duration (s) and speed at the end (mm/s), with ramps of constant acceleration.
    fn sharp(&self) -> (f32, f32) {
        let per_mm = 1.0 / self.length;
        let profile = Trapezoid::new(&Plan {
            start: Place::at(0),
            end: 1,
            entry_v2: self.entry * self.entry * per_mm * per_mm,
            cruise: self.nominal * per_mm,
            exit_v2: self.limit_v2 * per_mm * per_mm,
            up: self.up * per_mm,
            down: self.down * per_mm,
        });
        (profile.time(1), sqrt(profile.exit_v2()) * self.length)
    }
}

#[cfg(test)]
mod tests {
    use crate::reference::{to, Rig, RigQueue};
    use crate::{Config, Overrides};
    use proptest::prelude::*;
    use std::vec::Vec;

    /// The time left.
    fn seconds(rig: &mut Rig<'_>) -> f64 {
        let mut left = rig.planner.time_left(&rig.segmenter);
        while rig.planner.add_time(&mut left) {}
        left.seconds().into()
    }

    #[test]
    fn an_empty_queue_takes_no_time() {
        assert_eq!(
            seconds(&mut Rig::new(Config::default(), &mut RigQueue::new())),
            0.0
        );
    }

    #[test]
    fn moves_that_begin_while_it_is_added_up_are_skipped() {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(Config::default(), &mut queue);
        for k in 1..=20 {
            rig.planner.push(&to(f64::from(k), 0.0, 5.0)).unwrap();
        }
        let mut left = rig.planner.time_left(&rig.segmenter);
        assert!(rig.planner.add_time(&mut left));
        while rig.step().is_some() {}
        assert!(!rig.planner.add_time(&mut left));
        assert!(left.seconds() < 5.0, "{}", left.seconds());
    }

    /// A line, a quarter of a circle and a line at 45° to the axes. The lines are run in parts.
    #[test]
    fn lines_beside_a_curve_are_timed_as_they_run() {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(
            Config {
                max_rate: [100.0; 2],
                acceleration: [500.0; 2],
                ..Config::default()
            },
            &mut queue,
        );
        let side = 20.0 * core::f64::consts::FRAC_1_SQRT_2;
        let on_circle = |k: u32| {
            let angle = core::f64::consts::FRAC_PI_2 * (f64::from(k) / 16.0 - 0.5);
            let [x, y] = [angle.cos(), angle.sin()];
            let centre = [side - core::f64::consts::FRAC_1_SQRT_2, side];
            [
                centre[0] + x,
                centre[1] + core::f64::consts::FRAC_1_SQRT_2 + y,
            ]
        };
        let end = on_circle(16);
        rig.planner.push(&to(side, side, 100.0)).unwrap();
        for [x, y] in (1..=16).map(on_circle) {
            rig.planner.push(&to(x, y, 100.0)).unwrap();
        }
        rig.planner
            .push(&to(end[0] - side, end[1] + side, 100.0))
            .unwrap();
        let hz = f64::from(rig.planner.config().timer_hz);
        let mut told = Vec::new();
        loop {
            told.push((rig.player.now as f64 / hz, seconds(&mut rig)));
            if rig.step().is_none() {
                break;
            }
        }
        let all = rig.player.now as f64 / hz;
        for (at, left) in told {
            assert!((at + left - all).abs() < 2e-3 * all, "{at} {left} {all}");
        }
    }

    proptest! {
        #![proptest_config(crate::reference::times(100))]

        /// At the start and half-way, whatever the override. With a jerk limit it is an estimate.
        #[test]
        fn it_is_the_time_that_the_queue_takes(
            points in prop::collection::vec((-20.0f64..20.0, -20.0f64..20.0, 0.5f32..60.0), 1..60),
            acceleration in 10.0f32..3000.0, feed in 10u8..200, ease in prop::option::of(0.003f32..0.3),
        ) {
            let mut queue = RigQueue::new();
            let mut rig = Rig::new(Config {
                max_rate: [50.0, 80.0],
                acceleration: [acceleration; 2],
                jerk: ease.map_or(0.0, |seconds| acceleration / seconds),
                ..Config::default()
            }, &mut queue);
            rig.planner.set_overrides(Overrides { feed, rapid: 100 }).unwrap();
            for (x, y, feed) in &points {
                rig.planner.push(&to(*x, *y, *feed)).unwrap();
            }
            let most = ease.map_or(1e-3, |_| 0.25);
            let whole = seconds(&mut rig);
            let half = rig.planner.len() / 2;
            while rig.planner.len() > half {
                rig.step();
            }
            let hz = f64::from(rig.planner.config().timer_hz);
            let (at_half, rest) = (rig.player.now as f64 / hz, seconds(&mut rig));
            while rig.step().is_some() {}
            let all = rig.player.now as f64 / hz;
            prop_assert!((whole - all).abs() <= most * all + 1e-3, "{} {}", whole, all);
            prop_assert!((rest - (all - at_half)).abs() <= most * all + 1e-3, "{} {}", rest, all - at_half);
        }
    }
}
