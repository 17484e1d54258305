//! The output for the firmware's build: Rust modules of the board, and the memory map for the
//! linker.
use crate::{
    check::number_of,
    chip::channel,
    flash::{Sector, BEGIN},
    record::mask,
    Board, Closes, Drive, Input, Kinematics, Level, Output, Pin,
};
use std::fmt::Write;

/// The axes that each have one motor or more.
const AXES: usize = crate::record::AXES as usize;

impl Board {
    /// Returns the module of the board's pins, which `crates/board-f407` compiles. [`Board::check`]
    /// must have found no mistake.
    #[must_use]
    pub fn pins_module(&self) -> String {
        let [first, second] = self.settings;
        let mut text = format!(
            "pub(crate) const SETTINGS_SECTORS: (Sector, Sector) = (Sector::new({first}), Sector::new({second}));\n"
        );
        let motors = self.motor_sockets().map(|motor| motor.drive.literal());
        let limits = self.motor_sockets().map(|motor| input(motor.limit));
        let synchronised = self.sockets.outputs.iter().map(|one| output_literal(*one));
        text += &self.sensors();
        text += &self.capture_inputs();
        text += &self.safe_pins();
        let heaters = self.sockets.heaters.iter();
        let heaters = heaters.map(|one| output_literal(one.output()));
        let outputs = &self.outputs;
        let fields = [
            ("name", format!("{:?}", self.name)),
            ("crystal_hz", self.crystal.to_string()),
            ("serial", self.serial_pins()),
            ("motors", list(motors)),
            ("enables", slice(&self.enable)),
            ("power", self.power_pin()),
            ("spindle", output(outputs.spindle)),
            ("spindle_reverse", output(outputs.spindle_reverse)),
            ("flood", output(outputs.flood)),
            ("mist", output(outputs.mist)),
            ("limits", list(limits)),
            ("synchronised", format!("&{}", list(synchronised))),
            ("heaters", format!("&{}", list(heaters))),
            ("heater_supply", output(self.sockets.heater_supply)),
            ("fan", output(self.sockets.fan)),
        ];
        text += "pub(crate) const PROFILE: Profile = Profile {\n";
        let buttons = self.buttons().map(|(name, button)| (name, input(button)));
        for (name, value) in fields.into_iter().chain(buttons) {
            let _ = writeln!(text, "    {name}: {value},");
        }
        text + "};\n"
    }

    /// The pins that could do harm, and whether high is their harmless level.
    fn safe_pins(&self) -> String {
        let levels = self.safe_levels();
        let pins = levels
            .iter()
            .map(|(pin, level)| format!("({}, {})", literal(*pin), *level == Level::High));
        let (count, pins) = (levels.len(), list(pins));
        format!("pub(crate) const SAFE: [(Pin, bool); {count}] = {pins};\n")
    }

    /// The sensors of the heaters and the input of their fault, if there are heaters.
    fn sensors(&self) -> String {
        let heaters = &self.sockets.heaters;
        if heaters.is_empty() {
            return String::new();
        }
        let sensors = heaters.iter().map(|heater| {
            let of = channel(heater.sensor).unwrap_or(0);
            format!("({}, {of})", literal(heater.sensor))
        });
        format!(
            "pub(crate) const SENSORS: [(Pin, u8); {}] = {};
pub(crate) const HEATER_FAULT: Option<crate::gpio::Input> = {};\n",
            heaters.len(),
            list(sensors),
            input(self.sockets.heater_fault)
        )
    }

    /// The inputs that capture edges, if wires lead to any.
    fn capture_inputs(&self) -> String {
        let captures = self.captures().into_iter().map(|(wire, channel)| {
            let pin = literal(wire.to);
            format!("crate::capture::Input {{ pin: {pin}, channel: {channel} }}")
        });
        match captures.len() {
            0 => String::new(),
            count => format!(
                "pub(crate) const CAPTURES: [crate::capture::Input; {count}] = {};\n",
                list(captures)
            ),
        }
    }

    /// Returns the module for a machine without a file of its own: how many motors move which axes,
    /// and the settings of a new machine.
    #[must_use]
    pub fn machine_module(&self) -> String {
        let motors = self.motor.len();
        let (kind, value) = self.motion();
        let defaults = self.defaults.iter().filter_map(|(name, value)| {
            let number = number_of(name)?;
            Some(format!(
                "Entry {{ number: {number}, value: leadscrew_gcode::Number::from_int({value}) }}"
            ))
        });
        let defaults = list(defaults);
        let (own, own_value) = match self.captures().is_empty() {
            true => ("()", ""),
            false => ("crate::capture::Capture", "crate::capture::Capture::new()"),
        };
        let homing = self.homing.as_ref().map_or(String::new(), |groups| {
            let masks = groups.iter().map(|axes| mask(axes).to_string());
            let padded = masks.chain(std::iter::repeat("0".to_owned())).take(4);
            format!("    config.homing_cycles = {};\n", list(padded))
        });
        format!(
            "pub(crate) const AXES: usize = {AXES};
pub(crate) const MOTORS: usize = {motors};
pub(crate) type Kinematics = leadscrew_planner::{kind};
pub(crate) const fn kinematics() -> Kinematics {{
    leadscrew_planner::{value}
}}
const DEFAULTS: &[Entry] = &{defaults};
pub(crate) const fn config() -> MachineConfig<AXES> {{
    let mut config = MachineConfig::new();
    config.defaults = DEFAULTS;
{homing}    config
}}
pub(crate) type Own = {own};
pub(crate) fn own() -> Own {{
    {own_value}
}}
"
        )
    }

