//! The next piece of the running move: as many whole steps as a segment may have, or a part of one
//! step (see [`Parts`]).

use super::{Progress, Running, Timing};
use crate::emit::fit::{bits, steps, Carry, Linear};
use crate::real::{max, min};
use crate::speed::plan::Place;
use core::num::NonZeroU16;
use leadscrew_stepper::{Early, Interval, IntervalChange, MotorMask, Smoothing};

/// The most step events of a segment: with sixteenfold smoothing their ticks fit 16 bits. (A
/// millisecond at 300 kHz has 300 step events.)
const MOST_EVENTS: u32 = 4000;

/// By how much a motor may be too early after an override in a cruise, seconds.
///
/// After a step that takes `T` an override may make the next step shorter by `a·T³`. A motor that
/// is early by a sixteenth of the first step is then too early by a sixteenth of this difference.
/// Where that is more than this bound, the ticks of a cruise are as fine as on a ramp.
const SURPRISE: f32 = 0.2e-6;

/// The evenness to use for a cruise whose ticks have to be as fine as on a ramp: anything below 1.
const NEARLY_EVEN: f32 = 0.99;

/// The ticks of a segment, which are whole steps or a part of one, and the speeds that give its
/// power. It is not a whole `Segment`, because each copy of a `Segment` takes 200 cycles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) ticks: NonZeroU16,
    pub(super) smoothing: Smoothing,
    pub(super) motors: MotorMask,
    pub(super) ends_event: bool,
    pub(super) early: Early,
    pub(super) interval: Interval,
    pub(super) interval_change: IntervalChange,
    /// Speeds in the segment's first and last tick, steps/s.
    pub(super) speeds: [f32; 2],
}

/// Some steps on a ramp, in two halves.
struct Ramp {
    /// Steps in the first half; 0.5 if there is a single step.
    half: f32,
    /// Time of the first half, and of all steps, seconds.
    first: f32,
    seconds: f32,
    /// Speed at the end, steps/s.
    exit: f32,
}

impl<const MOTORS: usize> Running<MOTORS> {
    /// The next piece: a part of a step event, or as many whole step events as a segment may have.
    pub(super) fn piece(&mut self, timing: Timing, carry: &mut Carry) -> Piece {
        if self.is_for_parts(timing) {
            if let Some(parts) = self.progress.parts.or_else(|| self.first_part(timing)) {
                return self.part(parts, timing, carry);
            }
        }
        let done = self.progress.done;
        let stretch = self.profile.stretch(done);
        let events = steps(self.speed, stretch.acceleration, timing.longest_segment)
            .min(stretch.steps)
            .min(self.along.to_next_pixel(done))
            .clamp(1, MOST_EVENTS);
        if stretch.acceleration == 0.0 && stretch.steps > 0 {
            self.cruise_piece(events, timing, carry)
        } else {
            self.ramp_piece(events, timing, carry)
        }
    }

    /// The next `events` steps at constant speed. Their intervals are even, and known to more than
    /// 24 bits so that no drift adds up.
    fn cruise_piece(&mut self, events: u32, timing: Timing, carry: &mut Carry) -> Piece {
        let seconds = 1.0 / self.speed;
        self.progress.done += events;
        let steady = self.acceleration * seconds * seconds * seconds < 16.0 * SURPRISE;
        let evenness = if steady { 1.0 } else { NEARLY_EVEN };
        let smoothing = self.tracer.smoothing(seconds, timing, evenness);
        let ticks = ticks(events, smoothing);
        let (interval, interval_change) =
            carry.round_cruise(self.cruise_interval, smoothing.level(), ticks);
        Piece {
            ticks,
            smoothing,
            motors: MotorMask::ALL,
            ends_event: true,
            early: self.tracer.early(),
            interval,
            interval_change,
            speeds: [self.speed; 2],
        }
    }

