//! Connects the peripherals: events in the order of time, and clocks. The other files of this
//! folder connect interrupt lines, DMA requests and pins.
mod dma;
mod pins;
pub(crate) mod serial;
mod timers;

use crate::{
    machine::Machine,
    memory::FLASH,
    peripheral::{
        nvic::Exception,
        rcc::{Clocks, ResetCause},
    },
    record::{Cause, FlashOperation},
    trap::Stray,
    warning::Warning,
    world::Happening,
};

impl Machine {
    /// Carries out all events that are due by now, in order.
    #[cold]
    pub(crate) fn run_events(&mut self) {
        while self.next_event <= self.cycle {
            let now = self.next_event;
            while let Some(happening) = self.world.due(now) {
                self.happen(happening, now);
            }
            self.run_timers(now);
            self.run_usarts(now);
            self.run_single_devices(now);
            self.reschedule();
        }
    }

    fn happen(&mut self, happening: Happening, now: u64) {
        match happening {
            Happening::Pin { pin, level } => {
                let port = usize::from(pin.port);
                self.devices.ports[port].world.set(pin.number, level);
                self.update_pins(port, now, Cause::Input);
            }
            Happening::CrystalStops => {
                self.devices.rcc.crystal_fails();
                self.clocks_changed(now);
            }
            Happening::Supply { millivolts } => {
                if let Some(level) = self.devices.pwr.set_supply(millivolts) {
                    self.detector_changed(level);
                }
            }
            Happening::Reset(cause) => self.restart(cause, now),
        }
    }

    /// The voltage detector's output has changed: it is connected to EXTI's line 16 (RM0090 section
    /// 5.2.3).
    pub(crate) fn detector_changed(&mut self, low: bool) {
        self.devices.exti.line_changed(16, low);
        self.exti_changed();
    }

    fn run_timers(&mut self, now: u64) {
        for index in 0..self.devices.timers.len() {
            if self.devices.timers[index].next_event() <= now {
                self.timer_event(index, now);
            }
        }
    }

    fn run_usarts(&mut self, now: u64) {
        for index in 0..self.devices.usarts.len() {
            if self.devices.usarts[index].next_event() <= now {
                let requests = self.devices.usarts[index].event(now);
                self.usart_changed(index);
                self.usart_requests(index, requests, now);
            }
        }
    }

    fn run_single_devices(&mut self, now: u64) {
        if self.devices.systick.next_event() <= now && self.devices.systick.event(now) {
            self.nvic.pend(Exception::SYSTICK);
        }
        if self.devices.flash.next_event() <= now {
            self.devices.flash.event();
            self.flash_changed();
        }
        if self.devices.usb.next_event() <= now {
            self.devices.usb.event(now);
            self.usb_changed();
        }
        if self.devices.iwdg.next_event() <= now {
            self.restart(ResetCause::Watchdog, now);
        }
    }

    /// Finds the cycle of the next event.
    pub(crate) fn reschedule(&mut self) {
        self.next_event = self.devices.next_event().min(self.world.next_event());
    }

    // Clocks

    /// RCC or the flash's wait states have changed.
    pub(crate) fn clocks_changed(&mut self, now: u64) {
        self.check_clocks();
        let stopped = self.devices.rcc.non_maskable();
        self.nvic.set_line(Exception::NMI, stopped);
        self.update_clocks(now);
    }

    /// Warns if limits of the chip are exceeded.
    pub(crate) fn check_clocks(&mut self) {
        let wait_states = self.devices.flash.acr & 7;
        let scale_1 = self.devices.pwr.has_scale_1();
        let warnings = &mut self.warnings;
        self.devices.rcc.check(wait_states, scale_1, warnings);
    }

    /// Updates the clocks of all peripherals that count.
    pub(crate) fn update_clocks(&mut self, now: u64) {
        let clocks = self.devices.rcc.clocks();
        self.clocks = clocks;
        for index in 0..self.devices.timers.len() {
            self.catch_up_timer(index, now);
            let timer = &mut self.devices.timers[index];
            let divider = if timer.instance.on_apb2() {
                clocks.apb2
            } else {
                clocks.apb1
            };
            timer.set_clock(Clocks::timer(divider), now);
        }
        for (usart, base) in self.devices.usarts.iter_mut().zip(crate::devices::USARTS) {
            let apb2 = base >= 0x4001_0000;
            usart.set_bus_clock(if apb2 { clocks.apb2 } else { clocks.apb1 });
        }
        self.devices.iwdg.set_hclk(clocks.hclk, now);
        self.devices.usb.host.set_hclk(clocks.hclk);
        self.reschedule();
    }
    // Flash

    pub(crate) fn flash_write(&mut self, offset: u32, value: u32, now: u64) {
        let before = self.devices.flash.acr;
        // FLASH_CR keeps the bus until the operation under way has ended (RM0090 section 3.6.1).
        let now = match offset {
            0x10 => now.max(self.devices.flash.busy_until),
            _ => now,
        };
        self.cycle = self.cycle.max(now);
        let time = (now, self.clocks.hclk);
        let flash = &mut self.devices.flash;
        let erase = flash.write(offset, value, time, &mut self.warnings);
        if erase
            .as_ref()
            .is_some_and(|erase| erase.range.end > self.memory.flash.len())
        {
            self.warnings.add(Warning::NoSuchSector);
        } else if let Some(erase) = erase {
            self.remember(erase.range.clone());
            self.record_flash_operation(now, erase.range.start, true);
            let addresses = [erase.range.start, erase.range.end].map(|at| FLASH + at as u32);
            self.memory.erase(erase.range);
            self.art.erase(addresses[0]..addresses[1]);
        }
        if self.devices.flash.is_barred() {
            self.stop_astray(0x4002_3C00 + offset, Stray::WrongKey);
        }
        let acr = self.devices.flash.acr;
        self.art.reset(acr);
        if acr != before {
            self.clocks_changed(now);
        }
        self.flash_changed();
        self.reschedule();
    }

    /// Records that the operation at `offset` has begun.
    pub(crate) fn record_flash_operation(&mut self, begin: u64, offset: usize, erases: bool) {
        self.flash_operations.push(FlashOperation {
            begin,
            end: self.devices.flash.busy_until,
            address: FLASH + offset as u32,
            erases,
        });
    }

    fn flash_changed(&mut self) {
        let up = self.devices.flash.interrupt();
        self.nvic.set_line(Exception::irq(4), up);
    }
}

#[cfg(test)]
mod capture_tests;
#[cfg(test)]
mod pin_tests;
#[cfg(test)]
mod tests;
