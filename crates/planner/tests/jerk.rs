//! Whole jobs under a jerk limit, judged by their steps alone.

use leadscrew_planner::{
    Cartesian, Config, Coordinate, CornerRule, Feed, Move, MoveKind, MovePower, Overrides,
    PixelQueue, Planner, Queue, Segmenter, StepsPerMm, NANOS_PER_MM, THREE_DECIMALS,
};
use leadscrew_stepper::{OutputChange, Progress, Stepper};
use proptest::prelude::*;

/// Steps/mm of both axes.
const STEPS: f64 = 250.0;
const HZ: f64 = 84e6;

/// The third axis never moves: with three axes the limits of the places near a move are kept with it.
fn config([x, y]: [f32; 2], jerk: f32) -> Config<3> {
    Config {
        max_rate: [80.0; 3],
        acceleration: [x, y, x],
        jerk,
        ..Config::default()
    }
}

fn to(x: f64, y: f64, feed: f32) -> Move<3> {
    Move {
        target: [x, y, 0.0].map(|mm| Coordinate::from_nanos((mm * 1e9).round() as i64)),
        feed: Feed::PerMinute(feed),
        power: MovePower::Off,
        curve: None,
        rounding: THREE_DECIMALS,
        outputs: OutputChange::NONE,
        line_number: None,
        kind: MoveKind::Feed,
    }
}

/// An interruption that comes before the segment of a number.
#[derive(Clone, Copy, Debug)]
enum Event {
    Hold,
    Resume,
    Feed(u8),
}

/// The steps of each axis: the time in seconds, and the place after it, mm.
type Edges = [Vec<(f64, f64)>; 2];

/// Runs `moves` with events before some segments. Each hold that has reached rest is resumed.
fn edges(moves: &[Move<3>], config: Config<3>, events: &[(usize, Event)]) -> Edges {
    let mut queue = Box::new(Queue::<3, 3, 1024>::new());
    let mut pixels = PixelQueue::<16>::new();
    let mut planner = Planner::new(config, Cartesian, &mut *queue, &mut pixels).unwrap();
    let mut segmenter = Segmenter::new();
    let (mut stepper, mut now) = (Stepper::<3>::new(), 0);
    let mut waiting = moves.iter().peekable();
    let mut edges = Edges::default();
    let (mut at, steps) = ([0.0; 2], f64::from(config.steps_per_mm[0].to_f32()));
    for segments in 0.. {
        while let Some(next) = waiting.next_if(|_| planner.has_room()) {
            planner.push(next).unwrap();
        }
        for (_, event) in events.iter().filter(|(when, _)| *when == segments) {
            match event {
                Event::Hold => segmenter.hold(),
                Event::Resume => segmenter.resume(),
                Event::Feed(feed) => {
                    let overrides = Overrides {
                        feed: *feed,
                        rapid: 100,
                    };
                    planner.set_overrides(overrides).unwrap();
                }
            }
        }
        let Some(segment) = segmenter.next(&mut planner) else {
            if !segmenter.is_held() {
                break;
            }
            segmenter.resume();
            continue;
        };
        let mut next = Some(segment);
        for _ in 0..segment.ticks.get() {
            let Progress::Tick(tick) = stepper.tick(|| next.take()) else {
                panic!("a segment ended early")
            };
            now += u64::from(tick.wait.0);
            for (axis, edges) in edges.iter_mut().enumerate() {
                if tick.step.contains(axis) {
                    let sign = if tick.direction.contains(axis) {
                        -1.0
                    } else {
                        1.0
                    };
                    at[axis] += sign / steps;
                    edges.push((now as f64 / HZ, at[axis]));
                }
            }
        }
    }
    assert!(planner.is_empty(), "{segmenter:?} len {}", planner.len());
    let target = moves.last().unwrap().target.map(|mm| f64::from(mm.to_mm()));
    for axis in [0, 1] {
        assert!(
            (at[axis] - target[axis]).abs() < 0.51 / steps,
            "{at:?} {target:?}"
        );
    }
    edges
}

/// The place of an axis at a time, mm.
fn place(edges: &[(f64, f64)], time: f64) -> f64 {
    let after = edges.partition_point(|(at, _)| *at <= time);
    let before = after
        .checked_sub(1)
        .map_or((f64::MIN, 0.0), |last| edges[last]);
    match edges.get(after) {
        Some(next) if after > 0 => {
            let share = (time - before.0) / (next.0 - before.0);
            before.1 + share * (next.1 - before.1)
        }
        _ => before.1,
    }
}

