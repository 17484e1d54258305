//! Puts the machine on the board: start-up, the calls of each interrupt, and the main loop.
use crate::{
    board::F407,
    chip,
    clock::{self, Clock, Source},
    fast_memory,
    profile::{self, config, kinematics, own, Kinematics, Own, AXES, MOTORS, MOVES},
    pwm, registers, restart,
    serial::{self, Listener, Sender, Writer},
    settings_flash::Sectors,
    step_interrupt::{self, SHARED},
    step_port, supply,
    switches::{self, Filter},
    watchdog,
};
use core::{iter, mem::MaybeUninit};
use cortex_m::peripheral::NVIC;
use defmt_rtt as _;
use heapless::spsc::Queue;
use leadscrew_f407_usb as usb;
use leadscrew_machine::{
    board::Duration,
    config::{self, MoveQueues, SegmentQueue},
    inputs::Inputs,
    machine::{Links, Machine},
    protocol::serial::SerialQueue,
};
use leadscrew_planner::PixelQueue;
use stm32f4::stm32f407::{Interrupt, EXTI, PWR, RCC};
use stm32f4xx_hal::rcc::Rcc;

/// The longest sleep of the main loop, in microseconds.
const LONGEST_SLEEP: Duration = Duration::from_ticks(5_000);

/// Changes of power within rows of a raster. A machine of more than four axes takes more room in the
/// same memory.
const PIXELS: usize = if AXES > 4 {
    config::PIXELS - 128
} else {
    config::PIXELS
};

/// Room for bytes to send on USB: 512, and the place that a ring keeps free. 512 bytes are sent
/// within half a millisecond.
type UsbOutgoing = Queue<u8, 513>;

type TheMachine = Machine<'static, Kinematics, AXES, MOTORS, Own>;

static INPUTS: Inputs<MOTORS> = Inputs::new();

/// Switches on the clocks of the timers, of the switches' lines, of the supply's detector, of the
/// captures' DMA controller, and of the heaters' converter.
fn switch_on_clocks(rcc: &RCC) {
    clock::switch_on(rcc, |rcc| {
        rcc.apb2enr()
            .modify(|_, w| w.syscfgen().enabled().tim11en().enabled());
        #[cfg(captures)]
        rcc.ahb1enr().modify(|_, w| w.dma1en().enabled());
        #[cfg(heaters)]
        rcc.apb2enr().modify(|_, w| w.adc1en().enabled());
        rcc.apb1enr()
            .modify(|_, w| w.tim2en().enabled().tim5en().enabled().pwren().enabled());
    });
}

/// The start of the firmware: the source of its clock, and the reason of the reset.
struct Start {
    source: Source,
    reason: restart::Reason,
}

impl Start {
    /// Sets the clocks up, and logs how the firmware came to start.
    fn new(rcc: RCC, power: &PWR, exti: &EXTI) -> (Rcc, Self) {
        let reason = restart::reason(&rcc);
        supply::watch(power, exti);
        let (rcc, source) = clock::start(rcc, power);
        defmt::info!(
            "leadscrew on {=str}, clock: {}, restarted: {}",
            profile::name(),
            source,
            reason
        );
        (rcc, Self { source, reason })
    }

    /// Tells senders of a clock that is not the crystal, and of a restart that nobody asked for.
    fn say(&self, board: &mut F407) {
        let told = self.source != Source::Crystal && profile::crystal_hz() != 0;
        board.say(told.then_some(self.source));
        board.say(self.reason.text());
        board.say(self.reason.place());
    }
}

/// Takes over the stored settings, and makes room for changes while nothing waits for it.
fn load_settings(machine: &mut TheMachine, store: &mut Sectors) {
    match machine.load(store) {
        Ok(condition) => defmt::info!("settings: {}", condition),
        Err(error) => defmt::error!("settings: {}", error),
    }
    if let Err(error) = machine.make_room(store) {
        defmt::error!("the spare sector of the settings: {}", error);
    }
}

/// Lets the next packet in over USB. The interrupt takes one packet for each turn of the main loop,
/// so that a host that sends without an end leaves time for motion; the controller lets it wait.
#[allow(unsafe_code)]
fn admit_packet() {
    // SAFETY: no critical section and no task relies on this mask.
    unsafe { NVIC::unmask(Interrupt::OTG_FS) }
}

