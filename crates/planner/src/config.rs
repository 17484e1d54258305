//! The planner's knowledge of the machine, and the numbers derived from it.

use crate::built::JERK;
use crate::ease::Ease;
use crate::path::short::STEPS;
use crate::real::{max, min, norm2, sqrt};
use crate::{Kinematics, StepsPerMm};
use core::array::from_fn;
use leadscrew_stepper::Ticks;

/// The step timer of the F407 board: 84 MHz.
pub const DEFAULT_TIMER_HZ: u32 = 84_000_000;

/// The slowest speed of a move: Grbl's minimum feed of 1 mm/min, in mm/s.
pub(crate) const SLOWEST: f32 = 1.0 / 60.0;

/// The most pixels of a row that motion passes in a second, counted by their mean length. Each
/// pixel is a segment, which the main loop has to make while it takes in lines. A faster row is
/// slowed down, so that segments do not run out (measured: `docs/benchmarks.md`, Lasers).
pub(crate) const PIXELS_A_SECOND: f32 = 12_500.0;

/// The bound of the speed at changes of direction.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CornerRule {
    /// Junction deviation alone, between each move and the next: Grbl's rule, with Grbl's times. On
    /// arcs and curves of short moves the acceleration may then be several times the setting.
    Grbl,
    /// Junction deviation at corners, and `v² ≤ a·R` on arcs and on curves of short moves.
    #[default]
    Limits,
}

/// Settings of the machine, taken over at rest.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Config<const AXES: usize> {
    /// Steps/mm of each axis's motors.
    pub steps_per_mm: [StepsPerMm; AXES],
    /// Highest speed of each axis, mm/s, above 0.
    pub max_rate: [f32; AXES],
    /// Highest acceleration of each axis, mm/s², above 0.
    pub acceleration: [f32; AXES],
    /// Highest jerk along the path, mm/s³; 0 for no limit.
    pub jerk: f32,
    /// The frequency of a vibration that motion along the path does not set off, Hz; 0 for none.
    /// Below 10 Hz it is only weakened.
    pub resonance: f32,
    /// The distance between a corner and the circle that sets its speed, mm.
    pub junction_deviation: f32,
    /// The bound of the speed at corners and on curves.
    pub corner_rule: CornerRule,
    /// The greatest distance of a chord from its arc, mm. For callers that make [`crate::Arc`]s.
    pub arc_tolerance: f32,
    /// Counts of the step timer in a second.
    pub timer_hz: u32,
    /// The shortest time between ticks: no motor steps faster, and step smoothing keeps to it. At
    /// least 1 count, at most the longest segment.
    pub shortest_tick: Ticks,
    /// The longest segment, seconds, 10⁻⁶ to 10⁻³. A hold cannot change a segment that is handed
    /// out; above a millisecond, edges would not be exact. A single step that takes longer is
    /// handed out in several segments.
    pub longest_segment: f32,
    /// The most moves that may be queued, the running one included. No more than the planner's
    /// queue holds.
    pub moves: usize,
    /// The most changes of power that rows of laser pixels may hold together. No more than the
    /// planner's [`crate::PixelQueue`] holds. 0: each line is a move of its own, as in Grbl.
    pub pixels: usize,
}

impl<const AXES: usize> Default for Config<AXES> {
    /// Grbl's defaults: 250 steps/mm, 500 mm/min, 10 mm/s², a junction deviation of 0.01 mm, an arc
    /// tolerance of 0.002 mm. Besides, [`CornerRule::Limits`]; as many moves as there is room for;
    /// no pixels.
    fn default() -> Self {
        Self {
            steps_per_mm: [StepsPerMm::from_nanos(250 * crate::NANOS_PER_MM); AXES],
            max_rate: [500.0 / 60.0; AXES],
            acceleration: [10.0; AXES],
            jerk: 0.0,
            resonance: 0.0,
            junction_deviation: 0.01,
            corner_rule: CornerRule::default(),
            arc_tolerance: 0.002,
            timer_hz: DEFAULT_TIMER_HZ,
            shortest_tick: Ticks(4 * 84), // 4 µs: a tick and its interrupt take less on the F407
            longest_segment: 1e-3,
            moves: usize::MAX,
            pixels: 0,
        }
    }
}

impl<const AXES: usize> Config<AXES> {
    /// The highest step rate of a motor, steps/s.
    pub(crate) fn step_rate(&self) -> f32 {
        self.timer_hz as f32 / self.shortest_tick.0.max(1) as f32
    }

