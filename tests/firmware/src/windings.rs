//! Motors without drivers: turns the levels of their lines into steps, by the states that the
//! document of machine 001 prints.
const SEQUENCES: &str = include_str!("../../../crates/stepper/tests/five_phase_sequences.csv");

/// The effect of a store to a motor's lines.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Change {
    /// The current was switched on in the state in which it had been switched off, or off.
    Current,
    /// The lines went to a neighbouring state, with a `negative` step to the one before.
    Step { negative: bool },
    /// No state of the document, or none that may follow the last one.
    Fault,
}

/// The lines of a motor.
#[derive(Clone, Debug)]
pub(crate) struct Phases {
    /// The document's states in the order of forward steps; bit *n* is line *n*.
    states: Vec<u8>,
    /// The levels now.
    lines: u8,
    /// The index of the last state.
    at: usize,
}

impl Phases {
    /// A motor without current, at the first state of its table; `number` counts from 1.
    pub(crate) fn new(number: usize) -> Self {
        let name = format!("cw_motor_{number},");
        let rows = SEQUENCES.lines().filter_map(|row| row.strip_prefix(&name));
        let lines = |row: &str| {
            let cells = row.split(',').skip(1).enumerate();
            cells.fold(0, |lines, (line, cell)| {
                lines | u8::from(cell.trim() == "1") << line
            })
        };
        Phases {
            states: rows.map(lines).collect(),
            lines: 0,
            at: 0,
        }
    }

    /// Notes the level of a line. A store changes several: [`Self::settle`] comes after the last.
    pub(crate) fn set(&mut self, line: usize, level: bool) {
        self.lines = self.lines & !(1 << line) | u8::from(level) << line;
    }

    /// Returns true if no line has current.
    pub(crate) fn is_off(&self) -> bool {
        self.lines == 0
    }

    /// Returns the effect of the store that changed the lines.
    pub(crate) fn settle(&mut self) -> Change {
        let count = self.states.len();
        let place = self.states.iter().position(|state| *state == self.lines);
        let (forward, back) = ((self.at + 1) % count, (self.at + count - 1) % count);
        match place {
            None if self.lines == 0 => return Change::Current,
            Some(place) if place == self.at => return Change::Current,
            Some(place) if place == forward || place == back => self.at = place,
            _ => return Change::Fault,
        }
        let negative = self.at == back;
        Change::Step { negative }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn put(motor: &mut Phases, lines: u8) -> Change {
        for line in 0..5 {
            motor.set(line, lines >> line & 1 == 1);
        }
        motor.settle()
    }

    #[test]
    fn neighbouring_states_are_steps_and_others_are_faults() {
        let mut motor = Phases::new(1);
        assert_eq!(motor.states.len(), 10);
        // The document's first rows: 1 1 0 0 1, 1 1 0 0 0, 1 1 1 0 0.
        assert_eq!(put(&mut motor, 0b1_0011), Change::Current);
        assert_eq!(put(&mut motor, 0b0_0011), Change::Step { negative: false });
        assert_eq!(put(&mut motor, 0b1_0011), Change::Step { negative: true });
        assert_eq!(put(&mut motor, 0b0_0111), Change::Fault);
        assert_eq!(put(&mut motor, 0b1_1111), Change::Fault);
        assert_eq!(put(&mut motor, 0), Change::Current);
        assert!(motor.is_off());
    }
}
