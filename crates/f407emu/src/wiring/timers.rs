//! The timers: their interrupt lines, their DMA requests, and the pins that their outputs drive.
use crate::{
    machine::Machine,
    peripheral::{
        gpio::Gpio, nvic::Exception, timer::TimerRequests, timer_map, timer_output::Output,
    },
    record::{Cause, Duty, Match, Pin},
};

impl Machine {
    pub(crate) fn timer_write(
        &mut self,
        index: usize,
        offset: u32,
        value: u32,
        now: u64,
        cause: Cause,
    ) {
        self.catch_up_timer(index, now);
        let timer = &mut self.devices.timers[index];
        let requests = timer.write(offset, value, now, &mut self.warnings);
        self.timer_changed(index, now, cause);
        self.record_matches(index, requests.matched, now, true);
        self.timer_requests(index, requests, now);
        self.reschedule();
    }

    /// Carries out the events of a timer that are due by now. An access comes later than the start
    /// of its instruction, because it waits for the flash and for the store buffer. A match during
    /// that wait must not be missed.
    pub(crate) fn catch_up_timer(&mut self, index: usize, now: u64) {
        while self.devices.timers[index].next_event() <= now {
            let due = self.devices.timers[index].next_event();
            self.timer_event(index, due);
        }
    }

    /// Carries out the event that a timer has planned for now.
    pub(super) fn timer_event(&mut self, index: usize, now: u64) {
        let requests = self.devices.timers[index].event(now);
        self.timer_changed(index, now, Cause::Timer(index as u8 + 1));
        self.record_matches(index, requests.matched, now, false);
        self.timer_requests(index, requests, now);
    }

    pub(super) fn timer_changed(&mut self, index: usize, now: u64, cause: Cause) {
        let drives = self.devices.timers[index].outputs.take_driving();
        self.update_timer_lines(index);
        if drives {
            self.update_timer_pins(index, now, cause);
        }
    }

    /// Sets the interrupt lines of a timer by its flags.
    pub(crate) fn update_timer_lines(&mut self, index: usize) {
        let instance = self.devices.timers[index].instance;
        self.update_timer_line(instance.update_irq);
        if instance.compare_irq != instance.update_irq {
            self.update_timer_line(instance.compare_irq);
        }
    }

    /// A pin's level has changed: if the pin is a timer's input, the timer may capture its count.
    pub(super) fn show_timer(&mut self, pin: Pin, level: bool, now: u64) {
        let port = &self.devices.ports[usize::from(pin.port)];
        if port.alternate_pins() >> pin.number & 1 == 0 {
            return;
        }
        let function = port.function(pin.number);
        let Some((index, channel)) = timer_map::input(pin.port.into(), pin.number, function) else {
            return;
        };
        self.catch_up_timer(index, now);
        let requests = self.devices.timers[index].edge(channel, level, now);
        self.update_timer_lines(index);
        self.timer_requests(index, requests, now);
    }

    /// Records the matches of watched channels; `matched` has one bit for each channel.
    pub(super) fn record_matches(&mut self, index: usize, matched: u8, cycle: u64, forced: bool) {
        let watched = matched & self.watched_channels[index];
        for channel in (0..4).filter(|channel| watched >> channel & 1 != 0) {
            self.matches.push(Match {
                cycle,
                timer: index as u8 + 1,
                channel: channel + 1,
                forced,
            });
        }
    }

    /// Sets an interrupt line, which several timers may share.
    fn update_timer_line(&mut self, irq: u8) {
        let up = self.devices.timers.iter().any(|timer| {
            let instance = timer.instance;
            (instance.update_irq == irq && timer.update_interrupt())
                || (instance.compare_irq == irq && timer.compare_interrupt())
        });
        self.nvic.set_line(Exception::irq(irq), up);
    }

    pub(super) fn timer_requests(&mut self, index: usize, requests: TimerRequests, now: u64) {
        let instance = self.devices.timers[index].instance;
        if requests.update {
            self.request_dma(instance.update_dma, now);
        }
        for (channel, routes) in instance.compare_dma.iter().enumerate() {
            if requests.compare >> channel & 1 != 0 {
                self.request_dma(routes, now);
            }
        }
    }

    /// Updates the pins of a timer's outputs.
    fn update_timer_pins(&mut self, index: usize, now: u64, cause: Cause) {
        for port in 0..self.devices.ports.len() {
            let mut changed = false;
            for (pin, timer, output) in outputs(&self.devices.ports[port], port) {
                if timer == index {
                    changed = true;
                    self.record_duty(
                        Pin {
                            port: port as u8,
                            number: pin,
                        },
                        index,
                        output,
                        now,
                    );
                }
            }
            if changed {
                self.update_pins(port, now, cause);
            }
        }
    }

    fn record_duty(&mut self, pin: Pin, index: usize, output: Output, now: u64) {
        let timer = &self.devices.timers[index];
        let driven = timer.level(output).is_some();
        let share = timer.duty(usize::from(output.channel)).filter(|_| driven);
        let (high, period) = share.unwrap_or((0, 0));
        let last = self.duties.iter().rev().find(|duty| duty.pin == pin);
        let last = last.map_or((0, 0), |duty| (duty.high, duty.period));
        if last != (high, period) {
            self.duties.push(Duty {
                cycle: now,
                pin,
                high,
                period,
            });
        }
    }
}

/// The timer outputs on a port's pins: pin, timer and output.
pub(super) fn outputs(port: &Gpio, index: usize) -> Vec<(u8, usize, Output)> {
    (0..16)
        .filter(|pin| port.alternate_pins() >> pin & 1 != 0)
        .filter_map(|pin| {
            let (timer, output) = timer_map::output(index, pin, port.function(pin))?;
            Some((pin, timer, output))
        })
        .collect()
}