    /// The average over the plan, if the jerk is limited, or if a vibration is not to be set off.
    /// Limits are multiplied by [`MARGIN`].
    fn ease(&self) -> Option<Ease> {
        let steps = self.steps_per_mm.map(|steps| steps.to_f32());
        let rates = from_fn(|axis| min(self.max_rate[axis], self.step_rate() / steps[axis]));
        let accelerations = self.acceleration.map(|a| a * MARGIN);
        let finest = steps.iter().copied().fold(0.0, max);
        let jerk = self.jerk * MARGIN;
        Ease::new(jerk, self.resonance, &rates, &accelerations, finest)
    }

    /// Returns the longest time that any motion takes to stop, seconds. It is the time of the axis
    /// that takes longest by itself: no path of several axes takes longer. The machine asks how
    /// much motion is to wait in the queue.
    pub fn longest_stop(&self) -> f32 {
        let ease = self.ease();
        let (most, mean) = ease.map_or((f32::INFINITY, 0.0), |ease| {
            (ease.acceleration, ease.seconds)
        });
        let axes = self.max_rate.iter().zip(&self.acceleration);
        mean + axes.fold(0.0, |longest: f32, (rate, acceleration)| {
            max(longest, rate / min(*acceleration, most))
        })
    }
}

/// Shares of the programmed speed at which moves run, in per cent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Overrides {
    /// For [`crate::MoveKind::Feed`], 1 to 200; 10 to 200 in Grbl.
    pub feed: u8,
    /// For [`crate::MoveKind::Rapid`], 1 to 100; 25, 50 or 100 in Grbl.
    pub rapid: u8,
}

impl Overrides {
    /// The highest share of a programmed feed, in per cent.
    pub(crate) const HIGHEST_FEED: u8 = 200;
}

impl Default for Overrides {
    fn default() -> Self {
        Self {
            feed: 100,
            rapid: 100,
        }
    }
}

/// [`Move::rounding`](crate::Move::rounding) of numbers with three decimals, mm.
pub const THREE_DECIMALS: f32 = 0.0005;

/// The used share of each limit. The rest, 32 roundings of an `f32`, is more than all roundings
/// between a setting and a ramp together (20 at most): planned motion is within the setting in
/// exact arithmetic.
pub(crate) const MARGIN: f32 = 1.0 - 1.0 / (1 << 19) as f32;

/// The values of a [`Config`] that `push` needs, with the divisions done. Limits are multiplied by
/// [`MARGIN`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits<const AXES: usize> {
    /// The inverse of each highest rate, s/mm.
    pub(crate) per_rate: [f32; AXES],
    /// The highest acceleration of each axis, mm/s².
    pub(crate) acceleration: [f32; AXES],
    /// The inverse of each acceleration, s²/mm.
    pub(crate) per_acceleration: [f32; AXES],
    /// 1/acceleration of the weakest axis, s²/mm.
    pub(crate) per_weakest: f32,
    /// Half a step, mm: how far rounding to steps may have moved a point.
    pub(crate) half_step: [f32; AXES],
    /// The axis with the coarsest steps.
    pub(crate) coarsest: usize,
    /// True if an axis has coarse steps beside another one (see `coarse`).
    pub(crate) is_uneven: bool,
    /// Highest step rate of a motor, steps/s.
    pub(crate) step_rate: f32,
    /// Junction deviation, mm.
    pub(crate) deviation: f32,
    /// The square of the length below which a move has too few steps to give a direction, mm² (see
    /// `short`). With uneven axes it is the greatest such length (see `coarse`).
    pub(crate) short2: f32,
    pub(crate) unit: SpeedUnit,
    ease: Option<Ease>,
}

impl<const AXES: usize> Limits<AXES> {
    pub(crate) fn new(config: &Config<AXES>) -> Self {
        let acceleration = config.acceleration.map(|a| a * MARGIN);
        let per_acceleration = acceleration.map(|a| 1.0 / a);
        let half_step = config.steps_per_mm.map(|scale| 0.5 / scale.to_f32());
        let coarsest = |one: usize, other: usize| match half_step[other] > half_step[one] {
            true => other,
            false => one,
        };
        Self {
            acceleration,
            per_weakest: per_acceleration
                .iter()
                .fold(0.0, |weakest, k| max(weakest, *k)),
            per_acceleration,
            short2: short2(config),
            coarsest: (0..AXES).fold(0, coarsest),
            is_uneven: Self::are_uneven(&half_step),
            half_step,
            per_rate: config.max_rate.map(|rate| 1.0 / (rate * MARGIN)),
            step_rate: config.step_rate(),
            deviation: config.junction_deviation,
            unit: SpeedUnit::for_top_speed(sqrt(norm2(&config.max_rate))),
            ease: config.ease(),
        }
    }

