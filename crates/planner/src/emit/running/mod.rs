//! The running move: its place, its profile, and its next segment.

mod parts;
mod plan;

use crate::config::SLOWEST;
use crate::emit::fit::{smoothing, steps, Carry, Linear};
use crate::emit::pixel::Pixel;
use crate::moves::{MovePower, PlannedMove};
use crate::planner::Outlook;
use crate::real::{max, min, sqrt};
use crate::space::course::Whereabouts;
use crate::speed::profile::{Place, Plan};
use crate::{Config, Profile, Trapezoid};
use core::num::NonZeroU16;
use fixed::types::U1F31;
use leadscrew_stepper::{
    Early, Interval, IntervalChange, Line, LineStart, MotorMask, OutputChange, Power, PowerChange,
    Segment, Smoothing,
};
use parts::Parts;

/// Timer and smoothing, from the configuration.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Timing {
    /// Counts in a second.
    pub(crate) hz: f32,
    /// The shortest interval of ticks that smoothing may make, seconds.
    pub(crate) shortest_tick: f32,
    /// The longest segment, seconds.
    pub(crate) longest_segment: f32,
}

impl Timing {
    pub(crate) fn new<const AXES: usize>(config: &Config<AXES>) -> Self {
        let hz = config.timer_hz as f32;
        Self {
            hz,
            shortest_tick: config.shortest_tick.0 as f32 / hz,
            longest_segment: config.longest_segment,
        }
    }
}

/// The next task of the running move.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Aim {
    pub(crate) goal: Goal,
    /// Steps of the dominant motor from the end of the part that runs to the move's end.
    pub(crate) steps_after: u32,
    /// Squared speed at which the part may end so that all later limits can be kept, mm²/s².
    pub(crate) exit_v2: f32,
    /// Limit of the corner at the part's end alone, squared, mm²/s².
    pub(crate) corner_v2: f32,
    /// Speed to cruise at, mm/s.
    pub(crate) nominal: f32,
    /// Accelerations along the path, mm/s²: where the speed rises, where it falls, and for a stop
    /// that begins at once.
    pub(crate) up: f32,
    pub(crate) down: f32,
    pub(crate) stop: f32,
    /// Limit of the jerk along the path, mm/s³; 0 for none.
    pub(crate) jerk: f32,
}

/// How far to go.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Goal {
    /// To the end of the move.
    End,
    /// To rest as soon as possible. Where the move is too short for that, the stop goes on in the
    /// next move.
    Stop,
}

/// A planned move that is being executed.
#[derive(Clone, Debug)]
pub(crate) struct Running<const MOTORS: usize> {
    line: Line<MOTORS>,
    /// Whether the stepper has yet to be told of `line`.
    announce: bool,
    /// Whether a motor steps less often than the dominant one: only then is smoothing of use.
    smooth: bool,
    /// How early motors are at the end of the segments handed out: half a tick of this smoothing.
    /// Later segments may have that smoothing. `None` where motors are not early at all.
    early: Option<Smoothing>,
    /// Whole steps of the dominant motor handed out.
    done: u32,
    /// The share of the next step event that was handed out, 0 to 1. It is 0 unless that event
    /// takes so long that it is handed out in spans.
    way: f32,
    /// The motors that have already been advanced by that step event.
    made: MotorMask,
    /// The value of `done` at the start of `line`: 0 until the line is begun anew.
    line_start: u32,
    /// Steps of the dominant motor in the whole move.
    events: u32,
    profile: Profile,
    /// Speed at the end of the segments handed out, steps/s.
    speed: f32,
    /// The span that is being handed out in parts.
    parts: Option<Parts<MOTORS>>,
    /// Interval of the cruise, 2⁻³² counts.
    cruise_interval: u64,
    /// Steps of the dominant motor per mm of path.
    steps_per_mm: f32,
    /// Acceleration along the path where the path is straight, steps/s².
    acceleration: f32,
    /// 1 / programmed feed, s/step.
    per_feed: f32,
    power: MovePower,
    /// Outputs that change with the first segment, until that is handed out.
    outputs: OutputChange,
    pub(crate) line_number: Option<u32>,
    /// How many changes of power the pool still holds for this move.
    pixels: u16,
    /// The next change of power, and the step at which it comes.
    next_pixel: Option<(u32, Pixel)>,
    /// The outlook that the profile was made from.
    pub(crate) outlook: Option<Outlook>,
}

