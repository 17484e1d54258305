//! The states that the machine has been in: a test that fails prints them.

use crate::protocol::alarm::Alarm;
use crate::state::State;

/// States that are remembered.
const STATES: usize = 16;

/// How the machine came to where it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct History {
    /// The first poll is over.
    pub(crate) booted: bool,
    /// The last alarm since power-up.
    pub(crate) last_alarm: Option<Alarm>,
    /// The last states, a ring.
    states: [State; STATES],
    /// States entered since power-up.
    entered: usize,
}

impl History {
    /// As at power-up.
    pub(crate) const fn new() -> Self {
        Self {
            booted: false,
            last_alarm: None,
            states: [State::Idle; STATES],
            entered: 0,
        }
    }

    /// Notes that the machine leaves `state`.
    pub(crate) fn leaves(&mut self, state: State) {
        if let Some(place) = self.states.get_mut(self.entered % STATES) {
            *place = state;
        }
        self.entered = self.entered.wrapping_add(1);
    }

    /// The last states that the machine has left, the oldest first.
    pub(crate) fn states(&self) -> impl Iterator<Item = State> + '_ {
        let known = self.entered.min(STATES);
        let first = self.entered.wrapping_sub(known);
        (0..known)
            .filter_map(move |index| self.states.get(first.wrapping_add(index) % STATES).copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_last_sixteen_states_are_remembered_in_order() {
        let mut history = History::new();
        assert_eq!(history.states().count(), 0);
        history.leaves(State::Idle);
        history.leaves(State::Run);
        let states: Vec<_> = history.states().collect();
        assert_eq!(states, [State::Idle, State::Run]);
        for _ in 0..10 {
            history.leaves(State::Home);
            history.leaves(State::Check);
        }
        let states: Vec<_> = history.states().collect();
        assert_eq!(states, [State::Home, State::Check].repeat(8));
    }
}
