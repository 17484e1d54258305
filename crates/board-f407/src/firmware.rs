//! Puts the machine on the board: what is started, which interrupt calls what, and the main loop.
use crate::{
    board::{self, F407},
    clock::{self, Clock},
    profile::{kinematics, Kinematics, AXES, MOTORS, PROFILE},
    pwm, safe_state,
    serial::{self, Outgoing},
    step_port::Port,
    wake,
};
use core::mem::MaybeUninit;
use defmt_rtt as _;
use heapless::{spsc::Consumer, Vec};
use leadscrew_machine::{
    board::Duration,
    config::{MachineConfig, SegmentQueue},
    inputs::Inputs,
    machine::{Links, Machine},
    protocol::serial::SerialQueue,
};
use leadscrew_stepper::{on_timer, Segment, Shared, StepInterrupt};

/// Moves planned ahead.
const MOVES: usize = 1024;
/// How long the main loop sleeps at most, in microseconds.
const LONGEST_SLEEP: Duration = Duration::from_ticks(5_000);

type TheMachine = Machine<'static, Kinematics, AXES, MOTORS, MOVES>;

static SHARED: Shared<MOTORS> = Shared::new();
static INPUTS: Inputs<MOTORS> = Inputs::new();

#[rtic::app(device = stm32f4::stm32f407, peripherals = true)]
mod app {
    use super::*;

    #[shared]
    struct SharedResources {}

    #[local]
    struct Local {
        port: Port,
        segments: Consumer<'static, Segment<MOTORS>>,
        serial: serial::Port,
        machine: &'static mut TheMachine,
        board: F407,
        clock: Clock,
    }

    #[init(local = [
        queue: SegmentQueue<MOTORS> = SegmentQueue::new(),
        received: SerialQueue = SerialQueue::new(),
        outgoing: Outgoing = Outgoing::new(),
        place: MaybeUninit<TheMachine> = MaybeUninit::uninit(),
    ])]
    fn init(cx: init::Context) -> (SharedResources, Local) {
        let device = cx.device;
        device.RCC.ahb1enr().modify(|_, w| {
            w.gpioaen()
                .enabled()
                .gpioben()
                .enabled()
                .gpiocen()
                .enabled();
            w.gpioden().enabled().gpioeen().enabled()
        });
        device.RCC.apb1enr().modify(|_, w| {
            w.tim2en().enabled().tim4en().enabled().tim5en().enabled();
            w.usart2en().enabled()
        });
        safe_state::enter();
        let source = clock::start(&device.RCC, &device.FLASH, &device.PWR);
        defmt::info!("leadscrew on {=str}, clock: {}", PROFILE.name, source);
        board::start_switches();
        pwm::start();

        let (producer, segments) = cx.local.queue.split();
        let (receiver, inbox) = cx.local.received.split();
        let (outgoing, sending) = cx.local.outgoing.split();
        let mut inboxes = Vec::new();
        let _ = inboxes.push(inbox);
        let links = Links {
            segments: producer,
            shared: &SHARED,
            inputs: &INPUTS,
            inboxes,
        };
        let machine = Machine::new(MachineConfig::new(), kinematics(), links);
        let local = Local {
            port: Port::new(device.TIM2),
            segments,
            serial: serial::Port::new(device.USART2, receiver, sending),
            machine: cx.local.place.write(machine),
            board: F407::new(outgoing),
            clock: Clock::new(device.TIM5),
        };
        (SharedResources {}, local)
    }

    /// The main loop: sleeps when it has nothing to do.
    #[idle(local = [machine, board, clock])]
    fn idle(cx: idle::Context) -> ! {
        let idle::LocalResources {
            machine,
            board,
            clock,
            ..
        } = cx.local;
        loop {
            let now = clock.now();
            let next = machine.poll(board, now);
            if !next.busy {
                let latest = now + LONGEST_SLEEP;
                clock.wake_at(next.when.map_or(latest, |when| when.min(latest)));
                wake::sleep();
            }
        }
    }

    /// The step interrupt. Above everything else, so that nothing delays a step.
    #[task(binds = TIM2, priority = 16, local = [port, segments, state: StepInterrupt<MOTORS> = StepInterrupt::new()])]
    fn step(cx: step::Context) {
        let step::LocalResources {
            port,
            segments,
            state,
            ..
        } = cx.local;
        if port.acknowledge(&SHARED) {
            on_timer(state, segments, &SHARED, port);
        }
    }

    /// A byte has come, or can be sent.
    #[task(binds = USART2, priority = 15, local = [serial])]
    fn usart(cx: usart::Context) {
        cx.local.serial.on_interrupt();
    }

    /// The main loop wants to be woken.
    #[task(binds = TIM5, priority = 1)]
    fn alarm(_: alarm::Context) {
        clock::on_alarm();
    }
}
