//! A timer's channels: their outputs, PWM and similar modes (RM0090 sections 17.3.8 to 17.3.11,
//! 18.3.7 to 18.3.9), and their inputs, which capture the count (section 18.3.5).
//!
//! ```text
//!  mode 1 (110)  OCxREF = count < CCRx        OCx = OCxREF, inverted by CCxP, while CCxE (and MOE)
//!  mode 2 (111)  OCxREF = count >= CCRx       OCxN = its complement, while CCxNE
//! ```
//!
//! In these modes OCxREF changes only if the result of the comparison changes, or if the mode
//! was frozen before (section 18.4.7, OC1M). A PWM that begins from a forced level keeps that level
//! until then; a PWM of 100 % keeps it for ever.
//!
//! If OCxPE is set, a new CCRx takes effect at the next update event: with a PWM of 50 Hz that may
//! be 20 ms later. Without OCxPE the manual guarantees PWM in one-pulse mode only; here CCRx takes
//! effect at once. A forced level, CCxE and MOE always take effect at once.
//!
//! A channel whose CCxS is not 0 is an input: it drives no pin and matches no count, and its CCRx
//! cannot be written. CCxS itself cannot be written while CCxE is set.

/// TIMx_BDTR. OSSI: outputs stay driven while MOE is off. OSSR: while MOE is on, an output that is
/// not enabled is driven if its complement is enabled. MOE: main output enable. The other bits are
/// not modelled.
const OSSI: u32 = 1 << 10;
const OSSR: u32 = 1 << 11;
const MOE: u32 = 1 << 15;

/// One of a timer's outputs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Output {
    /// The index of the channel, 0 for channel 1.
    pub(crate) channel: u8,
    /// True for the complementary output, OCxN.
    pub(crate) complementary: bool,
}

/// The way in which a channel derives its reference from matches (TIMx_CCMR.OCxM).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Mode {
    Frozen,
    ActiveOnMatch,
    InactiveOnMatch,
    Toggle,
    ForcedInactive,
    ForcedActive,
    Pwm1,
    Pwm2,
}

/// The registers of the channels.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outputs {
    ccmr: [u32; 2],
    ccer: u32,
    ccr: [u32; 4],
    bdtr: u32,
    /// The compare values in force.
    active: [u32; 4],
    /// The reference signals of the channels, OCxREF.
    reference: [bool; 4],
    /// The last results of the comparisons: whether the count is below the compare value.
    below: [bool; 4],
    /// The channels that have just changed from frozen to PWM, one bit each.
    thawed: u8,
    /// Edges of inputs since the last capture.
    edges: [u8; 4],
    /// True if the timer drove a pin at the last call of [`Outputs::take_driving`].
    drove: bool,
}

impl Outputs {
    /// The compare value of a channel that is in force.
    pub(crate) fn compare(&self, channel: usize) -> u32 {
        self.active[channel]
    }

    /// Returns true if the timer drives any pin, or did at the last call.
    pub(crate) fn take_driving(&mut self) -> bool {
        let outputs = (0..4).filter(|&channel| !self.is_input(channel));
        let enables = outputs.fold(0, |all, channel| all | 5 << (4 * channel));
        let driving = self.ccer & enables != 0;
        core::mem::replace(&mut self.drove, driving) || driving
    }

    /// An update event: new compare values come into force.
    pub(crate) fn update(&mut self) {
        self.active = self.ccr;
    }

    /// Returns true if a channel is an input (TIMx_CCMR.CCxS).
    pub(crate) fn is_input(&self, channel: usize) -> bool {
        half(self.ccmr, channel) & 3 != 0
    }

    /// Returns true if a channel uses something that is not modelled: as an input the trigger or a
    /// filter; as an output the external signal that clears it (OCxCE).
    pub(crate) fn is_conditioned(&self, channel: usize) -> bool {
        const CLEARED_FROM_OUTSIDE: u32 = 1 << 7;
        let half = half(self.ccmr, channel);
        match half & 3 {
            0 => half & CLEARED_FROM_OUTSIDE != 0,
            3 => true,
            _ => half >> 4 != 0,
        }
    }

