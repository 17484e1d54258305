//! Speed along time in a bounded number of columns, whatever the job's length.
//!
//! Steps of several axes rarely fall together, so the way of each axis is added up over a millisecond first; the
//! path's length in it is the root of the sum of their squares.

/// Columns kept at most; when all are full, neighbours are joined and each covers twice the time.
const COLUMNS: usize = 4096;

/// Time over which the axes' ways are added up, s.
const SLICE: f64 = 1e-3;

/// Collects path length over time and answers the mean speed in each column of time.
#[derive(Clone, Debug)]
pub(crate) struct SpeedChart {
    /// Path length in each column, mm.
    lengths: Vec<f64>,
    /// Slices that a column covers.
    joined: u64,
    /// The slice under way, and the way of each axis in it, mm.
    slice: u64,
    ways: [f64; 3],
    end: f64,
}

impl Default for SpeedChart {
    fn default() -> Self {
        Self {
            lengths: Vec::new(),
            joined: 1,
            slice: 0,
            ways: [0.0; 3],
            end: 0.0,
        }
    }
}

impl SpeedChart {
    /// Notes that the axes went so many mm each at time `seconds` since power-up. Times must not fall.
    pub(crate) fn went(&mut self, seconds: f64, ways: [f64; 3]) {
        self.end = self.end.max(seconds);
        let slice = (seconds / SLICE) as u64;
        if slice != self.slice {
            self.close_slice();
            self.slice = slice;
        }
        for (sum, way) in self.ways.iter_mut().zip(ways) {
            *sum += way.abs();
        }
    }

    /// The points of the chart: time in s at the middle of a column, mean speed in mm/min.
    pub(crate) fn points(&self) -> Vec<[f64; 2]> {
        let mut whole = self.clone();
        whole.close_slice();
        let width = SLICE * whole.joined as f64;
        let columns = whole.lengths.iter().enumerate();
        columns
            .map(|(column, length)| [(column as f64 + 0.5) * width, length / width * 60.0])
            .collect()
    }

    /// The last time noted, s.
    pub(crate) fn end(&self) -> f64 {
        self.end
    }

    fn close_slice(&mut self) {
        let length = self.ways.iter().map(|way| way * way).sum::<f64>().sqrt();
        self.ways = [0.0; 3];
        while self.slice / self.joined >= COLUMNS as u64 {
            self.join_neighbours();
        }
        let column = (self.slice / self.joined) as usize;
        if column >= self.lengths.len() {
            self.lengths.resize(column + 1, 0.0);
        }
        self.lengths[column] += length;
    }

    fn join_neighbours(&mut self) {
        self.lengths = self
            .lengths
            .chunks(2)
            .map(|pair| pair.iter().sum())
            .collect();
        self.joined *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constant_speed_on_a_diagonal_stays_constant_however_long_the_job_is() {
        for seconds in [1.0, 3600.0] {
            let mut chart = SpeedChart::default();
            let steps = (100_000.0 * seconds) as u64; // X and Y in turn, 12 and 16 mm/s
            for k in 0..steps {
                let way = if k % 2 == 0 {
                    [12.0, 0.0, 0.0]
                } else {
                    [0.0, 16.0, 0.0]
                };
                chart.went(k as f64 * 1e-5, way.map(|mm| mm * 2e-5));
            }
            let points = chart.points();
            assert!(points.len() <= COLUMNS);
            let inner = &points[1..points.len() - 1];
            assert!(
                inner.iter().all(|p| (p[1] - 1200.0).abs() < 30.0),
                "{seconds}"
            );
        }
    }
}
