//! The registers of one endpoint (RM0090 section 34.16.4): OTG_FS_DIEPCTLx and OTG_FS_DOEPCTLx, and those behind them.
use super::Answer;
use std::collections::VecDeque;

/// Control: active, not acknowledging, stalled; written: acknowledge, do not, disable, enable.
const USBAEP: u32 = 1 << 15;
const NAKSTS: u32 = 1 << 17;
const STALL: u32 = 1 << 21;
const CNAK: u32 = 1 << 26;
const SNAK: u32 = 1 << 27;
const EPDIS: u32 = 1 << 30;
const EPENA: u32 = 1 << 31;
/// Bits of the control register that keep what is written: type, number of the FIFO, largest packet, and the two above.
const KEPT: u32 = 0x03CC_07FF | USBAEP | STALL;
/// Flags: transfer complete, disabled.
const XFRC: u32 = 1;
const EPDISD: u32 = 1 << 1;
/// Size: bytes, packets.
const XFRSIZ: u32 = 0x7_FFFF;
const PKTCNT: u32 = 0x3FF << 19;

/// Index of the endpoint and register of an offset from the first endpoint's control register.
pub(super) fn place(offset: u32) -> (usize, u32) {
    ((offset >> 5) as usize, offset & 0x1F)
}

fn controlled(before: u32, value: u32) -> u32 {
    let mut control = before & (EPENA | NAKSTS) | value & KEPT;
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

fn refusal(control: u32, index: usize) -> Option<Answer> {
    match control {
        // Endpoint 0 is always active.
        _ if index != 0 && control & USBAEP == 0 => Some(Answer::Nothing),
        _ if control & STALL != 0 => Some(Answer::Stall),
        _ if control & EPENA == 0 || control & NAKSTS != 0 => Some(Answer::Nak),
        _ => None,
    }
}

/// The largest packet: endpoint 0 has a code of its own.
fn largest(control: u32, index: usize) -> u32 {
    match index {
        0 => 64 >> (control & 3),
        _ => control & 0x7FF,
    }
}

/// From the device to the host.
#[derive(Clone, Default, Debug)]
pub(super) struct In {
    pub(super) control: u32,
    pub(super) flags: u32,
    size: u32,
    pub(super) fifo: VecDeque<u8>,
}

impl In {
    /// `depth`: words of its FIFO.
    pub(super) fn read(&self, register: u32, depth: usize) -> u32 {
        match register {
            0x00 => self.control,
            0x08 => self.flags,
            0x10 => self.size,
            0x18 => (depth - depth.min(self.fifo.len() / 4)) as u32,
            _ => 0,
        }
    }

    pub(super) fn write(&mut self, register: u32, value: u32) {
        match register {
            0x00 => {
                self.control = controlled(self.control, value);
                if value & EPDIS != 0 {
                    self.flags |= EPDISD;
                }
            }
            0x08 => self.flags &= !value,
            0x10 => self.size = value & (XFRSIZ | PKTCNT),
            _ => {}
        }
    }

    /// A request has come: what was halted goes on, what was to be sent is not wanted any more.
    pub(super) fn begin_request(&mut self) {
        self.control = self.control & !STALL | NAKSTS;
    }

    /// The next packet, once all of it is in the FIFO, which is filled in words.
    pub(super) fn packet(&mut self, index: usize) -> Answer {
        if let Some(refusal) = refusal(self.control, index) {
            return refusal;
        }
        let left = self.size & XFRSIZ;
        let length = left.min(largest(self.control, index));
        let words = length.div_ceil(4) as usize;
        if self.fifo.len() / 4 < words || self.size & PKTCNT == 0 {
            return Answer::Nak;
        }
        let mut data: Vec<u8> = self.fifo.drain(..4 * words).collect();
        data.truncate(length as usize);
        self.size -= length;
        self.size -= 1 << 19;
        if self.size & PKTCNT == 0 {
            self.control = self.control & !EPENA | NAKSTS;
            self.flags |= XFRC;
        }
        Answer::Ack(data)
    }
}

/// From the host to the device.
#[derive(Clone, Default, Debug)]
pub(super) struct Out {
    control: u32,
    flags: u32,
    size: u32,
}

impl Out {
    pub(super) fn read(&self, register: u32) -> u32 {
        match register {
            0x00 => self.control,
            0x08 => self.flags,
            0x10 => self.size,
            _ => 0,
        }
    }

    pub(super) fn write(&mut self, register: u32, value: u32) {
        match register {
            0x00 => {
                self.control = controlled(self.control, value);
                if value & EPDIS != 0 {
                    self.flags |= EPDISD;
                }
            }
            0x08 => self.flags &= !value,
            0x10 => self.size = value,
            _ => {}
        }
    }

    pub(super) fn begin_request(&mut self) {
        self.control = self.control & !STALL | NAKSTS;
    }

    /// What it answers where it takes no packet.
    pub(super) fn refusal(&self, index: usize) -> Option<Answer> {
        refusal(self.control, index)
    }

    /// Takes a packet; whether that was the transfer's last one. A transfer without a size is one packet.
    pub(super) fn take(&mut self, length: usize) -> bool {
        let packets = (self.size & PKTCNT) >> 19;
        let bytes = (self.size & XFRSIZ).saturating_sub(length as u32);
        self.size = self.size & !(PKTCNT | XFRSIZ) | packets.saturating_sub(1) << 19 | bytes;
        let last = packets <= 1;
        if last {
            self.control = self.control & !EPENA | NAKSTS;
            self.flags |= XFRC;
        }
        last
    }
}
