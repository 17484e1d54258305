//! Motion: planned moves become segments, holds and stops end motion, and steps tell where the
//! motors are.
//!
//! ```text
//!   executor --> program: Planner, Segmenter, PowerLead --+
//!                                                         +--> PowerRule --> Feeder
//!   cycles   --> aside:   Planner, Segmenter -------------+                  --> step interrupt
//! ```
//!
//! There are two queues of moves: one of the program, one of cycles. A cycle is a motion of the
//! machine's own: homing, parking, or the way off a limit switch. The program may be held half-way
//! through a move while parking moves the machine aside and back again. Only one queue feeds the
//! step interrupt at a time.
//!
//! Motion out of rest waits for lines that come together ([`Start`]).

mod drivers;
mod feed;
mod feeder;
pub(crate) mod measure;
mod place;
mod power_rule;
mod reserve;

use crate::board::{Duration, Instant};
use crate::config::{MoveQueues, SegmentSender, ASIDE_MOVES};
use crate::home::Bounds;
use drivers::Drivers;
use feeder::Feeder;
use leadscrew_planner::{
    Ahead, Config, ConfigError, Coordinate, CornerRule, Curve, Feed, Kinematics, Move, Outline,
    Overrides, PixelQueue, Planner, PowerLead, PushError, Pushed, Segmenter, LONGEST_LEAD,
};
use leadscrew_stepper::{OutputChange, Power, Shared};

pub(crate) use feeder::Hunger;
pub(crate) use power_rule::PowerRule;
use reserve::Reserve;

/// The speed of the machine's own motion at `rate`, mm/min: no slower than Grbl's slowest, 1 mm/min,
/// since `$24` and `$25` may be 0.
pub(crate) fn own_feed(rate: f32) -> Feed {
    Feed::PerMinute(rate.max(1.0) / 60.0)
}

/// A planner and the segmenter of its moves.
struct Track<'a, K, const AXES: usize, const MOTORS: usize> {
    planner: Planner<'a, K, AXES, MOTORS>,
    segmenter: Segmenter<AXES, MOTORS>,
}

/// Whose moves feed the step interrupt.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Driver {
    Program,
    Aside,
}

/// The way in which motion follows the sender and the laser.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Pacing {
    /// The time after the last line at which motion begins; 0: as soon as in Grbl.
    pub(crate) silence: Duration,
    /// The time for which a sender may fall silent in motion; 0: as long as the queue lasts.
    pub(crate) stall: Duration,
    /// The time by which power changes before the motion that it belongs to, µs.
    pub(crate) lead_us: u32,
}

/// The motion of one machine.
pub(crate) struct Motion<'a, K, const AXES: usize, const MOTORS: usize> {
    program: Track<'a, K, AXES, MOTORS>,
    aside: Track<'a, K, AXES, MOTORS>,
    driver: Driver,
    start: Start,
    reserve: Reserve,
    /// A stop was asked for; nothing is fed until the step interrupt has emptied its queue.
    stopping: bool,
    /// Brings power forward between the program's segments and the feeder.
    lead: PowerLead<'a, MOTORS>,
    feeder: Feeder<'a, MOTORS>,
    pub(crate) shared: &'a Shared<MOTORS>,
    underruns: u32,
    power: PowerRule,
    /// The power of the segment committed last.
    power_out: Power,
    pub(crate) drivers: Drivers,
    /// Outputs that change when the next move of the program begins.
    pub(crate) outputs: OutputChange,
    /// The end of the planned path, exactly.
    pub(crate) path_end: [Coordinate; AXES],
    /// The ends of each axis's travel.
    pub(crate) bounds: [Bounds; AXES],
    /// The farthest places on both sides whose steps can be counted.
    pub(crate) reach: [Coordinate; AXES],
}