    /// Counts an edge of an input. Returns whether it is one that is captured: every first, second,
    /// fourth or eighth edge, as ICxPSC says (section 18.4.7).
    pub(crate) fn passes_prescaler(&mut self, channel: usize) -> bool {
        let every = 1 << (half(self.ccmr, channel) >> 2 & 3);
        self.edges[channel] = (self.edges[channel] + 1) % every;
        self.edges[channel] == 0
    }

    /// Returns true if a channel captures an edge of the timer's pin `input`. CCxS selects the pin
    /// of the channel or of its neighbour. CCxNP and CCxP select rising, falling or both edges
    /// (section 18.4.9). CCxE enables the capture.
    pub(crate) fn captures(&self, channel: usize, input: usize, rises: bool) -> bool {
        let selected = match half(self.ccmr, channel) & 3 {
            1 => input == channel,
            2 => input == channel ^ 1,
            _ => false,
        };
        let bits = self.ccer >> (4 * channel);
        let edge = match bits >> 1 & 5 {
            0 => rises,
            1 => !rises,
            5 => true,
            _ => false,
        };
        selected && edge && bits & 1 != 0
    }

    /// Stores the count of an edge.
    pub(crate) fn capture(&mut self, channel: usize, count: u32) {
        self.ccr[channel] = count;
    }

    /// Updates the references to the count and the channels that match it.
    pub(crate) fn follow(&mut self, count: u32, matched: u8) {
        for channel in 0..4 {
            let matches = matched >> channel & 1 != 0;
            let reference = &mut self.reference[channel];
            let below = count < self.active[channel];
            let before = core::mem::replace(&mut self.below[channel], below);
            let looks = below != before || self.thawed >> channel & 1 != 0;
            *reference = match mode(self.ccmr, channel) {
                Mode::Frozen => *reference,
                Mode::ActiveOnMatch => *reference || matches,
                Mode::InactiveOnMatch => *reference && !matches,
                Mode::Toggle => *reference != matches,
                Mode::ForcedInactive => false,
                Mode::ForcedActive => true,
                Mode::Pwm1 if looks => below,
                Mode::Pwm2 if looks => !below,
                Mode::Pwm1 | Mode::Pwm2 => *reference,
            };
        }
        self.thawed = 0;
    }

    /// Returns true if the outputs of an advanced timer use neither breaks, dead times nor locks.
    pub(crate) fn has_plain_levels(&self) -> bool {
        self.bdtr & !(MOE | OSSR | OSSI) == 0
    }

    /// The level of an output; `None` if the timer does not drive it and the pin's pull decides
    /// (RM0090 section 18.4.9).
    pub(crate) fn level(&self, output: Output) -> Option<bool> {
        let bits = self.ccer >> (4 * output.channel);
        let inverted = bits >> 1 & 1 != 0;
        let drives = bits & 1 != 0 && !self.is_input(output.channel.into());
        drives.then_some(self.reference[usize::from(output.channel)] ^ inverted)
    }

    /// The level of an output of TIM1 or TIM8, which has `idle_level` while MOE is off (RM0090
    /// section 17.4.9).
    pub(crate) fn advanced_level(&self, output: Output, idle_level: bool) -> Option<bool> {
        let bits = self.ccer >> (4 * output.channel);
        let (enabled, inverted) = if output.complementary {
            (bits >> 2 & 1 != 0, bits >> 3 & 1 != 0)
        } else {
            (bits & 1 != 0, bits >> 1 & 1 != 0)
        };
        if bits & 5 == 0 || self.is_input(output.channel.into()) {
            return None;
        }
        if self.bdtr & MOE == 0 {
            return (self.bdtr & OSSI != 0).then_some(idle_level);
        }
        if !enabled {
            return (self.bdtr & OSSR != 0).then_some(inverted);
        }
        let complement = output.complementary && bits & 5 == 5;
        Some(self.reference[usize::from(output.channel)] ^ complement ^ inverted)
    }

    /// Counts of a period during which a PWM output is high; `None` for a channel that makes no
    /// PWM.
    pub(crate) fn high_counts(&self, channel: usize, period: u64) -> Option<u64> {
        let below = u64::from(self.active[channel]).min(period);
        let stuck = below == period && !self.reference[channel];
        let active = match mode(self.ccmr, channel) {
            Mode::Pwm1 if stuck => 0,
            Mode::Pwm1 => below,
            Mode::Pwm2 => period - below,
            Mode::ForcedInactive => 0,
            Mode::ForcedActive => period,
            Mode::Frozen | Mode::ActiveOnMatch | Mode::InactiveOnMatch | Mode::Toggle => {
                return None
            }
        };
        let inverted = self.ccer >> (4 * channel + 1) & 1 != 0;
        Some(if inverted { period - active } else { active })
    }

