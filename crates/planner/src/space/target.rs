//! From an exact target of the axes to steps of the motors.
//!
//! Positions are whole numbers of 10⁻⁹ mm. The kinematics turn positions of axes into positions of
//! motors. Steps/mm are an exact decimal, and turn a position of a motor into steps.

use core::array::from_fn;
use core::ops::{Add, Neg, Sub};
use leadscrew_stepper::MotorMask;

/// Coordinate units in a millimetre (or degree).
pub const NANOS_PER_MM: i64 = 1_000_000_000;

/// A position or distance: a whole number of 10⁻⁹ mm (or degrees on a rotary axis), ±9.2·10⁹ mm.
///
/// Sums saturate: a coordinate beyond the range is beyond every machine, and [`StepsPerMm::steps`]
/// refuses it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Coordinate(i64);

impl Coordinate {
    /// The origin.
    pub const ZERO: Self = Self(0);

    /// Makes a coordinate from a number of 10⁻⁹ mm.
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// Returns the coordinate as a number of 10⁻⁹ mm.
    pub const fn nanos(self) -> i64 {
        self.0
    }

    /// Returns the nearest `f32`, in mm.
    #[inline(never)] // inlined, a record of four motors takes 436 bytes more
    pub fn to_mm(self) -> f32 {
        let nanos = NANOS_PER_MM;
        (self.0 / nanos) as f32 + (self.0 % nanos) as f32 / nanos as f32
    }

    /// Makes a coordinate from mm, exact to 10⁻⁹ mm or the resolution of `f32`. `None` if `mm` is
    /// not a number, infinite, or beyond ±2·10⁹ mm.
    pub fn from_mm(mm: f32) -> Option<Self> {
        (mm.abs() <= 2e9).then(|| Self::near(mm))
    }

    /// As [`Coordinate::from_mm`] for lengths that are known to be numbers; saturates beyond
    /// ±2·10⁹ mm.
    pub(crate) fn near(mm: f32) -> Self {
        let whole = mm as i32;
        let rest = ((mm - whole as f32) * NANOS_PER_MM as f32) as i32;
        Self(i64::from(whole) * NANOS_PER_MM + i64::from(rest))
    }

    /// Returns half of the coordinate, rounded towards zero.
    pub const fn half(self) -> Self {
        Self(self.0 / 2)
    }
}

impl Add for Coordinate {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for Coordinate {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl Neg for Coordinate {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.saturating_neg())
    }
}

/// Says which motors move which axes: a linear map between axes and motors and its inverse. There
/// are at least as many motors as axes.
///
/// Limits apply to axes, Bresenham's tracer to motors. The maps are linear, so that a straight move
/// is straight in both, and a map of positions is also one of differences.
///
/// ```text
///             axes     motors
///  Cartesian  X ------ 0           one motor an axis
///  CoreXy     X, Y --- 0, 1        two belts, each of them moved by both axes
///  Ganged     X ------ 0
///             Y --+--- 1           two motors on one axis
///                 +--- 2
/// ```
///
/// Ganged motors have the same steps at the same ticks: the tracer has the same numbers for both.
/// Only a motor lock (homing) tells them apart.
pub trait Kinematics<const AXES: usize, const MOTORS: usize> {
    /// The axis whose steps/mm `motor` has. A motor beyond the axes turns with that axis.
    fn axis_of(&self, motor: usize) -> usize {
        motor
    }

    /// Axes that share motors (CoreXY), by axis number: one of these motors turns for each of the
    /// axes. The axes home one by one, and a limit switch of any of them stops all of these motors.
    fn sharing(&self) -> MotorMask {
        MotorMask::NONE
    }

    /// Places of the motors for the places `axes` of the axes.
    fn motors(&self, axes: &[Coordinate; AXES]) -> [Coordinate; MOTORS];

    /// Places of the axes, mm, for the places `motors` of the motors, mm. The map is linear, so it
    /// also turns distances of motors into distances of axes.
    fn axes_mm(&self, motors: &[f32; MOTORS]) -> [f32; AXES];

    /// Places of the axes for the places `motors` of the motors.
    fn axes(&self, motors: &[Coordinate; MOTORS]) -> [Coordinate; AXES];
}

/// One motor an axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Cartesian;

impl<const N: usize> Kinematics<N, N> for Cartesian {
    fn motors(&self, axes: &[Coordinate; N]) -> [Coordinate; N] {
        *axes
    }

    fn axes_mm(&self, motors: &[f32; N]) -> [f32; N] {
        *motors
    }

