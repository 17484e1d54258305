//! Watches a job and cuts it into stretches.
//!
//! ```text
//!  move_planned  -->  planned moves, oldest first  --+
//!  segments_made -->  end speed and what lies ahead --+--> segment_taken: a piece begins, the one before has ended
//! ```
//!
//! Consecutive pieces of one move are one stretch while speed and power go on in the same way.

use super::limit::{Limit, Limits, Machine, Slow, SpeedLimit};
use super::shares::add_up;
use super::{Phase, Share, Stretch};
use crate::clock::Cycle;
use crate::observer::{Observer, Taken};
use leadscrew_machine::explain::{Committed, PlannedMove};
use leadscrew_planner::MoveKind;
use std::collections::{BTreeMap, VecDeque};

/// Cuts a job into stretches.
#[derive(Debug)]
pub struct Recorder {
    machine: Machine,
    planned: VecDeque<(u32, Limits)>,
    /// The planner's state at the end of each segment; `None` for a segment that was made together
    /// with later ones.
    made: VecDeque<Option<Committed>>,
    /// The move under way; `None` if the machine moves by itself.
    running: Option<(u32, Limits)>,
    /// The path of one step of the dominant motor in this move, mm.
    mm_per_event: f64,
    stretches: Vec<Raw>,
    /// The times of stretches that are not kept; `None` if all are.
    sums: Option<Sums>,
    /// A piece whose end is not known yet.
    begun: Option<Begun>,
    /// Speed at the end of the last piece, mm/s.
    speed: f64,
    /// The slow place that motion passed last.
    behind: Slow,
}

/// A piece: one or more segments, up to the next one at whose end the speed is known.
#[derive(Clone, Copy, Debug)]
struct Begun {
    cycle: Cycle,
    begins_move: bool,
    step_events: u32,
    power: [f64; 2],
}

/// A stretch whose line in the file is not known yet. If it brakes for a slower move, that move's
/// limit is not known yet either.
#[derive(Clone, Copy, Debug)]
struct Raw {
    stretch: Stretch,
    /// The number of the line, [`PlannedMove::line`].
    line: u32,
    /// The limit of the move's speed if it neither speeds up nor slows down.
    speed_limit: Option<SpeedLimit>,
    /// Mean power and mean speed of its last piece.
    mean: [f64; 2],
    /// True if it begins a move, at the speed of `speed_limit`.
    begins_nominal: bool,
}

/// Stretches that are added up together.
const SETTLED: usize = 64;

/// The times of stretches that are not kept.
#[derive(Debug, Default)]
struct Sums {
    /// The first stretch: the machine may have rested for a while before the job began.
    first: Option<Raw>,
    cycles: BTreeMap<Limit, u64>,
}

impl Sums {
    fn add(&mut self, raw: Raw) {
        if self.first.is_none() {
            self.first = Some(raw);
        } else {
            *self.cycles.entry(raw.stretch.limit).or_default() += raw.stretch.cycles();
        }
    }
}

impl Raw {
    /// Returns true if `piece`, which begins a move of `line`, cruises on at this stretch's speed.
    fn is_continued_by(&self, line: u32, piece: &Stretch) -> bool {
        let even = self.stretch.phase == Phase::Cruise && piece.phase == Phase::Cruise;
        even && self.line == line
            && self.stretch.limit == piece.limit
            && (piece.speed[1] - self.stretch.speed[0]).abs() <= EVEN * piece.speed[1]
    }
}

/// `SAME`: the relative difference up to which a speed counts as the nominal one. `EVEN`: the
/// relative change up to which a speed counts as constant.
const SAME: f64 = 1e-3;
const EVEN: f64 = 1e-6;
/// `STEADY`: how much power may change within a pixel (share of full power). `FOLLOWS`: how
/// closely, in relative terms, power has to follow the speed within a pixel.
const STEADY: f64 = 0.005;
const FOLLOWS: f64 = 0.03;

