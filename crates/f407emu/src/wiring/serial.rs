//! The USARTs and USB: their interrupt lines, and the DMA requests of the USARTs.
use crate::{
    machine::Machine,
    peripheral::{nvic::Exception, timer_map::Route, usart::UsartRequests},
};

/// Interrupts of the USARTs, in the order of `Devices` (RM0090 table 62).
pub(crate) const USART_IRQS: [u8; 4] = [37, 38, 39, 71];
/// Interrupt of USB OTG FS.
pub(crate) const USB_IRQ: u8 = 67;
/// DMA streams of the USARTs (RM0090 tables 43 and 44): for received bytes, and for bytes to be
/// sent.
pub(crate) const USART_RECEIVE: [&[Route]; 4] = [
    &[route(1, 2, 4), route(1, 5, 4)],
    &[route(0, 5, 4)],
    &[route(0, 1, 4)],
    &[route(1, 1, 5), route(1, 2, 5)],
];
pub(crate) const USART_TRANSMIT: [&[Route]; 4] = [
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
    pub(crate) fn usart_write(&mut self, index: usize, offset: u32, value: u32, now: u64) {
        let usart = &mut self.devices.usarts[index];
        let requests = usart.write(offset, value, now, &mut self.warnings);
        self.usart_changed(index);
        self.usart_requests(index, requests, now);
        self.reschedule();
    }

    pub(crate) fn usart_changed(&mut self, index: usize) {
        let up = self.devices.usarts[index].interrupt();
        self.nvic.set_line(Exception::irq(USART_IRQS[index]), up);
    }

    pub(crate) fn usb_changed(&mut self) {
        let up = self.devices.usb.interrupt();
        self.nvic.set_line(Exception::irq(USB_IRQ), up);
    }

    /// Repeats the USARTs' requests to DMA, for streams that have just been enabled.
    pub(super) fn repeat_usart_requests(&mut self, now: u64) {
        for index in 0..self.devices.usarts.len() {
            let requests = self.devices.usarts[index].requests();
            self.usart_requests(index, requests, now);
        }
        self.reschedule();
    }

    pub(super) fn usart_requests(&mut self, index: usize, requests: UsartRequests, now: u64) {
        if requests.receive {
            self.request_dma(USART_RECEIVE[index], now);
        }
        if requests.transmit {
            self.request_dma(USART_TRANSMIT[index], now);
        }
    }
}