    /// The type and the value of the kinematics, as source text.
    fn motion(&self) -> (String, String) {
        let seconds: Vec<String> = self
            .motor
            .iter()
            .skip(AXES)
            .map(|motor| (motor.axis as usize).to_string())
            .collect();
        match (self.kinematics, seconds.len()) {
            (Kinematics::CoreXy, _) => ("CoreXy".to_owned(), "CoreXy".to_owned()),
            (Kinematics::Cartesian, 0) => ("Cartesian".to_owned(), "Cartesian".to_owned()),
            (Kinematics::Cartesian, count) => (
                format!("Ganged<{count}>"),
                format!("Ganged {{ axis_of: {} }}", list(seconds)),
            ),
        }
    }

    fn serial_pins(&self) -> String {
        let serial = &self.serial;
        let (transmit, receive) = (literal(serial.transmit), literal(serial.receive));
        let usart = serial.usart;
        format!(
            "SerialPins {{ usart: Usart::Usart{usart}, transmit: {transmit}, receive: {receive} }}"
        )
    }

    fn power_pin(&self) -> String {
        let power = &self.power;
        let function = self.power_function().unwrap_or(0);
        format!(
            "PowerPin {{ output: {}, function: {function}, timer: Timer::Tim{}, channel: {}, frequency: {} }}",
            output_literal(power.output()),
            power.timer,
            power.channel,
            power.frequency
        )
    }

    /// Returns the linker's memory map: where flash, code in SRAM, variables and stack are.
    #[must_use]
    pub fn memory(&self) -> String {
        let sectors = self.settings.map(Sector::new);
        let [Some(first), Some(second)] = sectors else {
            return String::new();
        };
        let before = first.begin.saturating_sub(self.start);
        let (end, text) = if before == self.room(first, second) {
            (first.begin, String::new())
        } else {
            let offset = second.end() - self.start;
            let words =
                "/* Behind the sectors of the settings; the vector table is in front of them. */";
            (
                BEGIN + self.chip.flash(),
                format!("{words}\n_stext = ORIGIN(FLASH) + {offset:#X};\n"),
            )
        };
        let memory = match self.motor_sockets().count() > FEW_MOTORS {
            true => MANY_MOTORS,
            false => USUAL,
        };
        self.script(end, memory, &text)
    }

