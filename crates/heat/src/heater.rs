//! One heater: on below its target, off above it, and its faults.
//!
//! ```text
//!             +---- hysteresis ----+
//!   off       |                    |  on below target - hysteresis, off above target + hysteresis
//! ------------+------ target ------+----------> °C
//! ```

use crate::fault::Fault;
use crate::sensor::Sensor;
use leadscrew_machine::board::{Duration, Instant};

/// The limits of a heater's temperature, °C, and of the time in which it has to react.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limits {
    /// The highest target, °C.
    pub most: f32,
    /// The temperature below which nothing is extruded, °C.
    pub extrusion: f32,
    /// A reading below this, °C, means that the sensor's wire is broken (or shorted, if the sensor
    /// is an amplifier).
    pub coldest: f32,
    /// A reading above this, °C, means that the sensor is shorted (or its wire is broken, if the
    /// sensor is an amplifier).
    pub hottest: f32,
    /// The time in which the temperature has to react, seconds. If it has not risen by
    /// [`Limits::answer`] with the heater on, the sensor is frozen. If it has risen by more than
    /// [`Limits::answer`] with the heater off, the heater goes on heating.
    pub patience: u16,
    /// The change of temperature that counts as a reaction, K.
    pub answer: f32,
    /// The greatest distance of the temperature from the target, once it has reached the target, K.
    /// Farther away is the fault [`Fault::RunsAway`].
    pub band: f32,
}

impl Limits {
    /// The limits of a plastic nozzle.
    pub const NOZZLE: Self = Self {
        most: 275.0,
        extrusion: 170.0,
        coldest: -10.0,
        hottest: 310.0,
        patience: 20,
        answer: 2.0,
        band: 30.0,
    };

    /// The limits of a heated bed.
    pub const BED: Self = Self {
        most: 120.0,
        hottest: 150.0,
        patience: 90,
        band: 20.0,
        ..Self::NOZZLE
    };
}

/// A heater.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct HeaterConfig {
    /// Its name in reports, one or two letters.
    pub name: &'static str,
    /// The sensor that reads its temperature.
    pub sensor: Sensor,
    /// The distance from its target at which the heater is switched on and off, K, above 0. With a
    /// larger value a relay lasts longer.
    pub hysteresis: f32,
    /// The limits of its temperature.
    pub limits: Limits,
}

/// The temperature at the start of a watch, and when the watch began.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Watch {
    since: Instant,
    at: f32,
}

/// A heater at work.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Heater {
    config: HeaterConfig,
    target: f32,
    /// The target that comes back with `~`; 0 for none.
    kept: f32,
    celsius: f32,
    on: bool,
    /// True if it has been at its target since the target was set.
    reached: bool,
    watch: Option<Watch>,
}

impl Heater {
    pub(crate) fn new(config: HeaterConfig) -> Self {
        Self {
            config,
            target: 0.0,
            kept: 0.0,
            celsius: 0.0,
            on: false,
            reached: false,
            watch: None,
        }
    }

