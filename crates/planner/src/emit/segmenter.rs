//! Planned moves in, step segments out; feed hold and resume; the power of a laser ahead of motion.
//!
//! ```text
//!             hold                    rest reached
//!    Going ----------> Stopping ------------------> Held
//!      ^ \__ at rest ______|________________________^ |
//!      |      resume       |                          |
//!      +-------------------+--------------------------+
//! ```
//!
//! Each call hands out a segment of at most `Config::longest_segment`; a step event that takes
//! longer is handed out in parts. Before each segment the planner is asked again how fast the
//! running move may end (the queue may have grown) and whether nominal speeds have changed
//! (overrides). If an answer has changed, the profile is made anew from the place and the speed
//! reached. So every change takes effect after the segments handed out.

use crate::built::RASTERS;
use crate::ease::Ease;
use crate::emit::fit::Carry;
use crate::emit::lead::Lead;
use crate::emit::running::drive::{Aim, Goal};
use crate::emit::running::{Running, Timing};
use crate::{Kinematics, Place, Planner, Profile};
use core::num::NonZeroU16;
use fixed::types::U1F31;
use heapless::deque::{Deque, DequeView};
use leadscrew_stepper::{Interval, OutputChange, Power, PowerChange, Segment};

/// Turns the planner's moves into segments for the step interrupt. Main loop.
#[derive(Clone, Debug)]
pub struct Segmenter<const AXES: usize, const MOTORS: usize> {
    /// The move that runs, or the last one that ran: the next one goes on from its end.
    last: Option<Running<MOTORS>>,
    mode: Mode,
    carry: Carry,
    /// With a jerk limit: the plan, which is ahead of the segments.
    lead: Lead,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum Mode {
    /// Motion as planned.
    #[default]
    Going,
    /// A feed hold slows down.
    Stopping,
    /// A feed hold has reached rest.
    Held,
}

impl Mode {
    /// Returns how far the running move is to go.
    const fn goal(self) -> Goal {
        match self {
            Self::Going => Goal::End,
            Self::Stopping | Self::Held => Goal::Stop,
        }
    }
}

impl<const AXES: usize, const MOTORS: usize> Default for Segmenter<AXES, MOTORS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const AXES: usize, const MOTORS: usize> Segmenter<AXES, MOTORS> {
    /// Makes a segmenter at rest.
    pub fn new() -> Self {
        Self {
            last: None,
            mode: Mode::Going,
            carry: Carry::default(),
            lead: Lead::new(),
        }
    }

