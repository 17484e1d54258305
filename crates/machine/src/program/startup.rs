//! Startup lines: run after power-up, after each reset and after homing, unless the machine is
//! locked.

use crate::activity::line::Origin;

/// The startup line that is to run next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Startup {
    next: Option<u8>,
    /// A line (`$H`) that is answered once all startup lines have run.
    then: Option<Origin>,
}

/// The action that [`Startup::advance`] asks for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Turn {
    /// Nothing is to be done.
    Nothing,
    /// Run this startup line.
    Run(u8),
    /// All have run: answer this line.
    Answer(Origin),
}

impl Startup {
    /// Begins with nothing to run.
    pub(crate) const fn new() -> Self {
        Self {
            next: None,
            then: None,
        }
    }

    /// Runs all startup lines from the first on, then answers `then`.
    pub(crate) fn begin(&mut self, then: Option<Origin>) {
        *self = Self {
            next: Some(0),
            then,
        };
    }

    /// Forgets the startup lines that have not run yet; returns the line that waits for them.
    pub(crate) fn cancel(&mut self) -> Option<Origin> {
        self.next = None;
        self.then.take()
    }

    /// Returns true if lines from senders have to wait.
    pub(crate) fn is_running(&self) -> bool {
        self.next.is_some() || self.then.is_some()
    }

    /// The next step; `lines`: how many startup lines there are.
    pub(crate) fn advance(&mut self, lines: u8) -> Turn {
        match (self.next, self.then) {
            (Some(line), _) => {
                self.next = (line + 1 < lines).then_some(line + 1);
                Turn::Run(line)
            }
            (None, Some(origin)) => {
                self.then = None;
                Turn::Answer(origin)
            }
            (None, None) => Turn::Nothing,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::ChannelId;

    #[test]
    fn startup_lines_run_in_order_before_the_waiting_line_is_answered() {
        let origin = Origin::Channel(ChannelId(1));
        let mut startup = Startup::new();
        assert_eq!(startup.advance(2), Turn::Nothing);
        startup.begin(Some(origin));
        assert_eq!(startup.advance(2), Turn::Run(0));
        assert_eq!(startup.advance(2), Turn::Run(1));
        assert_eq!(startup.advance(2), Turn::Answer(origin));
        assert!(!startup.is_running());
    }
}