    fn axes(&self, motors: &[Coordinate; N]) -> [Coordinate; N] {
        *motors
    }
}

/// Two crossed belts: motor 0 turns by `x + y`, motor 1 by `x − y`; all other axes have a motor
/// each.
///
/// Source: <https://corexy.com/theory.html>.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct CoreXy;

impl<const N: usize> Kinematics<N, N> for CoreXy {
    fn sharing(&self) -> MotorMask {
        MotorMask::only(0).with(MotorMask::only(1))
    }

    fn motors(&self, axes: &[Coordinate; N]) -> [Coordinate; N] {
        let mut motors = *axes;
        if let [a, b, ..] = motors.as_mut_slice() {
            (*a, *b) = (*a + *b, *a - *b);
        }
        motors
    }

    fn axes_mm(&self, motors: &[f32; N]) -> [f32; N] {
        let mut axes = *motors;
        if let [x, y, ..] = axes.as_mut_slice() {
            (*x, *y) = (0.5 * (*x + *y), 0.5 * (*x - *y));
        }
        axes
    }

    fn axes(&self, motors: &[Coordinate; N]) -> [Coordinate; N] {
        let mut axes = *motors;
        if let [x, y, ..] = axes.as_mut_slice() {
            (*x, *y) = ((*x + *y).half(), (*x - *y).half());
        }
        axes
    }
}

/// As [`Cartesian`], but motor `AXES + k` turns together with the motor of axis `axis_of[k]`.
///
/// The axis stands at the count of its own motor, which has the axis's number. A missing axis
/// stands still.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Ganged<const MORE: usize> {
    /// The axis of each motor beyond the axes.
    pub axis_of: [usize; MORE],
}

impl<const AXES: usize, const MOTORS: usize, const MORE: usize> Kinematics<AXES, MOTORS>
    for Ganged<MORE>
{
    fn axis_of(&self, motor: usize) -> usize {
        let more = motor.checked_sub(AXES);
        let axis = more.and_then(|more| self.axis_of.get(more));
        axis.copied().unwrap_or(motor)
    }

    fn motors(&self, axes: &[Coordinate; AXES]) -> [Coordinate; MOTORS] {
        let axis_of = |motor| Kinematics::<AXES, MOTORS>::axis_of(self, motor);
        from_fn(|motor| axes.get(axis_of(motor)).copied().unwrap_or_default())
    }

    fn axes_mm(&self, motors: &[f32; MOTORS]) -> [f32; AXES] {
        from_fn(|axis| motors.get(axis).copied().unwrap_or_default())
    }

    fn axes(&self, motors: &[Coordinate; MOTORS]) -> [Coordinate; AXES] {
        from_fn(|axis| motors.get(axis).copied().unwrap_or_default())
    }
}

/// The number of steps that a motor takes in a millimetre: an exact decimal in 10⁻⁹ steps/mm.
///
/// A target in steps is `coordinate · steps/mm`, rounded once, half away from zero. Both factors
/// are decimals with nine places, so the product is a whole number of 10⁻¹⁸ steps in 128 bits and
/// nothing accumulates from move to move.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StepsPerMm(u64);

/// 5¹⁸, the odd factor of 10¹⁸. A product of two decimals, divided by 10¹⁸, is a number of steps.
const ODD: u64 = 3_814_697_265_625;
/// The exponent of the factor 2¹⁸ of 10¹⁸.
const EVEN_BITS: u32 = 18;
/// From this value of the upper 64 bits on, a product is more than 2³¹ steps. A smaller product
/// plus half a step is below 2⁹¹.
const TOO_MUCH: u64 = (1 << 27) - 1;
/// Half a step, in 10⁻¹⁸ steps.
const HALF: u128 = 500_000_000_000_000_000;
/// The greatest scale, 10⁻⁹ steps/mm: a thousand times this value fits 64 bits.
const GREATEST: u64 = (1 << 54) - 1;

impl StepsPerMm {
    /// Makes a scale from a number of 10⁻⁹ steps/mm. No machine has 0 steps/mm or less: such a
    /// scale is 0, and [`Config::validate`](crate::Config::validate) refuses it. More than 18
    /// million steps/mm are beyond every machine, and become as many.
    pub const fn from_nanos(nanos: i64) -> Self {
        if nanos < 0 {
            return Self(0);
        }
        let nanos = nanos.unsigned_abs();
        Self(if nanos > GREATEST { GREATEST } else { nanos })
    }

    /// Returns the scale as a number of 10⁻⁹ steps/mm.
    pub const fn nanos(self) -> u64 {
        self.0
    }