impl<'a, K, const AXES: usize, const MOTORS: usize> Motion<'a, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS> + Clone,
{
    /// Makes the motion of a machine at rest.
    ///
    /// # Errors
    /// Nothing can be planned with these settings.
    pub(crate) fn new<const MOVES: usize, const PIXELS: usize, const BLOCKS: usize>(
        config: Config<AXES>,
        kinematics: K,
        (queues, pixels): (
            &'a mut MoveQueues<AXES, MOTORS, MOVES, BLOCKS>,
            &'a mut PixelQueue<PIXELS>,
        ),
        segments: SegmentSender<'a, MOTORS>,
        shared: &'a Shared<MOTORS>,
    ) -> Result<Self, ConfigError> {
        let feeder = Feeder::new(segments.ready, shared, config.timer_hz);
        let config = Config {
            longest_segment: feeder.longest_segment(),
            ..config
        };
        let aside = aside(config);
        Ok(Self {
            program: Track {
                planner: Planner::new(config, kinematics.clone(), &mut queues.program, pixels)?,
                segmenter: Segmenter::new(),
            },
            aside: Track {
                planner: Planner::new(
                    aside,
                    kinematics,
                    &mut queues.aside,
                    &mut queues.aside_pixels,
                )?,
                segmenter: Segmenter::new(),
            },
            driver: Driver::Program,
            start: Start::new(Duration::from_ticks(0)),
            reserve: Reserve::ALL,
            stopping: false,
            lead: segments.lead,
            feeder,
            shared,
            underruns: shared.underruns(),
            power: PowerRule::Laser { percent: 100 },
            power_out: Power::OFF,
            drivers: Drivers::default(),
            outputs: OutputChange::NONE,
            path_end: [Coordinate::ZERO; AXES],
            bounds: [Bounds::NONE; AXES],
            reach: [Coordinate::ZERO; AXES],
        })
    }

    /// Takes over new settings. At rest, with nothing queued.
    ///
    /// # Errors
    /// Nothing can be planned with these settings, and the old ones stay in force. The settings'
    /// table has no such values.
    pub(crate) fn configure(
        &mut self,
        config: Config<AXES>,
        pacing: Pacing,
    ) -> Result<(), ConfigError> {
        let Pacing {
            silence,
            stall,
            lead_us,
        } = pacing;
        self.start = Start::new(silence);
        self.reserve = Reserve::new(&config, stall);
        self.reserve
            .set_override(self.program.planner.overrides().feed);
        self.lead.set(lead_us, config.timer_hz);
        self.feeder.set_lead(lead_us.min(LONGEST_LEAD));
        let config = Config {
            longest_segment: self.feeder.longest_segment(),
            ..config
        };
        self.program.planner.configure(config)?;
        self.aside.planner.configure(aside(config))?;
        self.resync();
        Ok(())
    }

    /// The settings in force.
    pub(crate) fn config(&self) -> &Config<AXES> {
        self.program.planner.config()
    }

    /// Sets the overrides of the program's moves. [`crate::overrides::Overrides`] keeps to shares
    /// that the planner takes.
    pub(crate) fn set_overrides(&mut self, overrides: Overrides) {
        if self.program.planner.set_overrides(overrides).is_ok() {
            self.reserve.set_override(overrides.feed);
        }
    }

    /// Sets the rule by which power goes out, from the next segment on.
    pub(crate) fn set_power_rule(&mut self, rule: PowerRule) {
        self.power = rule;
    }

    /// Plans a move of the program. `more`: its line has further moves, and motion out of rest
    /// waits for them.
    pub(crate) fn push(
        &mut self,
        next: &Move<AXES>,
        more: bool,
        now: Instant,
    ) -> Result<Pushed, PushError> {
        let begins = self.is_idle();
        let pushed = self.program.planner.push(next)?;
        self.start.planned(begins, more, now);
        Ok(pushed)
    }

    /// Plans a move of a cycle. The cycle's queue feeds the step interrupt until
    /// [`Motion::end_aside`].
    pub(crate) fn push_aside(&mut self, next: &Move<AXES>) -> Result<Pushed, PushError> {
        if self.driver == Driver::Program {
            self.driver = Driver::Aside;
            let steps = self.gang();
            self.aside.planner.set_position(steps);
        }
        self.aside.planner.push(next)
    }

    /// Gives the step interrupt back to the program. At rest, with the motors in the place at which
    /// a hold left them or the program's queue empty.
    pub(crate) fn end_aside(&mut self) {
        if self.driver == Driver::Aside {
            self.aside.planner.clear();
            self.aside.segmenter.abandon();
            self.driver = Driver::Program;
            self.program.segmenter.renew_line();
        }
    }

    /// Returns true if one more move of the program should be planned now. Without it the queue's
    /// end might slow motion down, or the queue might run empty while the sender stalls as long as
    /// `$710` allows. If not, the line of that move waits.
    pub(crate) fn wants_more(&self) -> bool {
        let planner = &self.program.planner;
        let ample = planner.len() >= DEPTH && self.reserve.is_exceeded(planner.waiting_micros());
        !ample && planner.has_room()
    }

