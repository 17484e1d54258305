//! The laser power is put out early, to make up for the delay of the laser.
//!
//! A laser follows a change of its power after a delay (its driver's rise time, the tube's
//! ignition). At a speed `v` the light is then `v·delay` too late along the path. A raster is burnt
//! in both directions, so its rows are shifted to either side in turn. To prevent that, the power
//! that belongs to the time `t + lead` is put out at `t`:
//!
//! ```text
//!   motion   | front ...... | second | third ...............|     segments that wait, oldest first
//!            |<----- lead ----->|
//!   power                       ^ for the front's first tick
//! ```
//!
//! Segments wait here until they reach to the time that belongs to the front's first tick, and no
//! longer: a hold cannot change a segment that waits. For the same reason no more segments are
//! taken than there is `room` for. Where ticks are so long that this time lies beyond the segments
//! that wait, the power at the end of the last one is used.
//!
//! Each segment is handed out in pieces, one for each segment that its power comes from. The power
//! changes with a tick, at most half a tick from the right time. Motion is never changed.
//!
//! Out of rest the first power would have to be put out before motion begins. There the laser stays
//! off. Its power would follow the speed, which is lowest there, so the energy that is lost is
//! small. At the end of motion the power at rest comes early.

use core::num::NonZeroU16;
use fixed::types::U1F31;
use heapless::deque::{Deque, DequeView};
use leadscrew_stepper::{Interval, OutputChange, Power, PowerChange, Segment};

/// The longest lead, µs.
pub const LONGEST_LEAD: u32 = 1000;

/// Hands on segments with the power of later ones. Main loop.
#[derive(Debug)]
pub struct PowerLead<'a, const MOTORS: usize> {
    /// The lead, in counts of the step timer.
    lead: u64,
    waiting: &'a mut DequeView<Segment<MOTORS>>,
}

/// Where a segment's power comes from.
struct Source {
    /// The power in the middle of the first tick.
    power: Power,
    /// Change of the power in a timer count.
    slope: f32,
    /// Timer counts for which this source can be used.
    lasts: u64,
}

impl<'a, const MOTORS: usize> PowerLead<'a, MOTORS> {
    /// Makes a lead of 0, which hands on each segment with its own power. Where there is a lead,
    /// segments wait in `waiting`. Where the lead spans more segments than fit there, the last
    /// one's power is put out for the rest of the lead.
    pub fn new<const WAITING: usize>(waiting: &'a mut Deque<Segment<MOTORS>, WAITING>) -> Self {
        Self { lead: 0, waiting }
    }

    /// Sets the lead in microseconds (values above [`LONGEST_LEAD`] count as [`LONGEST_LEAD`]), for
    /// a step timer of `timer_hz` counts a second. Called at rest.
    pub fn set(&mut self, lead_us: u32, timer_hz: u32) {
        let lead = u64::from(lead_us.min(LONGEST_LEAD));
        self.lead = lead * u64::from(timer_hz) / 1_000_000;
    }

    /// Hands out the next segment. Takes from `source` the segments that its power depends on, but
    /// none while segments of more than `room` timer counts wait already. `None` where `source` has
    /// no segment and none waits.
    pub fn next(
        &mut self,
        room: u64,
        mut source: impl FnMut() -> Option<Segment<MOTORS>>,
    ) -> Option<Segment<MOTORS>> {
        if self.lead == 0 && self.waiting.is_empty() {
            return source();
        }
        self.fill(room, source);
        let front = *self.waiting.front()?;
        let source = self.source(&front);
        let ticks = ticks_within(&front, source.lasts);
        match rest_of(&front, ticks) {
            Some(rest) => {
                if let Some(waiting) = self.waiting.front_mut() {
                    *waiting = rest;
                }
            }
            None => {
                self.waiting.pop_front();
            }
        }
        let change = source.slope * interval(&front) as f32;
        Some(Segment {
            ticks,
            power: source.power,
            power_change: PowerChange::from_bits(change as i32),
            at_rest: front.at_rest.filter(|_| ticks == front.ticks),
            ..front
        })
    }

    /// Whether nothing waits.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Forgets the segments that wait: after a reset or a jog cancel.
    pub fn clear(&mut self) {
        self.waiting.clear();
    }

    /// Takes segments until they reach to the time that belongs to the front's first tick, or
    /// `source` has no more, or there is no room.
    fn fill(&mut self, room: u64, mut source: impl FnMut() -> Option<Segment<MOTORS>>) {
        let mut covered: u64 = self.waiting.iter().map(duration).sum();
        while !self.waiting.is_full()
            && covered <= self.waiting.front().map_or(0, |front| self.reach(front))
            && covered <= room
        {
            let Some(segment) = source() else { return };
            covered += duration(&segment);
            // There is room.
            let _ = self.waiting.push_back(segment);
        }
    }

    /// Timer counts from the start of `front` to the time that its power belongs to: the lead after
    /// the middle of its first tick.
    fn reach(&self, front: &Segment<MOTORS>) -> u64 {
        self.lead + (front.interval.to_bits() >> 33)
    }