    /// Returns the nearest `f32`, in steps/mm.
    pub fn to_f32(self) -> f32 {
        let nanos = NANOS_PER_MM as u64;
        (self.0 / nanos) as f32 + (self.0 % nanos) as f32 / nanos as f32
    }

    /// Returns the exact number of steps at `coordinate`, rounded half away from zero; `None`
    /// beyond `i32`.
    pub fn steps(self, coordinate: Coordinate) -> Option<i32> {
        let product = u128::from(coordinate.0.unsigned_abs()) * u128::from(self.0);
        // A comparison of the upper half excludes large excesses with less work than one of 128
        // bits.
        if (product >> 64) as u64 >= TOO_MUCH {
            return None;
        }
        let steps = divide_by_odd((product + HALF) >> EVEN_BITS);
        let steps = i32::try_from(steps).ok()?;
        Some(if coordinate.0 < 0 { -steps } else { steps })
    }

    /// Returns the coordinate nearest to `steps`; the origin if the scale is 0.
    ///
    /// A long division in base 1000. Its first quotient has nine of the 18 decimals of 10¹⁸. Each
    /// remainder is less than the scale, below 2⁵⁴, so that a thousand times the remainder fits 64
    /// bits.
    pub fn coordinate(self, steps: i32) -> Coordinate {
        if self.0 == 0 {
            return Coordinate::ZERO;
        }
        let dividend = u64::from(steps.unsigned_abs()) * NANOS_PER_MM as u64;
        let (mut quotient, mut remainder) = (dividend / self.0, dividend % self.0);
        for _ in 0..3 {
            let further = remainder * 1000;
            quotient = quotient
                .saturating_mul(1000)
                .saturating_add(further / self.0);
            remainder = further % self.0;
        }
        let nearest = quotient.saturating_add(u64::from(remainder >= self.0 - remainder));
        let nanos = i64::try_from(nearest).unwrap_or(i64::MAX);
        Coordinate(if steps < 0 { -nanos } else { nanos })
    }
}

