//! The contents of a board's file.
use crate::{chip::capture_channel, Chip, Drive, Input, Motor, MotorSocket, Pin, BOARDS};
use leadscrew_files::{read_text, shown, WRITTEN_BY_HAND};
use serde::Deserialize;
use std::{collections::BTreeMap, path::Path};

/// A board, as its file describes it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Board {
    /// The name that people read.
    pub name: String,
    /// The chip, as ST calls it.
    pub chip: Chip,
    /// Frequency of the crystal in Hz.
    pub crystal: u32,
    /// The address at which the program begins: the begin of the flash, or the end of a bootloader.
    pub start: u32,
    /// The numbers of the two flash sectors that keep the settings.
    pub settings: [u8; 2],
    /// True if the pins of the debug port, PA13 and PA14, may have another purpose: then no probe
    /// reaches the firmware while it runs.
    #[serde(default, rename = "gives-up-debug-port")]
    pub gives_up_debug_port: bool,
    /// The sources of the pins: documents that anybody can open.
    pub sources: Vec<String>,
    /// The way in which the motors move the axes.
    #[serde(default)]
    pub kinematics: Kinematics,
    /// Axes that home together, in the order in which they home, as in `["Z", "XY"]`; Grbl's order
    /// if it is left out.
    pub homing: Option<Vec<String>>,
    /// Settings that a new machine has instead of Grbl's: `"$4" = 1`.
    #[serde(default)]
    pub defaults: BTreeMap<String, i32>,
    /// The serial line.
    pub serial: Serial,
    /// The motors: X, Y and Z in this order, then second motors.
    pub motor: Vec<Motor>,
    /// The pins that enable all motors.
    pub enable: Vec<Pin>,
    /// Laser or spindle power.
    pub power: Power,
    /// The switched outputs.
    #[serde(default)]
    pub outputs: Outputs,
    /// Probe and buttons.
    #[serde(default)]
    pub inputs: Inputs,
    /// Parts that are used only if a machine's file asks for them.
    #[serde(default)]
    pub sockets: Sockets,
    /// Wires between the board's own pins. With them, a firmware is built that measures its own
    /// edges (`cargo hil`).
    #[serde(default)]
    pub wire: Vec<Wire>,
    /// The place of each pin on the board.
    pub at: BTreeMap<Pin, String>,
}

/// A wire from an output to an input of the same board.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wire {
    /// The output.
    pub from: Pin,
    /// One of the board's inputs, or a pin of channel 2, 3 or 4 of TIM2. On such a pin, the times
    /// of edges are captured.
    pub to: Pin,
}

/// The way in which the motors move the axes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kinematics {
    /// Each motor moves one axis; an axis may have two motors.
    #[default]
    Cartesian,
    /// The motors of X and Y pull crossed belts: one moves X + Y, the other X − Y.
    CoreXy,
}

/// A USART and its pins.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Serial {
    /// The number of the USART: 1 or 2.
    pub usart: u8,
    /// The pin on which the board sends.
    pub transmit: Pin,
    /// The pin on which the board receives.
    pub receive: Pin,
}

/// The pin that a timer's channel modulates.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Power {
    /// The pin.
    pub pin: Pin,
    /// Number of the timer.
    pub timer: u8,
    /// The timer's channel, 1 to 4.
    pub channel: u8,
    /// The frequency of the pulses in Hz: 50 to 100 000.
    pub frequency: u32,
    /// The level while the laser burns or the spindle is driven.
    #[serde(default)]
    pub active: Level,
}

impl Power {
    /// The pin as an output.
    pub(crate) fn output(&self) -> Output {
        let Self { pin, active, .. } = *self;
        Output { pin, on: active }
    }
}

/// The switched outputs; each may be missing.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Outputs {
    /// The output that switches the spindle on.
    pub spindle: Option<Output>,
    /// The output for the counter-clockwise direction of the spindle.
    pub spindle_reverse: Option<Output>,
    /// The output of flood coolant.
    pub flood: Option<Output>,
    /// The output of mist coolant.
    pub mist: Option<Output>,
    /// Pins that are always high.
    #[serde(default)]
    pub high: Vec<Pin>,
}

/// An output.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// The pin.
    pub pin: Pin,
    /// Its level when it is on.
    #[serde(default)]
    pub on: Level,
}

impl Output {
    /// Its level while it is off.
    fn off(self) -> Level {
        match self.on {
            Level::High => Level::Low,
            Level::Low => Level::High,
        }
    }
}

/// The level of a pin.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Level {
    /// 3.3 V.
    #[default]
    High,
    /// Ground.
    Low,
}

/// Probe and buttons; each may be missing.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inputs {
    /// The input of the probe.
    pub probe: Option<Input>,
    /// The input of the reset button.
    pub reset: Option<Input>,
    /// The input of the feed hold button.
    pub hold: Option<Input>,
    /// The input of the cycle start button.
    pub start: Option<Input>,
    /// The input of the safety door.
    pub door: Option<Input>,
}

