//! leadscrew on a Black Pill (STM32F411), under embassy.
//!
//! Written from `docs/embedding.md` and `docs/async.md`; compiled, never run.
//! Pins: serial line on PA9 and PA10, steps of X, Y, Z on PB12 to PB14, directions on PB8 to PB10,
//! enable (low) on PB15, the spindle's PWM on PB0. Timer 2 times steps, timer 4 is embassy's clock.
//! Settings are in the last two sectors of the flash.
#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod chip;

use chip::StepTimer;
use core::cell::RefCell;
use critical_section::Mutex;
use embassy_executor::Spawner;
use embassy_futures::join::join;
use embassy_stm32::{
    bind_interrupts,
    flash::Flash as ChipFlash,
    gpio::{Level, Output, OutputType, Pin, Speed},
    interrupt, peripherals,
    time::khz,
    timer::simple_pwm::{PwmPin, SimplePwm},
    usart::{self, BufferedUart},
    Peri,
};
use leadscrew::{Cartesian, Config, EmbassyClock, Flash, Outputs, PinStepping, Resources, StepDir};
use panic_halt as _;
use static_cell::ConstStaticCell;

bind_interrupts!(struct Interrupts {
    USART1 => usart::BufferedInterruptHandler<peripherals::USART1>;
});

type Motors = StepDir<Output<'static>, Output<'static>, 3>;

static MEMORY: ConstStaticCell<Resources<3, 3, 256>> = ConstStaticCell::new(Resources::new());
/// What the line's interrupt has sent and received.
static BYTES: ConstStaticCell<[[u8; 256]; 2]> = ConstStaticCell::new([[0; 256]; 2]);
/// The step interrupt's.
static STEPS: Mutex<RefCell<Option<PinStepping<Motors, StepTimer, 3>>>> =
    Mutex::new(RefCell::new(None));

fn out(pin: Peri<'static, impl Pin>) -> Output<'static> {
    Output::new(pin, Level::Low, Speed::Medium)
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let pins = embassy_stm32::init(chip::clocks());
    let config = Config::new().timer_hz(chip::HZ);
    let (mut machine, steps, mut serial, _) =
        leadscrew::new(MEMORY.take(), config, Cartesian).expect("the build is sound");
    let motors = StepDir::new([
        (out(pins.PB12), out(pins.PB8)),
        (out(pins.PB13), out(pins.PB9)),
        (out(pins.PB14), out(pins.PB10)),
    ]);
    let steps = steps.on(motors, StepTimer::new(pins.TIM2));
    critical_section::with(|cs| STEPS.replace(cs, Some(steps)));

    let [sent, received] = BYTES.take();
    let rate = usart::Config::default(); // 115 200 baud, 8 bits, no parity, one stop bit
    let line = BufferedUart::new(
        pins.USART1,
        pins.PA10,
        pins.PA9,
        sent,
        received,
        Interrupts,
        rate,
    );
    let (mut writer, mut reader) = line.expect("the clock makes 115 200 baud").split();
    chip::start_interrupts();

    let pwm = PwmPin::new(pins.PB0, OutputType::PushPull);
    let pwm = SimplePwm::new(
        pins.TIM3,
        None,
        None,
        Some(pwm),
        None,
        khz(5),
        Default::default(),
    );
    let mut spindle = pwm.split().ch3;
    spindle.enable();
    let enable = Output::new(pins.PB15, Level::High, Speed::Low); // the drivers are off
    let mut outputs = Outputs::new(chip::pend_step, enable).with_spindle(spindle);
    let flash = ChipFlash::new_blocking(pins.FLASH);
    let mut store = Flash::new(flash, chip::SETTINGS).expect("the range is two sectors");
    let running = machine.run(&mut outputs, &mut store, &EmbassyClock);
    let talking = async {
        loop {
            // It ends with the line's first error; the lost byte is counted. Then it goes on.
            let Err(_) = serial.pump(&mut reader, &mut writer).await;
        }
    };
    join(running, talking).await;
}

/// A tick is due, a pulse ends, or motion is to start.
#[interrupt]
fn TIM2() {
    critical_section::with(|cs| {
        STEPS.borrow_ref_mut(cs).as_mut().map(|steps| steps.tick());
    });
}
