//! The analog-to-digital converter (RM0090 chapter 13): ADC1's injected group, started by software.
//! It converts up to four channels one after the other.
//!
//! A channel takes (sections 13.3.2 and 13.5):
//!
//! ```text
//! conversion = (sampling time + 12) × 2 (ADCPRE + 1) / f_PCLK2
//! ```
//!
//! A channel sees only a pin in analog mode; the conversion of another one gives 0, and a warning.
//!
//! Not modelled, and warned of if a program asks for it: regular groups, triggers, DMA, fewer
//! than 12 bits, alignment to the left, the analog watchdog, channels without a pin, converters that
//! work together, a sampling time that changes during a conversion (section 13.13.4). ADC2 and ADC3
//! do not exist here.

/// ADC_SR: the injected group has ended; the injected group has begun.
const JEOC: u32 = 1 << 2;
const JSTRT: u32 = 1 << 3;
/// ADC_CR1: convert all channels of a group; bits that are not modelled.
const SCAN: u32 = 1 << 8;
const CR1_UNKNOWN: u32 = 0x07C0_FEFF;
/// ADC_CR2: converter on; start of the injected group; bits that are not modelled.
const ADON: u32 = 1;
const JSWSTART: u32 = 1 << 22;
const CR2_UNKNOWN: u32 = 0x7F3F_0F02;

/// ADC_CCR: bits that are not modelled, all but ADCPRE.
const CCR_UNKNOWN: u32 = !0x0003_0000;

/// Offsets of the registers.
const SR: usize = 0x00;
const CR1: usize = 0x04;
const CR2: usize = 0x08;
const SMPR1: usize = 0x0C;
const SMPR2: usize = 0x10;
const JOFR: usize = 0x14;
const HTR: usize = 0x24;
const JSQR: usize = 0x38;
const JDR: usize = 0x3C;
const DR: usize = 0x4C;
const CSR: usize = 0x300;
const CCR: usize = 0x304;
/// The number of words up to the last register of ADC1.
const WORDS: usize = DR / 4 + 1;

/// The clocks of each sampling time, by its code.
const SAMPLING: [u64; 8] = [3, 15, 28, 56, 84, 112, 144, 480];
/// The clocks of the conversion itself, with 12 bits.
const CONVERSION: u64 = 12;
/// The reciprocal of the longest time from ADON to right conversions, Hz (data sheet, table 67: 3
/// µs).
const STABLE_HZ: u64 = 333_333;

/// Channels with a pin.
const CHANNELS: usize = 16;

/// The channel at a pin of port 0 (A) to 2 (C), if it has one (data sheet, table 7).
pub(crate) fn channel(port: u8, number: u8) -> Option<usize> {
    let channel = match (port, number) {
        (0, 0..8) => number,
        (1, 0..2) => 8 + number,
        (2, 0..6) => 10 + number,
        _ => return None,
    };
    Some(channel.into())
}

/// The clock of the converter, in cycles of the core.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clock {
    /// The present cycle.
    pub(crate) now: u64,
    /// Cycles in a clock of APB2.
    pub(crate) apb2: u64,
    /// Cycles in a second.
    pub(crate) hclk: u64,
}

/// A group under way.
#[derive(Clone, Debug)]
struct Group {
    ends: u64,
    /// The results, in the order of the group.
    results: Vec<u32>,
}

/// ADC1, and the registers that all converters share.
#[derive(Clone, Debug)]
pub(crate) struct Adc {
    /// The voltages at the channels, as shares of the reference voltage; the world sets them.
    inputs: [f64; CHANNELS],
    /// The channels whose pins are in analog mode, one bit each.
    pub(crate) analog: u16,
    /// True if a channel has been converted whose pin was not in analog mode, since the last call
    /// of [`Adc::take_misuse`].
    misuse: bool,
    words: [u32; WORDS],
    common: u32,
    group: Option<Group>,
    /// The first cycle with right conversions.
    stable_at: u64,
}

impl Adc {
    pub(crate) fn new() -> Self {
        let mut words = [0; WORDS];
        words[HTR / 4] = 0xFFF;
        Adc {
            inputs: [0.0; CHANNELS],
            analog: 0,
            misuse: false,
            words,
            common: 0,
            group: None,
            stable_at: 0,
        }
    }

    /// Resets the registers; the voltages stay.
    pub(crate) fn reset(&mut self) {
        *self = Adc {
            inputs: self.inputs,
            analog: self.analog,
            ..Adc::new()
        };
    }

