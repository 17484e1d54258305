//! Power control (RM0090 chapter 5): the voltage detector that warns of a brown-out.
//!
//! Not modelled, and warned of: stop and standby modes (sleep is modelled), the backup regulator.
//! Not modelled either: the detector's thresholds. The supply is either good or low.

/// PWR_CR.PVDE: the detector is on.
const DETECTOR: u32 = 1 << 4;
/// PWR_CR.VOS: the core has the higher of its two voltages.
const SCALE_1: u32 = 1 << 14;
/// PWR_CSR.PVDO: the supply is below the threshold.
const LOW: u32 = 1 << 2;
/// PWR_CSR.VOSRDY: the core's regulator is at its voltage.
const REGULATOR_READY: u32 = 1 << 14;

/// Whether everything that a value asks of the register at `offset` is modelled. PWR_CSR is not: a
/// program can switch only the backup regulator and the wake-up pin there.
pub(crate) fn is_modelled(offset: u32, value: u32) -> bool {
    offset == 0 || value == 0
}

/// The power controller.
#[derive(Clone, Debug)]
pub(crate) struct Pwr {
    control: u32,
    low: bool,
}

impl Pwr {
    /// The state after a reset: the regulator is at full voltage (PWR_CR.VOS).
    pub(crate) fn new() -> Self {
        Pwr {
            control: SCALE_1,
            low: false,
        }
    }

    /// Sets whether the supply is low. Returns the new level of EXTI line 16 if that changes
    /// (RM0090 section 5.2.3).
    pub(crate) fn set_supply(&mut self, low: bool) -> Option<bool> {
        let before = self.output();
        self.low = low;
        (self.output() != before).then_some(low)
    }

    /// Whether the core has the higher of its two voltages.
    pub(crate) fn has_scale_1(&self) -> bool {
        self.control & SCALE_1 != 0
    }

    fn output(&self) -> bool {
        self.low && self.control & DETECTOR != 0
    }

    /// Reads the register at `offset` from 0x40007000.
    pub(crate) fn read(&self, offset: u32) -> u32 {
        match offset {
            0 => self.control,
            4 => REGULATOR_READY | if self.output() { LOW } else { 0 },
            _ => 0,
        }
    }

    /// Resets the registers; the supply stays as it is.
    pub(crate) fn reset(&mut self) {
        *self = Pwr {
            low: self.low,
            ..Pwr::new()
        };
    }

    /// Writes the register at `offset` from 0x40007000. Returns the new level of EXTI line 16 if
    /// that changes.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<bool> {
        let before = self.output();
        if offset == 0 {
            self.control = value;
        }
        (self.output() != before).then_some(self.output())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_low_supply_is_reported_where_the_detector_is_on() {
        let mut pwr = Pwr::new();
        assert_eq!(pwr.set_supply(true), None);
        assert_eq!(pwr.set_supply(false), None);
        pwr.write(0, 0x4000 | DETECTOR);
        assert_eq!(pwr.set_supply(true), Some(true));
        assert_eq!(pwr.read(4) & LOW, LOW);
        assert_eq!(pwr.set_supply(true), None);
        assert_eq!(pwr.set_supply(false), Some(false));
    }

    #[test]
    fn a_detector_that_is_switched_on_while_the_supply_is_low_rises() {
        let mut pwr = Pwr::new();
        pwr.set_supply(true);
        assert_eq!(pwr.write(0, 0x4000 | DETECTOR), Some(true));
        assert_eq!(pwr.write(0, 0x4000), Some(false));
    }

    #[test]
    fn a_supply_that_is_low_stays_low_over_a_reset() {
        let mut pwr = Pwr::new();
        pwr.set_supply(true);
        pwr.reset();
        assert_eq!(pwr.write(0, 0x4000 | DETECTOR), Some(true));
    }
}
