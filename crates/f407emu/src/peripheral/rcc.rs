//! Reset and clock control (RM0090 chapter 7): the source of HCLK, the clocks of the peripherals,
//! and the cause of the last reset.
//!
//! A peripheral's clock starts some cycles after its enable bit has been set (ES0182, "Delay after
//! an RCC peripheral clock enabling"): two cycles of HCLK on AHB, and one plus the bus's divider on
//! an APB.
//!
//! A source that is in use cannot be switched off, and the PLL's settings stay while it is on
//! (sections 7.2.3 and 7.2.6).
//!
//! A peripheral's reset bit resets it at once (sections 7.3.5 to 7.3.9). While the bit is set, an
//! access to the peripheral ends the run.
//!
//! Not modelled: start-up times of oscillators and PLLs (they are ready at once; a crystal that is
//! not fitted is never ready). Not modelled, and warned of if a program asks for it: clock
//! outputs, interrupts of clocks that become ready, the backup domain, clocks that stop in sleep.
use crate::warning::{Warning, Warnings};

/// The address of its first register.
const BASE: u32 = 0x4002_3800;
/// The numbers of registers: a quarter of their offsets.
const CR: usize = 0;
const PLLCFGR: usize = 1;
const CFGR: usize = 2;
const CIR: usize = 3;
const AHB1ENR: usize = 0x30 / 4;
const BDCR: usize = 0x70 / 4;
const CSR: usize = 0x74 / 4;
const SSCGR: usize = 0x80 / 4;
/// The number of registers up to RCC_PLLI2SCFGR (0x84).
const REGISTERS: usize = 0x88 / 4;

/// The offset and the number of the enable registers, and the place of RCC_APB1ENR among them.
const ENABLE: u32 = 0x30;
const ENABLES: usize = 6;
const APB1_ENABLE: usize = 4;
/// The distance of an enable register from the reset register of the same bus.
const ENABLES_AFTER: u32 = 0x20;

/// RCC_CR: the internal oscillator, the crystal, the clock security system, the PLLs.
const HSION: u32 = 1;
const HSEON: u32 = 1 << 16;
const HSERDY: u32 = 1 << 17;
const HSEBYP: u32 = 1 << 18;
const CSSON: u32 = 1 << 19;
const PLLON: u32 = 1 << 24;
const PLLI2SON: u32 = 1 << 26;
/// RCC_PLLCFGR: PLLM and PLLSRC, which both PLLs share.
const SHARED_BY_PLLS: u32 = 0x3F | PLL_FROM_CRYSTAL;
/// RCC_CFGR: clock outputs, I2S.
const OUTPUTS: u32 = 0xFFE0_0000;
/// RCC_CIR: interrupts of clocks that become ready.
const READY_INTERRUPTS: u32 = 0x3F00;
/// RCC_PLLCFGR.PLLSRC: the crystal feeds the PLL.
const PLL_FROM_CRYSTAL: u32 = 1 << 22;
/// RCC_CIR: the clock security system has found the crystal stopped.
const CSSF: u32 = 1 << 7;
const CSSC: u32 = 1 << 23;
/// RCC_AHB1ENR: the clock of CCM, on after a reset (section 7.3.10).
const CCMDATARAMEN: u32 = 1 << 20;
/// RCC_CSR: remove the reset flags.
const RMVF: u32 = 1 << 24;
/// RCC_SSCGR: the PLL's spectrum is spread.
const SSCGEN: u32 = 1 << 31;
/// The values of RCC_AHB1LPENR and the following registers after a reset: every clock runs on in
/// sleep.
const SLEEP_ENABLES: [(usize, u32); 5] = [
    (0x50, 0x7E67_91FF),
    (0x54, 0xF1),
    (0x58, 1),
    (0x60, 0x36FE_C9FF),
    (0x64, 0x0007_5F33),
];
/// Frequency of the internal oscillator in Hz.
const HSI_HZ: u32 = 16_000_000;

/// The reason why a reset came.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ResetCause {
    /// Power came on: nothing in RAM survives.
    PowerOn,
    /// The reset pin.
    Pin,
    /// The program asked for it (AIRCR.SYSRESETREQ).
    Software,
    /// The independent watchdog was not fed.
    Watchdog,
    /// The supply fell below the level of the option bytes (BOR_LEV) and came back: RAM keeps its
    /// contents.
    BrownOut,
}

