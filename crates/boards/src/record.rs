//! A board as the record that its firmware reads.
use crate::{
    check::number_of,
    chip::channel,
    flash::{Sector, BEGIN},
    Axis, Board, Closes, Input, Kinematics, Level, Output, Pin,
};
use leadscrew_record::{
    Content, Motor, Outputs, Parts, PinCode, Power, Record, SafeTable, Serial, Setting, Shape,
    NAME, PROGRAM, SLOT,
};
use std::fmt;

/// The axes of a board without a machine's file, which one motor or more moves.
pub(crate) const AXES: u8 = 3;

/// The order of homing where a board's file does not say: Grbl's.
const GRBL_HOMING: [u8; 4] = [0b100, 0b011, 0, 0];

/// The facts of a machine's file that are in its board's record.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct MachineFacts {
    /// Axes.
    pub axes: u8,
    /// Kinematics as in [`Shape`].
    pub kinematics: u8,
    /// Axes that home together, a bit each.
    pub homing: [u8; 4],
    /// A new machine's settings: number and value in 10⁻⁹.
    pub settings: Vec<(u16, i64)>,
}

/// A machine has more settings of its own than a record has room for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TooManySettings;

impl fmt::Display for TooManySettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a new machine's settings are too many for a board's record")
    }
}

impl std::error::Error for TooManySettings {}

impl Board {
    /// The sector of its record; `None` where no sector begins at its start.
    #[must_use]
    pub fn record_sector(&self) -> Option<Sector> {
        let start = (0..12).find(|number| {
            let sector = Sector::new(*number);
            sector.is_some_and(|sector| sector.begin == self.start)
        });
        Sector::new(leadscrew_record::sector(start?))
    }

    /// Whether its record has a sector of its own, and the program has room behind it.
    #[must_use]
    pub fn has_room_for_record(&self) -> bool {
        let sectors = self.settings.map(Sector::new);
        let (Some(record), [Some(first), Some(second)]) = (self.record_sector(), sectors) else {
            return false;
        };
        let end = match first.begin < record.end() {
            true => BEGIN + self.chip.flash(),
            false => first.begin,
        };
        let room = end.saturating_sub(record.end());
        ![first, second].contains(&record) && room >= PROGRAM
    }

    /// The record of the board, which has to be free of findings. With a machine, that of the board
    /// that [`Board::fitted`] has made for it; without, the board's own machine has no use for its
    /// sockets.
    ///
    /// # Errors
    /// It is too long.
    pub fn record(&self, machine: Option<&MachineFacts>) -> Result<Vec<u8>, TooManySettings> {
        let (board, facts) = match machine {
            Some(machine) => (self.clone(), machine.clone()),
            None => (self.bare(), self.own_machine()),
        };
        let settings = facts.settings.iter().map(|(number, nanos)| Setting {
            number: (*number).into(),
            reserved: [0; 6],
            nanos: (*nanos).into(),
        });
        let settings: Vec<Setting> = settings.collect();
        let mut bytes = [0; SLOT];
        let content = board.content(&facts);
        let length = Record::pack(&content, &settings, &mut bytes).ok_or(TooManySettings)?;
        Ok(bytes[..length].to_vec())
    }

    /// The shape of the firmware for it without a machine's file.
    pub(crate) fn own_machine(&self) -> MachineFacts {
        let second = self.motor.get(usize::from(AXES)).map(|motor| motor.axis);
        let kinematics = match (self.kinematics, second) {
            (Kinematics::CoreXy, _) => 1,
            (Kinematics::Cartesian, None) => 0,
            (Kinematics::Cartesian, Some(axis)) => 2 + axis as u8,
        };
        let groups = self.homing.as_ref().map(|groups| {
            let mut masks = groups.iter().map(|axes| mask(axes));
            [0; 4].map(|_| masks.next().unwrap_or(0))
        });
        let settings = self.defaults.iter().filter_map(|(name, value)| {
            Some((number_of(name)?, i64::from(*value) * 1_000_000_000))
        });
        MachineFacts {
            axes: AXES,
            kinematics,
            homing: groups.unwrap_or(GRBL_HOMING),
            settings: settings.collect(),
        }
    }

