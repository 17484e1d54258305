//! The bodies that heaters warm: the room cools them, and sensors and relays may fail.

use crate::profile::Body;
use leadscrew_heat::{HeatPort, Sensor};
use leadscrew_machine::board::{Duration, Instant};
use std::str::FromStr;

/// The room, °C.
const ROOM: f32 = 22.0;

/// 0 °C and 25 °C, K.
const ZERO: f32 = 273.15;
const WARM_ROOM: f32 = 298.15;

/// The kind of a failure.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Failure {
    /// The wire of the sensor breaks.
    Open,
    /// The wires of the sensor touch.
    Shorted,
    /// The sensor falls out of its place, and keeps its last reading.
    Frozen,
    /// The relay of the heater sticks: only the relay of the supply can switch the heater off.
    Stuck,
    /// Another controller reports a fault on the fault input.
    External,
}

/// A failure of the first heater's parts at a time after power-up.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct HeatFault {
    /// The kind of the failure.
    pub failure: Failure,
    /// The time at which it fails, counted from power-up.
    pub at: Duration,
}

/// The reason why a text is no [`HeatFault`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NoHeatFault;

impl std::fmt::Display for NoHeatFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(
            "expected open, shorted, frozen, stuck or external, and the second, such as open@40",
        )
    }
}

impl std::error::Error for NoHeatFault {}

impl FromStr for HeatFault {
    type Err = NoHeatFault;

    /// Reads a text such as `open@40`: the wire breaks after 40 seconds.
    fn from_str(text: &str) -> Result<Self, NoHeatFault> {
        let (failure, seconds) = text.split_once('@').ok_or(NoHeatFault)?;
        let failure = match failure {
            "open" => Failure::Open,
            "shorted" => Failure::Shorted,
            "frozen" => Failure::Frozen,
            "stuck" => Failure::Stuck,
            "external" => Failure::External,
            _ => return Err(NoHeatFault),
        };
        let seconds: u32 = seconds.parse().map_err(|_| NoHeatFault)?;
        let at = Duration::from_ticks(u64::from(seconds) * 1_000_000);
        Ok(Self { failure, at })
    }
}

/// Wires of the heaters that only some machines have.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct HeatWires {
    /// A relay supplies all heaters.
    pub supply_relay: bool,
    /// An input for faults that another controller sees.
    pub fault_input: bool,
}

#[derive(Clone, Copy, Debug)]
struct Part {
    body: Body,
    celsius: f32,
    is_on: bool,
}

/// All heated bodies, with the pins of their heaters and sensors.
#[derive(Clone, Debug)]
pub struct Oven {
    parts: Vec<Part>,
    reference: f32,
    wires: HeatWires,
    fault: Option<HeatFault>,
    /// The reading at which the first sensor has frozen; `None` while it works.
    frozen: Option<f32>,
    now: Instant,
    has_supply: bool,
}

impl Oven {
    /// Makes an oven whose bodies are at room temperature. `reference` is the reference voltage of
    /// all sensors.
    pub fn new(
        bodies: &[Body],
        reference: f32,
        wires: HeatWires,
        fault: Option<HeatFault>,
    ) -> Self {
        let cold = |body: &Body| Part {
            body: *body,
            celsius: ROOM,
            is_on: false,
        };
        Self {
            parts: bodies.iter().map(cold).collect(),
            reference,
            wires,
            fault,
            frozen: None,
            now: Instant::from_ticks(0),
            has_supply: true,
        }
    }

    /// The failure that has happened by now, if any.
    fn failure(&self) -> Option<Failure> {
        let fault = self.fault.filter(|fault| {
            let since = self.now.duration_since_epoch();
            since >= fault.at
        });
        fault.map(|fault| fault.failure)
    }
}

impl HeatPort for Oven {
    fn begin(&mut self, now: Instant) {
        let passed = now.checked_duration_since(self.now);
        let seconds = passed.map_or(0.0, |passed| passed.ticks() as f32 / 1e6);
        let is_stuck = self.failure() == Some(Failure::Stuck);
        self.now = now;
        for (heater, part) in self.parts.iter_mut().enumerate() {
            let is_closed = part.is_on || is_stuck && heater == 0;
            let power = f32::from(u8::from(is_closed && self.has_supply)) * part.body.power;
            // This is exact while the power does not change.
            let end = ROOM + power * part.body.cools;
            part.celsius = end + (part.celsius - end) * (-seconds / part.body.cools).exp();
        }
    }

