//! One port of pins (RM0090 chapter 8).
//!
//! ```text
//!              MODER = output:    ODR, unless open drain and 1
//!  pin level = MODER = alternate: what a timer drives, if one does       else: what the world drives,
//!              MODER = input: .......................................          else the pull-up or pull-down
//!              MODER = analog:    0, whatever the voltage is (section 8.3.12)
//! ```
//!
//! Not modelled: LCKR (it reads back, but locks nothing, and a warning says so), slew rates,
//! alternate functions other than timer outputs, and the level of a floating pin: it reads as 0.

/// Levels that something drives onto the pins.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Driven {
    /// A bit for each pin that is driven.
    pub(crate) pins: u16,
    /// The levels of these pins.
    pub(crate) levels: u16,
}

impl Driven {
    /// Drives one more pin, or drives it differently.
    pub(crate) fn set(&mut self, pin: u8, level: bool) {
        self.pins |= 1 << pin;
        self.levels = self.levels & !(1 << pin) | u16::from(level) << pin;
    }
}

/// Registers of a port, and the world's effect on its pins.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gpio {
    moder: u32,
    otyper: u32,
    ospeedr: u32,
    pupdr: u32,
    odr: u16,
    lckr: u32,
    afr: [u32; 2],
    /// The pins in each mode and with a pull-up, decoded from MODER and PUPDR.
    outputs: u16,
    alternates: u16,
    analogs: u16,
    pull_ups: u16,
    /// The levels that switches and drivers outside make.
    pub(crate) world: Driven,
    /// The levels that were seen last.
    pub(crate) levels: u16,
}

impl Gpio {
    /// The state after a reset: ports A and B keep their debug pins (RM0090 table 40).
    pub(crate) fn new(port: usize) -> Self {
        let (moder, ospeedr, pupdr) = match port {
            0 => (0xA800_0000, 0, 0x6400_0000),
            1 => (0x0000_0280, 0xC0, 0x0000_0100),
            _ => (0, 0, 0),
        };
        let mut gpio = Gpio {
            moder,
            ospeedr,
            pupdr,
            ..Gpio::default()
        };
        gpio.sort_pins();
        gpio
    }

    /// Resets the registers. The world goes on driving the pins.
    pub(crate) fn reset(&mut self, port: usize) {
        *self = Gpio {
            world: self.world,
            levels: self.levels,
            ..Gpio::new(port)
        };
    }

    /// Reads the register at `offset` from the port's base.
    pub(crate) fn read(&self, offset: u32) -> u32 {
        match offset {
            0x00 => self.moder,
            0x04 => self.otyper,
            0x08 => self.ospeedr,
            0x0C => self.pupdr,
            0x10 => u32::from(self.levels),
            0x14 => u32::from(self.odr),
            0x1C => self.lckr,
            0x20 => self.afr[0],
            0x24 => self.afr[1],
            _ => 0,
        }
    }

    /// Writes the register at `offset` from the port's base.
    pub(crate) fn write(&mut self, offset: u32, value: u32) {
        match offset {
            0x00 => self.moder = value,
            0x04 => self.otyper = value,
            0x08 => self.ospeedr = value,
            0x0C => self.pupdr = value,
            0x14 => self.odr = value as u16,
            // A set bit wins over a reset bit (RM0090 section 8.4.7).
            0x18 => self.odr = self.odr & !((value >> 16) as u16) | value as u16,
            0x1C => self.lckr = value,
            0x20 => self.afr[0] = value,
            0x24 => self.afr[1] = value,
            _ => {}
        }
        if matches!(offset, 0x00 | 0x0C) {
            self.sort_pins();
        }
    }

    /// The pins that are in alternate mode.
    pub(crate) fn alternate_pins(&self) -> u16 {
        self.alternates
    }

    /// The number of a pin's alternate function.
    pub(crate) fn function(&self, pin: u8) -> u8 {
        let register = self.afr[usize::from(pin >> 3 & 1)];
        (register >> (4 * (pin & 7)) & 15) as u8
    }

    /// The alternate function that a pin has; none in another mode.
    pub(crate) fn alternate(&self, pin: u8) -> Option<u8> {
        (self.alternates >> pin & 1 != 0).then(|| self.function(pin))
    }

