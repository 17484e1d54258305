//! From the moves to the step interrupt: segments are made and handed over, but never more than
//! 2 ms of them.
//!
//! A segment comes from the planner. The [`PowerRule`] gives it the power that goes out. The
//! [`Feeder`] puts it into the stepper's queue. [`Drivers`] are enabled before the step timer is
//! started.

use super::{Driver, Motion, Track};
use crate::board::{Board, Duration, Instant};
use crate::config::{COMMITTED, SEGMENTS};
use crate::work::Work;
use fixed::types::U1F31;
use heapless::spsc::Producer;
use heapless::Deque;
use leadscrew_planner::Kinematics;
use leadscrew_stepper::{Power, PowerChange, Segment, Shared};

/// The most segments made between two lines when motion may run out of segments. With one segment
/// only, motion does stop wherever a line and a segment together take longer to make than the
/// segment lasts.
const AT_ONCE: usize = 4;

impl<K, const AXES: usize, const MOTORS: usize> Motion<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS> + Clone,
{
    /// Finds out how much of the committed motion is left. Called at the start of a turn of the
    /// main loop.
    pub(crate) fn look(&mut self, now: Instant) {
        self.feeder.look(now);
    }

    /// Commits one segment if there is room. A line that waits is taken before the next segment, so
    /// that this segment takes the line's move into account. If segments may run out, they are
    /// committed before the line, [`AT_ONCE`] at most; so it is before motion begins, since a ramp
    /// may begin with segments that are over before the next turn. Returns whether the step timer is to be
    /// started. `may_start`: whether the program may begin to move now.
    pub(crate) fn prepare(&mut self, now: Instant, may_start: bool, work: &mut Work) -> bool {
        self.end_stop();
        self.program.planner.renew();
        if self.stopping || !self.may_feed(now, may_start) {
            return false;
        }
        for _ in 0..AT_ONCE {
            if !self.feeder.has_room() || !self.commit::<false>(work) || self.feeder.has_enough() {
                break;
            }
        }
        self.feeder.is_to_start()
    }

    /// As [`Motion::prepare`] in the middle of the program's motion, with long segments. Returns
    /// whether a move has ended.
    pub(crate) fn carry_on(&mut self, work: &mut Work) -> bool {
        let moves = self.program.planner.len();
        for _ in 0..AT_ONCE {
            if !self.feeder.has_room() || !self.commit::<true>(work) || self.feeder.has_enough() {
                break;
            }
        }
        self.program.planner.len() != moves
    }

    /// Returns true if the step interrupt makes the program's moves, and no hold or stop slows them
    /// down.
    pub(crate) fn goes_on(&self) -> bool {
        let runs = self.driver == Driver::Program && self.shared.is_running();
        runs && !self.stopping && !self.program.segmenter.is_held()
    }

    fn may_feed(&mut self, now: Instant, may_start: bool) -> bool {
        match self.driver {
            Driver::Aside => true,
            Driver::Program if !self.is_at_rest() => true,
            Driver::Program => may_start && self.is_released(now),
        }
    }

    fn is_released(&mut self, now: Instant) -> bool {
        if !self.wants_more() {
            self.release();
        }
        self.start.is_over(self.program.planner.len(), now)
    }

    /// Commits the next segment; returns whether there was one. `LONG`: it may be a whole cruise.
    fn commit<const LONG: bool>(&mut self, work: &mut Work) -> bool {
        let Some(mut segment) = self.next_segment::<LONG>() else {
            return false;
        };
        self.power.apply(&mut segment);
        self.power_out = segment.power;
        self.feeder.push(segment);
        work.segments = work.segments.wrapping_add(1);
        true
    }

    fn next_segment<const LONG: bool>(&mut self) -> Option<Segment<MOTORS>> {
        match self.driver {
            Driver::Program => {
                let Track { planner, segmenter } = &mut self.program;
                let room = self.feeder.room();
                self.lead.next(room.into(), || match LONG {
                    true => segmenter.next_long(planner),
                    false => segmenter.next(planner),
                })
            }
            Driver::Aside => self.aside.segmenter.next(&mut self.aside.planner),
        }
    }

