//! Computes how long the machine travels.

use crate::Point;

/// The limits of the machine's motion.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Speeds {
    /// `$110` to `$112`: mm/min of X, Y and Z.
    pub rates: [f64; 3],
    /// `$120` to `$122`: mm/s² of X, Y and Z.
    pub accelerations: [f64; 3],
    /// `$30`: the spindle's highest speed, 1/min.
    pub spindle: f64,
}

/// A place in mm, as a float: only the order of holes depends on it.
pub(super) type Place = [f64; 2];

/// The distance between two places, mm.
pub(super) fn distance(from: Place, to: Place) -> f64 {
    (to[0] - from[0]).hypot(to[1] - from[1])
}

/// The point as a [`Place`].
pub(super) fn place(point: Point) -> Place {
    [point.x.to_f64(), point.y.to_f64()]
}

impl Speeds {
    /// Time of a rapid in X and Y from rest to rest, s.
    ///
    /// For a length L, the speed v and the acceleration a along the way follow from the axis that
    /// needs longest:
    ///
    /// ```text
    /// L/v = max |d_axis| / rate,  L/a = max |d_axis| / acceleration
    /// t = L/v + v/a      if the speed is reached: v²/a <= L
    /// t = 2 sqrt(L/a)    else
    /// ```
    pub(super) fn travel(&self, from: Place, to: Place) -> f64 {
        let way = [(to[0] - from[0]).abs(), (to[1] - from[1]).abs()];
        let cruise = (way[0] / self.rates[0]).max(way[1] / self.rates[1]) * 60.0;
        let ramp = (way[0] / self.accelerations[0]).max(way[1] / self.accelerations[1]);
        if cruise * cruise <= ramp {
            2.0 * ramp.sqrt()
        } else {
            cruise + ramp / cruise
        }
    }
}
