//! USB OTG FS as a full-speed device (RM0090 chapter 34), with a host at the other end of the cable
//! ([`host`]).
//!
//! The device answers the tokens of the host. IN takes data from the FIFOs of the endpoints; OUT
//! and SETUP put data into the common receive FIFO. A device that is not ready answers NAK.
//! Endpoints other than 0 answer only to their own address.
//!
//! A SETUP packet always finds room in the receive FIFO, in which 10 words are reserved for it
//! (section 34.13.1). The end of the SETUP stage is put there when the host's next token comes
//! (section 34.17.6).
//!
//! Not modelled, and warned of: host mode, isochronous transfers, global NAKs, low power, and
//! interrupts other than these: end of transfer of the IN endpoints, reset, speed, suspend, wake-up
//! (which never comes), received data. FIFOs that overlap, overflow or are read empty are warned of,
//! too. Not modelled either: data toggles, line errors, the count of SETUP packets, the turnaround
//! time (GUSBCFG.TRDT), the choice of the mode (GUSBCFG.FDMOD: it is a device always), the supply
//! of the cable, frame numbers and suspend in DSTS, and the suspend interrupt of a device without a
//! cable.
mod descriptors;
mod endpoint;
mod host;

pub(crate) use host::Host;

use core::ops::{Range, RangeInclusive};
use endpoint::{In, Out};
use std::collections::{HashMap, VecDeque};

/// OTG_FS_GAHBCFG.GINTMSK: interrupts reach the NVIC.
const GINT: u32 = 1;
/// OTG_FS_GRSTCTL: core soft reset, HCLK soft reset, frame counter reset, flush of the receive
/// FIFO, flush of a transmit FIFO, and the number of that FIFO.
const CSRST: u32 = 1;
const RXFFLSH: u32 = 1 << 4;
const TXFFLSH: u32 = 1 << 5;
const SELF_CLEARING: u32 = CSRST | 1 << 1 | 1 << 2 | RXFFLSH | TXFFLSH;
/// The number in GRSTCTL.TXFNUM that stands for all transmit FIFOs.
const ALL_FIFOS: u32 = 0x10;
/// OTG_FS_GRSTCTL.AHBIDL: nothing is under way.
const IDLE: u32 = 1 << 31;
/// OTG_FS_GINTSTS: received data, suspend, reset, speed known, IN endpoint, wake-up.
const RXFLVL: u32 = 1 << 4;
const USBSUSP: u32 = 1 << 11;
const USBRST: u32 = 1 << 12;
const ENUMDNE: u32 = 1 << 13;
const IEPINT: u32 = 1 << 18;
/// Flags of OTG_FS_GINTSTS that are cleared by writing 1.
const CLEARED: u32 = USBSUSP | USBRST | ENUMDNE | 1 << 31;
/// OTG_FS_GCCFG.PWRDWN: the transceiver is on.
const PWRDWN: u32 = 1 << 16;
/// OTG_FS_DCFG.DSPD: the device's speed.
const DSPD: u32 = 3;
/// OTG_FS_DCTL.SDIS: no pull-up, so that the host sees no device.
const SDIS: u32 = 1 << 1;
/// OTG_FS_CID after a reset.
const PRODUCT: u32 = 0x1100;
/// OTG_FS_DSTS.ENUMSPD: full speed.
const FULL_SPEED: u32 = 3 << 1;
/// OTG_FS_GRXSTSP.PKTSTS: OUT data, OUT transfer complete, SETUP complete, SETUP data.
const OUT_DATA: u32 = 2;
const OUT_COMPLETE: u32 = 3;
const SETUP_COMPLETE: u32 = 4;
const SETUP_DATA: u32 = 6;
/// The words of the receive FIFO that are reserved for SETUP packets.
const SETUP_ROOM: usize = 10;
/// The words of memory for all FIFOs (section 34.2.1): 1.25 KB.
const MEMORY: usize = 320;
/// The words of one FIFO (section 34.16.2, GRXFSIZ and DIEPTXF0).
const DEPTHS: RangeInclusive<usize> = 16..=256;
/// The number of endpoints in each direction.
const ENDPOINTS: usize = 4;