    /// Returns the linker's memory map of an image that reads its board from a record. The record's
    /// sector is in front of the code, which ends where this board has its settings, or where its
    /// flash ends. The image serves all boards with the same `start` whose settings are behind its
    /// last byte. An image of four motors has less room for the step interrupts' code, since its
    /// moves take more. `None` if the board has no room for such an image.
    #[must_use]
    pub fn record_memory(&self, has_four_motors: bool) -> Option<String> {
        let (sector, end) = (self.record_sector()?, self.record_end()?);
        let text = format!(
            "/* The board's record; the code is behind it. */
__record = {:#010X};
_stext = {:#010X};
{}",
            sector.begin,
            sector.end(),
            // An image of four motors is for chips of 1 MiB, and has more constants.
            if has_four_motors {
                String::new()
            } else {
                self.front(sector)
            }
        );
        let memory = match has_four_motors {
            true => RECORD_OF_FOUR,
            false => RECORD,
        };
        Some(self.script(end, memory, &text))
    }

    /// The part of the script that fills the rest of the vector table's sector, in front of the
    /// record in `sector`.
    fn front(&self, sector: Sector) -> String {
        let front = Sector {
            begin: self.start + VECTORS,
            size: (sector.begin - self.start).min(SMALLEST) - VECTORS,
        };
        format!(
            "/* Constants, and code that keeps settings: the vector table's sector has room for them, which a chip of 512 KiB needs. */
MEMORY
{{
  FRONT    : ORIGIN = {:#010X}, LENGTH = {}
}}
SECTIONS
{{
  .front : ALIGN(4)
  {{
    *(.rodata .rodata.*);
    *(.text*leadscrew_settings5store*14settings_flash*);
    . = ALIGN(4);
  }} > FRONT
}} INSERT AFTER .vector_table;
",
            front.begin, front.size
        )
    }

    /// The script for a program from the board's `start` on, which ends in front of `end`. `cargo
    /// xtask thumb` reads from its symbols how much of the flash is free.
    fn script(&self, end: u32, memory: Memory, text: &str) -> String {
        let Memory { stack, .. } = memory;
        let (start, length) = (self.start, (end - self.start) >> 10);
        let (ram, chip, pins) = (ram(memory), self.chip.flash(), self.chip.pins());
        format!(
            "MEMORY
{{
  FLASH    : ORIGIN = {start:#010X}, LENGTH = {length}K
{ram}}}
__flash_end = {end:#010X};
__chip_flash = {chip:#X};
__chip_pins = {pins};
{text}{STACK}__stack_top = ORIGIN(CCM) + {stack}K;
"
        )
    }
}

/// Bytes that are kept for the vector table, of 98 words.
const VECTORS: u32 = 512;
/// Bytes of the smallest sectors, in which a vector table may be.
const SMALLEST: u32 = 16 << 10;

/// The division of the memory by an image.
#[derive(Clone, Copy)]
struct Memory {
    /// Bytes for the step interrupts' code, the first ones of SRAM1.
    code: u32,
    /// KiB for the stack, the first ones of the core coupled memory.
    stack: u32,
}

/// With pins that are compiled in, and four motors or fewer.
const USUAL: Memory = Memory {
    code: 4096,
    stack: 16,
};
const FEW_MOTORS: usize = 4;
/// With more motors the code and the machine are larger.
const MANY_MOTORS: Memory = Memory {
    code: 5120,
    stack: 15,
};
/// An image that reads the pins from a record has longer code.
const RECORD: Memory = Memory {
    code: 5120,
    ..USUAL
};
const RECORD_OF_FOUR: Memory = Memory {
    code: 4608,
    stack: 15,
};

/// SRAM and core coupled memory, as every F407 has them (data sheet DocID022152 section 2.2).
fn ram(memory: Memory) -> String {
    let Memory { code, stack } = memory;
    format!(
        "  /* The first bytes of SRAM1, as the core fetches them once SRAM1 is at 0. */
  CODE     : ORIGIN = 0x00000000, LENGTH = {code}
  RAM      : ORIGIN = {:#010X}, LENGTH = {}
  CCM      : ORIGIN = 0x10000000, LENGTH = {stack}K
  CCM_DATA : ORIGIN = {:#010X}, LENGTH = {}K
",
        0x2000_0000 + code,
        (128 << 10) - code,
        0x1000_0000 + (stack << 10),
        64 - stack,
    )
}

const STACK: &str =
    "/* The stack grows down to the begin of the core coupled memory: below it there is nothing, so that an overflow is a fault
   and not a variable that changes. `__stack_top` is its begin. */
_stack_end = ORIGIN(CCM);
/* What the vector table says: bootloaders after ST's template start a program only where this is in SRAM, below 0x20020000.
   `src/safe_state/` goes over to the stack above before anything is pushed. */
_stack_start = ORIGIN(RAM) + LENGTH(RAM) - 8;
";

fn list(items: impl IntoIterator<Item = String>) -> String {
    let items: Vec<String> = items.into_iter().collect();
    format!("[{}]", items.join(", "))
}

fn slice(pins: &[Pin]) -> String {
    format!("&{}", list(pins.iter().map(|pin| literal(*pin))))
}

fn literal(pin: Pin) -> String {
    format!("Pin::new(Bank::{}, {})", pin.port, pin.number)
}

fn output(output: Option<Output>) -> String {
    optional(output.map(output_literal))
}

fn output_literal(output: Output) -> String {
    let high = output.on == Level::High;
    let pin = literal(output.pin);
    format!("crate::gpio::Output {{ pin: {pin}, active_high: {high} }}")
}

fn input(input: Option<Input>) -> String {
    optional(input.map(Input::literal))
}

fn optional(value: Option<String>) -> String {
    value.map_or("None".to_owned(), |value| format!("Some({value})"))
}

impl Drive {
    /// The pins as the source text of a value.
    fn literal(self) -> String {
        match self {
            Self::Driver { step, direction } => {
                let (step, direction) = (literal(step), literal(direction));
                format!("MotorPins::new({step}, {direction})")
            }
            Self::Windings(lines) => format!("MotorPins::new({})", list(lines.map(literal))),
        }
    }
}

impl Input {
    /// Returns the input as the source text of a value.
    #[must_use]
    pub fn literal(self) -> String {
        // The machine sees a switch to the supply as an inverted input.
        let (pull, inverted) = match self.closes {
            Closes::ToGround => ("Up", false),
            Closes::ToSupply => ("Down", true),
        };
        let (pin, gpio) = (literal(self.pin), "crate::gpio");
        format!("{gpio}::Input {{ pin: {pin}, pull: {gpio}::Pull::{pull}, inverted: {inverted} }}")
    }
}
