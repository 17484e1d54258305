//! A DMA controller (RM0090 chapter 10): eight streams, each of which moves one datum for each
//! request.
//!
//! Not modelled: the FIFO's packing and bursts (a datum is moved at once, in the width of the
//! peripheral), arbitration (DMA takes no bus time from the core), priorities, errors.
use super::nvic::Exception;

/// DMA_SxCR: enable, interrupt enables (error, half transfer, transfer complete), circular mode,
/// increments, double buffer.
const EN: u32 = 1;
const TEIE: u32 = 1 << 2;
const HTIE: u32 = 1 << 3;
const TCIE: u32 = 1 << 4;
const CIRC: u32 = 1 << 8;
const PINC: u32 = 1 << 9;
const MINC: u32 = 1 << 10;
const DBM: u32 = 1 << 18;
const CT: u32 = 1 << 19;
/// DMA_SxFCR.DMDIS: direct mode disabled, which means that the FIFO is used.
const FIFO: u32 = 1 << 2;
/// DMA_SxFCR.FTH after a reset: half full.
const HALF_FULL: u32 = 1;
/// DMA_SxFCR.FS: the FIFO is empty.
const FIFO_EMPTY: u32 = 4 << 3;
/// Flags of a stream in DMA_LISR and DMA_HISR, counted from its first bit.
const TEIF: u32 = 1 << 3;
const HTIF: u32 = 1 << 4;
const TCIF: u32 = 1 << 5;
/// The first bit of each stream's flags, in LISR and HISR taken together.
const FLAGS: [u32; 8] = [0, 6, 16, 22, 32, 38, 48, 54];
/// The bytes of a stream's registers.
const STRIDE: u32 = 0x18;

/// The move of one datum.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Transfer {
    pub(crate) from: u32,
    pub(crate) to: u32,
    /// 1, 2 or 4 bytes.
    pub(crate) bytes: u32,
    /// Whether the FIFO would have packed data of another width.
    pub(crate) packs: bool,
}

#[derive(Clone, Copy, Debug)]
struct Stream {
    control: u32,
    /// The number of data left, and the number at the start.
    left: u32,
    total: u32,
    peripheral: u32,
    memory: [u32; 2],
    fifo: u32,
    /// The number of data moved since the start.
    position: u32,
}

/// A controller's registers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Dma {
    streams: [Stream; 8],
    flags: u64,
}

impl Default for Stream {
    fn default() -> Self {
        Stream {
            control: 0,
            left: 0,
            total: 0,
            peripheral: 0,
            memory: [0; 2],
            fifo: HALF_FULL,
            position: 0,
        }
    }
}

impl Dma {
    /// Reads the register at `offset` from the controller's base.
    pub(crate) fn read(&self, offset: u32) -> u32 {
        let Some((stream, register)) = place(offset) else {
            return match offset {
                0x0 => self.flags as u32,
                0x4 => (self.flags >> 32) as u32,
                _ => 0,
            };
        };
        let stream = &self.streams[stream];
        match register {
            0x00 => stream.control,
            0x04 => stream.left,
            0x08 => stream.peripheral,
            0x0C => stream.memory[0],
            0x10 => stream.memory[1],
            _ => stream.fifo | FIFO_EMPTY,
        }
    }