/// OTG_FS_GINTSTS: the FIFOs of host mode are empty.
const HOST_FIFOS_EMPTY: u32 = 1 << 26 | 1 << 5;
/// The reset values of the registers that keep the written value, by their offsets.
const RESET: [(u32, u32); 11] = [
    (0x000, 0x800),
    (0x00C, 0xA00),
    (0x024, 0x200),
    (0x028, 0x200),
    (0x02C, 0x0008_0200),
    (0x100, 0x0200_0600),
    (0x104, 0x0200_0400),
    (0x108, 0x0200_0400),
    (0x10C, 0x0200_0400),
    (0x828, 0x17D7),
    (0x82C, 0x5B8),
];

/// The device's answer to a token.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Answer {
    /// The data for an IN token, or the acceptance of the data of an OUT or SETUP token.
    Ack(Vec<u8>),
    /// Not ready.
    Nak,
    /// The request is not known, or the endpoint is halted.
    Stall,
    /// There is no such device, or no such endpoint.
    Nothing,
}

/// An entry of the receive FIFO.
#[derive(Clone, Debug)]
struct Entry {
    status: u32,
    data: Vec<u8>,
}

impl Entry {
    fn new(endpoint: usize, status: u32, data: &[u8]) -> Self {
        Entry {
            status: endpoint as u32 | (data.len() as u32) << 4 | status << 17,
            data: data.to_vec(),
        }
    }

    fn words(&self) -> usize {
        1 + self.data.len().div_ceil(4)
    }
}

/// The controller's registers and FIFOs, and the other end of the cable.
#[derive(Clone, Debug)]
pub(crate) struct Usb {
    /// Registers that keep the written value.
    written: HashMap<u32, u32>,
    /// True if the host has set the speed (DSTS).
    enumerated: bool,
    flags: u32,
    ins: [In; ENDPOINTS],
    outs: [Out; ENDPOINTS],
    receive: VecDeque<Entry>,
    /// The data of the receive FIFO's entry that was read last.
    data: VecDeque<u8>,
    /// True if the host is in the SETUP stage of a control transfer.
    in_setup: bool,
    /// True if D- and D+ are connected to their pins.
    pub(crate) connected: bool,
    /// True if the program has used a FIFO in a wrong way since the last call of
    /// [`Usb::take_misuse`].
    misuse: bool,
    pub(crate) host: Host,
}

impl Default for Usb {
    fn default() -> Self {
        Usb {
            written: RESET.into(),
            enumerated: false,
            flags: 0,
            ins: Default::default(),
            outs: Default::default(),
            receive: VecDeque::new(),
            data: VecDeque::new(),
            in_setup: false,
            connected: false,
            misuse: false,
            host: Host::default(),
        }
    }
}

impl Usb {
    /// Resets the controller with the chip. The host stays, and sees the device disappear.
    pub(crate) fn reset(&mut self, now: u64) {
        let mut host = core::mem::take(&mut self.host);
        host.device_gone(now);
        *self = Usb {
            host,
            connected: self.connected,
            ..Usb::default()
        };
    }

    /// Returns true if the controller requests its interrupt.
    pub(crate) fn interrupt(&self) -> bool {
        self.plain(0x08) & GINT != 0 && self.status() & self.plain(0x18) != 0
    }

    /// Returns true if the transceiver is on.
    pub(crate) fn is_on(&self) -> bool {
        self.plain(0x38) & PWRDWN != 0
    }

    /// Returns true if the host sees a device: transceiver and pull-up are on, and both lines are
    /// connected.
    fn is_attached(&self) -> bool {
        self.connected && self.is_on() && self.plain(0x804) & SDIS == 0
    }

    fn plain(&self, offset: u32) -> u32 {
        self.written.get(&offset).copied().unwrap_or(0)
    }

    /// The value of GINTSTS.
    fn status(&self) -> u32 {
        let mut status = self.flags | HOST_FIFOS_EMPTY;
        if !self.receive.is_empty() {
            status |= RXFLVL;
        }
        if self.daint() & self.plain(0x81C) != 0 {
            status |= IEPINT;
        }
        status
    }

