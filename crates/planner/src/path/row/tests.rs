use crate::reference::{to, Rig, RigQueue};
use crate::{Cartesian, Feed, Planner};
use crate::{Config, CornerRule, Move, MoveKind, MovePower, Overrides, PushError, Pushed};
use crate::{PixelQueue, Queue};
use fixed::types::U1F31;
use leadscrew_stepper::{MotorMask, Power};
use proptest::prelude::*;
use std::vec::Vec;

fn config(acceleration: f32) -> Config<2> {
    Config {
        max_rate: [500.0; 2],
        acceleration: [acceleration; 2],
        pixels: usize::MAX,
        ..Config::default()
    }
}

/// `percent` of full power, exact in 2⁻²².
fn percent(percent: u32) -> Power {
    Power::from_share(U1F31::from_bits((percent << 22) / 100 * 512))
}

fn pixel(x: f64, feed: f32, power: u32) -> Move<2> {
    Move {
        power: MovePower::Constant {
            power: percent(power),
        },
        ..to(x, 0.0, feed)
    }
}

fn gap(x: f64) -> Move<2> {
    Move {
        feed: Feed::Rapid,
        kind: MoveKind::Rapid,
        ..to(x, 0.0, 0.0)
    }
}

/// The power at each step of the dominant motor, and the numbers of the lines, in the order of
/// their segments.
fn burn(rig: &mut Rig<'_>) -> (Vec<Power>, Vec<Option<u32>>) {
    let (mut powers, mut lines) = (Vec::new(), Vec::new());
    while let Some(segment) = rig.segmenter.next(&mut rig.planner) {
        let played = rig.player.play(&segment);
        let steps = played.iter().filter(|timed| !timed.tick.step.is_empty());
        powers.extend(steps.map(|timed| timed.tick.power));
        lines.push(rig.segmenter.line_number());
    }
    lines.dedup();
    (powers, lines)
}

#[test]
fn pixels_that_differ_in_power_are_one_move_and_burn_from_end_to_end() {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config(500.0), &mut queue);
    for k in 1..=100 {
        let pixel = Move {
            line_number: Some(k),
            ..pixel(f64::from(k) * 0.1, 100.0, k % 7 * 10)
        };
        assert_ne!(rig.planner.push(&pixel), Ok(Pushed::TooShort));
    }
    assert_eq!(rig.planner.len(), 1);
    let (powers, lines) = burn(&mut rig);
    let due: Vec<Power> = (0..2500)
        .map(|step| percent((step / 25 + 1) % 7 * 10))
        .collect();
    assert!(powers == due);
    // The last segment ends the move.
    assert!(lines.iter().flatten().copied().eq(1..=100), "{lines:?}");
    assert!(rig.planner.is_empty());
    assert_eq!(rig.planner.room(), 1024);
}

#[test]
fn another_feed_mode_direction_or_kind_is_a_move_of_its_own() {
    let first = pixel(1.0, 100.0, 50);
    let dynamic = MovePower::Dynamic { power: percent(10) };
    for other in [
        pixel(2.0, 90.0, 10),
        Move {
            power: dynamic,
            ..pixel(2.0, 100.0, 10)
        },
        pixel(0.5, 100.0, 10),
        Move {
            kind: MoveKind::Jog,
            ..pixel(2.0, 100.0, 10)
        },
        Move {
            curve: Some(crate::Curve {
                radius: 50.0,
                acceleration: 500.0,
            }),
            ..pixel(2.0, 100.0, 10)
        },
        Move {
            feed: Feed::InverseTime(1.0),
            ..pixel(2.0, 100.0, 10)
        },
        Move {
            power: MovePower::Spindle { power: percent(10) },
            ..pixel(2.0, 100.0, 10)
        },
        Move {
            target: [2.0, 0.5].map(crate::Coordinate::near),
            ..pixel(2.0, 100.0, 10)
        },
    ] {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(config(500.0), &mut queue);
        rig.planner.push(&first).unwrap();
        rig.planner.push(&other).unwrap();
        assert_eq!(rig.planner.len(), 2, "{other:?}");
    }
}

#[test]
fn a_row_that_outgrows_any_curve_is_no_faster_than_the_board() {
    let config = Config {
        max_rate: [2000.0; 2],
        shortest_tick: leadscrew_stepper::Ticks(840), // 100 kHz at 84 MHz
        ..config(500.0)
    };
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config, &mut queue);
    for k in 1..=100 {
        rig.planner
            .push(&pixel(f64::from(k), 1e4, k as u32))
            .unwrap();
        let fastest = rig.planner.newest().unwrap().rate;
        assert!(fastest <= 400.01, "{fastest} mm/s of 250 steps/mm");
    }
    assert_eq!(rig.planner.len(), 1);
}