    /// Reads the register at `offset` from the timer's base.
    pub(crate) fn read(&self, offset: u32) -> u32 {
        match offset {
            0x18 => self.ccmr[0],
            0x1C => self.ccmr[1],
            0x20 => self.ccer,
            0x34..=0x40 => self.ccr[(offset as usize - 0x34) / 4],
            0x44 => self.bdtr,
            _ => 0,
        }
    }

    /// Writes the register at `offset` from the timer's base.
    pub(crate) fn write(&mut self, offset: u32, value: u32) {
        match offset {
            0x18 => self.write_modes(0, value),
            0x1C => self.write_modes(1, value),
            0x20 => self.ccer = value,
            0x34..=0x40 => self.write_compare((offset as usize - 0x34) / 4, value),
            0x44 => self.bdtr = value,
            _ => {}
        }
    }

    fn write_modes(&mut self, register: usize, value: u32) {
        let frozen = |ccmr, channel| mode(ccmr, channel) == Mode::Frozen;
        let before = self.ccmr;
        let fixed = (0..2)
            .filter(|place| self.ccer >> (4 * (2 * register + place)) & 1 != 0)
            .fold(0, |all, place| all | 3 << (8 * place));
        self.ccmr[register] = value & !fixed | before[register] & fixed;
        for channel in 2 * register..2 * register + 2 {
            if frozen(before, channel) && !frozen(self.ccmr, channel) {
                self.thawed |= 1 << channel;
            }
            self.write_compare(channel, self.ccr[channel]);
        }
    }

    fn write_compare(&mut self, channel: usize, value: u32) {
        if self.is_input(channel) {
            return;
        }
        self.ccr[channel] = value;
        if half(self.ccmr, channel) >> 3 & 1 == 0 {
            self.active[channel] = value;
        }
    }
}

/// The byte of CCMR1 or CCMR2 that belongs to a channel.
fn half(ccmr: [u32; 2], channel: usize) -> u32 {
    ccmr[channel / 2] >> (8 * (channel % 2)) & 0xFF
}

