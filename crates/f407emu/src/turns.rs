//! Turns of a program's main loop: each begins as it feeds the watchdog, and ends as the core falls asleep, or with the next.
use crate::machine::Machine;

/// How many turns are over, and what they took.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Turns {
    /// How many.
    pub count: u64,
    /// Cycles in all, without exceptions.
    pub cycles: u64,
    /// The cycle at which the one under way began, and what exceptions had taken by then.
    began: Option<(u64, u64)>,
}

impl Turns {
    fn begin(&mut self, now: u64, exceptions: u64) {
        self.end(now, exceptions);
        self.began = Some((now, exceptions));
    }

    /// The core has fallen asleep, or a turn begins. `exceptions`: the cycles that they have taken since power-on.
    pub(crate) fn end(&mut self, now: u64, exceptions: u64) {
        if let Some((began, before)) = self.began.take() {
            self.count += 1;
            self.cycles += now - began - (exceptions - before);
        }
    }
}

impl Machine {
    /// Turns of the main loop since power-on.
    pub fn turns(&self) -> Turns {
        self.turns
    }

    /// The watchdog is fed.
    pub(crate) fn begin_turn(&mut self) {
        self.turns.begin(self.cycle, self.profiler.spent);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_ends_once_and_exceptions_are_not_in_it() {
        let mut turns = Turns::default();
        turns.begin(1000, 50);
        turns.end(1500, 150);
        turns.end(9000, 150);
        assert_eq!((turns.count, turns.cycles), (1, 400));
        turns.begin(9100, 150);
        turns.begin(9200, 150);
        assert_eq!((turns.count, turns.cycles), (2, 500));
    }
}