    /// Moves of the program that may still be planned: the first number of `Bf:`.
    pub(crate) fn room(&self) -> usize {
        self.program.planner.room()
    }

    /// Lets motion begin without waiting for more lines.
    pub(crate) fn release(&mut self) {
        self.start.release();
    }

    /// Makes motion out of rest wait for a line that has come, or is coming.
    pub(crate) fn put_off(&mut self, now: Instant) {
        self.start.put_off(now);
    }

    /// Returns true if no step is made and none is committed. A hold that was asked for is complete
    /// then.
    pub(crate) fn is_at_rest(&self) -> bool {
        self.feeder.is_at_rest() && self.lead.is_empty()
    }

    /// Returns true if all moves of the program have been made.
    pub(crate) fn is_idle(&self) -> bool {
        self.is_at_rest() && self.is_program_idle()
    }

    /// Returns true if all moves of a cycle have been made.
    pub(crate) fn is_aside_idle(&self) -> bool {
        self.is_at_rest() && self.aside.planner.is_empty() && self.aside.segmenter.is_idle()
    }

    pub(super) fn is_program_idle(&self) -> bool {
        self.program.segmenter.is_idle() && self.program.planner.is_empty()
    }

    /// Returns when motion begins by itself, if it waits for lines.
    pub(crate) fn starts_at(&self) -> Option<Instant> {
        self.start
            .ends_at()
            .filter(|_| !self.program.planner.is_empty())
    }

    /// Begins to slow down on the path, as fast as the limits allow.
    pub(crate) fn hold(&mut self) {
        self.program.segmenter.hold();
    }

    /// Goes on after a hold, or while a hold still slows motion down.
    pub(crate) fn resume(&mut self) {
        self.program.segmenter.resume();
        self.release();
    }

    /// Forgets all planned moves, of program and cycles. At rest after a hold, or after a stop.
    pub(crate) fn forget(&mut self) {
        self.program.planner.clear();
        self.program.segmenter.abandon();
        self.lead.clear();
        self.end_aside();
        self.resync();
    }

    /// Stops before the next step, and forgets all that is planned. Position is kept: no step is
    /// made after this.
    pub(crate) fn stop(&mut self) {
        self.shared.set_stop(true);
        self.stopping = true;
        self.outputs = OutputChange::NONE;
        self.forget();
    }

    /// The distance that each axis goes in the move that runs, mm or degrees; `None` at rest.
    pub(crate) fn running_ways(&self) -> Option<[f32; AXES]> {
        match self.driver {
            Driver::Program => self.program.planner.running_ways(),
            Driver::Aside => self.aside.planner.running_ways(),
        }
    }

    /// The speed along the path, mm/s; 0 at rest.
    pub(crate) fn speed(&self) -> f32 {
        if self.is_at_rest() {
            return 0.0;
        }
        match self.driver {
            Driver::Program => self.program.segmenter.speed(),
            Driver::Aside => self.aside.segmenter.speed(),
        }
    }

    /// The power that is put out in motion; `None` at rest.
    pub(crate) fn power(&self) -> Option<Power> {
        (!self.is_at_rest()).then_some(self.power_out)
    }

    /// The line number of the move under way, or of the one that begins next.
    pub(crate) fn line_number(&self) -> Option<u32> {
        let Track { planner, segmenter } = &self.program;
        match segmenter.is_idle() {
            true => planner.next_line_number(),
            false => segmenter.line_number(),
        }
    }

    /// The values that the program's newest move was planned with.
    pub(crate) fn newest(&self) -> Option<Outline<MOTORS>> {
        self.program.planner.newest()
    }

    /// The speed at the end of the segment that was committed last, mm/s, and the limit that lies
    /// ahead of it.
    pub(crate) fn committed(&self) -> (f32, Ahead) {
        match self.driver {
            Driver::Program => (self.program.segmenter.speed(), self.ahead()),
            Driver::Aside => (self.aside.segmenter.speed(), self.aside.planner.ahead()),
        }
    }

