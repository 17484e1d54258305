//! A serial device (CDC-ACM) on OTG FS, PA11 and PA12 (RM0090 chapter 34).
//!
//! ```text
//!   host -> packet -> interrupt -> Receiver -> main loop
//!                                  Realtime bytes are picked out, all others are queued.
//!   host <- packet <- interrupt <- queue of bytes to send <- main loop: Writer
//! ```
//!
//! A packet is always taken, so that a realtime byte never waits behind a full buffer. A sender
//! counts the bytes that it has sent, or waits for each answer, as on any line of Grbl. DTR tells
//! that a program has opened the port; the baud rate that the host sets is ignored.
//!
//! A host that does not read stops nothing else: the queue fills, the machine takes no more lines
//! from this host, and the other line goes on. Without a host, bytes are dropped, except for the
//! first kilobyte after power-up. That kilobyte holds the banner, which the first host reads.
//!
//! This code has run in the emulator (`cargo fw-test usb`), but never on a board.
use core::{
    mem::MaybeUninit,
    sync::atomic::{AtomicBool, AtomicU8, Ordering::Relaxed},
};
use heapless::{
    spsc::{Consumer, Producer},
    Vec,
};
use leadscrew_machine::protocol::serial::Receiver;
use stm32f4::stm32f407::{OTG_FS_DEVICE, OTG_FS_GLOBAL, OTG_FS_PWRCLK};
use stm32f4xx_hal::rcc::{Enable, Reset};
use synopsys_usb_otg::{UsbBus, UsbPeripheral};
use usb_device::{
    bus::UsbBusAllocator,
    device::{StringDescriptors, UsbDevice, UsbDeviceBuilder, UsbDeviceState, UsbVidPid},
};
use usbd_serial::{CdcAcmClass, USB_CLASS_CDC};

/// Largest packet of a full-speed bulk endpoint in bytes (USB 2.0 section 5.8.3).
const PACKET: usize = 64;
/// Bytes in a packet that is sent. A full packet would have to be followed by an empty one (USB 2.0
/// section 5.8.3).
const SENT: usize = PACKET - 1;
/// Vendor and product ID: the pair that the makers of V-USB share for serial devices
/// (USB-IDs-for-free.txt). Devices with this pair are told apart by their texts. Anybody who sells
/// boards has to use another pair.
const ID: UsbVidPid = UsbVidPid(0x16C0, 0x27DD);

/// The state of the host at the other end: a [`Host`], as the interrupt knows it.
static HOST: AtomicU8 = AtomicU8::new(Host::Expected as u8);

/// The main loop has more bytes to send than there was room for, and wants to be woken.
static MORE: AtomicBool = AtomicBool::new(false);

/// The state of the host at the other end.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
enum Host {
    /// No host has come since power-up: bytes to send wait for the first one.
    Expected,
    /// A host has configured the device.
    Attached,
    /// A host was there and has left.
    Gone,
}

impl Host {
    fn now() -> Self {
        let known = [Self::Expected, Self::Attached, Self::Gone];
        let number = HOST.load(Relaxed);
        let host = known.into_iter().find(|host| *host as u8 == number);
        host.unwrap_or(Self::Gone)
    }
}

/// The controller's registers.
pub type Registers = (OTG_FS_GLOBAL, OTG_FS_DEVICE, OTG_FS_PWRCLK);

/// The controller's parameters for the driver.
struct Controller {
    _registers: Registers,
    cpu_hz: u32,
}

// SAFETY: the driver owns the registers, and accesses them in critical sections only.
#[allow(unsafe_code)]
unsafe impl Sync for Controller {}

// SAFETY: OTG FS has this address, this size of packet memory and this number of endpoints (RM0090
// sections 2.3, 34.2.1 and 34.2.3).
#[allow(unsafe_code)]
unsafe impl UsbPeripheral for Controller {
    const REGISTERS: *const () = OTG_FS_GLOBAL::ptr().cast();
    const HIGH_SPEED: bool = false;
    const FIFO_DEPTH_WORDS: usize = 320;
    const ENDPOINT_COUNT: usize = 4;

