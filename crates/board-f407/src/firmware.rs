//! Boots the board: clocks, a log line, then sleep until an interrupt.
use defmt_rtt as _;
use panic_probe as _;
use stm32f4xx_hal::{pac, prelude::*, rcc::Config};

/// Frequency of the board's crystal in Hz (STM32F4-Discovery, UM1472 section 6.10: X2, 8 MHz).
const CRYSTAL_HZ: u32 = 8_000_000;
/// CPU clock in Hz: the highest that the STM32F407 allows (DocID022152 table 14).
const CPU_HZ: u32 = 168_000_000;

#[cortex_m_rt::entry]
fn main() -> ! {
    if let Some(device) = pac::Peripherals::take() {
        let clocks = Config::hse(CRYSTAL_HZ.Hz()).sysclk(CPU_HZ.Hz());
        let rcc = device.RCC.freeze(clocks);
        defmt::info!("leadscrew: CPU at {} Hz", rcc.clocks.sysclk().raw());
    }
    loop {
        cortex_m::asm::wfi();
    }
}
