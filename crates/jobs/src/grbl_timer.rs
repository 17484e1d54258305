//! The slowest step of Grbl's timer: a job that asks for slower ones takes less time there.

use leadscrew_sim::clock::{seconds, Cycle};
use leadscrew_sim::observer::{Observer, Taken};

/// The longest time of a step of the dominant motor: 65 535 counts of a 16-bit timer at 16 MHz, at
/// the highest of Grbl's three smoothing levels, which makes eight ticks a step.
const LONGEST: f64 = 65_535.0 * 8.0 / 16e6;

/// Adds up how much sooner Grbl's timer makes the steps of a job than they are asked for.
#[derive(Debug, Default)]
pub(crate) struct GrblTimer {
    /// The cycle at which the stepper took its present segment, and the number of steps that end in
    /// this segment; `None` at rest.
    under_way: Option<(Cycle, u32)>,
    /// The time since the last end of a step, s.
    since: f64,
    /// The time by which Grbl's timer is sooner so far, s.
    pub(crate) sooner: f64,
}

impl Observer for GrblTimer {
    fn segment_taken(&mut self, cycle: Cycle, taken: Option<&Taken<'_>>) {
        if let Some((begun, steps)) = self.under_way {
            self.since += seconds(cycle.0 - begun.0);
            if steps > 0 {
                self.sooner += (self.since - f64::from(steps) * LONGEST).max(0.0);
                self.since = 0.0;
            }
        }
        self.under_way = taken.map(|taken| (cycle, taken.step_events));
        if taken.is_none() {
            self.since = 0.0;
        }
    }
}
