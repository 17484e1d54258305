//! The parts of a simulation: its settings, and the memory that main loop and interrupts share.

use crate::contacts::Contacts;
use crate::cost::Costs;
use crate::link::Rate;
use crate::output_pins::OutputPins;
use crate::own::OwnPins;
use crate::tool_pins::ToolHeight;
use leadscrew_machine::config::{MachineConfig, MoveQueues, RowPixels, SegmentQueue, CHANNELS};
use leadscrew_machine::inputs::Inputs;
use leadscrew_machine::protocol::serial::{SerialQueue, DEFAULT_RX};
use leadscrew_stepper::Shared;

/// The simulated machine.
#[derive(Clone, Debug)]
pub struct Setup<const AXES: usize> {
    /// The machine's build.
    pub machine: MachineConfig<AXES>,
    /// The costs of its CPU.
    pub costs: Costs,
    /// Its serial lines, in the order of their channels. At most as many as the machine can serve.
    pub lines: Vec<Rate>,
    /// Size of each line's receive buffer, bytes: 128 as in Grbl, at most 1024.
    pub receive_buffer: usize,
    /// The contacts between its switches and its inputs.
    pub contacts: Contacts,
}

impl<const AXES: usize> Setup<AXES> {
    /// Puts `machine` on an F407 with one serial line and the largest receive buffer.
    pub fn new(machine: MachineConfig<AXES>, line: Rate) -> Self {
        Self {
            machine,
            costs: Costs::F407,
            lines: vec![line],
            receive_buffer: DEFAULT_RX - 1,
            contacts: Contacts::default(),
        }
    }
}

/// Room for planned moves, and everything that the main loop shares with the interrupts. On the
/// board these are statics. Here the caller keeps them, because a [`crate::Simulation`] borrows
/// them.
pub struct Memory<const AXES: usize, const MOTORS: usize, const MOVES: usize = 1024> {
    pub(crate) moves: Box<MoveQueues<AXES, MOTORS, MOVES>>,
    pub(crate) pixels: Box<RowPixels>,
    pub(crate) segments: SegmentQueue<MOTORS>,
    pub(crate) shared: Shared<MOTORS>,
    pub(crate) inputs: Inputs<MOTORS>,
    pub(crate) serial: Vec<SerialQueue>,
    pub(crate) outputs: OutputPins,
    pub(crate) tool: ToolHeight,
}

impl<const AXES: usize, const MOTORS: usize, const MOVES: usize> Memory<AXES, MOTORS, MOVES> {
    /// Makes the memory for a simulation of `setup`.
    pub fn new(setup: &Setup<AXES>) -> Self {
        let lines = setup.lines.len().min(CHANNELS);
        Self {
            moves: Box::default(),
            pixels: Box::default(),
            segments: SegmentQueue::new(),
            shared: Shared::new(),
            inputs: Inputs::new(),
            serial: (0..lines)
                .map(|_| SerialQueue::with_limit(setup.receive_buffer))
                .collect(),
            outputs: OutputPins::default(),
            tool: ToolHeight::default(),
        }
    }

    /// Returns the pins of the synchronised outputs, for an extension that switches them.
    pub fn outputs(&self) -> OutputPins {
        self.outputs.clone()
    }

    /// Returns the height of the tool, for an extension that reads the tool's switches.
    pub fn tool(&self) -> ToolHeight {
        self.tool.clone()
    }

    /// Returns the pins of all extensions.
    pub fn own_pins(&self) -> OwnPins {
        OwnPins {
            outputs: self.outputs(),
            tool: self.tool(),
        }
    }
}
