//! Finds registers by their addresses: the peripherals' (RM0090 table 1) and the core's (DDI 0403,
//! B3.1).
use crate::{
    devices::USARTS,
    instruction::Width,
    machine::Machine,
    memory::Low,
    peripheral::{adc, iwdg, nvic::Exception, pwr, register_map, timer_map::INSTANCES, usb},
    record::Cause,
    trap::{Stop, Stray},
    warning::Warning,
};

/// The first address of the registers of USB OTG FS.
const USB: u32 = 0x5000_0000;

/// The offsets of a port's GPIOx_ODR and GPIOx_BSRR, which set levels and no functions.
const ODR: u32 = 0x14;
const BSRR: u32 = 0x18;

/// The offset of a port's GPIOx_LCKR.
const LCKR: u32 = 0x1C;

/// SCB_SCR, and its bit that makes sleep a stop or standby mode.
const SCR: u32 = 0xE000_ED10;
const SLEEPDEEP: u32 = 1 << 2;

/// The offset of OTG_FS_GCCFG, which switches USB's transceiver on.
const GCCFG: u32 = 0x38;

/// The offset of SYSCFG_MEMRMP in SYSCFG.
const MEMRMP: u32 = 0;

/// DBGMCU_APB1_FZ (RM0090 section 38.16.4).
const DBGMCU_APB1_FZ: u32 = 0xE004_2008;

/// A peripheral, by its place in `Devices`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Device {
    Rcc,
    Pwr,
    Flash,
    Port(usize),
    Syscfg,
    Exti,
    Adc,
    Crc,
    Dma(usize),
    Usart(usize),
    Timer(usize),
    Iwdg,
    Usb,
    Other,
}

impl Device {
    fn at(address: u32) -> Device {
        let base = address & !0x3FF;
        match base {
            0x4002_0000..=0x4002_23FF => Device::Port((base >> 10 & 15) as usize),
            0x4002_3000 => Device::Crc,
            0x4002_3800 => Device::Rcc,
            0x4002_3C00 => Device::Flash,
            0x4002_6000 => Device::Dma(0),
            0x4002_6400 => Device::Dma(1),
            0x4000_3000 => Device::Iwdg,
            0x4000_7000 => Device::Pwr,
            0x5000_0000..=0x5003_FFFF => Device::Usb,
            0x4001_3800 => Device::Syscfg,
            0x4001_3C00 => Device::Exti,
            0x4001_2000 => Device::Adc,
            _ => Device::by_table(base),
        }
    }

    fn by_table(base: u32) -> Device {
        let timer = INSTANCES.iter().position(|timer| timer.base == base);
        let usart = USARTS.iter().position(|&usart| usart == base);
        match (timer, usart) {
            (Some(index), _) => Device::Timer(index),
            (None, Some(index)) => Device::Usart(index),
            (None, None) => Device::Other,
        }
    }
}

impl Machine {
    /// Reads a peripheral's register at a cycle.
    pub(crate) fn register_read(&mut self, address: u32, now: u64) -> u32 {
        if !self.is_clocked(address, now) {
            return 0;
        }
        let value = self.device_read(address, now);
        match register_map::find(address) {
            Some(register) => register.seen(value),
            None if register_map::is_modelled(address) => {
                self.stop_astray(address, Stray::NoRegister);
                0
            }
            None => value,
        }
    }

