//! The pins: their drivers, the edges that are recorded, and the external interrupts that follow
//! them.
use super::timers::outputs;
use crate::{
    machine::Machine,
    peripheral::{
        adc,
        gpio::Driven,
        pin_map::{self, Signal},
        usart::Connected,
    },
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

    /// Returns true if the chip drives a pin. A pin that it does not drive floats, or follows its
    /// pull or the world.
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

    /// Pins may have got other functions: tells the serial ports, USB and ADC1 so.
    pub(crate) fn functions_changed(&mut self, now: u64) {
        let signals = self.signals();
        for (index, cable) in self.devices.cables.into_iter().enumerate() {
            let connected = cable.map(|(output, input)| Connected {
                output: signals.contains(&(output, Signal::Transmit(index))) && self.rises(output),
                // If two pins have the function of one input, the cable may be at the wrong one.
                input: only(&signals, Signal::Receive(index)) == Some(input),
            });
            self.devices.usarts[index].connect(connected.unwrap_or_default(), now);
        }
        let lines = [Signal::UsbMinus, Signal::UsbPlus];
        self.devices.usb.connected = lines.iter().all(|line| only(&signals, *line).is_some());
        self.devices.adc.analog = self.analog_channels();
    }

    /// The pins with a function of a serial port or of USB.
    fn signals(&self) -> Vec<(Pin, Signal)> {
        let ports = (0..).zip(&self.devices.ports);
        let pins = ports.flat_map(|(port, gpio)| (0..16).map(move |number| (port, gpio, number)));
        pins.filter_map(|(port, gpio, number)| {
            let signal = pin_map::signal(port.into(), number, gpio.alternate(number)?)?;
            Some((Pin { port, number }, signal))
        })
        .collect()
    }

    /// Returns true if a pin in alternate mode can be high.
    fn rises(&self, pin: Pin) -> bool {
        self.devices.ports[usize::from(pin.port)].rises(pin.number)
    }

    /// The channels of ADC1 whose pins are in analog mode, one bit each.
    fn analog_channels(&self) -> u16 {
        let ports = (0..3).zip(&self.devices.ports);
        let pins = ports.flat_map(|(port, gpio)| (0..16).map(move |number| (port, gpio, number)));
        pins.filter(|(_, gpio, number)| gpio.is_analog(*number))
            .filter_map(|(port, _, number)| adc::channel(port, number))
            .fold(0, |all, channel| all | 1 << channel)
    }

    pub(crate) fn exti_changed(&mut self) {
        for (exception, up) in self.devices.exti.interrupts() {
            self.nvic.set_line(exception, up);
        }
    }
}

/// The pin with a function, if just one pin has it.
fn only(signals: &[(Pin, Signal)], wanted: Signal) -> Option<Pin> {
    let mut pins = signals.iter().filter(|(_, signal)| *signal == wanted);
    match (pins.next(), pins.next()) {
        (Some((pin, _)), None) => Some(*pin),
        _ => None,
    }
}
