//! Finds turn, shift and scale between two sets of points, by least squares.
//!
//! Let p and q be the points of the two sets, as complex numbers relative to the middle of their
//! set (`p*` is the conjugate of p). Then
//!
//! ```text
//! c = sum q p* / sum p p*         turn = arg c,  scale = |c|
//! ```
//!
//! minimises the sum of |q - c p|² over all turns and scales. The turn is the same if the scale is
//! fixed at 1 (Umeyama 1991). The points of a mirrored board fit better with p* in place of p.

/// A place in mm.
pub type Place = [f64; 2];

/// A point of the job, and where it was found.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Pair {
    /// The point in the job's coordinates, mm.
    pub nominal: Place,
    /// The point in the machine's coordinates, mm.
    pub measured: Place,
}

/// The position of a board relative to its job.
#[derive(Clone, PartialEq, Debug)]
pub struct Fit {
    /// The board's turn, counter-clockwise, rad.
    pub angle: f64,
    /// The board's size divided by the job's. It is reported, and applied only if the user wants
    /// it.
    pub scale: f64,
    /// True if the points fit a mirrored board better. Two points, or points on one line, cannot
    /// show whether a board is mirrored.
    pub is_mirrored: bool,
    /// The distance of each measured point from its place in the turned and shifted job, mm.
    pub misses: Vec<f64>,
    factor: [f64; 2],
    applied: f64,
    middle: Pair,
}

/// Points closer together than this give no direction, mm.
const NEAR: f64 = 1e-6;
/// A board counts as mirrored if it fits better that way by this factor.
const CLEARLY: f64 = 2.0;

impl Fit {
    /// Finds the position of a board; the job is scaled too if `applies_scale`.
    ///
    /// # Errors
    /// Fewer than two points, or points in one place.
    pub fn new(pairs: &[Pair], applies_scale: bool) -> Result<Self, String> {
        if pairs.len() < 2 {
            return Err(
                "two points are needed at least: --ref and --measured, twice each".to_owned(),
            );
        }
        let middle = middle(pairs);
        let seen = pairs.iter().map(|pair| from(pair, &middle));
        let seen: Vec<Pair> = seen.collect();
        let size: f64 = seen.iter().map(|pair| square(pair.nominal)).sum();
        let measured: f64 = seen.iter().map(|pair| square(pair.measured)).sum();
        if size < NEAR * NEAR || measured < NEAR * NEAR {
            return Err("the points are all in one place: they name no direction".to_owned());
        }
        let straight = factor(&seen, size, false);
        let mirrored = factor(&seen, size, true);
        let (plain, turned) = (rest(&seen, straight, false), rest(&seen, mirrored, true));
        let scale = straight[0].hypot(straight[1]);
        let is_mirrored = plain > CLEARLY * turned && plain > NEAR;
        if scale < NEAR && !is_mirrored {
            return Err("the points fit the job in no direction better than in another".to_owned());
        }
        let applied = if applies_scale { scale } else { 1.0 };
        let mut fit = Self {
            angle: straight[1].atan2(straight[0]),
            scale,
            is_mirrored,
            misses: Vec::new(),
            factor: straight.map(|part| part / scale.max(NEAR) * applied),
            applied,
            middle,
        };
        fit.misses = pairs.iter().map(|pair| fit.miss(pair)).collect();
        Ok(fit)
    }

    /// Returns the place on the board of a point of the job.
    pub fn place(&self, point: Place) -> Place {
        let Pair { nominal, measured } = self.middle;
        let way = self.way([point[0] - nominal[0], point[1] - nominal[1]]);
        [measured[0] + way[0], measured[1] + way[1]]
    }

    /// Returns the turned and scaled way from one point to another.
    pub fn way(&self, way: Place) -> Place {
        product(self.factor, way)
    }

    /// Returns the factor by which lengths of the job grow: 1 unless the scale is applied.
    pub fn length(&self) -> f64 {
        self.applied
    }

    /// Returns the place on the board of the job's X0 Y0.
    pub fn shift(&self) -> Place {
        self.place([0.0, 0.0])
    }

    fn miss(&self, pair: &Pair) -> f64 {
        let [x, y] = self.place(pair.nominal);
        (x - pair.measured[0]).hypot(y - pair.measured[1])
    }
}

fn middle(pairs: &[Pair]) -> Pair {
    let mean = |part: fn(&Pair) -> f64| pairs.iter().map(part).sum::<f64>() / pairs.len() as f64;
    Pair {
        nominal: [mean(|pair| pair.nominal[0]), mean(|pair| pair.nominal[1])],
        measured: [mean(|pair| pair.measured[0]), mean(|pair| pair.measured[1])],
    }
}

fn from(pair: &Pair, middle: &Pair) -> Pair {
    let way = |to: Place, from: Place| [to[0] - from[0], to[1] - from[1]];
    Pair {
        nominal: way(pair.nominal, middle.nominal),
        measured: way(pair.measured, middle.measured),
    }
}

fn factor(seen: &[Pair], size: f64, mirrors: bool) -> [f64; 2] {
    let sum = seen.iter().fold([0.0, 0.0], |sum, pair| {
        let [px, py] = conjugate(seen_nominal(pair, mirrors));
        let [re, im] = product(pair.measured, [px, py]);
        [sum[0] + re, sum[1] + im]
    });
    sum.map(|part| part / size)
}

/// The root mean square of the distances that remain with this factor, mm.
fn rest(seen: &[Pair], factor: [f64; 2], mirrors: bool) -> f64 {
    let squares = seen.iter().map(|pair| {
        let [x, y] = product(factor, seen_nominal(pair, mirrors));
        square([x - pair.measured[0], y - pair.measured[1]])
    });
    (squares.sum::<f64>() / seen.len() as f64).sqrt()
}

fn seen_nominal(pair: &Pair, mirrors: bool) -> Place {
    if mirrors {
        conjugate(pair.nominal)
    } else {
        pair.nominal
    }
}

fn conjugate([x, y]: Place) -> Place {
    [x, -y]
}

fn product([a, b]: Place, [c, d]: Place) -> Place {
    [a * c - b * d, a * d + b * c]
}

fn square([x, y]: Place) -> f64 {
    x * x + y * y
}
