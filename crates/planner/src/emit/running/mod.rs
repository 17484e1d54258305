//! The running move: its place, its profile, and its next segment.
//!
//! The profile leads to the end of the move or of a part of it (see
//! [`Course`](crate::space::axis_limits::Course)), or to the shortest stop.

pub(crate) mod drive;
mod piece;
mod tracer;

use crate::ease::Ease;
use crate::emit::fit::{bits, Carry};
use crate::emit::pixel::Pixel;
use crate::moves::PlannedMove;
use crate::real::{divide_twice, sqrt};
use crate::speed::mean::Piece;
use crate::speed::plan::Place;
use crate::{Config, Mean, Profile, Trapezoid};
use drive::{Drive, Goal};
use leadscrew_stepper::{Line, MotorMask, Segment, MAX_SMOOTHING_LEVEL};
use tracer::{Along, Tracer};

/// A planned move that is being executed.
#[derive(Clone, Debug)]
pub(crate) struct Running<const MOTORS: usize> {
    /// The end of the segments handed out.
    pub(crate) drive: Drive,
    /// The speeds from there on.
    pub(crate) profile: Profile,
    /// The motors that have already been advanced in the step event under way.
    made: MotorMask,
    tracer: Tracer<MOTORS>,
    /// Speed at the end of the segments handed out, steps/s.
    speed: f32,
    /// Interval of the profile's cruise, 2⁻³² counts.
    cruise_interval: u64,
    along: Along,
}

impl<const MOTORS: usize> Running<MOTORS> {
    /// Begins `planned` at the squared speed `entry_v2` (mm²/s²); `None` if it has no steps.
    /// Such a move is never queued.
    pub(crate) fn new<const AXES: usize>(
        planned: &PlannedMove<AXES, MOTORS>,
        entry_v2: f32,
    ) -> Option<Self> {
        let line = Line::new(planned.delta).ok()?;
        let drive = Drive::new(planned, line.step_events().get());
        Some(Self {
            made: MotorMask::NONE,
            tracer: Tracer::new(line),
            speed: sqrt(entry_v2 * drive.steps_per_mm * drive.steps_per_mm),
            cruise_interval: 0,
            along: Along::new(planned, drive.steps_per_mm),
            profile: Profile::Trapezoid(drive.begun(planned.rate, entry_v2)),
            drive,
        })
    }

    /// Begins `planned` under a jerk limit, when the move `before` has ended.
    pub(crate) fn after<const AXES: usize>(
        before: Option<&Self>,
        planned: &PlannedMove<AXES, MOTORS>,
        ease: &Ease,
    ) -> Option<Self> {
        let mut running = Self::new(planned, 0.0)?;
        let (events, mm) = (running.drive.events, planned.length);
        let (mean, speed) = match before.map(|before| (&before.profile, before.speed())) {
            Some((Profile::Mean(mean), speed)) if !mean.rests() => {
                (mean.go_on(events, mm, ease), speed)
            }
            Some((Profile::Mean(_) | Profile::Trapezoid(_), _)) | None => {
                (Mean::new(events, mm, ease), 0.0)
            }
        };
        running.profile = Profile::Mean(mean);
        running.speed = speed * running.drive.steps_per_mm;
        Some(running)
    }

    /// Returns true if more of the tool's way has to be known for the next segment.
    pub(crate) fn needs_more(&self, timing: Timing) -> bool {
        match &self.profile {
            Profile::Trapezoid(_) => false,
            Profile::Mean(mean) => mean.needs_more(timing.longest_segment),
        }
    }

    /// Hands out the way up to `to`, which takes `seconds`.
    fn pass(&mut self, to: Place, seconds: f32) {
        self.drive.here = to;
        if let Profile::Mean(mean) = &mut self.profile {
            mean.pass(to, seconds);
        }
    }

    /// Adds a piece to the tool's way that is known.
    pub(crate) fn extend(&mut self, piece: Piece) {
        if let Profile::Mean(mean) = &mut self.profile {
            mean.push(piece);
        }
    }

    /// If the next pixel begins here, takes its power and asks `next` for the pixel after it.
    pub(crate) fn begin_pixel(&mut self, next: impl FnMut() -> Option<Pixel>) {
        self.along.begin_pixel(self.drive.here.step(), next);
    }

    /// The line number of the pixel that begins next, or of the move.
    pub(crate) const fn line_number(&self) -> Option<u32> {
        self.along.line_number()
    }

