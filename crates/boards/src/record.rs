//! Makes a board's record: bytes in the flash from which a firmware that is built without pins
//! reads its pins and its machine.
use crate::{
    check::number_of,
    flash::{Sector, BEGIN},
    Axis, Board, Closes, Drive, Input, Kinematics, Level, MotorSocket, Output, Pin,
};
use leadscrew_record::{
    Content, Motor, Outputs, PinCode, Power, Record, SafeTable, Serial, Setting, Shape, ENABLES,
    MOTORS, NAME, PART, PROGRAM, SLOT,
};
use std::fmt;

/// The number of axes of a board without a machine's file. Each has one motor or more.
pub(crate) const AXES: u8 = 3;

/// The order of homing if a board's file does not say: Grbl's.
const GRBL_HOMING: [u8; 4] = [0b100, 0b011, 0, 0];

/// The part of a record that describes the machine, without its pins.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Machine {
    /// The number of its axes, 3 or 4.
    pub axes: u8,
    /// 0: each axis has one motor; 1: crossed belts; 2 + n: axis n has two motors.
    pub kinematics: u8,
    /// The axes that turn, a bit each.
    pub rotary: u8,
    /// The axes without a switch, a bit each: `$H` takes them to their zero.
    pub without_switch: u8,
    /// The homing cycles in their order; each is a mask of the axes that home together.
    pub homing: [u8; 4],
    /// Settings that a new machine has instead of Grbl's: numbers, and values in units of 10⁻⁹.
    pub settings: Vec<(u16, i64)>,
}

/// The reason why a board has no record.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum NoRecord {
    /// It has more settings or enable pins than a record has room for.
    TooLong,
    /// It has motors without a driver, or too many.
    Motors,
}

impl fmt::Display for NoRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooLong => {
                f.write_str("the settings or the pins of `enable` are too many for a record")
            }
            Self::Motors => write!(f, "a record has up to {MOTORS} motors, with drivers"),
        }
    }
}

impl std::error::Error for NoRecord {}

impl Board {
    /// Returns the sector of the board's record; `None` if no sector begins at [`Board::start`].
    #[must_use]
    pub fn record_sector(&self) -> Option<Sector> {
        let start = (0..12).find(|number| {
            let sector = Sector::new(*number);
            sector.is_some_and(|sector| sector.begin == self.start)
        });
        Sector::new(leadscrew_record::sector(start?))
    }

    /// Returns the address at which the room for the program behind the board's record ends: there
    /// are the settings, or the flash ends. `None` if the record has no sector of its own, or less
    /// room behind it than an image needs.
    #[must_use]
    pub fn record_end(&self) -> Option<u32> {
        let record = self.record_sector()?;
        let settings @ [first, _] = self.settings.map(Sector::new);
        let first = first?;
        let end = match first.begin < record.end() {
            true => BEGIN + self.chip.flash(),
            false => first.begin,
        };
        let room = end.saturating_sub(record.end());
        (!settings.contains(&Some(record)) && room >= PROGRAM).then_some(end)
    }

    /// Returns the record of the board, without its sockets, which only a machine's file puts to
    /// use. [`Board::check`] must have found no mistake.
    ///
    /// # Errors
    /// The board has more settings, enable pins or motors than a record has room for, or windings.
    pub fn record(&self) -> Result<Vec<u8>, NoRecord> {
        self.bare().record_for(&self.machine())
    }

    /// Returns the record of a board that is fitted to a machine ([`Board::fitted`]).
    ///
    /// # Errors
    /// The board has more enable pins or motors, or the machine more settings, than a record has
    /// room for; or the board has windings.
    pub fn record_for(&self, machine: &Machine) -> Result<Vec<u8>, NoRecord> {
        let settings = machine.settings.iter().map(|(number, nanos)| Setting {
            number: (*number).into(),
            reserved: [0; 6],
            nanos: (*nanos).into(),
        });
        let settings: Vec<Setting> = settings.collect();
        let count = u8::try_from(settings.len()).map_err(|_| NoRecord::TooLong)?;
        if self.enable.len() > ENABLES {
            return Err(NoRecord::TooLong);
        }
        let mut bytes = [0; SLOT];
        let motors = self.recorded_motors().ok_or(NoRecord::Motors)?;
        let content = self.content(machine, motors, count);
        let length = Record::pack(&content, &settings, &mut bytes).ok_or(NoRecord::TooLong)?;
        Ok(bytes[..length].to_vec())
    }

    /// Returns the lines that send a record to a firmware. Each has a part of the record; the last
    /// one ends it.
    #[must_use]
    pub fn record_lines(record: &[u8]) -> Vec<String> {
        let line = |(number, part): (usize, &[u8])| {
            let place = (number * PART) as u16; // a record has 2 KiB
            let mut bytes = place.to_be_bytes().to_vec();
            bytes.extend(part);
            let sum = bytes
                .iter()
                .fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
            bytes.push(sum.wrapping_neg());
            let digits = bytes.iter().map(|byte| format!("{byte:02X}"));
            format!("$B={}", digits.collect::<String>())
        };
        let parts = record.chunks(PART).enumerate().map(line);
        parts.chain(std::iter::once("$B=".to_owned())).collect()
    }