impl ResetCause {
    /// The flags in RCC_CSR (RM0090 section 7.3.21): every reset pulls the reset pin as well.
    fn flags(self) -> u32 {
        const PIN: u32 = 1 << 26;
        match self {
            ResetCause::PowerOn => PIN | 1 << 27 | 1 << 25,
            ResetCause::Pin => PIN,
            ResetCause::Software => PIN | 1 << 28,
            ResetCause::Watchdog => PIN | 1 << 29,
            ResetCause::BrownOut => PIN | 1 << 25,
        }
    }
}

/// The frequencies of the buses.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Clocks {
    /// HCLK, the core's clock, in Hz.
    pub hclk: u32,
    /// The HCLK cycles in a clock of APB1.
    pub apb1: u32,
    /// The HCLK cycles in a clock of APB2.
    pub apb2: u32,
}

impl Clocks {
    /// The HCLK cycles in a clock of a timer on a bus with this divider (RM0090 section 7.2).
    pub(crate) fn timer(divider: u32) -> u64 {
        u64::from(if divider == 1 { 1 } else { divider / 2 })
    }
}

/// The clock controller.
#[derive(Clone, Debug)]
pub(crate) struct Rcc {
    registers: [u32; REGISTERS],
    /// The crystal's frequency; 0 if none is fitted or it has stopped.
    crystal_hz: u32,
    /// The cycle at which each clock starts, by enable register and bit.
    since: [[u64; 32]; ENABLES],
}

impl Rcc {
    /// The state after power-on, with a crystal of this frequency.
    pub(crate) fn new(crystal_hz: u32) -> Self {
        let mut rcc = Rcc {
            registers: [0; REGISTERS],
            crystal_hz,
            since: [[0; 32]; ENABLES],
        };
        rcc.reset(ResetCause::PowerOn);
        rcc
    }

    /// Sets the reset values; the backup domain stays. The flags of earlier causes end with a power
    /// reset only, which a brown-out is too (RM0090 sections 7.1.2 and 7.3.21).
    pub(crate) fn reset(&mut self, cause: ResetCause) {
        let kept = match cause {
            ResetCause::PowerOn => (0, 0),
            ResetCause::BrownOut => (0, self.registers[BDCR]),
            ResetCause::Pin | ResetCause::Software | ResetCause::Watchdog => {
                (self.registers[CSR] & !3, self.registers[BDCR])
            }
        };
        self.registers = [0; REGISTERS];
        self.registers[CR] = 0x83;
        self.registers[PLLCFGR] = 0x2400_3010;
        self.registers[AHB1ENR] = CCMDATARAMEN;
        for (offset, value) in SLEEP_ENABLES {
            self.registers[offset / 4] = value;
        }
        self.since = [[0; 32]; ENABLES];
        self.registers[CSR] = kept.0 | cause.flags();
        self.registers[BDCR] = kept.1;
        self.registers[0x84 / 4] = 0x2000_3000;
    }

    /// Reads the register at `offset` from 0x40023800.
    pub(crate) fn read(&self, offset: u32) -> u32 {
        let index = offset as usize / 4;
        self.registers.get(index).copied().unwrap_or(0)
    }

