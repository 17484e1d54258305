//! STM32F4-Discovery (ST, MB997; user manual UM1472): the wiring table is in this crate's README.
use crate::gpio::{Bank::*, Input, Output, Pin};
use crate::profile::{MotorPins, PowerPin, Profile, SerialPins, Timer, Usart};
use crate::settings_flash::Sector;
use leadscrew_machine::config::MachineConfig;

pub(crate) const AXES: usize = 3;
pub(crate) const MOTORS: usize = 3;
pub(crate) type Kinematics = leadscrew_planner::Cartesian;

pub(crate) const fn kinematics() -> Kinematics {
    leadscrew_planner::Cartesian
}

pub(crate) const fn config() -> MachineConfig<AXES> {
    MachineConfig::new()
}

/// As `memory/discovery.x` has it.
pub(crate) const SETTINGS_SECTORS: (Sector, Sector) = (Sector::new(1), Sector::new(2));

pub(crate) const PROFILE: Profile = Profile {
    name: "STM32F4-Discovery",
    crystal_hz: 8_000_000,
    serial: SerialPins {
        usart: Usart::Usart2,
        transmit: Pin::new(A, 2),
        receive: Pin::new(A, 3),
    },
    motors: [
        MotorPins::new(Pin::new(E, 7), Pin::new(E, 10)),
        MotorPins::new(Pin::new(E, 8), Pin::new(E, 11)),
        MotorPins::new(Pin::new(E, 9), Pin::new(E, 12)),
    ],
    enables: &[Pin::new(E, 13)],
    // The green LED.
    power: PowerPin {
        pin: Pin::new(D, 12),
        function: 2,
        timer: Timer::Tim4,
        channel: 1,
        frequency: 10_000,
    },
    // The other three LEDs: orange, red, blue.
    spindle: Some(Output::high(D, 13)),
    spindle_reverse: Some(Output::high(D, 14)),
    flood: Some(Output::high(D, 15)),
    mist: Some(Output::high(D, 11)),
    high: &[],
    limits: [
        Some(Input::to_ground(E, 4)),
        Some(Input::to_ground(E, 5)),
        Some(Input::to_ground(E, 6)),
    ],
    probe: Some(Input::to_ground(C, 1)),
    door: Some(Input::to_ground(C, 2)),
    reset: Some(Input::to_ground(C, 8)),
    hold: Some(Input::to_ground(C, 9)),
    // The blue button makes its pin high.
    start: Some(Input::to_supply(A, 0)),
};