    /// Returns the machine of a board without a machine's file.
    #[must_use]
    pub fn machine(&self) -> Machine {
        let second = self.motor.get(usize::from(AXES)).map(|motor| motor.axis);
        let settings = self.defaults.iter().filter_map(|(name, value)| {
            Some((number_of(name)?, i64::from(*value) * 1_000_000_000))
        });
        Machine {
            axes: AXES,
            kinematics: match (self.kinematics, second) {
                (Kinematics::CoreXy, _) => 1,
                (Kinematics::Cartesian, None) => 0,
                (Kinematics::Cartesian, Some(axis)) => 2 + axis as u8,
            },
            rotary: 0,
            without_switch: 0,
            homing: self.homing_cycles(),
            settings: settings.collect(),
        }
    }

    /// Axes that home together, a bit each.
    fn homing_cycles(&self) -> [u8; 4] {
        let Some(groups) = &self.homing else {
            return GRBL_HOMING;
        };
        let mut masks = groups.iter().map(|axes| mask(axes));
        [0; 4].map(|_| masks.next().unwrap_or(0))
    }

    /// The motors, if each has a driver and a record has room for them.
    fn recorded_motors(&self) -> Option<Vec<Motor>> {
        let motors: Option<Vec<Motor>> = self.motor_sockets().map(recorded_motor).collect();
        motors.filter(|motors| motors.len() <= MOTORS)
    }

    fn content(&self, machine: &Machine, motors: Vec<Motor>, defaults: u8) -> Content {
        let count = motors.len() as u8; // 4 at most
        let mut motors = motors.into_iter();
        let mut enables = self.enable.iter().map(|one| pin(*one));
        let buttons = self.buttons().map(|(_, button)| input(button));
        let (serial, power, outputs) = (&self.serial, &self.power, &self.outputs);
        Content {
            crystal_hz: self.crystal.into(),
            power_hz: power.frequency.into(),
            safe: self.safe(),
            shape: Shape {
                axes: machine.axes,
                motors: count,
                kinematics: machine.kinematics,
                defaults,
            },
            settings: self.settings,
            serial: Serial {
                usart: serial.usart,
                transmit: pin(serial.transmit),
                receive: pin(serial.receive),
            },
            power: Power {
                pin: output(Some(power.output())),
                function: self.power_function().unwrap_or(0),
                timer: power.timer,
                channel: power.channel,
            },
            motors: [Motor::NONE; MOTORS].map(|none| motors.next().unwrap_or(none)),
            enables: [PinCode::NONE; ENABLES].map(|none| enables.next().unwrap_or(none)),
            outputs: Outputs {
                spindle: output(outputs.spindle),
                spindle_reverse: output(outputs.spindle_reverse),
                flood: output(outputs.flood),
                mist: output(outputs.mist),
            },
            buttons,
            homing: machine.homing,
            name: name(&self.name),
            rotary: machine.rotary,
            without_switch: machine.without_switch,
            reserved: [0; 4],
        }
    }

    /// [`Board::safe_levels`] as a record has them.
    fn safe(&self) -> SafeTable {
        let levels = self.safe_levels().into_iter();
        SafeTable::new(levels.map(|(pin, level)| (port(pin), pin.number, level == Level::High)))
    }
}

/// A motor with a driver, as a record has it.
fn recorded_motor(motor: MotorSocket) -> Option<Motor> {
    match motor.drive {
        Drive::Driver { step, direction } => Some(Motor {
            step: pin(step),
            direction: pin(direction),
            limit: input(motor.limit),
        }),
        Drive::Windings(_) => None,
    }
}

/// A mask with one bit for each axis in `axes`.
pub(crate) fn mask(axes: &str) -> u8 {
    [('X', Axis::X), ('Y', Axis::Y), ('Z', Axis::Z)]
        .into_iter()
        .filter(|(name, _)| axes.contains(*name))
        .fold(0, |all, (_, axis)| all | 1 << axis as u8)
}

/// The bytes of a name, cut to whole letters if it is too long, and filled up with zeros.
fn name(text: &str) -> [u8; NAME] {
    let mut bytes = text.as_bytes()[..text.floor_char_boundary(NAME)].iter();
    [0; NAME].map(|_| bytes.next().copied().unwrap_or(0))
}

fn port(pin: Pin) -> u8 {
    pin.port as u8 - b'A'
}

fn code(pin: Pin, high: bool) -> PinCode {
    PinCode::new(port(pin), pin.number, high).unwrap_or(PinCode::NONE)
}

fn pin(pin: Pin) -> PinCode {
    code(pin, true)
}

fn output(output: Option<Output>) -> PinCode {
    output.map_or(PinCode::NONE, |one| code(one.pin, one.on == Level::High))
}

fn input(input: Option<Input>) -> PinCode {
    input.map_or(PinCode::NONE, |one| {
        code(one.pin, one.closes == Closes::ToSupply)
    })
}