    /// Writes the register at `offset` from 0x40023800.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: u64, warnings: &mut Warnings) {
        self.note_enables(offset, value, now);
        match offset as usize / 4 {
            CR => self.write_control(value),
            PLLCFGR => self.set_pll(value, warnings),
            CFGR => self.select(value, warnings),
            CIR => self.write_interrupts(value),
            BDCR => self.registers[BDCR] = value & !2 | (value & 1) << 1,
            CSR => self.write_status(value),
            index => {
                if let Some(register) = self.registers.get_mut(index) {
                    *register = value;
                }
            }
        }
        if !is_modelled(offset, value) {
            let address = BASE + offset;
            warnings.add(Warning::NotModelled { address });
        }
    }

    /// Switches all clocks on, as if long ago.
    #[cfg(test)]
    pub(crate) fn switch_all_on(&mut self) {
        for (offset, bits) in [
            (0x30, 0x7E74_11FF),
            (0x34, 0xC1),
            (0x38, 1),
            (0x40, 0x36FE_C9FF),
            (0x44, 0x7_5F33),
        ] {
            self.registers[offset / 4] = bits;
        }
    }

    /// Notes when the clocks that are switched on now will start.
    fn note_enables(&mut self, offset: u32, value: u32, now: u64) {
        let place = (offset.wrapping_sub(ENABLE) / 4) as usize;
        let Clocks { apb1, apb2, .. } = self.clocks();
        let Some(since) = self.since.get_mut(place) else {
            return;
        };
        let fresh = value & !self.registers[offset as usize / 4];
        let delay = match place {
            0..APB1_ENABLE => 2,
            APB1_ENABLE => 1 + apb1,
            _ => 1 + apb2,
        };
        for (bit, since) in since.iter_mut().enumerate() {
            if fresh >> bit & 1 != 0 {
                // The store itself takes one cycle to reach RCC.
                *since = now + 1 + u64::from(delay);
            }
        }
    }

    fn write_control(&mut self, value: u32) {
        let before = self.registers[CR];
        // HSEBYP can be written only while the crystal is off (section 7.3.1).
        let bypass = if before & HSEON != 0 { before } else { value } & HSEBYP;
        let value = value & !HSEBYP | bypass | self.in_use();
        let mut running = value & (HSION | HSEON | PLLON | PLLI2SON);
        if self.crystal_hz == 0 {
            running &= !HSEON;
        }
        if running & self.pll_source() == 0 {
            running &= !(PLLON | PLLI2SON);
        }
        let ready = HSION << 1 | HSERDY | PLLON << 1 | PLLI2SON << 1;
        self.registers[CR] = value & !ready | running << 1;
        self.switch();
    }

    /// The oscillator that feeds the PLLs, as its enable bit in RCC_CR.
    fn pll_source(&self) -> u32 {
        if self.registers[PLLCFGR] & PLL_FROM_CRYSTAL != 0 {
            HSEON
        } else {
            HSION
        }
    }

    /// The sources that the system clock uses, directly or indirectly, as their enable bits.
    fn in_use(&self) -> u32 {
        match self.registers[CFGR] >> 2 & 3 {
            0 => HSION,
            1 => HSEON,
            _ => PLLON | self.pll_source(),
        }
    }

    /// Writes RCC_PLLCFGR: its fields stay while a PLL that uses them is on (section 7.3.2).
    fn set_pll(&mut self, value: u32, warnings: &mut Warnings) {
        let before = self.registers[PLLCFGR];
        let on = self.registers[CR];
        let fixed = match (on & PLLON != 0, on & PLLI2SON != 0) {
            (true, _) => u32::MAX,
            (false, true) => SHARED_BY_PLLS,
            (false, false) => 0,
        };
        if (value ^ before) & fixed != 0 {
            warnings.add(Warning::PllRunning);
        }
        self.registers[PLLCFGR] = value & !fixed | before & fixed;
    }

    fn write_interrupts(&mut self, value: u32) {
        let flag = self.registers[CIR] & CSSF;
        let flag = if value & CSSC != 0 { 0 } else { flag };
        self.registers[CIR] = value & 0x3F00 | flag;
    }

    fn write_status(&mut self, value: u32) {
        let flags = self.registers[CSR] & 0xFE00_0000;
        let flags = if value & RMVF != 0 { 0 } else { flags };
        self.registers[CSR] = flags | value & 1 | (value & 1) << 1;
    }

    /// Selects the system clock. SWS shows the clock in use, which may not be the requested one.
    fn select(&mut self, value: u32, warnings: &mut Warnings) {
        self.registers[CFGR] = value & !0xC | self.registers[CFGR] & 0xC;
        if !self.switch() {
            warnings.add(Warning::ClockNotReady);
        }
    }

    /// Switches to the requested clock if it is ready (section 7.2.6). Returns whether it is.
    fn switch(&mut self) -> bool {
        let requested = self.registers[CFGR] & 3;
        let ready = match requested {
            0 => HSION << 1,
            1 => HSERDY,
            2 => PLLON << 1,
            _ => 0,
        };
        let is_ready = self.registers[CR] & ready != 0;
        if is_ready {
            self.registers[CFGR] = self.registers[CFGR] & !0xC | requested << 2;
        }
        is_ready
    }

    /// The crystal stops. Returns whether the clock security system noticed (RM0090 section 7.2.7):
    /// then the crystal is off, and if the system clock used it, the internal oscillator has taken
    /// over. Without the clock security system the chip would stand still, which is not modelled.
    pub(crate) fn crystal_fails(&mut self) -> bool {
        let guarded = self.registers[CR] & CSSON != 0 && self.registers[CR] & HSERDY != 0;
        self.crystal_hz = 0;
        if guarded {
            let in_use = self.in_use();
            self.registers[CR] &= !(HSEON | HSERDY);
            if in_use & HSEON != 0 {
                if in_use & PLLON != 0 {
                    let plls = PLLON | PLLI2SON;
                    self.registers[CR] &= !(plls | plls << 1);
                }
                self.registers[CR] |= HSION | HSION << 1;
                self.registers[CFGR] &= !0xF;
            }
            self.registers[CIR] |= CSSF;
        }
        guarded
    }

    /// Returns true if the clock security system requests the NMI.
    pub(crate) fn non_maskable(&self) -> bool {
        self.registers[CIR] & CSSF != 0
    }

    /// The frequencies that the registers select.
    pub(crate) fn clocks(&self) -> Clocks {
        let configuration = self.registers[CFGR];
        let system = match configuration >> 2 & 3 {
            0 => HSI_HZ,
            1 => self.crystal_hz,
            _ => self.pll().2,
        };
        let divided = match configuration >> 4 & 15 {
            code @ 8..=11 => system >> (code - 7),
            code @ 12..=15 => system >> (code - 6),
            _ => system,
        };
        Clocks {
            hclk: divided.max(1),
            apb1: bus_divider(configuration >> 10),
            apb2: bus_divider(configuration >> 13),
        }
    }

    /// The clock that the crystal makes for the RTC (RM0090 section 7.3.3, RTCPRE): edges, and the
    /// cycles of the core in which they come. No edges if the crystal or its divider is off.
    pub(crate) fn crystal_for_rtc(&self) -> (u64, u64) {
        let divider = self.registers[CFGR] >> 16 & 0x1F;
        let edges = match self.registers[CR] & HSEON != 0 && divider >= 2 {
            true => self.crystal_hz,
            false => 0,
        };
        let cycles = u64::from(self.clocks().hclk) * u64::from(divider);
        (edges.into(), cycles)
    }

    /// The frequencies of the PLL's input, of its oscillator and of its output, Hz (RM0090 section
    /// 7.3.2).
    fn pll(&self) -> (u32, u64, u32) {
        let register = self.registers[PLLCFGR];
        let source = if register & PLL_FROM_CRYSTAL != 0 {
            self.crystal_hz
        } else {
            HSI_HZ
        };
        let input = source / (register & 63).max(1);
        let oscillator = u64::from(input) * u64::from(register >> 6 & 511);
        let divider = 2 * u64::from(register >> 16 & 3) + 2;
        (input, oscillator, (oscillator / divider) as u32)
    }

    /// The frequency for USB, Hz: 0 while the PLL is off (RM0090 section 7.3.2, PLLQ).
    pub(crate) fn usb_hz(&self) -> u32 {
        let divider = self.registers[PLLCFGR] >> 24 & 15;
        if self.registers[CR] & PLLON << 1 == 0 || divider < 2 {
            return 0;
        }
        (self.pll().1 / u64::from(divider)) as u32
    }

    /// Warns if limits of the chip are exceeded (its data sheet, tables 14 and 36; RM0090 table 11,
    /// sections 3.5.1 and 7.3.2). `scale_1` says whether the core has the higher of its two
    /// voltages (PWR_CR.VOS).
    pub(crate) fn check(&self, wait_states: u32, scale_1: bool, warnings: &mut Warnings) {
        let Clocks { hclk, apb1, apb2 } = self.clocks();
        let (input, oscillator, _) = self.pll();
        let register = self.registers[PLLCFGR];
        let good = (950_000..=2_100_000).contains(&input)
            && (100_000_000..=432_000_000).contains(&oscillator)
            && register & 63 >= 2
            && (50..=432).contains(&(register >> 6 & 511))
            && hclk <= 168_000_000;
        if self.registers[CFGR] >> 2 & 3 == 2 && !good {
            warnings.add(Warning::PllOutOfRange { hclk });
        }
        if !scale_1 && hclk > 144_000_000 {
            warnings.add(Warning::VoltageTooLow { hclk });
        }
        if hclk / apb1 > 42_000_000 || hclk / apb2 > 84_000_000 {
            warnings.add(Warning::BusTooFast { hclk });
        }
        if (wait_states + 1) * 30_000_000 < hclk {
            warnings.add(Warning::TooFewWaitStates { hclk });
        }
    }

    /// The cycle at which the last of the clocks that were switched on starts.
    pub(crate) fn clocks_come_at(&self) -> u64 {
        self.since
            .iter()
            .flatten()
            .fold(0, |all, &one| all.max(one))
    }

    /// The cycle at which the clock of the peripheral at an address starts; `None` if it is off
    /// (RM0090 sections 7.3.10 to 7.3.14).
    pub(crate) fn clock_of(&self, address: u32) -> Option<u64> {
        let Some((register, bit)) = enable_of(address) else {
            return Some(0);
        };
        let on = self.read(register) >> bit & 1 != 0;
        on.then(|| self.since[((register - ENABLE) / 4) as usize][bit as usize])
    }

    /// Returns true if the peripheral at an address is held in reset.
    pub(crate) fn is_held(&self, address: u32) -> bool {
        enable_of(address)
            .is_some_and(|place| self.read(place.0 - ENABLES_AFTER) >> place.1 & 1 != 0)
    }
}