/// A [`Segment`] without its line, its outputs and its power at rest: the next steps, or a part of
/// one step event. A segment is long, and each copy of one takes 200 cycles.
#[derive(Clone, Copy, Debug)]
struct Piece {
    ticks: NonZeroU16,
    smoothing: Smoothing,
    motors: MotorMask,
    ends_event: bool,
    early: Early,
    interval: Interval,
    interval_change: IntervalChange,
    power: Power,
    power_change: PowerChange,
}

impl<const MOTORS: usize> Running<MOTORS> {
    /// Begins `planned` at the squared speed `entry_v2` (mm²/s²); `None` where it has no steps
    /// (never queued).
    pub(crate) fn new<const AXES: usize>(
        planned: &PlannedMove<AXES, MOTORS>,
        entry_v2: f32,
    ) -> Option<Self> {
        let line = Line::new(planned.delta).ok()?;
        let events = line.step_events().get();
        let steps_per_mm = events as f32 / planned.length;
        let entry_v2 = entry_v2 * steps_per_mm * steps_per_mm;
        let acceleration = planned.acceleration * steps_per_mm;
        let profile = Profile::Trapezoid(Trapezoid::new(&Plan {
            start: Place::at(0),
            end: events,
            entry_v2,
            cruise: planned.rate * steps_per_mm,
            exit_v2: 0.0,
            up: acceleration,
            down: acceleration,
        }));
        Some(Self {
            line,
            announce: true,
            smooth: line
                .steps()
                .iter()
                .any(|steps| *steps != 0 && *steps != events),
            early: None,
            done: 0,
            way: 0.0,
            made: MotorMask::NONE,
            line_start: 0,
            events,
            profile,
            speed: sqrt(entry_v2),
            parts: None,
            cruise_interval: 0,
            steps_per_mm,
            acceleration,
            per_feed: 1.0 / (max(planned.feed, SLOWEST) * steps_per_mm),
            power: planned.power,
            outputs: planned.outputs,
            line_number: planned.line_number(),
            pixels: planned.pixels,
            next_pixel: None,
            outlook: None,
        })
    }

    /// If the next pixel begins here, takes its power and asks `next` for the pixel after it.
    pub(crate) fn begin_pixel(&mut self, mut next: impl FnMut() -> Option<Pixel>) {
        if let Some((_, pixel)) = self.next_pixel.take_if(|(at, _)| *at <= self.done) {
            self.power = self.power.with(pixel.power);
            self.line_number = pixel.line_number;
        }
        if self.next_pixel.is_none() && self.pixels > 0 {
            self.pixels -= 1;
            self.next_pixel = next().map(|pixel| (self.done + pixel.after, pixel));
        }
    }

    /// Speed along the path at the end of the segments handed out, mm/s.
    pub(crate) fn speed(&self) -> f32 {
        self.speed / self.steps_per_mm
    }

    /// Seconds of the rest of the profile, the speed at its end, mm/s, and the steps of the move
    /// after it.
    pub(crate) fn rest(&self) -> (f32, f32, u32) {
        let steps = self.here().before(self.profile.end());
        let (entry, elapsed) = self
            .parts
            .as_ref()
            .map_or((self.speed, 0.0), |parts| (parts.entry, parts.elapsed));
        let (seconds, _) = self.profile.time_over(self.here(), entry, steps);
        let steps_after = self.events - self.profile.end();
        (seconds - elapsed, sqrt(self.exit_v2()), steps_after)
    }

    /// Speed and remaining length, for the planner.
    pub(crate) fn whereabouts(&self) -> Whereabouts {
        Whereabouts {
            v2: self.profile.speed_v2(self.here()) / (self.steps_per_mm * self.steps_per_mm),
            steps: self.events - self.done,
            way: self.way,
            at_start: self.done == 0 && self.way <= 0.0,
        }
    }

    pub(crate) const fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The end of the segments handed out. Parts of a span that is not finished do not count.
    pub(crate) const fn here(&self) -> Place {
        Place {
            step: self.done,
            part: self.way,
        }
    }

    /// Whether the profile may be made anew: not while a span is handed out in part.
    pub(crate) const fn may_change(&self) -> bool {
        self.parts.is_none()
    }

    /// Whether no step event is handed out in part.
    pub(crate) fn at_step(&self) -> bool {
        self.parts.is_none() && self.way <= 0.0
    }

    /// Whether all steps of the profile have been handed out.
    pub(crate) fn at_profile_end(&self) -> bool {
        self.done >= self.profile.end()
    }

