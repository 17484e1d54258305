//! G2 and G3: an arc as chords.
//!
//! ```text
//!        .-'''-.  chord        φ: the angle that the chord spans
//!      .' _____ '.             r: the radius
//!     / .'     '. \            t: the tolerance
//! ```
//!
//! A chord stays within `r·(1 − cos φ/2)` of the circle. For the tolerance this gives, to first
//! order in `t/r`,
//!
//! ```text
//!   φ = 2·√(t·(2r − t)) / r        n = ⌊ |angle|·r / (2·√(t·(2r − t))) ⌋ chords
//! ```
//!
//! That count is Grbl's, so that programs take the same steps. It is rounded down, so it overshoots
//! the tolerance by the factor `((n + 1)/n)²` at most. The other axes move in proportion (helix).
//!
//! Each chord's end is the start rotated about the centre, in `f32` relative to the centre: it is
//! exact to 4·10⁻⁷ of the radius. The end of the last chord is the exact end of the arc.

use crate::path::trigonometry::sin_cos;
use crate::real::{norm2, sqrt};
use crate::valid::ABOVE_ZERO;
use crate::{Coordinate, Curve};
use core::f32::consts::TAU;
use core::fmt;

/// Yields the ends of an arc's chords, the last one the arc's exact end.
#[derive(Clone, Debug)]
pub struct Arc<const AXES: usize> {
    start: [Coordinate; AXES],
    end: [Coordinate; AXES],
    /// `end − start`, mm.
    travel: [f32; AXES],
    plane: (usize, usize),
    centre: [Coordinate; 2],
    /// From the centre to the start, mm.
    spoke: [f32; 2],
    radius: f32,
    /// The angle from start to end, radians, positive counter-clockwise.
    angle: f32,
    chords: u32,
    made: u32,
}

/// The most chords of an arc. An `f32` counts no further, and ends of more chords would be less than
/// their rounding apart.
const MOST_CHORDS: u32 = 1 << 24;

/// The value with which an [`Arc`] cannot be drawn.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ArcError {
    /// The plane's axes are not two different axes of the machine.
    Plane,
    /// The tolerance is not within 10⁻¹² to 10¹⁰ mm.
    Tolerance,
}

impl fmt::Display for ArcError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Plane => "the arc's plane has no two different axes",
            Self::Tolerance => "the arc's tolerance is not above 0 mm",
        })
    }
}

impl core::error::Error for ArcError {}

/// Angles closer to 0 than this are full circles (Grbl: 5·10⁻⁷ rad).
const FULL_CIRCLE: f32 = 5e-7;

impl<const AXES: usize> Arc<AXES> {
    /// Makes the arc from `start` to `end`.
    ///
    /// `offset` leads from the start to the centre along the two axes of `plane` (first and second,
    /// so that counter-clockwise is from first to second); all other axes move in proportion.
    /// `tolerance` is in mm. If the ends coincide in the plane, the arc is a full circle.
    ///
    /// # Errors
    /// [`ArcError`]: the plane or the tolerance is none.
    pub fn new(
        start: [Coordinate; AXES],
        end: [Coordinate; AXES],
        offset: [Coordinate; 2],
        plane: (usize, usize),
        clockwise: bool,
        tolerance: f32,
    ) -> Result<Self, ArcError> {
        if plane.0 == plane.1 || plane.0.max(plane.1) >= AXES {
            return Err(ArcError::Plane);
        }
        if !ABOVE_ZERO.contains(&tolerance) {
            return Err(ArcError::Tolerance);
        }
        let ([x0, y0], [x1, y1]) = (pick(&start, plane), pick(&end, plane));
        let centre = [x0 + offset[0], y0 + offset[1]];
        let spoke = offset.map(|offset| -offset.to_mm());
        let radius = sqrt(norm2(&spoke));
        let to = [x1 - centre[0], y1 - centre[1]].map(Coordinate::to_mm);
        let angle = angle_between(spoke, to, clockwise);
        let mut travel = [0.0; AXES];
        for (travel, (end, start)) in travel.iter_mut().zip(end.iter().zip(&start)) {
            *travel = (*end - *start).to_mm();
        }
        Ok(Self {
            start,
            end,
            travel,
            plane,
            centre,
            spoke,
            radius,
            angle,
            chords: chords(angle, radius, tolerance),
            made: 0,
        })
    }