/// Parts that are used only if a machine's file asks for them. A firmware built without such a file
/// leaves their pins alone.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Sockets {
    /// The motors beyond the third: a second motor of an axis, or motors of more axes.
    #[serde(default)]
    pub motors: Vec<MotorSocket>,
    /// The outputs of M62 to M65, `P0` first.
    #[serde(default)]
    pub outputs: Vec<Output>,
    /// The switches at the ends of a tool's travel.
    pub tool: Option<ToolSwitches>,
    /// Heaters, the nozzle's first, then the bed's.
    #[serde(default)]
    pub heaters: Vec<HeaterSocket>,
    /// The relay that supplies all heaters.
    pub heater_supply: Option<Output>,
    /// Closed while another controller, or a thermal cut-out, reports a fault of the heaters. This
    /// input does not interrupt.
    pub heater_fault: Option<Input>,
    /// A fan, on or off.
    pub fan: Option<Output>,
    /// The reference voltage of the analogue-to-digital converter, V; 3.3 if it is left out.
    pub reference: Option<f32>,
}

/// A heater's switch, and the input of its sensor.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeaterSocket {
    /// The pin of its switch.
    pub pin: Pin,
    /// The level at which it heats.
    #[serde(default)]
    pub on: Level,
    /// The pin of its sensor, a channel of ADC1.
    pub sensor: Pin,
}

impl HeaterSocket {
    /// The output of its switch.
    pub(crate) fn output(self) -> Output {
        let Self { pin, on, .. } = self;
        Output { pin, on }
    }
}

/// The switches at the ends of a tool's travel. They are read while the tool moves, and do not
/// interrupt.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToolSwitches {
    /// The switch that is closed while the tool is in the work.
    pub lower: Input,
    /// The switch that is closed while the tool is above the work.
    pub upper: Input,
}

