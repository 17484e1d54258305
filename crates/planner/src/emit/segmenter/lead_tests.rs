use super::*;
use crate::config::DEFAULT_TIMER_HZ;
use crate::reference::{to, Rig, RigQueue};
use crate::{Config, Move, MovePower, Overrides};
use proptest::prelude::*;
use std::vec::Vec;

type Waiting = Deque<Segment<2>, 16>;

fn share(share: f64) -> Power {
    Power::from_share(U1F31::from_num(share))
}

/// Steps of 0.004 mm.
fn rig(acceleration: f32, queue: &mut RigQueue) -> Rig<'_> {
    Rig::new(
        Config {
            max_rate: [500.0; 2],
            acceleration: [acceleration; 2],
            pixels: usize::MAX,
            ..Config::default()
        },
        queue,
    )
}

/// The record of the pins: when a power was put out, and when the carriage was at which place
/// (steps).
#[derive(Default)]
struct Record {
    powers: Vec<(u64, Power)>,
    places: Vec<(u64, i32)>,
}

fn run(rig: &mut Rig<'_>, lead: &mut PowerLead<'_, 2>) -> Record {
    let mut record = Record::default();
    loop {
        let Rig {
            planner, segmenter, ..
        } = rig;
        let Some(segment) = lead.next(u64::MAX, || segmenter.next(planner)) else {
            break;
        };
        let mut from = rig.player.now;
        let before = rig.player.position[0];
        let mut at = before;
        for timed in rig.player.play(&segment) {
            record.powers.push((from, timed.tick.power));
            let negative = timed.tick.direction.contains(0);
            at += i32::from(timed.tick.step.contains(0)) * if negative { -1 } else { 1 };
            record.places.push((timed.at, at));
            from = timed.at;
        }
        if let Some(rest) = segment.at_rest {
            record.powers.push((from, rest));
        }
    }
    record
}

/// Returns the places at which the light of a laser that is `delay` counts late goes on and off,
/// steps.
fn burnt(record: &Record, delay: u64) -> Vec<f64> {
    let mut lit = false;
    let mut edges = Vec::new();
    for (at, power) in &record.powers {
        if lit != (*power > Power::OFF) {
            lit = !lit;
            edges.push(record.place(at + delay));
        }
    }
    edges
}

impl Record {
    fn place(&self, at: u64) -> f64 {
        let next = self.places.partition_point(|(time, _)| *time < at);
        let (after, to) = self.places[next.min(self.places.len() - 1)];
        let (before, from) = next.checked_sub(1).map_or((0, 0), |k| self.places[k]);
        let part = (at.min(after) - before) as f64 / (after - before).max(1) as f64;
        f64::from(from) + part.min(1.0) * f64::from(to - from)
    }
}

fn marks(ends: &[f64], feed: f32) -> Vec<Move<2>> {
    let marks = ends.iter().enumerate().map(|(k, x)| Move {
        power: MovePower::Constant {
            power: if k % 2 == 1 { share(0.5) } else { Power::OFF },
        },
        ..to(*x, 0.0, feed)
    });
    marks.collect()
}

/// The largest distance (steps) between marks burnt on the way there and the same marks burnt
/// on the way back, with a lead for the laser's delay.
fn mismatch(lead_us: u32, delay_us: u64, feed: f32) -> f64 {
    let there = [10.0, 10.5, 12.0, 12.1, 12.3, 12.35, 15.0, 18.0, 30.0];
    let back = [18.0, 15.0, 12.35, 12.3, 12.1, 12.0, 10.5, 10.0, 0.0];
    let mut queue = RigQueue::new();
    let mut rig = rig(2000.0, &mut queue);
    for next in marks(&there, feed).iter().chain(&marks(&back, feed)) {
        rig.planner.push(next).unwrap();
    }
    let mut waiting = Waiting::new();
    let mut lead = PowerLead::new(&mut waiting);
    lead.set(lead_us, DEFAULT_TIMER_HZ);
    let record = run(&mut rig, &mut lead);
    assert!(lead.is_empty());
    assert_eq!(rig.player.position, [0, 0]);
    let edges = burnt(&record, delay_us * 84);
    assert_eq!(edges.len(), 16);
    let (there, back) = edges.split_at(8);
    let pairs = there.iter().zip(back.iter().rev());
    pairs.fold(0.0, |worst, (a, b)| f64::max(worst, (a - b).abs()))
}

