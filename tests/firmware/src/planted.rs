//! Faults planted in the firmware, and the checks that must find them: `cargo fw-test --planted`.
//!
//! A fault changes or drops a word on its way to a register, with the effect of a wrong compare, a
//! flag that is not cleared or a bit that is not set. In addition, the check `stores` leaves out
//! each store of the step interrupt.
use crate::{
    bench::Failure,
    checks::{Check, Figures},
    firmware::{Fault, Firmware},
};
use leadscrew_f407emu::Tamper;

/// A fault and the checks that must find it.
pub(crate) struct Planted {
    pub(crate) name: &'static str,
    fault: Fault,
    /// The names of the checks; each of them must fail.
    found_by: &'static [&'static str],
}

/// A fault that applies `tamper` to the words written to `register`.
const fn planted(
    name: &'static str,
    register: u32,
    tamper: Tamper,
    found_by: &'static [&'static str],
) -> Planted {
    Planted {
        name,
        fault: Fault { register, tamper },
        found_by,
    }
}

const OTG_FS: u32 = 0x5000_0000;
const TIM2: u32 = 0x4000_0000;
const TIM11: u32 = 0x4001_4800;
const TIM5: u32 = 0x4000_0C00;
const TIM7: u32 = 0x4000_1400;
/// The control registers of the DMA1 streams of USART2: stream 5 receives, stream 6 sends.
const DMA1_S5CR: u32 = 0x4002_6088;
const DMA1_S6CR: u32 = 0x4002_60A0;
const IWDG: u32 = 0x4000_3000;
const USART2: u32 = 0x4000_4400;
const PWR: u32 = 0x4000_7000;
const EXTI: u32 = 0x4001_3C00;
const GPIOA: u32 = 0x4002_0000;
const GPIOB: u32 = 0x4002_0400;
const GPIOD: u32 = 0x4002_0C00;
const GPIOE: u32 = 0x4002_1000;
const RCC: u32 = 0x4002_3800;
const FLASH: u32 = 0x4002_3C00;
/// The data register of the CRC unit.
const CRC: u32 = 0x4002_3000;
/// The priorities of interrupts, one byte each.
const NVIC_IPR: u32 = 0xE000_E400;
const OTG_FS_IRQ: u32 = 67;
const TIM11_IRQ: u32 = 26;
const EXTI1_IRQ: u32 = 7;
const EXTI9_5_IRQ: u32 = 23;
const TIM5_IRQ: u32 = 50;
const PVD_IRQ: u32 = 1;
const TIM4: u32 = 0x4000_0800;
const TIM9: u32 = 0x4001_4000;
const SYSCFG_MEMRMP: u32 = 0x4001_3800;
const SYSCFG_EXTICR2: u32 = 0x4001_380C;
/// Offsets of a port's registers: alternate functions of pins 0 to 7 and 8 to 15.
const AFRL: u32 = 0x20;
const AFRH: u32 = 0x24;
/// The place to which the program writes the packets of USB's endpoint 0.
const OTG_FS_FIFO_0: u32 = OTG_FS + 0x1000;
/// Offsets of a timer's registers.
const SR: u32 = 0x10;
const EGR: u32 = 0x14;
const CCER: u32 = 0x20;
const ARR: u32 = 0x2C;
const CCR1: u32 = 0x34;
const CCR2: u32 = 0x38;
const OR: u32 = 0x50;

