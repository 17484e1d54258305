//! The DMA controllers: the requests of the peripherals, and the memory that a stream can reach.
use crate::{
    instruction::Width,
    machine::Machine,
    memory::Region,
    peripheral::{
        dma::{self, Transfer},
        timer_map::Route,
    },
    record::Cause,
    warning::Warning,
};

impl Machine {
    pub(crate) fn dma_write(&mut self, index: usize, offset: u32, value: u32, now: u64) {
        let dma = &mut self.devices.dma[index];
        if let Some(stream) = dma.write(offset, value, &mut self.warnings) {
            if index == 0 {
                // DMA1 cannot move data from memory to memory (RM0090 section 10.3.6).
                self.warnings.add(Warning::DmaMode);
            }
            while self.devices.dma[index].is_enabled(stream) {
                self.move_datum(index, stream, now);
            }
        }
        // A stream that has just been enabled serves requests that wait.
        self.repeat_usart_requests(now);
        for stream in 0..8 {
            self.dma_changed(index, stream);
        }
    }

    /// A peripheral requests a transfer: the streams that serve it make it.
    pub(super) fn request_dma(&mut self, routes: &[Route], now: u64) {
        for route in routes {
            let (index, stream) = (usize::from(route.controller), usize::from(route.stream));
            if self.devices.dma[index].listens(stream, route.channel) {
                self.move_datum(index, stream, now);
            }
        }
    }

    fn move_datum(&mut self, index: usize, stream: usize, now: u64) {
        let transfer = self.devices.dma[index].advance(stream);
        if let Err(address) = self.transfer(transfer, index, stream, now) {
            self.warnings.add(Warning::DmaUnreachable { address });
            self.devices.dma[index].fail(stream);
        }
        self.dma_changed(index, stream);
    }

    pub(crate) fn dma_changed(&mut self, index: usize, stream: usize) {
        let up = self.devices.dma[index].interrupt(stream);
        self.nvic.set_line(dma::exception(index, stream), up);
    }

    /// Moves a datum. The error is the address that cannot be reached.
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
        let value = match self.dma_memory(from) {
            Some(place) => self.memory.read(place, width).ok_or(from)?,
            None if reaches(index, from) => {
                self.register_read(from & !3, now) >> (8 * (from & 3)) & width.mask()
            }
            None => return Err(from),
        };
        match self.dma_memory(to) {
            Some(place) => self.memory.write(place, width, value).ok_or(to),
            None if reaches(index, to) => {
                self.write_part(to, width, value, now, cause);
                Ok(())
            }
            None => Err(to),
        }
    }

    /// The memories that a DMA controller can reach: not CCM, which is on the core's bus (RM0090
    /// section 2.1). The manual does not say whether a DMA controller reaches the flash (sections
    /// 2.1.4 and 2.1.5); the emulator allows it.
    fn dma_memory(&self, address: u32) -> Option<(Region, usize)> {
        let place = self.memory.place(address)?;
        matches!(place.0, Region::Flash | Region::Sram).then_some(place)
    }
}

/// Returns true if a controller can reach a peripheral. The peripheral port of DMA1 is no master of
/// the bus matrix, and cannot reach AHB1 (RM0090 sections 2.1 and 10.3.1).
fn reaches(index: usize, address: u32) -> bool {
    match address {
        0x4000_0000..=0x4001_FFFF => true,
        0x4002_0000..=0x4007_FFFF => index == 1,
        _ => false,
    }
}
