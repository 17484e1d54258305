//! `bench/budgets.txt`: the name of each count, and its limits.
use crate::failure::Failure;
use std::{fs, path::Path};

/// The instruction counts of one region of a program.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Count {
    pub(crate) samples: u64,
    pub(crate) sum: u64,
    pub(crate) smallest: u64,
    pub(crate) largest: u64,
}

/// One line of the file.
#[derive(Debug, PartialEq)]
pub(crate) struct Budget {
    /// The program that counts it.
    pub(crate) program: String,
    /// The region of that program.
    pub(crate) region: usize,
    /// The number of step events in a sample; 1 if the count is for the whole sample.
    per: f64,
    /// The highest mean allowed.
    mean: f64,
    /// The highest single count allowed.
    max: f64,
    /// The mean to reach, if there is one.
    target: Option<f64>,
    /// The description of the count.
    pub(crate) what: String,
}

impl Budget {
    /// The heading of the table whose lines [`Budget::row`] makes.
    pub(crate) const HEADING: &str =
        "    mean      max  target   budget (mean, max)  Cortex-M4F instructions";

    /// Reads the file.
    ///
    /// # Errors
    /// When the file cannot be read, or a line is not a budget: the error has the line's number.
    pub(crate) fn read(path: &Path) -> Result<Vec<Self>, Failure> {
        let text = fs::read_to_string(path).map_err(Failure::file(path))?;
        let lines = text
            .lines()
            .enumerate()
            .filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
        lines
            .map(|(index, line)| {
                let place = || format!("{}:{}", path.display(), index + 1);
                Self::parse(line).ok_or_else(|| Failure::unreadable(place(), line))
            })
            .collect()
    }

    fn parse(line: &str) -> Option<Self> {
        let mut words = line.split_whitespace();
        Some(Budget {
            program: words.next()?.to_owned(),
            region: words.next()?.parse().ok()?,
            per: words.next()?.parse().ok().filter(|per| *per > 0.0)?,
            mean: words.next()?.parse().ok()?,
            max: words.next()?.parse().ok()?,
            target: match words.next()? {
                "-" => None,
                number => Some(number.parse().ok()?),
            },
            what: words.collect::<Vec<_>>().join(" "),
        })
    }

    /// The table's line for a count.
    pub(crate) fn row(&self, count: &Count) -> String {
        let (mean, max) = self.figures(count);
        let target = self
            .target
            .map_or("-".to_owned(), |target| target.to_string());
        let (budget_mean, budget_max, what) = (self.mean, self.max, &self.what);
        format!("{mean:8.1} {max:8.0} {target:>7}   {budget_mean:>8} {budget_max:>9}  {what}")
    }

    /// A complaint, if a count exceeds the budget.
    pub(crate) fn exceeded_by(&self, count: &Count) -> Option<String> {
        let (mean, max) = self.figures(count);
        let exceeded = mean > self.mean || max > self.max;
        let (budget_mean, budget_max, what) = (self.mean, self.max, &self.what);
        exceeded.then(|| {
            format!("{what}: mean {mean:.1}, max {max:.0}; allowed {budget_mean}, {budget_max}")
        })
    }

    /// The mean and the largest count, per step event if the budget is for step events.
    fn figures(&self, count: &Count) -> (f64, f64) {
        let mean = count.sum as f64 / count.samples as f64;
        (mean / self.per, count.largest as f64 / self.per)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &str = "step  0  1  100 110  90  a step tick";

    fn count(sum: u64, largest: u64) -> Count {
        Count {
            samples: 2,
            sum,
            smallest: 1,
            largest,
        }
    }

    #[test]
    fn a_count_within_the_budget_passes_and_one_above_it_does_not() {
        let budget = Budget::parse(LINE).unwrap();
        assert_eq!(budget.exceeded_by(&count(200, 110)), None);
        assert!(budget.exceeded_by(&count(201, 110)).is_some());
        assert!(budget.exceeded_by(&count(200, 111)).is_some());
    }

    #[test]
    fn a_sample_of_several_step_events_is_divided_by_them() {
        let budget = Budget::parse("segment 0 20 60 80 - segment preparation").unwrap();
        assert_eq!(budget.exceeded_by(&count(2400, 1600)), None);
        assert!(budget.exceeded_by(&count(2401, 1600)).is_some());
    }

    #[test]
    fn a_line_with_a_word_missing_or_wrong_is_refused() {
        for line in [
            "step 0 1 100 110",
            "step x 1 100 110 90 tick",
            "step 0 0 100 110 90 tick",
            "step 0 1 1e 110 90 tick",
        ] {
            assert_eq!(Budget::parse(line), None, "{line}");
        }
    }

    #[test]
    fn every_committed_budget_can_be_read() {
        assert!(
            !Budget::read(&crate::toolchain::root().join("bench/budgets.txt"))
                .unwrap()
                .is_empty()
        );
    }
}