    /// Whether the next segment belongs to the profile's last step.
    fn is_in_last_step(&self) -> bool {
        self.done + 1 >= self.profile.end()
    }

    /// Whether all steps of the move have been handed out.
    pub(crate) fn at_end(&self) -> bool {
        self.done >= self.events
    }

    /// Squared speed at the profile's end, mm²/s².
    pub(crate) fn exit_v2(&self) -> f32 {
        self.profile.exit_v2() / (self.steps_per_mm * self.steps_per_mm)
    }

    /// Makes the stepper begin the line anew at `done`, after another line came between.
    pub(crate) fn renew_line(&mut self) {
        if let Some(rest) = self.line.rest(self.done - self.line_start, self.early()) {
            self.line = rest;
            self.line_start = self.done;
            self.announce = true;
        }
    }

    /// The next `events` steps at constant speed. Their intervals are even, and known to more than
    /// 24 bits so that no drift adds up.
    fn cruise_piece(&mut self, events: u32, timing: Timing, carry: &mut Carry) -> Piece {
        let seconds = 1.0 / self.speed;
        self.done += events;
        let steady = self.acceleration * seconds * seconds * seconds < 16.0 * SURPRISE;
        let smoothing = self.smoothing(seconds, timing, if steady { 1.0 } else { NEARLY_EVEN });
        let ticks = ticks(events, smoothing);
        let (interval, interval_change) =
            carry.round_cruise(self.cruise_interval, smoothing.level(), ticks);
        let (power, power_change) = self.power_at(self.speed, self.speed, ticks);
        Piece {
            ticks,
            smoothing,
            motors: MotorMask::ALL,
            ends_event: true,
            early: self.early(),
            interval,
            interval_change,
            power,
            power_change,
        }
    }

    /// The next `events` steps on a ramp, or over the end of one.
    fn ramp_piece(&mut self, events: u32, timing: Timing, carry: &mut Carry) -> Piece {
        let (from, all) = (Place::at(self.done), events as f32);
        let half = if events > 1 { (events / 2) as f32 } else { 0.5 };
        let (first, middle_speed) = self.profile.time_over(from, self.speed, half);
        let (seconds, speed) = if events > 1 {
            let (second, speed) =
                self.profile
                    .time_over(Place::at(self.done + events / 2), middle_speed, all - half);
            (first + second, speed)
        } else {
            self.profile.time_over(from, self.speed, all)
        };
        let first = if events > 1 {
            first
        } else {
            within_a_step(first, seconds)
        };
        let evenness = min(self.speed, speed) * seconds / all;
        self.speed = speed;
        self.done += events;
        let smoothing = self.smoothing(seconds / all, timing, evenness);
        let ticks = ticks(events, smoothing);
        let count = f32::from(ticks.get());
        let duration = seconds * timing.hz;
        let linear = if ticks.get() > 1 {
            Linear::through(first * timing.hz, half * count / all, duration, count)
        } else {
            Linear::even(duration, count)
        };
        let (interval, interval_change) = carry.round(linear, ticks, duration);
        let (power, power_change) = if events > 1 {
            let per_tick = all / count * timing.hz;
            self.power_at(
                per_tick / linear.first,
                per_tick / linear.last(count),
                ticks,
            )
        } else {
            self.power_at(1.0 / seconds, 1.0 / seconds, ticks)
        };
        Piece {
            ticks,
            smoothing,
            motors: MotorMask::ALL,
            ends_event: true,
            early: self.early(),
            interval,
            interval_change,
            power,
            power_change,
        }
    }

    /// The smoothing of the next segment. If it is coarser than the segment before, it begins one
    /// segment late: in that segment the motors become as early as the coarser smoothing needs.
    fn smoothing(&mut self, interval: f32, timing: Timing, evenness: f32) -> Smoothing {
        let wanted = self.wanted(interval, timing, evenness);
        match self.early.replace(wanted) {
            Some(prepared) if !self.announce => prepared.max(wanted),
            Some(_) | None => wanted,
        }
    }

    /// The earliness of motors at the end of the segments handed out.
    fn early(&self) -> Early {
        self.early.map_or(Early::NOT, Early::half_a_tick)
    }

    /// The least smoothing that keeps the steps of other motors near enough to the line (see
    /// `fit`).
    fn wanted(&self, interval: f32, timing: Timing, evenness: f32) -> Smoothing {
        if self.smooth {
            smoothing(interval, timing.shortest_tick, evenness)
        } else {
            Smoothing::None
        }
    }

