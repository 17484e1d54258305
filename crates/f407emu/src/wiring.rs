//! How the peripherals are connected: events in the order of time, interrupt lines, DMA requests, pins.
use crate::{
    instruction::Width,
    machine::Machine,
    memory::{Memory, Region},
    peripheral::{
        dma::{self, Transfer},
        gpio::{Driven, Gpio},
        nvic::Exception,
        rcc::{Clocks, ResetCause},
        timer::TimerRequests,
        timer_map::{self, Route},
        timer_output::Output,
        usart::UsartRequests,
    },
    record::{Cause, Duty, Edge, Pin},
    warning::Warning,
    world::Happening,
};

/// Interrupts of the USARTs, in the order of `Devices` (RM0090 table 61).
const USART_IRQS: [u8; 4] = [37, 38, 39, 71];
/// DMA streams of the USARTs (RM0090 tables 42 and 43): of received bytes, and of those to be sent.
const USART_RECEIVE: [&[Route]; 4] = [
    &[route(1, 2, 4), route(1, 5, 4)],
    &[route(0, 5, 4)],
    &[route(0, 1, 4)],
    &[route(1, 1, 5), route(1, 2, 5)],
];
const USART_TRANSMIT: [&[Route]; 4] = [
    &[route(1, 7, 4)],
    &[route(0, 6, 4)],
    &[route(0, 3, 4), route(0, 4, 7)],
    &[route(1, 6, 5), route(1, 7, 5)],
];

const fn route(controller: u8, stream: u8, channel: u8) -> Route {
    Route {
        controller,
        stream,
        channel,
    }
}