    /// The limit that lies ahead of the program's motion. The queue counts as full even with room
    /// for one move: a move that has just ended leaves room that no line can have filled yet.
    fn ahead(&self) -> Ahead {
        match self.program.planner.ahead() {
            Ahead::QueueEnd { .. } => Ahead::QueueEnd {
                full: self.room() <= 1 || !self.wants_more(),
            },
            other @ (Ahead::Corner | Ahead::Curve | Ahead::SlowerMove) => other,
        }
    }

    /// Returns true if a stop still empties the segment queue. Not if no step interrupt comes,
    /// which would keep all lines waiting.
    pub(crate) fn is_stopping(&self) -> bool {
        self.stopping && !self.feeder.is_stalled()
    }

    /// The speed that the arc of a move allows, mm/s.
    pub(crate) fn arc_speed(&self, of: &Move<AXES>) -> Option<f32> {
        match self.config().corner_rule {
            CornerRule::Limits => of.curve.map(Curve::top_speed),
            CornerRule::Grbl => None,
        }
    }

    /// Returns true if a change of overrides has not reached all planned moves yet.
    pub(crate) fn is_renewing(&self) -> bool {
        self.program.planner.is_renewing()
    }
}

/// The number of planned moves with which motion begins; with fewer, no line waits for its answer.
/// Grbl plans as many.
const DEPTH: usize = 15;

/// Motion begins after a silence of this length: the time of two characters at 115 200 baud, in
/// which a byte on its way is heard.
const SILENCE: Duration = Duration::from_ticks(200);

/// No sender waits for motion longer than this.
const LONGEST: Duration = Duration::from_ticks(5_000);

/// The conditions that motion waits for: this silence, this number of moves, or this time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Patience {
    silence: Duration,
    moves: usize,
    longest: Option<Duration>,
}

/// Says whether motion may begin.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Phase {
    /// The line under way has more moves to come: motion waits until enough are planned.
    MoreToCome,
    /// Lines may still come: motion waits until this instant.
    Until(Instant),
    /// Motion has begun, or need not wait.
    Over,
}

/// The wait before the program's motion. It says when motion begins out of rest: lines that a
/// sender sends together are planned together.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Start {
    patience: Patience,
    phase: Phase,
    /// The time at which the wait is over at the latest.
    latest: Option<Instant>,
}

impl Start {
    /// A start without anything that waits. `silence`: `$701`, 0 for as little as Grbl waits.
    fn new(silence: Duration) -> Self {
        let as_grbl = Patience {
            silence: SILENCE,
            moves: DEPTH,
            longest: Some(LONGEST),
        };
        let patience = Patience {
            silence,
            moves: usize::MAX,
            longest: None,
        };
        Self {
            patience: match silence.ticks() {
                0 => as_grbl,
                _ => patience,
            },
            phase: Phase::Over,
            latest: None,
        }
    }

    /// Notes that a move was planned. `begins`: it is the first one after rest. `more`: its line
    /// has further moves.
    fn planned(&mut self, begins: bool, more: bool, now: Instant) {
        if begins {
            self.latest = self.patience.longest.map(|longest| now + longest);
        } else if self.phase == Phase::Over {
            return;
        }
        self.phase = match more {
            true => Phase::MoreToCome,
            false => Phase::Until(now + self.patience.silence),
        };
    }

    /// Puts motion off: a line has come that has not been carried out yet, or is coming.
    fn put_off(&mut self, now: Instant) {
        if let Phase::Until(instant) = &mut self.phase {
            *instant = now + self.patience.silence;
        }
    }

    /// Ends the wait.
    fn release(&mut self) {
        self.phase = Phase::Over;
    }

    /// Returns when the wait is over by itself.
    fn ends_at(&self) -> Option<Instant> {
        match (self.phase, self.latest) {
            (Phase::Until(instant), Some(latest)) => Some(instant.min(latest)),
            (Phase::Until(instant), None) => Some(instant),
            (Phase::MoreToCome | Phase::Over, _) => None,
        }
    }

    /// Returns true if motion may begin with `moves` planned.
    fn is_over(&mut self, moves: usize, now: Instant) -> bool {
        let enough = moves >= self.patience.moves;
        if enough || self.ends_at().is_some_and(|end| now >= end) {
            self.release();
        }
        self.phase == Phase::Over
    }
}

/// The configuration of the queue for cycles.
fn aside<const AXES: usize>(config: Config<AXES>) -> Config<AXES> {
    Config {
        moves: ASIDE_MOVES,
        pixels: 0,
        ..config
    }
}

#[cfg(test)]
mod tests;
