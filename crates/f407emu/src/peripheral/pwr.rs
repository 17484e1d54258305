//! Power control (RM0090 chapter 5): the voltage detector that warns of a brown-out.
//!
//! Not modelled, and warned of: stop and standby modes (sleep is modelled), the backup regulator.
//!
//! The detector's thresholds are the typical ones of the data sheet (DocID022152, table 19); those of
//! a chip are up to 0.07 V off.

/// The supply at power-up, mV.
const GOOD_MV: u32 = 3300;
/// The thresholds by PWR_CR.PLS, mV: the supply is low below the first one, and good again above the
/// second one.
const THRESHOLDS: [(u32, u32); 8] = [
    (2040, 2140),
    (2190, 2300),
    (2350, 2450),
    (2510, 2600),
    (2660, 2760),
    (2840, 2930),
    (2930, 3030),
    (3030, 3140),
];
/// PWR_CR.PVDE: the detector is on.
const DETECTOR: u32 = 1 << 4;
/// PWR_CR.VOS: the core has the higher of its two voltages.
const SCALE_1: u32 = 1 << 14;
/// PWR_CSR.PVDO: the supply is below the threshold.
const LOW: u32 = 1 << 2;
/// PWR_CSR.VOSRDY: the core's regulator is at its voltage.
const REGULATOR_READY: u32 = 1 << 14;

/// Returns true if everything that a value asks of the register at `offset` is modelled. PWR_CSR is
/// not: a program can switch only the backup regulator and the wake-up pin there.
pub(crate) fn is_modelled(offset: u32, value: u32) -> bool {
    offset == 0 || value == 0
}

/// The power controller.
#[derive(Clone, Debug)]
pub(crate) struct Pwr {
    control: u32,
    /// The supply, mV.
    supply: u32,
    /// True if the supply is low, as the comparator sees it.
    low: bool,
}

impl Pwr {
    /// The state after a reset: the regulator is at full voltage (PWR_CR.VOS).
    pub(crate) fn new() -> Self {
        Pwr {
            control: SCALE_1,
            supply: GOOD_MV,
            low: false,
        }
    }

    /// Sets the supply, mV. Returns the new level of EXTI line 16 if that changes (RM0090 section
    /// 5.2.3).
    pub(crate) fn set_supply(&mut self, millivolts: u32) -> Option<bool> {
        let before = self.output();
        self.supply = millivolts;
        self.compare();
        (self.output() != before).then_some(self.output())
    }

    /// Compares the supply with the thresholds; between them nothing changes.
    fn compare(&mut self) {
        let (falling, rising) = THRESHOLDS[(self.control >> 5 & 7) as usize];
        self.low = self.supply < falling || self.low && self.supply <= rising;
    }

    /// Returns true if the core has the higher of its two voltages.
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
            supply: self.supply,
            ..Pwr::new()
        };
        self.compare();
    }

    /// Writes the register at `offset` from 0x40007000. Returns the new level of EXTI line 16 if
    /// that changes.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<bool> {
        let before = self.output();
        if offset == 0 {
            let was_on = self.control & DETECTOR != 0;
            self.control = value;
            // A detector that is switched on knows of no voltage before: below the upper threshold
            // the supply has not become good yet.
            self.low |= !was_on && self.supply <= THRESHOLDS[(value >> 5 & 7) as usize].1;
            self.compare();
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
        assert_eq!(pwr.set_supply(1900), None);
        assert_eq!(pwr.set_supply(3300), None);
        pwr.write(0, 0x4000 | DETECTOR);
        assert_eq!(pwr.set_supply(1900), Some(true));
        assert_eq!(pwr.read(4) & LOW, LOW);
        assert_eq!(pwr.set_supply(1900), None);
        assert_eq!(pwr.set_supply(3300), Some(false));
    }

    #[test]
    fn each_level_has_its_two_thresholds() {
        for (level, (falling, rising)) in (0..).zip(THRESHOLDS) {
            let mut pwr = Pwr::new();
            pwr.write(0, 0x4000 | DETECTOR | level << 5);
            assert_eq!(pwr.set_supply(falling), None);
            assert_eq!(pwr.set_supply(falling - 1), Some(true));
            assert_eq!(pwr.set_supply(rising), None);
            assert_eq!(pwr.set_supply(rising + 1), Some(false));
        }
    }

    #[test]
    fn a_detector_that_is_switched_on_while_the_supply_is_low_rises() {
        let mut pwr = Pwr::new();
        pwr.set_supply(2700);
        assert_eq!(pwr.write(0, 0x4000 | DETECTOR | 4 << 5), Some(true));
        assert_eq!(pwr.write(0, 0x4000), Some(false));
    }

    #[test]
    fn a_supply_that_is_low_stays_low_over_a_reset() {
        let mut pwr = Pwr::new();
        pwr.set_supply(1900);
        pwr.reset();
        assert_eq!(pwr.write(0, 0x4000 | DETECTOR), Some(true));
    }
}