impl Recorder {
    /// Watches a machine from power-up on.
    pub fn new(machine: Machine) -> Self {
        Self {
            machine,
            planned: VecDeque::new(),
            made: VecDeque::new(),
            running: None,
            mm_per_event: 0.0,
            stretches: Vec::new(),
            sums: None,
            begun: None,
            speed: 0.0,
            behind: Slow::Stop,
        }
    }

    /// As [`Recorder::new`], but only the times of the limits are kept, in memory that does not grow
    /// with the job: see [`Recorder::shares`].
    pub fn summing(machine: Machine) -> Self {
        Self {
            sums: Some(Sums::default()),
            ..Self::new(machine)
        }
    }

    /// Returns the time that each limit binds in the job from `begin` to `end`, longest first.
    pub fn shares(mut self, begin: Cycle, end: Cycle) -> Vec<Share> {
        let Sums { first, cycles } = self.sums.take().unwrap_or_default();
        self.stretches.splice(0..0, first);
        let kept = self.finish(begin, end, |_| None);
        add_up(cycles, &kept)
    }

    /// Returns the job from `begin` to `end`, cut into stretches without a gap. `file_line` maps
    /// [`PlannedMove::line`] to the line of the file.
    pub fn finish(
        mut self,
        begin: Cycle,
        end: Cycle,
        file_line: impl Fn(u32) -> Option<u64>,
    ) -> Vec<Stretch> {
        self.close(end);
        self.name_slower_moves();
        self.name_end();
        let stretches = self.stretches.into_iter().map(|raw| Stretch {
            line: file_line(raw.line).unwrap_or(0),
            begin: raw.stretch.begin.max(begin).min(end),
            end: raw.stretch.end.max(begin).min(end),
            ..raw.stretch
        });
        let mut all: Vec<Stretch> = stretches.filter(|s| s.cycles() > 0).collect();
        let first = all.first().map_or(end, |first| first.begin);
        if first > begin {
            all.insert(0, rest(begin, first));
        }
        all
    }

    /// Ends the stretch under way.
    fn close(&mut self, end: Cycle) {
        if let Some(last) = self.stretches.last_mut() {
            last.stretch.end = end;
        }
    }

    /// Finds the planned move that begins with a segment whose line has these steps. If the planner
    /// joined several planned moves into one, the last of them has all the steps.
    fn begin_move(&mut self, steps: &[u32]) {
        let found = self.planned.iter().position(|(_, of)| of.steps == steps);
        let ended = found.and_then(|last| self.planned.drain(..=last).next_back());
        let length = match &ended {
            Some((_, of)) => of.length,
            // The machine moves on its own. On crossed belts it then moves along one axis at a
            // time, so the directions do not matter.
            None => {
                let steps: Vec<i32> = steps.iter().map(|steps| steps.cast_signed()).collect();
                self.machine.length(&steps)
            }
        };
        let events = steps.iter().copied().max().unwrap_or(1).max(1);
        self.mm_per_event = length / f64::from(events);
        self.running = ended;
    }

    /// Adds a segment to the piece under way, or begins a new piece with it.
    fn begin_piece(&mut self, cycle: Cycle, taken: &Taken<'_>) -> Begun {
        let before = self.begun.take();
        let first = before.unwrap_or(Begun {
            cycle,
            begins_move: taken.line.is_some(),
            step_events: 0,
            power: taken.power,
        });
        Begun {
            step_events: first.step_events + taken.step_events,
            power: [first.power[0], taken.power[1]],
            ..first
        }
    }

    /// Ends the piece under way, at whose end the speed is known, and adds it to the stretches.
    fn end_piece(&mut self, piece: Begun, made: &Committed) {
        let (from, to) = (self.speed, f64::from(made.speed));
        self.speed = to;
        let phase = if (to - from).abs() <= EVEN * to.max(from) {
            Phase::Cruise
        } else if to > from {
            Phase::Accelerate
        } else {
            Phase::Brake
        };
        let ahead = Slow::new(made.ahead, self.curve());
        let stretch = Stretch {
            begin: piece.cycle,
            end: piece.cycle,
            line: 0,
            phase,
            length: f64::from(piece.step_events) * self.mm_per_event,
            speed: [from, to],
            power: piece.power,
            limit: self.limit(phase, to, ahead),
        };
        self.add(stretch, piece.begins_move);
        self.pass(&stretch, ahead);
    }

