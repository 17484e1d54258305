//! The devices on the pins of each board, as `crates/board-f407/README.md` and the makers' tables
//! give them.
use crate::pins::{CRYSTAL_HZ, DIRECTION, LIMIT, LINE, POWER, SPINDLE, STEP};
use leadscrew_f407emu::{Pin, SerialLine, SerialPort};

/// The first address of the flash, at which most programs begin.
pub(crate) const FLASH: u32 = 0x0800_0000;

/// Sector 3 of the flash.
const SECTOR_3: u32 = FLASH + 0xC000;
/// The address of sector 4.
const SECTOR_4: u32 = FLASH + 0x1_0000;

/// A switch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Switch {
    pub(crate) pin: Pin,
    /// The level at the pin while the switch is closed.
    pub(crate) closed: bool,
}

/// A board's pins.
#[derive(Debug)]
pub(crate) struct Wiring {
    /// The serial line.
    pub(crate) line: SerialLine,
    /// The step pins, one for each motor.
    pub(crate) step: &'static [Pin],
    /// Direction pins; high is negative.
    pub(crate) direction: &'static [Pin],
    /// The lines of motors without drivers, of which each has five.
    pub(crate) lines: &'static [[Pin; 5]],
    /// The limit switches, at most one for each motor.
    pub(crate) limits: &'static [Option<Switch>],
    /// Power of laser or spindle, a PWM.
    pub(crate) power: Pin,
    /// The output that switches the spindle on.
    pub(crate) spindle: Pin,
    /// Outputs that are always high.
    pub(crate) high: &'static [Pin],
    /// Frequency of the crystal in Hz.
    pub(crate) crystal_hz: u32,
    /// The flash of its chip, KB.
    pub(crate) flash_kb: u16,
    /// The address of the vector table: the start of the flash, unless a bootloader is there.
    pub(crate) start: u32,
}

impl Wiring {
    /// The address of the board's record: sector 3, or sector 4 if the vector table is in
    /// sector 3.
    pub(crate) fn record(&self) -> u32 {
        match self.start {
            SECTOR_3 => SECTOR_4,
            _ => SECTOR_3,
        }
    }
}

const fn to_ground(pin: Pin) -> Option<Switch> {
    Some(Switch { pin, closed: false })
}

const fn to_supply(pin: Pin) -> Option<Switch> {
    Some(Switch { pin, closed: true })
}

/// USART1 at two pins of a port: output and input.
const fn usart_1(port: char, [output, input]: [u8; 2]) -> SerialLine {
    SerialLine {
        port: SerialPort::Usart1,
        output: Pin::new(port, output),
        input: Pin::new(port, input),
    }
}

/// STM32F4-Discovery.
pub(crate) const DISCOVERY: Wiring = Wiring {
    line: LINE,
    step: &STEP,
    direction: &DIRECTION,
    lines: &[],
    limits: &[
        to_ground(LIMIT[0]),
        to_ground(LIMIT[1]),
        to_ground(LIMIT[2]),
    ],
    power: POWER,
    spindle: SPINDLE,
    high: &[],
    crystal_hz: CRYSTAL_HZ,
    flash_kb: 1024,
    start: FLASH,
};

/// The Discovery with a fourth motor in its spare socket.
pub(crate) const DISCOVERY_4: Wiring = Wiring {
    step: &[STEP[0], STEP[1], STEP[2], Pin::new('E', 14)],
    direction: &[DIRECTION[0], DIRECTION[1], DIRECTION[2], Pin::new('E', 15)],
    limits: &[
        to_ground(LIMIT[0]),
        to_ground(LIMIT[1]),
        to_ground(LIMIT[2]),
        to_ground(Pin::new('D', 7)),
    ],
    ..DISCOVERY
};

/// The Discovery with a motor in each of its six sockets.
pub(crate) const DISCOVERY_6: Wiring = Wiring {
    step: &[
        STEP[0],
        STEP[1],
        STEP[2],
        Pin::new('E', 14),
        Pin::new('D', 0),
        Pin::new('D', 2),
    ],
    direction: &[
        DIRECTION[0],
        DIRECTION[1],
        DIRECTION[2],
        Pin::new('E', 15),
        Pin::new('D', 1),
        Pin::new('D', 3),
    ],
    ..DISCOVERY_4
};