    /// The next `events` steps on a ramp, or over the end of one.
    fn ramp_piece(&mut self, events: u32, timing: Timing, carry: &mut Carry) -> Piece {
        let all = events as f32;
        let ramp = self.ramp(events);
        let evenness = min(self.speed, ramp.exit) * ramp.seconds / all;
        self.speed = ramp.exit;
        self.progress.done += events;
        let smoothing = self.tracer.smoothing(ramp.seconds / all, timing, evenness);
        let ticks = ticks(events, smoothing);
        let count = f32::from(ticks.get());
        let duration = ramp.seconds * timing.hz;
        let linear = if ticks.get() > 1 {
            let middle = ramp.half * count / all;
            Linear::through(ramp.first * timing.hz, middle, duration, count)
        } else {
            Linear::even(duration, count)
        };
        let (interval, interval_change) = carry.round(linear, ticks, duration);
        let speeds = if events > 1 {
            let per_tick = all / count * timing.hz;
            [per_tick / linear.first, per_tick / linear.last(count)]
        } else {
            [1.0 / ramp.seconds; 2]
        };
        Piece {
            ticks,
            smoothing,
            motors: MotorMask::ALL,
            ends_event: true,
            early: self.tracer.early(),
            interval,
            interval_change,
            speeds,
        }
    }

    /// The next `events` steps of the profile.
    fn ramp(&self, events: u32) -> Ramp {
        let (done, all) = (self.progress.done, events as f32);
        let half = if events > 1 { (events / 2) as f32 } else { 0.5 };
        let over = |from, speed, steps| self.profile.time_over(Place::at(from), speed, steps);
        let (first, middle_speed) = over(done, self.speed, half);
        if events > 1 {
            let (second, exit) = over(done + events / 2, middle_speed, all - half);
            Ramp {
                half,
                first,
                seconds: first + second,
                exit,
            }
        } else {
            let (seconds, exit) = over(done, self.speed, all);
            Ramp {
                half,
                first: within_a_step(first, seconds),
                seconds,
                exit,
            }
        }
    }
}

/// The time of the first half of a step, limited so that a linear interval can follow it. The whole
/// step takes `seconds`. Under constant acceleration out of rest the first half takes √½ of them.
/// Under a jerk limit it takes more, and the last interval of the step would be negative.
fn within_a_step(half: f32, seconds: f32) -> f32 {
    const MOST: f32 = 0.7075;
    min(max(half, (1.0 - MOST) * seconds), MOST * seconds)
}

/// The ticks of so many step events.
fn ticks(events: u32, smoothing: Smoothing) -> NonZeroU16 {
    NonZeroU16::new((events << smoothing.level()) as u16).unwrap_or(NonZeroU16::MIN)
}

/// A step event is handed out in parts if the squared speed (steps²/s²) is less than this many
/// times the acceleration (steps/s²). At that limit the last 32nd of a step that brakes (half of
/// one of its sixteen ticks) takes a 27th of the step's time. Out of rest the first 32nd of a step
/// takes a sixth of the step's time.
const SUDDEN: f32 = 4.0;

/// The least evenness (see `fit::smoothing`) of the first step after the steps in parts. In that
/// step the speed changes by less than a sixth. It changes by up to a fourth if an override makes
/// motion accelerate where it braked before, or brake where it accelerated.
const SETTLED: f32 = 0.75;

/// A step that is not sudden takes at most this many times as long as at its first speed: `2/(1 +
/// √½)`.
const LONGER: f32 = 1.18;

/// A step event is handed out in parts only if it takes at least as long as this many of the
/// shortest ticks. So a motor that steps with the next tick is off by a sixteenth of the step at
/// most.
const ROOM: f32 = 16.0;

/// The shortest span, steps. If a step takes more than 1000 s, this span takes longer than a
/// segment may, and is handed out nevertheless.
const LEAST_WAY: f32 = 1.0 / (1 << 20) as f32;

/// The most corrections of the length of a span, see [`Running::cut`].
const CORRECTIONS: u32 = 24;

/// A span takes at most this share of the rest of a step event, or all of the rest.
const MOST_OF_IT: f32 = 0.75;