    /// The value of DAINT: the IN endpoints with a flag that DIEPMSK does not mask.
    fn daint(&self) -> u32 {
        let mask = self.plain(0x810);
        let ins = self.ins.iter().enumerate();
        ins.fold(0, |all, (index, endpoint)| {
            all | u32::from(endpoint.registers.flags & mask != 0) << index
        })
    }

    /// Reads the register at `offset` from 0x50000000.
    pub(crate) fn read(&mut self, offset: u32) -> u32 {
        match offset {
            0x10 => IDLE | self.plain(offset),
            0x14 => self.status(),
            0x1C => self.receive.front().map_or(0, |entry| entry.status),
            0x20 => self.pop_entry(),
            0x3C => PRODUCT,
            0x808 if self.enumerated => FULL_SPEED,
            0x808 => 0,
            0x818 => self.daint(),
            0x900..=0x97F => {
                let (index, register) = endpoint::place(offset - 0x900);
                let depth = self.transmit_depth(index);
                self.ins[index].read(register, depth)
            }
            0xB00..=0xB7F => {
                let (index, register) = endpoint::place(offset - 0xB00);
                let active = if offset == 0xB00 { endpoint::USBAEP } else { 0 };
                self.outs[index].registers.read(register) | active
            }
            0x1000..=0x1FFF => self.pop_word(),
            _ => self.plain(offset),
        }
    }

    /// Writes the register at `offset` from 0x50000000.
    pub(crate) fn write(&mut self, offset: u32, value: u32) {
        match offset {
            0x10 => {
                self.reset_parts(value);
                self.written.insert(offset, value & !(SELF_CLEARING | IDLE));
            }
            0x14 => self.flags &= !(value & CLEARED),
            0x900..=0x97F => {
                let (index, register) = endpoint::place(offset - 0x900);
                self.ins[index].registers.write(index, register, value);
            }
            0xB00..=0xB7F => {
                let (index, register) = endpoint::place(offset - 0xB00);
                // OUT endpoint 0 cannot be disabled (section 34.16.4).
                let fixed = if offset == 0xB00 { endpoint::EPDIS } else { 0 };
                self.outs[index]
                    .registers
                    .write(index, register, value & !fixed);
            }
            0x1000..=0x4FFF => {
                let index = (offset >> 12) as usize - 1;
                self.ins[index].fifo.extend(value.to_le_bytes());
                // The endpoint is enabled before its data are written (section 34.17.6).
                self.misuse |= !self.ins[index].registers.is_enabled();
                self.misuse |= !self.has_good_fifo(index);
            }
            _ => {
                self.written.insert(offset, value);
            }
        }
    }

    fn reset_parts(&mut self, value: u32) {
        if value & CSRST != 0 {
            self.soft_reset();
        }
        if value & (RXFFLSH | CSRST) != 0 {
            self.receive.clear();
            self.data.clear();
        }
        if value & TXFFLSH != 0 {
            let number = value >> 6 & 0x1F;
            for (index, endpoint) in (0..).zip(&mut self.ins) {
                if number == ALL_FIFOS || number == index {
                    endpoint.fifo.clear();
                }
            }
        }
    }

    /// The program resets the controller: the speed (DCFG.DSPD) and PCGCCTL stay (section 34.16.2,
    /// GRSTCTL).
    fn soft_reset(&mut self) {
        let kept = [(0x800, DSPD), (0xE00, u32::MAX)];
        let kept = kept.map(|(offset, bits)| (offset, self.plain(offset) & bits));
        let host = core::mem::take(&mut self.host);
        *self = Usb {
            host,
            connected: self.connected,
            misuse: self.misuse,
            ..Usb::default()
        };
        self.written.extend(kept);
    }

