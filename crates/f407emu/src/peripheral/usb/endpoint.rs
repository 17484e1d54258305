//! The registers of one endpoint (RM0090 section 34.16.4): OTG_FS_DIEPCTLx or OTG_FS_DOEPCTLx, and
//! the registers that follow it.
use super::Answer;
use std::collections::VecDeque;

/// Control register. State: active, NAK, stall. Commands: clear NAK, set NAK, disable, enable.
pub(super) const USBAEP: u32 = 1 << 15;
const NAKSTS: u32 = 1 << 17;
const STALL: u32 = 1 << 21;
const CNAK: u32 = 1 << 26;
const SNAK: u32 = 1 << 27;
pub(super) const EPDIS: u32 = 1 << 30;
const EPENA: u32 = 1 << 31;
/// Bits of the control register that keep the written value: type, number of the FIFO, snooping,
/// largest packet, active, stall.
const KEPT: u32 = 0x03DC_07FF | USBAEP | STALL;
/// Flags: transfer complete, disabled.
const XFRC: u32 = 1;
const EPDISD: u32 = 1 << 1;
/// Flag of an IN endpoint: its FIFO is empty.
const TXFE: u32 = 1 << 7;
/// Size: bytes, packets.
const XFRSIZ: u32 = 0x7_FFFF;
const PKTCNT: u32 = 0x3FF << 19;

/// The index of an endpoint and the offset of its register, for an offset from the first endpoint's
/// control register.
pub(super) fn place(offset: u32) -> (usize, u32) {
    ((offset >> 5) as usize, offset & 0x1F)
}

/// The control register of endpoint `index` after `value` has been written to it. The program can
/// set the stall of endpoint 0, but cannot end it.
fn controlled(before: u32, value: u32, index: usize) -> u32 {
    let sticky = if index == 0 { STALL } else { 0 };
    let mut control = before & (EPENA | NAKSTS | sticky) | value & KEPT;
    if value & CNAK != 0 {
        control &= !NAKSTS;
    }
    if value & SNAK != 0 {
        control |= NAKSTS;
    }
    if value & EPENA != 0 {
        control |= EPENA;
    }
    if value & EPDIS != 0 {
        control &= !EPENA;
    }
    control
}

/// The size of the largest packet, bytes. Endpoint 0 has an encoding of its own.
fn largest(control: u32, index: usize) -> u32 {
    match index {
        0 => 64 >> (control & 3),
        _ => control & 0x7FF,
    }
}

/// The common state of both directions.
#[derive(Clone, Default, Debug)]
pub(super) struct Registers {
    pub(super) control: u32,
    pub(super) flags: u32,
    size: u32,
}

impl Registers {
    pub(super) fn read(&self, register: u32) -> u32 {
        match register {
            0x00 => self.control,
            0x08 => self.flags,
            0x10 => self.size,
            _ => 0,
        }
    }

    /// Returns true if the program has enabled a transfer.
    pub(super) fn is_enabled(&self) -> bool {
        self.control & EPENA != 0
    }

    /// Writes a register of endpoint `index`. An endpoint that is not enabled has nothing to
    /// disable.
    pub(super) fn write(&mut self, index: usize, register: u32, value: u32) {
        match register {
            0x00 => {
                if value & EPDIS != 0 && self.control & EPENA != 0 {
                    self.flags |= EPDISD;
                }
                self.control = controlled(self.control, value, index);
            }
            0x08 => self.flags &= !value,
            0x10 => self.size = value,
            _ => {}
        }
    }

    /// A request has come: ends a stall, and drops a transfer under way.
    pub(super) fn begin_request(&mut self) {
        self.control = self.control & !STALL | NAKSTS;
    }

    /// The host has reset the bus: only endpoint 0 stays active.
    pub(super) fn deactivate(&mut self) {
        self.control &= !USBAEP;
    }

    /// The program has taken the end of a SETUP stage: OUT endpoint 0 is no longer enabled
    /// (section 34.17.6).
    pub(super) fn end_setup(&mut self) {
        self.control &= !EPENA;
    }

    /// The answer of endpoint `index` when it cannot take part in a transfer; `None` if it can.
    pub(super) fn refusal(&self, index: usize) -> Option<Answer> {
        match self.control {
            // Endpoint 0 is always active.
            control if index != 0 && control & USBAEP == 0 => Some(Answer::Nothing),
            control if control & STALL != 0 => Some(Answer::Stall),
            control if control & EPENA == 0 || control & NAKSTS != 0 => Some(Answer::Nak),
            _ => None,
        }
    }

    fn packets(&self) -> u32 {
        (self.size & PKTCNT) >> 19
    }

    fn bytes(&self) -> u32 {
        self.size & XFRSIZ
    }

    /// Counts a packet of `bytes` bytes. Returns whether it was the transfer's last one; a transfer
    /// without a size is one packet.
    fn packet(&mut self, bytes: u32) -> bool {
        let packets = self.packets().saturating_sub(1);
        let left = self.bytes().saturating_sub(bytes);
        self.size = self.size & !(XFRSIZ | PKTCNT) | packets << 19 | left;
        packets == 0
    }

    /// A transfer has ended: the program knows of it.
    pub(super) fn end_transfer(&mut self) {
        self.control &= !EPENA;
        self.flags |= XFRC;
    }
}

/// An IN endpoint: from the device to the host.
#[derive(Clone, Default, Debug)]
pub(super) struct In {
    pub(super) registers: Registers,
    pub(super) fifo: VecDeque<u8>,
}

impl In {
    /// Reads a register. `depth` is the number of words in its FIFO.
    pub(super) fn read(&self, register: u32, depth: usize) -> u32 {
        match register {
            0x08 if self.fifo.is_empty() => self.registers.read(register) | TXFE,
            0x18 => (depth - depth.min(self.fifo.len() / 4)) as u32,
            _ => self.registers.read(register),
        }
    }

    /// The next packet, once the FIFO holds all of it: the program fills the FIFO word by word.
    pub(super) fn packet(&mut self, index: usize) -> Answer {
        if let Some(refusal) = self.registers.refusal(index) {
            return refusal;
        }
        let length = self
            .registers
            .bytes()
            .min(largest(self.registers.control, index));
        let words = length.div_ceil(4) as usize;
        if self.fifo.len() / 4 < words || self.registers.packets() == 0 {
            return Answer::Nak;
        }
        let mut data: Vec<u8> = self.fifo.drain(..4 * words).collect();
        data.truncate(length as usize);
        if self.registers.packet(length) {
            self.registers.end_transfer();
        }
        Answer::Ack(data)
    }
}

/// An OUT endpoint: from the host to the device.
#[derive(Clone, Default, Debug)]
pub(super) struct Out {
    pub(super) registers: Registers,
}

impl Out {
    /// Counts a packet of endpoint `index`. Returns whether it was the last packet of the transfer;
    /// a packet shorter than the largest size always is. After the last packet the endpoint refuses
    /// data, but stays enabled until the program has read that the transfer has ended (section
    /// 34.17.6).
    pub(super) fn take(&mut self, index: usize, length: usize) -> bool {
        let is_short = (length as u32) < largest(self.registers.control, index);
        let is_last = self.registers.packet(length as u32) || is_short;
        if is_last {
            self.registers.control |= NAKSTS;
        }
        is_last
    }
}
