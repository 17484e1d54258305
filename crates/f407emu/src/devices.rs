//! All peripherals of the chip, and the cycle of their next event.
use crate::peripheral::{
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
        self.pwr.reset();
        self.flash = Flash::new();
        for (index, port) in self.ports.iter_mut().enumerate() {
            let (world, levels) = (port.world, port.levels);
            *port = Gpio::new(index);
            (port.world, port.levels) = (world, levels);
        }
        self.exti = Exti::default();
        self.adc.reset();
        self.crc = Crc::new();
        self.usarts.iter_mut().for_each(Usart::reset);
        for timer in &mut self.timers {
            *timer = Timer::new(timer.instance);
        }
        self.dma = Default::default();
        self.systick = SysTick::new();
        self.dwt = Dwt::new();
        self.iwdg = Iwdg::new(self.iwdg.lsi_hz(), self.rcc.clocks().hclk);
        self.usb.reset(now);
        self.others.clear();
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
