#![no_std]
#![forbid(unsafe_code)]
#![doc = include_str!("../README.md")]

use core::fmt;
use leadscrew_gcode::{Letter, Number};
use leadscrew_machine::extension::{Call, Cx, Event, Extension, MCode, OutputChange, Step};
use leadscrew_machine::guard::Load;
use leadscrew_machine::protocol::status::Status;
use leadscrew_machine::state::{Door, Hold, State};

/// The pins of the outputs, as the main loop changes them.
///
/// The step interrupt changes the same pins (`StepPort::change_outputs`), perhaps in the middle of
/// these methods. So a change must be one write that names only the pins which change, as a set and
/// reset register takes it. Then the other pins keep the interrupt's levels.
pub trait OutputPort {
    /// Changes the outputs at once; outputs in neither mask stay as they are.
    fn change(&mut self, change: OutputChange);

    /// The levels now, one bit for each output.
    fn levels(&self) -> u8;
}

/// The number of outputs, and which are on at power-up and in a hold.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct OutputsConfig {
    /// The number of outputs, 0 to 8: `P0` to `P(count - 1)`. With 0, M62 to M65 are refused, as
    /// they are without this extension.
    pub count: u8,
    /// The outputs that are on after power-up, a reset, an alarm and the end of the program, one
    /// bit for each output.
    pub boot: u8,
    /// The outputs that stay as they are in a hold, one bit for each output; all others go off.
    pub stay: u8,
}

impl OutputsConfig {
    /// The mask of all outputs.
    const fn all(self) -> u8 {
        match 0xFFu8.checked_shl(self.count as u32) {
            Some(others) => !others,
            None => 0xFF,
        }
    }
}

/// The extension for M62 to M65.
#[derive(Debug)]
pub struct Outputs<P> {
    config: OutputsConfig,
    port: P,
    /// The outputs that a hold has switched off; `None` while no hold is in force.
    held: Option<u8>,
    /// True if the operator has the machine (a tool change). This counts as a hold, whatever the
    /// state is.
    is_aside: bool,
}

impl<P: OutputPort> Outputs<P> {
    /// Makes the extension; all outputs take their boot level at once.
    pub fn new(config: OutputsConfig, port: P) -> Self {
        let mut outputs = Self {
            config,
            port,
            held: None,
            is_aside: false,
        };
        outputs.take_boot_level();
        outputs
    }

    /// Returns the levels now, one bit for each output.
    pub fn levels(&self) -> u8 {
        self.port.levels() & self.config.all()
    }

    fn take_boot_level(&mut self) {
        (self.held, self.is_aside) = (None, false);
        let (all, boot) = (self.config.all(), self.config.boot);
        self.port.change(OutputChange {
            set: all & boot,
            clear: all & !boot,
        });
    }

    /// Switches outputs off for a hold, once. Motion is at rest, so that the step interrupt changes
    /// nothing meanwhile.
    fn hold(&mut self) {
        if self.held.is_none() {
            let off = self.levels() & !self.config.stay;
            self.port.change(OutputChange { set: 0, clear: off });
            self.held = Some(off);
        }
    }

    /// Switches off what is on and was off at power-up, for a hold that is in force.
    fn hold_all(&mut self) {
        let off = self.levels() & !self.config.boot;
        self.port.change(OutputChange { set: 0, clear: off });
        self.held = Some(self.held.unwrap_or(0) | off);
    }

    /// Switches on again the outputs that a hold has switched off.
    fn resume(&mut self) {
        if self.is_aside {
            return;
        }
        if let Some(set) = self.held.take() {
            self.port.change(OutputChange { set, clear: 0 });
        }
    }

    fn enters(&mut self, state: State) {
        match state {
            State::Alarm(_) => self.take_boot_level(),
            State::Hold(Hold::Complete { .. })
            | State::Door(Door::Retracting | Door::Parked)
            | State::Sleep => self.hold(),
            State::Idle | State::Run | State::Jog(_) => self.resume(),
            State::Hold(Hold::Stopping { .. })
            | State::Door(Door::Stopping | Door::Restoring)
            | State::Home
            | State::Check => {}
        }
    }
}

impl<P: OutputPort, const AXES: usize> Extension<AXES> for Outputs<P> {
    fn m_code(&self, number: u8) -> Option<MCode> {
        (self.config.count > 0 && matches!(number, 62..=65)).then_some(MCode::with(&[Letter::P]))
    }

    fn check(&self, call: &Call) -> Result<(), Status> {
        let index = call.words.get(Letter::P).ok_or(Status::MissingWord)?;
        if index.nanos() % 1_000_000_000 != 0 {
            return Err(Status::NotWhole);
        }
        match index < Number::from_int(self.config.count.into()) {
            true => Ok(()),
            false => Err(Status::OutOfRange),
        }
    }

    fn perform(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) -> Step<AXES> {
        let index = call.words.get(Letter::P).unwrap_or_default().trunc();
        let on = matches!(call.code, 62 | 64);
        let change = OutputChange::of(u8::try_from(index).unwrap_or(u8::MAX), on);
        match call.code {
            62 | 63 => cx.with_next_move(change),
            _ => self.port.change(change),
        }
        Step::Done
    }

    fn report(&self, fields: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.config.count == 0 {
            return Ok(());
        }
        fields.write_str("|Out:")?;
        let levels = self.levels();
        (0..self.config.count).try_for_each(|index| write!(fields, "{}", levels >> index & 1))
    }

    fn is_on(&self, load: Load) -> bool {
        load == Load::Outputs && self.levels() & !self.config.boot != 0
    }

    fn event(&mut self, event: Event) {
        match event {
            Event::Enters(state) => self.enters(state),
            Event::LeftAlone {
                load: Load::Outputs,
                resumes,
            } => match resumes {
                true => self.hold_all(),
                false => self.take_boot_level(),
            },
            Event::Reset | Event::ProgramEnd => self.take_boot_level(),
            Event::SetAside => {
                self.is_aside = true;
                self.hold();
            }
            Event::TakesBack => {
                self.is_aside = false;
                self.resume();
            }
            _ => {}
        }
    }
}