/// A span of a step event that is being handed out in parts.
///
/// In a step event that is handed out in parts, each motor steps when it is due, and the profile
/// may change within the event.
///
/// At low speeds one step takes much longer or shorter than the next. Out of rest the first quarter
/// of a step takes half of its time. A hold or an override may change the speed of the next step.
/// Ticks whose interval changes linearly cannot follow that, and a motor that is half a tick early
/// may be early by a large part of a step's time. But in one step event each motor steps at most
/// once. So the profile itself tells when each motor is due, and the step event is cut at these
/// times into parts of one tick each:
///
/// ```text
///                      Y       Z              X, the dominant motor
///   |------------------|-------|--------------|
///     part of Y alone   of Z    of all others
/// ```
///
/// In its part each motor is advanced by the whole step event at once.
///
/// Ticks cannot be closer than [`Timing::shortest_tick`]. A step that is due sooner after a tick
/// comes a little late, or with the next tick.
///
/// A segment that was handed out cannot be changed. So a step event that takes longer than a
/// segment may is handed out in *spans*, each of them in parts. Between two spans no motor steps,
/// and the profile may be made anew, as between steps:
///
/// ```text
///              Y                           X
///   |..........|......|................|...|      spans of a millisecond at most
/// ```
#[derive(Clone, Copy, Debug)]
pub(super) struct Parts<const MOTORS: usize> {
    /// When each motor is due, seconds from the span's start. A motor that is not due within this
    /// span has `seconds` or more.
    due: [f32; MOTORS],
    /// The motors that are still to be advanced in this span.
    left: MotorMask,
    /// The span's end, as a share of the step event, up to 1.
    to: f32,
    /// Speeds at the span's start, at its end and in the mean, steps/s.
    pub(super) entry: f32,
    exit: f32,
    mean: f32,
    /// Time of the span, and of its parts handed out so far, seconds.
    seconds: f32,
    pub(super) elapsed: f32,
    /// How early motors are to be at the span's end, as in [`Tracer`](super::tracer::Tracer).
    early: Option<Smoothing>,
}

/// A piece of a step event: its end, as a share of the step event; its duration, seconds; the speed
/// at its end, steps/s.
#[derive(Clone, Copy)]
struct Span {
    to: f32,
    seconds: f32,
    exit: f32,
}

impl<const MOTORS: usize> Running<MOTORS> {
    /// Whether a part is next, or a step event that may have to be handed out in parts.
    ///
    /// The step event after such step events is handed out in parts, too. At its end motors are as
    /// early as the following ticks need them to be.
    fn is_for_parts(&self, timing: Timing) -> bool {
        let (begun, after_parts) = (!self.progress.at_step(), self.tracer.lacks_early());
        begun || after_parts || self.is_sudden() || self.is_slow(timing)
    }

    /// Whether one step takes much longer than the next, or may do so (see [`SUDDEN`]).
    fn is_sudden(&self) -> bool {
        self.speed * self.speed < SUDDEN * self.acceleration
    }

    /// Whether the next step takes, or may take, longer than a segment.
    fn is_slow(&self, timing: Timing) -> bool {
        self.speed * timing.longest_segment < LONGER
    }

    /// Begins to hand out in parts the rest of the next step event, or a span of it. `None` where
    /// that rest takes no longer than a segment may and no motor needs parts, or ticks would be too
    /// close.
    fn first_part(&self, timing: Timing) -> Option<Parts<MOTORS>> {
        let (rest, way) = (self.span(1.0), self.progress.way);
        let room = ROOM * timing.shortest_tick;
        let longest = max(timing.longest_segment, 2.0 * timing.shortest_tick);
        let span = if rest.seconds > longest {
            self.cut(rest, longest)
        } else if way > 0.0 || self.tracer.is_smooth() && rest.seconds >= room {
            rest
        } else {
            return None;
        };
        let (due, left) = self.due(&span);
        let whole = rest.seconds / (1.0 - way);
        Some(Parts {
            due,
            left,
            to: span.to,
            entry: self.speed,
            exit: span.exit,
            mean: (span.to - way) / span.seconds,
            seconds: span.seconds,
            elapsed: 0.0,
            early: if span.to < 1.0 || self.is_sudden() || self.is_slow(timing) {
                None
            } else {
                Some(self.tracer.wanted(whole, timing, SETTLED))
            },
        })
    }

    /// The piece of the next step event from the end of the segments handed out up to `to`.
    fn span(&self, to: f32) -> Span {
        let here = self.progress.here();
        let (seconds, exit) = self.profile.time_over(here, self.speed, to - here.part);
        Span { to, seconds, exit }
    }