/// Returns true if a write of `value` to RCC's register at `offset` resets the peripheral at an
/// address.
pub(crate) fn resets(offset: u32, value: u32, address: u32) -> bool {
    enable_of(address)
        .is_some_and(|(register, bit)| register - ENABLES_AFTER == offset && value >> bit & 1 != 0)
}

/// The enable register and the bit of the peripheral at an address; the reset registers have the
/// same bits.
fn enable_of(address: u32) -> Option<(u32, u32)> {
    let page = address & !0x3FF;
    Some(match page {
        0x4002_0000..=0x4002_23FF => (0x30, page >> 10 & 15),
        0x4002_3000 => (0x30, 12),
        0x4002_6000 => (0x30, 21),
        0x4002_6400 => (0x30, 22),
        0x5000_0000..=0x5003_FFFF => (0x34, 7),
        0x4000_0000..=0x4000_23FF => (0x40, page >> 10 & 15),
        0x4000_4400..=0x4000_53FF => (0x40, 17 + ((page - 0x4000_4400) >> 10)),
        0x4000_7000 => (0x40, 28),
        0x4001_0000 => (0x44, 0),
        0x4001_0400 => (0x44, 1),
        0x4001_1000 => (0x44, 4),
        0x4001_1400 => (0x44, 5),
        0x4001_2000 => (0x44, 8),
        0x4001_3800 => (0x44, 14),
        0x4001_4000..=0x4001_4BFF => (0x44, 16 + (page >> 10 & 3)),
        _ => return None,
    })
}

