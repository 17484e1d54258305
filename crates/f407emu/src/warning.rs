//! Actions of the program that would not work on the chip as intended, or that are not modelled.
use core::fmt;

/// One kind of mistake; each is recorded once.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Warning {
    /// A clock was selected that is not running; the switch does not happen.
    ClockNotReady,
    /// The PLL's input, its oscillator or HCLK is out of range.
    PllOutOfRange {
        /// The frequency of HCLK, Hz.
        hclk: u32,
    },
    /// The settings of a PLL were written while it was on; they stay as they were (RM0090 section
    /// 7.3.2).
    PllRunning,
    /// The core's voltage is too low for the clock (RM0090 section 3.5.1).
    VoltageTooLow {
        /// The frequency of HCLK, Hz.
        hclk: u32,
    },
    /// USB is switched on with a clock other than 48 MHz (RM0090 section 7.3.2, PLLQ).
    UsbClock {
        /// The clock in Hz.
        hz: u32,
    },
    /// A FIFO of USB overlaps another one or the end of the memory, has overflowed, or was read
    /// empty or only in part (RM0090 sections 34.13.1 and 34.17.6).
    UsbFifo,
    /// A peripheral bus is faster than the chip allows (42 MHz APB1, 84 MHz APB2).
    BusTooFast {
        /// The frequency of HCLK, Hz.
        hclk: u32,
    },
    /// The flash has too few wait states for the clock (RM0090 table 11).
    TooFewWaitStates {
        /// The frequency of HCLK, Hz.
        hclk: u32,
    },
    /// FLASH_CR was written while it was locked.
    FlashLocked,
    /// A cache of the flash was to be reset while it was on: it stays (RM0090 section 3.9.1).
    CacheReset,
    /// A cache of the flash gave content that had been erased since (RM0090 section 3.6.4).
    StaleCache,
    /// The flash was written without FLASH_CR.PG.
    FlashWriteNotEnabled,
    /// The flash was written with a width other than FLASH_CR.PSIZE.
    FlashWriteWidth,
    /// The program wants to erase a sector that does not exist.
    NoSuchSector,
    /// A peripheral that is not modelled: it only stores the written words.
    NotModelled {
        /// Address of the register.
        address: u32,
    },
    /// ADC1 has converted a channel whose pin was not in analog mode (RM0090 section 8.3.12).
    PinNotAnalog,
    /// A timer is in a mode that is not modelled: counting down or both ways, as a slave, with
    /// breaks, or in another mode that its module names.
    TimerMode {
        /// Base address of the timer.
        base: u32,
    },
    /// A DMA stream was to access a place that its controller cannot reach (RM0090 section 10.3:
    /// DMA1 has no GPIO, and no DMA controller has CCM).
    DmaUnreachable {
        /// The address.
        address: u32,
    },
    /// A DMA stream is set up in a way that the manual forbids or that is not modelled, or its
    /// settings were written while it was on.
    DmaMode,
    /// The program wanted to start a DMA stream while a flag of the stream was set: the stream
    /// stays off (RM0090 section 10.5.5).
    DmaFlags,
    /// A USART is in a mode that is not modelled, or at a rate that is out of range.
    UsartMode {
        /// Base address of the USART.
        base: u32,
    },
    /// A USART's rate, word length or transmitter was changed while a byte went out, which corrupts
    /// that byte (RM0090 section 30.3.2).
    UsartDisturbed {
        /// Base address of the USART.
        base: u32,
    },
    /// A byte was written to a USART before the USART had taken the previous byte.
    UsartOverwrite {
        /// Base address of the USART.
        base: u32,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::ClockNotReady => f.write_str("a clock was selected that is not running"),
            Warning::PllOutOfRange { hclk } => write!(f, "PLL out of range, HCLK {hclk} Hz"),
            Warning::PllRunning => f.write_str("settings of a PLL written while it is on"),
            Warning::VoltageTooLow { hclk } => write!(f, "core voltage too low for {hclk} Hz"),
            Warning::UsbClock { hz } => write!(f, "USB switched on with a clock of {hz} Hz"),
            Warning::UsbFifo => f.write_str("a FIFO of USB is misplaced or misused"),
            Warning::BusTooFast { hclk } => write!(f, "peripheral bus too fast, HCLK {hclk} Hz"),
            Warning::TooFewWaitStates { hclk } => {
                write!(f, "too few wait states of the flash for {hclk} Hz")
            }
            Warning::FlashLocked => f.write_str("FLASH_CR written while it is locked"),
            Warning::CacheReset => f.write_str("a cache of the flash reset while it is on"),
            Warning::StaleCache => f.write_str("a cache of the flash gave erased content"),
            Warning::FlashWriteNotEnabled => f.write_str("flash written without PG"),
            Warning::FlashWriteWidth => f.write_str("flash written with another width than PSIZE"),
            Warning::NoSuchSector => f.write_str("erase of a sector that does not exist"),
            Warning::NotModelled { address } => write!(f, "nothing is modelled at {address:#010x}"),
            Warning::PinNotAnalog => f.write_str("ADC1 converts a pin that is not analog"),
            Warning::TimerMode { base } => write!(f, "mode of timer {base:#010x} not modelled"),
            Warning::DmaUnreachable { address } => write!(f, "DMA cannot reach {address:#010x}"),
            Warning::DmaMode => f.write_str("settings of a DMA stream forbidden or not modelled"),
            Warning::DmaFlags => f.write_str("DMA stream started before its flags were cleared"),
            Warning::UsartMode { base } => write!(f, "mode of USART {base:#010x} not modelled"),
            Warning::UsartDisturbed { base } => {
                write!(f, "USART {base:#010x} changed while a byte goes out")
            }
            Warning::UsartOverwrite { base } => {
                write!(f, "data register of USART {base:#010x} overwritten")
            }
        }
    }
}

/// The warnings so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Warnings(Vec<Warning>);

impl Warnings {
    /// Records a warning, unless it is there already.
    pub(crate) fn add(&mut self, warning: Warning) {
        if !self.0.contains(&warning) {
            self.0.push(warning);
        }
    }

    /// The warnings in the order of their first occurrence.
    pub(crate) fn all(&self) -> &[Warning] {
        &self.0
    }
}