    fn pop_entry(&mut self) -> u32 {
        // Data of the previous entry that are not read yet would be taken for this entry's data.
        self.misuse |= !self.data.is_empty();
        let Some(entry) = self.receive.pop_front() else {
            self.misuse = true;
            return 0;
        };
        let out = &mut self.outs[entry.status as usize & 0xF].registers;
        match entry.status >> 17 & 0xF {
            SETUP_COMPLETE => out.end_setup(),
            OUT_COMPLETE => out.end_transfer(),
            _ => {}
        }
        self.data = entry.data.into();
        entry.status
    }

    fn pop_word(&mut self) -> u32 {
        self.misuse |= self.data.is_empty();
        (0..4).fold(0, |word, place| {
            let byte = self.data.pop_front().unwrap_or(0);
            word | u32::from(byte) << (8 * place)
        })
    }

    /// Returns true if the program has used a FIFO in a wrong way since the last call.
    pub(crate) fn take_misuse(&mut self) -> bool {
        core::mem::take(&mut self.misuse)
    }

    /// The words of an endpoint's transmit FIFO, from DIEPTXF0, DIEPTXF1 and so on.
    fn transmit_depth(&self, index: usize) -> usize {
        self.transmit_place(index).len()
    }

    /// The place of an endpoint's transmit FIFO in the memory, in words.
    fn transmit_place(&self, index: usize) -> Range<usize> {
        let offset = match index {
            0 => 0x28,
            _ => 0x100 + 4 * index as u32,
        };
        let register = self.plain(offset);
        let start = (register & 0xFFFF) as usize;
        start..start + (register >> 16) as usize
    }

    /// Returns true if an endpoint's data fit into its transmit FIFO, and whether that FIFO is
    /// within the memory, behind the receive FIFO, and apart from the FIFOs of other active
    /// endpoints (section 34.13.1).
    fn has_good_fifo(&self, index: usize) -> bool {
        let place = self.transmit_place(index);
        let is_apart = |other: usize| {
            let active = other == 0 || self.ins[other].registers.control & endpoint::USBAEP != 0;
            let theirs = self.transmit_place(other);
            other == index || !active || theirs.end <= place.start || place.end <= theirs.start
        };
        let receive = self.plain(0x24) as usize;
        self.ins[index].fifo.len() <= 4 * place.len()
            && DEPTHS.contains(&place.len())
            && DEPTHS.contains(&receive)
            && place.start >= receive
            && place.end <= MEMORY
            && (0..ENDPOINTS).all(is_apart)
    }

    /// Returns true if the receive FIFO has room for a packet of data of this number of bytes.
    fn has_room(&self, bytes: usize) -> bool {
        let is_data =
            |entry: &&Entry| !matches!(entry.status >> 17 & 0xF, SETUP_DATA | SETUP_COMPLETE);
        let used: usize = self.receive.iter().filter(is_data).map(Entry::words).sum();
        // The entry for the end of the transfer needs room, too.
        used + 2 + bytes.div_ceil(4) + SETUP_ROOM <= self.plain(0x24) as usize
    }

    fn has_address(&self, address: u8) -> bool {
        self.plain(0x800) >> 4 & 0x7F == u32::from(address)
    }

    // The tokens of the host.

    /// The host resets the device: its endpoints other than 0 are no longer active.
    fn bus_reset(&mut self) {
        self.flags |= USBRST;
        self.in_setup = false;
        for index in 1..ENDPOINTS {
            self.ins[index].registers.deactivate();
            self.outs[index].registers.deactivate();
        }
    }

    /// The host has ended the reset: the speed is known.
    fn bus_ready(&mut self) {
        self.enumerated = true;
        self.flags |= ENUMDNE;
    }

    /// The line has been silent for so long that the controller is suspended.
    fn bus_idle(&mut self) {
        self.flags |= USBSUSP;
    }

    /// A SETUP token: the device with this address always accepts it.
    fn setup(&mut self, address: u8, request: &[u8; 8]) -> Answer {
        if !self.has_address(address) {
            return Answer::Nothing;
        }
        self.ins[0].registers.begin_request();
        self.outs[0].registers.begin_request();
        self.receive.push_back(Entry::new(0, SETUP_DATA, request));
        self.in_setup = true;
        Answer::Ack(Vec::new())
    }