    /// The kind of curve that limits the speed: an arc if the running or the next move is an arc.
    fn curve(&self) -> SpeedLimit {
        let mut moves = self.running.iter().chain(self.planned.front());
        match moves.any(|(_, of)| of.is_arc) {
            true => SpeedLimit::Arc,
            false => SpeedLimit::Curve,
        }
    }

    /// Remembers the slow place that the piece leads to. If the piece reaches the nominal speed,
    /// remembers this speed's limit.
    fn pass(&mut self, piece: &Stretch, ahead: Slow) {
        let Some((_, of)) = &self.running else {
            return;
        };
        let slow = piece.speed[1] < of.nominal * (1.0 - SAME);
        self.behind = match piece.phase {
            Phase::Brake => ahead,
            Phase::Cruise if slow => ahead,
            Phase::Accelerate if slow => return,
            Phase::Cruise | Phase::Accelerate => Slow::Move(of.speed_limit),
            Phase::Rest => Slow::Stop,
        };
    }

    fn limit(&self, phase: Phase, speed: f64, ahead: Slow) -> Limit {
        let Some((_, of)) = &self.running else {
            return Limit::Cycle;
        };
        match phase {
            Phase::Rest => Limit::Rest,
            Phase::Accelerate => Limit::Acceleration(of.axis, self.behind),
            Phase::Brake => Limit::Acceleration(of.axis, ahead),
            Phase::Cruise if speed < of.nominal * (1.0 - SAME) => match ahead {
                Slow::Move(curve @ (SpeedLimit::Arc | SpeedLimit::Curve)) => Limit::Speed(curve),
                _ => Limit::Slow(ahead),
            },
            Phase::Cruise => Limit::Speed(of.speed_limit),
        }
    }

    /// Adds a piece. It lengthens the stretch under way if it continues the stretch's phase in the
    /// same move, or goes on at the same speed along the next chord of an arc.
    fn add(&mut self, piece: Stretch, begins: bool) {
        let line = self.running.as_ref().map_or(0, |(line, _)| *line);
        if let Some(last) = self.stretches.last_mut() {
            // At its top a ramp may have one step at constant speed.
            let top = last.stretch.phase == Phase::Accelerate
                && matches!(piece.limit, Limit::Slow(_))
                && piece.length <= self.mm_per_event * 1.5;
            let chord = begins && last.is_continued_by(line, &piece);
            let same = !begins && (last.stretch.phase == piece.phase || top) || chord;
            if same && is_steady(last.mean, mean(&piece)) {
                last.mean = mean(&piece);
                last.stretch.length += piece.length;
                last.stretch.speed[1] = piece.speed[1];
                last.stretch.power[1] = piece.power[1];
                if piece.phase == Phase::Brake {
                    last.stretch.limit = piece.limit;
                }
                return;
            }
        }
        self.stretches.push(Raw {
            stretch: piece,
            line,
            speed_limit: self.running.as_ref().map(|(_, of)| of.speed_limit),
            mean: mean(&piece),
            begins_nominal: begins
                && self
                    .running
                    .as_ref()
                    .is_some_and(|(_, of)| piece.speed[0] >= of.nominal * (1.0 - SAME)),
        });
        self.settle();
    }

    /// Adds up the stretches that no later one can change: all before one that does not brake.
    fn settle(&mut self) {
        let is_final = |raw: &Raw| match raw.stretch.phase {
            Phase::Accelerate | Phase::Cruise => true,
            Phase::Brake | Phase::Rest => false,
        };
        let is_due = self.sums.is_some() && self.stretches.len() > SETTLED;
        if !is_due || !self.stretches.last().is_some_and(is_final) {
            return;
        }
        self.name_slower_moves();
        let Some(sums) = &mut self.sums else { return };
        let last = self.stretches.len().saturating_sub(1);
        for raw in self.stretches.drain(..last) {
            sums.add(raw);
        }
    }