/// All planted faults.
pub(crate) const PLANTED: &[Planted] = &[
    planted(
        "the lowest bit of the next tick lost",
        TIM2 + CCR1,
        |word| Some(word & !1),
        &["queued-traces"],
    ),
    planted(
        "the caches of the flash off",
        FLASH,
        |word| Some(word & !(0b11 << 9)),
        &["costs"],
    ),
    planted(
        "the caches of the flash are on while they are emptied",
        FLASH,
        |word| Some(word | 0b11 << 9),
        &["power-loss"],
    ),
    planted(
        "the caches of the flash keep what they hold of an erased sector",
        FLASH,
        |word| Some(word & !(0b11 << 11)),
        &["sector-change"],
    ),
    planted(
        "a board's record is not summed up as it is",
        CRC,
        |word| Some(word ^ 1),
        &["records"],
    ),
    planted(
        "a pin beside the serial line's is driven",
        GPIOA,
        |word| Some(word & !(0b11 << 16) | 0b01 << 16),
        &["no-record"],
    ),
    planted(
        "the motors' enable pin is driven with the safe levels",
        GPIOE,
        |word| Some(word & !(0b11 << 26) | 0b01 << 26),
        &["another-chip"],
    ),
    planted(
        "the loader does not find its memory at address 0",
        SYSCFG_MEMRMP,
        |word| (word & 0b11 != 0b01).then_some(word),
        &["loader"],
    ),
    planted(
        "power that is on while low has the usual polarity",
        TIM4 + CCER,
        |word| Some(word & !0b10),
        &["polarity"],
    ),
    planted(
        "the crystal's edges do not reach TIM11",
        TIM11 + OR,
        |_| None,
        &["crystal"],
    ),
    planted(
        "a tick that was missed is not made to come",
        TIM2 + EGR,
        |_| None,
        &["late-arm"],
    ),
    planted(
        "USB as urgent as ticks",
        NVIC_IPR + OTG_FS_IRQ,
        |_| Some(0),
        &["together"],
    ),
    planted(
        "the end of a pulse as urgent as ticks",
        NVIC_IPR + TIM11_IRQ,
        |_| Some(0),
        &["together"],
    ),
    planted(
        "an edge of the probe as urgent as ticks",
        NVIC_IPR + EXTI1_IRQ,
        |_| Some(0),
        &["together"],
    ),
    planted(
        "edges of limit switches as urgent as ticks",
        NVIC_IPR + EXTI9_5_IRQ,
        |_| Some(0),
        &["together"],
    ),
    planted(
        "the end of the filter's time as urgent as ticks",
        NVIC_IPR + TIM5_IRQ,
        |_| Some(0),
        &["together"],
    ),
    planted(
        "the supply's detector as urgent as ticks",
        NVIC_IPR + PVD_IRQ,
        |_| Some(0),
        &["together"],
    ),
    planted(
        "the pulse a microsecond short",
        TIM11 + ARR,
        |word| Some(word.wrapping_sub(168)),
        &["jitter"],
    ),
    planted(
        "the pulse a microsecond long",
        TIM11 + ARR,
        |word| Some(word.wrapping_add(168)),
        &["jitter"],
    ),
    planted(
        "the step timer's flags not cleared",
        TIM2 + SR,
        |_| None,
        &["queued-traces"],
    ),
    planted(
        "the step pin of X does not rise",
        GPIOE + 0x18,
        |word| Some(word & !(1 << 7)),
        &["queued-traces"],
    ),
    planted(
        "a line of machine 001's Y stays off",
        GPIOD + 0x18,
        |word| Some(word & !1),
        &["machines"],
    ),
    planted(
        "the step pin of X not driven",
        GPIOE,
        |word| Some(word & !(3 << 14)),
        &["start-up"],
    ),
    planted(
        "the power of the SKR 2 a count off",
        TIM9 + ARR,
        |word| Some(word + 1),
        &["boards"],
    ),
    planted(
        "the direction of Y stays positive",
        GPIOE + 0x18,
        |word| Some(word & !(1 << 11)),
        &["queued-traces"],
    ),
    planted(
        "the filter's time 50 us too long",
        TIM5 + CCR2,
        |word| Some(word.wrapping_add(50)),
        &["limits", "reset-button"],
    ),
    planted(
        "the filter's time 50 us too short",
        TIM5 + CCR2,
        |word| Some(word.wrapping_sub(50)),
        &["limits"],
    ),
    planted(
        "the filter's alarm not set",
        TIM5 + CCR2,
        |_| None,
        &["limits", "filter"],
    ),
    planted(
        "edges of limit switches not listened to",
        EXTI,
        |word| Some(word & !(7 << 4)),
        &["limits", "homing"],
    ),
    planted(
        "the door's edge not listened to",
        EXTI,
        |word| Some(word & !(1 << 2)),
        &["buttons"],
    ),
    planted(
        "only openings of the probe count",
        EXTI + 0x0C,
        |word| Some(word & !(1 << 1)),
        &["probe"],
    ),
    planted(
        "an edge's flag not cleared",
        EXTI + 0x14,
        |_| None,
        &["filter"],
    ),
    planted(
        // Here a compare value takes effect only at the end of a period. If it took effect at once,
        // the compare value 0 alone would put the laser out, and hide the fault.
        "laser off is no forced level",
        TIM4 + 0x18,
        |word| Some(if word >> 4 == 4 { 6 << 4 } else { word } | 1 << 3),
        &["limits"],
    ),
    planted(
        "the laser's pin not taken from its timer",
        GPIOD,
        |word| Some(word & !(3 << 24) | 2 << 24),
        &["endings"],
    ),
    planted(
        "the crystal not watched",
        RCC,
        |word| Some(word & !(1 << 19)),
        &["endings"],
    ),
    planted(
        "the supply's threshold a level lower",
        PWR,
        |word| Some(word & !(7 << 5) | 3 << 5),
        &["endings"],
    ),
    planted(
        "the supply's threshold a level higher",
        PWR,
        |word| Some(word & !(7 << 5) | 5 << 5),
        &["endings"],
    ),
    planted(
        "the supply not watched",
        PWR,
        |word| Some(word & !(1 << 4)),
        &["endings"],
    ),
    planted(
        "why the last reset came not cleared",
        RCC + 0x74,
        |_| None,
        &["resets"],
    ),
    planted(
        "the watchdog not started",
        IWDG,
        |word| (word & 0xFFFF != 0xCCCC).then_some(word),
        &["watchdog", "debugger"],
    ),
    planted(
        "a bootloader's DMA left running",
        RCC + 0x10,
        |_| None,
        &["bootloader"],
    ),
    planted(
        "edges of the step pins left slow",
        GPIOE + 0x08,
        |_| None,
        &["edge-speed"],
    ),
    planted(
        "the watchdog's time twice as long",
        IWDG + 0x08,
        |word| Some(2 * word),
        &["watchdog"],
    ),
    planted(
        "the watchdog's time a quarter",
        IWDG + 0x08,
        |word| Some(word / 4),
        &["normal-work"],
    ),
    planted(
        "the watchdog not fed",
        IWDG,
        |word| (word & 0xFFFF != 0xAAAA).then_some(word),
        &["normal-work"],
    ),
    planted(
        "the ring of received bytes filled only once",
        DMA1_S5CR,
        |word| Some(word & !(1 << 8)),
        &["stream-short"],
    ),
    planted(
        "received bytes looked at every half millisecond only",
        TIM7 + ARR,
        |word| Some((word + 1) * 10 - 1),
        &["realtime"],
    ),
    planted(
        "the end of what is sent not told",
        DMA1_S6CR,
        |word| Some(word & !(1 << 4)),
        &["stream-short"],
    ),
    planted(
        "the flash not unlocked",
        FLASH + 0x04,
        |_| None,
        &["power-loss"],
    ),
    planted(
        "the flash programmed byte by byte",
        FLASH + 0x10,
        |word| Some(word & !(3 << 8)),
        &["power-loss"],
    ),
    planted(
        "the wrong sector erased",
        FLASH + 0x10,
        |word| {
            Some(if word & 1 << 16 == 0 {
                word
            } else {
                word ^ 3 << 3
            })
        },
        &["sector-change"],
    ),
    planted(
        "the rate of the serial line 5 % off",
        USART2 + 0x08,
        |word| Some(word + word / 20),
        &["stream-short"],
    ),
    planted(
        "serial: the output is an input",
        GPIOA,
        |word| Some(word & !(3 << 4)),
        &["stream-short"],
    ),
    planted(
        "serial: the input is an output",
        GPIOA,
        |word| Some(word & !(3 << 6) | 1 << 6),
        &["stream-short"],
    ),
    planted(
        "serial: the input stays an input without a function",
        GPIOA,
        |word| Some(word & !(3 << 6)),
        &["stream-short"],
    ),
    planted(
        "serial: the output has another function",
        GPIOA + AFRL,
        |word| Some(word & !(0xF << 8) | 8 << 8),
        &["stream-short"],
    ),
    planted(
        "serial: the input has another function",
        GPIOA + AFRL,
        |word| Some(word & !(0xF << 12) | 8 << 12),
        &["stream-short"],
    ),
    planted(
        "serial: the SKR 2's output has another function",
        GPIOA + AFRH,
        |word| Some(word & !(0xF << 4) | 8 << 4),
        &["boards", "record-machines"],
    ),
    planted(
        "serial: machine 003's input is an input without a function",
        GPIOB,
        |word| Some(word & !(3 << 14)),
        &["boards"],
    ),
    planted(
        "USB: D- is an input",
        GPIOA,
        |word| Some(word & !(3 << 22)),
        &["usb"],
    ),
    planted(
        "USB: D+ is an input",
        GPIOA,
        |word| Some(word & !(3 << 24)),
        &["usb"],
    ),
    planted(
        "USB: D+ has another function",
        GPIOA + AFRH,
        |word| Some(word & !(0xF << 16) | 9 << 16),
        &["usb", "boards"],
    ),
    planted(
        "the nozzle's heater does not go off",
        GPIOB + 0x18,
        |word| Some(word & !(1 << 21)),
        &["heaters"],
    ),
    planted(
        "a sensor's pin is an input",
        GPIOB,
        |word| Some(word & !3),
        &["machines"],
    ),
    planted(
        "the laser's pin has another timer's function",
        GPIOD + AFRH,
        |word| Some(word & !(0xF << 16) | 1 << 16),
        &["limits"],
    ),
    planted(
        "limit switches are listened to at another port",
        SYSCFG_EXTICR2,
        |_| None,
        &["limits"],
    ),
    planted(
        "USB: the configuration states a byte too much",
        OTG_FS_FIFO_0,
        |word| {
            let is_configuration = word & 0xFFFF == 0x0209;
            Some(if is_configuration {
                word + (1 << 16)
            } else {
                word
            })
        },
        &["usb"],
    ),
    planted(
        "USB: the serial number states a byte too few",
        OTG_FS_FIFO_0,
        // Two bytes and 24 digits of two bytes each.
        |word| {
            Some(if word & 0xFFFF == 0x0332 {
                word - 1
            } else {
                word
            })
        },
        &["usb"],
    ),
    planted(
        "USB: an interface states an endpoint too few",
        OTG_FS_FIFO_0,
        |word| {
            // bLength, bDescriptorType, number, alternate setting; they are behind 9 bytes.
            let is_interface = word & 0xFF_FFFF == 0x00_0409 || word & 0xFFFF_FF00 == 0x0004_0900;
            Some(if is_interface { word ^ 1 << 16 } else { word })
        },
        &["usb"],
    ),
    planted(
        "USB: no packet is taken after a request",
        OTG_FS + 0xB20,
        |word| Some(word & !(1 << 31)),
        &["usb"],
    ),
    planted(
        "USB: the end of a packet that was sent not cleared",
        OTG_FS + 0x948,
        |_| None,
        &["usb"],
    ),
];