    /// Writes the register at `offset`. Returns the stream on which this starts a memory-to-memory
    /// transfer.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<usize> {
        const CLEARABLE: u64 = 0x0F7D_0F7D;
        let Some((index, register)) = place(offset) else {
            match offset {
                0x8 => self.flags &= !(u64::from(value) & CLEARABLE),
                0xC => self.flags &= !((u64::from(value) & CLEARABLE) << 32),
                _ => {}
            }
            return None;
        };
        let stream = &mut self.streams[index];
        let enabled = stream.control & EN != 0;
        match register {
            0x00 => return stream.write_control(value).then_some(index),
            0x04 if !enabled => stream.left = value & 0xFFFF,
            0x08 if !enabled => stream.peripheral = value,
            // In double-buffer mode the address of the buffer that is not in use may be changed
            // (section 10.3.9).
            0x0C if !enabled || stream.uses_second() => stream.memory[0] = value,
            0x10 if !enabled || stream.uses_first_of_two() => stream.memory[1] = value,
            0x14 if !enabled => stream.fifo = value & 0x87,
            _ => {}
        }
        None
    }

    /// Whether a stream listens to a channel's requests.
    pub(crate) fn listens(&self, stream: usize, channel: u8) -> bool {
        let control = self.streams[stream].control;
        control & EN != 0 && control >> 25 & 7 == u32::from(channel)
    }

    /// Whether a stream is enabled.
    pub(crate) fn is_enabled(&self, stream: usize) -> bool {
        self.streams[stream].control & EN != 0
    }

    /// Takes the next datum of a stream, and advances its counters.
    pub(crate) fn advance(&mut self, index: usize) -> Transfer {
        let stream = &mut self.streams[index];
        let transfer = stream.transfer();
        stream.position += 1;
        stream.left = stream.left.saturating_sub(1);
        let mut flags = 0;
        if stream.left == stream.total / 2 {
            flags |= HTIF;
        }
        if stream.left == 0 {
            flags |= TCIF;
            stream.end();
        }
        self.flags |= u64::from(flags) << FLAGS[index];
        transfer
    }

    /// A transfer failed: the stream stops.
    pub(crate) fn fail(&mut self, index: usize) {
        self.streams[index].control &= !EN;
        self.flags |= u64::from(TEIF) << FLAGS[index];
    }

    /// The level of a stream's interrupt line.
    pub(crate) fn interrupt(&self, index: usize) -> bool {
        let flags = (self.flags >> FLAGS[index]) as u32;
        let control = self.streams[index].control;
        [(TCIF, TCIE), (HTIF, HTIE), (TEIF, TEIE)]
            .iter()
            .any(|&(flag, enable)| flags & flag != 0 && control & enable != 0)
    }
}

impl Stream {
    /// Writes the control register. Returns whether that starts a memory-to-memory transfer, which
    /// waits for no requests.
    fn write_control(&mut self, value: u32) -> bool {
        let starts = value & EN != 0 && self.control & EN == 0;
        self.control = value & 0x0FEF_FFFF;
        if !starts {
            return false;
        }
        (self.total, self.position) = (self.left, 0);
        if self.left == 0 {
            self.control &= !EN;
        }
        self.left != 0 && self.direction() == 2
    }

    fn uses_second(&self) -> bool {
        self.control & (DBM | CT) == DBM | CT
    }

    fn uses_first_of_two(&self) -> bool {
        self.control & (DBM | CT) == DBM
    }

    /// The direction: 0 to memory, 1 to the peripheral, 2 from memory to memory.
    fn direction(&self) -> u32 {
        self.control >> 6 & 3
    }

    fn transfer(&self) -> Transfer {
        let width = |shift: u32| 1u32 << (self.control >> shift & 3);
        let bytes = width(11);
        let offset = |increments: u32| {
            let moves = self.control & increments != 0;
            if moves {
                self.position * bytes
            } else {
                0
            }
        };
        let buffer = usize::from(self.control & CT != 0);
        let memory = self.memory[buffer].wrapping_add(offset(MINC));
        let peripheral = self.peripheral.wrapping_add(offset(PINC));
        let (from, to) = match self.direction() {
            1 => (memory, peripheral),
            _ => (peripheral, memory),
        };
        Transfer {
            from,
            to,
            bytes,
            packs: self.fifo & FIFO != 0 && width(13) != bytes,
        }
    }

    /// All data have been moved: goes on with the other buffer, starts again, or ends (RM0090
    /// sections 10.3.8, 10.3.9).
    fn end(&mut self) {
        self.position = 0;
        if self.control & DBM != 0 {
            self.control ^= CT;
            self.left = self.total;
        } else if self.control & CIRC != 0 {
            self.left = self.total;
        } else {
            self.control &= !EN;
        }
    }
}

