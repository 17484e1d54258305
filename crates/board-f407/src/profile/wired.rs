//! A board whose pins are compiled in: `build/main.rs` makes their table from the board's file.
use super::number;
use crate::{
    chip::{Bank, Timer, Usart},
    gpio::{Input, Output, Pin},
    sector::Sector,
};
use leadscrew_machine::config::MachineConfig;

/// The board that the firmware is built for.
mod selected {
    use super::{MotorPins, PowerPin, Profile, SerialPins};
    use crate::chip::{Bank, Timer, Usart};
    use crate::gpio::Pin;
    use crate::sector::Sector;
    use leadscrew_machine::{config::MachineConfig, settings::values::Entry};

    include!(concat!(env!("OUT_DIR"), "/board.rs"));
}

pub(crate) use selected::{kinematics, own, Kinematics, Own, AXES, MOTORS, PROFILE, SAFE};

#[cfg(captures)]
pub(crate) use selected::CAPTURES;
#[cfg(heaters)]
pub(crate) use selected::{HEATER_FAULT, SENSORS};

/// The profile's machine, with the options that the board has pins for. If `LEADSCREW_TICK_NS`
/// is set at build time, its value in nanoseconds replaces `StepTiming::tick_ns`. This serves to
/// find out how fast the board can step.
pub(crate) const fn config() -> MachineConfig<AXES> {
    let mut config = selected::config();
    config.options.door = PROFILE.door.is_some();
    config.dialect.mist = PROFILE.mist.is_some();
    if let Some(tick_ns) = number(option_env!("LEADSCREW_TICK_NS")) {
        config.step_timing.tick_ns = tick_ns;
    }
    config
}

/// The outputs of M62 to M65.
pub(crate) const SYNCHRONISED: &[Output] = PROFILE.synchronised;

/// A board whose pins are compiled in needs no record, so there is no reason to refuse. Start-up.
pub(crate) fn find() -> Option<&'static str> {
    None
}

/// A board: its pins and its crystal.
pub(crate) struct Profile {
    /// The name of the board, for the log.
    pub(crate) name: &'static str,
    /// Frequency of the crystal in Hz.
    pub(crate) crystal_hz: u32,
    /// The serial line.
    pub(crate) serial: SerialPins,
    /// The pins that move each motor.
    pub(crate) motors: [MotorPins; MOTORS],
    /// The pins that enable all motors. The setting `$4` says which level enables.
    pub(crate) enables: &'static [Pin],
    /// Laser or spindle power.
    pub(crate) power: PowerPin,
    /// The output that switches the spindle on.
    pub(crate) spindle: Option<Output>,
    /// The output for the counter-clockwise direction of the spindle.
    pub(crate) spindle_reverse: Option<Output>,
    /// Flood coolant.
    pub(crate) flood: Option<Output>,
    /// Mist coolant.
    pub(crate) mist: Option<Output>,
    /// Limit switches, one input a motor.
    pub(crate) limits: [Option<Input>; MOTORS],
    /// The input of the probe.
    pub(crate) probe: Option<Input>,
    /// The input of the reset button.
    pub(crate) reset: Option<Input>,
    /// The input of the feed hold button.
    pub(crate) hold: Option<Input>,
    /// The input of the cycle start button.
    pub(crate) start: Option<Input>,
    /// The input of the safety door.
    pub(crate) door: Option<Input>,
    /// The outputs of M62 to M65.
    pub(crate) synchronised: &'static [Output],
    /// The switches of heaters.
    #[cfg_attr(
        not(heaters),
        allow(
            dead_code,
            reason = "a board's file names it; only a build with heaters drives it"
        )
    )]
    pub(crate) heaters: &'static [Output],
    /// The relay that supplies all heaters.
    #[cfg_attr(
        not(heaters),
        allow(
            dead_code,
            reason = "a board's file names it; only a build with heaters drives it"
        )
    )]
    pub(crate) heater_supply: Option<Output>,
    /// A fan.
    #[cfg_attr(
        not(heaters),
        allow(
            dead_code,
            reason = "a board's file names it; only a build with heaters drives it"
        )
    )]
    pub(crate) fan: Option<Output>,
}