impl Planted {
    /// The checks that must find it.
    pub(crate) fn checks<'a>(
        &self,
        all: &'a [Check],
    ) -> impl Iterator<Item = &'a Check> + use<'a, '_> {
        let found_by = self.found_by;
        all.iter()
            .filter(move |check| found_by.contains(&check.name))
    }

    /// Runs a check on the firmware with this fault. Returns what the check found.
    ///
    /// # Errors
    /// The check found nothing.
    pub(crate) fn hold(&self, firmware: &Firmware, check: &Check) -> Result<Figures, Failure> {
        match (check.run)(&firmware.only(check.needs).with(self.fault)) {
            Ok(_) => Err(Failure(format!("{} does not find it", check.name))),
            Err(Failure(words)) => {
                let mut figures = Figures::default();
                let first: String = words
                    .lines()
                    .next()
                    .unwrap_or_default()
                    .chars()
                    .take(140)
                    .collect();
                figures.add(check.name, first);
                Ok(figures)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checks::CHECKS;

    #[test]
    fn every_fault_names_checks_that_there_are() {
        for planted in PLANTED {
            assert!(!planted.found_by.is_empty(), "{}", planted.name);
            assert_eq!(
                planted.checks(CHECKS).count(),
                planted.found_by.len(),
                "{}",
                planted.name
            );
        }
    }
}