    /// A token that is not SETUP ends the SETUP stage of endpoint 0.
    fn end_setup(&mut self, endpoint: usize) {
        if endpoint == 0 && core::mem::take(&mut self.in_setup) {
            self.receive.push_back(Entry::new(0, SETUP_COMPLETE, &[]));
        }
    }

    /// An OUT token. Endpoint 0 goes on with its request even if the address changes in between.
    fn out(&mut self, address: u8, endpoint: usize, data: &[u8]) -> Answer {
        if endpoint != 0 && !self.has_address(address) {
            return Answer::Nothing;
        }
        self.end_setup(endpoint);
        let room = self.has_room(data.len());
        let out = &mut self.outs[endpoint];
        if let Some(refusal) = out.registers.refusal(endpoint) {
            return refusal;
        }
        if !room {
            return Answer::Nak;
        }
        self.receive.push_back(Entry::new(endpoint, OUT_DATA, data));
        if out.take(endpoint, data.len()) {
            self.receive
                .push_back(Entry::new(endpoint, OUT_COMPLETE, &[]));
        }
        Answer::Ack(Vec::new())
    }

    /// An IN token. Endpoint 0 goes on with its request even if the address changes in between.
    fn r#in(&mut self, address: u8, endpoint: usize) -> Answer {
        if endpoint != 0 && !self.has_address(address) {
            return Answer::Nothing;
        }
        self.end_setup(endpoint);
        self.ins[endpoint].packet(endpoint)
    }
}