    /// Returns the same arc with this many whole turns before it, which the other axes share.
    /// `tolerance`: as in [`Arc::new`].
    #[must_use]
    pub fn with_turns(mut self, turns: u8, tolerance: f32) -> Self {
        if turns > 0 {
            let more = f32::from(turns) * TAU;
            self.angle += if self.angle < 0.0 { -more } else { more };
            self.chords = chords(self.angle, self.radius, tolerance);
        }
        self
    }

    /// Returns the curve that the chords belong to, for their moves. `acceleration`: see
    /// [`Curve::acceleration`]. `None` if the radius is 0: the arc is one chord.
    pub fn curve(&self, acceleration: f32) -> Option<Curve> {
        let radius = self.radius;
        (radius > 0.0).then_some(Curve {
            radius,
            acceleration,
        })
    }

    /// Returns the radius at the start, mm.
    pub const fn radius(&self) -> f32 {
        self.radius
    }

    /// Returns the number of chords, at least 1. In G93 each chord takes the same share of the
    /// arc's time.
    pub const fn chords(&self) -> u32 {
        self.chords
    }

    /// Returns the angle from start to end, radians, positive counter-clockwise.
    pub const fn angle(&self) -> f32 {
        self.angle
    }

    /// Ends of chords among which are the lowest and the highest in each axis of the plane, and the
    /// end of the arc: for those who ask only how far it reaches. The start is not among them.
    pub fn extremes(&self) -> impl Iterator<Item = [Coordinate; AXES]> + '_ {
        let begin = libm::atan2f(self.spoke[1], self.spoke[0]);
        let (all, each) = (self.angle.abs(), (self.angle / self.chords as f32).abs());
        let quarters = [0.0, 1.0, 2.0, 3.0].map(move |quarter| {
            let way = quarter * (0.25 * TAU) - begin;
            let way = if self.angle < 0.0 { -way } else { way };
            // `begin` is within half a turn.
            if way < 0.0 {
                way + TAU
            } else if way >= TAU {
                way - TAU
            } else {
                way
            }
        });
        let passed = quarters.into_iter().filter(move |way| *way < all);
        let chords = passed.flat_map(move |way| {
            let before = (way / each) as u32;
            [before, before + 1]
        });
        // The end may be nearer to the centre than all chords before it.
        let chords = chords.chain(core::iter::once(self.chords.saturating_sub(1)));
        let inner = chords.filter(|chord| (1..self.chords).contains(chord));
        inner
            .map(|chord| self.point(chord))
            .chain(core::iter::once(self.end))
    }

    /// The end of chord number `made`, counted from 1.
    fn point(&self, made: u32) -> [Coordinate; AXES] {
        let share = made as f32 / self.chords as f32;
        let (sin, cos) = sin_cos(self.angle * share);
        let [x, y] = self.spoke;
        let turned = [x * cos - y * sin, x * sin + y * cos];
        let mut point = self.start;
        for (axis, (point, travel)) in point.iter_mut().zip(&self.travel).enumerate() {
            *point = if axis == self.plane.0 {
                self.centre[0] + Coordinate::near(turned[0])
            } else if axis == self.plane.1 {
                self.centre[1] + Coordinate::near(turned[1])
            } else {
                *point + Coordinate::near(travel * share)
            };
        }
        point
    }
}

impl<const AXES: usize> Iterator for Arc<AXES> {
    type Item = [Coordinate; AXES];

    fn next(&mut self) -> Option<Self::Item> {
        if self.made >= self.chords {
            return None;
        }
        self.made += 1;
        Some(if self.made == self.chords {
            self.end
        } else {
            self.point(self.made)
        })
    }
}

/// The angle from `from` to `to` in the direction of rotation, radians; a full turn if they
/// coincide.
fn angle_between(from: [f32; 2], to: [f32; 2], clockwise: bool) -> f32 {
    let cross = from[0] * to[1] - from[1] * to[0];
    let dot = from[0] * to[0] + from[1] * to[1];
    let angle = libm::atan2f(cross, dot);
    if clockwise && angle >= -FULL_CIRCLE {
        angle - TAU
    } else if !clockwise && angle <= FULL_CIRCLE {
        angle + TAU
    } else {
        angle
    }
}

