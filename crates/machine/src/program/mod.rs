//! The program: its lines, and the state that they leave to each other.

pub(crate) mod startup;

use crate::board::ChannelId;
use crate::interpreter::{Coordinate, Interpreter, OverrideControl};
use startup::Startup;

/// The program of the sender whose turn it is.
pub(crate) struct Program<const AXES: usize> {
    pub(crate) interpreter: Interpreter<AXES>,
    pub(crate) startup: Startup,
    /// The channel whose job is under way.
    pub(crate) owner: Option<ChannelId>,
    /// A `$` line has come that waits until the motion before it has ended.
    pub(crate) line_waits: bool,
    /// Lines since the program began: since power-up, a reset, or the end of the program before.
    pub(crate) lines: u32,
    /// True if M56 allows parking.
    pub(crate) parking_allowed: bool,
    /// The overrides that M48 to M51 let act.
    pub(crate) overrides: OverrideControl,
    /// The end of the last probing motion.
    pub(crate) probed: Probed<AXES>,
    /// The `WCO` of reports.
    pub(crate) work_offset: [Coordinate; AXES],
}

/// The place at which the probe touched last.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Probed<const AXES: usize> {
    /// Machine position.
    pub(crate) position: [Coordinate; AXES],
    /// True if the last probing motion made contact.
    pub(crate) contact: bool,
}

impl<const AXES: usize> Program<AXES> {
    /// The program as at power-up, without a line.
    pub(crate) fn new() -> Self {
        Self {
            interpreter: Interpreter::new(),
            startup: Startup::new(),
            owner: None,
            line_waits: false,
            lines: 0,
            parking_allowed: true,
            overrides: OverrideControl::ALL,
            probed: Probed::NOTHING,
            work_offset: [Coordinate::ZERO; AXES],
        }
    }

    /// Sets modes, offsets that are not stored, and the count of lines back to their state at
    /// power-up. The owner of the job and the startup lines stay.
    pub(crate) fn reset(&mut self) {
        self.interpreter.reset();
        self.work_offset = *self.interpreter.work_offset();
        self.parking_allowed = true;
        self.overrides = OverrideControl::ALL;
        self.probed = Probed::NOTHING;
        self.lines = 0;
        self.line_waits = false;
    }
}

impl<const AXES: usize> Probed<AXES> {
    /// As at power-up and after a reset.
    pub(crate) const NOTHING: Self = Self {
        position: [Coordinate::ZERO; AXES],
        contact: false,
    };
}