impl Machine {
    /// Lets everything happen that is due by now, in order.
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
            Happening::Supply { low } => {
                if let Some(level) = self.devices.pwr.set_supply(low) {
                    self.devices.exti.line_changed(16, level);
                    self.exti_changed();
                }
            }
            Happening::Reset(cause) => self.restart(cause, now),
        }
    }

    fn run_timers(&mut self, now: u64) {
        for index in 0..self.devices.timers.len() {
            if self.devices.timers[index].next_event() <= now {
                let requests = self.devices.timers[index].event(now);
                self.timer_changed(index, now, Cause::Timer(index as u8 + 1));
                self.timer_requests(index, requests, now);
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
        if self.devices.iwdg.next_event() <= now {
            self.restart(ResetCause::Watchdog, now);
        }
    }

    /// Works out when the next event is.
    pub(crate) fn reschedule(&mut self) {
        self.next_event = self.devices.next_event().min(self.world.next_event());
    }

    // Clocks

    /// RCC or the flash's wait states have changed.
    pub(crate) fn clocks_changed(&mut self, now: u64) {
        let wait_states = self.devices.flash.acr & 7;
        self.devices.rcc.check(wait_states, &mut self.warnings);
        let stopped = self.devices.rcc.non_maskable();
        self.nvic.set_line(Exception::NMI, stopped);
        self.update_clocks(now);
    }

    /// Tells everything that counts how fast it does.
    pub(crate) fn update_clocks(&mut self, now: u64) {
        let clocks = self.devices.rcc.clocks();
        self.clocks = clocks;
        for timer in &mut self.devices.timers {
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
        self.reschedule();
    }

    // Timers

    pub(crate) fn timer_write(
        &mut self,
        index: usize,
        offset: u32,
        value: u32,
        now: u64,
        cause: Cause,
    ) {
        let timer = &mut self.devices.timers[index];
        let requests = timer.write(offset, value, now, &mut self.warnings);
        self.timer_changed(index, now, cause);
        self.timer_requests(index, requests, now);
        self.reschedule();
    }

    fn timer_changed(&mut self, index: usize, now: u64, cause: Cause) {
        let timer = &mut self.devices.timers[index];
        let (instance, drives) = (timer.instance, timer.outputs.take_driving());
        self.update_timer_line(instance.update_irq);
        if instance.compare_irq != instance.update_irq {
            self.update_timer_line(instance.compare_irq);
        }
        if drives {
            self.update_timer_pins(index, now, cause);
        }
    }

    /// Several timers may share a line.
    fn update_timer_line(&mut self, irq: u8) {
        let up = self.devices.timers.iter().any(|timer| {
            let instance = timer.instance;
            (instance.update_irq == irq && timer.update_interrupt())
                || (instance.compare_irq == irq && timer.compare_interrupt())
        });
        self.nvic.set_line(Exception::irq(irq), up);
    }

    fn timer_requests(&mut self, index: usize, requests: TimerRequests, now: u64) {
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

    /// The pins of a timer's outputs follow it.
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

    // USARTs

    pub(crate) fn usart_write(&mut self, index: usize, offset: u32, value: u32, now: u64) {
        let usart = &mut self.devices.usarts[index];
        let transmit = usart.write(offset, value, now, &mut self.warnings);
        self.usart_changed(index);
        let requests = UsartRequests {
            receive: false,
            transmit,
        };
        self.usart_requests(index, requests, now);
        self.reschedule();
    }

    pub(crate) fn usart_changed(&mut self, index: usize) {
        let up = self.devices.usarts[index].interrupt();
        self.nvic.set_line(Exception::irq(USART_IRQS[index]), up);
    }

    fn usart_requests(&mut self, index: usize, requests: UsartRequests, now: u64) {
        if requests.receive {
            self.request_dma(USART_RECEIVE[index], now);
        }
        if requests.transmit {
            self.request_dma(USART_TRANSMIT[index], now);
        }
    }

    // Flash

    pub(crate) fn flash_write(&mut self, offset: u32, value: u32, now: u64) {
        const RESETS_CACHES: u32 = 3 << 11;
        let before = self.devices.flash.acr;
        let time = (now, self.clocks.hclk);
        let flash = &mut self.devices.flash;
        if let Some(erase) = flash.write(offset, value, time, &mut self.warnings) {
            self.remember(erase.range.clone());
            self.memory.erase(erase.range);
            self.art.flush();
        }
        let acr = self.devices.flash.acr;
        if acr != before || acr & RESETS_CACHES != 0 {
            self.art.flush();
            self.clocks_changed(now);
        }
        self.flash_changed();
        self.reschedule();
    }

    fn flash_changed(&mut self) {
        let up = self.devices.flash.interrupt();
        self.nvic.set_line(Exception::irq(4), up);
    }

    // DMA

    pub(crate) fn dma_write(&mut self, index: usize, offset: u32, value: u32, now: u64) {
        if let Some(stream) = self.devices.dma[index].write(offset, value) {
            while self.devices.dma[index].is_enabled(stream) {
                self.move_datum(index, stream, now);
            }
        }
        for stream in 0..8 {
            self.dma_changed(index, stream);
        }
    }

    /// A peripheral asks for a transfer: the streams that listen make it.
    fn request_dma(&mut self, routes: &[Route], now: u64) {
        for route in routes {
            let (index, stream) = (usize::from(route.controller), usize::from(route.stream));
            if self.devices.dma[index].listens(stream, route.channel) {
                self.move_datum(index, stream, now);
            }
        }
    }

    fn move_datum(&mut self, index: usize, stream: usize, now: u64) {
        let transfer = self.devices.dma[index].advance(stream);
        if transfer.packs {
            self.warnings.add(Warning::DmaPacking);
        }
        if let Err(address) = self.transfer(transfer, index, stream, now) {
            self.warnings.add(Warning::DmaUnreachable { address });
            self.devices.dma[index].fail(stream);
        }
        self.dma_changed(index, stream);
    }

    fn dma_changed(&mut self, index: usize, stream: usize) {
        let up = self.devices.dma[index].interrupt(stream);
        self.nvic.set_line(dma::exception(index, stream), up);
    }

    /// Moves a datum; the error is the address that cannot be reached.
    fn transfer(
        &mut self,
        transfer: Transfer,
        index: usize,
        stream: usize,
        now: u64,
    ) -> Result<(), u32> {
        let Transfer { from, to, .. } = transfer;
        let width = match transfer.bytes {
            1 => Width::Byte,
            2 => Width::Half,
            _ => Width::Word,
        };
        let cause = Cause::Dma {
            controller: index as u8 + 1,
            stream: stream as u8,
        };
        let value = match dma_memory(from) {
            Some(place) => self.memory.read(place, width).ok_or(from)?,
            None if reaches(index, from) => {
                self.register_read(from & !3, now) >> (8 * (from & 3)) & width.mask()
            }
            None => return Err(from),
        };
        match dma_memory(to) {
            Some(place) => self.memory.write(place, width, value).ok_or(to),
            None if reaches(index, to) => {
                self.write_part(to, width, value, now, cause);
                Ok(())
            }
            None => Err(to),
        }
    }

    // Pins

    /// The pins of a port take their new levels: edges are recorded, and may interrupt.
    pub(crate) fn update_pins(&mut self, port: usize, cycle: u64, cause: Cause) {
        let levels = self.devices.ports[port].resolve(self.timer_levels(port));
        let changed = levels ^ self.devices.ports[port].levels;
        if changed == 0 {
            return;
        }
        self.devices.ports[port].levels = levels;
        for number in (0..16).filter(|number| changed >> number & 1 != 0) {
            let level = levels >> number & 1 != 0;
            if self.watched[port] >> number & 1 != 0 {
                let pin = Pin {
                    port: port as u8,
                    number,
                };
                self.edges.push(Edge {
                    cycle,
                    pin,
                    level,
                    cause,
                });
            }
            self.devices.exti.pin_changed(port, number, level);
        }
        self.exti_changed();
    }

    /// All pins take the levels that the ports' registers make.
    pub(crate) fn update_all_pins(&mut self, cycle: u64, cause: Cause) {
        for port in 0..self.devices.ports.len() {
            self.update_pins(port, cycle, cause);
        }
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

/// The timer outputs on a port's pins: pin, timer and output.
fn outputs(port: &Gpio, index: usize) -> Vec<(u8, usize, Output)> {
    (0..16)
        .filter(|pin| port.alternate_pins() >> pin & 1 != 0)
        .filter_map(|pin| {
            let (timer, output) = timer_map::output(index, pin, port.function(pin))?;
            Some((pin, timer, output))
        })
        .collect()
}

/// The memories that a DMA controller reaches: CCM is on the core's bus (RM0090 section 2.1).
fn dma_memory(address: u32) -> Option<(Region, usize)> {
    let place = Memory::place(address)?;
    matches!(place.0, Region::Flash | Region::Sram).then_some(place)
}

/// The peripherals that a controller reaches: DMA1 has no port to AHB1 (RM0090 section 2.1).
fn reaches(index: usize, address: u32) -> bool {
    match address {
        0x4000_0000..=0x4001_FFFF => true,
        0x4002_0000..=0x4007_FFFF => index == 1,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peripheral::nvic::Exception;

    const RCC: u32 = 0x4002_3800;
    const GPIOD: u32 = 0x4002_0C00;
    const TIM4: u32 = 0x4000_0800;
    const LASER: Pin = Pin::new('D', 12);

    /// A machine whose core sleeps in a `wfi; b .-2` at the start of SRAM, with these registers written.
    fn machine(registers: &[(u32, u32)]) -> Box<Machine> {
        let mut machine = Machine::new(8_000_000);
        machine.write_word(0x2000_0000, 0xE7FD_BF30).unwrap();
        machine.cpu.next = 0x2000_0000;
        for enables in [0x30, 0x40, 0x44] {
            machine.write_word(RCC + enables, u32::MAX).unwrap();
        }
        for &(address, value) in registers {
            machine.write_word(address, value).unwrap();
        }
        machine.clear_records();
        machine
    }

    /// TIM4 channel 1 on PD12: 1000 counts, so many of them high.
    fn pwm(high: u32, preload: u32) -> Box<Machine> {
        machine(&[
            (GPIOD, 2 << 24),
            (GPIOD + 0x24, 2 << 16),
            (TIM4 + 0x2C, 999),
            (TIM4 + 0x34, high),
            (TIM4 + 0x18, 6 << 4 | preload << 3),
            (TIM4 + 0x20, 1),
            (TIM4 + 0x14, 1),
            (TIM4, 1),
        ])
    }

    fn edges(machine: &Machine) -> Vec<(u64, bool)> {
        let start = machine.edges()[0].cycle;
        let relative = |edge: &Edge| (edge.cycle - start, edge.level);
        machine.edges_of(LASER).map(relative).collect()
    }

    #[test]
    fn a_timers_pwm_makes_edges_on_its_pin() {
        let mut machine = pwm(250, 0);
        machine.run_until(3_100).unwrap();
        let expected = [
            (0, false),
            (750, true),
            (1000, false),
            (1750, true),
            (2000, false),
        ];
        assert_eq!(edges(&machine)[..5], expected);
        assert_eq!(machine.edges()[1].cause, Cause::Timer(4));
    }

    #[test]
    fn a_preloaded_duty_changes_at_the_end_of_the_period() {
        let mut machine = pwm(250, 1);
        machine.run_until(1_100).unwrap();
        let start = machine.cycle();
        machine.write_word(TIM4 + 0x34, 500).unwrap();
        machine.run_until(3_100).unwrap();
        let last = machine.duties().last().unwrap();
        assert_eq!((last.high, last.period), (500, 1000));
        assert!(last.cycle > start + 500);
    }

    #[test]
    fn a_laser_forced_off_is_off_at_once() {
        let mut machine = pwm(900, 1);
        machine.run_until(1_100).unwrap();
        assert!(machine.level(LASER));
        let now = machine.cycle();
        machine.write_word(TIM4 + 0x18, 4 << 4 | 1 << 3).unwrap();
        assert!(!machine.level(LASER));
        assert_eq!(machine.edges().last().unwrap().cycle, now);
        assert_eq!(machine.duties().last().unwrap().high, 0);
    }

    #[test]
    fn a_timer_moves_words_from_memory_to_a_port_without_the_core() {
        const DMA2_S1: u32 = 0x4002_6400 + 0x10 + 0x18;
        const TIM8: u32 = 0x4001_0400;
        let mut machine = machine(&[
            (GPIOD, 1 << 24),
            (0x2000_0100, 1 << 12),
            (0x2000_0104, 1 << 28),
            (DMA2_S1 + 0x04, 2),
            (DMA2_S1 + 0x08, GPIOD + 0x18),
            (DMA2_S1 + 0x0C, 0x2000_0100),
            (DMA2_S1, 7 << 25 | 10 << 11 | 1 << 10 | 1 << 8 | 1 << 6 | 1),
            (TIM8 + 0x2C, 99),
            (TIM8 + 0x0C, 1 << 8),
            (TIM8, 1),
        ]);
        machine.run_until(450).unwrap();
        let expected = [(0, true), (100, false), (200, true), (300, false)];
        assert_eq!(edges(&machine)[..4], expected);
        let (controller, stream) = (2, 1);
        assert_eq!(machine.edges()[0].cause, Cause::Dma { controller, stream });
    }

    #[test]
    fn dma1_has_no_way_to_a_port() {
        const DMA1_S7: u32 = 0x4002_6000 + 0x10 + 7 * 0x18;
        let machine = machine(&[
            (DMA1_S7 + 0x04, 1),
            (DMA1_S7 + 0x08, GPIOD + 0x18),
            (DMA1_S7, 3 << 25 | 10 << 11 | 1 << 6 | 1),
            (0x4000_000C, 1 << 8),
            (0x4000_0014, 1),
        ]);
        let address = GPIOD + 0x18;
        let unreachable = Warning::DmaUnreachable { address };
        // The memory address is 0, which is the flash.
        assert_eq!(machine.warnings(), [unreachable]);
    }

    #[test]
    fn a_switch_makes_its_line_pending_at_its_cycle() {
        let mut machine = machine(&[
            (0x4001_3808, 2), // EXTICR1: line 0 from port C
            (0x4001_3C00, 1),
            (0x4001_3C0C, 1), // falling
        ]);
        let switch = Pin::new('C', 0);
        machine.pin_at(500, switch, true);
        machine.pin_at(900, switch, false);
        machine.run_until(890).unwrap();
        assert!(!machine.nvic.is_pending(Exception::irq(6)));
        machine.run_until(910).unwrap();
        assert!(machine.nvic.is_pending(Exception::irq(6)));
        assert_eq!(machine.edges().last().unwrap().cycle, 900);
    }

    #[test]
    fn bytes_come_one_after_the_other_at_the_rate_of_the_port() {
        const USART2: u32 = 0x4000_4400;
        let mut machine = machine(&[(USART2 + 0x08, 16), (USART2 + 0x0C, 0x200C)]);
        let sent_at = machine.cycle();
        machine.uart_send(crate::SerialPort::Usart2, b"ab");
        machine.run_until(sent_at + 159).unwrap();
        assert_eq!(machine.read_word(USART2).unwrap() & 1 << 5, 0);
        machine.run_until(sent_at + 200).unwrap();
        assert_eq!(machine.read_word(USART2 + 4), Ok(u32::from(b'a')));
        machine.run_until(sent_at + 330).unwrap();
        assert_eq!(machine.read_word(USART2 + 4), Ok(u32::from(b'b')));
        assert_eq!(machine.uart_overruns(crate::SerialPort::Usart2), 0);
    }

    #[test]
    fn an_unfed_watchdog_resets_the_chip_and_its_outputs() {
        let mut machine = machine(&[
            (GPIOD, 1 << 24),
            (GPIOD + 0x18, 1 << 12),
            (0x4000_3000, 0x5555),
            (0x4000_3008, 79), // 10 ms at 32 kHz
            (0x4000_3000, 0xCCCC),
        ]);
        let _ = machine.run_until(170_000);
        let (cycle, cause) = machine.resets()[0];
        assert_eq!(cause, ResetCause::Watchdog);
        assert!((160_000..160_200).contains(&cycle), "{cycle}");
        assert_eq!(machine.edges().last().unwrap().cause, Cause::Reset);
    }

    #[test]
    fn a_stopped_crystal_asks_for_the_nmi_where_it_is_watched() {
        let mut machine = machine(&[(RCC, 0x83 | 1 << 16 | 1 << 19), (RCC + 8, 1)]);
        assert_eq!(machine.clocks().hclk, 8_000_000);
        machine.crystal_stops_at(100);
        machine.cycle = 100;
        machine.run_events();
        assert_eq!(machine.clocks().hclk, 16_000_000);
        assert!(machine.nvic.is_pending(Exception::NMI));
    }

    #[test]
    fn a_supply_that_sinks_is_an_edge_of_line_16() {
        let mut machine = machine(&[
            (0x4000_7000, 0xC010),
            (0x4001_3C00, 1 << 16),
            (0x4001_3C08, 1 << 16),
        ]);
        machine.supply_at(100, true);
        machine.run_until(120).unwrap();
        assert!(machine.nvic.is_pending(Exception::irq(1)));
    }
}