/// The whole part of `x / 5¹⁸`, for `x` below 2⁷³.
///
/// The top 32 bits of `x` times the reciprocal are an estimate that is too small by 2 at most: by
/// 0.58 for the bits below the top, by 1 for the rounding of the reciprocal, and by the rounding of
/// the product. Two comparisons with the remainder correct the estimate. The compiler would turn a
/// loop into a division. (Its 128-bit division costs twenty times as much.)
fn divide_by_odd(x: u128) -> u32 {
    const TOP: u32 = 41;
    const RECIPROCAL: u64 = ((1u128 << (TOP + 32)) / ODD as u128) as u64;
    let top = (x >> TOP) as u32;
    let quotient = (u64::from(top) * RECIPROCAL) >> 32;
    // The remainder is below 3·5¹⁸: the low 64 bits are enough.
    let remainder = (x as u64).wrapping_sub(quotient.wrapping_mul(ODD));
    quotient as u32 + u32::from(remainder >= ODD) + u32::from(remainder >= 2 * ODD)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn crossed_belts_turn_by_sum_and_difference_and_back() {
        let axes = [3.0, -1.0, 7.0].map(Coordinate::near);
        let motors = CoreXy.motors(&axes);
        assert_eq!(motors, [2.0, 4.0, 7.0].map(Coordinate::near));
        assert_eq!(CoreXy.axes(&motors), axes);
        assert_eq!(CoreXy.axes_mm(&[2.0, 4.0, 7.0]), [3.0, -1.0, 7.0]);
    }

    #[test]
    fn a_second_motor_turns_with_its_axis_which_stands_where_the_first_one_does() {
        let ganged = Ganged { axis_of: [1] };
        let [x, y, twin] = [3.0, -1.0, 7.0].map(Coordinate::near);
        assert_eq!(ganged.motors(&[x, y]), [x, y, y]);
        assert_eq!(ganged.axes(&[x, y, twin]), [x, y]);
        let axis_of = |motor| Kinematics::<2, 3>::axis_of(&ganged, motor);
        assert_eq!([0, 1, 2].map(axis_of), [0, 1, 1]);
    }

    /// Rounds half away from zero, computed directly in 128-bit integers.
    fn by_the_book(nanos: i64, scale: i64) -> Option<i32> {
        let product = i128::from(nanos) * i128::from(scale);
        let whole = (product.abs() + HALF as i128) / (2 * HALF as i128);
        i32::try_from(whole * product.signum()).ok()
    }

    #[test]
    fn half_a_step_rounds_away_from_zero() {
        let scale = StepsPerMm::from_nanos(250 * NANOS_PER_MM);
        assert_eq!(scale.steps(Coordinate::from_nanos(2_000_000)), Some(1));
        assert_eq!(scale.steps(Coordinate::from_nanos(-2_000_000)), Some(-1));
        assert_eq!(scale.steps(Coordinate::from_nanos(1_999_999)), Some(0));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let scale = StepsPerMm::from_nanos(NANOS_PER_MM);
        let far = Coordinate::from_nanos(i64::from(i32::MAX) * NANOS_PER_MM);
        assert_eq!(scale.steps(far), Some(i32::MAX));
        assert_eq!(scale.steps(far + Coordinate::near(1.0)), None);
        let huge = StepsPerMm::from_nanos(i64::MAX);
        assert_eq!(huge.steps(Coordinate::from_nanos(i64::MIN)), None);
    }

    #[test]
    fn a_million_relative_moves_end_where_their_sum_says() {
        let scale = StepsPerMm::from_nanos(80_370_000_000);
        let tenth = Coordinate::from_nanos(100_000_000);
        let (mut target, mut position, mut moved) = (Coordinate::ZERO, 0i32, 0i64);
        for _ in 0..1_000_000 {
            target = target + tenth;
            let steps = scale.steps(target).unwrap();
            moved += i64::from(steps - position);
            position = steps;
        }
        assert_eq!(moved, 8_037_000);
    }

    #[test]
    fn chords_keep_their_millimetres() {
        assert_eq!(
            Coordinate::from_mm(-12.5),
            Some(Coordinate::from_nanos(-12_500_000_000))
        );
        assert_eq!(Coordinate::from_nanos(1_250_000_000).to_mm(), 1.25);
    }

    #[test]
    fn mm_that_are_no_place_are_no_coordinate() {
        for mm in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 2.1e9, -1e30] {
            assert_eq!(Coordinate::from_mm(mm), None, "{mm}");
        }
        let far = Coordinate::from_nanos(-2_000_000_000 * NANOS_PER_MM);
        assert_eq!(Coordinate::from_mm(-2e9), Some(far));
        assert_eq!(Coordinate::from_mm(-0.0), Some(Coordinate::ZERO));
    }

    /// The nearest coordinate, computed directly in 128-bit integers.
    fn coordinate_by_the_book(steps: i32, scale: i64) -> i64 {
        let twice = 4 * HALF * u128::from(steps.unsigned_abs()) / u128::from(scale.unsigned_abs());
        let nearest = i64::try_from(twice.div_ceil(2)).unwrap_or(i64::MAX);
        nearest * i64::from(steps.signum())
    }

    proptest! {
        #[test]
        fn a_coordinate_is_the_nearest_one(steps: i32, scale in 1i64..1 << 54) {
            let coordinate = StepsPerMm::from_nanos(scale).coordinate(steps);
            prop_assert_eq!(coordinate.nanos(), coordinate_by_the_book(steps, scale));
        }

        #[test]
        fn a_coordinate_of_a_machine_is_the_nearest_one(
            steps in -100_000_000i32..100_000_000,
            scale in NANOS_PER_MM / 100..20_000 * NANOS_PER_MM,
        ) {
            let coordinate = StepsPerMm::from_nanos(scale).coordinate(steps);
            prop_assert_eq!(coordinate.nanos(), coordinate_by_the_book(steps, scale));
        }

        #[test]
        fn steps_agree_with_rational_arithmetic(
            nanos in any::<i64>(),
            scale in 0i64..20_000 * NANOS_PER_MM,
        ) {
            let steps = StepsPerMm::from_nanos(scale).steps(Coordinate(nanos));
            prop_assert_eq!(steps, by_the_book(nanos, scale));
        }

        #[test]
        fn steps_agree_near_the_machine(
            nanos in -3_000 * NANOS_PER_MM..3_000 * NANOS_PER_MM,
            scale in 0i64..20_000 * NANOS_PER_MM,
        ) {
            let steps = StepsPerMm::from_nanos(scale).steps(Coordinate(nanos));
            prop_assert_eq!(steps, by_the_book(nanos, scale));
        }

        #[test]
        fn steps_to_coordinate_and_back(
            steps in -100_000_000i32..100_000_000,
            scale in NANOS_PER_MM / 100..20_000 * NANOS_PER_MM,
        ) {
            let scale = StepsPerMm::from_nanos(scale);
            prop_assert_eq!(scale.steps(scale.coordinate(steps)), Some(steps));
        }
    }
}