    fn device_read(&mut self, address: u32, now: u64) -> u32 {
        let (offset, devices) = (address & 0x3FF, &mut self.devices);
        match Device::at(address) {
            Device::Rcc => devices.rcc.read(offset),
            Device::Pwr => devices.pwr.read(offset),
            Device::Flash => devices.flash.read(offset, now),
            Device::Port(index) => devices.ports[index].read(offset),
            Device::Syscfg => devices.exti.read_syscfg(offset),
            Device::Exti => devices.exti.read(offset),
            Device::Adc => devices.adc.read(offset, now),
            Device::Crc => {
                self.cycle = devices.crc.wait(offset, self.cycle);
                devices.crc.read(offset)
            }
            Device::Dma(index) => devices.dma[index].read(offset),
            Device::Timer(index) => {
                self.catch_up_timer(index, now);
                let crystal = self.devices.rcc.crystal_for_rtc();
                self.devices.timers[index].show_crystal(crystal, now);
                if self.devices.timers[index].take_capture(offset) {
                    self.update_timer_lines(index);
                }
                self.devices.timers[index].read(offset, now)
            }
            Device::Iwdg => devices.iwdg.read(offset, now),
            Device::Usb => {
                let value = devices.usb.read(address - USB);
                if devices.usb.take_misuse() {
                    self.warnings.add(Warning::UsbFifo);
                }
                self.usb_changed();
                value
            }
            Device::Usart(index) => {
                let value = devices.usarts[index].read(offset);
                self.usart_changed(index);
                value
            }
            Device::Other => {
                self.warnings.add(Warning::NotModelled { address });
                self.devices.others.get(&address).copied().unwrap_or(0)
            }
        }
    }

    /// Writes a peripheral's register at a cycle, and carries out the consequences. The program has
    /// written only the bits in `lanes`.
    pub(crate) fn register_write(
        &mut self,
        address: u32,
        value: u32,
        lanes: u32,
        now: u64,
        cause: Cause,
    ) {
        if !self.is_clocked(address, now) {
            return;
        }
        let taken = match register_map::find(address) {
            Some(register) => register.write,
            None => u32::MAX,
        };
        if let Err(stray) = is_proper(address, value, lanes) {
            return self.stop_astray(address, stray);
        }
        if let Some(value) = self.tampered(address, value, cause) {
            self.device_write(address, value & taken, now, cause);
        }
    }

    fn device_write(&mut self, address: u32, value: u32, now: u64, cause: Cause) {
        let (offset, devices) = (address & 0x3FF, &mut self.devices);
        match Device::at(address) {
            Device::Rcc => {
                devices.rcc.write(offset, value, now, &mut self.warnings);
                self.reset_peripherals(offset, value, now);
                self.clocks_changed(now);
            }
            Device::Pwr => {
                let changed = devices.pwr.write(offset, value);
                if !pwr::is_modelled(offset, value) {
                    self.warnings.add(Warning::NotModelled { address });
                }
                if let Some(low) = changed {
                    self.detector_changed(low);
                }
                self.check_clocks();
            }
            Device::Flash => self.flash_write(offset, value, now),
            Device::Port(index) => {
                devices.ports[index].write(offset, value);
                if offset == LCKR {
                    self.warnings.add(Warning::NotModelled { address });
                }
                if !matches!(offset, ODR | BSRR) {
                    self.functions_changed(now);
                }
                self.update_pins(index, now, cause);
            }
            Device::Syscfg => self.syscfg_write(address, value),
            Device::Exti => {
                devices.exti.write(offset, value);
                if !devices.exti.is_modelled() {
                    self.warnings.add(Warning::NotModelled { address });
                }
                self.exti_changed();
            }
            Device::Adc => self.adc_write(address, value, now),
            Device::Crc => {
                self.cycle = devices.crc.wait(offset, self.cycle);
                devices.crc.write(offset, value, self.cycle);
            }
            Device::Dma(index) => self.dma_write(index, offset, value, now),
            Device::Usart(index) => self.usart_write(index, offset, value, now),
            Device::Timer(index) => self.timer_write(index, offset, value, now, cause),
            Device::Iwdg => {
                devices.iwdg.write(offset, value, now);
                if iwdg::is_feeding(offset, value) {
                    self.begin_turn();
                }
                self.reschedule();
            }
            Device::Usb => self.usb_write(address, value),
            Device::Other => {
                self.warnings.add(Warning::NotModelled { address });
                self.devices.others.insert(address, value);
            }
        }
    }