#[test]
fn both_directions_of_a_raster_meet_within_a_step() {
    for delay in [50, 137, 400, 1000] {
        for feed in [20.0, 100.0, 150.0] {
            let without = mismatch(0, delay, feed);
            let way = 2.0 * f64::from(feed) * 250.0 * delay as f64 * 1e-6;
            assert!((without / way - 1.0).abs() < 0.3, "{without} {way}");
            let with = mismatch(delay as u32, delay, feed);
            assert!(with <= 1.01, "{delay} us, {feed} mm/s: {with} steps");
        }
    }
}

#[test]
fn without_a_lead_segments_pass_as_they_are() {
    let mut queue = RigQueue::new();
    let mut rig = rig(500.0, &mut queue);
    rig.planner.push(&to(1.0, 0.0, 50.0)).unwrap();
    let mut waiting = Waiting::new();
    let mut lead = PowerLead::new(&mut waiting);
    let Rig {
        planner, segmenter, ..
    } = &mut rig;
    let mut copy = segmenter.clone();
    let mut other_queue = RigQueue::new();
    let mut same = self::rig(500.0, &mut other_queue).planner;
    same.push(&to(1.0, 0.0, 50.0)).unwrap();
    while let Some(segment) = lead.next(u64::MAX, || segmenter.next(planner)) {
        assert_eq!(Some(segment), copy.next(&mut same));
    }
}

/// The most timer counts that were handed out or waited at any time. Steps take 1.2 ms, in two
/// spans; the lead is 1 ms.
fn committed(room: u64) -> u64 {
    let mut queue = RigQueue::new();
    let mut rig = rig(2000.0, &mut queue);
    for next in marks(&[0.4, 0.6, 1.0], 0.004 / 1.2e-3) {
        rig.planner.push(&next).unwrap();
    }
    let mut waiting = Waiting::new();
    let mut lead = PowerLead::new(&mut waiting);
    lead.set(1000, DEFAULT_TIMER_HZ);
    let Rig {
        planner, segmenter, ..
    } = &mut rig;
    let mut longest = 0;
    while let Some(segment) = lead.next(room, || segmenter.next(planner)) {
        let waiting: u64 = lead.waiting.iter().map(duration).sum();
        if waiting > 0 {
            longest = longest.max(duration(&segment) + waiting);
        }
    }
    longest
}

#[test]
fn no_more_waits_than_there_is_room_for_and_one_segment() {
    let (room, longest) = (500 * 84, 1000 * 84);
    assert!(committed(room) <= room + longest, "{}", committed(room));
    assert!(committed(u64::MAX) > room + longest);
}

#[test]
fn at_a_planned_rest_the_laser_is_off_a_lead_before_it() {
    let mut queue = RigQueue::new();
    let mut rig = rig(500.0, &mut queue);
    let power = MovePower::Dynamic { power: Power::FULL };
    rig.planner
        .push(&Move {
            power,
            ..to(5.0, 0.0, 50.0)
        })
        .unwrap();
    let mut waiting = Waiting::new();
    let mut lead = PowerLead::new(&mut waiting);
    lead.set(300, DEFAULT_TIMER_HZ);
    let record = run(&mut rig, &mut lead);
    let end = record.places.last().unwrap().0;
    let off = record
        .powers
        .iter()
        .rev()
        .find(|(_, power)| *power > Power::OFF)
        .unwrap()
        .0;
    // The last step takes 1/sqrt(2·500·250) s more than the lead.
    assert!(end - off >= 300 * 84, "{}", end - off);
}

