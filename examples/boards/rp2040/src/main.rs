//! leadscrew on a Raspberry Pi Pico, under RTIC.
//!
//! ```text
//!  UART0 task --> Receiver      idle task: Machine::poll(board, now)       TIMER_IRQ_0 --> on_timer --> pins
//!                                     |            ^                           ^
//!                                     +-- segments-+---------------------------+
//! ```
//!
//! Written from `docs/embedding.md`; compiled, but never run. Pins: serial line on GPIO 0 and 1,
//! steps of X, Y, Z on GPIO 2 to 4, directions on GPIO 5 to 7, enable (low) on GPIO 8. Time and
//! steps share one count of microseconds, the chip's own timer.
#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod board;
mod clock;
mod step_port;

use board::Pico;
use heapless::spsc::Consumer;
use leadscrew_machine::{
    config::{MachineConfig, MoveQueues, SegmentQueue},
    inputs::Inputs,
    machine::{Links, Machine},
    protocol::serial::{Receiver, SerialQueue},
    step_timing::StepTiming,
};
use leadscrew_planner::{Cartesian, PixelQueue};
use leadscrew_stepper::{Segment, Shared, StepInterrupt};
use panic_halt as _;
use step_port::Port;

/// The axes X, Y, Z, with one motor each.
const AXES: usize = 3;

/// Moves that are planned ahead.
const MOVES: usize = 256;

type TheMachine = Machine<'static, Cartesian, AXES, AXES>;

/// State that the step interrupt shares with the main loop.
static SHARED: Shared<AXES> = Shared::new();

/// State that switch interrupts would share with the main loop. This board has no switches.
static INPUTS: Inputs<AXES> = Inputs::new();

/// Sets the flash chip up, before anything else runs.
#[allow(unsafe_code)] // the boot loader looks for it in this section
#[link_section = ".boot2"]
#[used]
static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_GENERIC_03H;

/// The state that the step interrupt owns.
pub struct Steps {
    interrupt: StepInterrupt<AXES>,
    segments: Consumer<'static, Segment<AXES>>,
    port: Port,
    in_motion: bool,
}

#[rtic::app(device = rp2040_hal::pac, peripherals = true)]
mod app {
    use super::*;

    #[shared]
    struct SharedResources {}

    #[local]
    struct Local {
        machine: TheMachine,
        board: Pico,
        reader: board::Reader,
        receiver: Receiver<'static>,
        steps: Steps,
    }

    // The initial values are constants, in zeroed memory, so that nothing is built on the stack.
    #[init(local = [
        queue: SegmentQueue<AXES> = SegmentQueue::new(),
        moves: MoveQueues<AXES, AXES, MOVES> = MoveQueues::new(),
        pixels: PixelQueue<1> = PixelQueue::new(),
        serial: SerialQueue = SerialQueue::new(),
    ])]
    fn init(cx: init::Context) -> (SharedResources, Local) {
        let (board, reader) = board::start(cx.device);
        let (producer, segments) = cx.local.queue.split();
        let (receiver, inbox) = cx.local.serial.split();
        let links = Links {
            moves: cx.local.moves,
            pixels: cx.local.pixels,
            segments: producer,
            shared: &SHARED,
            inputs: &INPUTS,
            inboxes: core::iter::once(inbox).collect(),
        };
        let local = Local {
            machine: Machine::new(config(), Cartesian, links).expect("the settings are sound"),
            board,
            reader,
            receiver,
            steps: Steps {
                interrupt: StepInterrupt::new(),
                segments,
                port: Port::new(),
                in_motion: false,
            },
        };
        (SharedResources {}, local)
    }

    /// The main loop. It never sleeps: at 125 MHz it makes a turn every few microseconds.
    #[idle(local = [machine, board])]
    fn idle(cx: idle::Context) -> ! {
        loop {
            cx.local.machine.poll(cx.local.board, clock::now());
        }
    }

    /// Bytes have come.
    #[task(binds = UART0_IRQ, priority = 2, local = [reader, receiver])]
    fn listen(cx: listen::Context) {
        cx.local.reader.hand_over(cx.local.receiver);
    }

    /// A tick is due, or the main loop has something to start.
    #[task(binds = TIMER_IRQ_0, priority = 3, local = [steps])]
    fn tick(cx: tick::Context) {
        let Steps {
            interrupt,
            segments,
            port,
            in_motion,
        } = cx.local.steps;
        port.acknowledge();
        if !*in_motion && SHARED.is_running() {
            port.begin();
            leadscrew_stepper::start(interrupt, segments, &SHARED, port);
            *in_motion = true;
        }
        if *in_motion {
            leadscrew_stepper::on_timer(interrupt, segments, &SHARED, port);
        }
        *in_motion = SHARED.is_running();
    }

    /// A pulse ends.
    #[task(binds = TIMER_IRQ_1, priority = 3)]
    fn pulse_end(_: pulse_end::Context) {
        step_port::on_pulse_end();
    }
}

fn config() -> MachineConfig<AXES> {
    MachineConfig {
        timer_hz: clock::HZ,
        step_timing: StepTiming {
            // Not measured: figures for 20 000 steps/s.
            tick_ns: 45_000,
            motor_ns: 1_000,
            line_ns: 48_000,
            pulse_end_ns: 3_000,
            setup_ns: 1_000,
            shortest_pulse_us: 3,
        },
        moves: MOVES,
        ..MachineConfig::new()
    }
}
