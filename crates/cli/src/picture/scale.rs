//! A labelled axis: a range of values on a range of pixels, with round ticks.

/// A linear map from values to pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    from: f64,
    to: f64,
    start: f64,
    end: f64,
}

impl Scale {
    /// Maps `from..to` to pixels `start..end`. An empty range is made one unit wide.
    pub(super) fn new(from: f64, to: f64, start: f64, end: f64) -> Self {
        let (from, to) = if to > from {
            (from, to)
        } else {
            (from - 0.5, from + 0.5)
        };
        Self {
            from,
            to,
            start,
            end,
        }
    }

    /// The pixel of `value`.
    pub(super) fn pixel(&self, value: f64) -> f64 {
        self.start + (value - self.from) / (self.to - self.from) * (self.end - self.start)
    }

    /// Round values within the range, about one every `spacing` pixels; two at least, since one alone
    /// gives no scale.
    pub(super) fn ticks(&self, spacing: f64) -> Vec<f64> {
        let wanted = ((self.end - self.start).abs() / spacing).max(2.0);
        let step = round_step((self.to - self.from) / wanted);
        let first = (self.from / step).ceil() as i64;
        let last = (self.to / step).floor() as i64;
        if first >= last {
            return self.ticks(spacing / 2.0);
        }
        (first..=last).map(|k| k as f64 * step).collect()
    }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `least`.
fn round_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|step| *step >= least * 0.999_999)
        .unwrap_or(10.0 * power)
}

/// A tick's label, with as many decimals as it needs, at most four.
pub(super) fn label(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0" } else { text }.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside_the_range() {
        let scale = Scale::new(-3.2, 101.0, 0.0, 600.0);
        assert_eq!(scale.ticks(100.0), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(
            Scale::new(0.0, 0.03, 0.0, 300.0).ticks(100.0),
            [0.0, 0.01, 0.02, 0.03]
        );
    }

    #[test]
    fn a_scale_around_zero_names_more_than_zero() {
        let scale = Scale::new(-432.0, 432.0, 0.0, 100.0);
        assert_eq!(scale.ticks(25.0), [-400.0, -200.0, 0.0, 200.0, 400.0]);
    }

    #[test]
    fn a_range_of_no_width_still_has_a_scale() {
        let scale = Scale::new(5.0, 5.0, 0.0, 100.0);
        assert_eq!(scale.pixel(5.0), 50.0);
    }

    #[test]
    fn labels_have_no_needless_decimals() {
        assert_eq!(
            ["0", "0.25", "-12", "1000"].map(str::to_owned),
            [-0.0, 0.25, -12.0, 1000.0].map(label)
        );
    }
}
