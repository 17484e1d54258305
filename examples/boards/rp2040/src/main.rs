//! leadscrew on a Raspberry Pi Pico, under RTIC.
//!
//! Written from `docs/embedding.md`; runs in an emulator (`cargo xtask boards`). Pins: serial line on GPIO 0 and 1,
//! steps of X, Y, Z on GPIO 2 to 4, directions on GPIO 5 to 7, enable (low) on GPIO 8, the
//! spindle's PWM on GPIO 9. Time and steps share one count of microseconds, the chip's own timer.
#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod timer;

use leadscrew::{
    Cartesian, Config, Listener, Machine, Outputs, PinStepping, Resources, Speaker, StepDir,
};
use panic_halt as _;
use rp2040_hal::{
    clocks::init_clocks_and_plls,
    fugit::RateExtU32,
    gpio::{bank0, DynPinId, FunctionSioOutput, FunctionUart, Pin, Pins, PullDown, PullNone},
    gpio::{Function, PinId, PinState, PullType, ValidFunction},
    pac,
    pwm::{Channel, FreeRunning, Pwm4, Slice, Slices, B},
    uart::{DataBits, Reader, StopBits, UartConfig, UartPeripheral, Writer},
    Clock, Sio, Watchdog,
};
use timer::StepTimer;

/// The frequency of the Pico's crystal, Hz.
const CRYSTAL_HZ: u32 = 12_000_000;

type Output = Pin<DynPinId, FunctionSioOutput, PullDown>;
type Spindle = Channel<Slice<Pwm4, FreeRunning>, B>;
type Wire<I> = Pin<I, FunctionUart, PullNone>;
type Wires = (Wire<bank0::Gpio0>, Wire<bank0::Gpio1>);

/// Makes a pin an output, of the one type that all outputs have.
fn out<I, F, P>(pin: Pin<I, F, P>) -> Output
where
    I: PinId + ValidFunction<FunctionSioOutput>,
    F: Function,
    P: PullType,
{
    pin.into_push_pull_output().into_pull_type().into_dyn_pin()
}

/// Sets the flash chip up, before anything else runs.
#[allow(unsafe_code)] // the boot loader looks for it in this section
#[link_section = ".boot2"]
#[used]
static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_GENERIC_03H;

#[rtic::app(device = rp2040_hal::pac, peripherals = true)]
mod app {
    use super::*;

    #[shared]
    struct SharedResources {}

    #[local]
    struct Local {
        machine: Machine<'static, Cartesian, 3, 3>,
        outputs: Outputs<fn(), Output, Spindle>,
        steps: PinStepping<StepDir<Output, Output, 3>, StepTimer, 3>,
        listener: Listener<'static>,
        speaker: Speaker<'static>,
        reader: Reader<pac::UART0, Wires>,
        writer: Writer<pac::UART0, Wires>,
    }

    #[init(local = [memory: Resources<3, 3, 256> = Resources::new()])]
    fn init(cx: init::Context) -> (SharedResources, Local) {
        let mut resets = cx.device.RESETS;
        let clocks = init_clocks_and_plls(
            CRYSTAL_HZ,
            cx.device.XOSC,
            cx.device.CLOCKS,
            cx.device.PLL_SYS,
            cx.device.PLL_USB,
            &mut resets,
            &mut Watchdog::new(cx.device.WATCHDOG),
        );
        let clocks = clocks.ok().expect("the crystal and the PLLs start");
        let (ports, pads) = (cx.device.IO_BANK0, cx.device.PADS_BANK0);
        let pins = Pins::new(ports, pads, Sio::new(cx.device.SIO).gpio_bank0, &mut resets);

        let wires = (pins.gpio0.reconfigure(), pins.gpio1.reconfigure());
        let rate = UartConfig::new(115_200.Hz(), DataBits::Eight, None, StopBits::One);
        let mut uart = UartPeripheral::new(cx.device.UART0, wires, &mut resets)
            .enable(rate, clocks.peripheral_clock.freq())
            .expect("the clock makes 115 200 baud");
        uart.enable_rx_interrupt();
        let (reader, writer) = uart.split();

        // This takes the timer out of reset, with the watchdog's tick as its clock.
        let _ = rp2040_hal::Timer::new(cx.device.TIMER, &mut resets, &clocks);
        timer::start();
        let config = Config::new().timer_hz(timer::HZ);
        let (machine, steps, serial, _) =
            leadscrew::new(cx.local.memory, config, Cartesian).expect("the build is sound");
        let motors = StepDir::new([
            (out(pins.gpio2), out(pins.gpio5)),
            (out(pins.gpio3), out(pins.gpio6)),
            (out(pins.gpio4), out(pins.gpio7)),
        ]);
        let mut slice = Slices::new(cx.device.PWM, &mut resets).pwm4;
        slice.enable();
        let mut spindle = slice.channel_b;
        spindle.output_to(pins.gpio9);
        let enable = pins.gpio8.into_push_pull_output_in_state(PinState::High); // the drivers are off
        let outputs = Outputs::new(timer::pend as fn(), out(enable)).with_spindle(spindle);
        let (listener, speaker) = serial.split();
        let local = Local {
            machine,
            outputs,
            steps: steps.on(motors, StepTimer),
            listener,
            speaker,
            reader,
            writer,
        };
        (SharedResources {}, local)
    }

    /// The main loop. It never sleeps: at 125 MHz it makes a turn every few microseconds.
    #[idle(local = [machine, outputs, speaker, writer])]
    fn idle(cx: idle::Context) -> ! {
        let mut unsent = None;
        loop {
            cx.local.machine.poll(cx.local.outputs, timer::now());
            while let Some(byte) = unsent.take().or_else(|| cx.local.speaker.next_to_send()) {
                if cx.local.writer.write_raw(&[byte]).is_err() {
                    unsent = Some(byte); // there is no room
                    break;
                }
            }
        }
    }

    /// Bytes have come.
    #[task(binds = UART0_IRQ, priority = 2, local = [reader, listener])]
    fn listen(cx: listen::Context) {
        let mut byte = [0];
        while cx.local.reader.read_raw(&mut byte).is_ok() {
            cx.local.listener.receive(byte[0]);
        }
    }

    /// A tick is due, a pulse ends, or the main loop has something to start.
    #[task(binds = TIMER_IRQ_0, priority = 3, local = [steps])]
    fn tick(cx: tick::Context) {
        cx.local.steps.tick();
    }
}
