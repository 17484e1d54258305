//! The chips, and the functions of their pins.
use crate::Pin;
use serde::Deserialize;

/// A chip that the firmware runs on.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub enum Chip {
    /// 100 pins, 512 KiB of flash.
    #[serde(rename = "STM32F407VE")]
    Ve,
    /// 100 pins, 1 MiB of flash.
    #[serde(rename = "STM32F407VG")]
    Vg,
    /// 144 pins, 512 KiB of flash.
    #[serde(rename = "STM32F407ZE")]
    Ze,
    /// 144 pins, 1 MiB of flash.
    #[serde(rename = "STM32F407ZG")]
    Zg,
}

/// Functions of the pins of the STM32F407ZG; `crates/f407emu/tests/chip.rs` checks them.
const FUNCTIONS: &str = include_str!("../data/stm32f407.txt");

impl Chip {
    /// Returns the size of the flash, bytes.
    #[must_use]
    pub fn flash(self) -> u32 {
        match self {
            Chip::Ve | Chip::Ze => 512 << 10,
            Chip::Vg | Chip::Zg => 1024 << 10,
        }
    }

    /// Pins of its package.
    pub(crate) fn pins(self) -> u32 {
        match self {
            Chip::Ve | Chip::Vg => 100,
            Chip::Ze | Chip::Zg => 144,
        }
    }

    /// Returns true if the chip's package has a pin. A package with 100 pins has only the ports A
    /// to E.
    #[must_use]
    pub fn has(self, pin: Pin) -> bool {
        match self {
            Chip::Ve | Chip::Vg => pin.port <= 'E',
            Chip::Ze | Chip::Zg => pin.port <= 'G',
        }
    }
}

/// The words of a pin's line in [`FUNCTIONS`].
fn words(pin: Pin) -> impl Iterator<Item = &'static str> {
    let name = pin.to_string();
    let mut lines = FUNCTIONS.lines();
    let ours = lines.find_map(|line| line.strip_prefix(&name)?.strip_prefix(' '));
    ours.into_iter().flat_map(|line| line.split(' '))
}

/// The number of the alternate function that connects a pin to a peripheral's signal, such as
/// `USART1_TX`.
pub(crate) fn function(pin: Pin, signal: &str) -> Option<u8> {
    words(pin).find_map(|word| {
        let (found, number) = word.split_once('=')?;
        (found == signal).then(|| number.parse().ok())?
    })
}

/// The channel of TIM2, 2 to 4, to whose input the pin can be connected. Channel 1 has another
/// task.
pub(crate) fn capture_channel(pin: Pin) -> Option<u8> {
    (2..=4).find(|channel| function(pin, &format!("TIM2_CH{channel}")) == Some(1))
}

/// The pin's channel of ADC1, if it has one.
pub(crate) fn channel(pin: Pin) -> Option<u8> {
    words(pin).find_map(|word| word.strip_prefix("ADC1_IN")?.parse().ok())
}

/// Returns true if a DMA stream and channel, such as `DMA2.5.4`, can receive a request.
pub(crate) fn hears(request: &str, stream: &str) -> bool {
    let mut lines = FUNCTIONS.lines();
    let ours = lines.find_map(|line| line.strip_prefix(request)?.strip_prefix(": "));
    ours.is_some_and(|streams| streams.split(' ').any(|one| one == stream))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pin_has_the_functions_of_its_own_line() {
        let pin = |name: &str| name.parse::<Pin>().unwrap();
        assert_eq!(function(pin("PD12"), "TIM4_CH1"), Some(2));
        assert_eq!(function(pin("PD1"), "TIM4_CH1"), None);
        assert_eq!(function(pin("PA9"), "USART1_TX"), Some(7));
        assert_eq!((channel(pin("PB0")), channel(pin("PB2"))), (Some(8), None));
        assert!(hears("USART1_RX", "DMA2.5.4") && !hears("USART1_RX", "DMA1.5.4"));
        let captures = ["PA1", "PA2", "PB11", "PA0"].map(|name| capture_channel(pin(name)));
        assert_eq!(captures, [Some(2), Some(3), Some(4), None]);
    }

    #[test]
    fn the_small_package_has_no_port_f() {
        let pin: Pin = "PF0".parse().unwrap();
        assert!(!Chip::Vg.has(pin) && Chip::Zg.has(pin));
        assert_eq!(Chip::Ve.flash(), 0x8_0000);
    }
}
