//! The plan under a jerk limit, which is ahead of the segments.
//!
//! ```text
//!   moves:    A          | B               | C
//!   plan:     ...............................s      a place each h
//!   tool:     ............v                         the mean of the last N places
//! ```
//!
//! The plan is that of motion without a jerk limit: ramps of constant acceleration. It goes on only
//! when a segment needs to know more of the tool's way. So a hold or an override changes the plan as
//! soon as it changes motion without a jerk limit.

use super::running::drive::{Aim, Drive, Goal};
use super::running::{Running, Timing};
use crate::ease::Ease;
use crate::real::sqrt;
use crate::speed::mean::{Piece, Ring};
use crate::{Kinematics, Planner, Trapezoid};

/// The plan's place in the queue, and its last places.
#[derive(Clone, Debug)]
pub(crate) struct Lead {
    /// The place in the move that the plan is in, and its profile. `None` between moves.
    drive: Option<(Drive, Trapezoid)>,
    /// The length of that move, units.
    length: u64,
    /// The length of one of its steps, in 2⁻³² units.
    per_step: u64,
    /// The way in it up to the newest place, units, modulo 2³².
    placed: u32,
    /// Squared speed at the end of the last move, mm²/s².
    exit_v2: f32,
    /// True if the plan rests, because a move or a stop has ended.
    rests: bool,
    /// True if the plan has moved within the time over which it is averaged.
    is_ahead: bool,
    /// The time over which the plan is averaged, seconds.
    seconds: f32,
    ring: Ring,
}

impl Lead {
    /// A plan at rest.
    pub(crate) const fn new() -> Self {
        Self {
            drive: None,
            length: 0,
            per_step: 0,
            placed: 0,
            exit_v2: 0.0,
            rests: true,
            is_ahead: false,
            seconds: 0.0,
            ring: Ring::new(),
        }
    }

    /// Returns true if the tool has not reached the plan yet.
    pub(crate) const fn is_ahead(&self) -> bool {
        self.is_ahead
    }

    /// Returns true if the plan moves, or has stood so shortly that the tool moves still. Without a
    /// jerk limit it never does.
    pub(crate) const fn is_under_way(&self) -> bool {
        !self.rests || self.is_ahead
    }

    /// Makes the plan of the move under way anew.
    pub(crate) fn plan_anew(&mut self) {
        if let Some((drive, _)) = &mut self.drive {
            drive.outlook = None;
        }
    }

    /// The time to the end of the plan's profile, and for which the plan stands before and after it,
    /// s; the speed at that end, mm/s; the steps of the move that follow.
    #[inline(never)]
    pub(crate) fn rest(&self, ease: &Ease) -> (f32, f32, u32) {
        let stands = match self.rests {
            true => self.ring.stands(ease),
            false => 0.0,
        };
        let Some((drive, profile)) = &self.drive else {
            return (stands, sqrt(self.exit_v2), 0);
        };
        let steps = drive.here.before(profile.end());
        let speed = sqrt(profile.speed_v2_at(drive.here));
        let (seconds, _) = profile.time_over(drive.here, speed, steps);
        let end = sqrt(drive.mm2(profile.exit_v2()));
        let rests = if end > 0.0 { 0.0 } else { ease.seconds };
        (stands + seconds + rests, end, drive.events - profile.end())
    }

    /// Begins the next move, if there is one.
    pub(crate) fn begin<K, const AXES: usize, const MOTORS: usize>(
        &mut self,
        planner: &mut Planner<'_, K, AXES, MOTORS>,
        ease: &Ease,
    ) -> bool
    where
        K: Kinematics<AXES, MOTORS>,
    {
        let next = planner.start_next();
        self.drive = next.map(|next| {
            let drive = Drive::new(next, next.events());
            let profile = drive.begun(next.rate, self.exit_v2);
            (drive, profile)
        });
        let (length, events) = next.map_or((0, 1), |next| {
            (ease.units(next.length), u64::from(next.events()))
        });
        let (whole, rest) = (length / events, length % events);
        (self.length, self.per_step) = (length, (whole << 32) + (rest << 32) / events);
        self.placed = 0;
        self.drive.is_some()
    }

    /// Goes on as far as the next segment of `running` needs. `None` if nothing moves.
    #[inline(never)]
    pub(crate) fn extend<K, const AXES: usize, const MOTORS: usize>(
        &mut self,
        planner: &mut Planner<'_, K, AXES, MOTORS>,
        goal: Goal,
        running: &mut Running<MOTORS>,
        timing: Timing,
    ) -> Option<()>
    where
        K: Kinematics<AXES, MOTORS>,
    {
        let ease = planner.ease()?;
        while running.needs_more(timing) {
            running.extend(self.next(planner, goal, &ease)?);
        }
        Some(())
    }

    /// The next piece of the tool's way. `None` if neither plan nor tool moves.
    fn next<K, const AXES: usize, const MOTORS: usize>(
        &mut self,
        planner: &mut Planner<'_, K, AXES, MOTORS>,
        goal: Goal,
        ease: &Ease,
    ) -> Option<Piece>
    where
        K: Kinematics<AXES, MOTORS>,
    {
        if self.seconds != ease.seconds {
            // Settings change at rest.
            (self.ring, self.seconds) = (Ring::new(), ease.seconds);
        }
        let still = self.ring.is_still(ease);
        // At a rest the plan stands until the tool rests too.
        let stands = self.rests && (!still || goal == Goal::Stop);
        let begins = !stands && (self.drive.is_some() || self.begin(planner, ease));
        let way = if begins {
            self.go(planner, goal, ease)?
        } else {
            0
        };
        if still && !begins {
            return None;
        }
        let piece = self.ring.push(way, self.rests, ease);
        self.is_ahead = !self.ring.is_still(ease);
        Some(piece)
    }

    /// Goes on for the time from one place to the next, or to a rest. Returns the way, units.
    fn go<K, const AXES: usize, const MOTORS: usize>(
        &mut self,
        planner: &mut Planner<'_, K, AXES, MOTORS>,
        goal: Goal,
        ease: &Ease,
    ) -> Option<u16>
    where
        K: Kinematics<AXES, MOTORS>,
    {
        let (mut seconds, mut way) = (ease.between, 0u32);
        self.rests = false;
        while seconds > 0.0 && !self.rests {
            if self.drive.is_none() && !self.begin(planner, ease) {
                self.rests = true;
                break;
            }
            let (drive, profile) = self.drive.as_mut()?;
            let outlook = planner.outlook(|| drive.whereabouts(profile));
            if drive.outlook != Some(outlook) {
                let course = planner.course(drive.whereabouts(profile), outlook)?;
                *profile = drive.planned(profile, Aim::new(goal, planner, &course));
                drive.outlook = Some(outlook);
            }
            (drive.here, seconds) = profile.advance(drive.here, seconds);
            let placed = drive.way(self.length, self.per_step) as u32;
            way += placed.wrapping_sub(self.placed);
            self.placed = placed;
            if drive.here.step() < profile.end() {
                continue;
            }
            self.exit_v2 = drive.mm2(profile.exit_v2());
            self.rests = self.exit_v2 <= 0.0;
            drive.outlook = None;
            if drive.at_end() {
                planner.pass();
                self.drive = None;
            }
        }
        Some(way.min(u16::MAX.into()) as u16)
    }
}