/// Returns true if everything that a value asks of the register at `offset` is modelled.
pub(crate) fn is_modelled(offset: u32, value: u32) -> bool {
    const WKUPINT: u32 = 1 << 31;
    const INTERRUPTS: u32 = RXFLVL | USBSUSP | USBRST | ENUMDNE | IEPINT | WKUPINT;
    const HOST_MODE: u32 = 1 << 29;
    /// OTG_FS_DCTL: remote wake-up, test modes, global NAKs.
    const CONTROLS: u32 = 0x2F1;
    let isochronous = value >> 18 & 3 == 1;
    match offset {
        0x00C => value & HOST_MODE == 0,
        0x018 => value & !INTERRUPTS == 0,
        0x804 => value & CONTROLS == 0,
        0x810 => value & !3 == 0,
        // DIEPEMPMSK, and PCGCCTL, which stops clocks.
        0x834 | 0xE00 => value == 0,
        0x920 | 0x940 | 0x960 | 0xB20 | 0xB40 | 0xB60 => !isochronous,
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A controller as a driver leaves it after a reset of the bus: address 5, endpoint 0 and a
    /// bulk pair 1 of 64 bytes.
    fn ready() -> Usb {
        let mut usb = Usb::default();
        for (offset, value) in [
            (0x08, GINT),
            (0x18, RXFLVL | IEPINT),
            (0x24, 62),
            (0x28, 16 << 16 | 62),
            (0x104, 16 << 16 | 78),
            (0x800, 5 << 4),
            (0x810, 1),
            (0x81C, 0b11),
            (0xB00, 1 << 31 | 1 << 26),
            (0x920, 1 << 27 | 1 << 15 | 64),
            (0xB20, 1 << 31 | 1 << 26 | 1 << 15 | 64),
        ] {
            usb.write(offset, value);
        }
        usb
    }

    #[test]
    fn a_driver_that_waits_for_a_reset_goes_on() {
        let mut usb = Usb::default();
        assert_eq!(usb.read(0x10), IDLE);
        usb.write(0x10, 1 | 1 << 4 | 1 << 5 | 0x10 << 6);
        assert_eq!(usb.read(0x10), IDLE | 0x10 << 6);
    }

    #[test]
    fn a_packet_that_comes_is_announced_read_and_complete() {
        let mut usb = ready();
        assert_eq!(usb.out(5, 1, b"G0X1\n"), Answer::Ack(vec![]));
        assert!(usb.interrupt());
        assert_eq!(usb.read(0x1C), 1 | 5 << 4 | OUT_DATA << 17);
        assert_eq!(usb.read(0x20), 1 | 5 << 4 | OUT_DATA << 17);
        assert_eq!(usb.read(0x1000), u32::from_le_bytes(*b"G0X1"));
        assert_eq!(usb.read(0x1000), u32::from(b'\n'));
        assert_eq!(usb.read(0x20), 1 | OUT_COMPLETE << 17);
        assert!(!usb.interrupt());
        assert_eq!(usb.out(5, 1, b"?"), Answer::Nak, "not enabled again");
        usb.write(0xB20, 1 << 31 | 1 << 26 | 1 << 15 | 64);
        assert_eq!(usb.out(5, 1, b"?"), Answer::Ack(vec![]));
        assert_eq!(usb.out(6, 1, b"?"), Answer::Nothing, "another device");
    }

    #[test]
    fn a_transfer_has_ended_when_the_program_has_read_so() {
        let mut usb = ready();
        usb.write(0xB30, 2 << 19 | 128);
        usb.out(5, 1, b"?");
        assert_eq!(
            usb.out(5, 1, b"!"),
            Answer::Nak,
            "a short packet is the last one"
        );
        usb.write(0xB20, 1 << 31 | 1 << 26 | 1 << 15 | 64);
        usb.read(0x20);
        usb.read(0x1000);
        assert_eq!((usb.read(0xB20) >> 31, usb.read(0xB28)), (1, 0));
        assert_eq!(usb.read(0x20), 1 | OUT_COMPLETE << 17);
        assert_eq!((usb.read(0xB20) >> 31, usb.read(0xB28)), (0, 1));
        assert_eq!(usb.out(5, 1, b"!"), Answer::Nak, "enabled too early");
    }

    #[test]
    fn out_endpoint_0_cannot_be_disabled() {
        let mut usb = ready();
        usb.write(0xB00, 1 << 30);
        assert_eq!((usb.read(0xB00) >> 31, usb.read(0xB08)), (1, 0));
    }

    #[test]
    fn a_full_receive_fifo_takes_no_packet() {
        let mut usb = ready();
        usb.write(0x24, 30);
        assert_eq!(usb.out(5, 1, &[b'X'; 64]), Answer::Ack(vec![]));
        usb.write(0xB20, 1 << 31 | 1 << 26 | 1 << 15 | 64);
        assert_eq!(usb.out(5, 1, b"?"), Answer::Nak);
        assert_eq!(usb.setup(5, &[0; 8]), Answer::Ack(vec![]), "has its own");
    }

    #[test]
    fn a_packet_goes_once_it_is_whole_and_its_end_is_announced() {
        let mut usb = ready();
        assert_eq!(usb.r#in(5, 1), Answer::Nak);
        usb.write(0x930, 1 << 19 | 4);
        usb.write(0x920, usb.ins[1].registers.control | 1 << 31 | 1 << 26);
        assert_eq!(usb.r#in(5, 1), Answer::Nak, "the FIFO is empty");
        assert_eq!(usb.read(0x938), 16);
        usb.write(0x2000, u32::from_le_bytes(*b"ok\r\n"));
        assert_eq!(usb.read(0x938), 15);
        assert!(!usb.interrupt());
        assert_eq!(usb.r#in(5, 1), Answer::Ack(b"ok\r\n".to_vec()));
        assert!(usb.interrupt());
        usb.write(0x928, 1);
        assert!(!usb.interrupt());
        assert_eq!(usb.r#in(5, 1), Answer::Nak);
    }

    #[test]
    fn a_request_is_taken_by_the_device_that_has_the_address_and_ends_a_stall() {
        let mut usb = ready();
        let request = [0x80, 6, 0, 1, 0, 0, 64, 0];
        usb.write(0x900, 1 << 21);
        assert_eq!(usb.r#in(5, 0), Answer::Stall);
        assert_eq!(usb.setup(0, &request), Answer::Nothing);
        assert_eq!(usb.setup(5, &request), Answer::Ack(vec![]));
        assert_eq!(usb.read(0x20), 8 << 4 | SETUP_DATA << 17);
        assert_eq!(usb.r#in(5, 0), Answer::Nak);
    }

    #[test]
    fn the_end_of_a_setup_stage_comes_with_the_next_token_and_disables_out_endpoint_0() {
        let mut usb = ready();
        usb.setup(5, &[0; 8]);
        usb.read(0x20);
        usb.read(0x1000);
        usb.read(0x1000);
        assert_eq!(usb.read(0x14) & RXFLVL, 0);
        usb.r#in(5, 0);
        assert_eq!(usb.read(0xB00) >> 31, 1);
        assert_eq!(usb.read(0x20), SETUP_COMPLETE << 17);
        assert_eq!(usb.read(0xB00) >> 31, 0);
        assert!(!usb.take_misuse());
    }

    #[test]
    fn a_reset_of_the_bus_leaves_endpoint_0_alone_active() {
        let mut usb = ready();
        usb.bus_reset();
        let active = |usb: &mut Usb, offset| usb.read(offset) & endpoint::USBAEP != 0;
        assert!(active(&mut usb, 0xB00));
        assert!(!active(&mut usb, 0x920) && !active(&mut usb, 0xB20));
    }

    #[test]
    fn only_a_request_ends_the_stall_of_endpoint_0() {
        let mut usb = ready();
        usb.write(0x900, 1 << 21);
        usb.write(0x900, 0);
        assert_eq!(usb.r#in(5, 0), Answer::Stall);
        usb.write(0x920, 1 << 21 | 1 << 15 | 64);
        usb.write(0x920, 1 << 15 | 64);
        assert_eq!(usb.r#in(5, 1), Answer::Nak);
    }

    #[test]
    fn an_endpoint_that_is_not_enabled_has_nothing_to_disable() {
        let mut usb = ready();
        usb.write(0x920, 1 << 30 | 1 << 15 | 64);
        assert_eq!(usb.read(0x928) & 2, 0);
        usb.write(0x920, 1 << 31 | 1 << 15 | 64);
        usb.write(0x920, 1 << 30 | 1 << 15 | 64);
        assert_eq!(usb.read(0x928) & 2, 2);
    }

    #[test]
    fn wrong_uses_of_fifos_are_noticed() {
        let misuse = |setup: &[(u32, u32)], words: usize| {
            let mut usb = ready();
            usb.write(0x920, 1 << 31 | 1 << 26 | 1 << 15 | 64);
            for &(offset, value) in setup {
                usb.write(offset, value);
            }
            for _ in 0..words {
                usb.write(0x2000, 0);
            }
            usb.take_misuse()
        };
        assert!(!misuse(&[], 16));
        assert!(misuse(&[], 17), "overflow");
        assert!(misuse(&[(0x104, 16 << 16 | 77)], 1), "overlaps another");
        assert!(misuse(&[(0x24, 79)], 1), "overlaps the receive FIFO");
        assert!(misuse(&[(0x104, 16 << 16 | 305)], 1), "beyond the memory");
        assert!(misuse(&[(0x104, 15 << 16 | 78)], 1), "less than 16 words");
        assert!(misuse(&[(0x920, 1 << 30 | 1 << 15 | 64)], 1), "not enabled");
        for offset in [0x20, 0x1000] {
            let mut usb = ready();
            usb.read(offset);
            assert!(usb.take_misuse(), "empty");
        }
        let mut usb = ready();
        usb.out(5, 1, b"G0X1\n");
        usb.read(0x20);
        usb.read(0x1000);
        usb.read(0x20);
        assert!(usb.take_misuse(), "a word was left");
    }

    #[test]
    fn a_soft_reset_resets_the_registers_but_the_speed() {
        let mut usb = ready();
        usb.write(0x38, PWRDWN);
        usb.write(0x800, DSPD | 5 << 4);
        usb.write(0x10, CSRST);
        let left = [0x18, 0x38, 0x800, 0x81C].map(|offset| usb.read(offset));
        assert_eq!(left, [0, 0, DSPD, 0]);
        assert_eq!(usb.read(0x24), 0x200);
        assert_eq!(usb.read(0x10), IDLE);
    }
}
