//! Turns of a program's main loop. A turn begins when the loop feeds the watchdog. It ends when the
//! core falls asleep, or when the next turn begins.

/// The number of finished turns, and their instructions and cycles.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Turns {
    /// The number of turns.
    pub count: u64,
    /// Cycles in all, without exceptions.
    pub cycles: u64,
    /// Instructions in all, without the instructions of exceptions.
    pub instructions: u64,
    /// The counts outside exceptions at the start of the turn under way.
    began: Option<Spent>,
}

/// The counts outside exceptions since power-on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Spent {
    pub(crate) cycles: u64,
    pub(crate) instructions: u64,
}

impl Turns {
    pub(crate) fn begin(&mut self, spent: Spent) {
        self.end(spent);
        self.began = Some(spent);
    }

    pub(crate) fn end(&mut self, spent: Spent) {
        if let Some(before) = self.began.take() {
            self.count += 1;
            self.cycles += spent.cycles - before.cycles;
            self.instructions += spent.instructions - before.instructions;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_ends_once() {
        let spent = |cycles, instructions| Spent {
            cycles,
            instructions,
        };
        let mut turns = Turns::default();
        turns.begin(spent(950, 600));
        turns.end(spent(1350, 850));
        turns.end(spent(8850, 900));
        assert_eq!(
            (turns.count, turns.cycles, turns.instructions),
            (1, 400, 250)
        );
        turns.begin(spent(8950, 1000));
        turns.begin(spent(9050, 1050));
        assert_eq!(
            (turns.count, turns.cycles, turns.instructions),
            (2, 500, 300)
        );
    }
}
