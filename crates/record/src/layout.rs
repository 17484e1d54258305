//! The bytes of a record.
use crate::{PinCode, SafeTable};
use core::mem::offset_of;
use zerocopy::{
    little_endian::{I64, U16, U32},
    FromBytes, Immutable, IntoBytes, KnownLayout,
};

/// The first four bytes of a record, `LSBR`, as a little-endian word.
pub const MAGIC: u32 = u32::from_le_bytes(*b"LSBR");

/// The version of the layout: in version 3, power may be on while its pin is low.
pub const VERSION: u16 = 3;

/// The oldest version that is read. [`Record::pack`] makes it of all records that a firmware of
/// that time may read.
pub const OLDEST: u16 = 2;

/// The offset of the [`SafeTable`] in a record, in bytes.
pub const SAFE: usize = offset_of!(Record, content) + offset_of!(Content, safe);

/// Bytes of a board's name.
pub const NAME: usize = 32;

/// The most motors of a record.
pub const MOTORS: usize = 4;

/// The most pins that enable the motors.
pub const ENABLES: usize = 8;

/// The most settings of a new machine. There are few, because the outputs float after a reset until
/// the checksum over them has been made.
pub const SETTINGS: usize = 64;

/// The first fields of every record.
#[derive(Clone, Copy, PartialEq, Eq, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Head {
    /// The mark of a record, [`crate::MAGIC`].
    pub magic: U32,
    /// CRC-32 of the bytes behind this field, to the record's end.
    pub checksum: U32,
    /// The version of the layout, [`crate::VERSION`].
    pub version: U16,
    /// The length of the whole record in bytes, with its settings.
    pub length: U16,
}

/// The machine that a record is for.
#[derive(Clone, Copy, PartialEq, Eq, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Shape {
    /// Axes of the machine.
    pub axes: u8,
    /// Motors of the machine.
    pub motors: u8,
    /// 0: each axis has one motor; 1: crossed belts; 2 + n: axis n has two motors.
    pub kinematics: u8,
    /// The number of settings that follow.
    pub defaults: u8,
}

/// The machines that an image is for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Image {
    /// Machines with three axes, and a motor for each.
    Three,
    /// Machines with three or four axes, and with four motors at most. The record says which motors
    /// move which axes.
    Four,
}

impl Image {
    /// Returns true if the image is for a machine of this shape.
    #[must_use]
    pub fn takes(self, shape: &Shape) -> bool {
        match self {
            Self::Three => [shape.axes, shape.motors, shape.kinematics] == [3, 3, 0],
            Self::Four => shape.is_sound() && shape.axes >= 3 && shape.motors <= 4,
        }
    }
}

impl Shape {
    /// Returns true if each axis has a motor, and the second motor, if there is one, has an axis.
    fn is_sound(&self) -> bool {
        let second = self.kinematics.checked_sub(2);
        let motors = self.axes.checked_add(second.is_some().into());
        motors == Some(self.motors) && second.is_none_or(|axis| axis < self.axes)
    }
}

/// A USART and its pins.
#[derive(Clone, Copy, PartialEq, Eq, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Serial {
    /// The number of the USART, 1 or 2.
    pub usart: u8,
    /// The pin on which the board sends.
    pub transmit: PinCode,
    /// The pin on which the board receives.
    pub receive: PinCode,
}

/// The timer of laser or spindle power.
#[derive(Clone, Copy, PartialEq, Eq, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Power {
    /// The pin, and the level at which it is on.
    pub pin: PinCode,
    /// Number of the timer's function in the data sheet's table 9.
    pub function: u8,
    /// The number of the timer: 1, 3, 4, 8 or 9.
    pub timer: u8,
    /// The channel of the timer, 1 to 4.
    pub channel: u8,
}

/// A motor driver's pins.
#[derive(Clone, Copy, PartialEq, Eq, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Motor {
    /// The pin for step pulses.
    pub step: PinCode,
    /// The direction pin: high is negative.
    pub direction: PinCode,
    /// Its limit switch.
    pub limit: PinCode,
}

