//! BIGTREETECH SKR 2 (the revision with an STM32F407VGT6): a printer's board that can be bought, five driver sockets.
//!
//! Pins: the table of <https://teamgloomy.github.io/skr_2.0_pins.html>, where the maker's schematic
//! (<https://github.com/bigtreetech/SKR-2>, `Hardware`) is drawn up by connector. The wiring table is in this crate's README.
//!
//! Its bootloader has sectors 0 and 1 of the flash and takes `firmware.bin` from a memory card. That file has no gaps, so
//! the settings are behind it, at the end of the flash.
use crate::gpio::{Bank::*, Input, Output, Pin};
use crate::profile::{MotorPins, PowerPin, Profile, SerialPins, Timer, Usart};
use crate::settings_flash::Sector;
use leadscrew_machine::config::MachineConfig;

pub(crate) const AXES: usize = 3;

/// With `dual-y`, socket E0 drives the second motor of Y.
#[cfg(feature = "dual-y")]
mod motors {
    use leadscrew_planner::Ganged;

    pub(crate) const MOTORS: usize = 4;
    pub(crate) type Kinematics = Ganged<1>;

    pub(crate) const fn kinematics() -> Kinematics {
        Ganged { axis_of: [1] }
    }
}

/// With `core-xy`, the sockets X and Y drive the belts: X + Y and X − Y.
#[cfg(feature = "core-xy")]
mod motors {
    use leadscrew_planner::CoreXy;

    pub(crate) const MOTORS: usize = 3;
    pub(crate) type Kinematics = CoreXy;

    pub(crate) const fn kinematics() -> Kinematics {
        CoreXy
    }
}

#[cfg(not(any(feature = "dual-y", feature = "core-xy")))]
mod motors {
    use leadscrew_planner::Cartesian;

    pub(crate) const MOTORS: usize = 3;
    pub(crate) type Kinematics = Cartesian;

    pub(crate) const fn kinematics() -> Kinematics {
        Cartesian
    }
}

pub(crate) use motors::{kinematics, Kinematics, MOTORS};

pub(crate) const fn config() -> MachineConfig<AXES> {
    MachineConfig::new()
}

/// The last two, as `memory/skr_2.x` has it.
pub(crate) const SETTINGS_SECTORS: (Sector, Sector) = (Sector::new(10), Sector::new(11));

pub(crate) const PROFILE: Profile = Profile {
    name: "BIGTREETECH SKR 2",
    crystal_hz: 8_000_000,
    // The connector TFT.
    serial: SerialPins {
        usart: Usart::Usart1,
        transmit: Pin::new(A, 9),
        receive: Pin::new(A, 10),
    },
    motors: [
        MotorPins::new(Pin::new(E, 2), Pin::new(E, 1)),
        MotorPins::new(Pin::new(D, 5), Pin::new(D, 4)),
        MotorPins::new(Pin::new(A, 15), Pin::new(A, 8)),
        #[cfg(feature = "dual-y")]
        MotorPins::new(Pin::new(D, 15), Pin::new(D, 14)),
    ],
    // Sockets X, Y, Z, E0.
    enables: &[
        Pin::new(E, 3),
        Pin::new(D, 6),
        Pin::new(D, 1),
        Pin::new(C, 7),
    ],
    // The servo's connector: a signal, not a switched supply.
    power: PowerPin {
        pin: Pin::new(E, 5),
        function: 3,
        timer: Timer::Tim9,
        channel: 1,
        frequency: 10_000,
    },
    // HE0; fans 1 and 2.
    spindle: Some(Output::high(B, 3)),
    spindle_reverse: None,
    flood: Some(Output::high(B, 6)),
    mist: Some(Output::high(B, 5)),
    // "Safe power": switches the drivers' supply on.
    high: &[Pin::new(C, 13)],
    limits: [
        Some(Input::to_ground(C, 1)),
        Some(Input::to_ground(C, 3)),
        Some(Input::to_ground(C, 0)),
        // E0DET.
        #[cfg(feature = "dual-y")]
        Some(Input::to_ground(C, 2)),
    ],
    probe: Some(Input::to_ground(E, 4)),
    // The display's connector EXP1: D4 to D7.
    reset: Some(Input::to_ground(E, 10)),
    hold: Some(Input::to_ground(E, 11)),
    start: Some(Input::to_ground(E, 12)),
    door: Some(Input::to_ground(E, 13)),
};
