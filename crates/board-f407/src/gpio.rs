//! Pins as data: a profile names them, this file drives them.
//!
//! A HAL has a type for each pin, so a table cannot hold its pins. A HAL also builds a port's word
//! bit by bit, and the step interrupt needs the word ready made. All ports have the same registers,
//! 0x400 apart (RM0090 sections 2.3 and 8.4).
use crate::{
    chip::Bank,
    registers::{port, Word},
};

#[cfg(record)]
pub(crate) use crate::registers::AnyPort;

impl Bank {
    /// The levels at its pins, one bit a pin. Any context.
    #[inline(always)]
    pub(crate) fn levels(self) -> u32 {
        port(self).idr().read().bits()
    }

    /// Sets and resets pins in one store (RM0090 section 8.4.7): bit *n* raises pin *n*, bit *n* +
    /// 16 lowers it. Any context: a store cannot interfere with another one.
    #[inline(always)]
    pub(crate) fn write(self, word: u32) {
        port(self).bsrr().put(word);
    }
}

#[cfg(record)]
impl AnyPort {
    /// As [`Bank::levels`].
    #[inline(always)]
    pub(crate) fn levels(&self) -> u32 {
        self.registers().idr().read().bits()
    }

    /// As [`Bank::write`].
    #[inline(always)]
    pub(crate) fn write(&self, word: u32) {
        self.registers().bsrr().put(word);
    }
}

/// The pull of a pin that nothing else drives.
#[derive(Clone, Copy, PartialEq, Eq)]
#[allow(dead_code)] // no board uses all of them
pub(crate) enum Pull {
    None = 0,
    Up = 1,
    Down = 2,
}

/// The mode of a pin (MODER, RM0090 section 8.4.1).
#[derive(Clone, Copy)]
enum Mode {
    Input = 0,
    Output = 1,
    Alternate = 2,
    #[cfg(heaters)]
    Analog = 3,
}

/// The speed of an output's edges (OSPEEDR; data sheet, table 50). After a reset most pins take
/// 100 ns for an edge.
#[derive(Clone, Copy)]
pub(crate) enum Speed {
    /// 10 ns: steps and 2 Mbaud.
    Medium = 1,
    /// 4 ns: USB.
    VeryHigh = 3,
}

/// A pin.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Pin {
    pub(crate) bank: Bank,
    /// The number in the bank, 0 to 15.
    pub(crate) number: u8,
}

impl Pin {
    /// Names a pin.
    pub(crate) const fn new(bank: Bank, number: u8) -> Self {
        assert!(number < 16, "a port has 16 pins");
        Self { bank, number }
    }

    /// The word for [`Bank::write`] that raises the pin (`true`) or lowers it.
    #[inline]
    pub(crate) const fn word(self, high: bool) -> u32 {
        if high {
            1 << self.number
        } else {
            1 << (self.number + 16)
        }
    }

    /// Raises the pin (`true`) or lowers it. Any context.
    #[inline]
    pub(crate) fn set(self, high: bool) {
        self.bank.write(self.word(high));
    }

    /// The level at the pin. Any context.
    #[inline]
    pub(crate) fn is_high(self) -> bool {
        self.bank.levels() >> self.number & 1 == 1
    }

    /// Makes the pin an output of this level, without any other level in between. Before the
    /// interrupts are on, or if nothing else runs any more.
    pub(crate) fn make_output(self, high: bool) {
        self.set(high);
        self.set_mode(Mode::Output);
    }

    /// Makes the pin an input. Before the interrupts are on.
    pub(crate) fn make_input(self, pull: Pull) {
        self.set_pull(pull);
        self.set_mode(Mode::Input);
    }

    /// Makes the pin an input of the converter. Before the interrupts are on.
    #[cfg(heaters)]
    pub(crate) fn make_analog(self) {
        self.set_pull(Pull::None);
        self.set_mode(Mode::Analog);
    }

    /// Hands the pin to a peripheral: `function` is its number in the data sheet's table 9. Before
    /// the interrupts are on.
    pub(crate) fn make_alternate(self, function: u8, pull: Pull) {
        self.set_pull(pull);
        let (registers, number) = (port(self.bank), self.number);
        let function = u32::from(function);
        if number < 8 {
            registers
                .afrl()
                .change(|bits| field(bits, number, 4, function));
        } else {
            registers
                .afrh()
                .change(|bits| field(bits, number - 8, 4, function));
        }
        self.set_speed(Speed::Medium);
        self.set_mode(Mode::Alternate);
    }

    /// Sets how fast the pin's edges are. Before the interrupts are on.
    pub(crate) fn set_speed(self, speed: Speed) {
        port(self.bank)
            .ospeedr()
            .change(|bits| field(bits, self.number, 2, speed as u32));
    }

    fn set_pull(self, pull: Pull) {
        port(self.bank)
            .pupdr()
            .change(|bits| field(bits, self.number, 2, pull as u32));
    }

    fn set_mode(self, mode: Mode) {
        port(self.bank)
            .moder()
            .change(|bits| field(bits, self.number, 2, mode as u32));
    }
}

/// `register` with the field of pin `number`, `width` bits wide, set to `value`.
const fn field(register: u32, number: u8, width: u8, value: u32) -> u32 {
    let shift = number * width;
    let mask = (1 << width) - 1;
    register & !(mask << shift) | value << shift
}

/// An output, and the level that switches its load on.
#[derive(Clone, Copy)]
pub(crate) struct Output {
    pub(crate) pin: Pin,
    pub(crate) active_high: bool,
}

impl Output {
    /// Switches the load on or off. Any context.
    pub(crate) fn switch(self, on: bool) {
        self.pin.set(on == self.active_high);
    }

    /// Returns true if the load is switched on. Any context.
    #[cfg(outputs)]
    pub(crate) fn is_on(self) -> bool {
        self.pin.is_high() == self.active_high
    }
}

/// An input and which level counts as open.
#[derive(Clone, Copy)]
pub(crate) struct Input {
    pub(crate) pin: Pin,
    pub(crate) pull: Pull,
    /// True if the machine is told the other level: for a button that makes its pin high when
    /// pressed.
    pub(crate) inverted: bool,
}

impl Input {
    /// Its line of EXTI, as a bit.
    pub(crate) const fn line(self) -> u16 {
        1 << self.pin.number
    }

    /// The level that the machine is told: `true` is open.
    #[inline]
    pub(crate) fn level(self) -> bool {
        self.pin.is_high() != self.inverted
    }
}