/// Returns how many chords, at least 1, fit into an arc by `angle` if each is `tolerance` away from
/// it.
fn chords(angle: f32, radius: f32, tolerance: f32) -> u32 {
    let half_chord = sqrt(tolerance * (2.0 * radius - tolerance));
    let count = (0.5 * angle * radius).abs() / half_chord;
    if half_chord > 0.0 {
        (count as u32).clamp(1, MOST_CHORDS)
    } else {
        1
    }
}

/// The two coordinates of the plane.
fn pick<const AXES: usize>(point: &[Coordinate; AXES], plane: (usize, usize)) -> [Coordinate; 2] {
    [plane.0, plane.1].map(|axis| point.get(axis).copied().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn point(x: f64, y: f64, z: f64) -> [Coordinate; 3] {
        [x, y, z].map(|mm| Coordinate::from_nanos((mm * 1e9).round() as i64))
    }

    fn mm(point: &[Coordinate; 3]) -> [f64; 3] {
        point.map(|c| c.nanos() as f64 / 1e9)
    }

    fn offset(x: f64, y: f64) -> [Coordinate; 2] {
        let [x, y, _] = point(x, y, 0.0);
        [x, y]
    }

    /// A helix of 3¼ turns, against sine and cosine in double precision.
    #[test]
    fn an_arc_of_many_turns_stays_on_its_circle_and_climbs_evenly() {
        for (turns, clockwise) in [(3, false), (99, true)] {
            let (start, end) = (point(50.0, 0.0, 0.0), point(0.0, 50.0, -13.0));
            let arc = Arc::new(start, end, offset(-50.0, 0.0), (0, 1), clockwise, 0.002).unwrap();
            let arc = arc.with_turns(turns, 0.002);
            let part: f64 = if clockwise { -0.75 } else { 0.25 };
            let angle = std::f64::consts::TAU * (part + f64::from(turns) * part.signum());
            assert!((f64::from(arc.angle()) - angle).abs() < 1e-4);
            let (count, ends) = (f64::from(arc.chords()), arc.collect::<Vec<_>>());
            for (made, at) in (1..).zip(&ends) {
                let share = f64::from(made) / count;
                let (sin, cos) = (angle * share).sin_cos();
                let expected = [50.0 * cos, 50.0 * sin, -13.0 * share];
                let apart = mm(at)
                    .iter()
                    .zip(expected)
                    .all(|(is, of)| (is - of).abs() < 0.003);
                assert!(apart, "{turns}: {at:?} is not {expected:?}");
            }
            assert_eq!(ends.last(), Some(&end));
        }
    }

    #[test]
    fn coinciding_ends_are_a_full_circle_in_the_sense_asked_for() {
        let at = point(10.0, 0.0, 0.0);
        for (clockwise, side) in [(true, -1.0), (false, 1.0)] {
            let arc = Arc::new(at, at, offset(-10.0, 0.0), (0, 1), clockwise, 0.002).unwrap();
            // ⌊π·10 / √(0.002·(20 − 0.002))⌋
            assert_eq!(arc.chords(), 157);
            assert_eq!(arc.radius(), 10.0);
            let points: Vec<_> = arc.collect();
            assert!(mm(&points[39])[1] * side > 9.9);
            assert_eq!(points.last(), Some(&at));
        }
    }

    #[test]
    fn extremes_reach_as_far_as_all_chords() {
        let (start, end) = (point(7.0, 0.3, 0.0), point(0.4, -7.0, 2.0));
        for (clockwise, at) in [(true, start), (false, start), (true, end), (false, end)] {
            let centre = offset(-mm(&at)[0], -mm(&at)[1]);
            let targets = (0..24).map(|part| {
                let (sin, cos) = (f64::from(part) * 0.26).sin_cos();
                point(7.0 * cos, 7.0 * sin, 2.0)
            });
            for target in targets {
                let arc = Arc::new(at, target, centre, (0, 1), clockwise, 0.002).unwrap();
                let ends = |points: &mut dyn Iterator<Item = [Coordinate; 3]>| {
                    points.fold([at, at], |[low, high], point| {
                        let of = |pick: fn(Coordinate, Coordinate) -> Coordinate,
                                  one: [Coordinate; 3]| {
                            core::array::from_fn(|axis| pick(one[axis], point[axis]))
                        };
                        [of(Ord::min, low), of(Ord::max, high)]
                    })
                };
                assert_eq!(ends(&mut arc.extremes()), ends(&mut arc.clone()));
                assert!(arc.extremes().count() <= 10);
            }
        }
    }

    #[test]
    fn an_arc_within_the_tolerance_is_one_straight_chord() {
        let (start, end) = (point(0.0, 0.0, 0.0), point(0.001, 0.001, 0.0));
        let arc = Arc::new(start, end, offset(0.001, 0.0), (0, 1), true, 0.5).unwrap();
        assert_eq!(arc.collect::<Vec<_>>(), [end]);
    }

    #[test]
    fn an_arc_that_cannot_be_drawn_is_refused() {
        let (start, end) = (point(0.0, 0.0, 0.0), point(1.0, 1.0, 0.0));
        let arc =
            |plane, tolerance| Arc::new(start, end, offset(1.0, 0.0), plane, true, tolerance).err();
        assert_eq!(arc((0, 2), 0.002), None);
        for plane in [(0, 0), (0, 3), (usize::MAX, 1)] {
            assert_eq!(arc(plane, 0.002), Some(ArcError::Plane), "{plane:?}");
        }
        for tolerance in [f32::NAN, f32::INFINITY, 0.0, -0.002, -f32::INFINITY] {
            assert_eq!(
                arc((0, 1), tolerance),
                Some(ArcError::Tolerance),
                "{tolerance}"
            );
        }
    }

    #[test]
    fn an_arc_without_a_radius_is_one_chord_without_a_curve() {
        let at = point(1.0, 2.0, 3.0);
        let arc = Arc::new(at, at, offset(0.0, 0.0), (0, 1), true, 0.002).unwrap();
        assert_eq!((arc.curve(10.0), arc.chords()), (None, 1));
    }

    /// The coordinates go to both ends of their range.
    #[test]
    fn the_largest_arc_ends() {
        let [far, near] = [1e9, -1e9].map(|mm| point(mm, mm, mm));
        let arc = Arc::new(far, near, offset(-2e9, 2e9), (0, 1), true, 1e-12).unwrap();
        assert_eq!(arc.chords(), MOST_CHORDS);
        assert_eq!(arc.last(), Some(near));
    }

    #[test]
    fn other_planes_and_other_axes_move_as_they_should() {
        // G18: from Z to X, with Y moving along.
        let (start, end) = (point(0.0, 1.0, 5.0), point(5.0, 3.0, 0.0));
        let arc = Arc::new(start, end, offset(-5.0, 0.0), (2, 0), false, 0.002).unwrap();
        let chords = f64::from(arc.chords());
        for (k, point) in arc.enumerate() {
            let [x, y, z] = mm(&point);
            assert!((x.hypot(z) - 5.0).abs() < 1e-5);
            assert!((y - 1.0 - 2.0 * (k + 1) as f64 / chords).abs() < 1e-6);
        }
    }

    proptest! {
        /// Points on the circle, chords no further from it than the rounded count allows, the end
        /// exact.
        #[test]
        fn chords_follow_the_circle(
            x in -300.0f64..300.0, y in -300.0f64..300.0, radius in 0.01f64..400.0,
            from in 0.0f64..6.2, sweep in 0.05f64..6.2, clockwise: bool,
        ) {
            let at = |angle: f64| point(x + radius * angle.cos(), y + radius * angle.sin(), 0.0);
            let turned = if clockwise { from - sweep } else { from + sweep };
            let (start, end) = (at(from), at(turned));
            let arc = Arc::new(start, end, offset(-radius * from.cos(), -radius * from.sin()), (0, 1), clockwise, 0.002).unwrap();
            let allowed = 0.002 * (1.0 + 1.0 / f64::from(arc.chords())).powi(2) * 1.01 + radius * 1e-6;
            let mut before = mm(&start);
            let mut last = start;
            for point in arc {
                let [px, py, _] = mm(&point);
                prop_assert!(((px - x).hypot(py - y) - radius).abs() < radius * 1e-6 + 1e-6);
                let middle = (0.5 * (px + before[0]) - x).hypot(0.5 * (py + before[1]) - y);
                prop_assert!(radius - middle < allowed, "{} > {}", radius - middle, allowed);
                (before, last) = ([px, py, 0.0], point);
            }
            prop_assert_eq!(last, end);
        }
    }
}
