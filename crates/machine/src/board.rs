//! The board under the machine: slow pins, serial output, the start of the step timer.
//!
//! ```text
//!   Machine::poll(&mut board, now)          switch interrupt         step interrupt
//!        |                                       |                        |
//!        v                                       v                        v
//!   Board: write, switches, enable_motors,   Inputs::on_switches      StepPort
//!          set_spindle, set_coolant, ...
//! ```
//!
//! Implemented by the firmware's board and by the simulator. Every method is called from the main
//! loop and none may wait: a long job is begun, or done in parts ([`Board::write`]).

use crate::explain::Explain;
use crate::protocol::status::Status;
use core::fmt;
use leadscrew_stepper::{MotorMask, Power};

/// Microseconds since power-up, as the caller of `Machine::poll` counts them.
pub type Instant = fugit::TimerInstantU64<1_000_000>;

/// A span of time in microseconds.
pub type Duration = fugit::TimerDurationU64<1_000_000>;

/// One of the serial lines, counted from 0 in the order in which the machine was given them.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ChannelId(pub u8);

impl fmt::Display for ChannelId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// Electrical levels of all switches at one instant. Inputs are pulled up: `true` is high, an open
/// switch.
///
/// Which level is *active* follows from the settings (`$5`, `$6`) and the machine's configuration;
/// the board need not know it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Switches {
    /// The motors whose limit switch input is high.
    pub limits: MotorMask,
    /// Level of the probe input.
    pub probe: bool,
    /// Level of the reset button's input.
    pub reset: bool,
    /// Level of the feed hold button's input.
    pub hold: bool,
    /// Level of the cycle start button's input.
    pub start: bool,
    /// Level of the safety door's input.
    pub door: bool,
}

impl Switches {
    /// All inputs open: the report of a board without any switch.
    pub const OPEN: Self = Self {
        limits: MotorMask::from_bits(0xFF),
        probe: true,
        reset: true,
        hold: true,
        start: true,
        door: true,
    };
}

/// The direction of the spindle, or that it stands. Its power is separate, and changes from step to
/// step.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SpindleOutput {
    /// Disabled (M5).
    #[default]
    Off,
    /// Enabled, clockwise (M3; constant power of a laser).
    Clockwise,
    /// Enabled, counter-clockwise (M4; a laser's power that follows the speed).
    CounterClockwise,
}

/// Coolant valves.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CoolantOutput {
    /// Flood valve (M8).
    pub flood: bool,
    /// Mist valve (M7).
    pub mist: bool,
}

/// The wiring of the step port and the switches: settings that the board, not the machine, puts
/// into effect.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PortConfig {
    /// Least width of a step pulse in microseconds (`$0`), no less than
    /// `StepTiming::shortest_pulse_us`.
    pub pulse_us: u8,
    /// Motors whose step pulse is low (`$2`).
    pub step_invert: MotorMask,
    /// Motors whose direction pin is low in the negative direction (`$3`); the pin of all others is
    /// high then.
    pub direction_invert: MotorMask,
    /// True if the drivers are enabled by a high level (`$4`).
    pub enable_invert: bool,
    /// The time for which a switch input must keep a new level before the board believes it,
    /// microseconds, 0 to 10 000 (`$706`).
    pub filter_us: u32,
}

/// The board under the machine. All methods: main loop, never waiting.
pub trait Board {
    /// Makes the step interrupt happen as soon as possible, with the timer running from now on.
    ///
    /// The machine has called `Shared::set_running` before. Called at rest only, in a poll at
    /// `now`. Returns the instant of that interrupt, from which committed motion is counted.
    fn start_stepping(&mut self, now: Instant) -> Instant;

    /// Takes as many of `bytes` for sending on `channel` as there is room for; returns how many.
    fn write(&mut self, channel: ChannelId, bytes: &[u8]) -> usize;

    /// Reads all switches at once.
    fn switches(&self) -> Switches;

    /// Enables or disables all motor drivers.
    fn enable_motors(&mut self, on: bool);

    /// Sets direction and enable of the spindle. [`Board::set_power`] and the step interrupt set
    /// its power.
    fn set_spindle(&mut self, output: SpindleOutput);

    /// Sets the spindle's or laser's power. Called while the step timer rests, and to switch it off
    /// after a stop; in motion, power goes through `StepPort::set_power`.
    fn set_power(&mut self, power: Power);

    /// Sets the coolant valves.
    fn set_coolant(&mut self, output: CoolantOutput);

    /// Puts the wiring into effect. Called at rest only, though the last pulse may still be high: a
    /// new direction waits for its end.
    fn configure(&mut self, port: &PortConfig);

    /// The reason why the board can move nothing, if there is one. It holds as long as the board
    /// runs: the operator is told, and nothing unlocks the machine. A board that knows its pins has
    /// no such reason.
    fn locked(&self) -> Option<&'static str> {
        None
    }

    /// Returns why the program ended the last time that it did so by itself, for people: the row
    /// `[LAST END:` of `$I`. `None` if it has not.
    fn last_end(&self) -> Option<&dyn fmt::Display> {
        None
    }

    /// True if the board takes its own description over a line, by `$B=`.
    const TAKES_RECORD: bool = false;

    /// Takes the text of a line after `$B=`: a part of the board's description, or its end if
    /// there is none. At rest only. It may write a flash, for a few ms. Returns the answer to the
    /// line, and a message for the operator if there is one.
    fn take_record(&mut self, _: &[u8]) -> (Result<(), Status>, Option<&'static str>) {
        (Err(Status::InvalidStatement), None)
    }

    /// True if the board can start its loader, which takes new firmware over a line: `$DFU`.
    const HAS_LOADER: bool = false;

    /// Starts the loader soon after `now`, when the answer to the line is sent. At rest only.
    fn start_loader(&mut self, _now: Instant) {}

    /// The listener to whom the machine explains the job: a part of a simulator that draws the job,
    /// or tells why it slows down. A controller has none.
    fn explainer(&mut self) -> Option<&mut dyn Explain> {
        None
    }
}