    fn sensor(&mut self, heater: usize) -> f32 {
        let Some(part) = self.parts.get(heater) else {
            return 0.0;
        };
        let (sensor, celsius) = (part.body.sensor, part.celsius);
        let is_cold_if_open = matches!(sensor, Sensor::Thermistor { .. });
        match self.failure().filter(|_| heater == 0) {
            None | Some(Failure::Stuck | Failure::External) => {
                share(sensor, celsius, self.reference)
            }
            Some(Failure::Frozen) => {
                let celsius = *self.frozen.get_or_insert(celsius);
                share(sensor, celsius, self.reference)
            }
            // The input of a thermistor is pulled up when its wire breaks. The input of an
            // amplifier floats up; a short is below its reading of 0 °C.
            Some(Failure::Open) => 1.0,
            Some(Failure::Shorted) if is_cold_if_open => 0.0,
            Some(Failure::Shorted) => -1.0,
        }
    }

    fn heat(&mut self, heater: usize, on: bool) {
        if let Some(part) = self.parts.get_mut(heater) {
            part.is_on = on;
        }
    }

    fn supply(&mut self, on: bool) {
        self.has_supply = on || !self.wires.supply_relay;
    }

    fn external_fault(&mut self) -> bool {
        self.wires.fault_input && self.failure() == Some(Failure::External)
    }
}

/// The voltage of a sensor at a temperature, as a share of the reference.
fn share(sensor: Sensor, celsius: f32, reference: f32) -> f32 {
    match sensor {
        Sensor::Linear { offset, gain } => (offset + gain * celsius) / reference,
        Sensor::Thermistor { r25, beta, pull_up } => {
            let resistance = r25 * (beta * (1.0 / (celsius + ZERO) - 1.0 / WARM_ROOM)).exp();
            resistance / (resistance + pull_up)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const THERMISTOR: Sensor = Sensor::Thermistor {
        r25: 100_000.0,
        beta: 3950.0,
        pull_up: 4_700.0,
    };

    fn oven(sensor: Sensor, fault: Option<HeatFault>) -> Oven {
        let body = Body {
            power: 4.0,
            cools: 90.0,
            sensor,
        };
        let wires = HeatWires {
            supply_relay: true,
            fault_input: true,
        };
        Oven::new(&[body], 5.0, wires, fault)
    }

    fn seconds(seconds: u64) -> Instant {
        Instant::from_ticks(seconds * 1_000_000)
    }

    #[test]
    fn a_sensor_reads_the_temperature_of_its_body() {
        for sensor in [Sensor::AD595, THERMISTOR] {
            let mut oven = oven(sensor, None);
            oven.heat(0, true);
            oven.begin(seconds(90));
            // The body warms from 22 °C to 22 + 4 * 90 °C, and has gone 63.2 % of this way
            // after one time constant.
            let read = sensor.celsius(oven.sensor(0), 5.0);
            assert!((read - (22.0 + 0.632 * 360.0)).abs() < 1.0, "{read}");
            oven.supply(false);
            oven.begin(seconds(2000));
            let read = sensor.celsius(oven.sensor(0), 5.0);
            assert!((read - 22.0).abs() < 0.1, "{read}");
        }
    }

    #[test]
    fn steps_of_any_length_lead_to_the_same_temperature() {
        let (mut one, mut many) = (oven(Sensor::AD595, None), oven(Sensor::AD595, None));
        one.heat(0, true);
        many.heat(0, true);
        one.begin(seconds(60));
        (1..=600).for_each(|tenth| many.begin(Instant::from_ticks(tenth * 100_000)));
        assert!((one.sensor(0) - many.sensor(0)).abs() < 1e-4);
    }

    #[test]
    fn a_relay_that_sticks_heats_until_the_supply_is_off() {
        let mut oven = oven(Sensor::AD595, Some("stuck@10".parse().unwrap()));
        oven.begin(seconds(10));
        let cold = oven.sensor(0);
        oven.begin(seconds(40));
        let warm = oven.sensor(0);
        assert!(warm > cold);
        oven.supply(false);
        oven.begin(seconds(60));
        assert!(oven.sensor(0) < warm);
    }

    #[test]
    fn a_fault_comes_when_it_is_due() {
        for (text, hot) in [
            ("open@10", Some(true)),
            ("shorted@10", Some(false)),
            ("frozen@10", None),
        ] {
            let mut oven = oven(Sensor::AD595, Some(text.parse().unwrap()));
            oven.heat(0, true);
            oven.begin(seconds(9));
            assert!((0.0..0.9).contains(&oven.sensor(0)), "{text}");
            oven.begin(seconds(10));
            let at_ten = oven.sensor(0);
            oven.begin(seconds(20));
            match hot {
                Some(true) => assert_eq!(oven.sensor(0), 1.0),
                Some(false) => assert!(oven.sensor(0) < 0.0),
                None => assert_eq!(oven.sensor(0), at_ten),
            }
        }
        let mut oven = oven(Sensor::AD595, Some("external@10".parse().unwrap()));
        oven.begin(seconds(9));
        assert!(!oven.external_fault());
        oven.begin(seconds(10));
        assert!(oven.external_fault());
        assert_eq!("loose@10".parse::<HeatFault>(), Err(NoHeatFault));
        assert_eq!("open".parse::<HeatFault>(), Err(NoHeatFault));
    }
}