    /// Returns true if a pin in alternate mode can be high: it is not open drain, or has a pull-up.
    pub(crate) fn rises(&self, pin: u8) -> bool {
        (!self.otyper as u16 | self.pull_ups) >> pin & 1 != 0
    }

    /// Returns true if a pin is in analog mode.
    pub(crate) fn is_analog(&self, pin: u8) -> bool {
        self.analogs >> pin & 1 != 0
    }

    /// The levels of all pins, if timers drive the pins of `timers`.
    pub(crate) fn resolve(&self, timers: Driven) -> u16 {
        let outputs = self.driven_levels(timers);
        let driving = self.driving(timers);
        let left = self.world.levels & self.world.pins | self.pull_ups & !self.world.pins;
        (outputs & driving | left & !driving) & !self.analogs
    }

    /// The pins that the port drives: outputs and pins of timers, except for open-drain pins that
    /// are released.
    pub(crate) fn driving(&self, timers: Driven) -> u16 {
        let released = self.driven_levels(timers) & self.otyper as u16;
        (self.outputs | self.alternates & timers.pins) & !released
    }

    fn driven_levels(&self, timers: Driven) -> u16 {
        self.outputs & self.odr | self.alternates & timers.pins & timers.levels
    }

    /// Decodes the pins in each mode.
    fn sort_pins(&mut self) {
        self.outputs = pins_with(self.moder, 1);
        self.alternates = pins_with(self.moder, 2);
        self.analogs = pins_with(self.moder, 3);
        self.pull_ups = pins_with(self.pupdr, 1);
    }
}

/// The pins whose two bits in a register have this value.
fn pins_with(register: u32, value: u32) -> u16 {
    let has = |pin: &u16| register >> (2 * pin) & 3 == value;
    (0..16).filter(has).fold(0, |pins, pin| pins | 1 << pin)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outputs() -> Gpio {
        let mut port = Gpio::new(4);
        port.write(0x00, 0x5555_5555);
        port
    }

    #[test]
    fn one_store_sets_and_resets_and_set_wins() {
        let mut port = outputs();
        port.write(0x14, 0b0110);
        port.write(0x18, 0b0110 << 16 | 0b0011);
        assert_eq!(port.resolve(Driven::default()), 0b0011);
    }

    #[test]
    fn an_input_follows_the_world_then_its_pull_up() {
        let mut port = Gpio::new(2);
        assert_eq!(port.resolve(Driven::default()), 0);
        port.write(0x0C, 1);
        assert_eq!(port.resolve(Driven::default()), 1);
        port.world.set(0, false);
        assert_eq!(port.resolve(Driven::default()), 0);
    }

    #[test]
    fn an_analog_pin_reads_as_zero() {
        let mut port = Gpio::new(2);
        port.write(0x0C, 1);
        port.world.set(1, true);
        assert_eq!(port.resolve(Driven::default()), 0b11);
        port.write(0x00, 0b1111);
        assert_eq!(port.resolve(Driven::default()), 0);
    }

    #[test]
    fn an_open_drain_output_only_pulls_down() {
        let mut port = outputs();
        port.write(0x04, 1);
        port.write(0x14, 1);
        assert_eq!(port.resolve(Driven::default()), 0);
        assert_eq!(port.driving(Driven::default()), !1);
        port.world.set(0, true);
        assert_eq!(port.resolve(Driven::default()), 1);
        port.write(0x14, 0);
        assert_eq!(port.resolve(Driven::default()), 0);
    }

    #[test]
    fn a_timer_drives_only_pins_in_alternate_mode() {
        let mut port = Gpio::new(3);
        let mut timer = Driven::default();
        timer.set(12, true);
        assert_eq!(port.resolve(timer), 0);
        port.write(0x00, 2 << 24);
        port.write(0x24, 2 << 16);
        assert_eq!((port.alternate_pins(), port.function(12)), (1 << 12, 2));
        assert_eq!(port.resolve(timer), 1 << 12);
        assert_eq!(
            (port.driving(timer), port.driving(Driven::default())),
            (1 << 12, 0)
        );
    }

    #[test]
    fn the_debug_pins_are_in_alternate_mode_after_a_reset() {
        let port = Gpio::new(0);
        assert_eq!(port.alternate_pins(), 0b111 << 13);
        assert_eq!(port.function(13), 0);
        assert_eq!(
            port.resolve(Driven::default()),
            1 << 13 | 1 << 15,
            "their pull-ups"
        );
    }
}