    /// A piece of `rest` that takes no longer than `longest`, and at least half of `longest` if
    /// such a piece can be found.
    ///
    /// `rest` is divided into as many pieces as needed, each of the same time. The length of a
    /// piece is found as under constant acceleration, which it mostly is. Where a ramp ends, or
    /// under a jerk limit, the length is corrected. A piece that is too short in time is made
    /// longer in proportion, which is never too much where the speed grows. A piece that takes too
    /// long is made shorter by the cube of the ratio, as out of rest with limited jerk.
    fn cut(&self, rest: Span, longest: f32) -> Span {
        let (v0, v1, left) = (self.speed, rest.exit, 1.0 - self.progress.way);
        let pieces = (rest.seconds / longest) as u32 + 1;
        let wanted = rest.seconds / pieces as f32;
        let gained = 0.25 * (v1 * v1 - v0 * v0) / left * wanted;
        let (mut way, mut span, mut shortened) = ((v0 + gained) * wanted, rest, false);
        for _ in 0..CORRECTIONS {
            way = max(min(way, MOST_OF_IT * left), LEAST_WAY);
            span = self.span(self.progress.way + way);
            let ratio = wanted / span.seconds;
            if span.seconds > longest {
                way *= max(ratio * ratio * ratio, 0.1);
                shortened = true;
            } else if !shortened && 2.0 * span.seconds < longest && way < MOST_OF_IT * left {
                way *= ratio;
            } else {
                break;
            }
        }
        span
    }

    /// Hands out the next part.
    fn part(&mut self, parts: Parts<MOTORS>, timing: Timing, carry: &mut Carry) -> Piece {
        let next = parts.next(timing.shortest_tick);
        let (motors, end) = next.unwrap_or((parts.left, parts.seconds));
        // With differences of rounded times, the times of the parts add up to the time of the span
        // exactly.
        let counts = bits(end * timing.hz).saturating_sub(bits(parts.elapsed * timing.hz));
        let interval = carry.settle(counts, 0, NonZeroU16::MIN, counts).0;
        self.progress.made = self.progress.made.with(motors);
        if next.is_some() {
            self.speed = parts.mean;
            self.tracer.set_early(None);
            self.progress.parts = Some(Parts {
                left: parts.left.without(motors),
                elapsed: end,
                ..parts
            });
        } else {
            self.speed = parts.exit;
            self.tracer.set_early(parts.early);
            self.progress.end_span(parts.to);
        }
        Piece {
            ticks: NonZeroU16::MIN,
            smoothing: Smoothing::None,
            motors,
            ends_event: self.progress.at_step(),
            early: self.tracer.early().of_a_part(),
            interval,
            interval_change: IntervalChange::ZERO,
            speeds: [parts.mean; 2],
        }
    }

    /// When each motor is due in `span` (seconds from its start), and the motors that are advanced
    /// in it. In the last span of a step event these are all motors that were not advanced yet.
    fn due(&self, span: &Span) -> ([f32; MOTORS], MotorMask) {
        let Progress {
            done, way, made, ..
        } = self.progress;
        let (mut due, mut left) = ([span.seconds; MOTORS], MotorMask::NONE);
        for (motor, (due, share)) in due.iter_mut().zip(self.tracer.due(done)).enumerate() {
            if share < span.to && !made.contains(motor) {
                *due = self.span(max(share, way)).seconds;
                left = left.with(MotorMask::only(motor));
            }
        }
        if span.to < 1.0 {
            (due, left)
        } else {
            (due, MotorMask::ALL.without(made))
        }
    }
}

impl<const MOTORS: usize> Parts<MOTORS> {
    /// The motors that are due next, and when, seconds from the span's start. `None` where all that
    /// are left step at the span's end.
    fn next(&self, shortest: f32) -> Option<(MotorMask, f32)> {
        let left = || {
            let motors = self.due.iter().enumerate();
            motors.filter(|(motor, _)| self.left.contains(*motor))
        };
        let first = left().fold(self.seconds, |first, (_, due)| min(first, *due));
        let at = max(first, self.elapsed + shortest);
        let soon = left().filter(|(_, due)| **due < at + shortest);
        let motors = soon.fold(MotorMask::NONE, |motors, (motor, _)| {
            motors.with(MotorMask::only(motor))
        });
        (at + shortest <= self.seconds).then_some((motors, at))
    }
}