/// The greatest difference of an order, 2 or 3, of an axis's place, over `between` seconds.
fn difference(edges: &[(f64, f64)], order: i32, between: f64) -> f64 {
    let Some(end) = edges.last().map(|last| last.0) else {
        return 0.0;
    };
    let count = (end / between * 16.0) as i32 + 32;
    (-32..count).fold(0.0, |most: f64, step| {
        let start = f64::from(step) * between / 16.0;
        let at = |k| place(edges, start + f64::from(k) * between);
        let sum = match order {
            2 => at(2) - 2.0 * at(1) + at(0),
            _ => at(3) - 3.0 * at(2) + 3.0 * at(1) - at(0),
        };
        most.max(sum.abs())
    })
}

/// The share of the axis's acceleration that it takes, a step of noise at each place left out.
fn acceleration_share(edges: &Edges, acceleration: [f32; 2]) -> f64 {
    let mut most: f64 = 0.0;
    for between in [0.01, 0.02, 0.05] {
        for axis in [0, 1] {
            let allowed = f64::from(acceleration[axis]) * between * between;
            let taken = difference(&edges[axis], 2, between) - 4.0 / STEPS;
            most = most.max(taken / allowed);
        }
    }
    most
}

/// The share of the jerk that a straight path along X takes.
fn jerk_share(edges: &Edges, jerk: f32) -> f64 {
    [0.01, 0.02, 0.04]
        .into_iter()
        .fold(0.0, |most: f64, between| {
            let allowed = f64::from(jerk) * f64::powi(between, 3);
            let taken = difference(&edges[0], 3, between) - 8.0 / STEPS;
            most.max(taken / allowed)
        })
}

fn time(edges: &Edges) -> f64 {
    let ends = edges.iter().filter_map(|edges| edges.last());
    ends.fold(0.0, |end: f64, (at, _)| end.max(*at))
}

#[test]
fn a_line_takes_the_time_of_its_ramps_and_of_the_mean() {
    let edges = edges(&[to(100.0, 0.0, 50.0)], config([200.0; 2], 5000.0), &[]);
    // 200 mm/s² are averaged over 2·200/5000 s.
    let due = 100.0 / 50.0 + 50.0 / 200.0 + 0.08;
    assert!((time(&edges) - due).abs() < 3e-3, "{} {due}", time(&edges));
    assert!(jerk_share(&edges, 5000.0) > 0.38);
}

fn events() -> impl Strategy<Value = Vec<(usize, Event)>> {
    let event = prop_oneof![
        2 => Just(Event::Hold),
        1 => Just(Event::Resume),
        1 => (10u8..200).prop_map(Event::Feed),
    ];
    prop::collection::vec((0usize..2000, event), 0..12)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases / 4))]

    #[test]
    fn no_hold_resume_or_override_on_a_line_breaks_the_jerk(
        acceleration in 50.0f32..2000.0, seconds in 0.005f32..0.05, feed in 5.0f32..80.0,
        events in events(),
    ) {
        let jerk = 2.0 * acceleration / seconds;
        let moves = [to(20.0, 0.0, feed), to(40.0, 0.0, feed), to(41.0, 0.0, 0.5 * feed), to(55.0, 0.0, feed)];
        let edges = edges(&moves, config([acceleration; 2], jerk), &events);
        let shares = [jerk_share(&edges, jerk), acceleration_share(&edges, [acceleration; 2])];
        prop_assert!(shares.iter().all(|share| *share < 1.01), "{shares:?}");
    }

    #[test]
    fn lines_arcs_and_corners_keep_the_accelerations(
        acceleration in (50.0f32..1500.0, 50.0f32..1500.0), seconds in 0.005f32..0.1, feed in 5.0f32..80.0,
        radius in 0.5f64..10.0, turn in 0.3f64..6.0, heading in 0.0f64..6.2, events in events(),
    ) {
        let acceleration = [acceleration.0, acceleration.1];
        let jerk = 2.0 * acceleration[0] / seconds;
        let moves = beside_an_arc(radius, turn, heading, feed);
        let edges = edges(&moves, config(acceleration, jerk), &events);
        // A corner may jump by the speed of junction deviation; there is none here but at the ends.
        let share = acceleration_share(&edges, acceleration);
        prop_assert!(share < 1.03, "{share}");
    }
}

