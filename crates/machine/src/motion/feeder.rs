//! The main loop's end of the segment queue: hands segments over, and no more than 2 ms of them.
//!
//! A segment in the queue cannot be changed any more: a hold, an override or a cancel takes effect
//! after it. The time committed is the rest of the segment under way and all segments that wait:
//!
//! ```text
//!    left of the one under way | waiting ...          | room for the longest | laser's lead
//!    <--------------------------------- 2 ms ----------------------------------------->
//! ```
//!
//! The main loop notices the start of a segment late, never early. So its estimate of the committed
//! time is too long rather than too short. No segment is longer than [`Feeder::longest_segment`]; a
//! slow step takes several segments.

use crate::board::{Board, Duration, Instant};
use crate::config::{COMMITTED, SEGMENTS};
use heapless::spsc::Producer;
use heapless::Deque;
use leadscrew_stepper::{Segment, Shared};

/// [`COMMITTED`] is reduced by this time, because a byte may have come that the segments made now
/// do not take into account: 50 µs until a board looks at received bytes, some for its interrupts,
/// and a microsecond for each rounding of the time.
const UNSEEN: Duration = Duration::from_ticks(100);

/// A further reduction where power has a lead: half a tick of fast steps, for which power is needed
/// beyond the lead.
const HALF_A_TICK: Duration = Duration::from_ticks(50);

/// When this much committed motion is left, the main loop makes the next segment, and does not wait
/// until the last one begins. It is more than the time of a `Machine::poll` (0.4 ms).
const SHORT: Duration = Duration::from_ticks(450);

/// Ticks closer than this leave the main loop little time: on the F407, with a tick every 2.7 µs,
/// two fifths of it. A line may then take as long as a segment lasts, so segments come first, as
/// soon as there is room for them.
const CROWDED: Duration = Duration::from_ticks(4);

/// [`Segment::duration`] is shorter than the segment by less than this, timer counts. It is the sum
/// of two products, which are rounded down. One factor of each was rounded down to 2⁻¹⁶ counts, the
/// other is the number of ticks, or of pairs of ticks. A segment of 0.95 ms has at most 500 ticks,
/// of 1.9 µs:
///
/// ```text
///     2 + (500 + 500·499/2)/2¹⁶ = 3.91
/// ```
const ROUNDED_OFF: u32 = 4;

/// Hands segments to the step interrupt and starts it out of rest. Main loop.
pub(crate) struct Feeder<'a, const MOTORS: usize> {
    segments: Producer<'a, Segment<MOTORS>>,
    shared: &'a Shared<MOTORS>,
    /// Durations of the segment under way and of the segments that wait in the queue, oldest first,
    /// timer counts.
    durations: Deque<u32, { SEGMENTS + 1 }>,
    /// The sum of `durations`.
    committed: u32,
    /// The instant at which the oldest of them began, or a later one: timer counts modulo 2³².
    since: u32,
    /// Timer counts in a microsecond, rounded down.
    counts_per_us: u32,
    /// The bounds of segments and of the committed time.
    bounds: Bounds,
    /// The part of the segment under way that was over at the last look, timer counts.
    over: u32,
    /// Whether the ticks of the newest segment are closer than [`CROWDED`].
    is_crowded: bool,
}

/// The bounds of segments and of the committed time.
struct Bounds {
    /// The longest segment, µs.
    longest_us: u32,
    /// The most committed time with which one more segment may be handed over, timer counts.
    committed: u32,
    /// The most committed time with which one more segment may wait for the power's lead, timer
    /// counts.
    waiting: u32,
    /// [`SHORT`], timer counts: the next segment is made when only this is left, at the latest.
    short: u32,
    /// [`CROWDED`], timer counts.
    crowded: u32,
}

impl Bounds {
    /// Makes the bounds for power with a lead of `lead_us` µs, below [`COMMITTED`]: segments that
    /// wait for it are committed, too.
    fn new(lead_us: u32, counts_per_us: u32) -> Self {
        let all = (COMMITTED - UNSEEN).ticks() as u32;
        let most = match lead_us {
            0 => all,
            lead => all - lead - HALF_A_TICK.ticks() as u32,
        };
        // One segment waits while another is under way and has SHORT left.
        let longest_us = (most / 2).min(most - SHORT.ticks() as u32);
        Self {
            longest_us,
            committed: (most - longest_us) * counts_per_us,
            waiting: (all - longest_us) * counts_per_us,
            short: SHORT.ticks() as u32 * counts_per_us,
            crowded: CROWDED.ticks() as u32 * counts_per_us,
        }
    }
}

/// The time at which motion needs another segment.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Hunger {
    /// One more could be committed now.
    Now,
    /// At this instant, if the step interrupt takes none before.
    At(Instant),
    /// Not before something else happens.
    None,
}

impl Hunger {
    /// The instant, if it is one.
    pub(crate) fn at(self) -> Option<Instant> {
        match self {
            Self::At(at) => Some(at),
            Self::Now | Self::None => None,
        }
    }
}

