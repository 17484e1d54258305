//! The pins: their drivers, the edges that are recorded, and the external interrupts that follow
//! them.
use super::timers::outputs;
use crate::{
    machine::Machine,
    peripheral::gpio::Driven,
    record::{Cause, Edge, Pin},
    world::Happening,
};

impl Machine {
    /// Updates the levels of a port's pins. Edges are recorded, and may cause interrupts.
    pub(crate) fn update_pins(&mut self, port: usize, cycle: u64, cause: Cause) {
        let levels = self.devices.ports[port].resolve(self.timer_levels(port));
        let changed = levels ^ self.devices.ports[port].levels;
        if changed == 0 {
            return;
        }
        self.devices.ports[port].levels = levels;
        for number in (0..16).filter(|number| changed >> number & 1 != 0) {
            let level = levels >> number & 1 != 0;
            let pin = Pin {
                port: port as u8,
                number,
            };
            if self.watched[port] >> number & 1 != 0 {
                self.edges.push(Edge {
                    cycle,
                    pin,
                    level,
                    cause,
                });
            }
            self.devices.exti.pin_changed(port, number, level);
            self.show_timer(pin, level, cycle);
            self.show_wires(pin, level, cycle);
        }
        self.exti_changed();
    }

    /// Carries the new level of a pin over its wires.
    fn show_wires(&mut self, from: Pin, level: bool, cycle: u64) {
        for wire in self.world.wires_of(from) {
            let pin = wire.to;
            let arrives = cycle + wire.cycles;
            self.world.add(arrives, Happening::Pin { pin, level });
            self.reschedule();
        }
    }

    /// Updates the levels of all pins.
    pub(crate) fn update_all_pins(&mut self, cycle: u64, cause: Cause) {
        for port in 0..self.devices.ports.len() {
            self.update_pins(port, cycle, cause);
        }
    }

    /// Whether the chip drives a pin. A pin that it does not drive floats, or follows its pull or
    /// the world.
    pub fn drives(&self, pin: Pin) -> bool {
        let port = usize::from(pin.port);
        let driving = self.devices.ports[port].driving(self.timer_levels(port));
        driving >> pin.number & 1 != 0
    }

    fn timer_levels(&self, port: usize) -> Driven {
        let mut driven = Driven::default();
        if self.devices.ports[port].alternate_pins() == 0 {
            return driven;
        }
        for (pin, timer, output) in outputs(&self.devices.ports[port], port) {
            if let Some(level) = self.devices.timers[timer].level(output) {
                driven.set(pin, level);
            }
        }
        driven
    }

    pub(crate) fn exti_changed(&mut self) {
        for (exception, up) in self.devices.exti.interrupts() {
            self.nvic.set_line(exception, up);
        }
    }
}
