//! The machine: owns all parts of the main loop, and lends them to each other in `poll`.

use crate::board::{Board, Instant};
use crate::config::{MachineConfig, CHANNELS};
use crate::inputs::Inputs;
use crate::protocol::serial::Inbox;
use crate::state::State;
use crate::work::Work;
use heapless::spsc::Producer;
use heapless::Vec;
use leadscrew_stepper::{Segment, Shared};

/// The main loop's ends of everything that crosses to interrupts.
pub struct Links<'a, const MOTORS: usize> {
    /// Segments for the step interrupt, from a [`crate::config::SegmentQueue`].
    pub segments: Producer<'a, Segment<MOTORS>>,
    /// Words shared with the step interrupt.
    pub shared: &'a Shared<MOTORS>,
    /// Words shared with the switch interrupts.
    pub inputs: &'a Inputs<MOTORS>,
    /// Serial lines, in the order of their `ChannelId`s.
    pub inboxes: Vec<Inbox<'a>, CHANNELS>,
}

/// When [`Machine::poll`] wants to be called again.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Next {
    /// At once: there is more to do.
    pub busy: bool,
    /// At this instant at the latest; `None`: at the next byte, switch edge or step interrupt that takes a segment.
    pub when: Option<Instant>,
}

/// A GRBL machine with `AXES` axes on `MOTORS` motors that plans up to `MOVES` moves ahead.
pub struct Machine<'a, K, const AXES: usize, const MOTORS: usize, const MOVES: usize> {
    config: MachineConfig<AXES>,
    kinematics: K,
    links: Links<'a, MOTORS>,
    state: State,
    work: Work,
}

impl<'a, K, const AXES: usize, const MOTORS: usize, const MOVES: usize>
    Machine<'a, K, AXES, MOTORS, MOVES>
{
    /// Makes a machine that will boot at its first [`Machine::poll`].
    pub fn new(config: MachineConfig<AXES>, kinematics: K, links: Links<'a, MOTORS>) -> Self {
        Self {
            config,
            kinematics,
            links,
            state: State::Idle,
            work: Work::default(),
        }
    }

    /// Does a bounded amount of work: never waits, at most one line, a few segments, one report.
    ///
    /// Main loop. `now` never goes back.
    pub fn poll<B: Board>(&mut self, board: &mut B, now: Instant) -> Next {
        let _ = (board, now, &self.config, &self.kinematics, &self.links);
        self.work.polls = self.work.polls.wrapping_add(1);
        Next::default()
    }

    /// What the machine is doing.
    pub fn state(&self) -> State {
        self.state
    }

    /// What has been done since power-up.
    pub fn work(&self) -> &Work {
        &self.work
    }
}