impl Board {
    /// Reads a board's file.
    ///
    /// # Errors
    /// If the text is not TOML, or does not describe a board; the message gives line and column.
    pub fn read(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|error| error.to_string())
    }

    /// Returns the board of this name that comes with the firmware. If there is none, the board in
    /// the file of this name in `folder`.
    ///
    /// # Errors
    /// If there is neither, or the file does not describe a board; the message says where and
    /// why.
    pub fn find(asked: &str, folder: &Path) -> Result<Self, String> {
        let name = shown(asked);
        let text = match BOARDS.iter().find(|(name, _)| *name == asked) {
            Some((_, text)) => (*text).to_owned(),
            None => read_text(&folder.join(asked), WRITTEN_BY_HAND).map_err(|error| {
                format!(
                    "{name}: is no board of the firmware (`leadscrew board list`), \
                     and cannot be read: {error}"
                )
            })?,
        };
        Self::read(&text).map_err(|error| format!("{name}: {}", error.trim_end()))
    }

    /// Returns the sockets of all motors: first `[[motor]]`, then `[sockets]`.
    pub fn motor_sockets(&self) -> impl Iterator<Item = MotorSocket> + '_ {
        let own = self.motor.iter().map(|motor| motor.socket);
        own.chain(self.sockets.motors.iter().copied())
    }

    /// Returns true if the board switches the windings of its motors itself. [`Board::check`]
    /// refuses a board that has both kinds of motors.
    #[must_use]
    pub fn switches_windings(&self) -> bool {
        self.motor_sockets()
            .any(|motor| matches!(motor.drive, Drive::Windings(_)))
    }

    /// The sockets of all motors with their names: motors by number, then `spare motor 1`.
    pub(crate) fn named_motors(&self) -> impl Iterator<Item = (String, MotorSocket)> + '_ {
        let own = self.motor.len();
        self.motor_sockets()
            .enumerate()
            .map(move |(index, socket)| match index.checked_sub(own) {
                None => (format!("motor {}", index + 1), socket),
                Some(spare) => (format!("spare motor {}", spare + 1), socket),
            })
    }

    /// The outputs that a program can switch, with their purpose.
    pub(crate) fn switched(&self) -> impl Iterator<Item = (&'static str, Output)> {
        let outputs = &self.outputs;
        [
            ("spindle", outputs.spindle),
            ("spindle-reverse", outputs.spindle_reverse),
            ("flood", outputs.flood),
            ("mist", outputs.mist),
        ]
        .into_iter()
        .filter_map(|(name, output)| Some((name, output?)))
    }

    /// Returns the pins that could do harm, each with the level at which it does none: the pin of
    /// power first. An output is harmless while it is off, a pin that moves a motor while it is
    /// low.
    #[must_use]
    pub fn safe_levels(&self) -> Vec<(Pin, Level)> {
        let sockets = &self.sockets;
        let motors = self.motor_sockets().flat_map(|one| one.drive.pins());
        let high = self.outputs.high.iter().map(|pin| (*pin, Level::High));
        let switched = self.switched().map(|(_, output)| output);
        let outputs = switched
            .chain(sockets.heater_supply)
            .chain(sockets.fan)
            .chain(sockets.outputs.iter().copied())
            .chain(sockets.heaters.iter().map(|heater| heater.output()));
        let off = |output: Output| (output.pin, output.off());
        std::iter::once(off(self.power.output()))
            .chain(motors.map(|(_, pin)| (pin, Level::Low)))
            .chain(high)
            .chain(outputs.map(off))
            .collect()
    }

    /// The inputs other than limit switches, with their purpose.
    pub(crate) fn buttons(&self) -> [(&'static str, Option<Input>); 5] {
        let inputs = &self.inputs;
        [
            ("probe", inputs.probe),
            ("reset", inputs.reset),
            ("hold", inputs.hold),
            ("start", inputs.start),
            ("door", inputs.door),
        ]
    }

    /// All inputs that cause interrupts, with their purpose.
    pub(crate) fn all_inputs(&self) -> Vec<(String, Input)> {
        let limits = self
            .named_motors()
            .filter_map(|(name, socket)| Some((format!("limit of {name}"), socket.limit?)));
        let buttons = self.buttons().into_iter();
        let others = buttons.filter_map(|(name, input)| Some((name.to_owned(), input?)));
        limits.chain(others).collect()
    }

    /// Returns the wires that lead to pins of TIM2's channels, each with its channel, in the order
    /// of the file.
    #[must_use]
    pub fn captures(&self) -> Vec<(Wire, u8)> {
        let inputs: Vec<Pin> = self.all_inputs().iter().map(|(_, one)| one.pin).collect();
        let wires = self.wire.iter().filter(|wire| !inputs.contains(&wire.to));
        wires
            .filter_map(|wire| Some((*wire, capture_channel(wire.to)?)))
            .collect()
    }

    /// Returns all pins, with their purpose, in the order of the file.
    #[must_use]
    pub fn pins(&self) -> Vec<(String, Pin)> {
        let mut pins = vec![
            ("serial line, out".to_owned(), self.serial.transmit),
            ("serial line, in".to_owned(), self.serial.receive),
        ];
        for (name, motor) in self.named_motors() {
            let named = |(purpose, pin)| (format!("{purpose} of {name}"), pin);
            pins.extend(motor.drive.pins().into_iter().map(named));
        }
        pins.extend(self.enable.iter().map(|pin| ("enable".to_owned(), *pin)));
        pins.push(("power".to_owned(), self.power.pin));
        pins.extend(
            self.switched()
                .map(|(name, one)| (name.to_owned(), one.pin)),
        );
        pins.extend(
            self.outputs
                .high
                .iter()
                .map(|pin| ("high".to_owned(), *pin)),
        );
        pins.extend(
            self.all_inputs()
                .into_iter()
                .map(|(name, one)| (name, one.pin)),
        );
        let captures = self.captures().into_iter().enumerate();
        pins.extend(captures.map(|(number, (wire, _))| (format!("capture {number}"), wire.to)));
        // The pins of the tool's switches may also be inputs with another purpose.
        let seen: Vec<Pin> = pins.iter().map(|(_, pin)| *pin).collect();
        let tool = self.sockets.tool_pins();
        pins.extend(self.sockets.pins());
        pins.extend(tool.into_iter().filter(|(_, pin)| !seen.contains(pin)));
        pins
    }
}

impl Sockets {
    /// All pins with their purpose, without the pins of the tool's switches, which
    /// [`Self::tool_pins`] lists.
    fn pins(&self) -> Vec<(String, Pin)> {
        let mut pins = Vec::new();
        let outputs = self.outputs.iter().enumerate();
        pins.extend(outputs.map(|(number, output)| (format!("output P{number}"), output.pin)));
        for (number, heater) in self.heaters.iter().enumerate() {
            pins.push((format!("heater {number}"), heater.pin));
            pins.push((format!("sensor of heater {number}"), heater.sensor));
        }
        let supply = self.heater_supply.map(|relay| relay.pin);
        pins.extend(supply.map(|pin| ("supply of the heaters".to_owned(), pin)));
        let fault = self.heater_fault.map(|input| input.pin);
        pins.extend(fault.map(|pin| ("fault of the heaters".to_owned(), pin)));
        pins.extend(self.fan.map(|fan| ("fan".to_owned(), fan.pin)));
        pins
    }

    fn tool_pins(&self) -> Vec<(String, Pin)> {
        let Some(tool) = self.tool else {
            return Vec::new();
        };
        let named = |name: &str, switch: Input| (format!("{name} switch of the tool"), switch.pin);
        vec![named("lower", tool.lower), named("upper", tool.upper)]
    }
}