/// Sockets of the Discovery: the output P0, a fan, the heaters of nozzle and bed, their sensors,
/// the relay of their supply, and the input for heater faults, which is high as long as there is
/// none.
pub(crate) const OUTPUT: Pin = Pin::new('B', 12);
pub(crate) const FAN: Pin = Pin::new('B', 7);
pub(crate) const HEATERS: [Pin; 2] = [Pin::new('B', 5), Pin::new('B', 8)];
pub(crate) const SENSORS: [Pin; 2] = [Pin::new('B', 0), Pin::new('B', 1)];
pub(crate) const HEATER_SUPPLY: Pin = Pin::new('D', 9);
pub(crate) const HEATER_FAULT: Pin = Pin::new('D', 10);

/// The switches of machine 003's tool: high when closed.
pub(crate) const TOOL_LOWER: Switch = Switch {
    pin: Pin::new('D', 4),
    closed: true,
};
pub(crate) const TOOL_UPPER: Switch = Switch {
    pin: Pin::new('D', 2),
    closed: true,
};

const fn lines(port: char, numbers: [u8; 5]) -> [Pin; 5] {
    let [a, b, c, d, e] = numbers;
    [
        Pin::new(port, a),
        Pin::new(port, b),
        Pin::new(port, c),
        Pin::new(port, d),
        Pin::new(port, e),
    ]
}

/// Machine 001: no drivers.
pub(crate) const MACHINE_001: Wiring = Wiring {
    step: &[],
    direction: &[],
    lines: &[
        lines('E', [7, 8, 9, 10, 11]),
        lines('D', [0, 1, 2, 3, 6]),
        lines('B', [7, 11, 13, 14, 15]),
    ],
    ..DISCOVERY
};

/// Machine 003: only Z has a limit switch.
pub(crate) const MACHINE_003: Wiring = Wiring {
    line: usart_1('B', [6, 7]),
    step: &[Pin::new('D', 12), Pin::new('A', 0), Pin::new('C', 6)],
    direction: &[Pin::new('D', 13), Pin::new('A', 1), Pin::new('C', 7)],
    lines: &[],
    limits: &[None, None, to_supply(Pin::new('D', 2))],
    power: Pin::new('E', 9),
    spindle: Pin::new('E', 11),
    high: &[Pin::new('D', 1), Pin::new('D', 3)],
    crystal_hz: CRYSTAL_HZ,
    flash_kb: 1024,
    start: FLASH,
};

/// BIGTREETECH SKR 2: its bootloader has the first 32 KiB.
pub(crate) const SKR_2: Wiring = Wiring {
    line: usart_1('A', [9, 10]),
    step: &[Pin::new('E', 2), Pin::new('D', 5), Pin::new('A', 15)],
    direction: &[Pin::new('E', 1), Pin::new('D', 4), Pin::new('A', 8)],
    lines: &[],
    limits: &[
        to_ground(Pin::new('C', 1)),
        to_ground(Pin::new('C', 3)),
        to_ground(Pin::new('C', 0)),
    ],
    power: Pin::new('E', 5),
    spindle: Pin::new('B', 3),
    high: &[Pin::new('C', 13)],
    crystal_hz: CRYSTAL_HZ,
    flash_kb: 1024,
    start: FLASH + 0x8000,
};

/// The SKR 2 with a second motor on Y: the fourth one.
pub(crate) const DUAL_Y: Wiring = Wiring {
    step: &[
        Pin::new('E', 2),
        Pin::new('D', 5),
        Pin::new('A', 15),
        Pin::new('D', 15),
    ],
    direction: &[
        Pin::new('E', 1),
        Pin::new('D', 4),
        Pin::new('A', 8),
        Pin::new('D', 14),
    ],
    limits: &[
        to_ground(Pin::new('C', 1)),
        to_ground(Pin::new('C', 3)),
        to_ground(Pin::new('C', 0)),
        to_ground(Pin::new('C', 2)),
    ],
    ..SKR_2
};

