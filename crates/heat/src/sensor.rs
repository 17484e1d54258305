//! Sensors convert a temperature to a voltage; this module converts it back.

use libm::logf;

/// The way in which a sensor turns a temperature into a voltage.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Sensor {
    /// An amplifier whose voltage is linear in the temperature, such as a thermocouple behind an
    /// AD595 with 10 mV/K.
    Linear {
        /// Volts at 0 °C.
        offset: f32,
        /// Volts a kelvin, above 0.
        gain: f32,
    },
    /// A thermistor to ground, with a resistor to the reference voltage.
    Thermistor {
        /// Its resistance at 25 °C, ohms.
        r25: f32,
        /// Its `B` value, kelvins.
        beta: f32,
        /// The resistor, ohms.
        pull_up: f32,
    },
}

/// The melting point of ice, 0 °C, in K.
const ZERO: f32 = 273.15;
/// The temperature at which thermistors are rated, 25 °C, in K.
const ROOM: f32 = 298.15;

impl Sensor {
    /// A type K thermocouple behind an AD595: 10 mV/K.
    pub const AD595: Self = Self::Linear {
        offset: 0.0,
        gain: 0.010,
    };

    /// Returns the temperature in °C for a voltage, as a share of the reference voltage `reference`
    /// (V).
    ///
    /// For a thermistor, temperatures in kelvins:
    ///
    /// ```text
    /// 1/T = 1/T25 + ln(R/R25)/B
    /// ```
    ///
    /// At either end of the voltage's range the result is very hot or very cold. The heater takes
    /// this for a short or a broken wire.
    pub fn celsius(self, share: f32, reference: f32) -> f32 {
        match self {
            Self::Linear { offset, gain } => (share * reference - offset) / gain,
            Self::Thermistor { r25, beta, pull_up } => {
                /// The least distance of `share` from 0 and from 1: one step of a converter of 12
                /// bits.
                const LEAST: f32 = 1.0 / 4096.0;
                let share = share.clamp(LEAST, 1.0 - LEAST);
                let resistance = pull_up * share / (1.0 - share);
                1.0 / (1.0 / ROOM + logf(resistance / r25) / beta) - ZERO
            }
        }
    }

    /// Returns true if a broken wire reads as cold: the wire of a thermistor does. The input of an
    /// amplifier needs a pull-up, so that a broken wire reads as hot.
    pub(crate) const fn is_cold_if_open(self) -> bool {
        matches!(self, Self::Thermistor { .. })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ad595_has_ten_millivolts_a_kelvin() {
        for celsius in [0.0, 25.0, 180.0, 300.0] {
            let share = celsius * 0.010 / 5.0;
            let read = Sensor::AD595.celsius(share, 5.0);
            assert!((read - celsius).abs() < 0.01, "{celsius} {read}");
        }
    }

    #[test]
    fn a_thermistor_reads_as_its_data_sheet_says() {
        // A thermistor of 100 kΩ, B 3950, pulled up by 4.7 kΩ; with resistances from a common data
        // sheet at some temperatures.
        let sensor = Sensor::Thermistor {
            r25: 100_000.0,
            beta: 3950.0,
            pull_up: 4_700.0,
        };
        for (celsius, ohms) in [(25.0f32, 100_000.0f32), (60.0, 24_860.0), (100.0, 6_974.0)] {
            let read = sensor.celsius(ohms / (ohms + 4_700.0), 3.3);
            assert!((read - celsius).abs() < 2.5, "{celsius} {read}");
        }
        assert!(sensor.celsius(1.0, 3.3) < -30.0, "open");
        assert!(sensor.celsius(0.0, 3.3) > 400.0, "shorted");
    }
}
