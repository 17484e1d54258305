//! Heaters and fan of a machine file.

use super::value::{AxisLetter, Celsius, Positive, Volts};
use super::Profile;
use leadscrew_heat::{Gates, HeatConfig, HeaterConfig, Limits, Sensor};
use schemars::JsonSchema;
use serde::Deserialize;

/// Heaters that are switched on and off, and the axis and outputs that work only when it is warm.
#[derive(Clone, PartialEq, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Heaters {
    /// The heater of M104 and M109.
    pub nozzle: Option<HeaterTable>,
    /// The heater of M140 and M190. A bed is possible only with a nozzle.
    pub bed: Option<HeaterTable>,
    /// The reference voltage of the sensors, V; 5 if it is left out.
    pub reference_v: Option<Positive>,
    /// The axis that does not turn while the nozzle is too cold. If it is left out, this is E, if
    /// the machine has one.
    pub extruder: Option<AxisLetter>,
    /// The outputs (M62, M64) that go on only if the nozzle is warm enough, one bit for each
    /// output.
    pub feeders: u8,
    /// No program moves until all heaters that have a target have reached it.
    pub wait_until_ready: bool,
    /// True if a relay supplies all heaters. It goes off if one of them does not cool.
    pub supply_relay: bool,
    /// True if another controller, or a thermal cut-out, reports faults on an input.
    pub fault_input: bool,
}

/// One heater, its sensor, and its body in the simulator.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeaterTable {
    /// How its temperature is read.
    pub sensor: SensorTable,
    /// How far from its target it is switched, K; 2 if it is left out.
    pub hysteresis_k: Option<Positive>,
    /// The highest target. If it is left out: 275 for a nozzle, 120 for a bed.
    pub most: Option<Celsius>,
    /// The temperature below which nothing is extruded; 170 if it is left out.
    pub extrusion: Option<Celsius>,
    /// A lower reading is a sensor's fault; -10 if it is left out.
    pub coldest: Option<Celsius>,
    /// A higher reading is a sensor's fault. If it is left out: 310 for a nozzle, 150 for a bed.
    pub hottest: Option<Celsius>,
    /// The time in which the temperature must react to the heater's switch, s. If it is left
    /// out: 20 for a nozzle, 90 for a bed.
    pub patience_s: Option<u16>,
    /// The least change of temperature that counts as a reaction, K; 2 if it is left out.
    pub answer_k: Option<Positive>,
    /// How far the temperature may be from the target once it has reached it, K. If it is left
    /// out: 30 for a nozzle, 20 for a bed.
    pub band_k: Option<Positive>,
    /// How fast the heater warms a cold body, K/s; used by the simulator only. If it is left
    /// out: 4 for a nozzle, 1 for a bed.
    pub warms_k_s: Option<Positive>,
    /// The time constant with which the body cools, s; used by the simulator only. If it is left
    /// out: 90 for a nozzle, 300 for a bed.
    pub cools_s: Option<Positive>,
}

/// A sensor of temperature.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum SensorTable {
    /// A thermocouple behind an AD595: 10 mV/K.
    Ad595,
    /// An amplifier whose voltage is linear in the temperature.
    Amplifier {
        /// Volts at 0 degrees.
        offset_v: Volts,
        /// Volts a kelvin.
        gain_v_k: Positive,
    },
    /// A thermistor to ground, with a resistor to the reference voltage.
    Thermistor {
        /// Its resistance at 25 degrees, ohms.
        ohms_25: Positive,
        /// Its B value, K.
        beta: Positive,
        /// The resistor, ohms.
        pull_up_ohms: Positive,
    },
}

/// A body that a heater warms, in the simulator: `dT/dt = power − (T − room) / cools`, with `power` = 0 while the heater is
/// off.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Body {
    /// How fast the heater warms the body, K/s.
    pub power: f32,
    /// The time in which the difference to the room falls to 37 %, s.
    pub cools: f32,
    /// How its temperature is read.
    pub sensor: Sensor,
}

/// A fan.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Fan {
    /// True if the machine has a fan, which M106 and M107 switch.
    pub fitted: bool,
}

/// The values for a heater whose table leaves them out.
struct Usual {
    /// The table in the file.
    table: &'static str,
    /// The name in reports.
    name: &'static str,
    limits: Limits,
    warms: f32,
    cools: f32,
}

const NOZZLE: Usual = Usual {
    table: "heaters.nozzle",
    name: "N",
    limits: Limits::NOZZLE,
    warms: 4.0,
    cools: 90.0,
};

const BED: Usual = Usual {
    table: "heaters.bed",
    name: "B",
    limits: Limits::BED,
    warms: 1.0,
    cools: 300.0,
};

/// The distance from the target at which a heater is switched, K.
const HYSTERESIS: f32 = 2.0;

/// The sensors' reference voltage, V.
const REFERENCE: f32 = 5.0;

