//! The main loop's end of the segment queue.

use crate::board::{Board, Duration, Instant};
use crate::config::{COMMITTED, SEGMENTS};
use heapless::spsc::Producer;
use heapless::Deque;
use leadscrew_stepper::{Segment, Shared};

/// [`COMMITTED`] is reduced by this time, because a byte may have come that the segments made now
/// do not take into account: 50 µs until a board looks at received bytes, some for its interrupts,
/// and a microsecond for each rounding of the time.
const UNSEEN: Duration = Duration::from_ticks(100);

/// A further reduction if power has a lead: half a tick of fast steps, for which power is needed
/// beyond the lead.
const HALF_A_TICK: Duration = Duration::from_ticks(50);

/// When this much committed motion is left, the main loop makes the next segment, and does not wait
/// until the last one begins. It is more than the time of a `Machine::poll` (0.4 ms on an F407; some
/// 100 000 instructions if each operation of a float is a call).
const SHORT: Duration = Duration::from_ticks(if cfg!(feature = "without-fpu") {
    2_800
} else {
    450
});

/// The share of the committed time that one segment is, at most: below a millisecond.
const SHARE: u32 = if cfg!(feature = "without-fpu") { 5 } else { 2 };

/// Ticks closer than this leave the main loop little time: on the F407, with a tick every 2.7 µs,
/// two fifths of it. A line may then take as long as a segment lasts, so segments come first, as
/// soon as there is room for them.
const CROWDED: Duration = Duration::from_ticks(4);

/// If the step timer runs and no segment is taken for this long, its interrupt does not come: no
/// segment is longer than a millisecond.
const STALLED: Duration = Duration::from_ticks(100_000);

/// While the step timer runs, the main loop looks this often at least. A longer pause between two
/// looks counts as this long: the program itself may have stood still, in a debugger or elsewhere.
const LOOK: Duration = Duration::from_ticks(20_000);

/// [`Segment::duration`] is shorter than the segment by less than this, timer counts. It is the sum
/// of two products, which are rounded down. One factor of each was rounded down to 2⁻¹⁶ counts, the
/// other is the number of ticks, or of pairs of ticks. A segment of 0.95 ms has at most 500 ticks,
/// of 1.9 µs:
///
/// ```text
///     2 + (500 + 500·499/2)/2¹⁶ = 3.91
/// ```
const ROUNDED_OFF: u32 = 4;

/// The main loop's end of the segment queue: hands segments to the step interrupt, no more than
/// 2 ms of them, and starts the step timer out of rest. Main loop.
///
/// A segment in the queue cannot be changed any more: a hold, an override or a cancel takes effect
/// after it. The segment that the step interrupt makes is the current one. What is left of it, and
/// all segments that wait, are the committed time:
///
/// ```text
///    left of the current one   | waiting ...          | room for the longest | laser's lead
///    <--------------------------------- 2 ms ----------------------------------------->
/// ```
///
/// The main loop notices the start of a segment late, never early. So its estimate of the committed
/// time is too long rather than too short. No segment is longer than [`Feeder::longest_segment`]; a
/// slow step takes several segments.
pub(crate) struct Feeder<'a, const MOTORS: usize> {
    segments: Producer<'a, Segment<MOTORS>>,
    shared: &'a Shared<MOTORS>,
    /// Durations of the current segment and of those that wait in the queue, oldest first, timer
    /// counts.
    durations: Deque<u32, { SEGMENTS + 1 }>,
    /// The sum of `durations`.
    committed: u32,
    /// The instant at which the oldest of these segments began, or a later instant: timer counts
    /// modulo 2³².
    since: u32,
    /// Timer counts in a microsecond, rounded down.
    counts_per_us: u32,
    /// The bounds of segments and of the committed time.
    bounds: Bounds,
    /// How much of the current segment the step interrupt had made at the last look, timer counts.
    over: u32,
    /// True if the ticks of the newest segment are closer than [`CROWDED`].
    is_crowded: bool,
    /// For how long no segment has been taken although the step timer runs, as of the last look.
    stalled: Duration,
    /// True if that was told, and no segment has been taken since.
    stall_told: bool,
    looked: Instant,
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
    /// The bound [`CROWDED`], timer counts.
    crowded: u32,
}

