//! Checks a board against its chip.
use crate::{
    chip::{channel, function, hears},
    flash::{Sector, BEGIN},
    Axis, Board, Drive, Kinematics, Pin, Wire,
};
use leadscrew_record::PROGRAM;
use std::{collections::BTreeMap, fmt};

/// The timers that can modulate power. The others have another task already, or no pin of their
/// own.
const POWER_TIMERS: [u8; 5] = [1, 3, 4, 8, 9];
/// The frequency of the PLL's VCO in Hz: twice 168 MHz. The 48 MHz for USB are divided from it, too
/// (RM0090 section 7.3.2).
const VCO: u32 = 336_000_000;
/// The DMA requests of TIM2's channels, and the streams on which the firmware receives them.
const CAPTURES: [(&str, &str); 3] = [
    ("TIM2_CH2", "DMA1.6.3"),
    ("TIM2_CH3", "DMA1.1.3"),
    ("TIM2_CH4", "DMA1.7.3"),
];
/// The most motors that the firmware drives.
const MOTORS: usize = 6;
/// The most wires of a self-test.
const WIRES: usize = 6;

/// A mistake in a board's file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Finding(String);

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Notes a mistake unless `right` is true.
fn expect(findings: &mut Vec<Finding>, right: bool, words: impl FnOnce() -> String) {
    if !right {
        findings.push(Finding(words()));
    }
}

impl Board {
    /// Returns the mistakes in the board's file; if there are none, the firmware can be built for
    /// the board.
    #[must_use]
    pub fn check(&self) -> Vec<Finding> {
        let mut findings = Vec::new();
        self.check_pins(&mut findings);
        self.check_lines(&mut findings);
        self.check_motors(&mut findings);
        self.check_heaters(&mut findings);
        self.check_serial(&mut findings);
        self.check_power(&mut findings);
        self.check_clock(&mut findings);
        self.check_flash(&mut findings);
        self.check_settings(&mut findings);
        self.check_wires(&mut findings);
        findings
    }

    /// Returns what the owner of the board should know, though the firmware can be built: pins of
    /// the debug port that have another purpose.
    #[must_use]
    pub fn warnings(&self) -> Vec<Finding> {
        let pins = self.pins().into_iter().filter(|(_, pin)| is_debug(*pin));
        let warning = |(name, pin)| {
            Finding(format!(
                "{name}: {pin} is the debug port's (SWD): a probe reaches the chip only under reset"
            ))
        };
        pins.map(warning).collect()
    }

    /// Checks that each pin exists, is free, is used only once, and has a place on the board.
    fn check_pins(&self, findings: &mut Vec<Finding>) {
        let mut users: BTreeMap<Pin, String> = BTreeMap::new();
        for (name, pin) in self.pins() {
            expect(findings, self.chip.has(pin), || {
                format!("{name}: the chip has no {pin}")
            });
            if is_usb(pin) {
                findings.push(Finding(format!("{name}: {pin} is USB's")));
            }
            let is_free = self.gives_up_debug_port || !is_debug(pin);
            expect(findings, is_free, || {
                format!(
                    "{name}: {pin} is the debug port's (SWD), unless the file says \
                     `gives-up-debug-port = true`"
                )
            });
            expect(findings, self.at.contains_key(&pin), || {
                format!("{name}: `at` does not say where {pin} is on the board")
            });
            if let Some(other) = users.insert(pin, name.clone()) {
                findings.push(Finding(format!("{pin}: {other}, and {name}")));
            }
        }
        for pin in self.at.keys().filter(|pin| !users.contains_key(pin)) {
            findings.push(Finding(format!("{pin}: in `at`, and nowhere else")));
        }
        expect(findings, !self.sources.is_empty(), || {
            "sources: none".to_owned()
        });
    }

    /// Checks that each input has an EXTI line of its own. The line's number is the pin's (RM0090
    /// section 12.2.5).
    fn check_lines(&self, findings: &mut Vec<Finding>) {
        let mut lines: BTreeMap<u8, (String, Pin)> = BTreeMap::new();
        for (name, input) in self.all_inputs() {
            let (pin, line) = (input.pin, input.pin.number);
            if let Some((other, first)) = lines.insert(line, (name.clone(), pin)) {
                findings.push(Finding(format!(
                    "{other} ({first}) and {name} ({pin}) are both on line {line} of EXTI"
                )));
            }
        }
    }