    /// Sets the voltage at a channel, as a share of the reference voltage.
    pub(crate) fn set_input(&mut self, channel: usize, share: f64) {
        self.inputs[channel] = share.clamp(0.0, 1.0);
    }

    /// Returns true if a channel has been converted whose pin was not in analog mode, since the
    /// last call.
    pub(crate) fn take_misuse(&mut self) -> bool {
        core::mem::take(&mut self.misuse)
    }

    /// Reads the register at `offset` from 0x40012000.
    pub(crate) fn read(&mut self, offset: u32, now: u64) -> u32 {
        self.end_group(now);
        match offset as usize {
            CSR => self.words[SR / 4],
            CCR => self.common,
            offset => self.words.get(offset / 4).copied().unwrap_or(0),
        }
    }

    /// Writes the register at `offset` from 0x40012000. Returns whether the program asks for
    /// something that is not modelled.
    pub(crate) fn write(&mut self, offset: u32, value: u32, clock: Clock) -> bool {
        self.end_group(clock.now);
        let offset = offset as usize;
        match offset {
            SR => self.words[SR / 4] &= value,
            CCR => self.common = value,
            CR2 => self.control(value, clock),
            // A new sequence restarts the group (section 13.3.3).
            JSQR => {
                self.words[JSQR / 4] = value;
                if self.group.is_some() {
                    self.start(clock);
                }
            }
            _ => {
                if let Some(word) = self.words.get_mut(offset / 4) {
                    *word = value;
                }
            }
        }
        match offset {
            CR1 => value & CR1_UNKNOWN != 0,
            CR2 => value & CR2_UNKNOWN != 0 || self.converts_inside(),
            SMPR1 | SMPR2 => self.group.is_some(),
            JSQR => self.converts_inside(),
            CCR => value & CCR_UNKNOWN != 0,
            _ => false,
        }
    }

    /// Returns true if a channel without a pin is being converted: the temperature, the reference,
    /// or the battery (section 13.3.3).
    fn converts_inside(&self) -> bool {
        self.group.is_some() && self.channels().any(|channel| channel >= CHANNELS)
    }

    fn control(&mut self, value: u32, clock: Clock) {
        let was_on = self.words[CR2 / 4] & ADON != 0;
        self.words[CR2 / 4] = value & !JSWSTART;
        match (was_on, value & ADON != 0) {
            (false, true) => self.stable_at = clock.now + clock.hclk / STABLE_HZ,
            (_, false) => self.group = None,
            (true, true) if value & JSWSTART != 0 => self.start(clock),
            (true, true) => {}
        }
    }

    /// The channels of the injected group, in their order. JSQ4 holds the last one (section
    /// 13.13.12).
    fn channels(&self) -> impl Iterator<Item = usize> {
        let sequence = self.words[JSQR / 4];
        let length = match self.words[CR1 / 4] & SCAN {
            0 => 1,
            _ => (sequence >> 20 & 3) + 1,
        };
        let first = 3 - (sequence >> 20 & 3);
        (first..first + length).map(move |place| (sequence >> (5 * place) & 0x1F) as usize)
    }

    /// Samples the channels of the injected group.
    fn start(&mut self, clock: Clock) {
        let divider = 2 * (u64::from(self.common >> 16 & 3) + 1);
        let clocks: u64 = self
            .channels()
            .map(|one| self.sampling(one) + CONVERSION)
            .sum();
        let is_stable = clock.now >= self.stable_at;
        let sees = |channel: usize| channel >= CHANNELS || self.analog >> channel & 1 != 0;
        let results = self
            .channels()
            .map(|channel| match self.inputs.get(channel) {
                Some(share) if is_stable && sees(channel) => (share * 4095.0).round() as u32,
                _ => 0,
            });
        let results = results.collect();
        self.misuse |= !self.channels().all(sees);
        self.words[SR / 4] |= JSTRT;
        let ends = clock.now + clocks * divider * clock.apb2;
        self.group = Some(Group { ends, results });
    }

    /// The clocks for which a channel is sampled.
    fn sampling(&self, channel: usize) -> u64 {
        let (register, place) = match channel {
            0..10 => (SMPR2, channel),
            _ => (SMPR1, channel - 10),
        };
        SAMPLING[(self.words[register / 4] >> (3 * place) & 7) as usize]
    }

