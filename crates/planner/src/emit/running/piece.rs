//! The next piece of the running move: as many whole steps as a segment may have, or a part of one
//! step (see [`Part`]).

use super::{Running, Timing};
use crate::emit::fit::{steps, Carry, Linear};
use crate::real::{max, min};
use crate::speed::plan::Place;
use crate::Profile;
use core::num::NonZeroU16;
use leadscrew_stepper::{Early, Interval, IntervalChange, MotorMask, Smoothing};

/// The most step events of a segment: with sixteenfold smoothing their ticks fit 16 bits. (A
/// millisecond at 300 kHz has 300 step events.)
const MOST_EVENTS: u32 = 4000;

/// The longest cruise in one segment if nobody waits for its end, seconds.
const LONGEST_CRUISE: f32 = 0.05;

/// The amount by which a motor may be too early after an override in a cruise, seconds.
///
/// After a step that takes `T` an override may make the next step shorter by `a·T³`. A motor that
/// is early by a sixteenth of the first step is then too early by a sixteenth of this difference.
/// If that is more than this bound, the ticks of a cruise are as fine as on a ramp.
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
    /// With `LONG` a cruise may take [`LONGEST_CRUISE`].
    pub(super) fn piece<const LONG: bool>(&mut self, timing: Timing, carry: &mut Carry) -> Piece {
        if self.is_for_parts(timing) || self.profile.is_open(self.drive.here) {
            if let Some(part) = self.part(timing, carry) {
                return part;
            }
        }
        let done = self.drive.here.step();
        let stretch = self.profile.stretch(done);
        let most = stretch.steps.min(self.along.to_next_pixel(done));
        let events = steps(self.speed, stretch.acceleration, timing.longest_segment)
            .min(most)
            .clamp(1, MOST_EVENTS);
        if stretch.acceleration == 0.0 && stretch.steps > 0 {
            let whole = if LONG {
                self.whole_pieces(most / events, events)
            } else {
                1
            };
            self.cruise_piece([events, whole], timing, carry)
        } else {
            self.ramp_piece(events, timing, carry)
        }
    }

    /// How many pieces of a cruise, `events` steps each, are one piece of [`LONGEST_CRUISE`] at most;
    /// `all` are left.
    fn whole_pieces(&self, all: u32, events: u32) -> u32 {
        let most = (self.speed * LONGEST_CRUISE) as u32;
        all.min(most.min(MOST_EVENTS) / events).max(1)
    }

    /// The next `events` steps at constant speed. Their intervals are even, and known to more than
    /// 24 bits so that no drift adds up. Becomes up to `whole` such pieces if each takes the same time
    /// to the last bit: if there is no error to make up for.
    fn cruise_piece(
        &mut self,
        [events, whole]: [u32; 2],
        timing: Timing,
        carry: &mut Carry,
    ) -> Piece {
        let seconds = 1.0 / self.speed;
        let steady = self.drive.acceleration * seconds * seconds * seconds < 16.0 * SURPRISE;
        let evenness = if steady { 1.0 } else { NEARLY_EVEN };
        let smoothing = self.tracer.smoothing(seconds, timing, evenness);
        let is_even = whole > 1 && carry.is_below(ticks(events, smoothing));
        let events = if is_even { events * whole } else { events };
        self.drive.here = Place::at(self.drive.here.step() + events);
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
        self.pass(Place::at(self.drive.here.step() + events), ramp.seconds);
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
        let (done, all) = (self.drive.here.step(), events as f32);
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
/// motion accelerate if it braked before, or brake if it accelerated.
const SETTLED: f32 = 0.75;

/// A step that is not sudden takes at most this many times as long as at its first speed: `2/(1 +
/// √½)`.
const LONGER: f32 = 1.18;

/// A step event is handed out in parts only if it takes at least as long as this many of the
/// shortest ticks. So a motor that steps with the next tick is off by a sixteenth of the step at
/// most.
const ROOM: f32 = 16.0;

/// The shortest part, steps. If a step takes more than 10⁶ s, this part takes longer than a
/// segment may, and is handed out nevertheless.
const LEAST_WAY: f32 = 1.0 / (1 << 30) as f32;

/// The most corrections of the length of a part, see [`Running::cut`].
const CORRECTIONS: u32 = 24;

/// A part that is cut takes at most this share of the part before the cut.
const MOST_OF_IT: f32 = 0.75;

/// A part of a step event: the motors that are advanced in it, its end, its duration in seconds,
/// the speed at its end in steps/s.
///
/// In a step event that is handed out in parts, each motor steps when it is due, and the profile
/// may change after each part.
///
/// At low speeds one step takes much longer or shorter than the next. Out of rest the first quarter
/// of a step takes half of its time. A hold or an override may change the speed of the next step.
/// Ticks whose interval changes linearly cannot follow that, and a motor that is half a tick early
/// may be early by a large part of a step's time. But in one step event each motor steps at most
/// once. So the step event is cut when motors are due into parts of one tick each, and when a
/// part would take longer than a segment may:
///
/// ```text
///              Y               Z           X, the dominant motor
///   |..........|......|........|...........|      parts of a millisecond at most
/// ```
///
/// In the part that ends when it is due each motor is advanced by the whole step event at once.
///
/// Ticks cannot be closer than [`Timing::shortest_tick`]. A step that is due sooner after a tick
/// comes a little late, or with the tick before it. [`Carry`] makes the next tick come sooner.
#[derive(Clone, Copy)]
struct Part {
    motors: MotorMask,
    to: Place,
    seconds: f32,
    exit: f32,
}

impl<const MOTORS: usize> Running<MOTORS> {
    /// Returns true if a part is next, or a step event that may have to be handed out in parts: one
    /// that takes much longer than the next, or longer than a segment, or may do so after an
    /// override.
    fn is_for_parts(&self, timing: Timing) -> bool {
        let is_sudden = self.speed * self.speed < SUDDEN * self.drive.acceleration;
        !self.drive.here.is_whole() || is_sudden || self.speed * timing.longest_segment < LONGER
    }

    /// The next part of the step event. `None` if the event takes no longer than a segment may
    /// and no motor needs parts, or ticks would be too close.
    fn part(&mut self, timing: Timing, carry: &mut Carry) -> Option<Piece> {
        let (shortest, start) = (timing.shortest_tick, self.drive.here);
        let longest = max(timing.longest_segment, 2.0 * shortest);
        let end = Place::at(start.step() + 1);
        let rest = self.part_to(end);
        let has_room = self.tracer.is_smooth() && rest.seconds >= ROOM * shortest;
        if start.is_whole() && rest.seconds <= longest && !has_room {
            return None;
        }
        let earliest = carry.late() / timing.hz + shortest;
        let next = self.next_due(rest, earliest, shortest);
        let part = if next.seconds > longest {
            self.cut(next, longest)
        } else {
            next
        };
        let interval = carry.tick(part.seconds * timing.hz, shortest * timing.hz);
        self.speed = part.exit;
        self.pass(part.to, part.seconds);
        self.made = if part.to < end {
            self.made.with(part.motors)
        } else {
            MotorMask::NONE
        };
        // The following ticks need the motors early, unless they are parts.
        let wanted = || self.tracer.wanted(1.0 / self.speed, timing, SETTLED);
        let early = (!self.is_for_parts(timing)).then(wanted);
        self.tracer.set_early(early);
        Some(Piece {
            ticks: NonZeroU16::MIN,
            smoothing: Smoothing::None,
            motors: part.motors,
            ends_event: self.drive.here.is_whole(),
            early: self.tracer.early().of_a_part(),
            interval,
            interval_change: IntervalChange::ZERO,
            speeds: [part.to.after(start) / part.seconds; 2],
        })
    }

    /// The part from the end of the segments handed out up to `to`.
    #[inline(never)] // inlined, a record of four motors takes 156 bytes more
    fn part_to(&self, to: Place) -> Part {
        let way = to.after(self.drive.here);
        let (seconds, exit) = self.profile.time_over(self.drive.here, self.speed, way);
        Part {
            motors: MotorMask::NONE,
            to,
            seconds,
            exit,
        }
    }

    /// The part to the place at which the next motor is due in the step event, of which `rest` is
    /// left. No tick comes before `earliest`. Motors that are due less than `shortest` after a tick
    /// step with it. So the last part advances all motors that are left.
    fn next_due(&self, rest: Part, earliest: f32, shortest: f32) -> Part {
        let due = self.tracer.due(self.drive.here.step());
        let left = || {
            let places = due.iter().enumerate();
            places.filter(|(motor, at)| **at < rest.to && !self.made.contains(*motor))
        };
        let first = left().fold(rest.to, |first, (_, at)| first.min(*at));
        let first = self.part_to(first);
        let next = max(first.seconds, earliest) + shortest;
        if next > rest.seconds {
            let motors = MotorMask::ALL.without(self.made);
            return Part { motors, ..rest };
        }
        let soon = left().filter(|(_, at)| self.part_to(**at).seconds < next);
        let motors = soon.fold(MotorMask::NONE, |motors, (motor, _)| {
            motors.with(MotorMask::only(motor))
        });
        Part { motors, ..first }
    }

    /// `whole`, or a part of it that takes no longer than `longest`, and at least half of `longest`
    /// if such a part can be found.
    ///
    /// `whole` is divided into as many parts as needed, each of the same time. The length of a
    /// part is found as under constant acceleration, which it mostly is. If a ramp ends, the
    /// length is corrected. A part that is too short in time is made longer in proportion, which is
    /// never too much while the speed grows. A part that takes too long is made shorter by the cube
    /// of the ratio. Under a jerk limit a part ends where the known way ends.
    fn cut(&self, whole: Part, longest: f32) -> Part {
        if let Profile::Mean(mean) = &self.profile {
            let (to, seconds, exit) = mean.after(min(longest, MOST_OF_IT * whole.seconds));
            return Part {
                motors: MotorMask::NONE,
                to,
                seconds,
                exit,
            };
        }
        let (v0, v1, left) = (self.speed, whole.exit, whole.to.after(self.drive.here));
        let pieces = ((whole.seconds / longest) as u32).saturating_add(1);
        let wanted = whole.seconds / pieces as f32;
        let gained = 0.25 * (v1 * v1 - v0 * v0) / left * wanted;
        let (mut way, mut part, mut shortened) = ((v0 + gained) * wanted, whole, false);
        for _ in 0..CORRECTIONS {
            way = max(min(way, MOST_OF_IT * left), LEAST_WAY);
            part = self.part_to(self.drive.here.moved(way));
            let ratio = wanted / part.seconds;
            if part.seconds > longest {
                way *= max(ratio * ratio * ratio, 0.1);
                shortened = true;
            } else if !shortened && 2.0 * part.seconds < longest && way < MOST_OF_IT * left {
                way *= ratio;
            } else {
                break;
            }
        }
        if part.to < whole.to {
            part
        } else {
            whole
        }
    }
}