    /// Starts the step timer, if [`Motion::prepare`] has returned `true`.
    pub(crate) fn start<B: Board>(&mut self, board: &mut B, now: Instant) {
        self.feeder.start(board, now);
    }

    /// Returns when [`Motion::prepare`] wants to be called again, should no interrupt come before.
    pub(crate) fn hunger(&mut self, now: Instant, may_start: bool) -> Hunger {
        if self.stopping || !self.may_feed(now, may_start) || !self.has_moves() {
            Hunger::None
        } else {
            self.feeder.hunger(now)
        }
    }

    fn has_moves(&self) -> bool {
        match self.driver {
            Driver::Program => {
                let waits = self.program.segmenter.is_held() || self.is_program_idle();
                !(waits && self.lead.is_empty())
            }
            Driver::Aside => !(self.aside.planner.is_empty() && self.aside.segmenter.is_idle()),
        }
    }

    /// Returns true if motion may run out of segments: they come before anything that takes long.
    pub(crate) fn is_short(&self) -> bool {
        self.feeder.is_short()
    }

    /// Returns true if segments ran out in motion since this was asked last.
    pub(crate) fn take_underrun(&mut self) -> bool {
        let before = self.underruns;
        self.underruns = self.shared.underruns();
        self.underruns != before
    }

    /// Returns true if the step interrupt does not come although there is motion to be made. Told
    /// once in [`STALLED`].
    pub(crate) fn take_stall(&mut self) -> bool {
        self.feeder.take_stall() && !(self.stopping && self.is_program_idle())
    }

    /// Returns when [`Motion::take_stall`] is to be asked, should no interrupt come before.
    pub(crate) fn look_at(&self, now: Instant) -> Option<Instant> {
        self.feeder.look_at(now)
    }

    fn end_stop(&mut self) {
        if self.stopping && self.feeder.is_at_rest() {
            self.stopping = false;
            self.shared.set_stop(false);
        }
    }
}

/// The rule for the power that goes out. It turns the power that a segment was planned with into
/// the power of the committed segment. The spindle override acts here.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum PowerRule {
    /// A spindle: this power in motion and at rest, whatever the moves were planned with.
    Spindle(Power),
    /// A laser: the power of the moves, in percent of full power.
    Laser {
        /// The spindle override.
        percent: u8,
    },
}

impl PowerRule {
    /// Puts the rule into effect.
    fn apply<const MOTORS: usize>(self, segment: &mut Segment<MOTORS>) {
        match self {
            Self::Spindle(power) => {
                segment.power = power;
                segment.power_change = PowerChange::ZERO;
                segment.at_rest = segment.at_rest.map(|_| power);
            }
            Self::Laser { percent: 100 } => {}
            Self::Laser { percent } => {
                segment.power = scaled(segment.power, percent);
                segment.at_rest = segment.at_rest.map(|power| scaled(power, percent));
                let change = i64::from(segment.power_change.to_bits()) * i64::from(percent) / 100;
                let limit = i64::from(i32::MAX);
                let change = change.clamp(-limit, limit) as i32;
                segment.power_change = PowerChange::from_bits(change);
            }
        }
    }
}