/// Marks of 0.004 to 1.5 mm with room for `WAITING` segments.
fn marked<const WAITING: usize>(lead_us: u32) -> Record {
    let mut queue = RigQueue::new();
    let mut rig = rig(2000.0, &mut queue);
    for next in marks(&[0.4, 0.404, 0.41, 0.5, 2.0, 2.1], 30.0) {
        rig.planner.push(&next).unwrap();
    }
    let mut waiting = Deque::<_, WAITING>::new();
    let mut lead = PowerLead::new(&mut waiting);
    lead.set(lead_us, DEFAULT_TIMER_HZ);
    run(&mut rig, &mut lead)
}

#[test]
fn with_room_for_one_segment_motion_is_the_same_and_power_earlier_by_no_more_than_the_lead() {
    let (plain, whole, short) = (marked::<1>(0), marked::<16>(1000), marked::<1>(1000));
    assert_eq!(short.places, plain.places);
    let [plain, whole, short] = [&plain, &whole, &short].map(|record| burnt(record, 0));
    assert_eq!(short.len(), plain.len());
    for ((whole, short), plain) in whole.iter().zip(&short).zip(&plain) {
        assert!(whole <= short && short <= plain, "{whole} {short} {plain}");
    }
}

proptest! {
    #![proptest_config(crate::reference::times(60))]

    /// Each step comes at the same timer count with a lead and without one. With the lead the power
    /// at each time is the power that comes `lead` later without it; its change may be off by half
    /// a tick.
    #[test]
    fn motion_stays_and_power_comes_by_the_lead_earlier(
        ends in prop::collection::vec((-8.0f64..8.0, 0u32..=100), 1..30),
        lead_us in 1u32..=1000,
        feed in 5.0f32..200.0,
        acceleration in 100.0f32..5000.0,
        hold in prop::option::of(5usize..200),
    ) {
        let run = |lead_us: u32| {
            let mut queue = RigQueue::new();
            let mut rig = rig(acceleration, &mut queue);
            for (x, percent) in &ends {
                let power = MovePower::Constant { power: share(f64::from(*percent) / 100.0) };
                rig.planner.push(&Move { power, ..to(*x, *x * 0.3, feed) }).unwrap();
            }
            rig.planner.set_overrides(Overrides { feed: 70, rapid: 100 }).unwrap();
            let mut waiting = Waiting::new();
            let mut lead = PowerLead::new(&mut waiting);
            lead.set(lead_us, DEFAULT_TIMER_HZ);
            let mut calls = 0;
            let mut record = Record::default();
            let Rig { planner, segmenter, player } = &mut rig;
            loop {
                let next = lead.next(u64::MAX, || {
                    calls += 1;
                    if Some(calls) == hold { segmenter.hold(); }
                    if segmenter.is_held() { segmenter.resume(); }
                    segmenter.next(planner)
                });
                let Some(segment) = next else { break };
                let mut from = player.now;
                for timed in player.play(&segment) {
                    record.powers.push((from, timed.tick.power));
                    record.places.push((timed.at, timed.tick.step.bits().into()));
                    from = timed.at;
                }
            }
            record
        };
        let (plain, early) = (run(0), run(lead_us));
        prop_assert!(plain.places == early.places);
        let wanted = |at: u64| {
            let next = plain.powers.partition_point(|(from, _)| *from <= at);
            plain.powers[next - 1].1
        };
        let end = plain.places.last().unwrap().0;
        for (pair, (until, _)) in early.powers.iter().zip(&early.places) {
            let (from, power) = *pair;
            let (from, until) = (from + u64::from(lead_us) * 84, until + u64::from(lead_us) * 84);
            if until < end && wanted(from) == wanted(until) {
                prop_assert_eq!(power, wanted(from), "at {}", from);
            }
        }
    }
}
