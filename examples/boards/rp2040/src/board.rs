//! The board that the machine runs on: three motors and a serial line; no spindle, no coolant, no
//! switches.

use crate::step_port;
use embedded_hal::digital::OutputPin;
use fugit::RateExtU32;
use leadscrew_machine::board::{
    Board, ChannelId, CoolantOutput, Instant, PortConfig, SpindleOutput, Switches,
};
use leadscrew_machine::protocol::serial::Receiver;
use leadscrew_stepper::Power;
use rp2040_hal::{
    clocks::init_clocks_and_plls,
    gpio::{bank0, FunctionSio, FunctionUart, Pin, Pins, PullDown, PullNone, SioOutput},
    pac,
    uart::{self, DataBits, StopBits, UartConfig, UartPeripheral},
    Clock, Sio, Watchdog,
};

/// The frequency of the Pico's crystal, Hz.
const CRYSTAL_HZ: u32 = 12_000_000;

type Wires = (
    Pin<bank0::Gpio0, FunctionUart, PullNone>,
    Pin<bank0::Gpio1, FunctionUart, PullNone>,
);
type Enable = Pin<bank0::Gpio8, FunctionSio<SioOutput>, PullDown>;

/// The board as the main loop uses it.
pub(crate) struct Pico {
    writer: uart::Writer<pac::UART0, Wires>,
    enable: Enable,
}

/// The board as the serial interrupt uses it.
pub(crate) struct Reader(uart::Reader<pac::UART0, Wires>);

impl Reader {
    /// Hands over all bytes that have been received.
    pub(crate) fn hand_over(&mut self, receiver: &mut Receiver<'_>) {
        let mut bytes = [0; 32];
        while let Ok(count) = self.0.read_raw(&mut bytes) {
            for byte in bytes.iter().take(count) {
                receiver.receive(*byte);
            }
        }
    }
}

/// Starts clocks, pins, serial line and step timer. Called once.
pub(crate) fn start(device: pac::Peripherals) -> (Pico, Reader) {
    let mut resets = device.RESETS;
    let mut watchdog = Watchdog::new(device.WATCHDOG);
    let clocks = init_clocks_and_plls(
        CRYSTAL_HZ,
        device.XOSC,
        device.CLOCKS,
        device.PLL_SYS,
        device.PLL_USB,
        &mut resets,
        &mut watchdog,
    );
    // If a crystal or a PLL does not start, nothing can run.
    let Ok(clocks) = clocks else { halt() };
    let sio = Sio::new(device.SIO);
    let pins = Pins::new(
        device.IO_BANK0,
        device.PADS_BANK0,
        sio.gpio_bank0,
        &mut resets,
    );
    let wires = (pins.gpio0.reconfigure(), pins.gpio1.reconfigure());
    let rate = UartConfig::new(115_200.Hz(), DataBits::Eight, None, StopBits::One);
    let serial = UartPeripheral::new(device.UART0, wires, &mut resets)
        .enable(rate, clocks.peripheral_clock.freq());
    let Ok(mut serial) = serial else { halt() };
    serial.enable_rx_interrupt();
    let (reader, writer) = serial.split();

    let mut enable: Enable = pins.gpio8.reconfigure();
    let Ok(()) = enable.set_high();
    pins.gpio2.into_push_pull_output();
    pins.gpio3.into_push_pull_output();
    pins.gpio4.into_push_pull_output();
    pins.gpio5.into_push_pull_output();
    pins.gpio6.into_push_pull_output();
    pins.gpio7.into_push_pull_output();
    // This takes the timer out of reset, with the watchdog's tick as its clock.
    let _timer = rp2040_hal::Timer::new(device.TIMER, &mut resets, &clocks);
    step_port::start();
    (Pico { writer, enable }, Reader(reader))
}

fn halt() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}

impl Board for Pico {
    fn start_stepping(&mut self, now: Instant) -> Instant {
        step_port::pend();
        now
    }
    fn write(&mut self, _: ChannelId, bytes: &[u8]) -> usize {
        self.writer
            .write_raw(bytes)
            .map_or(0, |rest| bytes.len() - rest.len())
    }
    fn switches(&self) -> Switches {
        Switches::OPEN
    }
    fn enable_motors(&mut self, on: bool) {
        let Ok(()) = self.enable.set_state((!on).into());
    }
    fn set_spindle(&mut self, _: SpindleOutput) {}
    fn set_power(&mut self, _: Power) {}
    fn set_coolant(&mut self, _: CoolantOutput) {}
    fn configure(&mut self, port: &PortConfig) {
        step_port::configure(port);
    }
}