    /// Hands out the next segment: at most `Config::longest_segment` of motion.
    ///
    /// When a move ends, takes the next one from `planner`. `None` if no move is queued, or a
    /// hold has reached rest.
    pub fn next<K>(&mut self, planner: &mut Planner<'_, K, AXES, MOTORS>) -> Option<Segment<MOTORS>>
    where
        K: Kinematics<AXES, MOTORS>,
    {
        self.make::<K, false>(planner)
    }

    /// As [`Segmenter::next`], but a cruise that no further move can change is cut after a twentieth
    /// of a second only: the same motion to the last bit in fewer segments, which follows a hold or an
    /// override later.
    ///
    /// For simulators that ask for times only.
    pub fn next_long<K>(
        &mut self,
        planner: &mut Planner<'_, K, AXES, MOTORS>,
    ) -> Option<Segment<MOTORS>>
    where
        K: Kinematics<AXES, MOTORS>,
    {
        self.make::<K, true>(planner)
    }

    fn make<K, const LONG: bool>(
        &mut self,
        planner: &mut Planner<'_, K, AXES, MOTORS>,
    ) -> Option<Segment<MOTORS>>
    where
        K: Kinematics<AXES, MOTORS>,
    {
        planner.renew();
        if self.mode == Mode::Held {
            return None;
        }
        if self.is_idle() {
            self.begin(planner)?;
        }
        let goal = self.mode.goal();
        // A reference, because moving it out and back in would copy it for each segment.
        let running = self.last.as_mut()?;
        running.begin_pixel(|| planner.take_pixel());
        let timing = Timing::new(planner.config());
        match &running.profile {
            Profile::Trapezoid(profile) => {
                let drive = &running.drive;
                let outlook = planner.outlook(|| drive.whereabouts(profile));
                if drive.outlook != Some(outlook) {
                    let course = planner.course(drive.whereabouts(profile), outlook)?;
                    let aim = Aim::new(goal, planner, &course);
                    running.follow(drive.planned(profile, aim), timing);
                    running.drive.outlook = Some(outlook);
                }
            }
            Profile::Mean(_) => self.lead.extend(planner, goal, running, timing)?,
        }
        // While the end of the plan bounds a move, more may be planned at each of its segments. Not
        // `LONG`, this is in one place: a call would take a seventh more for each segment.
        let segment = match LONG && !planner.is_bound_by_end() {
            true => running.segment::<true>(timing, &mut self.carry, goal),
            false => running.segment::<false>(timing, &mut self.carry, goal),
        };
        if running.at_profile_end() {
            self.end_profile(planner);
        }
        Some(segment)
    }

    /// Begins the next move. `None` if no move is queued.
    fn begin<K>(&mut self, planner: &mut Planner<'_, K, AXES, MOTORS>) -> Option<()>
    where
        K: Kinematics<AXES, MOTORS>,
    {
        self.last = match planner.ease() {
            Some(ease) => {
                if planner.front().is_none() && !self.lead.begin(planner, &ease) {
                    return None;
                }
                Running::after(self.last.as_ref(), planner.front()?, &ease)
            }
            None => {
                let planned = planner.start_next()?;
                let entry_v2 = self.last.as_ref().map_or(0.0, Running::exit_v2);
                Running::new(planned, entry_v2)
            }
        };
        self.last.is_some().then_some(())
    }

    /// Begins a feed hold: from the end of the segments handed out, the shortest stop on the path
    /// that acceleration allows.
    ///
    /// The stop ends on a whole step. If the running move is too short for the stop, the stop
    /// ends in a later move. [`Segmenter::is_held`] tells when the stop has ended.
    pub fn hold(&mut self) {
        if self.mode == Mode::Going {
            self.mode = if self.is_moving() {
                Mode::Stopping
            } else {
                Mode::Held
            };
            self.plan_anew();
        }
    }

    /// Goes on after a feed hold. A hold that has not reached rest yet is broken off.
    pub fn resume(&mut self) {
        self.mode = Mode::Going;
        self.plan_anew();
    }

    /// Returns true if a feed hold has reached rest (at the end of the segments handed out).
    pub fn is_held(&self) -> bool {
        self.mode == Mode::Held
    }

    /// Returns true if the segmenter makes segments of no move. Moves may wait in the queue.
    pub fn is_idle(&self) -> bool {
        self.running().is_none()
    }

    /// The move that runs.
    fn running(&self) -> Option<&Running<MOTORS>> {
        self.last.as_ref().filter(|last| !last.at_end())
    }

    /// Forgets the running move and any hold. Called at rest, after a reset or a jog cancel,
    /// together with [`Planner::clear`].
    pub fn abandon(&mut self) {
        *self = Self::new();
    }

    /// Makes the stepper begin the rest of the running line anew, because another line came between
    /// (parking). Called while held.
    pub fn renew_line(&mut self) {
        if let Some(running) = &mut self.last {
            running.renew_line();
        }
    }

    /// Returns the speed along the path at the end of the segments handed out, mm/s.
    pub fn speed(&self) -> f32 {
        self.last.as_ref().map_or(0.0, Running::speed)
    }

    /// Time to the end of the profile, s; the speed there, mm/s; the steps of the running move that
    /// follow.
    pub(crate) fn rest_of_part(&self, ease: Option<Ease>) -> (f32, f32, u32) {
        match ease {
            Some(ease) => self.lead.rest(&ease),
            None => self.last.as_ref().map_or((0.0, 0.0, 0), Running::rest),
        }
    }

    /// Returns the line number of the running move.
    pub fn line_number(&self) -> Option<u32> {
        self.running().and_then(Running::line_number)
    }

    /// Returns the profile of the running move and the place up to which it was handed out.
    pub fn profile(&self) -> Option<(&Profile, Place)> {
        self.running()
            .map(|running| (running.profile(), running.here()))
    }

    /// Returns true if motion has a speed at the end of the segments handed out.
    fn is_moving(&self) -> bool {
        self.speed() > 0.0 || self.lead.is_ahead()
    }

    /// Has the profile made anew before the next segment.
    fn plan_anew(&mut self) {
        if let Some(running) = &mut self.last {
            running.drive.outlook = None;
        }
        self.lead.plan_anew();
    }

    /// Ends a profile whose steps have all been handed out. A move has one profile or more: a hold
    /// may stop within it, and a long line runs in parts (see
    /// [`Course`](crate::space::axis_limits::Course)).
    fn end_profile<K>(&mut self, planner: &mut Planner<'_, K, AXES, MOTORS>)
    where
        K: Kinematics<AXES, MOTORS>,
    {
        let Some(running) = &mut self.last else {
            return;
        };
        let rests = running.exit_v2() <= 0.0 && !self.lead.is_under_way();
        if self.mode == Mode::Stopping && rests {
            self.mode = Mode::Held;
        }
        if running.at_end() {
            match running.profile {
                Profile::Trapezoid(_) => planner.finish(),
                Profile::Mean(_) => planner.retire(),
            }
        } else {
            running.drive.outlook = None;
        }
    }
}

/// The longest lead, µs.
pub const LONGEST_LEAD: u32 = 1000;

/// Hands on segments with the power of later ones. Main loop.
///
/// The laser power is put out early, to make up for the delay of the laser.
///
/// A laser follows a change of its power after a delay (its driver's rise time, the tube's
/// ignition). At a speed `v` the light is then `v·delay` too late along the path. A raster is burnt
/// in both directions, so its rows are shifted to either side in turn. To prevent that, the power
/// that belongs to the time `t + lead` is put out at `t`:
///
/// ```text
///   motion   | front ...... | second | third ...............|     segments that wait, oldest first
///            |<----- lead ----->|
///   power                       ^ for the front's first tick
/// ```
///
/// Segments wait here until they cover the time that the power for the front's first tick belongs
/// to, and no longer: a hold cannot change a segment that waits. For the same reason no more
/// segments are taken than there is `room` for. If ticks are so long that this time lies beyond
/// the segments that wait, the power at the end of the last one is used.
///
/// Each segment is handed out in pieces, one for each segment that its power comes from. The power
/// changes with a tick, at most half a tick from the right time. Motion is never changed.
///
/// Out of rest the first power would have to be put out before motion begins. There the laser stays
/// off. Its power would follow the speed, which is lowest there, so the energy that is lost is
/// small. At the end of motion the power at rest comes early.
#[derive(Debug)]
pub struct PowerLead<'a, const MOTORS: usize> {
    /// The lead, in counts of the step timer.
    lead: u64,
    waiting: &'a mut DequeView<Segment<MOTORS>>,
}

/// The source of a segment's power.
struct Source {
    /// The power in the middle of the first tick.
    power: Power,
    /// Change of the power in a timer count.
    slope: f32,
    /// Timer counts for which this source can be used.
    lasts: u64,
}

impl<'a, const MOTORS: usize> PowerLead<'a, MOTORS> {
    /// Makes a lead of 0, which hands on each segment with its own power. If there is a lead,
    /// segments wait in `waiting`. If the lead spans more segments than fit there, the last
    /// one's power is put out for the rest of the lead.
    pub fn new<const WAITING: usize>(waiting: &'a mut Deque<Segment<MOTORS>, WAITING>) -> Self {
        Self { lead: 0, waiting }
    }

    /// Sets the lead in microseconds (values above [`LONGEST_LEAD`] count as [`LONGEST_LEAD`]), for
    /// a step timer of `timer_hz` counts a second. Without the feature `rasters` there is no lead.
    /// Called at rest.
    pub fn set(&mut self, lead_us: u32, timer_hz: u32) {
        let lead = u64::from(lead_us.min(LONGEST_LEAD));
        self.lead = lead * u64::from(timer_hz) / 1_000_000;
    }

    /// Hands out the next segment. Takes from `source` the segments that its power depends on, but
    /// none while segments of more than `room` timer counts wait already. `None` if `source` has
    /// no segment and none waits.
    pub fn next(
        &mut self,
        room: u64,
        mut source: impl FnMut() -> Option<Segment<MOTORS>>,
    ) -> Option<Segment<MOTORS>> {
        if !RASTERS || (self.lead == 0 && self.waiting.is_empty()) {
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

    /// Returns true if nothing waits.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Forgets the segments that wait: after a reset or a jog cancel.
    pub fn clear(&mut self) {
        self.waiting.clear();
    }

    /// Takes segments until they cover the time that the power for the front's first tick belongs
    /// to, or `source` has no more, or there is no room.
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
    /// A power that does not change.
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

/// Returns how many of a segment's ticks have their middle less than `counts` after the middle of
/// the first. Bounded by the ticks of a millisecond.
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

/// The rest of a segment after `taken` ticks; `None` if no tick is left.
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
mod lead_tests;
#[cfg(test)]
mod tests;
