//! A DMA controller (RM0090 chapter 10): eight streams, each of which moves one datum for each
//! request.
//!
//! A stream starts only if all its flags are clear (section 10.5.5, EN). While it is on, its
//! settings stay as they are. A stream that the program switches off has TCIF set (section
//! 10.3.14).
//!
//! Not modelled, and warned of: the FIFO (a datum is moved at once, in the width of the
//! peripheral), the peripheral as flow controller, increments of four bytes, and the settings that
//! table 50 forbids. Not modelled either: the datum that a stream loads in advance from memory,
//! arbitration (DMA takes no bus time from the core), priorities, errors of the FIFO.
use super::nvic::Exception;
use crate::warning::{Warning, Warnings};

/// DMA_SxCR: enable, interrupt enables (error, half transfer, transfer complete), circular mode,
/// increments, double buffer.
const EN: u32 = 1;
const TEIE: u32 = 1 << 2;
const HTIE: u32 = 1 << 3;
const TCIE: u32 = 1 << 4;
const PFCTRL: u32 = 1 << 5;
const CIRC: u32 = 1 << 8;
const PINC: u32 = 1 << 9;
const MINC: u32 = 1 << 10;
const PINCOS: u32 = 1 << 15;
const DBM: u32 = 1 << 18;
const CT: u32 = 1 << 19;
/// The bits that a program may change while the stream is on: the interrupt enables, CIRC and EN
/// (section 10.5.5).
const CHANGEABLE: u32 = 0x1F | CIRC;
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
/// All flags of a stream.
const ALL_FLAGS: u32 = 0x3D;
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
}

#[derive(Clone, Copy, Debug)]
struct Stream {
    control: u32,
    /// The number of data left, the number at the start, and the number that was written last.
    left: u32,
    total: u32,
    written: u32,
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
            written: 0,
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
    pub(crate) fn write(
        &mut self,
        offset: u32,
        value: u32,
        warnings: &mut Warnings,
    ) -> Option<usize> {
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
        let buffers = stream.control & (EN | DBM | CT);
        match register {
            0x00 => return self.write_control(index, value, warnings).then_some(index),
            0x04 if !enabled => {
                stream.left = value & 0xFFFF;
                stream.written = stream.left;
            }
            0x08 if !enabled => stream.peripheral = value,
            // In double-buffer mode the address of the buffer that is not in use may be changed
            // (section 10.3.9).
            0x0C if !enabled || stream.uses_second() => stream.memory[0] = value,
            0x10 if !enabled || stream.uses_first_of_two() => stream.memory[1] = value,
            // The buffer that is in use: an error (section 10.3.18).
            0x0C if buffers == EN | DBM => self.fail(index),
            0x10 if buffers == EN | DBM | CT => self.fail(index),
            0x14 if !enabled => stream.fifo = value & 0x87,
            _ => {}
        }
        None
    }

    /// Writes a stream's control register. Returns whether that starts a memory-to-memory transfer,
    /// which waits for no requests.
    fn write_control(&mut self, index: usize, value: u32, warnings: &mut Warnings) -> bool {
        let flags = (self.flags >> FLAGS[index]) as u32 & ALL_FLAGS;
        let stream = &mut self.streams[index];
        if stream.control & EN != 0 {
            let kept = stream.control & !CHANGEABLE;
            stream.control = kept | value & CHANGEABLE;
            if value & EN == 0 {
                self.flags |= u64::from(TCIF) << FLAGS[index];
            } else if (value ^ kept) & !(CHANGEABLE | CT) != 0 {
                warnings.add(Warning::DmaMode);
            }
            return false;
        }
        stream.control = value & 0x0FEF_FFFF;
        if value & EN == 0 {
            return false;
        }
        if flags != 0 {
            warnings.add(Warning::DmaFlags);
            stream.control &= !EN;
            return false;
        }
        if !stream.is_modelled() {
            warnings.add(Warning::DmaMode);
        }
        stream.start()
    }

    /// Returns true if a stream listens to a channel's requests: without data to move it serves
    /// none (section 10.5.6).
    pub(crate) fn listens(&self, stream: usize, channel: u8) -> bool {
        let Stream { control, left, .. } = self.streams[stream];
        control & EN != 0 && left != 0 && control >> 25 & 7 == u32::from(channel)
    }

    /// Returns true if a stream is enabled.
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
    /// Starts the stream. If no data are left, the count starts again at the number that was
    /// written last (section 10.5.6). Returns whether a memory-to-memory transfer begins.
    fn start(&mut self) -> bool {
        if self.left == 0 {
            self.left = self.written;
        }
        (self.total, self.position) = (self.left, 0);
        let round = self.control & (CIRC | DBM) != 0;
        self.left != 0 && self.direction() == 2 && !round
    }