    fn enable() {
        // SAFETY: runs at start-up, before the interrupts are on, so that nothing else changes the
        // clocks.
        unsafe {
            OTG_FS_GLOBAL::enable_unchecked();
            OTG_FS_GLOBAL::reset_unchecked();
        }
    }

    fn ahb_frequency_hz(&self) -> u32 {
        self.cpu_hz
    }
}

type Bus = UsbBus<Controller>;

/// Digits of a unique number.
const SERIAL: usize = 24;

/// A number of 96 bits in hexadecimal digits, the highest word and the highest digit first.
fn digits(unique: [u32; 3]) -> [u8; SERIAL] {
    let words = unique.into_iter().rev();
    let values = words.flat_map(|word| (0..8).rev().map(move |digit| word >> (4 * digit) & 0xF));
    let mut text = [b'0'; SERIAL];
    for (place, value) in text.iter_mut().zip(values) {
        *place += if value < 10 {
            value as u8
        } else {
            value as u8 + 7
        };
    }
    text
}

/// The memory of the line.
pub struct Place {
    /// Packets that have not been read yet: two endpoints of 64 bytes, in words.
    packets: [u32; 2 * PACKET / 4],
    /// This is uninitialised in place of `None`: `None` is not all zeros, and would add a kilobyte
    /// to the program's image.
    bus: MaybeUninit<UsbBusAllocator<Bus>>,
    port: MaybeUninit<Port>,
    /// The chip's unique number, in hexadecimal digits.
    serial: [u8; SERIAL],
}

impl Default for Place {
    fn default() -> Self {
        Self::new()
    }
}

impl Place {
    /// Makes memory that is not in use yet.
    pub const fn new() -> Self {
        Self {
            packets: [0; 2 * PACKET / 4],
            bus: MaybeUninit::uninit(),
            port: MaybeUninit::uninit(),
            serial: [0; SERIAL],
        }
    }

    /// Starts the line. To be called at start-up, with the clock of 48 MHz running and the pins
    /// connected to the controller. `cpu_hz` is the clock of the CPU, and `unique` the chip's
    /// number, from which the host makes a name that stays.
    ///
    /// `None` if the driver refuses these values, which never happens.
    #[inline(never)] // values that are moved are on the stack only during this call
    pub fn start(
        &'static mut self,
        registers: Registers,
        cpu_hz: u32,
        unique: [u32; 3],
        receiver: Receiver<'static>,
        outgoing: Consumer<'static, u8>,
    ) -> Option<&'static mut Port> {
        self.serial = digits(unique);
        let controller = Controller {
            _registers: registers,
            cpu_hz,
        };
        let bus = UsbBus::new(controller, &mut self.packets);
        let serial = core::str::from_utf8(&self.serial).unwrap_or_default();
        let port = Port::new(self.bus.write(bus), serial, receiver, outgoing)?;
        Some(self.port.write(port))
    }
}

/// The interrupt's end of the line.
pub struct Port {
    device: UsbDevice<'static, Bus>,
    class: CdcAcmClass<'static, Bus>,
    receiver: Receiver<'static>,
    outgoing: Consumer<'static, u8>,
    /// The packet that is to be sent next.
    packet: Vec<u8, SENT>,
    /// True if a program has the port open, as DTR tells.
    open: bool,
}

impl Port {
    /// Connects to the host, if there is one.
    fn new(
        bus: &'static UsbBusAllocator<Bus>,
        serial: &'static str,
        receiver: Receiver<'static>,
        outgoing: Consumer<'static, u8>,
    ) -> Option<Self> {
        // The order matters: the class takes its endpoints, then the device starts.
        let class = CdcAcmClass::new(bus, PACKET as u16);
        let texts = StringDescriptors::default()
            .manufacturer("leadscrew")
            .product("leadscrew motion control")
            .serial_number(serial);
        let device = UsbDeviceBuilder::new(bus, ID)
            .device_class(USB_CLASS_CDC)
            .self_powered(true)
            .max_packet_size_0(PACKET as u8)
            .and_then(|builder| builder.strings(&[texts]));
        Some(Self {
            device: device.ok()?.build(),
            class,
            receiver,
            outgoing,
            packet: Vec::new(),
            open: false,
        })
    }