    fn content(&self, facts: &MachineFacts) -> Content {
        let motors = self.motors();
        let mut all = motors.iter().copied();
        let buttons = self.buttons().map(|(_, button)| input(button));
        let (serial, power, outputs) = (&self.serial, &self.power, &self.outputs);
        Content {
            crystal_hz: self.crystal.into(),
            power_hz: power.frequency.into(),
            safe: self.safe(),
            shape: Shape {
                axes: facts.axes,
                motors: motors.len() as u8,
                kinematics: facts.kinematics,
                defaults: facts.settings.len() as u8,
            },
            settings: self.settings,
            serial: Serial {
                usart: serial.usart,
                transmit: pin(serial.transmit),
                receive: pin(serial.receive),
            },
            power: Power {
                pin: pin(power.pin),
                function: self.power_function().unwrap_or(0),
                timer: power.timer,
                channel: power.channel,
            },
            motors: [Motor::NONE; 4].map(|none| all.next().unwrap_or(none)),
            enables: codes(self.enable.iter().map(|one| pin(*one))),
            outputs: Outputs {
                spindle: output(outputs.spindle),
                spindle_reverse: output(outputs.spindle_reverse),
                flood: output(outputs.flood),
                mist: output(outputs.mist),
            },
            buttons,
            parts: self.parts(),
            homing: facts.homing,
            name: name(&self.name),
            reserved: 0,
        }
    }

    /// Its motors, that of the spare socket last.
    fn motors(&self) -> Vec<Motor> {
        let own = self.motor.iter();
        let own = own.map(|motor| (motor.step, motor.direction, motor.limit));
        let spare = self.sockets.motor.iter();
        let spare = spare.map(|motor| (motor.step, motor.direction, motor.limit));
        let motors = own.chain(spare).map(|(step, direction, limit)| Motor {
            step: pin(step),
            direction: pin(direction),
            limit: input(limit),
        });
        motors.collect()
    }

    fn parts(&self) -> Parts {
        let sockets = &self.sockets;
        let heaters = || sockets.heaters.iter();
        let mut channels = heaters().map(|one| channel(one.sensor).unwrap_or(0));
        let tool = sockets.tool.map(|tool| [tool.lower, tool.upper]);
        Parts {
            outputs: codes(sockets.outputs.iter().map(|one| output(Some(*one)))),
            heaters: codes(heaters().map(|one| output(Some(one.output())))),
            sensors: codes(heaters().map(|one| pin(one.sensor))),
            channels: [0; 4].map(|_| channels.next().unwrap_or(0)),
            supply: output(sockets.heater_supply),
            fault: input(sockets.heater_fault),
            fan: output(sockets.fan),
            tool: tool.map_or([PinCode::NONE; 2], |both| both.map(|one| input(Some(one)))),
        }
    }

    /// The pins that could do harm, and the levels at which they do not: power first.
    fn safe(&self) -> SafeTable {
        let low = |pin: Pin| (pin, false);
        let off = |output: Output| (output.pin, output.on == Level::Low);
        let motors = self.motor.iter().flat_map(|one| [one.step, one.direction]);
        let spare = self.sockets.motor.iter();
        let spare = spare.flat_map(|one| [one.step, one.direction]);
        let sockets = &self.sockets;
        let heaters = sockets.heaters.iter().map(|one| one.output());
        let switched = self.switched().map(|(_, output)| output);
        let switched = switched
            .chain(heaters)
            .chain(sockets.outputs.iter().copied())
            .chain(sockets.heater_supply)
            .chain(sockets.fan);
        let high = self.outputs.high.iter().map(|pin| (*pin, true));
        let all = std::iter::once(low(self.power.pin))
            .chain(motors.chain(spare).map(low))
            .chain(high)
            .chain(switched.map(off));
        SafeTable::new(all.map(|(pin, high)| (port(pin), pin.number, high)))
    }
}

/// One bit for each axis that is named.
fn mask(axes: &str) -> u8 {
    [('X', Axis::X), ('Y', Axis::Y), ('Z', Axis::Z)]
        .into_iter()
        .filter(|(name, _)| axes.contains(*name))
        .fold(0, |all, (_, axis)| all | 1 << axis as u8)
}

/// As many bytes of a name as there is room for, whole letters, then zeros.
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

fn codes<const N: usize>(codes: impl Iterator<Item = PinCode>) -> [PinCode; N] {
    let mut codes = codes;
    [PinCode::NONE; N].map(|none| codes.next().unwrap_or(none))
}