#[rtic::app(device = stm32f4::stm32f407, peripherals = true)]
mod app {
    use super::*;

    #[shared]
    struct SharedResources {
        sender: Sender,
        // In the core coupled memory, in which no DMA delays an edge.
        #[lock_free]
        #[allow(unsafe_code)]
        #[link_section = ".bss.ccm.filter"]
        filter: Filter,
    }

    #[local]
    struct Local {
        machine: &'static mut TheMachine,
        listener: Listener,
        usb: Option<&'static mut usb::Port>,
        // In the core coupled memory, since the moves fill the other memory.
        #[allow(unsafe_code)]
        #[link_section = ".bss.ccm.board"]
        board: F407,
        store: Sectors,
        clock: Clock,
    }

    #[init(local = [
        #[allow(unsafe_code)] #[link_section = ".bss.ccm.queue"]
        queue: SegmentQueue<MOTORS> = SegmentQueue::new(),
        #[allow(unsafe_code)] #[link_section = ".bss.ccm.pixels"]
        pixels: PixelQueue<PIXELS> = PixelQueue::new(),
        moves: MoveQueues<AXES, MOTORS, MOVES> = MoveQueues::new(),
        received: SerialQueue = SerialQueue::new(),
        usb_received: SerialQueue = SerialQueue::new(),
        usb_outgoing: UsbOutgoing = UsbOutgoing::new(),
        usb_place: usb::Place = usb::Place::new(),
        #[allow(unsafe_code)] #[link_section = ".bss.ccm.machine"]
        place: MaybeUninit<TheMachine> = MaybeUninit::uninit(),
    ])]
    fn init(cx: init::Context) -> (SharedResources, Local) {
        let (device, mut core) = (cx.device, cx.core);
        restart::go_to_loader(&device.RCC, &device.SYSCFG, &mut core);
        let refusal = chip::refusal(&device.DBGMCU).or_else(profile::find);
        serial::enable(&device.RCC);
        switch_on_clocks(&device.RCC);
        fast_memory::load(&device.SYSCFG, &mut core.SCB);
        let (rcc, start) = Start::new(device.RCC, &device.PWR, &device.EXTI);
        pwm::start(&rcc);
        if refusal.is_none() {
            pwm::take_pin();
        }
        let filter = Filter::new(device.EXTI, &device.SYSCFG);
        INPUTS.on_switches(&switches::switches(), &SHARED);

        let (producer, segments) = cx.local.queue.split();
        let (receiver, inbox) = cx.local.received.split();
        let (usb_receiver, usb_inbox) = cx.local.usb_received.split();
        let (usb_outgoing, usb_sending) = cx.local.usb_outgoing.split();
        // In the order of the channels, as in `F407::write`. The internal oscillator is too inexact
        // for USB.
        let has_usb = start.source == Source::Crystal && refusal.is_none();
        let inboxes = iter::once(inbox).chain(has_usb.then_some(usb_inbox));
        let links = Links {
            moves: cx.local.moves,
            pixels: cx.local.pixels,
            segments: producer,
            shared: &SHARED,
            inputs: &INPUTS,
            inboxes: inboxes.collect(),
        };
        let Ok(machine) = Machine::with_extension(config(), kinematics(), links, own()) else {
            panic!("nothing can be planned with this profile");
        };
        let machine = cx.local.place.write(machine);
        let mut store = Sectors::new(device.FLASH);
        // The record names the sectors of the settings.
        if refusal.is_none() {
            load_settings(machine, &mut store);
        }
        let mut board = F407::new(Writer::new(), usb::Writer::new(usb_outgoing));
        board.lock(refusal);
        start.say(&mut board);
        watchdog::start(&device.DBGMCU);
        let listener = Listener::new(device.TIM7, receiver);
        serial::start();
        let (global, rest) = (device.OTG_FS_GLOBAL, device.OTG_FS_DEVICE);
        let controller = (global, rest, device.OTG_FS_PWRCLK);
        let usb = has_usb.then(|| {
            profile::give_usb_its_pins();
            let place = cx.local.usb_place;
            let unique = registers::unique_number();
            place.start(controller, clock::CPU_HZ, unique, usb_receiver, usb_sending)
        });
        step_interrupt::start(&mut core.NVIC, (device.TIM2, device.TIM11), segments);
        let local = Local {
            machine,
            listener,
            usb: usb.flatten(),
            board,
            store,
            clock: Clock::new(device.TIM5),
        };
        let sender = Sender::new();
        (SharedResources { sender, filter }, local)
    }

    /// The main loop: sleeps when it has nothing to do.
    #[idle(local = [machine, board, store, clock])]
    fn idle(cx: idle::Context) -> ! {
        let idle::LocalResources {
            machine,
            board,
            store,
            clock,
            ..
        } = cx.local;
        loop {
            watchdog::feed();
            step_port::catch_missed_tick();
            admit_packet();
            let now = clock.now();
            let next = machine.poll(board, now);
            let unsaved = machine.save(store).unwrap_or_else(|error| {
                defmt::error!("a change is not stored: {}", error);
                false
            });
            if !unsaved && board.wants_loader(now) {
                restart::into_loader();
            }
            if !next.busy && !unsaved {
                let latest = now + LONGEST_SLEEP;
                clock.wake_at(next.when.map_or(latest, |when| when.min(latest)));
                clock::sleep();
            }
        }
    }

    /// Something may have come over the serial line.
    #[task(binds = TIM7, priority = 13, local = [listener])]
    fn listen(cx: listen::Context) {
        cx.local.listener.listen();
    }

    /// Something can be sent, if the line is on USART2.
    #[task(binds = DMA1_STREAM6, priority = 13, shared = [sender])]
    fn send_2(mut cx: send_2::Context) {
        cx.shared.sender.lock(Sender::send);
    }

    /// Something can be sent, if the line is on USART1.
    #[task(binds = DMA2_STREAM7, priority = 13, shared = [sender])]
    fn send_1(mut cx: send_1::Context) {
        cx.shared.sender.lock(Sender::send);
    }

    /// A packet has come or gone, or the host has something to say.
    #[task(binds = OTG_FS, priority = 12, local = [usb])]
    fn packet(cx: packet::Context) {
        if cx.local.usb.as_mut().is_some_and(|usb| usb.on_interrupt()) {
            NVIC::mask(Interrupt::OTG_FS);
            clock::wake();
        }
    }

    /// The supply is low.
    #[task(binds = PVD, priority = 14)]
    fn low_supply(_: low_supply::Context) {
        supply::on_low()
    }

    /// The main loop wants to be woken, or the filter's time of a switch is over.
    #[task(binds = TIM5, priority = 14, shared = [filter])]
    fn alarm(cx: alarm::Context) {
        if clock::take_alarms() {
            cx.shared.filter.on_time(&INPUTS, &SHARED);
        }
    }

    /// An edge on line 0.
    #[task(binds = EXTI0, priority = 14, shared = [filter])]
    fn edge_0(cx: edge_0::Context) {
        cx.shared.filter.on_edge(&SHARED);
    }

    /// An edge on line 1.
    #[task(binds = EXTI1, priority = 14, shared = [filter])]
    fn edge_1(cx: edge_1::Context) {
        cx.shared.filter.on_edge(&SHARED);
    }

    /// An edge on line 2.
    #[task(binds = EXTI2, priority = 14, shared = [filter])]
    fn edge_2(cx: edge_2::Context) {
        cx.shared.filter.on_edge(&SHARED);
    }

    /// An edge on line 3.
    #[task(binds = EXTI3, priority = 14, shared = [filter])]
    fn edge_3(cx: edge_3::Context) {
        cx.shared.filter.on_edge(&SHARED);
    }

    /// An edge on line 4.
    #[task(binds = EXTI4, priority = 14, shared = [filter])]
    fn edge_4(cx: edge_4::Context) {
        cx.shared.filter.on_edge(&SHARED);
    }

    /// An edge on lines 5 to 9.
    #[task(binds = EXTI9_5, priority = 14, shared = [filter])]
    fn edge_5(cx: edge_5::Context) {
        cx.shared.filter.on_edge(&SHARED);
    }

    /// An edge on lines 10 to 15.
    #[task(binds = EXTI15_10, priority = 14, shared = [filter])]
    fn edge_10(cx: edge_10::Context) {
        cx.shared.filter.on_edge(&SHARED);
    }
}
