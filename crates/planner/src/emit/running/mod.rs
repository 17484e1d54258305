//! The running move: its place, its profile, and its next segment.

mod along;
mod parts;
mod piece;
mod plan;
mod progress;
mod tracer;

pub(crate) use plan::{Aim, Goal};

use crate::emit::fit::Carry;
use crate::emit::pixel::Pixel;
use crate::moves::PlannedMove;
use crate::planner::Outlook;
use crate::real::sqrt;
use crate::space::course::Whereabouts;
use crate::speed::profile::{Place, Plan};
use crate::{Config, Profile, Trapezoid};
use along::Along;
use leadscrew_stepper::{Line, Segment};
use progress::Progress;
use tracer::Tracer;

/// A planned move that is being executed.
#[derive(Clone, Debug)]
pub(crate) struct Running<const MOTORS: usize> {
    /// Steps of the dominant motor in the whole move.
    events: u32,
    /// Steps of the dominant motor per mm of path.
    steps_per_mm: f32,
    /// Acceleration along the path where the path is straight, steps/s².
    acceleration: f32,
    progress: Progress<MOTORS>,
    tracer: Tracer<MOTORS>,
    profile: Profile,
    /// Speed at the end of the segments handed out, steps/s.
    speed: f32,
    /// Interval of the profile's cruise, 2⁻³² counts.
    cruise_interval: u64,
    along: Along,
    /// The outlook that the profile was made from.
    pub(crate) outlook: Option<Outlook>,
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
            events,
            steps_per_mm,
            acceleration,
            progress: Progress::default(),
            tracer: Tracer::new(line),
            profile,
            speed: sqrt(entry_v2),
            cruise_interval: 0,
            along: Along::new(planned, steps_per_mm),
            outlook: None,
        })
    }

    /// If the next pixel begins here, takes its power and asks `next` for the pixel after it.
    pub(crate) fn begin_pixel(&mut self, next: impl FnMut() -> Option<Pixel>) {
        self.along.begin_pixel(self.progress.done, next);
    }

    /// The line number of the pixel that begins next, or of the move.
    pub(crate) const fn line_number(&self) -> Option<u32> {
        self.along.line_number()
    }

    /// Speed along the path at the end of the segments handed out, mm/s.
    pub(crate) fn speed(&self) -> f32 {
        self.speed / self.steps_per_mm
    }

    /// Seconds of the rest of the profile, the speed at its end, mm/s, and the steps of the move
    /// after it.
    pub(crate) fn rest(&self) -> (f32, f32, u32) {
        let steps = self.here().before(self.profile.end());
        let parts = self.progress.parts.as_ref();
        let (entry, elapsed) = parts.map_or((self.speed, 0.0), |of| (of.entry, of.elapsed));
        let (seconds, _) = self.profile.time_over(self.here(), entry, steps);
        let steps_after = self.events - self.profile.end();
        (seconds - elapsed, sqrt(self.exit_v2()), steps_after)
    }

    /// Speed and remaining length, for the planner.
    pub(crate) fn whereabouts(&self) -> Whereabouts {
        Whereabouts {
            v2: self.profile.speed_v2(self.here()) / (self.steps_per_mm * self.steps_per_mm),
            steps: self.events - self.progress.done,
            way: self.progress.way,
            at_start: self.progress.at_start(),
        }
    }

    /// The profile in force.
    pub(crate) const fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The end of the segments handed out. Parts of a span that is not finished do not count.
    pub(crate) const fn here(&self) -> Place {
        self.progress.here()
    }

    /// Whether the profile may be made anew: not while a span is handed out in part.
    pub(crate) const fn may_change(&self) -> bool {
        self.progress.parts.is_none()
    }

    /// Whether no step event is handed out in part.
    #[cfg(test)]
    pub(crate) fn at_step(&self) -> bool {
        self.progress.at_step()
    }

    /// Whether all steps of the profile have been handed out.
    pub(crate) fn at_profile_end(&self) -> bool {
        self.progress.done >= self.profile.end()
    }

    /// Whether the next segment belongs to the profile's last step.
    fn is_in_last_step(&self) -> bool {
        self.progress.done + 1 >= self.profile.end()
    }

    /// Whether all steps of the move have been handed out.
    pub(crate) fn at_end(&self) -> bool {
        self.progress.done >= self.events
    }

    /// Whether motion rests at the profile's end.
    fn rests_after(&self) -> bool {
        self.profile.exit_v2() <= 0.0
    }

    /// Squared speed at the profile's end, mm²/s².
    pub(crate) fn exit_v2(&self) -> f32 {
        self.profile.exit_v2() / (self.steps_per_mm * self.steps_per_mm)
    }

    /// Makes the stepper begin the line anew, after another line came between.
    pub(crate) fn renew_line(&mut self) {
        self.tracer.begin_anew(self.progress.done);
    }

    /// Hands out the next segment.
    ///
    /// The last step before the rest of a hold takes long. In that step a laser's constant power
    /// follows the speed, so that the step gets as much energy as at the programmed feed.
    pub(crate) fn segment(
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
        let piece = self.piece(timing, carry);
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