    /// Returns its name.
    pub const fn name(&self) -> &'static str {
        self.config.name
    }

    /// Returns the temperature read last, °C.
    pub const fn celsius(&self) -> f32 {
        self.celsius
    }

    /// Returns its target, °C; 0 if it is off.
    pub const fn target(&self) -> f32 {
        self.target
    }

    /// Returns true if it is off, or has reached its target.
    pub fn is_ready(&self) -> bool {
        self.target == 0.0 || self.reached
    }

    pub(crate) fn may_extrude(&self) -> bool {
        self.celsius >= self.config.limits.extrusion
    }

    pub(crate) fn takes(&self, target: f32) -> bool {
        (0.0..=self.config.limits.most).contains(&target)
    }

    /// Goes off until [`Heater::take_back`].
    pub(crate) fn put_off(&mut self) {
        let kept = self.target;
        self.set_target(0.0);
        self.kept = kept;
    }

    /// Takes back the target that it had before [`Heater::put_off`]; returns whether it had one.
    pub(crate) fn take_back(&mut self) -> bool {
        let had_one = self.kept > 0.0;
        if had_one {
            self.set_target(self.kept);
        }
        had_one
    }

    pub(crate) fn set_target(&mut self, target: f32) {
        self.kept = 0.0;
        if target != self.target {
            self.target = target;
            self.reached = false;
            self.watch = None;
        }
    }

    /// Takes a reading, `share` of the reference voltage; returns whether to heat.
    ///
    /// # Errors
    /// The fault of the heater.
    pub(crate) fn regulate(
        &mut self,
        share: f32,
        reference: f32,
        now: Instant,
    ) -> Result<bool, Fault> {
        self.celsius = self.config.sensor.celsius(share, reference);
        self.check_sensor()?;
        let on = self.wanted();
        if on != self.on {
            self.watch = None;
        }
        self.on = on;
        self.check_answer(now)?;
        let off_target = (self.celsius - self.target).abs();
        self.reached |= self.target > 0.0 && off_target <= self.config.hysteresis;
        match self.reached && off_target > self.config.limits.band {
            true => Err(Fault::RunsAway),
            false => Ok(on),
        }
    }

    fn wanted(&self) -> bool {
        let (target, hysteresis) = (self.target, self.config.hysteresis);
        match self.on {
            _ if target == 0.0 => false,
            true => self.celsius < target + hysteresis,
            false => self.celsius < target - hysteresis,
        }
    }

    /// Checks that the reading is within the limits. A reading that is not a number counts as too
    /// hot.
    fn check_sensor(&self) -> Result<(), Fault> {
        let limits = &self.config.limits;
        if (limits.coldest..=limits.hottest).contains(&self.celsius) {
            return Ok(());
        }
        let is_cold = self.celsius < limits.coldest;
        match is_cold == self.config.sensor.is_cold_if_open() {
            true => Err(Fault::SensorOpen),
            false => Err(Fault::SensorShorted),
        }
    }

    /// Checks that the heater gets warmer while it is on, and does not get warmer while it is off.
    fn check_answer(&mut self, now: Instant) -> Result<(), Fault> {
        let limits = &self.config.limits;
        let fresh = Watch {
            since: now,
            at: self.celsius,
        };
        let watch = self.watch.get_or_insert(fresh);
        let rise = self.celsius - watch.at;
        let patience = Duration::from_ticks(u64::from(limits.patience) * 1_000_000);
        let over = now >= watch.since + patience;
        let frozen = self.on && over && rise < limits.answer;
        let stuck = !self.on && over && rise > limits.answer;
        if frozen {
            return Err(Fault::SensorFrozen);
        }
        if stuck {
            return Err(Fault::DoesNotCool);
        }
        if over {
            self.watch = Some(fresh);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault_at(sensor: Sensor, share: f32) -> Option<Fault> {
        let mut heater = Heater::new(HeaterConfig {
            name: "N",
            sensor,
            hysteresis: 2.0,
            limits: Limits::NOZZLE,
        });
        let now = Instant::from_ticks(0);
        heater.regulate(share, 5.0, now).err()
    }

    #[test]
    fn each_sensor_is_open_on_its_own_side_and_no_number_is_no_temperature() {
        let thermistor = Sensor::Thermistor {
            r25: 100_000.0,
            beta: 3950.0,
            pull_up: 4_700.0,
        };
        let cases = [
            (thermistor, 1.0, Some(Fault::SensorOpen)),
            (thermistor, 0.0, Some(Fault::SensorShorted)),
            (thermistor, 0.95, None),
            (thermistor, f32::NAN, Some(Fault::SensorShorted)),
            (Sensor::AD595, 1.0, Some(Fault::SensorOpen)),
            (Sensor::AD595, -0.1, Some(Fault::SensorShorted)),
            (Sensor::AD595, 0.05, None),
            (Sensor::AD595, f32::NAN, Some(Fault::SensorOpen)),
        ];
        for (sensor, share, fault) in cases {
            assert_eq!(fault_at(sensor, share), fault, "{sensor:?} {share}");
        }
    }
}
