//! A board whose pins are in its record in flash.
//!
//! The record is checked once, at start-up. A pin is decoded each time it is asked for. The tables
//! of the interrupts are filled from here before the interrupts use them. Without a record the
//! board has only the two pins of a serial line.
use super::number;
use crate::{
    chip::{Bank, Timer, Usart},
    fast_memory,
    gpio::{Input, Output, Pin, Pull},
    sector::Sector,
};
use core::sync::atomic::{AtomicU8, Ordering::Relaxed};
use leadscrew_machine::{
    config::{AxisKind, MachineConfig},
    settings::values::Entry,
};
use leadscrew_record::{Content, Motor, PinCode, Record, Refusal};

/// An image for four motors: the record says how they move the axes.
#[cfg(four_motors)]
mod four {
    use leadscrew_machine::step_timing::StepTiming;
    use leadscrew_planner::Train;
    use leadscrew_record::Image;

    pub(super) const IMAGE: Image = Image::Four;
    pub(super) const COUNT: usize = 4;
    pub(super) const TIMING: StepTiming = StepTiming::F407_RECORD_FOUR;

    pub(crate) type Kinematics = Train;

    pub(crate) fn kinematics() -> Kinematics {
        match super::content().shape.kinematics {
            0 => Train::Straight,
            1 => Train::Crossed,
            second => Train::Ganged(usize::from(second) - 2),
        }
    }
}

/// An image for three axes, and a motor for each.
#[cfg(not(four_motors))]
mod three {
    use leadscrew_machine::step_timing::StepTiming;
    use leadscrew_planner::Cartesian;
    use leadscrew_record::Image;

    pub(super) const IMAGE: Image = Image::Three;
    pub(super) const COUNT: usize = 3;
    pub(super) const TIMING: StepTiming = StepTiming::F407_RECORD;

    pub(crate) type Kinematics = Cartesian;

    pub(crate) const fn kinematics() -> Kinematics {
        Cartesian
    }
}

#[cfg(four_motors)]
use four as image;
#[cfg(not(four_motors))]
use three as image;

pub(crate) use image::{kinematics, Kinematics};

pub(crate) const AXES: usize = image::COUNT;
pub(crate) const MOTORS: usize = image::COUNT;

/// The outputs of M62 to M65: they need a machine's file, and a board with a record has none.
pub(crate) const SYNCHRONISED: &[Output] = &[];

/// The extensions of the machine: none.
pub(crate) type Own = ();

/// Makes the extensions.
pub(crate) fn own() -> Own {}

/// The place of the record in force, counted from 1; 0: there is none.
static IN_FORCE: AtomicU8 = AtomicU8::new(0);

/// Looks for the record. Returns the fault if no record is in force. Start-up, before anything else
/// asks for a pin.
pub(crate) fn find() -> Option<&'static str> {
    match look_for() {
        Ok(place) => {
            IN_FORCE.store(place as u8 + 1, Relaxed);
            None
        }
        Err(refusal) => Some(refusal.text()),
    }
}

fn look_for() -> Result<usize, Refusal> {
    let first_word = |place| {
        let bytes = fast_memory::record(place).first_chunk();
        bytes.map_or(u32::MAX, |word| u32::from_le_bytes(*word))
    };
    let place = leadscrew_record::slot(first_word).ok_or(Refusal::Missing)?;
    check(fast_memory::record(place))?;
    Ok(place)
}

/// Checks that a record is whole and fits this image.
pub(crate) fn check(bytes: &[u8]) -> Result<(), Refusal> {
    let (record, _) = Record::read(bytes)?;
    let start = Sector::at(fast_memory::start());
    let behind = Sector::behind(fast_memory::end());
    record.content.fits(image::IMAGE, start.0, behind.0)
}

/// The content of the record in force, or a board without pins. Any context.
#[inline(never)] // inlined, an image with a record takes 600 bytes more
pub(crate) fn content() -> &'static Content {
    match IN_FORCE.load(Relaxed) {
        0 => &Content::NONE,
        place => Record::content(fast_memory::record(usize::from(place) - 1)),
    }
}

/// Axes, order of homing and settings of a new machine, with the options that the board has pins
/// for.
pub(crate) fn config() -> MachineConfig<AXES> {
    let content = content();
    let mut config = MachineConfig::new();
    for (axis, kind) in config.axes.iter_mut().enumerate() {
        *kind = match content.rotary >> axis & 1 {
            _ if axis >= usize::from(content.shape.axes) => AxisKind::Absent,
            0 => AxisKind::Linear,
            _ => AxisKind::Rotary,
        };
    }
    config.defaults = defaults();
    config.homing_cycles = content.homing;
    config.rules.without_switch = content.without_switch;
    config.step_timing = image::TIMING;
    let [_, _, _, _, door] = buttons();
    config.options.door = door.is_some();
    config.dialect.mist = output(content.outputs.mist).is_some();
    if let Some(tick_ns) = number(option_env!("LEADSCREW_TICK_NS")) {
        config.step_timing.tick_ns = tick_ns;
    }
    config
}

