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
//! With a jerk limit the ramps are those of `ramp`, and the speeds at which they fit into a move are found by halving.
//!
//! Moves may begin and be queued meanwhile. Those that are over by the end count still: some milliseconds.

use crate::ramp::{self, Limits};
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

    /// Adds the times of up to `most` further moves, with a jerk limit a quarter of that. Whether there were as many: then more
    /// may be left.
    ///
    /// Main loop. Some 150 instructions a move; with a jerk limit 2500, an estimate.
    pub fn add_time(&self, left: &mut TimeLeft, most: usize) -> bool {
        let jerk = self.config().jerk;
        let most = if jerk > 0.0 { most.div_ceil(4) } else { most };
        let (mut speed, mut seconds) = (left.speed, left.seconds);
        let counted = self.queue().walk(left.next, most, |planned, limit| {
            let over = Stretch {
                length: planned.length,
                acceleration: planned.acceleration,
                nominal: self.nominal(planned),
                entry: speed,
                limit_v2: self.v2(limit),
            };
            let (time, end) = if jerk > 0.0 {
                over.eased(jerk)
            } else {
                over.sharp()
            };
            seconds += time;
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

/// One move: mm, mm/s², mm/s, mm²/s².
struct Stretch {
    length: f32,
    acceleration: f32,
    nominal: f32,
    entry: f32,
    limit_v2: f32,
}

impl Stretch {
    /// Seconds, and the speed at the end, with ramps of constant acceleration.
    fn sharp(&self) -> (f32, f32) {
        let (a, v0) = (self.acceleration, self.entry);
        let v1 = sqrt(least(self.limit_v2, v0 * v0 + 2.0 * a * self.length));
        let ends_v2 = v0 * v0 + v1 * v1;
        let peak_v2 = least(self.nominal * self.nominal, 0.5 * ends_v2 + a * self.length);
        let peak = most(sqrt(peak_v2), most(v0, v1));
        let ramps = 2.0 * peak - v0 - v1;
        let cruise = self.length - (2.0 * peak * peak - ends_v2) / (2.0 * a);
        (ramps / a + most(cruise, 0.0) / peak, v1)
    }

    /// The same with ramps of limited `jerk`, mm/s³.
    #[inline(never)] // in firmware it is not worth a copy for each machine
    fn eased(&self, jerk: f32) -> (f32, f32) {
        let limits = Limits {
            acceleration: self.acceleration,
            jerk,
        };
        let v0 = self.entry;
        let up = |speed| ramp::length(v0, speed, limits);
        let v1 = self.reached(v0, sqrt(self.limit_v2), &up);
        let both = |speed| up(speed) + ramp::length(speed, v1, limits);
        let peak = self.reached(most(v0, v1), self.nominal, &both);
        let ramps = ramp::duration(v0, peak, limits) + ramp::duration(peak, v1, limits);
        (ramps + most(self.length - both(peak), 0.0) / peak, v1)
    }

    /// The speed nearest to `wanted` for which the `way` of the ramps is no longer than the move, as it is for `from`.
    #[inline(never)]
    fn reached(&self, from: f32, wanted: f32, way: &dyn Fn(f32) -> f32) -> f32 {
        /// To a four-thousandth of the speeds in question.
        const HALVINGS: u32 = 12;
        if way(wanted) <= self.length {
            return wanted;
        }
        let (mut good, mut bad) = (from, wanted);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (good + bad);
            if way(middle) <= self.length {
                good = middle;
            } else {
                bad = middle;
            }
        }
        good
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
            acceleration in 10.0f32..3000.0, feed in 10u8..200, most in 1usize..40, ease in prop::option::of(0.003f32..0.3),
        ) {
            let mut queue = RigQueue::new();
            let mut rig = Rig::new(Config {
                max_rate: [50.0, 80.0],
                acceleration: [acceleration; 2],
                jerk: ease.map_or(0.0, |seconds| acceleration / seconds),
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