    /// Takes received bytes and sends queued ones. Returns whether the main loop has something to
    /// do: bytes have come, there is room for bytes that it could not queue, a program has opened
    /// the port, or the host has left. Called in the interrupt of OTG FS, which the main loop also
    /// pends when it has queued bytes.
    #[inline(never)]
    pub fn on_interrupt(&mut self) -> bool {
        self.device.poll(&mut [&mut self.class]);
        if self.device.state() == UsbDeviceState::Configured {
            HOST.store(Host::Attached as u8, Relaxed);
            self.send();
            let opened = self.opens();
            self.receive() || self.takes_more() || opened
        } else {
            self.open = false;
            let leaves = Host::now() == Host::Attached;
            if leaves {
                HOST.store(Host::Gone as u8, Relaxed);
                self.forget();
                self.receiver.close();
            }
            leaves
        }
    }

    /// Returns true if a program has opened the port since the last call.
    fn opens(&mut self) -> bool {
        let was_open = core::mem::replace(&mut self.open, self.class.dtr());
        let opens = self.open && !was_open;
        if opens {
            self.receiver.open();
        }
        opens
    }

    /// Takes at most the one packet that the driver holds; the driver takes the next one in the
    /// next interrupt.
    fn receive(&mut self) -> bool {
        let mut packet = [0; PACKET];
        let Ok(length) = self.class.read_packet(&mut packet) else {
            return false;
        };
        for byte in packet.iter().take(length) {
            self.receiver.receive(*byte);
        }
        true
    }

    /// Sends one packet. While the packet before it is still under way, nothing is sent: the
    /// interrupt at its end calls this again.
    fn send(&mut self) {
        while !self.packet.is_full() {
            match self.outgoing.dequeue() {
                // The loop has checked that there is room.
                Some(byte) => drop(self.packet.push(byte)),
                None => break,
            }
        }
        if !self.packet.is_empty() && self.class.write_packet(&self.packet).is_ok() {
            self.packet.clear();
        }
    }

    /// Returns true if the main loop had more bytes to queue, and half of the queue is free. The
    /// other half is sent while the main loop wakes up.
    fn takes_more(&self) -> bool {
        MORE.load(Relaxed) && self.outgoing.len() <= self.outgoing.capacity() / 2
    }

    /// Drops all bytes that wait to be sent, since nobody reads them any more.
    fn forget(&mut self) {
        self.packet.clear();
        while self.outgoing.dequeue().is_some() {}
    }
}

/// The main loop's end of the line.
pub struct Writer {
    outgoing: Producer<'static, u8>,
}

impl Writer {
    /// Makes a writer that queues bytes in `outgoing`.
    pub fn new(outgoing: Producer<'static, u8>) -> Self {
        Self { outgoing }
    }

    /// Takes as many of `bytes` as there is room for; all of them if there is no host to read them.
    /// Called by the main loop, which then pends the interrupt.
    pub fn write(&mut self, bytes: &[u8]) -> usize {
        match Host::now() {
            Host::Expected => {
                self.queue(bytes);
                bytes.len()
            }
            Host::Attached => self.queue(bytes),
            Host::Gone => bytes.len(),
        }
    }

    fn queue(&mut self, bytes: &[u8]) -> usize {
        let fits = |byte: &&u8| self.outgoing.enqueue(**byte).is_ok();
        let taken = bytes.iter().take_while(fits).count();
        MORE.store(taken < bytes.len(), Relaxed);
        taken
    }
}