/// A new machine's settings.
fn defaults() -> &'static [Entry] {
    let place = IN_FORCE.load(Relaxed).checked_sub(1);
    let record = place.and_then(|place| Record::read(fast_memory::record(place.into())).ok());
    record.map_or(&[], |(_, settings)| fast_memory::entries(settings))
}

#[inline(never)] // inlined, a record of four motors takes 420 bytes more
fn pin(code: PinCode) -> Option<Pin> {
    let (port, number) = code.pin()?;
    let bank = Bank::numbered(port);
    Some(Pin { bank, number })
}

fn output(code: PinCode) -> Option<Output> {
    let active_high = code.high();
    pin(code).map(|pin| Output { pin, active_high })
}

fn input(code: PinCode) -> Option<Input> {
    let inverted = code.high();
    let pull = if inverted { Pull::Down } else { Pull::Up };
    pin(code).map(|pin| Input {
        pin,
        pull,
        inverted,
    })
}

/// Returns the name of the board, for the log.
pub(crate) fn name() -> &'static str {
    let text = content().name.split(|byte| *byte == 0).next();
    core::str::from_utf8(text.unwrap_or_default()).unwrap_or_default()
}

/// Frequency of the crystal in Hz; 0 if there is none, or if there is no record.
pub(crate) fn crystal_hz() -> u32 {
    content().crystal_hz.get()
}

/// The two sectors of the settings. With a record only.
pub(crate) fn settings_sectors() -> (Sector, Sector) {
    let [first, second] = content().settings;
    (Sector(first), Sector(second))
}

/// Returns true if the image has the flash to itself, with no bootloader in front. Without a record
/// this decides the serial line. An image alone uses the Discovery's line. An image behind a
/// bootloader uses the line of printer boards, on which ST's own bootloader listens as well.
fn is_alone() -> bool {
    Sector::at(fast_memory::start()).0 == 0
}

/// The USART of the serial line.
pub(crate) fn usart() -> Usart {
    match content().serial.usart {
        0 if is_alone() => Usart::Usart2,
        0 | 1 => Usart::Usart1,
        _ => Usart::Usart2,
    }
}

/// The pins of the serial line, out and in.
pub(crate) fn serial_pins() -> (Pin, Pin) {
    let serial = &content().serial;
    let (transmit, receive) = if is_alone() { (2, 3) } else { (9, 10) };
    let or = |code, usual| pin(code).unwrap_or(Pin::new(Bank::A, usual));
    (or(serial.transmit, transmit), or(serial.receive, receive))
}

/// Step and direction of each motor.
pub(crate) fn motors() -> [(Option<Pin>, Option<Pin>); MOTORS] {
    let mut all = content().motors.iter();
    [(); MOTORS].map(|()| {
        let motor = all.next().unwrap_or(&Motor::NONE);
        (pin(motor.step), pin(motor.direction))
    })
}

/// The pins that enable the motors.
pub(crate) fn enables() -> impl Iterator<Item = Pin> {
    content().enables.iter().filter_map(|code| pin(*code))
}

/// Spindle on, and counter-clockwise.
pub(crate) fn spindle() -> [Option<Output>; 2] {
    let outputs = &content().outputs;
    [outputs.spindle, outputs.spindle_reverse].map(output)
}

/// Returns the outputs of flood and mist.
pub(crate) fn coolant() -> [Option<Output>; 2] {
    let outputs = &content().outputs;
    [outputs.flood, outputs.mist].map(output)
}

/// Limit switches, one input a motor.
pub(crate) fn limits() -> [Option<Input>; MOTORS] {
    let mut all = content().motors.iter();
    [(); MOTORS].map(|()| all.next().and_then(|motor| input(motor.limit)))
}

/// Probe, reset, hold, start, door.
pub(crate) fn buttons() -> [Option<Input>; 5] {
    content().buttons.map(input)
}

/// The output of laser or spindle power, and its pin's function in the data sheet's table 9.
pub(crate) fn power_output() -> Option<(Output, u8)> {
    let power = &content().power;
    output(power.pin).map(|output| (output, power.function))
}

/// The timer of laser or spindle power, and its channel, 0 to 3.
pub(crate) fn power_channel() -> (Timer, u8) {
    let power = &content().power;
    let timer = match power.timer {
        3 => Timer::Tim3,
        4 => Timer::Tim4,
        8 => Timer::Tim8,
        9 => Timer::Tim9,
        _ => Timer::Tim1,
    };
    (timer, power.channel.wrapping_sub(1) % 4)
}

/// Frequency of laser or spindle power in Hz, 50 to 100 000: the record's, or the value of
/// `LEADSCREW_POWER_HZ` at build time.
pub(crate) fn power_hz() -> u32 {
    let asked = number(option_env!("LEADSCREW_POWER_HZ"));
    asked.unwrap_or(content().power_hz.get()).clamp(50, 100_000)
}
