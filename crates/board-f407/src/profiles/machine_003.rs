//! An engraver on an STM32F4-Discovery: L297 and L298 drivers in half steps, screws of 4 mm, Z between two switches.
//!
//! The wiring is that of the machine as it was built in 2013; the wiring table, with the conflicts on the Discovery, is in
//! this crate's README. What is new: power and spindle pins, since the original had none.
use crate::gpio::{Bank::*, Input, Output, Pin};
use crate::profile::{MotorPins, PowerPin, Profile, SerialPins, Timer, Usart};
use crate::settings_flash::Sector;
use leadscrew_gcode::Number;
use leadscrew_machine::{
    config::MachineConfig,
    settings::{
        table::{AxisSetting, Setting},
        values::Entry,
    },
};

pub(crate) const AXES: usize = 3;
pub(crate) const MOTORS: usize = 3;
pub(crate) type Kinematics = leadscrew_planner::Cartesian;

pub(crate) const fn kinematics() -> Kinematics {
    leadscrew_planner::Cartesian
}

/// A setting's first value, for the axis `axis` of those that have one each.
const fn entry(number: u16, axis: u16, value: i32) -> Entry {
    Entry {
        number: number + axis,
        value: Number::from_int(value),
    }
}

/// 400 half steps a turn and 4 mm a turn are 100 steps/mm; 2 kHz of half steps is what the motors do (20 mm/s); the drivers
/// are enabled by a high level. Home is where Z meets its upper switch; X and Y have none.
const DEFAULTS: &[Entry] = &[
    entry(Setting::EnableInvert.row().number, 0, 1),
    entry(AxisSetting::StepsPerMm.row().number, 0, 100),
    entry(AxisSetting::StepsPerMm.row().number, 1, 100),
    entry(AxisSetting::StepsPerMm.row().number, 2, 100),
    entry(AxisSetting::MaxRate.row().number, 0, 1200),
    entry(AxisSetting::MaxRate.row().number, 1, 1200),
    entry(AxisSetting::MaxRate.row().number, 2, 1200),
];

pub(crate) const fn config() -> MachineConfig<AXES> {
    let mut config = MachineConfig::new();
    config.defaults = DEFAULTS;
    config.homing_cycles = [0b100, 0, 0, 0];
    config
}

/// As `memory/discovery.x` has it.
pub(crate) const SETTINGS_SECTORS: (Sector, Sector) = (Sector::new(1), Sector::new(2));

pub(crate) const PROFILE: Profile = Profile {
    name: "machine 003",
    crystal_hz: 8_000_000,
    serial: SerialPins {
        usart: Usart::Usart1,
        transmit: Pin::new(B, 6),
        receive: Pin::new(B, 7),
    },
    motors: [
        MotorPins::new(Pin::new(D, 12), Pin::new(D, 13)),
        MotorPins::new(Pin::new(A, 0), Pin::new(A, 1)),
        MotorPins::new(Pin::new(C, 6), Pin::new(C, 7)),
    ],
    // X and Y; the Z driver is always enabled.
    enables: &[Pin::new(D, 14), Pin::new(D, 15)],
    power: PowerPin {
        pin: Pin::new(E, 9),
        function: 1,
        timer: Timer::Tim1,
        channel: 1,
        frequency: 10_000,
    },
    spindle: Some(Output::high(E, 11)),
    spindle_reverse: None,
    flood: None,
    mist: None,
    // They feed the switches of Z.
    high: &[Pin::new(D, 1), Pin::new(D, 3)],
    // The upper switch is Z's limit, the lower one the probe: `G38.2 Z-50 F100` lowers the tool onto it.
    limits: [None, None, Some(Input::to_supply(D, 2))],
    probe: Some(Input::to_supply(D, 4)),
    door: None,
    reset: Some(Input::to_ground(C, 8)),
    hold: Some(Input::to_ground(C, 9)),
    start: Some(Input::to_ground(C, 11)),
};
