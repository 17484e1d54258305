//! GRBL-compatible motion control on a board of your own.
//!
//! ```text
//!  serial line --> Serial --> Machine::poll or run --> segments --> Stepping::tick --> step pins
//!  switches -----> Watch ------^      |                              ^
//!                                     +--> Outputs: drivers, spindle |
//!                                                    timer's interrupt
//! ```
//!
//! You give one `static`, a timer with an interrupt, a serial line and pins of any HAL that
//! implements `embedded-hal` 1.0:
//!
//! ```
//! # use leadscrew::{Cartesian, Config, NoPin, Outputs, Resources, StepDir, SwitchPins};
//! # use embedded_hal::digital::{ErrorType, OutputPin};
//! # struct Pin; impl ErrorType for Pin { type Error = core::convert::Infallible; }
//! # impl OutputPin for Pin {
//! #   fn set_low(&mut self) -> Result<(), Self::Error> { Ok(()) }
//! #   fn set_high(&mut self) -> Result<(), Self::Error> { Ok(()) } }
//! # struct Timer; impl leadscrew::Alarm for Timer { fn count(&self) -> u32 { 0 }
//! #   fn ring_at(&mut self, _: u32) {} fn silence(&mut self) {} }
//! # fn pend() {}
//! # fn main() -> Result<(), leadscrew::Error> {
//! use static_cell::ConstStaticCell;
//!
//! static RESOURCES: ConstStaticCell<Resources<3, 3, 256>> =
//!     ConstStaticCell::new(Resources::new());
//!
//! let config = Config::new().timer_hz(1_000_000).with_steps_per_second(20_000);
//! let (mut machine, steps, mut serial, switches) =
//!     leadscrew::new(RESOURCES.take(), config, Cartesian)?;
//!
//! // The timer's handler calls `steps.tick()`. The serial handler calls `serial.receive(byte)`.
//! let mut steps = steps.on(StepDir::new([(Pin, Pin), (Pin, Pin), (Pin, Pin)]), Timer);
//! let mut outputs = Outputs::new(pend, Pin).with_flood(Pin);
//! # let now = |us| leadscrew::Instant::from_ticks(us);
//! let next = machine.poll(&mut outputs, now(0)); // for ever; or: machine.run(..).await
//! # "$X\n".bytes().for_each(|byte| { serial.receive(byte); });
//! # steps.tick();
//! # while machine.poll(&mut outputs, now(9)).busy {}
//! # let said: Vec<u8> = core::iter::from_fn(|| serial.next_to_send()).collect();
//! # assert!(said.starts_with(b"\r\nGrbl 1.1h"), "{said:?}");
//! # Ok(())
//! # }
//! ```
//!
//! It is right for a router, a plotter, a laser or a pick-and-place with up to eight motors on a
//! 32-bit chip with 128 KB of flash. It is not for a chip of 8 bits, nor for drives on a bus.
#![no_std]
#![forbid(unsafe_code)]

mod bell;
mod config;
mod fault;
mod flash;
mod machine;
mod motion;
mod motion_config;
mod motion_course;
mod motion_resources;
mod motion_switches;
mod motion_words;
mod outputs;
mod port;
mod resources;
#[cfg(feature = "async")]
mod run;
mod serial;
mod step_pins;
mod steps;
mod switches;
mod timed;
mod words;

pub use config::{Config, Error};
pub use fault::Fault;
pub use flash::{Flash, FlashError};
pub use machine::Machine;
pub use motion::Motion;
pub use motion_config::{MotionConfig, MotionConfigError};
pub use motion_resources::{motion, MotionParts, MotionResources};
pub use motion_words::{End, MotionError, MotionFault, MotionStatus, Speed, Turn};
pub use outputs::{Actuators, NoPin, NoPwm, OutputError, Outputs};
pub use port::Port;
pub use resources::{new, with_extension, Parts, Resources, SmallResources};
#[cfg(feature = "async")]
pub use run::Clock;
#[cfg(feature = "embassy")]
pub use run::EmbassyClock;
#[cfg(feature = "async")]
pub use serial::LineError;
pub use serial::{Listener, Serial, Speaker};
pub use step_pins::{StepDir, StepPins};
pub use steps::{LaserStepping, PinStepping, Stepping, Steps};
pub use switches::{SwitchPins, Switches, Watch};
pub use timed::{Alarm, Light, Pwm, Timed, WithoutLight};
pub use words::Pulse;

pub use leadscrew_gcode::{Letter, Number};
pub use leadscrew_machine::board::{CoolantOutput, Duration, Instant, SpindleOutput};
pub use leadscrew_machine::config::{
    AxisKind, AxisMask, Dialect, MachineConfig, Options, ParkingConfig, Squaring, SwitchRules,
};
pub use leadscrew_machine::extension;
pub use leadscrew_machine::inputs::ActiveSwitches;
pub use leadscrew_machine::machine::Next;
pub use leadscrew_machine::protocol::{
    alarm::Alarm as AlarmCode, realtime::Realtime, status::Status,
};
pub use leadscrew_machine::settings::{
    flash::SettingsStore,
    group::Group,
    table::{Kind, Row},
    values::Entry,
};
pub use leadscrew_machine::state::State;
pub use leadscrew_machine::step_timing::StepTiming;
pub use leadscrew_planner::{Cartesian, Coordinate, CoreXy, Ganged, Kinematics, Train};
pub use leadscrew_stepper::{MotorMask, OutputChange, Power, PowerScale, StepPort, Ticks};

// Third-party packages whose types stand in signatures.
#[cfg(feature = "async")]
pub use embedded_io_async;
pub use {embedded_hal, embedded_io, embedded_storage, fugit, heapless};

/// The examples of the package's README, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

/// The examples of the pages for embedders, run as tests.
#[cfg(doctest)]
mod pages {
    #[doc = include_str!("../../../docs/embedding.md")]
    struct Embedding;
    #[doc = include_str!("../../../docs/without-gcode.md")]
    struct WithoutGcode;
    #[doc = include_str!("../../../docs/async.md")]
    struct Async;
    #[doc = include_str!("../../../docs/own-m-code.md")]
    struct OwnMCode;
}