fn mode(ccmr: [u32; 2], channel: usize) -> Mode {
    let half = half(ccmr, channel);
    // For an input, these bits are its filter.
    if half & 3 != 0 {
        return Mode::Frozen;
    }
    match half >> 4 & 7 {
        0 => Mode::Frozen,
        1 => Mode::ActiveOnMatch,
        2 => Mode::InactiveOnMatch,
        3 => Mode::Toggle,
        4 => Mode::ForcedInactive,
        5 => Mode::ForcedActive,
        6 => Mode::Pwm1,
        _ => Mode::Pwm2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHANNEL_1: Output = Output {
        channel: 0,
        complementary: false,
    };
    const CHANNEL_1N: Output = Output {
        channel: 0,
        complementary: true,
    };

    fn pwm(mode: u32, compare: u32) -> Outputs {
        let mut outputs = Outputs::default();
        outputs.write(0x18, mode << 4);
        outputs.write(0x34, compare);
        outputs.write(0x20, 1);
        outputs
    }

    #[test]
    fn pwm_is_high_below_the_compare_value() {
        let mut outputs = pwm(6, 3);
        outputs.follow(2, 0);
        assert_eq!(outputs.level(CHANNEL_1), Some(true));
        outputs.follow(3, 1);
        assert_eq!(outputs.level(CHANNEL_1), Some(false));
        assert_eq!(outputs.high_counts(0, 8), Some(3));
        assert_eq!(pwm(7, 3).high_counts(0, 8), Some(5));
        let mut full = pwm(6, 99);
        full.follow(0, 0);
        assert_eq!(full.high_counts(0, 8), Some(8), "above the top: always on");
    }

    #[test]
    fn a_preloaded_compare_value_waits_for_the_update() {
        let mut outputs = pwm(6, 3);
        outputs.write(0x18, 6 << 4 | 1 << 3);
        outputs.write(0x34, 5);
        assert_eq!(outputs.compare(0), 3);
        outputs.update();
        assert_eq!(outputs.compare(0), 5);
    }

    #[test]
    fn forcing_a_level_works_at_once() {
        let mut outputs = pwm(6, 8);
        outputs.follow(0, 0);
        outputs.write(0x18, 4 << 4);
        outputs.follow(0, 0);
        assert_eq!(outputs.level(CHANNEL_1), Some(false));
    }

    #[test]
    fn pwm_that_begins_from_a_forced_level_waits_for_the_comparison_unless_it_was_frozen() {
        let mut outputs = pwm(4, 8);
        outputs.follow(3, 0);
        outputs.write(0x18, 6 << 4);
        outputs.follow(3, 0);
        assert_eq!(outputs.level(CHANNEL_1), Some(false));
        outputs.follow(8, 1);
        outputs.follow(0, 0);
        assert_eq!(outputs.level(CHANNEL_1), Some(true));
        outputs.write(0x18, 4 << 4);
        outputs.follow(3, 0);
        outputs.write(0x18, 0);
        outputs.follow(3, 0);
        assert_eq!(outputs.level(CHANNEL_1), Some(false));
        outputs.write(0x18, 6 << 4);
        outputs.follow(3, 0);
        assert_eq!(outputs.level(CHANNEL_1), Some(true));
    }

    #[test]
    fn an_output_that_is_off_is_left_to_the_pull() {
        let mut outputs = pwm(6, 8);
        outputs.write(0x20, 0);
        assert_eq!(outputs.level(CHANNEL_1), None);
    }

    #[test]
    fn advanced_timers_need_the_main_output_enable() {
        let mut outputs = pwm(5, 0);
        outputs.follow(0, 0);
        assert_eq!(outputs.advanced_level(CHANNEL_1, true), None);
        outputs.write(0x44, OSSI);
        assert_eq!(outputs.advanced_level(CHANNEL_1, false), Some(false));
        assert_eq!(outputs.advanced_level(CHANNEL_1, true), Some(true));
        outputs.write(0x20, 3);
        assert_eq!(outputs.advanced_level(CHANNEL_1, false), Some(false));
        outputs.write(0x44, MOE);
        assert_eq!(outputs.advanced_level(CHANNEL_1, true), Some(false));
    }

    #[test]
    fn the_complementary_output_is_the_opposite_where_both_are_on() {
        let mut outputs = pwm(5, 0);
        outputs.follow(0, 0);
        outputs.write(0x44, MOE);
        outputs.write(0x20, 5);
        assert_eq!(outputs.advanced_level(CHANNEL_1N, false), Some(false));
        outputs.write(0x20, 4);
        assert_eq!(outputs.advanced_level(CHANNEL_1N, false), Some(true));
    }

    #[test]
    fn an_output_that_is_off_beside_one_that_is_on_has_its_inactive_level_where_asked_for() {
        let mut outputs = pwm(5, 0);
        outputs.follow(0, 0);
        outputs.write(0x20, 1 | 1 << 3);
        let mut off_beside = |bits| {
            outputs.write(0x44, bits);
            outputs.advanced_level(CHANNEL_1N, false)
        };
        assert_eq!(off_beside(MOE), None);
        assert_eq!(off_beside(MOE | OSSR), Some(true));
        assert_eq!(off_beside(OSSI), Some(false));
    }

    #[test]
    fn the_direction_of_a_channel_that_is_on_stays() {
        let mut outputs = pwm(6, 8);
        outputs.write(0x18, 1);
        assert!(!outputs.is_input(0));
        outputs.write(0x20, 0);
        outputs.write(0x18, 1 | 1 << 8);
        assert!(outputs.is_input(0) && outputs.is_input(1));
    }

    #[test]
    fn matches_set_clear_and_toggle() {
        let mut outputs = pwm(3, 5);
        outputs.follow(5, 1);
        assert_eq!(outputs.level(CHANNEL_1), Some(true));
        outputs.follow(5, 1);
        assert_eq!(outputs.level(CHANNEL_1), Some(false));
        outputs.write(0x18, 1 << 4);
        outputs.follow(5, 1);
        outputs.follow(0, 0);
        assert_eq!(outputs.level(CHANNEL_1), Some(true));
    }
}
