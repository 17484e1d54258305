//! All peripherals of the chip, and the cycle of their next event.
use crate::{
    peripheral::{
        adc::Adc,
        crc::Crc,
        dma::Dma,
        dwt::Dwt,
        exti::Exti,
        flash::Flash,
        gpio::Gpio,
        iwdg::{Iwdg, LSI_TYPICAL_HZ},
        pwr::Pwr,
        rcc::{Rcc, ResetCause},
        systick::SysTick,
        timer::Timer,
        timer_map::INSTANCES,
        usart::Usart,
        usb::Usb,
    },
    record::Pin,
};
use core::array;
use std::collections::HashMap;

/// The serial ports that are modelled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SerialPort {
    /// USART1, on APB2.
    Usart1,
    /// USART2, on APB1.
    Usart2,
    /// USART3, on APB1.
    Usart3,
    /// USART6, on APB2.
    Usart6,
}

/// A serial port, and the pins that a cable connects with its other end.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SerialLine {
    /// The port.
    pub port: SerialPort,
    /// The pin from which the chip sends.
    pub output: Pin,
    /// The pin at which the chip receives.
    pub input: Pin,
}

/// Base addresses of the serial ports, in the order of [`SerialPort`].
pub(crate) const USARTS: [u32; 4] = [0x4001_1000, 0x4000_4400, 0x4000_4800, 0x4001_1400];

/// The peripherals.
#[derive(Clone)]
pub(crate) struct Devices {
    pub(crate) rcc: Rcc,
    pub(crate) pwr: Pwr,
    pub(crate) flash: Flash,
    pub(crate) ports: [Gpio; 9],
    pub(crate) exti: Exti,
    pub(crate) adc: Adc,
    pub(crate) crc: Crc,
    pub(crate) usarts: [Usart; 4],
    /// The pins at which each serial port's cable is: output and input.
    pub(crate) cables: [Option<(Pin, Pin)>; 4],
    pub(crate) timers: [Timer; 14],
    pub(crate) dma: [Dma; 2],
    pub(crate) systick: SysTick,
    pub(crate) dwt: Dwt,
    pub(crate) iwdg: Iwdg,
    pub(crate) usb: Usb,
    /// The words written to peripherals that are not modelled, by address.
    pub(crate) others: HashMap<u32, u32>,
}

impl Devices {
    /// The peripherals after power-on.
    pub(crate) fn new(crystal_hz: u32) -> Self {
        let rcc = Rcc::new(crystal_hz);
        let hclk = rcc.clocks().hclk;
        Devices {
            rcc,
            pwr: Pwr::new(),
            flash: Flash::new(),
            ports: array::from_fn(Gpio::new),
            exti: Exti::default(),
            adc: Adc::new(),
            crc: Crc::new(),
            usarts: USARTS.map(Usart::new),
            cables: [None; 4],
            timers: array::from_fn(|index| Timer::new(&INSTANCES[index])),
            dma: Default::default(),
            systick: SysTick::new(),
            dwt: Dwt::new(),
            iwdg: Iwdg::new(LSI_TYPICAL_HZ, hclk),
            usb: Usb::default(),
            others: HashMap::new(),
        }
    }

    /// Resets all peripherals. The world outside goes on driving the pins and sending.
    pub(crate) fn reset(&mut self, cause: ResetCause, now: u64) {
        self.rcc.reset(cause);
        self.flash = Flash::new();
        self.exti = Exti::default();
        self.reset_some(|_| true, now);
        self.systick = SysTick::new();
        self.dwt = Dwt::new();
        self.iwdg = Iwdg::new(self.iwdg.lsi_hz(), self.rcc.clocks().hclk);
        self.others.clear();
    }

    /// Resets the peripherals that RCC has reset bits for and whose base addresses `are_reset`.
    pub(crate) fn reset_some(&mut self, are_reset: impl Fn(u32) -> bool, now: u64) {
        for (index, port) in self.ports.iter_mut().enumerate() {
            if are_reset(0x4002_0000 + 0x400 * index as u32) {
                port.reset(index);
            }
        }
        for (usart, base) in self.usarts.iter_mut().zip(USARTS) {
            if are_reset(base) {
                usart.reset();
            }
        }
        for timer in &mut self.timers {
            if are_reset(timer.instance.base) {
                *timer = Timer::new(timer.instance);
            }
        }
        for (dma, base) in self.dma.iter_mut().zip([0x4002_6000, 0x4002_6400]) {
            if are_reset(base) {
                *dma = Dma::default();
            }
        }
        if are_reset(0x4000_7000) {
            self.pwr.reset();
        }
        if are_reset(0x4001_2000) {
            self.adc.reset();
        }
        if are_reset(0x4001_3800) {
            self.exti.reset_syscfg();
        }
        if are_reset(0x4002_3000) {
            self.crc = Crc::new();
        }
        if are_reset(0x5000_0000) {
            self.usb.reset(now);
        }
    }

    /// The cycle of the next event of any peripheral.
    pub(crate) fn next_event(&self) -> u64 {
        let timers = self.timers.iter().map(Timer::next_event);
        let usarts = self.usarts.iter().map(Usart::next_event);
        timers
            .chain(usarts)
            .fold(self.systick.next_event(), u64::min)
            .min(self.flash.next_event())
            .min(self.iwdg.next_event())
            .min(self.usb.next_event())
    }
}