impl Bounds {
    /// Makes the bounds for power with a lead of `lead_us` µs, below [`COMMITTED`]. Segments that
    /// wait for the lead count as committed.
    fn new(lead_us: u32, counts_per_us: u32) -> Self {
        let all = (COMMITTED - UNSEEN).ticks() as u32;
        let most = match lead_us {
            0 => all,
            lead => all - lead - HALF_A_TICK.ticks() as u32,
        };
        // One segment waits while the step interrupt makes the last SHORT of the current one.
        let longest_us = (most / SHARE).min(most - SHORT.ticks() as u32);
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
    /// The instant of [`Hunger::At`], if this is one.
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
            stalled: Duration::from_ticks(0),
            stall_told: false,
            looked: Instant::from_ticks(0),
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
    pub(super) fn room(&self) -> u32 {
        self.bounds.waiting.saturating_sub(self.left())
    }

    /// Returns true if one more segment may be committed.
    pub(super) fn has_room(&self) -> bool {
        self.left() <= self.bounds.committed && self.segments.ready()
    }

    /// The time at which another segment is needed. If there is no room for one now, that is when
    /// the committed motion has come down to [`Feeder::least`], if the step interrupt takes no
    /// segment before. A waiting segment may be short, and the next one must be there before it
    /// ends.
    pub(super) fn hunger(&self, now: Instant) -> Hunger {
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

    /// Returns true if motion may run out of segments: less than [`Feeder::least`] is left. The
    /// main loop wanted to be woken at that point, so it is late.
    pub(super) fn is_short(&self) -> bool {
        self.shared.is_running() && !self.has_enough()
    }

    /// Returns true if the segments that are committed last until the next turn of the main loop.
    pub(super) fn has_enough(&self) -> bool {
        self.left() >= self.least()
    }

    /// The next segment is made when less than this is left, timer counts. Usually that is
    /// [`SHORT`]: committed motion cannot be changed, so the segment is made late. If ticks are
    /// [`CROWDED`], a segment takes long to make, so it is made as soon as there is room.
    fn least(&self) -> u32 {
        match self.is_crowded {
            true => self.bounds.committed,
            false => self.bounds.short,
        }
    }

    /// Commits a segment. The caller has checked [`Feeder::has_room`].
    pub(super) fn push(&mut self, segment: Segment<MOTORS>) {
        let duration = segment.duration();
        self.is_crowded = segment.interval < self.bounds.crowded;
        if self.segments.enqueue(segment).is_ok() && self.durations.push_back(duration).is_ok() {
            self.committed = self.committed.saturating_add(duration);
        }
    }

    /// Returns true if the step timer rests although segments wait.
    pub(super) fn is_to_start(&self) -> bool {
        !self.shared.is_running() && !self.segments.is_empty()
    }

    /// Starts the step timer out of rest.
    pub(super) fn start<B: Board>(&mut self, board: &mut B, now: Instant) {
        self.shared.set_running();
        let begun = board.start_stepping(now);
        self.since = self.counts(begun);
    }

    /// Returns true if nothing is committed and the step timer rests.
    pub(crate) fn is_at_rest(&self) -> bool {
        !self.shared.is_running() && self.segments.is_empty()
    }

    /// Looks at the queue: drops the durations of segments that the step interrupt has made, and notes
    /// how much of the current one it has made. The main loop calls it at the start of a turn.
    pub(super) fn look(&mut self, now: Instant) {
        let is_running = self.shared.is_running();
        let remaining = self.segments.len() + usize::from(is_running);
        self.watch(is_running && self.durations.len() <= remaining, now);
        let now = self.counts(now);
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

    /// Adds up for how long no segment has been taken. `waits`: none was since the last look.
    fn watch(&mut self, waits: bool, now: Instant) {
        let before = core::mem::replace(&mut self.looked, now);
        if !waits {
            (self.stalled, self.stall_told) = (Duration::from_ticks(0), false);
            return;
        }
        let passed = now.checked_duration_since(before);
        self.stalled += passed.unwrap_or(LOOK).min(LOOK);
    }

    /// Returns true if the step interrupt has taken no segment for [`STALLED`], and has not been
    /// reported for it since.
    pub(crate) fn take_stall(&mut self) -> bool {
        let stalls = self.stalled >= STALLED;
        if stalls {
            (self.stalled, self.stall_told) = (Duration::from_ticks(0), true);
        }
        stalls
    }

    /// Returns true if the step interrupt does not come, as told.
    pub(crate) fn is_stalled(&self) -> bool {
        self.stall_told
    }

    /// Returns when the step interrupt is to be looked at, should it take no segment before; `None`
    /// at rest.
    pub(crate) fn look_at(&self, now: Instant) -> Option<Instant> {
        self.shared.is_running().then(|| now + LOOK)
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

/// Timer counts from `instant` up to `now`; 0 if `instant` has not come yet. The two must be
/// less than 2³¹ counts apart, 25 s on the F407.
fn passed(instant: u32, now: u32) -> u32 {
    let passed = now.wrapping_sub(instant).cast_signed();
    passed.max(0).cast_unsigned()
}

#[cfg(test)]
mod tests;