#[test]
fn a_row_along_a_diagonal_is_one_move_and_one_step_beside_it_is_another() {
    let pixel = |x: i32, y: i32, power| Move {
        target: [x, y].map(|steps| crate::Coordinate::near(steps as f32 * 0.004)),
        ..pixel(0.0, 100.0, power)
    };
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config(500.0), &mut queue);
    for k in 1..50 {
        rig.planner.push(&pixel(-8 * k, 6 * k, k as u32)).unwrap();
    }
    rig.planner.push(&pixel(-404, 303, 70)).unwrap();
    assert_eq!(rig.planner.len(), 1);
    rig.planner.push(&pixel(-412, 308, 80)).unwrap();
    assert_eq!(rig.planner.len(), 2);
}

#[test]
fn a_short_gap_belongs_to_the_row_without_power_and_a_long_one_is_a_rapid() {
    for (length, moves) in [(1.0, 1), (40.0, 3)] {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(config(500.0), &mut queue);
        rig.planner.push(&pixel(1.0, 400.0, 50)).unwrap();
        rig.planner.push(&gap(1.0 + length)).unwrap();
        rig.planner.push(&pixel(2.0 + length, 400.0, 70)).unwrap();
        assert_eq!(rig.planner.len(), moves);
        let steps = 250 * length as usize;
        let (powers, _) = burn(&mut rig);
        assert_eq!(powers.len(), 500 + steps);
        assert!(powers[..250].iter().all(|power| *power == percent(50)));
        assert!(powers[250..250 + steps]
            .iter()
            .all(|power| *power == Power::OFF));
        assert!(powers[250 + steps..]
            .iter()
            .all(|power| *power == percent(70)));
    }
}

#[test]
fn a_row_with_gaps_is_no_faster_than_the_rapid_override_allows() {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config(500.0), &mut queue);
    rig.planner.push(&pixel(100.0, 400.0, 50)).unwrap();
    rig.planner.push(&gap(101.0)).unwrap();
    rig.planner.push(&pixel(200.0, 400.0, 50)).unwrap();
    assert_eq!(rig.planner.len(), 1);
    let slower = Overrides {
        feed: 100,
        rapid: 25,
    };
    rig.planner.set_overrides(slower).unwrap();
    let mut fastest = 0.0f32;
    while rig.step().is_some() {
        fastest = fastest.max(rig.segmenter.speed());
    }
    assert!((fastest / 125.0 - 1.0).abs() < 1e-5, "{fastest}");
    // If rapids are slower than the row, a gap is a move of its own.
    rig.planner.push(&pixel(300.0, 400.0, 50)).unwrap();
    rig.planner.push(&gap(301.0)).unwrap();
    assert_eq!(rig.planner.len(), 2);
}

/// To keep 450 mm/s with pixels of 0.05 mm at 500 mm/s², the planner has to know the row for 202 mm
/// ahead.
#[test]
fn a_row_of_small_pixels_runs_as_fast_as_one_long_line() {
    let power = |k: u32| 10 + k * 37 % 90;
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config(500.0), &mut queue);
    let row: Vec<Move<2>> = (1..=12_000)
        .map(|k| pixel(f64::from(k) * 0.05, 450.0, power(k)))
        .collect();
    let seconds = rig.run(&row);
    let mut line_queue = RigQueue::new();
    let mut line = Rig::new(config(500.0), &mut line_queue);
    let at_best = line.run(&[pixel(600.0, 450.0, 50)]);
    assert!(
        (seconds / at_best - 1.0).abs() < 1e-5,
        "{seconds} {at_best}"
    );
}

#[test]
fn a_full_pool_is_a_full_queue_until_a_pixel_was_made() {
    let (mut room, mut pixels) = (Queue::<2, 2, 8>::new(), PixelQueue::<4>::new());
    let mut planner =
        Planner::<_, 2, 2>::new(config(500.0), Cartesian, &mut room, &mut pixels).unwrap();
    let mut segmenter = crate::Segmenter::new();
    let mut rooms = Vec::new();
    for k in 1..=5 {
        rooms.push(planner.room());
        planner.push(&pixel(f64::from(k), 100.0, k * 10)).unwrap();
    }
    assert_eq!((rooms, planner.room()), ([8, 7, 6, 4, 2].to_vec(), 0));
    let next = pixel(6.0, 100.0, 60);
    assert_eq!(planner.push(&next), Err(PushError::Full));
    segmenter.next(&mut planner).unwrap();
    assert_eq!(planner.push(&next), Ok(Pushed::Queued));
    planner.clear();
    assert_eq!(planner.room(), 8);
}

/// The parts of a program, each with its kind, size and power: pixels onwards from here, a turn, or
/// a gap.
fn parts() -> impl Strategy<Value = Vec<(u8, i32, u32)>> {
    prop::collection::vec((0u8..12, 1i32..60, 0u32..=100), 1..80)
}