    /// The segment and the place in it that the power for the first tick of `front` comes from: the
    /// lead after the middle of that tick.
    fn source(&self, front: &Segment<MOTORS>) -> Source {
        let mut after = self.reach(front);
        for segment in self.waiting.iter() {
            let lasts = duration(segment);
            if after < lasts {
                return Source::within(segment, after, lasts);
            }
            after -= lasts;
        }
        Source::steady(self.waiting.back().map_or(Power::OFF, |last| {
            last.at_rest
                .unwrap_or_else(|| power_after(last, last.ticks.get().into()))
        }))
    }
}

impl Source {
    fn steady(power: Power) -> Self {
        Self {
            power,
            slope: 0.0,
            lasts: u64::MAX,
        }
    }

    /// The power from `after` counts after the start of `segment` on. The segment takes `lasts`
    /// counts.
    fn within<const MOTORS: usize>(segment: &Segment<MOTORS>, after: u64, lasts: u64) -> Self {
        let left = lasts - after;
        let change = segment.power_change.to_bits();
        if change == 0 {
            return Self {
                lasts: left,
                ..Self::steady(segment.power)
            };
        }
        // Ticks in a count, in the mean.
        let rate = f32::from(segment.ticks.get()) / lasts as f32;
        Self {
            power: power_after(segment, after as f32 * rate),
            slope: change as f32 * rate,
            lasts: left,
        }
    }
}

/// The power `ticks` ticks after a segment's start.
fn power_after<const MOTORS: usize>(segment: &Segment<MOTORS>, ticks: f32) -> Power {
    let change = segment.power_change.to_bits() as f32 * ticks;
    let share = i64::from(segment.power.share().to_bits()) + change as i64;
    let share = share.clamp(0, U1F31::ONE.to_bits().into());
    Power::from_share(U1F31::from_bits(share as u32))
}

/// Timer counts that a segment takes.
fn duration<const MOTORS: usize>(segment: &Segment<MOTORS>) -> u64 {
    segment.duration().into()
}

/// Mean interval of a segment's ticks, timer counts, at least 1.
fn interval<const MOTORS: usize>(segment: &Segment<MOTORS>) -> u64 {
    (duration(segment) / u64::from(segment.ticks.get())).max(1)
}

/// How many of a segment's ticks have their middle less than `counts` after the middle of the
/// first. Bounded by the ticks of a millisecond.
fn ticks_within<const MOTORS: usize>(segment: &Segment<MOTORS>, counts: u64) -> NonZeroU16 {
    let change = segment.interval_change.to_bits();
    let mut interval = segment.interval.to_bits();
    let (mut ticks, mut after) = (NonZeroU16::MIN, 0);
    while ticks < segment.ticks {
        let next = interval.wrapping_add_signed(change);
        // From middle to middle.
        after += (interval / 2).wrapping_add(next / 2);
        if after >> 32 >= counts {
            break;
        }
        interval = next;
        ticks = ticks.saturating_add(1);
    }
    ticks
}

/// The rest of a segment after `taken` ticks; `None` where no tick is left.
fn rest_of<const MOTORS: usize>(
    segment: &Segment<MOTORS>,
    taken: NonZeroU16,
) -> Option<Segment<MOTORS>> {
    let left = NonZeroU16::new(segment.ticks.get() - taken.get())?;
    let change = segment.interval_change.to_bits() * i64::from(taken.get());
    Some(Segment {
        line: None,
        outputs: OutputChange::NONE,
        ticks: left,
        interval: Interval::from_bits(segment.interval.to_bits().wrapping_add_signed(change)),
        power: power_after(segment, taken.get().into()),
        ..*segment
    })
}

#[cfg(test)]
mod tests {
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

    /// The record of the pins: when a power was put out, and when the carriage was where (steps).
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

    /// Where the light of a laser that is `delay` counts late goes on and off, steps.
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
        #![proptest_config(ProptestConfig::with_cases(60))]

        /// Motion is the same to the count. The power is that of the time `lead` later, but for its
        /// change in half a tick.
        #[test]
        fn motion_stays_and_power_comes_by_the_lead_earlier(
            ends in prop::collection::vec((-8.0f64..8.0, 0u32..=100), 1..30), lead_us in 1u32..=1000,
            feed in 5.0f32..200.0, acceleration in 100.0f32..5000.0, hold in prop::option::of(5usize..200),
        ) {
            let run = |lead_us: u32| {
                let mut queue = RigQueue::new();
                let mut rig = rig(acceleration, &mut queue);
                for (x, percent) in &ends {
                    let power = MovePower::Constant { power: share(f64::from(*percent) / 100.0) };
                    rig.planner.push(&Move { power, ..to(*x, *x * 0.3, feed) }).unwrap();
                }
                rig.planner.set_overrides(Overrides { feed: 70, rapid: 100 });
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
}
