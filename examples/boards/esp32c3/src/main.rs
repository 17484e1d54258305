//! leadscrew on an ESP32-C3, on its HAL.
//!
//! Written from `docs/embedding.md`; compiled, never run. Pins: serial line on
//! GPIO 20 and 21, steps of X, Y, Z on GPIO 0, 1 and 3, directions on GPIO 4 to 6, enable (low) on
//! GPIO 7, the spindle's PWM on GPIO 10. Time and steps share one count, the system timer's.
#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod timer;

use core::cell::RefCell;
use critical_section::Mutex;
use esp_hal::{
    clock::CpuClock,
    gpio::{DriveMode, Level, Output, OutputConfig, OutputPin},
    handler,
    interrupt::Priority,
    ledc::{channel, channel::ChannelIFace, timer as pwm, timer::TimerIFace},
    ledc::{LSGlobalClkSource, Ledc, LowSpeed},
    time::Rate,
    uart::{self, Uart},
};
use leadscrew::{Cartesian, Config, Outputs, PinStepping, Resources, StepDir};
use panic_halt as _;
use static_cell::ConstStaticCell;
use timer::StepTimer;

/// Tells Espressif's boot loader and espflash that this is an application: ESP-IDF's
/// `esp_app_desc_t`, of which they read the magic word, the most recent revision of the fuses (any)
/// and the size of a page (2^16 bytes).
#[allow(unsafe_code)] // the HAL's linker script looks for it in this section
#[export_name = "esp_app_desc"]
#[link_section = ".flash.appdesc"]
#[used]
static DESCRIPTION: [u32; 64] = {
    let mut words = [0; 64];
    words[0] = 0xABCD_5432;
    words[44] = 0xFFFF_0000;
    words[45] = 16;
    words
};

type Motors = StepDir<Output<'static>, Output<'static>, 3>;

static MEMORY: ConstStaticCell<Resources<3, 3, 256>> = ConstStaticCell::new(Resources::new());
/// The step interrupt's.
static STEPS: Mutex<RefCell<Option<PinStepping<Motors, StepTimer, 3>>>> =
    Mutex::new(RefCell::new(None));

fn out(pin: impl OutputPin + 'static) -> Output<'static> {
    Output::new(pin, Level::Low, OutputConfig::default())
}

#[esp_hal::main]
fn main() -> ! {
    // 160 MHz. This stops the watchdogs.
    let chip = esp_hal::init(esp_hal::Config::default().with_cpu_clock(CpuClock::max()));
    let mut line = Uart::new(chip.UART0, uart::Config::default().with_baudrate(115_200))
        .expect("the clock makes 115 200 baud")
        .with_rx(chip.GPIO20)
        .with_tx(chip.GPIO21);

    let mut ledc = Ledc::new(chip.LEDC);
    ledc.set_global_slow_clock(LSGlobalClkSource::APBClk);
    let mut slow = ledc.timer::<LowSpeed>(pwm::Number::Timer0);
    slow.configure(pwm::config::Config {
        duty: pwm::config::Duty::Duty13Bit,
        clock_source: pwm::LSClockSource::APBClk,
        frequency: Rate::from_khz(5),
    })
    .expect("80 MHz make 5 kHz of 13 bits");
    let mut spindle = ledc.channel(channel::Number::Channel0, chip.GPIO10);
    spindle
        .configure(channel::config::Config {
            timer: &slow,
            duty_pct: 0,
            drive_mode: DriveMode::PushPull,
        })
        .expect("the timer has been configured");

    let config = Config::new().timer_hz(timer::HZ);
    let (mut machine, steps, mut serial, _) =
        leadscrew::new(MEMORY.take(), config, Cartesian).expect("the build is sound");
    let motors = StepDir::new([
        (out(chip.GPIO0), out(chip.GPIO4)),
        (out(chip.GPIO1), out(chip.GPIO5)),
        (out(chip.GPIO3), out(chip.GPIO6)),
    ]);
    let (timer, pend) = timer::start(chip.SYSTIMER, chip.FROM_CPU_INTR0, step);
    critical_section::with(|cs| STEPS.replace(cs, Some(steps.on(motors, timer))));
    let start = || pend.raise();
    let enable = Output::new(chip.GPIO7, Level::High, OutputConfig::default()); // the drivers are off
    let mut outputs = Outputs::new(start, enable).with_spindle(spindle);
    loop {
        machine.poll(&mut outputs, timer::now());
        // The line holds 128 bytes, 11 ms; a lost one is counted.
        let _ = serial.exchange(&mut line);
    }
}

/// A tick is due, a pulse ends, or the main loop has something to start.
#[handler(priority = Priority::Priority3)]
fn step() {
    critical_section::with(|cs| {
        STEPS.borrow_ref_mut(cs).as_mut().map(|steps| steps.tick());
    });
}
