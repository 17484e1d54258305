//! The plate that the probe meets, if it is uneven.
//!
//! ```text
//!           ___---‾‾‾---___          the bow: highest in the middle of the travel, none at its edge
//!  place --+---------------+--       the tilt: so far up for each step of X and of Y
//!          0               span
//! ```
//!
//! A plate with edges ends there, and may have a round hole; the probe's tip is round.

/// The parts of a step in which tilts are counted.
const PARTS: i64 = 1 << 20;

/// The height at places without a plate, in steps of Z: no carriage goes as far.
const NOWHERE: i32 = -(1 << 30);

/// The ends of a plate, mm.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Edges {
    /// Its low and its high end in X and in Y; `None` if it has none.
    pub sides: [Option<[f64; 2]>; 2],
    /// The middle and the diameter of a hole.
    pub hole: Option<([f64; 2], f64)>,
    /// The diameter of the probe's tip.
    pub tip: f64,
}

impl Edges {
    /// Returns true if the tip at `place` is over the plate, if only with its rim.
    fn are_met_at(&self, place: [f64; 2]) -> bool {
        let beyond = |axis: usize| {
            let ends = self.sides[axis];
            ends.map_or(0.0, |[low, high]| {
                (low - place[axis]).max(place[axis] - high).max(0.0)
            })
        };
        let is_outside = beyond(0).hypot(beyond(1)) > self.tip / 2.0;
        let is_in_hole = self.hole.is_some_and(|([x, y], diameter)| {
            (place[0] - x).hypot(place[1] - y) < (diameter - self.tip) / 2.0
        });
        !is_outside && !is_in_hole
    }
}

/// The difference of a plate from a flat one, in steps of the three carriages.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Plate {
    /// The height by which the plate rises per step of X and per step of Y, in 2⁻²⁰ steps of Z.
    tilt: [i64; 2],
    /// The height by which the middle stands above the edges, in steps of Z.
    bow: i64,
    /// Steps of X and Y from one edge to the other; 0 if there is no bow.
    span: [i64; 2],
    edges: Edges,
    /// Steps for each mm of X and Y.
    steps_per_mm: [f64; 2],
}

impl Plate {
    /// Makes a plate that rises by `tilt` mm per mm of X and of Y. Its middle stands `bow` mm above
    /// its edges, which are `span` mm apart in X and Y. `steps_per_mm` are the scales of X, Y, Z.
    pub fn new(tilt: [f64; 2], bow: f64, span: [f64; 2], steps_per_mm: [f64; 3]) -> Self {
        let [x, y, z] = steps_per_mm;
        let parts = |tilt: f64, steps: f64| (tilt * z / steps * PARTS as f64).round() as i64;
        Self {
            tilt: [parts(tilt[0], x), parts(tilt[1], y)],
            bow: (bow * z).round() as i64,
            span: [(span[0] * x).round() as i64, (span[1] * y).round() as i64],
            edges: Edges::default(),
            steps_per_mm: [x, y],
        }
    }

    /// Ends the plate at `edges`.
    pub fn within(self, edges: Edges) -> Self {
        Self { edges, ..self }
    }

    /// The height of the plate under the carriages of X and Y, above the switch's place, in steps
    /// of Z.
    pub(super) fn height(&self, [x, y]: [i32; 2]) -> i32 {
        let scale = self.steps_per_mm;
        if !self
            .edges
            .are_met_at([f64::from(x) / scale[0], f64::from(y) / scale[1]])
        {
            return NOWHERE;
        }
        let parts = self.tilt[0] * i64::from(x) + self.tilt[1] * i64::from(y);
        let tilted = (parts + PARTS / 2).div_euclid(PARTS);
        let along = |place: i32, span: i64| {
            let place = f64::from(place) / span.max(1) as f64;
            (4.0 * place * (1.0 - place)).max(0.0)
        };
        let bowed = self.bow as f64 * along(x, self.span[0]) * along(y, self.span[1]);
        (tilted + bowed.round() as i64) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tilted_plate_rises_with_each_axis() {
        let plate = Plate::new([0.01, -0.02], 0.0, [0.0; 2], [80.0, 80.0, 400.0]);
        // The plate rises 1 mm over 100 mm of X, and falls 1 mm over 50 mm of Y.
        assert_eq!(plate.height([8000, 0]), 400);
        assert_eq!(plate.height([0, 4000]), -400);
        assert_eq!(plate.height([8000, 4000]), 0);
    }

    #[test]
    fn a_tip_meets_the_plate_with_its_rim_and_a_hole_s_wall_too() {
        let edges = Edges {
            sides: [Some([10.0, 50.0]), Some([20.0, 60.0])],
            hole: Some(([30.0, 40.0], 12.0)),
            tip: 2.0,
        };
        let plate = Plate::new([0.0; 2], 0.0, [0.0; 2], [100.0, 100.0, 400.0]).within(edges);
        let met = [
            [900, 4000],
            [5100, 4000],
            [929, 1930],
            [2500, 4000],
            [3000, 4500],
        ];
        let missed = [
            [899, 4000],
            [5101, 4000],
            [929, 1929],
            [2501, 4000],
            [3000, 4499],
        ];
        for (place, height) in met
            .map(|place| (place, 0))
            .into_iter()
            .chain(missed.map(|place| (place, NOWHERE)))
        {
            assert_eq!(plate.height(place), height, "{place:?}");
        }
    }

    #[test]
    fn a_bow_is_highest_in_the_middle_and_none_at_the_edge() {
        let plate = Plate::new([0.0; 2], 0.5, [400.0, 200.0], [80.0, 80.0, 400.0]);
        assert_eq!(plate.height([16_000, 8000]), 200);
        assert_eq!(plate.height([0, 8000]), 0);
        assert_eq!(plate.height([16_000, 16_000]), 0);
        assert_eq!(plate.height([8000, 8000]), 150);
    }
}