fn program(parts: &[(u8, i32, u32)]) -> Vec<Move<2>> {
    let (mut at, mut way) = ([0i32, 0], [1i32, 0]);
    let mut moves = Vec::new();
    for (what, size, power) in parts {
        match what {
            0 => way = [-way[1], way[0]],
            1 => way = [-way[0], -way[1]],
            _ => {}
        }
        at = [at[0] + way[0] * size, at[1] + way[1] * size];
        let target = at.map(|steps| crate::Coordinate::near(steps as f32 * 0.004));
        let of = if *what == 3 {
            gap(0.0)
        } else {
            pixel(0.0, 150.0, *power)
        };
        moves.push(Move { target, ..of });
    }
    moves
}

/// A tick at which motors step.
struct Burnt {
    step: MotorMask,
    power: Power,
    /// True if it may be the last tick of a hold, which takes long and has less power.
    faded: bool,
}

impl PartialEq for Burnt {
    fn eq(&self, other: &Self) -> bool {
        let power = match (self.faded, other.faded) {
            (false, false) => self.power == other.power,
            (true, false) => self.power <= other.power,
            (false, true) => self.power >= other.power,
            (true, true) => true,
        };
        self.step == other.step && power
    }
}

/// Runs `moves` with a change of overrides half-way through them and a hold after as many segments
/// as `hold` says. Returns where the motors end, and each tick at which some step, with its power.
fn burn_interrupted(
    config: Config<2>,
    moves: &[Move<2>],
    hold: Option<usize>,
    percent: u8,
) -> ([i32; 2], Vec<Burnt>) {
    let mut queue = RigQueue::new();
    let mut rig = Rig::new(config, &mut queue);
    for (k, next) in moves.iter().enumerate() {
        if k == moves.len() / 2 && hold.is_some() {
            rig.planner
                .set_overrides(Overrides {
                    feed: percent,
                    rapid: 50,
                })
                .unwrap();
            while rig.planner.renew() {}
        }
        rig.planner.push(next).unwrap();
    }
    let mut powers = Vec::new();
    let mut segments = 0;
    while let Some(segment) = rig.segmenter.next(&mut rig.planner).or_else(|| {
        rig.segmenter.resume();
        rig.segmenter.next(&mut rig.planner)
    }) {
        let played = rig.player.play(&segment);
        let steps = played.iter().filter(|timed| !timed.tick.step.is_empty());
        powers.extend(steps.map(|timed| Burnt {
            step: timed.tick.step,
            power: timed.tick.power,
            faded: rig.segmenter.is_held(),
        }));
        segments += 1;
        if hold == Some(segments) {
            rig.segmenter.hold();
        }
    }
    (rig.player.position, powers)
}

/// The powers of each motor's steps.
fn by_motor(powers: &[Burnt]) -> [Vec<Burnt>; 2] {
    [0, 1].map(|motor| {
        let steps = powers.iter().filter(|burnt| burnt.step.contains(motor));
        let alone = |burnt: &Burnt| Burnt {
            step: MotorMask::only(motor),
            ..*burnt
        };
        steps.map(alone).collect()
    })
}

proptest! {
    #![proptest_config(crate::reference::times(200))]

    /// Whether rows are merged or not, interrupted or not: each step has the same power, and motion
    /// ends at the same place.
    #[test]
    fn each_step_has_the_power_of_its_line_whatever_comes_between(
        parts in parts(), acceleration in 100.0f32..5000.0, hold in prop::option::of(1usize..60), percent in 10u8..200,
    ) {
        let config = Config { corner_rule: CornerRule::Grbl, ..config(acceleration) };
        let [one_by_one, rows] = [0, usize::MAX].map(|pixels| {
            burn_interrupted(Config { pixels, ..config }, &program(&parts), hold, percent)
        });
        prop_assert_eq!(one_by_one.0, rows.0);
        prop_assert!(one_by_one.1 == rows.1);
    }

    /// Pieces of a few steps, of one power, are joined as well: their motors may step together.
    /// Each makes the same steps at the same powers as one by one.
    #[test]
    fn each_motor_has_the_power_of_its_line_at_each_step_where_pieces_are_joined(
        parts in parts(), acceleration in 100.0f32..5000.0, hold in prop::option::of(1usize..60), percent in 10u8..200,
    ) {
        let one_by_one = Config { corner_rule: CornerRule::Grbl, pixels: 0, ..config(acceleration) };
        let (end, powers) = burn_interrupted(one_by_one, &program(&parts), None, percent);
        for pixels in [0, usize::MAX] {
            let joined = Config { pixels, ..config(acceleration) };
            let (joined_end, joined) = burn_interrupted(joined, &program(&parts), hold, percent);
            prop_assert_eq!(joined_end, end);
            prop_assert!(by_motor(&joined) == by_motor(&powers));
        }
    }
}
