//! A serial device (CDC-ACM) on OTG FS, PA11 and PA12 (RM0090 chapter 34).
//!
//! ```text
//!   host -> packet -> interrupt -> Receiver: realtime bytes picked out, all others queued -> main loop
//!   host <- packet <- interrupt <- queue of bytes to send                                 <- main loop: Writer
//! ```
//!
//! A packet is always taken, so that a realtime byte never waits behind a full buffer: a sender
//! counts what it has sent, or waits for each answer, as on any line of Grbl's. DTR says that a
//! program has come; the rate that the host sets means nothing.
//!
//! A host that does not read stops nobody: the queue fills, then the machine takes no more lines
//! from it, the other line goes on. Without a host bytes go nowhere, but for the first kilobyte
//! after power-up, the banner: whoever comes first reads that.
//!
//! Run in the emulator (`cargo fw-test usb`), never on a board.
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
/// Bytes in a packet that is sent: a full one would have to be followed by an empty one (USB 2.0
/// section 5.8.3).
const SENT: usize = PACKET - 1;
/// The pair that V-USB's makers share for serial devices told apart by their texts
/// (USB-IDs-for-free.txt). Whoever sells boards takes one of his own.
const ID: UsbVidPid = UsbVidPid(0x16C0, 0x27DD);

/// Who is at the other end: a [`Host`], as the interrupt knows it.
static HOST: AtomicU8 = AtomicU8::new(Host::Expected as u8);

/// The main loop has more than there was room for: it wants to be woken.
static MORE: AtomicBool = AtomicBool::new(false);

/// Who is at the other end.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
enum Host {
    /// Nobody since power-up: bytes to send wait for the first client.
    Expected,
    /// It has set the device up.
    Attached,
    /// It has been there.
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

/// The controller as the driver knows it.
struct Controller {
    _registers: Registers,
    cpu_hz: u32,
}

// SAFETY: the driver owns the registers, and touches them in critical sections only.
#[allow(unsafe_code)]
unsafe impl Sync for Controller {}

// SAFETY: address, size of the packet memory and number of endpoints belong to OTG FS (RM0090
// sections 2.3, 34.2.1 and 34.2.3).
#[allow(unsafe_code)]
unsafe impl UsbPeripheral for Controller {
    const REGISTERS: *const () = OTG_FS_GLOBAL::ptr().cast();
    const HIGH_SPEED: bool = false;
    const FIFO_DEPTH_WORDS: usize = 320;
    const ENDPOINT_COUNT: usize = 4;

    fn enable() {
        // SAFETY: at start-up, before the interrupts are on: nobody else changes the clocks.
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

/// Where the line is kept.
pub struct Place {
    /// Packets until they are read: two endpoints of 64 bytes, in words.
    packets: [u32; 2 * PACKET / 4],
    /// Uninitialised, not `None`, which is not all zeros and would be a kilobyte of the program's
    /// image.
    bus: MaybeUninit<UsbBusAllocator<Bus>>,
    port: MaybeUninit<Port>,
}

impl Default for Place {
    fn default() -> Self {
        Self::new()
    }
}

impl Place {
    /// Nothing yet.
    pub const fn new() -> Self {
        Self {
            packets: [0; 2 * PACKET / 4],
            bus: MaybeUninit::uninit(),
            port: MaybeUninit::uninit(),
        }
    }

    /// Starts the line. At start-up, with the clock of 48 MHz running, and the pins the
    /// controller's; `cpu_hz` is the clock of the CPU.
    ///
    /// `None` where the driver refuses these values, which never happens.
    #[inline(never)] // what is moved on the way is on the stack for this long only
    pub fn start(
        &'static mut self,
        registers: Registers,
        cpu_hz: u32,
        receiver: Receiver<'static>,
        outgoing: Consumer<'static, u8>,
    ) -> Option<&'static mut Port> {
        let controller = Controller {
            _registers: registers,
            cpu_hz,
        };
        let bus = UsbBus::new(controller, &mut self.packets);
        let port = Port::new(self.bus.write(bus), receiver, outgoing)?;
        Some(self.port.write(port))
    }
}

/// The interrupt's end of the line.
pub struct Port {
    device: UsbDevice<'static, Bus>,
    class: CdcAcmClass<'static, Bus>,
    receiver: Receiver<'static>,
    outgoing: Consumer<'static, u8>,
    /// The packet that is sent next.
    packet: Vec<u8, SENT>,
    /// A program has the port open, as DTR says.
    open: bool,
}

impl Port {
    /// Connects to the host, if there is one.
    fn new(
        bus: &'static UsbBusAllocator<Bus>,
        receiver: Receiver<'static>,
        outgoing: Consumer<'static, u8>,
    ) -> Option<Self> {
        // In this order: the class takes its endpoints, then the device starts.
        let class = CdcAcmClass::new(bus, PACKET as u16);
        let texts = StringDescriptors::default()
            .manufacturer("leadscrew")
            .product("leadscrew motion control");
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

    /// Takes what has come, sends what there is; says whether the main loop has something to do:
    /// bytes have come, there is room for what it could not queue, or nobody is there any more who
    /// would read it. Interrupt of OTG FS, or pended by whoever has queued bytes.
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

    /// Whether a program has opened the port since this was asked last.
    fn opens(&mut self) -> bool {
        let was_open = core::mem::replace(&mut self.open, self.class.dtr());
        let opens = self.open && !was_open;
        if opens {
            self.receiver.open();
        }
        opens
    }

    /// At most the packet that the driver holds: it takes the next one in the next interrupt.
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

    /// One packet; where the one before is still under way, the interrupt at its end comes here
    /// again.
    fn send(&mut self) {
        while !self.packet.is_full() {
            match self.outgoing.dequeue() {
                // There is room.
                Some(byte) => drop(self.packet.push(byte)),
                None => break,
            }
        }
        if !self.packet.is_empty() && self.class.write_packet(&self.packet).is_ok() {
            self.packet.clear();
        }
    }

    /// Whether more was to be queued, and half of the queue is free: the queued bytes go out while
    /// the main loop comes.
    fn takes_more(&self) -> bool {
        MORE.load(Relaxed) && self.outgoing.len() <= self.outgoing.capacity() / 2
    }

    /// Nobody reads on.
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
    /// Sends bytes by way of `outgoing`.
    pub fn new(outgoing: Producer<'static, u8>) -> Self {
        Self { outgoing }
    }

    /// Takes as many of `bytes` as there is room for; all, where there is nobody to read them. Main
    /// loop, which then pends the interrupt.
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