    /// Returns true if the stream's settings are modelled and allowed (table 50). Without the FIFO,
    /// MSIZE, bursts and PINCOS do not matter. A transfer from memory to memory is the same with
    /// the FIFO and without it, but has to use it.
    fn is_modelled(&self) -> bool {
        let (control, fifo) = (self.control, self.fifo & FIFO != 0);
        let to_memory = self.direction() == 2;
        let round = control & (CIRC | DBM) != 0;
        let same_width = control >> 11 & 3 == control >> 13 & 3;
        let plain = same_width && control & (0xF << 21 | PINCOS) == 0;
        control & PFCTRL == 0
            && self.direction() != 3
            && control >> 11 & 3 != 3
            && fifo == to_memory
            && !(to_memory && round)
            && (!fifo || plain)
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
        let bytes = 1u32 << (self.control >> 11 & 3);
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
        Transfer { from, to, bytes }
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

    const BASE: u32 = 0x10 + 5 * STRIDE;
    const SETTINGS: u32 = CHANNEL_6 | WORDS | TO_PERIPHERAL | MINC | TCIE;

    fn write(dma: &mut Dma, offset: u32, value: u32) -> Vec<Warning> {
        let mut warnings = Warnings::default();
        dma.write(offset, value, &mut warnings);
        warnings.all().to_vec()
    }

    fn stream_5(options: u32, count: u32) -> Dma {
        let mut dma = Dma::default();
        for (offset, value) in [
            (BASE + 0x04, count),
            (BASE + 0x08, 0x4002_0C18),
            (BASE + 0x0C, 0x2000_0100),
            (BASE, SETTINGS | EN | options),
        ] {
            assert_eq!(write(&mut dma, offset, value), []);
        }
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
        write(&mut dma, 0xC, 0x3F << 6);
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
            write(&mut dma, 0xC, HALF | WHOLE);
            assert!(!dma.interrupt(5));
        }
    }

    #[test]
    fn two_buffers_take_turns() {
        let mut dma = stream_5(DBM, 1);
        write(&mut dma, BASE + 0x10, 0x2000_0200);
        assert_eq!(dma.advance(5).from, 0x2000_0100);
        assert_eq!(dma.advance(5).from, 0x2000_0200);
        assert_eq!(dma.advance(5).from, 0x2000_0100);
    }

    #[test]
    fn the_count_cannot_be_changed_while_the_stream_is_on() {
        let mut dma = stream_5(0, 2);
        write(&mut dma, BASE + 0x04, 99);
        assert_eq!(dma.read(BASE + 0x04), 2);
    }

    #[test]
    fn a_stream_with_a_flag_does_not_start() {
        let mut dma = stream_5(0, 1);
        dma.advance(5);
        write(&mut dma, BASE + 0x04, 3);
        assert_eq!(write(&mut dma, BASE, SETTINGS | EN), [Warning::DmaFlags]);
        assert!(!dma.is_enabled(5));
        write(&mut dma, 0xC, ALL_FLAGS << 6);
        assert_eq!(write(&mut dma, BASE, SETTINGS | EN), []);
        assert!(dma.is_enabled(5));
    }

    #[test]
    fn a_stream_that_is_switched_off_says_that_it_has_ended() {
        let mut dma = stream_5(0, 4);
        dma.advance(5);
        assert_eq!(write(&mut dma, BASE, SETTINGS), []);
        assert_eq!((dma.read(0x4), dma.read(BASE + 0x04)), (TCIF << 6, 3));
        assert!(dma.interrupt(5) && !dma.is_enabled(5));
    }

    #[test]
    fn settings_stay_while_the_stream_is_on() {
        let mut dma = stream_5(0, 4);
        let other = SETTINGS & !MINC & !TCIE | EN;
        assert_eq!(write(&mut dma, BASE, other), [Warning::DmaMode]);
        assert_eq!(dma.read(BASE), SETTINGS & !TCIE | EN);
    }

    #[test]
    fn a_count_that_has_run_out_comes_back_with_the_next_start() {
        let mut dma = stream_5(0, 2);
        dma.advance(5);
        dma.advance(5);
        write(&mut dma, 0xC, ALL_FLAGS << 6);
        assert_eq!(dma.read(BASE + 0x04), 0);
        write(&mut dma, BASE, SETTINGS | EN);
        assert_eq!(dma.read(BASE + 0x04), 2);
        let nothing = stream_5(0, 0);
        assert!(nothing.is_enabled(5) && !nothing.listens(5, 6));
    }

    #[test]
    fn a_new_address_for_the_buffer_in_use_is_an_error() {
        let mut dma = stream_5(DBM, 2);
        write(&mut dma, BASE + 0x10, 0x2000_0200);
        assert!(dma.is_enabled(5));
        write(&mut dma, BASE + 0x0C, 0x2000_0300);
        assert_eq!((dma.read(0x4), dma.is_enabled(5)), (TEIF << 6, false));
    }

    #[test]
    fn what_is_not_modelled_or_forbidden_is_said() {
        let from_memory_to_memory = 2 << 6;
        for (fifo, settings) in [
            (0, PFCTRL),
            (0, 3 << 6),
            (0, 3 << 11),
            (FIFO, TO_PERIPHERAL),
            (0, from_memory_to_memory),
            (FIFO, from_memory_to_memory | CIRC),
            (FIFO, from_memory_to_memory | 1 << 11),
            (FIFO, from_memory_to_memory | 1 << 23),
        ] {
            let mut dma = Dma::default();
            write(&mut dma, BASE + 0x04, 1);
            write(&mut dma, BASE + 0x14, fifo);
            let found = write(&mut dma, BASE, settings | EN);
            assert_eq!(found, [Warning::DmaMode], "{settings:#x}");
        }
    }
}