/// BIGTREETECH Octopus V1.1, whose STM32F407ZE has half the flash.
pub(crate) const OCTOPUS: Wiring = Wiring {
    line: usart_1('A', [9, 10]),
    step: &[Pin::new('F', 13), Pin::new('G', 0), Pin::new('F', 11)],
    direction: &[Pin::new('F', 12), Pin::new('G', 1), Pin::new('G', 3)],
    lines: &[],
    limits: &[
        to_ground(Pin::new('G', 6)),
        to_ground(Pin::new('G', 9)),
        to_ground(Pin::new('G', 10)),
    ],
    power: Pin::new('B', 6),
    spindle: Pin::new('A', 2),
    high: &[],
    crystal_hz: CRYSTAL_HZ,
    flash_kb: 512,
    start: FLASH + 0x8000,
};

/// Mellow Fly-407ZG.
pub(crate) const FLY_407ZG: Wiring = Wiring {
    line: usart_1('A', [9, 10]),
    step: &[Pin::new('B', 9), Pin::new('B', 8), Pin::new('A', 8)],
    direction: &[Pin::new('E', 0), Pin::new('G', 11), Pin::new('D', 6)],
    lines: &[],
    limits: &[
        to_ground(Pin::new('C', 3)),
        to_ground(Pin::new('F', 2)),
        to_ground(Pin::new('F', 0)),
    ],
    power: Pin::new('E', 11),
    spindle: Pin::new('F', 7),
    high: &[],
    crystal_hz: CRYSTAL_HZ,
    flash_kb: 1024,
    start: FLASH + 0x8000,
};

/// FYSETC Spider: an STM32F407VE, which has half the flash, and another crystal.
pub(crate) const SPIDER: Wiring = Wiring {
    line: usart_1('A', [9, 10]),
    step: &[Pin::new('E', 11), Pin::new('D', 8), Pin::new('D', 14)],
    direction: &[Pin::new('E', 10), Pin::new('B', 12), Pin::new('D', 13)],
    lines: &[],
    limits: &[
        to_ground(Pin::new('B', 14)),
        to_ground(Pin::new('B', 13)),
        to_ground(Pin::new('A', 0)),
    ],
    power: Pin::new('C', 6),
    spindle: Pin::new('B', 15),
    high: &[],
    crystal_hz: 12_000_000,
    flash_kb: 512,
    start: FLASH + 0x8000,
};

/// MKS Robin Nano V3: its bootloader has the first 48 KiB.
pub(crate) const ROBIN_NANO_V3: Wiring = Wiring {
    line: usart_1('A', [9, 10]),
    step: &[Pin::new('E', 3), Pin::new('E', 0), Pin::new('B', 5)],
    direction: &[Pin::new('E', 2), Pin::new('B', 9), Pin::new('B', 4)],
    lines: &[],
    limits: &[
        to_ground(Pin::new('A', 15)),
        to_ground(Pin::new('D', 2)),
        to_ground(Pin::new('C', 8)),
    ],
    power: Pin::new('A', 8),
    spindle: Pin::new('B', 0),
    high: &[],
    crystal_hz: CRYSTAL_HZ,
    flash_kb: 1024,
    start: SECTOR_3,
};

/// Mellow Fly-Super8.
pub(crate) const FLY_SUPER_8: Wiring = Wiring {
    line: usart_1('A', [9, 10]),
    step: &[Pin::new('E', 2), Pin::new('E', 3), Pin::new('E', 4)],
    direction: &[Pin::new('C', 5), Pin::new('F', 13), Pin::new('G', 0)],
    lines: &[],
    limits: &[
        to_ground(Pin::new('G', 12)),
        to_ground(Pin::new('G', 11)),
        to_ground(Pin::new('G', 9)),
    ],
    power: Pin::new('C', 6),
    spindle: Pin::new('B', 0),
    high: &[],
    crystal_hz: CRYSTAL_HZ,
    flash_kb: 1024,
    start: FLASH + 0x8000,
};

/// The black board with an STM32F407VE, which has half the flash and no bootloader.
pub(crate) const BLACK_F407VE: Wiring = Wiring {
    limits: &[
        to_ground(Pin::new('C', 1)),
        to_ground(Pin::new('C', 2)),
        to_ground(Pin::new('C', 3)),
    ],
    flash_kb: 512,
    ..DISCOVERY
};