/// `percent` of `power`, full power at most.
fn scaled(power: Power, percent: u8) -> Power {
    let bits = u64::from(power.share().to_bits()) * u64::from(percent) / 100;
    Power::from_share(U1F31::from_bits(u32::try_from(bits).unwrap_or(u32::MAX)))
}

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
/// after it. The time committed is the rest of the segment under way and all segments that wait:
///
/// ```text
///    left of the one under way | waiting ...          | room for the longest | laser's lead
///    <--------------------------------- 2 ms ----------------------------------------->
/// ```
///
/// The main loop notices the start of a segment late, never early. So its estimate of the committed
/// time is too long rather than too short. No segment is longer than [`Feeder::longest_segment`]; a
/// slow step takes several segments.
pub(crate) struct Feeder<'a, const MOTORS: usize> {
    segments: Producer<'a, Segment<MOTORS>>,
    shared: &'a Shared<MOTORS>,
    /// Durations of the segment under way and of the segments that wait in the queue, oldest first,
    /// timer counts.
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
    /// The part of the segment under way that was over at the last look, timer counts.
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
        // One segment waits while another is under way and has SHORT left.
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
    fn room(&self) -> u32 {
        self.bounds.waiting.saturating_sub(self.left())
    }

    /// Returns true if one more segment may be committed.
    fn has_room(&self) -> bool {
        self.left() <= self.bounds.committed && self.segments.ready()
    }

    /// The time at which another segment is needed. If there is no room for one now, that is when
    /// the committed motion has come down to [`Feeder::least`], if the step interrupt takes no
    /// segment before. A waiting segment may be short, and the next one must be there before it
    /// ends.
    fn hunger(&self, now: Instant) -> Hunger {
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
    fn is_short(&self) -> bool {
        self.shared.is_running() && !self.has_enough()
    }

    /// Returns true if the segments that are committed last until the next turn of the main loop.
    fn has_enough(&self) -> bool {
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
    fn push(&mut self, segment: Segment<MOTORS>) {
        let duration = segment.duration();
        self.is_crowded = segment.interval < self.bounds.crowded;
        if self.segments.enqueue(segment).is_ok() && self.durations.push_back(duration).is_ok() {
            self.committed = self.committed.saturating_add(duration);
        }
    }

    /// Returns true if the step timer rests although segments wait.
    fn is_to_start(&self) -> bool {
        !self.shared.is_running() && !self.segments.is_empty()
    }

    /// Starts the step timer out of rest.
    fn start<B: Board>(&mut self, board: &mut B, now: Instant) {
        self.shared.set_running();
        let begun = board.start_stepping(now);
        self.since = self.counts(begun);
    }

    /// Returns true if nothing is committed and the step timer rests.
    pub(crate) fn is_at_rest(&self) -> bool {
        !self.shared.is_running() && self.segments.is_empty()
    }

    /// Looks at the queue: drops the durations of the segments that are over, and notes how much of
    /// the one under way is over. At the start of a turn of the main loop.
    fn look(&mut self, now: Instant) {
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

/// `$1=255` keeps motors enabled.
const ALWAYS: u32 = 255;

/// Motor drivers: enabled before the first step, disabled some time after the last (`$1`). The
/// value says whether they are enabled, and since when they are not needed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Drivers {
    enabled: bool,
    idle_since: Option<Instant>,
}

impl Drivers {
    /// Enables the drivers. Before the step timer is started. Main loop.
    pub(crate) fn enable<B: Board>(&mut self, board: &mut B) {
        if !self.enabled {
            board.enable_motors(true);
        }
        self.enabled = true;
        self.idle_since = None;
    }

    /// Disables the drivers at once. Main loop, after a stop.
    pub(crate) fn drop<B: Board>(&mut self, board: &mut B) {
        board.enable_motors(false);
        self.enabled = false;
    }

    /// Disables the drivers `delay_ms` after motion ended; 255 stands for never. With `locked` (in
    /// an alarm, or asleep) 255 does not keep them enabled. Main loop, while at rest.
    pub(crate) fn rest<B: Board>(
        &mut self,
        delay_ms: impl FnOnce() -> u32,
        locked: bool,
        board: &mut B,
        now: Instant,
    ) {
        if !self.enabled {
            return;
        }
        self.idle_since.get_or_insert(now);
        if self.rest_at(delay_ms, locked).is_some_and(|end| now >= end) {
            board.enable_motors(false);
            self.enabled = false;
        }
    }

    /// Returns when the drivers are to be disabled; `None`: time does not disable them.
    pub(crate) fn rest_at(&self, delay_ms: impl FnOnce() -> u32, locked: bool) -> Option<Instant> {
        let since = self.idle_since.filter(|_| self.enabled)?;
        let delay_ms = delay_ms();
        (locked || delay_ms != ALWAYS).then(|| since + millis(delay_ms))
    }
}

fn millis(millis: u32) -> Duration {
    Duration::from_ticks(u64::from(millis) * 1_000)
}

#[cfg(test)]
mod tests;
