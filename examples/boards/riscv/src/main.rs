//! leadscrew on a SiFive FU540 (32 bits, as QEMU has it), under embassy's executor.
//!
//! Written from `docs/embedding.md` and `docs/async.md`. Pins: steps of X, Y, Z on GPIO 0 to 2,
//! directions on GPIO 3 to 5, enable (low) on GPIO 6. UART 0 is the serial line. The core's one
//! timer wakes tasks and times steps.
#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod chip;

use chip::{Line, Pin, Timer};
use core::cell::RefCell;
use critical_section::Mutex;
use embassy_executor::Spawner;
use embassy_futures::join::join;
use leadscrew::{Cartesian, Config, Outputs, PinStepping, SmallResources, StepDir};
use panic_halt as _;
use static_cell::ConstStaticCell;

type Memory = SmallResources<3, 3, 16>;
static MEMORY: ConstStaticCell<Memory> = ConstStaticCell::new(Memory::new());
/// The step interrupt's.
static STEPS: Mutex<RefCell<Option<PinStepping<StepDir<Pin, Pin, 3>, Timer, 3>>>> =
    Mutex::new(RefCell::new(None));

#[embassy_executor::main(entry = "riscv_rt::entry")]
async fn main(_spawner: Spawner) {
    chip::start();
    let config = Config::new().timer_hz(chip::HZ);
    let (mut machine, steps, mut serial, _) =
        leadscrew::new(MEMORY.take(), config, Cartesian).expect("the build is sound");
    let motors = StepDir::new([(Pin(0), Pin(3)), (Pin(1), Pin(4)), (Pin(2), Pin(5))]);
    critical_section::with(|cs| STEPS.replace(cs, Some(steps.on(motors, Timer))));

    let mut outputs = Outputs::new(chip::pend_step, Pin(6));
    let running = machine.run_without_store(&mut outputs, &Timer);
    let (mut reader, mut writer) = (Line, Line);
    join(running, serial.pump(&mut reader, &mut writer)).await;
}

/// A tick is due, a pulse ends, a task is to wake, or motion is to start.
#[no_mangle]
#[allow(unsafe_code)] // its name is the vector's
extern "C" fn MachineTimer() {
    critical_section::with(|cs| {
        if chip::take_step(cs) {
            STEPS.borrow_ref_mut(cs).as_mut().map(|steps| steps.tick());
        }
        chip::wake(cs);
    });
}

/// Bytes have come.
#[no_mangle]
#[allow(unsafe_code)] // its name is the vector's
extern "C" fn MachineExternal() {
    chip::on_bytes();
}