/// The stream and the register at an offset.
fn place(offset: u32) -> Option<(usize, u32)> {
    let offset = offset.checked_sub(0x10)?;
    let stream = (offset / STRIDE) as usize;
    (stream < 8).then_some((stream, offset % STRIDE))
}

/// The interrupt of a stream (RM0090 table 62); `controller` is 0 for DMA1.
pub(crate) fn exception(controller: usize, stream: usize) -> Exception {
    const POSITIONS: [[u8; 8]; 2] = [
        [11, 12, 13, 14, 15, 16, 17, 47],
        [56, 57, 58, 59, 60, 68, 69, 70],
    ];
    Exception::irq(POSITIONS[controller][stream])
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHANNEL_6: u32 = 6 << 25;
    const WORDS: u32 = 2 << 11 | 2 << 13;
    const TO_PERIPHERAL: u32 = 1 << 6;

    fn stream_5(options: u32, count: u32) -> Dma {
        let mut dma = Dma::default();
        let base = 0x10 + 5 * STRIDE;
        dma.write(base + 0x04, count);
        dma.write(base + 0x08, 0x4002_0C18);
        dma.write(base + 0x0C, 0x2000_0100);
        dma.write(
            base,
            CHANNEL_6 | WORDS | TO_PERIPHERAL | MINC | TCIE | EN | options,
        );
        dma
    }

    #[test]
    fn memory_moves_on_and_the_peripheral_stays() {
        let mut dma = stream_5(0, 2);
        assert!(dma.listens(5, 6) && !dma.listens(5, 7));
        let first = dma.advance(5);
        assert_eq!(
            (first.from, first.to, first.bytes),
            (0x2000_0100, 0x4002_0C18, 4)
        );
        assert!(!dma.interrupt(5));
        assert_eq!(dma.advance(5).from, 0x2000_0104);
        assert!(dma.interrupt(5) && !dma.is_enabled(5));
        dma.write(0xC, 0x3F << 6);
        assert!(!dma.interrupt(5));
    }

    #[test]
    fn a_circular_stream_begins_again() {
        let mut dma = stream_5(CIRC, 2);
        dma.advance(5);
        dma.advance(5);
        assert_eq!(dma.advance(5).from, 0x2000_0100);
        assert!(dma.is_enabled(5));
    }

    /// RM0090 section 10.3.8: the count is reloaded with its value when the stream was enabled, and
    /// requests are still served. Section 10.5.1: the flags of half and whole transfer come in
    /// every round.
    #[test]
    fn a_circular_stream_reloads_its_count_and_shows_each_half() {
        const HALF: u32 = HTIF << 6;
        const WHOLE: u32 = TCIF << 6;
        let mut dma = stream_5(CIRC, 4);
        let at = |dma: &Dma| (dma.read(0x10 + 5 * STRIDE + 0x04), dma.read(0x4));
        for _ in 0..2 {
            dma.advance(5);
            assert_eq!(at(&dma), (3, 0));
            dma.advance(5);
            assert_eq!(at(&dma), (2, HALF));
            dma.advance(5);
            assert_eq!(at(&dma), (1, HALF));
            dma.advance(5);
            assert_eq!(at(&dma), (4, HALF | WHOLE));
            assert!(dma.interrupt(5));
            dma.write(0xC, HALF | WHOLE);
            assert!(!dma.interrupt(5));
        }
    }

    #[test]
    fn two_buffers_take_turns() {
        let mut dma = stream_5(DBM, 1);
        dma.write(0x10 + 5 * STRIDE + 0x10, 0x2000_0200);
        assert_eq!(dma.advance(5).from, 0x2000_0100);
        assert_eq!(dma.advance(5).from, 0x2000_0200);
        assert_eq!(dma.advance(5).from, 0x2000_0100);
    }

    #[test]
    fn the_count_cannot_be_changed_while_the_stream_is_on() {
        let mut dma = stream_5(0, 2);
        dma.write(0x10 + 5 * STRIDE + 0x04, 99);
        assert_eq!(dma.read(0x10 + 5 * STRIDE + 0x04), 2);
    }
}