    /// The average over the plan, if the jerk is limited.
    pub(crate) const fn ease(&self) -> Option<&Ease> {
        if JERK {
            self.ease.as_ref()
        } else {
            None
        }
    }
}

/// The square of the length of [`STEPS`] of the coarsest steps, mm².
fn short2<const AXES: usize>(config: &Config<AXES>) -> f32 {
    let steps = config.steps_per_mm.iter().map(|scale| 1.0 / scale.to_f32());
    let length = STEPS as f32 * steps.fold(0.0, max);
    length * length
}

/// The scale of each motor, taken from its axis in [`Config`] once, so that `push` need not look it
/// up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scales<const MOTORS: usize> {
    pub(crate) steps_per_mm: [StepsPerMm; MOTORS],
    /// mm in a step.
    pub(crate) mm_per_step: [f32; MOTORS],
}

impl<const MOTORS: usize> Scales<MOTORS> {
    /// The scale of a motor without an axis, which never moves: any value.
    const NO_AXIS: StepsPerMm = StepsPerMm::from_nanos(crate::NANOS_PER_MM);

    pub(crate) fn new<const AXES: usize>(
        config: &Config<AXES>,
        kinematics: &impl Kinematics<AXES, MOTORS>,
    ) -> Self {
        let steps_per_mm = from_fn(|motor| {
            let scale = config.steps_per_mm.get(kinematics.axis_of(motor));
            scale.copied().unwrap_or(Self::NO_AXIS)
        });
        Self {
            steps_per_mm,
            mm_per_step: steps_per_mm.map(|scale| 1.0 / scale.to_f32()),
        }
    }
}

/// The unit of squared speeds in the look-ahead: a power of two, so that a conversion rounds only
/// once.
///
/// The square of the machine's largest possible speed (all axes at their rate) lies between 2³⁰ and
/// 2³¹ units. So a squared speed is known to 10⁻⁹ of the largest one, and all sums are exact whole
/// numbers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct SpeedUnit {
    /// Units in 1 mm²/s².
    per_mm2: f32,
    /// 1 / `per_mm2`, exact.
    mm2: f32,
}

impl SpeedUnit {
    /// Makes the least unit, a power of two, in which the square of `top` (mm/s) fits 31 bits.
    fn for_top_speed(top: f32) -> Self {
        const ONE: u32 = 127 << 23;
        const EXPONENT: u32 = 0xFF << 23;
        let top_v2 = (top * top).clamp(1e-12, 1e12);
        // `above` is the power of two above `top_v2`; `mm2` is this power divided by 2³¹.
        let above = (top_v2.to_bits() & EXPONENT) + (1 << 23);
        let mm2 = f32::from_bits(above + ONE - ((127 + 31) << 23));
        Self {
            per_mm2: 1.0 / mm2,
            mm2,
        }
    }

    /// Whole units in `v2` mm²/s², rounded down; `u32::MAX` if there are more.
    pub(crate) fn units(self, v2: f32) -> u32 {
        (v2 * self.per_mm2) as u32
    }

    /// Returns `units` in mm²/s².
    pub(crate) fn v2(self, units: u32) -> f32 {
        units as f32 * self.mm2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_top_speed_fills_thirty_one_bits(top in 1e-3f32..1e5) {
            let units = SpeedUnit::for_top_speed(top).units(top * top);
            prop_assert!((1 << 30..=1 << 31).contains(&units), "{}", units);
        }

        #[test]
        fn units_round_down(top in 1e-3f32..1e5, share in 0.0f32..1.0) {
            let unit = SpeedUnit::for_top_speed(top);
            let v2 = top * top * share;
            prop_assert!(unit.v2(unit.units(v2)) <= v2 * 1.000_000_1);
        }
    }

    #[test]
    fn more_than_fits_saturates() {
        let unit = SpeedUnit::for_top_speed(100.0);
        assert_eq!(unit.units(1e30), u32::MAX);
        assert_eq!(unit.units(-1.0), 0);
    }
}