impl Motor {
    /// No motor.
    pub const NONE: Self = Self {
        step: PinCode::NONE,
        direction: PinCode::NONE,
        limit: PinCode::NONE,
    };
}

/// Outputs that a program switches.
#[derive(Clone, Copy, PartialEq, Eq, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Outputs {
    /// The output that switches the spindle on.
    pub spindle: PinCode,
    /// The output for the counter-clockwise direction of the spindle.
    pub spindle_reverse: PinCode,
    /// The output of flood coolant.
    pub flood: PinCode,
    /// The output of mist coolant.
    pub mist: PinCode,
}

impl Outputs {
    /// No output.
    pub const NONE: Self = Self {
        spindle: PinCode::NONE,
        spindle_reverse: PinCode::NONE,
        flood: PinCode::NONE,
        mist: PinCode::NONE,
    };
}

/// The part of a record between its head and its settings.
#[derive(Clone, Copy, PartialEq, Eq, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Content {
    /// Frequency of the crystal in Hz; 0: there is none.
    pub crystal_hz: U32,
    /// Frequency of laser or spindle power in Hz, 50 to 100 000.
    pub power_hz: U32,
    /// The table that makes the outputs safe.
    pub safe: SafeTable,
    /// The machine that the record is for.
    pub shape: Shape,
    /// The two sectors of the settings.
    pub settings: [u8; 2],
    /// The serial line.
    pub serial: Serial,
    /// Laser or spindle power.
    pub power: Power,
    /// Step, direction and limit switch of each motor.
    pub motors: [Motor; MOTORS],
    /// The pins that enable all motors.
    pub enables: [PinCode; ENABLES],
    /// The switched outputs.
    pub outputs: Outputs,
    /// Probe, reset, hold, start, door.
    pub buttons: [PinCode; 5],
    /// The homing cycles in their order; each is a mask of the axes that home together.
    pub homing: [u8; 4],
    /// The board's name for the log and `$I`: UTF-8, filled up with zeros.
    pub name: [u8; NAME],
    /// The axes that turn, a bit each.
    pub rotary: u8,
    /// The axes without a switch, a bit each: `$H` takes them to their zero.
    pub without_switch: u8,
    /// Zeros, so that the settings begin at a multiple of 8.
    pub reserved: [u8; 4],
}

impl Content {
    /// The oldest version of the layout that has a field for all of this.
    pub(crate) fn version(&self) -> u16 {
        let power = self.power.pin;
        match power.pin() {
            Some(_) if !power.high() => VERSION,
            _ => OLDEST,
        }
    }

    /// A board without pins, for a firmware that has found no record.
    pub const NONE: Self = Self {
        crystal_hz: U32::ZERO,
        power_hz: U32::new(10_000),
        safe: SafeTable::NONE,
        shape: Shape {
            axes: 3,
            motors: 0,
            kinematics: 0,
            defaults: 0,
        },
        settings: [0, 0],
        serial: Serial {
            usart: 0,
            transmit: PinCode::NONE,
            receive: PinCode::NONE,
        },
        power: Power {
            pin: PinCode::NONE,
            function: 0,
            timer: 1,
            channel: 1,
        },
        motors: [Motor::NONE; MOTORS],
        enables: [PinCode::NONE; ENABLES],
        outputs: Outputs::NONE,
        buttons: [PinCode::NONE; 5],
        homing: [0; 4],
        name: [0; NAME],
        rotary: 0,
        without_switch: 0,
        reserved: [0; 4],
    };
}

/// A record without its settings.
#[derive(Clone, Copy, PartialEq, Eq, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Record {
    /// Its head: magic, checksum, version, length.
    pub head: Head,
    /// Its content.
    pub content: Content,
}

/// A setting of a new machine, in the layout of the firmware's own entries.
#[derive(Clone, Copy, PartialEq, Eq, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct Setting {
    /// The number after the `$`.
    pub number: U16,
    /// Bytes without a meaning yet: zeros.
    pub reserved: [u8; 6],
    /// Its value, in units of 10⁻⁹.
    pub nanos: I64,
}
