use super::*;
use crate::config::SegmentQueue;
use core::num::NonZeroU16;
use leadscrew_stepper::{
    Early, Interval, IntervalChange, MotorMask, OutputChange, Power, PowerChange, Smoothing,
};
use proptest::prelude::*;

fn segment(ticks: u16, interval: u32, change: f64) -> Segment<1> {
    Segment {
        line: None,
        ticks: NonZeroU16::new(ticks).unwrap(),
        smoothing: Smoothing::None,
        motors: MotorMask::ALL,
        ends_event: true,
        early: Early::NOT,
        interval: Interval::from_num(interval),
        interval_change: IntervalChange::from_num(change),
        power: Power::OFF,
        power_change: PowerChange::ZERO,
        outputs: OutputChange::NONE,
        at_rest: None,
    }
}

fn has_room(feeder: &mut Feeder<'_, 1>, now: Instant) -> bool {
    feeder.look(now);
    feeder.has_room()
}

fn is_short(feeder: &mut Feeder<'_, 1>, now: Instant) -> bool {
    feeder.look(now);
    feeder.is_short()
}

fn hunger(feeder: &mut Feeder<'_, 1>, now: Instant) -> Hunger {
    feeder.look(now);
    feeder.hunger(now)
}

#[test]
fn no_more_than_two_milliseconds_are_committed() {
    let mut queue = SegmentQueue::<1>::new();
    let (sender, mut consumer) = queue.split();
    let shared = Shared::new();
    let mut feeder = Feeder::new(sender.ready, &shared, 84_000_000);
    let at = Instant::from_ticks;
    let mut pushed = 0;
    while has_room(&mut feeder, at(0)) {
        feeder.push(segment(84, 950, 0.0));
        pushed += 1;
    }
    assert_eq!(pushed, 2);
    shared.set_running();
    consumer.dequeue(); // now under way
    assert!(!has_room(&mut feeder, at(949)));
    assert!(has_room(&mut feeder, at(950)));
    consumer.dequeue(); // seen at once
    assert!(has_room(&mut feeder, at(950)));
}

/// The longest committed time, µs, with the longest segments and everything that the power's
/// lead needs.
fn committed_with(lead_us: u32) -> u32 {
    let mut queue = SegmentQueue::<1>::new();
    let (sender, _consumer) = queue.split();
    let shared = Shared::new();
    let mut feeder = Feeder::new(sender.ready, &shared, 84_000_000);
    feeder.set_lead(lead_us);
    let longest = feeder.bounds.longest_us;
    let (at, mut most) = (Instant::from_ticks(0), 0);
    while has_room(&mut feeder, at) {
        let room = feeder.room() / 84;
        assert!(lead_us == 0 || room >= lead_us + 50, "{lead_us}: {room}");
        most = most.max(feeder.left() / 84 + room + longest);
        feeder.push(segment(84, longest, 0.0));
    }
    most.max(feeder.left() / 84)
}

#[test]
fn a_lead_is_a_part_of_what_is_committed() {
    for lead_us in 0..=1000 {
        assert_eq!(committed_with(lead_us), 1900, "{lead_us}");
    }
}

#[test]
fn motion_is_short_where_less_than_half_a_millisecond_is_left() {
    let mut queue = SegmentQueue::<1>::new();
    let (sender, mut consumer) = queue.split();
    let shared = Shared::new();
    let mut feeder = Feeder::new(sender.ready, &shared, 84_000_000);
    let at = Instant::from_ticks;
    feeder.push(segment(84, 1000, 0.0)); // 1 ms
    assert!(!is_short(&mut feeder, at(0)), "at rest");
    shared.set_running();
    consumer.dequeue();
    assert!(!is_short(&mut feeder, at(550)));
    assert!(is_short(&mut feeder, at(551)));
    feeder.push(segment(25, 336, 0.0)); // 0.1 ms more
    assert!(!is_short(&mut feeder, at(600)));
}