    fn check_motors(&self, findings: &mut Vec<Finding>) {
        let axes: Vec<Axis> = self.motor.iter().map(|motor| motor.axis).collect();
        let begins = axes.starts_with(&[Axis::X, Axis::Y, Axis::Z]);
        expect(findings, begins, || {
            "motor: the first three are those of X, Y and Z".to_owned()
        });
        let motors = self.motor_sockets().count();
        expect(findings, motors <= MOTORS, || {
            format!("motor: {motors} of them, {MOTORS} are driven")
        });
        self.check_windings(findings);
        let crossed = self.kinematics == Kinematics::CoreXy;
        expect(findings, !crossed || axes.len() == 3, || {
            "kinematics: crossed belts have no second motor".to_owned()
        });
        for group in self.homing.iter().flatten() {
            let known = !group.is_empty() && group.chars().all(|axis| "XYZ".contains(axis));
            expect(findings, known, || {
                format!("homing: `{group}` names no axes")
            });
        }
        let groups = self.homing.as_ref().map_or(0, Vec::len);
        expect(findings, groups <= 4, || {
            format!("homing: {groups} groups, four are kept")
        });
    }

    /// Checks that all motors are of one kind, and that the lines of a motor are on one port, so
    /// that they change at the same instant.
    fn check_windings(&self, findings: &mut Vec<Finding>) {
        for (name, motor) in self.named_motors() {
            let lines = match motor.drive {
                Drive::Driver { .. } if self.switches_windings() => {
                    findings.push(Finding(format!("{name}: a driver, and others have lines")));
                    continue;
                }
                Drive::Driver { .. } => continue,
                Drive::Windings(lines) => lines,
            };
            let port = lines[0].port;
            expect(findings, lines.iter().all(|pin| pin.port == port), || {
                format!("{name}: its lines are on more than one port")
            });
        }
    }

    /// Checks that each sensor's pin has a channel of the converter. The converter converts at most
    /// four sensors in a row (RM0090 section 13.3.3), so there may be no more.
    fn check_heaters(&self, findings: &mut Vec<Finding>) {
        let heaters = &self.sockets.heaters;
        for (number, heater) in heaters.iter().enumerate() {
            expect(findings, channel(heater.sensor).is_some(), || {
                format!(
                    "sensor of heater {number}: {} is no channel of ADC1",
                    heater.sensor
                )
            });
        }
        expect(findings, heaters.len() <= 4, || {
            format!("heaters: {} of them, four are read", heaters.len())
        });
        if let Some(volts) = self.sockets.reference {
            expect(findings, volts.is_finite() && volts > 0.0, || {
                format!("reference: {volts} V, expected a finite number above 0")
            });
        }
    }

    /// Checks that the serial line's pins belong to the USART, and that its requests reach the DMA
    /// streams that the firmware uses.
    fn check_serial(&self, findings: &mut Vec<Finding>) {
        let usart = self.serial.usart;
        let streams = match usart {
            1 => ["DMA2.5.4", "DMA2.7.4"],
            2 => ["DMA1.5.4", "DMA1.6.4"],
            _ => {
                findings.push(Finding(format!("serial: USART{usart} is not 1 or 2")));
                return;
            }
        };
        let ends = [("RX", self.serial.receive), ("TX", self.serial.transmit)];
        for ((signal, pin), stream) in ends.into_iter().zip(streams) {
            let name = format!("USART{usart}_{signal}");
            expect(findings, function(pin, &name) == Some(7), || {
                format!("serial: {pin} cannot be {name}")
            });
            expect(findings, hears(&name, stream), || {
                format!("serial: no stream {stream} for {name}")
            });
        }
    }

    /// Checks that each wire leads from an output to an input or to a channel of TIM2. The
    /// channel's requests have to reach DMA streams that the serial line does not use.
    fn check_wires(&self, findings: &mut Vec<Finding>) {
        if self.wire.is_empty() {
            return;
        }
        let (captures, inputs) = (self.captures(), self.all_inputs());
        for wire in &self.wire {
            let Wire { from, to } = wire;
            expect(findings, self.drives(*from), || {
                format!("wire: {from} is no output of the board")
            });
            let is_input = inputs.iter().any(|(_, input)| input.pin == *to);
            let is_capture = captures.iter().any(|(capture, _)| capture == wire);
            expect(findings, is_input || is_capture, || {
                format!("wire: {to} is neither an input nor channel 2, 3 or 4 of TIM2")
            });
        }
        for (request, stream) in CAPTURES {
            expect(findings, hears(request, stream), || {
                format!("wire: no stream {stream} for {request}")
            });
        }
        expect(
            findings,
            captures.is_empty() || self.serial.usart == 1,
            || "wire: stream 6 of DMA1 is the serial line's, unless that is on USART1".to_owned(),
        );
        expect(findings, self.wire.len() <= WIRES, || {
            format!("wire: {} of them, {WIRES} at most", self.wire.len())
        });
    }