impl Heaters {
    /// Returns true if there is any heater.
    pub fn is_any(&self) -> bool {
        self.tables().next().is_some()
    }

    /// The heaters' part of the extension's configuration.
    pub fn configs(&self) -> Vec<HeaterConfig> {
        self.tables()
            .map(|(table, usual)| table.config(usual))
            .collect()
    }

    /// The bodies that the heaters warm.
    pub fn bodies(&self) -> Vec<Body> {
        self.tables()
            .map(|(table, usual)| table.body(usual))
            .collect()
    }

    /// All heaters, the nozzle first.
    fn tables(&self) -> impl Iterator<Item = (&HeaterTable, &'static Usual)> {
        let nozzle = self.nozzle.iter().map(|table| (table, &NOZZLE));
        nozzle.chain(self.bed.iter().map(|table| (table, &BED)))
    }
}

impl HeaterTable {
    fn config(&self, usual: &Usual) -> HeaterConfig {
        let celsius = |own: Option<Celsius>, usual: f32| own.map_or(usual, Celsius::get);
        let of = &usual.limits;
        HeaterConfig {
            name: usual.name,
            sensor: self.sensor.sensor(),
            hysteresis: or(self.hysteresis_k, HYSTERESIS),
            limits: Limits {
                most: celsius(self.most, of.most),
                extrusion: celsius(self.extrusion, of.extrusion),
                coldest: celsius(self.coldest, of.coldest),
                hottest: celsius(self.hottest, of.hottest),
                patience: self.patience_s.unwrap_or(of.patience),
                answer: or(self.answer_k, of.answer),
                band: or(self.band_k, of.band),
            },
        }
    }

    fn body(&self, usual: &Usual) -> Body {
        Body {
            power: or(self.warms_k_s, usual.warms),
            cools: or(self.cools_s, usual.cools),
            sensor: self.sensor.sensor(),
        }
    }
}

impl SensorTable {
    fn sensor(self) -> Sensor {
        match self {
            Self::Ad595 => Sensor::AD595,
            Self::Amplifier { offset_v, gain_v_k } => Sensor::Linear {
                offset: offset_v.get(),
                gain: gain_v_k.get() as f32,
            },
            Self::Thermistor {
                ohms_25,
                beta,
                pull_up_ohms,
            } => Sensor::Thermistor {
                r25: ohms_25.get() as f32,
                beta: beta.get() as f32,
                pull_up: pull_up_ohms.get() as f32,
            },
        }
    }
}

fn or(own: Option<Positive>, usual: f32) -> f32 {
    own.map_or(usual, |own| own.get() as f32)
}

impl Profile {
    /// The configuration of the extension for heaters and fan.
    pub fn heat_config(&self) -> HeatConfig {
        let Heaters {
            extruder,
            feeders,
            wait_until_ready,
            reference_v,
            ..
        } = &self.heaters;
        HeatConfig {
            gates: Gates {
                extruder_axis: self.axis_of_letter(extruder.map_or('E', AxisLetter::capital)),
                feeders: *feeders,
                wait_until_ready: *wait_until_ready,
            },
            nozzle: 0,
            bed: self.heaters.bed.map(|_| 1),
            reference: or(*reference_v, REFERENCE),
            fan: self.fan.fitted,
        }
    }

    /// A key about heaters that contradicts other keys, with the value that was expected.
    pub(super) fn contradiction_of_heaters(&self) -> Option<(&'static str, &'static str)> {
        let Heaters {
            nozzle,
            bed,
            extruder,
            ..
        } = &self.heaters;
        if bed.is_some() && nozzle.is_none() {
            return Some(("heaters", "expected a nozzle beside a bed"));
        }
        if let Err(error) = self.heat_config().validate(&self.heaters.configs()) {
            let mut tables = self.heaters.tables().map(|(_, usual)| usual.table);
            let of_heater = error.heater().and_then(|heater| tables.nth(heater));
            return Some((of_heater.unwrap_or("heaters"), error.expected()));
        }
        let is_axis = |letter: AxisLetter| self.axis_of_letter(letter.capital()).is_some();
        if !extruder.is_none_or(is_axis) {
            let expected = "expected the letter of one of its axes as `extruder`";
            return Some(("heaters", expected));
        }
        self.contradiction_of_extrusion()
    }

    /// A heater that could never extrude.
    fn contradiction_of_extrusion(&self) -> Option<(&'static str, &'static str)> {
        let gates = self.heat_config().gates;
        let is_gated = gates.extruder_axis.is_some() || gates.feeders != 0;
        self.heaters.tables().find_map(|(table, usual)| {
            let limits = table.config(usual).limits;
            let is_asked = table.extrusion.is_some() || is_gated && usual.name == NOZZLE.name;
            let never = is_asked && limits.extrusion > limits.most;
            never.then_some((usual.table, "expected `extrusion` up to `most`"))
        })
    }
}
