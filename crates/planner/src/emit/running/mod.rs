//! The running move: its place, its profile, and its next segment.
//!
//! The profile leads to the end of the move or of a part of it (see
//! [`Course`](crate::space::axis_limits::Course)), or to the shortest stop.

mod eased;
mod piece;
mod tracer;

use crate::emit::fit::{bits, Carry};
use crate::emit::pixel::Pixel;
use crate::moves::PlannedMove;
use crate::planner::Outlook;
use crate::real::{divide_twice, max, min, sqrt};
use crate::space::axis_limits::Whereabouts;
use crate::speed::plan::{Place, Plan};
use crate::speed::profile::ROUNDING;
use crate::{Config, Profile, Trapezoid};
use leadscrew_stepper::{Line, MotorMask, Segment};
use tracer::{Along, Tracer};

/// A planned move that is being executed.
#[derive(Clone, Debug)]
pub(crate) struct Running<const MOTORS: usize> {
    /// Steps of the dominant motor in the whole move.
    events: u32,
    /// Steps of the dominant motor per mm of path.
    steps_per_mm: f32,
    /// Acceleration along the path where the path is straight, steps/s².
    acceleration: f32,
    /// The end of the segments handed out.
    here: Place,
    /// The motors that have already been advanced in the step event under way.
    made: MotorMask,
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
    /// Begins `planned` at the squared speed `entry_v2` (mm²/s²); `None` where it has no steps.
    /// Such a move is never queued.
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
            beyond: 0.0,
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
            here: Place::at(0),
            made: MotorMask::NONE,
            tracer: Tracer::new(line),
            profile,
            speed: sqrt(entry_v2),
            cruise_interval: 0,
            along: Along::new(planned, steps_per_mm),
            outlook: None,
        })
    }

    /// Begins with the profile of the move before, if that goes on.
    pub(crate) fn go_on(&mut self, before: &Self) {
        let ratio = self.steps_per_mm / before.steps_per_mm;
        if let Some(profile) = before.profile.go_on(self.events, ratio) {
            self.profile = profile;
        }
    }

    /// If the next pixel begins here, takes its power and asks `next` for the pixel after it.
    pub(crate) fn begin_pixel(&mut self, next: impl FnMut() -> Option<Pixel>) {
        self.along.begin_pixel(self.here.step(), next);
    }

    /// The line number of the pixel that begins next, or of the move.
    pub(crate) const fn line_number(&self) -> Option<u32> {
        self.along.line_number()
    }

    /// Speed along the path at the end of the segments handed out, mm/s.
    pub(crate) fn speed(&self) -> f32 {
        if self.at_end() {
            return sqrt(self.exit_v2());
        }
        self.speed / self.steps_per_mm
    }

    /// Time to the end of the profile, s; the speed there, mm/s; the steps of the move that follow.
    pub(crate) fn rest(&self) -> (f32, f32, u32) {
        let steps = self.here.before(self.profile.end());
        let (seconds, _) = self.profile.time_over(self.here, self.speed, steps);
        let steps_after = self.events - self.profile.end();
        (seconds, sqrt(self.exit_v2()), steps_after)
    }

    /// Speed and remaining length, for the planner.
    pub(crate) fn whereabouts(&self) -> Whereabouts {
        Whereabouts {
            v2: self.profile.speed_v2(self.here) / (self.steps_per_mm * self.steps_per_mm),
            steps: self.events - self.here.step(),
            way: self.here.part(),
            at_start: self.at_start(),
            brakes_to_rest: self.profile.brakes_to_rest(self.here),
        }
    }

    /// The profile in force.
    pub(crate) const fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The end of the segments handed out.
    pub(crate) const fn here(&self) -> Place {
        self.here
    }

    /// Whether the move has not begun.
    fn at_start(&self) -> bool {
        self.here == Place::at(0)
    }

    /// Whether no step event is handed out in part.
    #[cfg(test)]
    pub(crate) fn at_step(&self) -> bool {
        self.here.is_whole()
    }

    /// Whether all steps of the profile have been handed out.
    pub(crate) fn at_profile_end(&self) -> bool {
        self.here.step() >= self.profile.end()
    }

    /// Whether the next segment belongs to the profile's last step.
    fn is_in_last_step(&self) -> bool {
        self.here.step() + 1 >= self.profile.end()
    }

    /// Whether all steps of the move have been handed out.
    pub(crate) fn at_end(&self) -> bool {
        self.here.step() >= self.events
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
        self.tracer.begin_anew(self.here.step());
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

/// The next task of the running move.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Aim {
    pub(crate) goal: Goal,
    /// Steps of the dominant motor from the end of the part of the move that runs to the move's end
    /// (see [`Course`](crate::space::axis_limits::Course)).
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

/// The input of a profile. Units: steps of the dominant motor, steps/s.
struct Path {
    end: u32,
    cruise: f32,
    exit_v2: f32,
    /// Accelerations, steps/s².
    up: f32,
    down: f32,
    /// The share of the accelerations that is used, above 0, at most 1. The distance becomes
    /// 1/share times as long.
    share: f32,
}

impl<const MOTORS: usize> Running<MOTORS> {
    /// The profile from here on, without a jerk limit.
    ///
    /// A move may become the first one of a curve while it runs. Then the curve's acceleration
    /// across the path may leave too little for braking to the speed at its end. The profile in
    /// force stays where it ends no faster.
    pub(crate) fn planned(&self, aim: Aim) -> Profile {
        let ends_here = self.profile.end() == self.events - aim.steps_after;
        let is_kept = ends_here && self.exit_v2() <= aim.exit_v2 && !self.at_start();
        if is_kept && self.missed(aim).is_some() {
            return self.profile;
        }
        let entry_v2 = self.profile.speed_v2(self.here);
        let path = match aim.goal {
            Goal::End => self.to_end(aim),
            Goal::Stop => self.stop(entry_v2, aim),
        };
        let plan = Plan {
            start: self.here,
            end: path.end,
            beyond: 0.0,
            entry_v2,
            cruise: path.cruise,
            exit_v2: path.exit_v2,
            up: path.up * path.share,
            down: path.down * path.share,
        };
        Profile::Trapezoid(Trapezoid::new(&plan))
    }

    /// Puts a profile in force.
    pub(crate) fn follow(&mut self, profile: Profile, timing: Timing) {
        self.profile = profile;
        let (interval, rest) = divide_twice(timing.hz, self.profile.cruise());
        self.cruise_interval = bits(interval).saturating_add_signed(if rest < 0.0 {
            -(bits(-rest) as i64)
        } else {
            bits(rest) as i64
        });
    }

    /// The way to the end of the part that runs.
    ///
    /// Braking ends at a computed speed that is only as exact as the high speed before it. The
    /// planned exit speed is exact. Where the two speeds differ by no more than rounding, the
    /// planned one is used, so that rounding does not add up from move to move.
    ///
    /// An override may ask for a lower exit speed than can still be reached. Then the corner's own
    /// limit bounds the exit speed: the plan before the override kept that limit.
    fn to_end(&self, aim: Aim) -> Path {
        let per_mm = self.steps_per_mm;
        let [exit_v2, corner_v2] = [aim.exit_v2, aim.corner_v2].map(|v2| v2 * per_mm * per_mm);
        Path {
            end: self.events - aim.steps_after,
            cruise: aim.nominal * per_mm,
            exit_v2: min(self.missed(aim).unwrap_or(exit_v2), corner_v2),
            up: aim.up * per_mm,
            down: aim.down * per_mm,
            share: 1.0,
        }
    }

    /// The squared speed (steps²/s²) at which braking from here on ends, where that is faster than
    /// the exit speed by more than rounding.
    fn missed(&self, aim: Aim) -> Option<f32> {
        let per_mm = self.steps_per_mm;
        let entry_v2 = self.profile.speed_v2(self.here);
        let left = self.here.before(self.events - aim.steps_after);
        let slowest = entry_v2 - 2.0 * aim.down * per_mm * left;
        let excess = slowest - aim.exit_v2 * per_mm * per_mm;
        (excess > ROUNDING * entry_v2).then_some(slowest)
    }

    /// The shortest stop that ends on a whole step. It begins at once. Its length is rounded up to
    /// the whole step, which makes the stop gentler.
    ///
    /// A stop within a single step is made as fast as possible: at a speed near 0 the step would
    /// never end.
    fn stop(&self, entry_v2: f32, aim: Aim) -> Path {
        let (down, left) = (aim.stop * self.steps_per_mm, self.events - self.here.step());
        let distance = entry_v2 / (2.0 * down) * (1.0 - 0.5 * ROUNDING);
        let steps = round_up(distance + self.here.part()).max(1);
        if steps > left && aim.exit_v2 > 0.0 {
            let path = self.to_end(aim);
            let slowest = entry_v2 - 2.0 * down * self.here.before(path.end);
            return Path {
                cruise: sqrt(entry_v2),
                exit_v2: min(path.exit_v2, max(slowest, 0.0)),
                down: max(path.down, down),
                ..path
            };
        }
        let stop = Path {
            end: self.here.step() + steps.min(left),
            cruise: sqrt(entry_v2),
            exit_v2: 0.0,
            up: aim.up * self.steps_per_mm,
            down,
            share: 1.0,
        };
        if steps == 1 {
            let cruise = aim.nominal * self.steps_per_mm;
            Path { cruise, ..stop }
        } else if steps > left {
            stop
        } else {
            let share = distance / self.here.before(stop.end) * (1.0 + ROUNDING);
            Path {
                share: min(share, 1.0),
                ..stop
            }
        }
    }
}

/// The next whole number of steps.
fn round_up(steps: f32) -> u32 {
    let whole = steps as u32;
    whole.saturating_add(u32::from(steps > whole as f32))
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