    fn syscfg_write(&mut self, address: u32, value: u32) {
        let offset = address & 0x3FF;
        self.devices.exti.write_syscfg(offset, value);
        if offset != MEMRMP {
            return;
        }
        self.memory.low = match value & 3 {
            0 => Low::Flash,
            1 => Low::System,
            3 => Low::Sram1,
            _ => {
                self.warnings.add(Warning::NotModelled { address });
                Low::Flash
            }
        };
    }

    fn adc_write(&mut self, address: u32, value: u32, now: u64) {
        let clock = adc::Clock {
            now,
            apb2: self.clocks.apb2.into(),
            hclk: self.clocks.hclk.into(),
        };
        if self.devices.adc.write(address & 0x3FF, value, clock) {
            self.warnings.add(Warning::NotModelled { address });
        }
        if self.devices.adc.take_misuse() {
            self.warnings.add(Warning::PinNotAnalog);
        }
    }

    fn usb_write(&mut self, address: u32, value: u32) {
        let usb = &mut self.devices.usb;
        usb.write(address - USB, value);
        if usb.take_misuse() {
            self.warnings.add(Warning::UsbFifo);
        }
        if !usb::is_modelled(address - USB, value) {
            self.warnings.add(Warning::NotModelled { address });
        }
        if address - USB == GCCFG {
            self.check_usb_clock();
        }
        self.usb_changed();
    }

    /// Warns if USB is on with a clock that is not within 0.25 % of 48 MHz.
    fn check_usb_clock(&mut self) {
        let hz = self.devices.rcc.usb_hz();
        if self.devices.usb.is_on() && !(47_880_000..=48_120_000).contains(&hz) {
            self.warnings.add(Warning::UsbClock { hz });
        }
    }

    /// Applies planted faults to a word that the program writes; words that DMA writes are left
    /// alone.
    fn tampered(&self, address: u32, value: u32, cause: Cause) -> Option<u32> {
        match cause {
            Cause::Core(_) => self.planted(address, value),
            _ => Some(value),
        }
    }

    fn planted(&self, address: u32, value: u32) -> Option<u32> {
        let ours = self.tampers.iter().filter(|(place, _)| *place == address);
        ours.map(|(_, tamper)| tamper)
            .try_fold(value, |value, tamper| tamper(value))
    }

    /// Returns true if a peripheral has its clock. Otherwise the access ends the run.
    fn is_clocked(&mut self, address: u32, now: u64) -> bool {
        let rcc = &self.devices.rcc;
        let stray = match rcc.clock_of(address) {
            None => Stray::ClockOff,
            _ if rcc.is_held(address) => Stray::InReset,
            Some(since) if now < since => Stray::ClockTooFresh { left: since - now },
            Some(_) => return true,
        };
        self.stop_astray(address, stray);
        false
    }

    /// Ends the run: the program has made a wrong access.
    pub(crate) fn stop_astray(&mut self, address: u32, stray: Stray) {
        let pc = self.cpu.current();
        self.stray.get_or_insert(Stop::Stray { pc, address, stray });
    }

    /// Reads a word of the private peripheral bus.
    pub(crate) fn private_read(&mut self, address: u32) -> u32 {
        let now = self.cycle;
        let offset = address.wrapping_sub(0xE000_E000);
        match address {
            0xE000_1000..=0xE000_1FFF => self.devices.dwt.read(address & 0xFFF, now),
            0xE000_E010..=0xE000_E01F => self.devices.systick.read(address & 0xF, now),
            0xE000_ED04 => self.pending_state(),
            0xE000_ED0C => 0xFA05_0000 | u32::from(self.nvic.group) << 8,
            0xE000_ED18..=0xE000_ED23 => (0..4).fold(0, |word, k| {
                word | u32::from(self.nvic.priority(4 + offset - 0xD18 + k)) << (8 * k)
            }),
            0xE000_ED24 => self.handler_state(),
            0xE000_E100..=0xE000_E4EF => self.nvic.read(offset),
            0xE000_E000..=0xE000_EFFF => self.scb.read(offset),
            0xE004_2000 => self.idcode,
            DBGMCU_APB1_FZ => self.freeze_apb1,
            _ => 0,
        }
    }

