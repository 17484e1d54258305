//! Plans a square with one round corner and prints the segments for the step interrupt.
//!
//! `cargo run -p leadscrew-planner --example plan_a_square`

use leadscrew_planner::{
    Arc, Cartesian, Config, Coordinate, Feed, Move, MoveKind, MovePower, PixelQueue, Planner,
    Queue, Segmenter, THREE_DECIMALS,
};
use leadscrew_stepper::{OutputChange, Segment};

fn main() {
    let config = Config {
        max_rate: [100.0; 3],
        acceleration: [500.0; 3],
        ..Config::default()
    };
    let hz = f64::from(config.timer_hz);
    let (mut queue, mut pixels) = (Queue::<3, 3, 256>::new(), PixelQueue::<1>::new());
    let mut planner =
        Planner::new(config, Cartesian, &mut queue, &mut pixels).expect("the settings are sound");
    for target in path(config.arc_tolerance) {
        planner
            .push(&feed(target))
            .expect("the square has fewer moves than the queue");
    }

    let mut segmenter = Segmenter::new();
    let (mut seconds, mut segments) = (0.0, 0);
    println!("     time   line       speed");
    while let Some(segment) = segmenter.next(&mut planner) {
        seconds += counts(&segment) / hz;
        segments += 1;
        if let Some(start) = segment.line {
            let speed = segmenter.speed();
            println!(
                "{seconds:7.3} s   {:?} steps, {speed:.1} mm/s",
                start.line().steps()
            );
        }
    }
    println!(
        "{segments} segments, {seconds:.3} s, end at {:?} steps",
        planner.position()
    );
}

/// The corners of the square, the last one rounded.
fn path(tolerance: f32) -> impl Iterator<Item = [Coordinate; 3]> {
    let mm = |mm| Coordinate::from_mm(mm).expect("a place");
    let at = |x: f32, y: f32| [x, y, 0.0].map(mm);
    let centre = [0.0, -5.0].map(mm);
    let corner = Arc::new(
        at(5.0, 20.0),
        at(0.0, 15.0),
        centre,
        (0, 1),
        false,
        tolerance,
    )
    .expect("an arc");
    [at(20.0, 0.0), at(20.0, 20.0), at(5.0, 20.0)]
        .into_iter()
        .chain(corner)
        .chain([at(0.0, 0.0)])
}

fn feed(target: [Coordinate; 3]) -> Move<3> {
    Move {
        target,
        feed: Feed::PerMinute(50.0),
        power: MovePower::Off,
        curve: None,
        rounding: THREE_DECIMALS,
        outputs: OutputChange::NONE,
        line_number: None,
        kind: MoveKind::Feed,
    }
}

/// Returns how long a segment lasts: `p·n + d·n(n−1)/2`.
fn counts(segment: &Segment<3>) -> f64 {
    let ticks = f64::from(segment.ticks.get());
    let change = segment.interval_change.to_num::<f64>();
    segment.interval.to_num::<f64>() * ticks + change * ticks * (ticks - 1.0) / 2.0
}
