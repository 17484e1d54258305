//! A job's stretches cut into columns of equal time.

use leadscrew_sim::clock::{seconds, Cycle};
use leadscrew_sim::speed_profile::{Limit, Stretch};

/// Speed, acceleration, power and limits in one column.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Column {
    /// Mean speed, mm/s.
    pub(super) mean_speed: f64,
    /// Least and highest speed, mm/s.
    pub(super) speed: [f64; 2],
    /// Least and highest acceleration along the path, mm/s².
    pub(super) acceleration: [f64; 2],
    /// Mean power, share of full power.
    pub(super) mean_power: f64,
    /// Least and highest power, shares of full power.
    pub(super) power: [f64; 2],
    /// The shares of the column's time that each group of limits takes.
    pub(super) shares: Vec<f64>,
}

/// A job in columns.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Columns {
    /// The columns, in order.
    pub(super) all: Vec<Column>,
    /// Time that each column covers, s.
    pub(super) width: f64,
    /// The whole time, s.
    pub(super) seconds: f64,
    /// The shares of the whole time that each group of limits takes.
    pub(super) total: Vec<f64>,
}

/// An empty range, which the first value replaces.
const EMPTY: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

impl Columns {
    /// Cuts `stretches` into `count` columns. `group` maps a limit to its group's number, which is
    /// below `groups`.
    pub(super) fn new(
        stretches: &[Stretch],
        count: usize,
        groups: usize,
        group: impl Fn(Limit) -> usize,
    ) -> Self {
        let begin = stretches.first().map_or(Cycle::ZERO, |first| first.begin);
        let end = stretches.last().map_or(Cycle::ZERO, |last| last.end);
        let width = (end - begin) as f64 / count as f64;
        let empty = Column {
            mean_speed: 0.0,
            speed: EMPTY,
            acceleration: EMPTY,
            mean_power: 0.0,
            power: EMPTY,
            shares: vec![0.0; groups],
        };
        let mut all = vec![empty; count];
        let mut total = vec![0.0; groups];
        for stretch in stretches {
            let number = group(stretch.limit);
            let cycles = stretch.cycles() as f64;
            add(&mut total, number, cycles / (end - begin) as f64);
            let (from, to) = ((stretch.begin - begin) as f64, (stretch.end - begin) as f64);
            let mut at = from;
            let first = (from / width) as usize;
            for (index, column) in all.iter_mut().enumerate().skip(first) {
                let until = to.min((index + 1) as f64 * width);
                if until <= at {
                    break;
                }
                let part = [at, until].map(|cycle| (cycle - from) / cycles);
                column.add(stretch, part, (until - at) / width, number);
                at = until;
            }
        }
        all.iter_mut().for_each(Column::settle);
        Self {
            all,
            width: seconds(end - begin) / count as f64,
            seconds: seconds(end - begin),
            total,
        }
    }

    /// Returns when column `index` begins, s.
    pub(super) fn time(&self, index: usize) -> f64 {
        index as f64 * self.width
    }
}

impl Column {
    /// Adds a piece of a stretch to the column. `part` is the piece's begin and end as shares of
    /// the stretch's time. The piece takes `share` of the column's time.
    fn add(&mut self, stretch: &Stretch, part: [f64; 2], share: f64, group: usize) {
        let between = |ends: [f64; 2]| part.map(|t| ends[0] + (ends[1] - ends[0]) * t);
        let (speed, power) = (between(stretch.speed), between(stretch.power));
        self.mean_speed += (speed[0] + speed[1]) / 2.0 * share;
        self.mean_power += (power[0] + power[1]) / 2.0 * share;
        widen(&mut self.speed, speed);
        widen(&mut self.power, power);
        widen(&mut self.acceleration, [stretch.acceleration(); 2]);
        add(&mut self.shares, group, share);
    }

    /// Sets the ranges of a column without a stretch to 0.
    fn settle(&mut self) {
        for range in [&mut self.speed, &mut self.power, &mut self.acceleration] {
            if *range == EMPTY {
                *range = [0.0; 2];
            }
        }
    }
}

fn add(shares: &mut [f64], group: usize, share: f64) {
    if let Some(sum) = shares.get_mut(group) {
        *sum += share;
    }
}

fn widen(range: &mut [f64; 2], by: [f64; 2]) {
    for value in by {
        *range = [range[0].min(value), range[1].max(value)];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_sim::clock::CPU_HZ;
    use leadscrew_sim::speed_profile::{Phase, Slow, SpeedLimit};

    #[test]
    fn a_ramp_and_a_cruise_fall_into_their_columns() {
        let ramp = Stretch {
            begin: Cycle(CPU_HZ),
            end: Cycle(3 * CPU_HZ),
            line: 1,
            phase: Phase::Accelerate,
            length: 8.0,
            speed: [0.0, 8.0],
            power: [0.0, 0.8],
            limit: Limit::Acceleration(0, Slow::Stop),
        };
        let cruise = Stretch {
            begin: ramp.end,
            end: Cycle(5 * CPU_HZ),
            phase: Phase::Cruise,
            length: 16.0,
            speed: [8.0; 2],
            power: [0.8; 2],
            limit: Limit::Speed(SpeedLimit::Feed),
            ..ramp
        };
        let number = |limit| usize::from(matches!(limit, Limit::Speed(_)));
        let columns = Columns::new(&[ramp, cruise], 4, 2, number);
        let means: Vec<f64> = columns.all.iter().map(|c| c.mean_speed).collect();
        assert_eq!(means, [2.0, 6.0, 8.0, 8.0]);
        assert_eq!(columns.all[1].speed, [4.0, 8.0]);
        assert_eq!(columns.all[0].acceleration, [4.0; 2]);
        assert_eq!((columns.seconds, columns.width), (4.0, 1.0));
        assert_eq!(columns.total, [0.5, 0.5]);
        let odd = Columns::new(&[ramp, cruise], 3, 2, number);
        let middle: Vec<f64> = odd.all[1].shares.iter().map(|s| s * 100.0).collect();
        assert!((middle[0] - 50.0).abs() < 1e-6 && (middle[1] - 50.0).abs() < 1e-6);
    }
}
