//! A line that CAM cut into pieces of 0.01 mm, rounded to 3 decimals, takes hardly longer than the
//! line in one move.
//!
//! As a campaign of 2000 lines: `PROPTEST_CASES=12800 cargo test --release -p leadscrew-planner
//! cut_line -- --nocapture`.

use crate::reference::{runner, to, Rig, RigQueue};
use crate::{Config, Move, StepsPerMm, NANOS_PER_MM};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;
use std::cell::Cell;
use std::vec::Vec;
use std::{format, println};

/// Length of the line and of a piece, mm.
const LENGTH: f64 = 60.0;
const PIECE: f64 = 0.01;

/// The longest time that the pieces may take, as a share of the line's time.
const MOST: f64 = 1.01;

const SCALES: [i64; 3] = [80, 250, 800];

#[derive(Clone, Copy, Debug)]
struct Line {
    steps_per_mm: i64,
    /// mm/s, the feed and the rates of the axes.
    feed: f32,
    rate: f32,
    /// The acceleration of the axes, mm/s².
    acceleration: f32,
    /// The angle, radians.
    angle: f64,
}

impl Line {
    fn config(&self) -> Config<2> {
        Config {
            max_rate: [self.rate; 2],
            acceleration: [self.acceleration; 2],
            steps_per_mm: [StepsPerMm::from_nanos(self.steps_per_mm * NANOS_PER_MM); 2],
            ..Config::default()
        }
    }

    /// The point `length` mm from the start, rounded to 3 decimals.
    fn at(&self, length: f64) -> Move<2> {
        let end = [length * self.angle.cos(), length * self.angle.sin()];
        let [x, y] = end.map(|x| (x * 1e3).round() / 1e3);
        to(x, y, self.feed)
    }

    fn pieces(&self) -> Vec<Move<2>> {
        let count = (LENGTH / PIECE) as u32;
        let ends = (1..=count).map(|k| self.at(f64::from(k) * PIECE));
        ends.collect()
    }

    /// The time of the line in pieces, as a share of its time in one move.
    fn share(&self) -> f64 {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(self.config(), &mut queue);
        let cut = rig.run(&self.pieces());
        assert_eq!(rig.segmenter.speed(), 0.0, "{self:?}");
        cut / Rig::new(self.config(), &mut RigQueue::new()).run(&[self.at(LENGTH)])
    }
}

/// Lines whose feed no axis limits: each piece has the rate of its own direction.
fn line() -> impl Strategy<Value = Line> {
    let scale = prop::sample::select(SCALES.to_vec());
    let logarithmic = |from: f32, to: f32| (from.ln()..to.ln()).prop_map(f32::exp);
    let feed = (logarithmic(1.0, 100.0), 1.0f32..2.0);
    let angle = 0.0..core::f64::consts::TAU;
    (scale, feed, logarithmic(10.0, 2000.0), angle).prop_map(
        |(steps_per_mm, (feed, faster), acceleration, angle)| Line {
            steps_per_mm,
            feed,
            rate: feed * faster,
            acceleration,
            angle,
        },
    )
}

impl Line {
    /// Returns true if the path that the queue holds is enough to stop from the feed, even if three
    /// tenths of it are missing. At 800 steps/mm that path is shorter than 1024 moves of 32 steps: pieces are
    /// joined while their centre is within a sixth of a step of one line, and their ends are
    /// rounded to 0.4 steps. So it is measured.
    fn fits_the_queue(&self) -> bool {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(self.config(), &mut queue);
        let pieces = self.pieces();
        let held = pieces.iter().take_while(|piece| {
            let has_room = rig.planner.has_room();
            has_room && rig.planner.push(piece).is_ok()
        });
        let held = held.count() as f64 * PIECE;
        let (feed, acceleration) = (f64::from(self.feed), f64::from(self.acceleration));
        feed * feed <= 2.0 * acceleration * 0.7 * held
    }
}

#[test]
fn a_line_in_pieces_takes_the_time_of_the_line() {
    let worst = SCALES.map(|_| Cell::new(0.0f64));
    let result = runner(40).run(&line(), |line| {
        prop_assume!(line.fits_the_queue());
        let share = line.share();
        let scale = SCALES.iter().position(|scale| *scale == line.steps_per_mm);
        let worst = &worst[scale.expect("one of them")];
        worst.set(worst.get().max(share));
        if share > MOST {
            return Err(TestCaseError::fail(format!("{share} of its time")));
        }
        Ok(())
    });
    println!("lines in pieces, at {SCALES:?} steps/mm: at most {worst:?} of their time");
    result.unwrap_or_else(|error| panic!("{error}"));
}