    fn end_group(&mut self, now: u64) {
        let Some(Group { results, .. }) = self.group.take_if(|group| group.ends <= now) else {
            return;
        };
        for (place, result) in results.into_iter().enumerate() {
            // The result less its offset; below zero the sign is extended (section 13.4).
            let offset = self.words[JOFR / 4 + place];
            self.words[JDR / 4 + place] = result.wrapping_sub(offset) & 0xFFFF;
        }
        self.words[SR / 4] |= JEOC;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(now: u64) -> Clock {
        Clock {
            now,
            apb2: 2,
            hclk: 168_000_000,
        }
    }

    /// A converter that has long been on, at 21 MHz, with two channels of 480 clocks in its group:
    /// 8 and 9.
    fn ready() -> Adc {
        let mut adc = Adc::new();
        adc.analog = 3 << 8;
        adc.set_input(8, 0.5);
        adc.set_input(9, 1.0);
        for (register, value) in [
            (CCR, 1 << 16),
            (CR1, SCAN),
            (SMPR2, 7 << 27 | 7 << 24),
            (JSQR, 1 << 20 | 9 << 15 | 8 << 10),
            (CR2, ADON),
        ] {
            assert!(!adc.write(register as u32, value, at(0)));
        }
        adc
    }

    #[test]
    fn a_group_takes_its_time_and_its_first_channel_is_the_first_result() {
        let mut adc = ready();
        adc.write(CR2 as u32, ADON | JSWSTART, at(1000));
        let ends = 1000 + 2 * 492 * 4 * 2;
        assert_eq!(adc.read(SR as u32, ends - 1), JSTRT);
        assert_eq!(adc.read(JDR as u32, ends - 1), 0);
        assert_eq!(adc.read(JDR as u32, ends), 2048);
        assert_eq!(adc.read(JDR as u32 + 4, ends), 4095);
        assert_eq!(adc.read(SR as u32, ends), JSTRT | JEOC);
        assert_eq!(adc.read(CR2 as u32, ends), ADON, "JSWSTART is cleared");
        adc.write(SR as u32, 0, at(ends));
        assert_eq!(adc.read(CSR as u32, ends), 0);
    }

    #[test]
    fn without_scan_one_channel_is_converted_and_too_early_none() {
        let mut adc = ready();
        adc.write(CR2 as u32, ADON | JSWSTART, at(503));
        assert_eq!(adc.read(JDR as u32, 1_000_000), 0, "2.99 us after ADON");
        adc.write(CR1 as u32, 0, at(1_000_000));
        adc.write(CR2 as u32, ADON | JSWSTART, at(1_000_000));
        assert_eq!(adc.read(JDR as u32, 2_000_000), 2048);
        assert_eq!(adc.read(JDR as u32 + 4, 2_000_000), 0);
    }

    #[test]
    fn an_offset_is_taken_off_and_regular_groups_are_warned_of() {
        let mut adc = ready();
        adc.write(JOFR as u32, 2050, at(1000));
        adc.write(CR2 as u32, ADON | JSWSTART, at(1000));
        assert_eq!(adc.read(JDR as u32, 1_000_000), 0xFFFE);
        assert!(adc.write(CR2 as u32, ADON | 1 << 30, at(1_000_000)));
    }

    #[test]
    fn channels_without_a_pin_and_joined_converters_are_warned_of() {
        let mut adc = ready();
        assert!(adc.write(CCR as u32, 1 << 16 | 1 << 23, at(1000)));
        assert!(adc.write(CCR as u32, 1 << 16 | 5, at(1000)));
        assert!(!adc.write(JSQR as u32, 16 << 15, at(1000)));
        assert!(adc.write(CR2 as u32, ADON | JSWSTART, at(1000)));
    }

    #[test]
    fn a_pin_in_another_mode_is_not_seen() {
        let mut adc = ready();
        adc.analog = 1 << 8;
        adc.write(CR2 as u32, ADON | JSWSTART, at(1000));
        assert_eq!(adc.read(JDR as u32, 1_000_000), 2048);
        assert_eq!(adc.read(JDR as u32 + 4, 1_000_000), 0);
        assert!(adc.take_misuse() && !adc.take_misuse());
    }

    #[test]
    fn a_sampling_time_stays_as_it_is_during_a_conversion() {
        let mut adc = ready();
        adc.write(CR2 as u32, ADON | JSWSTART, at(1000));
        assert!(adc.write(SMPR2 as u32, 0, at(1001)));
        assert!(!adc.write(SMPR2 as u32, 0, at(1_000_000)));
    }
}