impl<'a, const MOTORS: usize> Feeder<'a, MOTORS> {
    /// Makes a feeder for a step timer of `timer_hz` counts a second.
    pub(crate) fn new(
        segments: Producer<'a, Segment<MOTORS>>,
        shared: &'a Shared<MOTORS>,
        timer_hz: u32,
    ) -> Self {
        let counts_per_us = timer_hz / 1_000_000;
        Self {
            segments,
            shared,
            durations: Deque::new(),
            committed: 0,
            since: 0,
            counts_per_us,
            bounds: Bounds::new(0, counts_per_us),
            over: 0,
            is_crowded: false,
        }
    }

    /// Sets the time for which the power's lead keeps segments waiting, µs, below [`COMMITTED`].
    /// Called at rest.
    pub(crate) fn set_lead(&mut self, lead_us: u32) {
        self.bounds = Bounds::new(lead_us, self.counts_per_us);
    }

    /// The longest segment that may be handed over, seconds.
    pub(crate) fn longest_segment(&self) -> f32 {
        self.bounds.longest_us as f32 * 1e-6
    }

    /// The most timer counts of segments that may wait for the power's lead. With one segment more,
    /// the committed time is still within its bound.
    pub(crate) fn room(&self) -> u32 {
        self.bounds.waiting.saturating_sub(self.left())
    }

    /// Whether one more segment may be committed.
    pub(crate) fn has_room(&self) -> bool {
        self.left() <= self.bounds.committed && self.segments.ready()
    }

    /// The time at which another segment is needed. If there is no room for one now, that is when
    /// the committed motion has come down to [`Feeder::least`], if the step interrupt takes no
    /// segment before. A waiting segment may be short, and the next one must be there before it
    /// ends.
    pub(crate) fn hunger(&self, now: Instant) -> Hunger {
        if self.has_room() {
            Hunger::Now
        } else if self.shared.is_running() && self.segments.ready() {
            let spare = self.left().saturating_sub(self.least());
            let wait = spare.div_ceil(self.counts_per_us);
            Hunger::At(now + Duration::from_ticks(wait.into()))
        } else {
            Hunger::None
        }
    }

    /// Whether motion may run out of segments: less than [`Feeder::least`] is left. The main loop
    /// wanted to be woken at that point, so it is late.
    pub(crate) fn is_short(&self) -> bool {
        self.shared.is_running() && self.left() < self.least()
    }

    /// The next segment is made when less than this is left, timer counts. Usually that is
    /// [`SHORT`]: committed motion cannot be changed, so the segment is made late. Where ticks are
    /// [`CROWDED`], a segment takes long to make, so it is made as soon as there is room.
    fn least(&self) -> u32 {
        match self.is_crowded {
            true => self.bounds.committed,
            false => self.bounds.short,
        }
    }

    /// Commits a segment. The caller has checked [`Feeder::has_room`].
    pub(crate) fn push(&mut self, segment: Segment<MOTORS>) {
        let duration = segment.duration();
        self.is_crowded = segment.interval < self.bounds.crowded;
        if self.segments.enqueue(segment).is_ok() && self.durations.push_back(duration).is_ok() {
            self.committed = self.committed.saturating_add(duration);
        }
    }

    /// Whether the step timer rests although segments wait.
    pub(crate) fn is_to_start(&self) -> bool {
        !self.segments.is_empty() && !self.shared.is_running()
    }

    /// Starts the step timer out of rest.
    pub(crate) fn start<B: Board>(&mut self, board: &mut B, now: Instant) {
        self.shared.set_running();
        let begun = board.start_stepping(now);
        self.since = self.counts(begun);
    }

    /// Whether nothing is committed and the step timer rests.
    pub(crate) fn is_at_rest(&self) -> bool {
        self.segments.is_empty() && !self.shared.is_running()
    }

    /// Looks at the queue: drops the durations of the segments that are over, and notes how much of
    /// the one under way is over. At the start of a turn of the main loop.
    pub(crate) fn look(&mut self, now: Instant) {
        let now = self.counts(now);
        let is_running = self.shared.is_running();
        let remaining = self.segments.len() + usize::from(is_running);
        while self.durations.len() > remaining {
            let Some(ended) = self.durations.pop_front() else {
                break;
            };
            self.committed = self.committed.saturating_sub(ended);
            let next = self.since.wrapping_add(ended).wrapping_add(ROUNDED_OFF);
            self.since = now.wrapping_sub(passed(next, now));
        }
        let under_way = self.durations.front().filter(|_| is_running);
        self.over = under_way.map_or(0, |lasts| passed(self.since, now).min(*lasts));
    }

    /// The time committed and not over, timer counts, as of the last look.
    fn left(&self) -> u32 {
        self.committed.wrapping_sub(self.over) // `over` is a part of `committed`
    }

    /// Timer counts since power-up, modulo 2³².
    fn counts(&self, now: Instant) -> u32 {
        (now.ticks() as u32).wrapping_mul(self.counts_per_us)
    }
}

/// Counts from an instant up to `now`; 0 where it has not come yet. They are less than 2³¹ counts
/// apart, 25 s on the F407.
fn passed(instant: u32, now: u32) -> u32 {
    let passed = now.wrapping_sub(instant).cast_signed();
    passed.max(0).cast_unsigned()
}

#[cfg(test)]
mod tests {
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
}