#[test]
fn motion_is_short_where_ticks_are_crowded_and_another_segment_has_room() {
    let mut queue = SegmentQueue::<1>::new();
    let (sender, mut consumer) = queue.split();
    let shared = Shared::new();
    let mut feeder = Feeder::new(sender.ready, &shared, 84_000_000);
    let at = Instant::from_ticks;
    feeder.push(segment(335, 238, 0.0)); // 353 000 ticks/s, 0.95 ms
    feeder.push(segment(335, 238, 0.0));
    shared.set_running();
    consumer.dequeue();
    assert!(!is_short(&mut feeder, at(900)));
    assert_eq!(hunger(&mut feeder, at(900)), Hunger::At(at(949)));
    consumer.dequeue();
    assert!(is_short(&mut feeder, at(960)));
    feeder.push(segment(250, 336, 0.0)); // 250 000 ticks/s, 1 ms
    assert!(!is_short(&mut feeder, at(1300)));
}

#[test]
fn what_comes_behind_a_short_segment_is_asked_for_before_that_begins() {
    let mut queue = SegmentQueue::<1>::new();
    let (sender, mut consumer) = queue.split();
    let shared = Shared::new();
    let mut feeder = Feeder::new(sender.ready, &shared, 84_000_000);
    let at = Instant::from_ticks;
    feeder.push(segment(84, 1000, 0.0));
    assert_eq!(hunger(&mut feeder, at(0)), Hunger::None, "at rest");
    shared.set_running();
    consumer.dequeue(); // 1 ms under way
    feeder.push(segment(25, 336, 0.0)); // 0.1 ms waits
    assert_eq!(hunger(&mut feeder, at(0)), Hunger::At(at(650)));
    assert!(has_room(&mut feeder, at(650)));
}

/// Segments last a fraction of a count longer than their durations tell. However many have been
/// played, the estimate of the committed time is never too short.
#[test]
fn fractions_of_counts_do_not_add_up() {
    let mut queue = SegmentQueue::<1>::new();
    let (sender, mut consumer) = queue.split();
    let shared = Shared::new();
    let mut feeder = Feeder::new(sender.ready, &shared, 84_000_000);
    let lasts = 70_000.9;
    let longest = Segment {
        interval: Interval::from_num(lasts),
        ..segment(1, 0, 0.0)
    };
    feeder.push(longest);
    shared.set_running();
    consumer.dequeue();
    let (mut end, mut waiting) = (lasts, 0.0);
    for look in 0..2_000_000u64 {
        let counts = (look * 100 * 84) as f64;
        while counts >= end {
            consumer.dequeue();
            (end, waiting) = (end + lasts, waiting - lasts);
        }
        let now = Instant::from_ticks(look * 100);
        while has_room(&mut feeder, now) {
            feeder.push(longest);
            waiting += lasts;
        }
        let left = f64::from(feeder.left());
        let real = end - counts + waiting;
        assert!(left + 4.0 >= real, "{look}: {left}, {real} are committed");
    }
}

proptest! {
    /// Compares with the exact sum, `p·n + d·n(n−1)/2` in 2⁻³² counts.
    #[test]
    fn a_duration_is_shorter_than_its_segment_by_less_than_is_allowed_for(
        ticks in 1u16..=500, interval in 1u64 << 40..1 << 50, change in -(1i64 << 32)..1 << 32,
    ) {
        let segment = Segment {
            interval: Interval::from_bits(interval),
            interval_change: IntervalChange::from_bits(change),
            ..segment(ticks, 0, 0.0)
        };
        let n = i128::from(ticks);
        let exact = i128::from(interval) * n + i128::from(change) * n * (n - 1) / 2;
        let short = exact - (i128::from(segment.duration()) << 32);
        prop_assert!(short >= 0 && short < i128::from(ROUNDED_OFF) << 32, "{}", short);
    }
}
