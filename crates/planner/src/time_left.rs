//! How long it takes to finish what is queued, added up a few moves at a time.
//!
//! The look-ahead knows how fast the next move may begin, and that is all that motion needs. Here the forward pass is made for
//! all moves: each begins as fast as the one before has ended, ends as fast as its length and what follows allow
//! (`v1² = min(limit, v0² + 2aL)`), and between the two runs no faster than its nominal speed:
//!
//! ```text
//!   vp² = min(v², (v0² + v1²)/2 + aL)         t = (2vp − v0 − v1)/a + (L − (2vp² − v0² − v1²)/2a)/vp
//! ```
//!
//! A jerk limit is left out: with one it takes longer than is said.
//!
//! Moves may begin and be queued meanwhile. Those that are over by the end count still: some milliseconds.

use crate::real::{least, most, sqrt};
use crate::{Kinematics, Planner, Segmenter};

/// A sum under way.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TimeLeft {
    /// Number of the move that comes next, as the queue counts them.
    next: u16,
    /// Speed at its start, mm/s.
    speed: f32,
    seconds: f32,
}

impl TimeLeft {
    /// The time added up so far, s.
    pub const fn seconds(&self) -> f32 {
        self.seconds
    }
}

impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Begins with what is left of the move that `segmenter` runs.
    pub fn time_left(&self, segmenter: &Segmenter<AXES, MOTORS>) -> TimeLeft {
        let (seconds, speed) = segmenter.rest_of_move();
        TimeLeft {
            next: self.queue().first_waiting(),
            speed,
            seconds,
        }
    }

    /// Adds the times of up to `most` further moves. Whether there were as many: then more may be left.
    ///
    /// Main loop. Some 150 instructions a move.
    pub fn add_time(&self, left: &mut TimeLeft, most: usize) -> bool {
        let (mut speed, mut seconds) = (left.speed, left.seconds);
        let counted = self.queue().walk(left.next, most, |planned, limit| {
            let reach = speed * speed + 2.0 * planned.acceleration * planned.length;
            let end = sqrt(least(self.v2(limit), reach));
            let over = Stretch {
                length: planned.length,
                acceleration: planned.acceleration,
                nominal: self.nominal(planned),
                ends: [speed, end],
            };
            seconds += over.seconds();
            speed = end;
        });
        *left = TimeLeft {
            next: counted.next,
            speed,
            seconds,
        };
        counted.moves == most
    }
}

/// One move: mm, mm/s², mm/s.
struct Stretch {
    length: f32,
    acceleration: f32,
    nominal: f32,
    ends: [f32; 2],
}

impl Stretch {
    fn seconds(&self) -> f32 {
        let [v0, v1] = self.ends;
        let (a, ends_v2) = (self.acceleration, v0 * v0 + v1 * v1);
        let peak_v2 = least(self.nominal * self.nominal, 0.5 * ends_v2 + a * self.length);
        let peak = most(sqrt(peak_v2), most(v0, v1));
        let ramps = 2.0 * peak - v0 - v1;
        let cruise = self.length - (2.0 * peak * peak - ends_v2) / (2.0 * a);
        ramps / a + most(cruise, 0.0) / peak
    }
}

#[cfg(test)]
mod tests {
    use crate::reference::{to, Rig, RigQueue};
    use crate::{Config, Overrides};
    use proptest::prelude::*;

    /// The time left, added up `most` moves at a time.
    fn seconds(rig: &Rig<'_>, most: usize) -> f64 {
        let mut left = rig.planner.time_left(&rig.segmenter);
        while rig.planner.add_time(&mut left, most) {}
        left.seconds().into()
    }

    #[test]
    fn an_empty_queue_takes_no_time() {
        assert_eq!(
            seconds(&Rig::new(Config::default(), &mut RigQueue::new()), 8),
            0.0
        );
    }

    #[test]
    fn moves_that_begin_while_it_is_added_up_are_skipped() {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(Config::default(), &mut queue);
        for k in 1..=4 {
            rig.planner.push(&to(f64::from(k), 0.0, 5.0)).unwrap();
        }
        let mut left = rig.planner.time_left(&rig.segmenter);
        assert!(rig.planner.add_time(&mut left, 1));
        while rig.step().is_some() {}
        assert!(!rig.planner.add_time(&mut left, 8));
        assert!(left.seconds() < 1.0, "{}", left.seconds());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100))]

        /// At the start and half-way, whatever the size of the bites and the override.
        #[test]
        fn it_is_the_time_that_the_queue_takes(
            points in prop::collection::vec((-20.0f64..20.0, -20.0f64..20.0, 0.5f32..60.0), 1..60),
            acceleration in 10.0f32..3000.0, feed in 10u8..200, most in 1usize..40,
        ) {
            let mut queue = RigQueue::new();
            let mut rig = Rig::new(Config {
                max_rate: [50.0, 80.0],
                acceleration: [acceleration; 2],
                ..Config::default()
            }, &mut queue);
            rig.planner.set_overrides(Overrides { feed, rapid: 100 });
            for (x, y, feed) in &points {
                rig.planner.push(&to(*x, *y, *feed)).unwrap();
            }
            let whole = seconds(&rig, most);
            let half = rig.planner.len() / 2;
            while rig.planner.len() > half {
                rig.step();
            }
            let hz = f64::from(rig.planner.config().timer_hz);
            let (at_half, rest) = (rig.player.now as f64 / hz, seconds(&rig, most));
            while rig.step().is_some() {}
            let all = rig.player.now as f64 / hz;
            prop_assert!((whole - all).abs() <= 1e-3 * all + 1e-3, "{} {}", whole, all);
            prop_assert!((rest - (all - at_half)).abs() <= 1e-3 * all + 1e-3, "{} {}", rest, all - at_half);
        }
    }
}