    /// Speed along the path at the end of the segments handed out, mm/s.
    pub(crate) fn speed(&self) -> f32 {
        if self.at_end() && matches!(self.profile, Profile::Trapezoid(_)) {
            return sqrt(self.exit_v2());
        }
        self.speed / self.drive.steps_per_mm
    }

    /// Time to the end of the profile, s; the speed there, mm/s; the steps of the move that follow.
    pub(crate) fn rest(&self) -> (f32, f32, u32) {
        let drive = &self.drive;
        let steps = drive.here.before(self.profile.end());
        let (seconds, _) = self.profile.time_over(drive.here, self.speed, steps);
        let steps_after = drive.events - self.profile.end();
        (seconds, sqrt(self.exit_v2()), steps_after)
    }

    /// The profile in force.
    pub(crate) const fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The end of the segments handed out.
    pub(crate) const fn here(&self) -> Place {
        self.drive.here
    }

    /// Returns true if all steps of the profile have been handed out. A mean ends at its rest.
    pub(crate) fn at_profile_end(&self) -> bool {
        match &self.profile {
            Profile::Trapezoid(of) => self.drive.here.step() >= of.end(),
            Profile::Mean(mean) => {
                let step = self.drive.here.step();
                step >= self.drive.events || mean.rests_at(step)
            }
        }
    }

    /// Returns true if the next segment belongs to the profile's last step.
    fn is_in_last_step(&self) -> bool {
        self.drive.here.step() + 1 >= self.profile.end()
    }

    /// Returns true if all steps of the move have been handed out.
    pub(crate) fn at_end(&self) -> bool {
        self.drive.here.step() >= self.drive.events
    }

    /// Returns true if motion rests at the profile's end.
    fn rests_after(&self) -> bool {
        self.profile.exit_v2() <= 0.0
    }

    /// Squared speed at the profile's end, mm²/s².
    pub(crate) fn exit_v2(&self) -> f32 {
        self.drive.mm2(self.profile.exit_v2())
    }

    /// Makes the stepper begin the line anew, after another line came between.
    pub(crate) fn renew_line(&mut self) {
        self.tracer.begin_anew(self.drive.here.step());
    }

    /// Hands out the next segment.
    ///
    /// The last step before the rest of a hold takes long. In that step a laser's constant power
    /// follows the speed, so that the step gets as much energy as at the programmed feed. `LONG`: as
    /// for [`Segmenter::next_long`](crate::Segmenter::next_long).
    pub(crate) fn segment<const LONG: bool>(
        &mut self,
        timing: Timing,
        carry: &mut Carry,
        goal: Goal,
    ) -> Segment<MOTORS> {
        let power = self.along.power();
        let programmed = match goal {
            Goal::Stop if self.is_in_last_step() && self.rests_after() => power.with_speed(),
            Goal::Stop | Goal::End => power,
        };
        let piece = self.piece::<LONG>(timing, carry);
        let (first, power_change) = self.along.power_over(programmed, piece.speeds, piece.ticks);
        let rests = self.at_profile_end() && self.rests_after();
        Segment {
            line: self.tracer.take_start(piece.early),
            ticks: piece.ticks,
            smoothing: piece.smoothing,
            motors: piece.motors,
            ends_event: piece.ends_event,
            early: piece.early,
            interval: piece.interval,
            interval_change: piece.interval_change,
            power: first,
            power_change,
            outputs: self.along.take_outputs(),
            at_rest: rests.then(|| match goal {
                Goal::End => power.at_rest(),
                Goal::Stop => power.held(),
            }),
        }
    }
}

impl<const MOTORS: usize> Running<MOTORS> {
    /// Puts a profile in force.
    pub(crate) fn follow(&mut self, profile: Trapezoid, timing: Timing) {
        self.profile = Profile::Trapezoid(profile);
        let (interval, rest) = divide_twice(timing.hz, self.profile.cruise());
        let exact = bits(interval).saturating_add_signed(if rest < 0.0 {
            -(bits(-rest) as i64)
        } else {
            bits(rest) as i64
        });
        // Each smoothing divides it without a rest: pieces of a cruise take the same time.
        self.cruise_interval = exact & !LEVELS;
    }
}

/// The bits of an interval that the finest smoothing cannot divide.
const LEVELS: u64 = (1 << MAX_SMOOTHING_LEVEL) - 1;

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
