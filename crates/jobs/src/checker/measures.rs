//! Lengths that follow from the settings. The checker needs them at each line, and computes them
//! once: divisions at each line took 20 to 30 % of the instructions of a check (`callgrind`,
//! docs/benchmarks.md).

use super::{mm, Checker, Finding, LineFaultKind};
use leadscrew_machine::home::{self, Bounds};
use leadscrew_machine::settings::table::AxisSetting;
use leadscrew_machine::settings::values::Settings;
use leadscrew_planner::{Coordinate, StepsPerMm};
use leadscrew_stepper::MAX_STEP_EVENTS;

/// Lengths that follow from the settings, for each axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measures<const AXES: usize> {
    /// The steps/mm of each axis.
    pub(super) scales: [StepsPerMm; AXES],
    /// The farthest coordinates whose steps can be counted: the machine itself has the same limits.
    pub(super) reach: [Coordinate; AXES],
    /// The ends of the travel, as the machine has them.
    pub(super) ends: [Bounds; AXES],
    /// The length of the travel.
    pub(super) travel: [Coordinate; AXES],
    /// A move of this length has steps that can be counted, if its ends are within reach.
    short: [Coordinate; AXES],
}

impl<const AXES: usize> Measures<AXES> {
    pub(super) fn new(settings: &Settings<AXES>) -> Self {
        let steps = settings.axes(AxisSetting::StepsPerMm);
        let scales = steps.map(|steps| StepsPerMm::from_nanos(steps.nanos()));
        let reach = scales.map(|scale| scale.coordinate(1 << 30));
        let ends = home::bounds(settings, &reach);
        // Both ends of a move are rounded to steps.
        let most = i32::try_from(MAX_STEP_EVENTS).unwrap_or(i32::MAX) - 2;
        Self {
            scales,
            reach,
            ends,
            travel: ends.map(Bounds::travel),
            short: scales.map(|scale| scale.coordinate(most)),
        }
    }

    /// Returns true if a move has more steps than the stepper can count, [`MAX_STEP_EVENTS`].
    pub(super) fn is_too_long(&self, from: &[Coordinate; AXES], to: &[Coordinate; AXES]) -> bool {
        (0..AXES).any(|axis| {
            let (from, to, reach) = (from[axis], to[axis], self.reach[axis]);
            let is_near = |at: Coordinate| at.max(Coordinate::ZERO - at) <= reach;
            let way = from.max(to) - from.min(to);
            if way <= self.short[axis] && is_near(from) && is_near(to) {
                return false;
            }
            let scale = self.scales[axis];
            let ends = scale.steps(from).zip(scale.steps(to));
            ends.is_none_or(|(from, to)| from.abs_diff(to) > MAX_STEP_EVENTS)
        })
    }
}

impl<const AXES: usize> Checker<AXES> {
    /// Checks that the steps of a move can be counted. A move with too many steps is a fault.
    pub(super) fn check_length(
        &self,
        from: &[Coordinate; AXES],
        to: &[Coordinate; AXES],
    ) -> Finding {
        match self.measures.is_too_long(from, to) {
            true => Err((LineFaultKind::TooLong, None)),
            false => Ok(()),
        }
    }

    /// Takes over settings that have changed. The motors stay where they are, so the program's
    /// position changes with their steps/mm.
    pub(super) fn learn_settings(&mut self) {
        let steps = self.steps();
        self.measures = Measures::new(&self.settings);
        self.stand_at(steps);
        self.learn_rates();
    }

    /// The motors' places, in steps; `None` for an axis whose steps cannot be counted.
    fn steps(&self) -> [Option<i32>; AXES] {
        let scales = &self.measures.scales;
        std::array::from_fn(|axis| scales[axis].steps(self.interpreter.position()[axis]))
    }

    /// Moves the program's position to the place at which the motors stand at these steps.
    fn stand_at(&mut self, steps: [Option<i32>; AXES]) {
        if self.steps() == steps {
            return;
        }
        let mut place = *self.interpreter.position();
        for (axis, scale) in self.measures.scales.iter().enumerate() {
            place[axis] = steps[axis].map_or(place[axis], |steps| scale.coordinate(steps));
        }
        self.interpreter.set_position(place);
        self.path.resume_at(mm(&place));
    }
}