    /// Returns true if a pin is an output of the board.
    fn drives(&self, pin: Pin) -> bool {
        let motors = self.motor.iter().flat_map(|one| one.socket.drive.pins());
        let motors = motors.map(|(_, pin)| pin);
        let switched = self.switched().map(|(_, output)| output.pin);
        let mut outputs = motors.chain(switched).chain([self.power.pin]);
        outputs.any(|output| output == pin)
    }

    fn check_power(&self, findings: &mut Vec<Finding>) {
        let power = &self.power;
        expect(findings, POWER_TIMERS.contains(&power.timer), || {
            format!("power: TIM{} is not one of {POWER_TIMERS:?}", power.timer)
        });
        expect(findings, self.power_function().is_some(), || {
            let (pin, timer, channel) = (power.pin, power.timer, power.channel);
            format!("power: {pin} cannot be channel {channel} of TIM{timer}")
        });
        expect(findings, (50..=100_000).contains(&power.frequency), || {
            format!("power: {} Hz are not 50 to 100 000", power.frequency)
        });
    }

    /// The number of the alternate function that connects the power pin to its timer's channel.
    pub(crate) fn power_function(&self) -> Option<u8> {
        let power = &self.power;
        let signal = format!("TIM{}_CH{}", power.timer, power.channel);
        function(power.pin, &signal)
    }

    /// Checks that the PLL can make 168 MHz for the core and 48 MHz for USB, from 1 or 2 MHz at its
    /// input.
    fn check_clock(&self, findings: &mut Vec<Finding>) {
        let crystal = self.crystal;
        let divides = |divider: &u32| {
            let input = crystal / divider;
            crystal.is_multiple_of(*divider)
                && (1_000_000..=2_000_000).contains(&input)
                && VCO.is_multiple_of(input)
        };
        let right = (4_000_000..=26_000_000).contains(&crystal) && (2..=63).any(|by| divides(&by));
        expect(findings, right, || {
            format!("crystal: {crystal} Hz do not make 168 MHz and 48 MHz")
        });
    }

    fn check_flash(&self, findings: &mut Vec<Finding>) {
        let sectors = self.settings.map(Sector::new);
        let [Some(first), Some(second)] = sectors else {
            findings.push(Finding("settings: sectors are 0 to 11".to_owned()));
            return;
        };
        let end = BEGIN + self.chip.flash();
        expect(
            findings,
            second.begin == first.end() && second.end() <= end,
            || "settings: two sectors of the chip, one behind the other".to_owned(),
        );
        let on_sector = (0..12)
            .filter_map(Sector::new)
            .any(|one| one.begin == self.start);
        expect(findings, on_sector && self.start < end, || {
            format!("start: no sector begins at {:#x}", self.start)
        });
        let bootloader = self.start > first.begin;
        expect(findings, !bootloader, || {
            "settings: where the bootloader is, or the program begins".to_owned()
        });
        let room = self.room(first, second);
        expect(findings, room >= PROGRAM, || {
            format!("flash: {room} bytes for the program, {PROGRAM} are wanted")
        });
    }

    /// Bytes of flash for the program: the larger room, in front of the settings or behind them. A
    /// program behind them has its vectors in front.
    pub(crate) fn room(&self, first: Sector, second: Sector) -> u32 {
        let before = first.begin.saturating_sub(self.start);
        let behind = (BEGIN + self.chip.flash()).saturating_sub(second.end());
        before.max(behind)
    }

    fn check_settings(&self, findings: &mut Vec<Finding>) {
        for name in self.defaults.keys() {
            expect(findings, number_of(name).is_some(), || {
                format!("defaults: `{name}` is no setting")
            });
        }
    }
}

/// The number of a setting: 4 of `$4`.
pub(crate) fn number_of(name: &str) -> Option<u16> {
    name.strip_prefix('$')?.parse().ok()
}

/// Returns true if a pin is USB's on every board.
fn is_usb(pin: Pin) -> bool {
    pin.port == 'A' && matches!(pin.number, 11 | 12)
}

/// Returns true if a pin is the debug port's (SWD) after a reset.
fn is_debug(pin: Pin) -> bool {
    pin.port == 'A' && matches!(pin.number, 13 | 14)
}