/// Pins of the USART.
pub(crate) struct SerialPins {
    pub(crate) usart: Usart,
    pub(crate) transmit: Pin,
    pub(crate) receive: Pin,
}

/// The pin that a timer's channel modulates.
pub(crate) struct PowerPin {
    pub(crate) output: Output,
    /// Number of the timer's function in the data sheet's table 9.
    pub(crate) function: u8,
    pub(crate) timer: Timer,
    /// The channel of the timer, 1 to 4.
    pub(crate) channel: u8,
    /// Frequency in Hz, 50 to 100 000, unless the build names another ([`POWER_HZ`]).
    pub(crate) frequency: u32,
}

/// The pins of a motor's driver.
#[cfg(not(windings))]
#[derive(Clone, Copy)]
pub(crate) struct MotorPins {
    pub(crate) step: Pin,
    pub(crate) direction: Pin,
}

#[cfg(not(windings))]
impl MotorPins {
    /// Names both pins.
    pub(crate) const fn new(step: Pin, direction: Pin) -> Self {
        Self { step, direction }
    }
}

/// The lines of a motor without driver.
#[cfg(windings)]
#[derive(Clone, Copy)]
pub(crate) struct MotorPins {
    pub(crate) lines: [Pin; Self::COUNT],
}

#[cfg(windings)]
impl MotorPins {
    /// The number of pins: one for each phase.
    pub(crate) const COUNT: usize = 5;

    /// Names the lines.
    pub(crate) const fn new(lines: [Pin; Self::COUNT]) -> Self {
        Self { lines }
    }
}

/// Returns the name of the board, for the log.
pub(crate) fn name() -> &'static str {
    PROFILE.name
}

/// Frequency of the crystal in Hz.
pub(crate) fn crystal_hz() -> u32 {
    PROFILE.crystal_hz
}

/// The two sectors of the settings.
pub(crate) fn settings_sectors() -> (Sector, Sector) {
    selected::SETTINGS_SECTORS
}

/// The USART of the serial line.
pub(crate) fn usart() -> Usart {
    PROFILE.serial.usart
}

/// The pins of the serial line, out and in.
pub(crate) fn serial_pins() -> (Pin, Pin) {
    (PROFILE.serial.transmit, PROFILE.serial.receive)
}

/// The pins that enable the motors.
pub(crate) fn enables() -> impl Iterator<Item = Pin> {
    PROFILE.enables.iter().copied()
}

/// Spindle on, and counter-clockwise.
pub(crate) fn spindle() -> [Option<Output>; 2] {
    [PROFILE.spindle, PROFILE.spindle_reverse]
}

/// Returns the outputs of flood and mist.
pub(crate) fn coolant() -> [Option<Output>; 2] {
    [PROFILE.flood, PROFILE.mist]
}

/// Frequency of laser or spindle power in Hz, 50 to 100 000: the profile's, or the value of
/// `LEADSCREW_POWER_HZ` at build time.
pub(crate) const POWER_HZ: u32 = match number(option_env!("LEADSCREW_POWER_HZ")) {
    Some(hz) => hz,
    None => PROFILE.power.frequency,
};

/// The ports of `pins`, each once, in the order of their first pins, and the number of these ports.
pub(crate) const fn banks<const N: usize>(pins: [Pin; N]) -> ([Bank; N], usize) {
    let (mut banks, mut count, mut pin) = ([Bank::A; N], 0, 0);
    while pin < N {
        if index_of(&banks, count, pins[pin].bank) == count {
            banks[count] = pins[pin].bank;
            count += 1;
        }
        pin += 1;
    }
    (banks, count)
}

/// The index of `bank` among the first `count` of `banks`; `count` if it is not among them.
pub(crate) const fn index_of<const N: usize>(banks: &[Bank; N], count: usize, bank: Bank) -> usize {
    let mut place = 0;
    while place < count && banks[place] as u8 != bank as u8 {
        place += 1;
    }
    place
}