    /// Writes a register of the private peripheral bus; priorities can be written byte by byte.
    pub(crate) fn private_write(&mut self, address: u32, width: Width, value: u32) {
        let Some(value) = self.planted(address, value) else {
            return;
        };
        let now = self.cycle;
        let offset = address.wrapping_sub(0xE000_E000);
        match address {
            0xE000_1000..=0xE000_1FFF => self.devices.dwt.write(address & 0xFFF, value, now),
            0xE000_E010..=0xE000_E01F => {
                self.devices.systick.write(address & 0xF, value, now);
                self.reschedule();
            }
            0xE000_E400..=0xE000_E4EF => self.set_priorities(16 + offset - 0x400, width, value),
            0xE000_ED18..=0xE000_ED23 => self.set_priorities(4 + offset - 0xD18, width, value),
            0xE000_ED04 => self.set_pending_state(value),
            0xE000_ED0C => self.application_control(value),
            0xE000_ED24 => self.set_handler_state(value),
            0xE000_E100..=0xE000_E3FF | 0xE000_EF00 => self.nvic.write(offset, value),
            0xE000_E000..=0xE000_EFFF => {
                self.scb.write(offset, value);
            }
            DBGMCU_APB1_FZ => self.freeze_apb1 = value,
            _ => {}
        }
        if !is_modelled_here(address, value) {
            self.warnings.add(Warning::NotModelled { address });
        }
        self.nvic.changed = true;
    }

    fn set_priorities(&mut self, first: u32, width: Width, value: u32) {
        for (number, byte) in (first..).zip(value.to_le_bytes()).take(width.bytes()) {
            self.nvic.set_priority(number, byte);
        }
    }

    /// The value of ICSR (DDI 0403, B3.2.4).
    fn pending_state(&self) -> u32 {
        let pending = |exception, bit: u32| u32::from(self.nvic.is_pending(exception)) << bit;
        u32::from(self.cpu.exception)
            | pending(Exception::SYSTICK, 26)
            | pending(Exception::PEND_SV, 28)
    }

    fn set_pending_state(&mut self, value: u32) {
        for (bit, exception) in [(28, Exception::PEND_SV), (26, Exception::SYSTICK)] {
            if value >> bit & 1 != 0 {
                self.nvic.pend(exception);
            } else if value >> (bit - 1) & 1 != 0 {
                self.nvic.unpend(exception);
            }
        }
    }

    /// Writes AIRCR (B3.2.6), which takes effect only with its key.
    fn application_control(&mut self, value: u32) {
        const KEY: u32 = 0x05FA;
        const SYSRESETREQ: u32 = 1 << 2;
        if value >> 16 != KEY {
            return;
        }
        self.nvic.group = (value >> 8 & 7) as u8;
        if value & SYSRESETREQ != 0 {
            self.reset_requested = true;
        }
    }

    /// The value of SHCSR (B3.2.13): the faults that have handlers of their own.
    fn handler_state(&self) -> u32 {
        FAULTS.iter().fold(0, |state, &(bit, exception)| {
            state | u32::from(self.nvic.is_enabled(exception)) << bit
        })
    }

    fn set_handler_state(&mut self, value: u32) {
        for (bit, exception) in FAULTS {
            self.nvic.enable(exception, value >> bit & 1 != 0);
        }
    }
}

/// Bits of SHCSR that enable faults.
const FAULTS: [(u32, Exception); 3] = [
    (16, Exception::MEMORY_FAULT),
    (17, Exception::BUS_FAULT),
    (18, Exception::USAGE_FAULT),
];