/// A line, an arc in short lines that touches it, and a line.
fn beside_an_arc(radius: f64, turn: f64, heading: f64, feed: f32) -> Vec<Move<3>> {
    let (mut at, mut moves) = ([0.0, 0.0], Vec::new());
    let mut go = |way: [f64; 2]| {
        at = [at[0] + way[0], at[1] + way[1]];
        let [x, y] = at.map(|mm: f64| (mm * 1e3).round() / 1e3);
        moves.push(to(x, y, feed));
    };
    let along = |angle: f64, way: f64| [way * angle.cos(), way * angle.sin()];
    go(along(heading, 12.0));
    let chords = ((radius * turn / 0.15).ceil() as i32).max(3);
    let each = turn / f64::from(chords);
    for chord in 0..chords {
        let angle = heading + each * (f64::from(chord) + 0.5);
        go(along(angle, 2.0 * radius * (0.5 * each).sin()));
    }
    go(along(heading + turn, 12.0));
    moves
}

#[test]
fn a_circle_in_short_lines_takes_little_more_time_than_a_line() {
    const RADIUS: f64 = 20.0;
    let moves: Vec<_> = (1..=628)
        .map(|line| {
            let angle = core::f64::consts::TAU * f64::from(line) / 628.0;
            let mm = [RADIUS * angle.sin(), RADIUS * (1.0 - angle.cos())];
            let [x, y] = mm.map(|mm| (mm * 1e3).round() / 1e3);
            to(x, y, 50.0)
        })
        .collect();
    let config = Config {
        corner_rule: CornerRule::Limits,
        ..config([500.0; 2], 5000.0)
    };
    let edges = edges(&moves, config, &[]);
    let line = 40.0 * core::f64::consts::PI / 50.0 + 0.2;
    assert!(time(&edges) < 1.04 * line, "{} {line}", time(&edges));
    assert!(acceleration_share(&edges, [500.0; 2]) < 1.01);
}

/// Random moves, many of them reversals and pieces of a few steps.
fn moves() -> impl Strategy<Value = Vec<Move<3>>> {
    let near = (-1.0f64..1.0, -1.0f64..1.0, -2.0f64..1.7, 0.0f32..2.5);
    let of = near.prop_map(|(x, y, size, feed)| {
        let mm = [x, y].map(|x| (x * 10f64.powf(size) * 1e4).round() / 1e4);
        to(mm[0], mm[1], 10f32.powf(feed))
    });
    prop::collection::vec(of, 1..40)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases / 3))]

    #[test]
    fn any_moves_end_at_their_place_whatever_comes_between(
        moves in moves(), rates in prop::array::uniform3(20.0f32..300.0),
        acceleration in prop::array::uniform2(50.0f32..5000.0), jerk in 1e3f32..1e5,
        grbl: bool, events in events(),
    ) {
        let config = Config {
            max_rate: rates,
            corner_rule: if grbl { CornerRule::Grbl } else { CornerRule::Limits },
            ..config(acceleration, jerk)
        };
        let made = edges(&moves, config, &events);
        prop_assert!(time(&made) < 1e4);
    }
}

/// The swing of a mass that an axis carries on a spring of `frequency` (Hz), in a period from the
/// axis's stop on, µm.
fn swing(edges: &Edges, frequency: f64) -> f64 {
    /// Seconds.
    const STEP: f64 = 20e-6;
    /// The damping, as a share of the one with which the mass would swing no more.
    const DAMPING: f64 = 0.05;
    let end = time(edges);
    let stop = edges[0].last().unwrap().1;
    let natural = std::f64::consts::TAU * frequency;
    let (mut at, mut speed, mut most) = (0.0, 0.0, 0.0f64);
    for step in 0..((end + 1.0 / frequency) / STEP) as u32 {
        let now = f64::from(step) * STEP;
        let pull = natural * natural * (place(&edges[0], now) - at);
        speed += (pull - 2.0 * DAMPING * natural * speed) * STEP;
        at += speed * STEP;
        if now > end {
            most = most.max((at - stop).abs());
        }
    }
    1000.0 * most
}

/// As a share of what is left without the average; also if the frequency was measured 15 % too low
/// or too high.
#[test]
fn a_stop_sets_off_hardly_any_vibration_of_the_resonance() {
    for speed in [30.0, 47.0, 55.0] {
        let stop = |resonance| {
            let config = Config {
                steps_per_mm: [StepsPerMm::from_nanos(2000 * NANOS_PER_MM); 3],
                resonance,
                ..config([3000.0; 2], 0.0)
            };
            edges(&[to(50.0, 0.0, speed)], config, &[])
        };
        let (rings, shaped) = (stop(0.0), stop(40.0));
        for (frequency, share) in [(34.0, 0.16), (40.0, 0.05), (46.0, 0.12)] {
            let left = [swing(&rings, frequency), swing(&shaped, frequency)];
            println!("{speed} mm/s, {frequency} Hz: {left:.1?} um");
            assert!(left[1] <= share * left[0], "{speed} {frequency} {left:?}");
        }
    }
}