/// Returns true if everything that a value asks of the register at `offset` is modelled.
fn is_modelled(offset: u32, value: u32) -> bool {
    let awake = |&(place, bits): &(usize, u32)| place as u32 != offset || value == bits;
    match offset as usize / 4 {
        AHB1ENR => value & CCMDATARAMEN != 0,
        CFGR => value & OUTPUTS == 0,
        CIR => value & READY_INTERRUPTS == 0,
        BDCR => value == 0,
        SSCGR => value & SSCGEN == 0,
        _ => SLEEP_ENABLES.iter().all(awake),
    }
}

/// The divider of a peripheral bus (RCC_CFGR.PPRE).
fn bus_divider(code: u32) -> u32 {
    if code & 4 == 0 {
        1
    } else {
        2 << (code & 3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn started() -> (Rcc, Warnings) {
        let (mut rcc, mut warnings) = (Rcc::new(8_000_000), Warnings::default());
        rcc.write(
            0x04,
            4 | 168 << 6 | PLL_FROM_CRYSTAL | 7 << 24,
            0,
            &mut warnings,
        );
        rcc.write(0x00, 0x83 | HSEON | PLLON, 0, &mut warnings);
        rcc.write(0x08, 2 | 5 << 10 | 4 << 13, 0, &mut warnings);
        (rcc, warnings)
    }

    #[test]
    fn eight_megahertz_become_168_with_the_buses_at_42_and_84() {
        let (rcc, mut warnings) = started();
        let clocks = rcc.clocks();
        assert_eq!((clocks.hclk, clocks.apb1, clocks.apb2), (168_000_000, 4, 2));
        assert_eq!(rcc.read(0x08) & 0xC, 8, "SWS");
        rcc.check(5, true, &mut warnings);
        assert_eq!(warnings.all(), []);
        assert_eq!(rcc.usb_hz(), 48_000_000);
        rcc.check(4, true, &mut warnings);
        rcc.check(5, false, &mut warnings);
        let hclk = 168_000_000;
        let expected = [
            Warning::TooFewWaitStates { hclk },
            Warning::VoltageTooLow { hclk },
        ];
        assert_eq!(warnings.all(), expected);
    }

    #[test]
    fn the_plls_settings_stay_while_it_is_on() {
        let (mut rcc, mut warnings) = started();
        let before = rcc.read(0x04);
        rcc.write(0x04, before, 0, &mut warnings);
        assert_eq!(warnings.all(), []);
        rcc.write(0x04, 8 | 336 << 6 | 7 << 24, 0, &mut warnings);
        assert_eq!(rcc.read(0x04), before);
        assert_eq!(warnings.all(), [Warning::PllRunning]);
    }

    #[test]
    fn sources_that_are_in_use_cannot_be_switched_off() {
        let (mut rcc, mut warnings) = started();
        rcc.write(0x00, 0x80, 0, &mut warnings);
        assert_eq!(rcc.read(0x00), 0x80 | HSEON | HSERDY | PLLON | PLLON << 1);
        assert_eq!(rcc.clocks().hclk, 168_000_000);
        rcc.write(0x00, 0x81 | HSEON | PLLON, 0, &mut warnings);
        rcc.write(0x08, 0, 0, &mut warnings);
        rcc.write(0x00, 0x80, 0, &mut warnings);
        assert_eq!(rcc.read(0x00), 0x83);
    }

    #[test]
    fn a_clock_that_was_selected_too_early_takes_over_once_it_is_ready() {
        let (mut rcc, mut warnings) = (Rcc::new(8_000_000), Warnings::default());
        rcc.write(0x08, 1, 0, &mut warnings);
        assert_eq!(rcc.clocks().hclk, HSI_HZ);
        assert_eq!(warnings.all(), [Warning::ClockNotReady]);
        rcc.write(0x00, 0x83 | HSEON, 0, &mut warnings);
        assert_eq!(rcc.clocks().hclk, 8_000_000);
    }

    #[test]
    fn a_pll_without_its_source_does_not_lock() {
        let (mut rcc, mut warnings) = (Rcc::new(8_000_000), Warnings::default());
        rcc.write(0x04, rcc.read(0x04) | PLL_FROM_CRYSTAL, 0, &mut warnings);
        rcc.write(0x00, 0x83 | PLLON, 0, &mut warnings);
        assert_eq!(rcc.read(0x00) & PLLON << 1, 0);
        rcc.write(0x00, 0x83 | PLLON | HSEON, 0, &mut warnings);
        assert_ne!(rcc.read(0x00) & PLLON << 1, 0);
    }

    #[test]
    fn what_is_not_modelled_is_said() {
        for (offset, value) in [
            (0x08, 1 << 21),
            (0x0C, 1 << 12),
            (0x60, 0),
            (0x70, 1),
            (0x80, SSCGEN),
        ] {
            let (mut rcc, mut warnings) = started();
            rcc.write(offset, value, 0, &mut warnings);
            let address = BASE + offset;
            assert!(warnings.all().contains(&Warning::NotModelled { address }));
        }
    }

    #[test]
    fn a_crystal_that_is_not_there_never_becomes_ready() {
        let (mut rcc, mut warnings) = (Rcc::new(0), Warnings::default());
        rcc.write(0x00, 0x83 | HSEON, 0, &mut warnings);
        assert_eq!(rcc.read(0x00) & HSERDY, 0);
        rcc.write(0x08, 1, 0, &mut warnings);
        assert_eq!(rcc.clocks().hclk, HSI_HZ);
        assert_eq!(warnings.all(), [Warning::ClockNotReady]);
    }

    #[test]
    fn the_clock_security_system_falls_back_to_the_internal_oscillator() {
        let (mut rcc, mut warnings) = started();
        assert!(!rcc.clone().crystal_fails(), "not asked to watch");
        rcc.write(0x00, rcc.read(0x00) | CSSON, 0, &mut warnings);
        // The internal oscillator is forced on (section 7.3.1).
        rcc.write(0x00, rcc.read(0x00) & !HSION, 0, &mut warnings);
        assert!(rcc.crystal_fails());
        assert_eq!(rcc.clocks().hclk, HSI_HZ);
        assert_eq!(rcc.read(0x00), 0x83 | CSSON);
        assert!(rcc.non_maskable());
        rcc.write(0x0C, CSSC, 0, &mut warnings);
        assert!(!rcc.non_maskable());
    }

    #[test]
    fn a_crystal_that_is_not_in_use_changes_no_clock_when_it_stops() {
        let (mut rcc, mut warnings) = started();
        rcc.write(0x08, 0, 0, &mut warnings);
        rcc.write(0x00, 0x83 | HSEON | CSSON, 0, &mut warnings);
        rcc.write(0x04, 8 | 100 << 6, 0, &mut warnings);
        rcc.write(0x00, 0x83 | HSEON | CSSON | PLLON, 0, &mut warnings);
        rcc.write(0x08, 2, 0, &mut warnings);
        assert!(rcc.crystal_fails() && rcc.non_maskable());
        assert_eq!(rcc.clocks().hclk, 100_000_000);
    }

    #[test]
    fn reset_flags_add_up_until_they_are_removed() {
        let mut rcc = Rcc::new(8_000_000);
        assert_eq!(rcc.read(0x74), 0x0E00_0000);
        rcc.reset(ResetCause::Watchdog);
        assert_eq!(rcc.read(0x74), 0x2E00_0000);
        rcc.write(0x74, RMVF, 0, &mut Warnings::default());
        rcc.reset(ResetCause::Software);
        assert_eq!(rcc.read(0x74), 0x1400_0000);
    }

    #[test]
    fn a_brown_out_is_told_from_power_that_comes_on() {
        let mut rcc = Rcc::new(8_000_000);
        rcc.write(0x74, RMVF, 0, &mut Warnings::default());
        rcc.reset(ResetCause::Watchdog);
        rcc.reset(ResetCause::BrownOut);
        assert_eq!(rcc.read(0x74), 0x0600_0000);
    }

    #[test]
    fn each_peripheral_has_its_enable_bit() {
        let (mut rcc, mut warnings) = started();
        assert_eq!(rcc.clock_of(0x4002_1000), None);
        rcc.write(0x30, 1 << 4, 0, &mut warnings); // GPIOE
        assert_eq!(rcc.clock_of(0x4002_1000), Some(3));
        rcc.write(0x40, 1 << 17 | 1, 0, &mut warnings); // USART2, TIM2
        assert_eq!(rcc.clock_of(0x4000_4400), Some(6));
        assert_eq!(rcc.clock_of(0x4000_0000), Some(6));
        assert_eq!(rcc.clock_of(0x4000_0400), None);
        rcc.write(0x44, 1 << 18, 0, &mut warnings); // TIM11
        assert_eq!(rcc.clock_of(0x4001_4800), Some(4));
        assert_eq!(rcc.clock_of(0x4001_4400), None);
    }
}
