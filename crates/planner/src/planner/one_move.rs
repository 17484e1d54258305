//! One move by itself: its length, the limits along it, and its nominal speed.

use super::Planner;
use crate::config::{Limits, SpeedUnit, PIXELS_A_SECOND, SLOWEST};
use crate::moves::PlannedMove;
use crate::real::{max, min, norm2, sqrt, worst};
use crate::{Feed, Kinematics, Move, MoveKind, Overrides};

impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Finds length and limits of the planned move for `of`, which has `events` steps of the
    /// dominant motor. Returns its direction. `exact` returns the way that was asked for, mm;
    /// without uneven axes nobody asks.
    pub(super) fn plan(
        &self,
        planned: &mut PlannedMove<AXES, MOTORS>,
        of: &Move<AXES>,
        events: u32,
        exact: impl FnOnce() -> Option<[f32; AXES]>,
    ) -> [f32; AXES] {
        let mut axes_mm = self.axes_mm(planned.delta);
        let exact = if self.limits.is_uneven { exact() } else { None };
        let is_coarse = exact.is_some_and(|exact| self.limits.straighten(&mut axes_mm, &exact));
        let length = sqrt(norm2(&axes_mm));
        let direction = axes_mm.map(|mm| mm / length);
        if is_coarse {
            let component = direction.get(self.limits.coarsest).copied();
            planned.coarse = Limits::<AXES>::share(component.unwrap_or(0.0));
        }
        planned.length = length;
        planned.acceleration = 1.0 / worst(&direction, &self.limits.per_acceleration);
        planned.rate = self.rate(length, events, &direction);
        if let Some(ease) = self.limits.ease() {
            planned.acceleration = min(planned.acceleration, ease.acceleration);
            planned.rate = min(planned.rate, ease.rate());
        }
        planned.feed = match of.feed {
            Feed::Rapid => planned.rate,
            Feed::PerMinute(speed) => speed,
            Feed::InverseTime(per_second) => per_second * length,
        };
        direction
    }

    /// Returns how far each axis goes in the running move, mm; `None` if there is none.
    pub fn running_ways(&self) -> Option<[f32; AXES]> {
        let running = self.queue.running()?;
        Some(self.axes_mm(running.delta))
    }

    /// Returns how far each axis goes if the motors make `delta` steps, mm.
    pub(super) fn axes_mm(&self, delta: [i32; MOTORS]) -> [f32; AXES] {
        let mut motors_mm = [0.0; MOTORS];
        let scales = delta.into_iter().zip(self.scales.mm_per_step);
        for (mm, (steps, mm_per_step)) in motors_mm.iter_mut().zip(scales) {
            *mm = steps as f32 * mm_per_step;
        }
        self.kinematics.axes_mm(&motors_mm)
    }

    /// The highest speed of a move, mm/s, by the rates of the axes and the step rate of the board.
    /// The move has `events` steps of the dominant motor on `length` mm.
    fn rate(&self, length: f32, events: u32, direction: &[f32; AXES]) -> f32 {
        min(
            1.0 / worst(direction, &self.limits.per_rate),
            self.limits.step_rate * (length / events as f32),
        )
    }

    /// The nominal speed of a move at the overrides in force, mm/s.
    pub(crate) fn nominal(&self, planned: &PlannedMove<AXES, MOTORS>) -> f32 {
        nominal(self.overrides, planned)
    }

    /// The speed at which the running move is to cruise, mm/s: its nominal speed. For a row it is
    /// also low enough that the pixels can be prepared in time.
    pub(crate) fn running_nominal(&self) -> f32 {
        self.queue.running().map_or(SLOWEST, |planned| {
            let nominal = self.nominal(planned);
            if planned.pixels == 0 {
                return nominal;
            }
            let pixel = planned.length / f32::from(planned.pixels);
            max(min(nominal, pixel * PIXELS_A_SECOND), SLOWEST)
        })
    }
}

/// The nominal speed of a move, mm/s: the speed asked for, changed by the override and bounded by
/// the rates of the axes.
pub(crate) fn nominal<const AXES: usize, const MOTORS: usize>(
    overrides: Overrides,
    planned: &PlannedMove<AXES, MOTORS>,
) -> f32 {
    let percent = match planned.kind {
        MoveKind::Rapid => overrides.rapid,
        MoveKind::Feed => overrides.feed,
        MoveKind::Jog | MoveKind::System => 100,
    };
    let asked = if percent == 100 {
        planned.feed
    } else {
        planned.feed * f32::from(percent) * 0.01
    };
    let fastest = if planned.has_gaps {
        planned.rate * f32::from(overrides.rapid) * 0.01
    } else {
        planned.rate
    };
    max(min(fastest, asked), SLOWEST)
}

/// The limit of the squared speed at the start of a move, units: by its `corner` (squared speed,
/// units), by its `nominal` speed and by the nominal speed of the move `before` it (mm/s).
pub(super) fn cap(unit: SpeedUnit, before: Option<f32>, nominal: f32, corner: u32) -> u32 {
    let slower = before.map_or(nominal, |before| min(nominal, before));
    corner.min(unit.units(slower * slower))
}