/// Returns true if everything that a value asks of a register of the private peripheral bus is
/// modelled. Not modelled are deep sleep, the MPU, trace, and the debug component (RM0090 section
/// 38.16) except for the bit that stops the watchdog's clock.
fn is_modelled_here(address: u32, value: u32) -> bool {
    match address {
        SCR => value & SLEEPDEEP == 0,
        DBGMCU_APB1_FZ => value & !iwdg::DBG_STOP == 0,
        0xE000_ED90..=0xE000_EDBF => false,
        0xE000_1000..=0xE000_1FFF | 0xE000_E000..=0xE000_EFFF => true,
        _ => false,
    }
}

/// Checks whether the manual allows a program to write a word to a register. The program has
/// written only the bits in `lanes`.
fn is_proper(address: u32, value: u32, lanes: u32) -> Result<(), Stray> {
    match register_map::find(address) {
        None if register_map::is_modelled(address) => Err(Stray::NoRegister),
        None => Ok(()),
        Some(register) if register.write == 0 => Err(Stray::ReadOnly),
        Some(register) if !register.allows(value, lanes) => Err(Stray::Reserved {
            value,
            bits: register.reserved() & lanes,
        }),
        Some(_) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_peripheral_is_found_by_its_address() {
        assert_eq!(Device::at(0x4000_0024), Device::Timer(1));
        assert_eq!(Device::at(0x4001_1404), Device::Usart(3));
        assert_eq!(Device::at(0x4002_1018), Device::Port(4));
        assert_eq!(Device::at(0x4002_6488), Device::Dma(1));
        assert_eq!(Device::at(0x5000_0800), Device::Usb);
    }

    #[test]
    fn usb_needs_a_clock_of_48_mhz() {
        let mut machine = Machine::with_clocks();
        let mut after = |value| {
            machine.write_word(USB + GCCFG, value).unwrap();
            machine.warnings().to_vec()
        };
        assert_eq!(after(0), []);
        assert_eq!(after(1 << 16), [Warning::UsbClock { hz: 0 }]);
    }

    #[test]
    fn what_is_not_modelled_is_said() {
        for (address, value) in [
            (0x4002_0000 + LCKR, 1),
            (0x4001_3C00, 1 << 17),
            (0x4001_3C04, 1),
            (0x4000_7004, 1 << 8),
            (SCR, SLEEPDEEP),
            (0xE000_ED94, 1),
            (DBGMCU_APB1_FZ, 1),
            (DBGMCU_APB1_FZ - 4, 1),
            (USB + 0x18, 1 << 3),
            (USB + 0x804, 1 << 9),
            (USB + 0x920, 1 << 18),
        ] {
            let mut machine = Machine::with_clocks();
            machine.write_word(address, value).unwrap();
            assert_eq!(machine.warnings(), [Warning::NotModelled { address }]);
        }
    }

    #[test]
    fn system_handler_priorities_are_bytes() {
        let mut machine = Machine::new(8_000_000);
        machine.private_write(0xE000_ED23, Width::Byte, 0xF0);
        assert_eq!(machine.nvic.priority(15), 0xF0);
        assert_eq!(machine.private_read(0xE000_ED20), 0xF000_0000);
    }

    #[test]
    fn aircr_needs_its_key() {
        let mut machine = Machine::new(8_000_000);
        machine.private_write(0xE000_ED0C, Width::Word, 0x0000_0004);
        assert!(!machine.reset_requested);
        machine.private_write(0xE000_ED0C, Width::Word, 0x05FA_0304);
        assert!(machine.reset_requested);
        assert_eq!(machine.nvic.group, 3);
    }

    #[test]
    fn the_system_timer_can_be_made_pending_and_taken_back() {
        let mut machine = Machine::new(8_000_000);
        machine.private_write(0xE000_ED04, Width::Word, 1 << 26);
        assert_eq!(machine.private_read(0xE000_ED04), 1 << 26);
        machine.private_write(0xE000_ED04, Width::Word, 1 << 25);
        assert_eq!(machine.private_read(0xE000_ED04), 0);
    }
}