    /// The power of the first tick and its change from tick to tick, from the speeds (steps/s) in
    /// the first and the last tick.
    fn power_at(&self, first: f32, last: f32, ticks: NonZeroU16) -> (Power, PowerChange) {
        match self.power {
            MovePower::Off => (Power::OFF, PowerChange::ZERO),
            MovePower::Spindle { power } | MovePower::Constant { power } => {
                (power, PowerChange::ZERO)
            }
            MovePower::Dynamic { power } => {
                let full = power.share().to_bits() as f32 * self.per_feed;
                let (first, last) = (share(full * first), share(full * last));
                let changes = i32::from(ticks.get() - 1).max(1);
                let change = (last as i32 - first as i32) / changes;
                (
                    Power::from_share(U1F31::from_bits(first)),
                    PowerChange::from_bits(change),
                )
            }
        }
    }

    /// Hands out the next segment. `held`: a hold slows down. The last step before the rest of a
    /// hold takes long. In that step a laser's constant power follows the speed, so that the step
    /// gets as much energy as at the programmed feed.
    pub(crate) fn segment(
        &mut self,
        timing: Timing,
        carry: &mut Carry,
        held: bool,
    ) -> Segment<MOTORS> {
        let power = self.power;
        if held && self.is_in_last_step() && self.profile.exit_v2() <= 0.0 {
            self.power = power.with_speed();
        }
        let piece = self.piece(timing, carry);
        self.power = power;
        let announce = core::mem::take(&mut self.announce);
        let rests = self.at_profile_end() && self.profile.exit_v2() <= 0.0;
        Segment {
            line: announce.then(|| LineStart::new(self.line, piece.early)),
            ticks: piece.ticks,
            smoothing: piece.smoothing,
            motors: piece.motors,
            ends_event: piece.ends_event,
            early: piece.early,
            interval: piece.interval,
            interval_change: piece.interval_change,
            power: piece.power,
            power_change: piece.power_change,
            outputs: core::mem::take(&mut self.outputs),
            at_rest: rests.then(|| match held {
                true => self.power.held(),
                false => self.power.at_rest(),
            }),
        }
    }

    fn piece(&mut self, timing: Timing, carry: &mut Carry) -> Piece {
        if self.is_for_parts(timing) {
            if let Some(parts) = self.parts.or_else(|| self.first_part(timing)) {
                return self.part(parts, timing, carry);
            }
        }
        let stretch = self.profile.stretch(self.done);
        let pixel = self.next_pixel.map_or(u32::MAX, |(at, _)| at - self.done);
        let events = steps(self.speed, stretch.acceleration, timing.longest_segment)
            .min(stretch.steps)
            .min(pixel)
            .clamp(1, MOST_EVENTS);
        if stretch.acceleration == 0.0 && stretch.steps > 0 {
            self.cruise_piece(events, timing, carry)
        } else {
            self.ramp_piece(events, timing, carry)
        }
    }
}

/// The most step events of a segment: with sixteenfold smoothing their ticks fit 16 bits. (A
/// millisecond at 300 kHz has 300 step events.)
const MOST_EVENTS: u32 = 4000;

/// After a step that takes `T` an override may make the next step shorter by `a·T³`. A motor that
/// is early by a sixteenth of the first step may then be too early by a sixteenth of that
/// difference: at most this time, seconds. Otherwise the ticks of a cruise are as fine as on a
/// ramp.
const SURPRISE: f32 = 0.2e-6;

/// The evenness to use for a cruise whose ticks have to be as fine as on a ramp: anything below 1.
const NEARLY_EVEN: f32 = 0.99;

/// Full power in units of [`Power`].
const FULL: u32 = 1 << 31;

/// The time of the first half of a step, limited so that a linear interval can follow it. The whole
/// step takes `seconds`. Under constant acceleration out of rest the first half takes √½ of them.
/// Under a jerk limit it takes more, and the last interval of the step would be negative.
fn within_a_step(half: f32, seconds: f32) -> f32 {
    const MOST: f32 = 0.7075;
    min(max(half, (1.0 - MOST) * seconds), MOST * seconds)
}

/// The bits of a power, at most full power.
fn share(bits: f32) -> u32 {
    (bits as u32).min(FULL - 1)
}

fn ticks(events: u32, smoothing: Smoothing) -> NonZeroU16 {
    NonZeroU16::new((events << smoothing.level()) as u16).unwrap_or(NonZeroU16::MIN)
}
