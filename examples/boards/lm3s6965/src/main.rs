//! leadscrew on a Stellaris LM3S6965 evaluation board: a Cortex-M3 that stock QEMU emulates.
//!
//! ```text
//!  UART0 interrupt --> Receiver      main loop: Machine::poll(board, now)       step timer --> on_timer --> pins
//!                                          |            ^                            ^
//!                                          +-- segments-+-------------------------- -+
//! ```
//!
//! Written from `docs/embedding.md`. Pins: steps of X, Y, Z on PE0 to PE2, directions on PD0 to
//! PD2, enable on PE3. Register addresses and bits are those of the LM3S6965's data sheet.
#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod board;
mod clock;
mod handlers;
mod register;
mod step_port;
mod uart;
mod vectors;

use board::Lm3s;
use cortex_m::asm;
use cortex_m_rt::entry;
use leadscrew_machine::{
    board::Duration,
    config::{MachineConfig, MoveQueues, SegmentQueue},
    inputs::Inputs,
    machine::{Links, Machine},
    protocol::serial::{SerialQueue, LEAST_TX},
    step_timing::StepTiming,
};
use leadscrew_planner::{Cartesian, PixelQueue};
use leadscrew_stepper::Shared;
use panic_halt as _;
use static_cell::{ConstStaticCell, StaticCell};

/// The axes X, Y, Z, with one motor each.
const AXES: usize = 3;

/// Moves that are planned ahead.
const DEPTH: usize = 16;

/// The number of blocks of moves in the look-ahead.
const BLOCKS: usize = 2;

/// Slots for segments: 8, and one that always stays empty. No segment has to wait for power,
/// because there is no laser.
const SLOTS: usize = 9;

/// The longest sleep of the main loop, so that it sees each change of the clock's high word.
const LONGEST_SLEEP: Duration = Duration::from_ticks(5_000);

type TheMachine = Machine<'static, Cartesian, AXES, AXES>;
type Moves = MoveQueues<AXES, AXES, DEPTH, BLOCKS>;
type Segments = SegmentQueue<AXES, SLOTS, 1>;
type Serial = SerialQueue<129, LEAST_TX, 8>;
type NoPixels = PixelQueue<1>;

/// The machine and all that it borrows take 13 KB at most.
const _: () = assert!(
    size_of::<TheMachine>()
        + size_of::<Moves>()
        + size_of::<Segments>()
        + size_of::<Serial>()
        + size_of::<NoPixels>()
        <= 13 * 1024
);

/// State that the step interrupt shares with the main loop.
static SHARED: Shared<AXES> = Shared::new();

/// State that switch interrupts would share with the main loop. This board has no switches.
static INPUTS: Inputs<AXES> = Inputs::new();

#[entry]
fn main() -> ! {
    // The initial values are constants, in zeroed memory, so that nothing is built on the stack.
    static SEGMENTS: ConstStaticCell<Segments> = ConstStaticCell::new(Segments::new());
    static MOVES: ConstStaticCell<Moves> = ConstStaticCell::new(Moves::new());
    static PIXELS: ConstStaticCell<NoPixels> = ConstStaticCell::new(NoPixels::new());
    static SERIAL: ConstStaticCell<Serial> = ConstStaticCell::new(Serial::new());
    static MACHINE: StaticCell<TheMachine> = StaticCell::new();

    clock::start();
    let (producer, segments) = SEGMENTS.take().split();
    let (receiver, inbox) = SERIAL.take().split();
    let links = Links {
        moves: MOVES.take(),
        pixels: PIXELS.take(),
        segments: producer,
        shared: &SHARED,
        inputs: &INPUTS,
        inboxes: core::iter::once(inbox).collect(),
    };
    let machine = Machine::new(config(), Cartesian, links).expect("the settings are sound");
    let machine = MACHINE.init(machine);
    handlers::start(receiver, segments);

    let mut board = Lm3s::new();
    loop {
        let now = clock::now();
        let next = machine.poll(&mut board, now);
        if !next.busy {
            let latest = now + LONGEST_SLEEP;
            clock::wake_at(next.when.map_or(latest, |when| when.min(latest)));
            asm::wfi();
        }
    }
}

fn config() -> MachineConfig<AXES> {
    MachineConfig {
        timer_hz: clock::HZ,
        step_timing: StepTiming {
            // Not measured on silicon: figures for 20 000 steps/s, which any Cortex-M3 can make.
            tick_ns: 45_000,
            motor_ns: 1_000,
            line_ns: 48_000,
            pulse_end_ns: 2_000,
            setup_ns: 1_000,
            shortest_pulse_us: 3,
        },
        moves: DEPTH,
        pixels: 0,
        receive_size: 128,
        ..MachineConfig::new()
    }
}