    /// Names the limit of the slower move in each stretch that brakes for a slower move. The slower
    /// move comes after the stretch, so its limit is known only now.
    fn name_slower_moves(&mut self) {
        let mut next = None;
        for raw in self.stretches.iter_mut().rev() {
            let limit = raw.stretch.limit;
            if let (
                Limit::Acceleration(axis, Slow::Move(SpeedLimit::Feed)),
                Some(next),
                Phase::Brake,
            ) = (limit, next, raw.stretch.phase)
            {
                raw.stretch.limit = Limit::Acceleration(axis, Slow::Move(next));
            }
            if raw.stretch.phase != Phase::Brake || raw.begins_nominal {
                next = raw.speed_limit;
            }
        }
    }

    /// Corrects the last stretch that moves: it brakes for the end of the job, not because a line
    /// is missing.
    fn name_end(&mut self) {
        let backwards = self.stretches.iter_mut().rev();
        let last = backwards.skip_while(|raw| raw.stretch.phase == Phase::Rest);
        for raw in last.take_while(|raw| raw.stretch.phase == Phase::Brake) {
            if let Limit::Acceleration(axis, Slow::NoLine) = raw.stretch.limit {
                raw.stretch.limit = Limit::Acceleration(axis, Slow::Stop);
            }
        }
    }
}

/// Mean power and mean speed of a piece.
fn mean(piece: &Stretch) -> [f64; 2] {
    [piece.power, piece.speed].map(|[from, to]| (from + to) / 2.0)
}

/// Returns true if the power stays the same from one piece to the next, or follows the speed. If
/// neither, another pixel has begun.
fn is_steady(one: [f64; 2], next: [f64; 2]) -> bool {
    let ([p0, v0], [p1, v1]) = (one, next);
    (p1 - p0).abs() <= STEADY || (p1 * v0 - p0 * v1).abs() <= FOLLOWS * p0 * v1
}

fn rest(begin: Cycle, end: Cycle) -> Stretch {
    Stretch {
        begin,
        end,
        line: 0,
        phase: Phase::Rest,
        length: 0.0,
        speed: [0.0; 2],
        power: [0.0; 2],
        limit: Limit::Rest,
    }
}

impl Observer for Recorder {
    fn move_planned(&mut self, planned: &PlannedMove<'_>) {
        let arc = planned.speed_limit.map(f64::from);
        let rate = planned.rate.into();
        let feed = match planned.kind {
            MoveKind::Rapid => None,
            MoveKind::Feed | MoveKind::Jog | MoveKind::System => Some(planned.feed.into()),
        };
        let limits = self.machine.limits(planned.steps, rate, feed, arc);
        self.planned.push_back((planned.line, limits));
    }

    fn segments_made(&mut self, segments: u32, committed: &dyn Fn() -> Committed) {
        self.made.extend((1..segments).map(|_| None));
        self.made.push_back(Some(committed()));
    }

    fn segment_taken(&mut self, cycle: Cycle, taken: Option<&Taken<'_>>) {
        if self.begun.is_none() {
            self.close(cycle);
        }
        let Some(taken) = taken else {
            self.begun = None;
            // A stop has thrown away all segments that were made but not taken.
            self.made.clear();
            self.speed = 0.0;
            self.running = None;
            return self.add(rest(cycle, cycle), false);
        };
        if let Some(steps) = taken.line {
            self.begin_move(steps);
        }
        let piece = self.begin_piece(cycle, taken);
        match self.made.pop_front().flatten() {
            Some(made) if taken.ends_event => self.end_piece(piece, &made),
            Some(_) | None => self.begun = Some(piece),
        }
    }
}
