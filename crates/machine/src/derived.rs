//! Settings in the units of those who use them: planner, motion, tool and step port.

use crate::board::{Duration, PortConfig};
use crate::config::MachineConfig;
use crate::interpreter::MAX_WORD;
use crate::motion::Pacing;
use crate::settings::table::{AxisSetting, Setting};
use crate::settings::values::{Key, Settings};
use crate::step_rate::largest_acceleration;
use crate::tool::scale::SpindleScale;
use core::array::from_fn;
use leadscrew_gcode::Number;
use leadscrew_planner::{Config, Coordinate, CornerRule, StepsPerMm};
use leadscrew_stepper::{MotorMask, Ticks};

/// Seconds in a minute: settings are in mm/min, the planner in mm/s.
const MINUTE: f32 = 60.0;

/// The planner's configuration; the board's step rate caps its rates.
pub(crate) fn planner_config<const AXES: usize>(
    settings: &Settings<AXES>,
    config: &MachineConfig<AXES>,
    motors: usize,
) -> Config<AXES> {
    let timing = &config.step_timing;
    let shortest_tick_ns = timing.shortest_tick_ns(port_config(settings).pulse_us, motors);
    let shortest_tick = counts(shortest_tick_ns, config.timer_hz);
    let steps_per_mm = settings
        .axes(AxisSetting::StepsPerMm)
        .map(|steps| StepsPerMm::from_nanos(steps.nanos()));
    let rates = settings.axes(AxisSetting::MaxRate);
    Config {
        steps_per_mm,
        max_rate: rates.map(|rate| rate.to_f32() / MINUTE),
        acceleration: from_fn(|axis| acceleration(settings, axis).to_f32()),
        #[cfg(feature = "jerk")]
        jerk: settings.value(Setting::Jerk).to_f32(),
        #[cfg(feature = "jerk")]
        resonance: settings.value(Setting::Resonance).to_f32(),
        #[cfg(not(feature = "jerk"))]
        jerk: 0.0,
        #[cfg(not(feature = "jerk"))]
        resonance: 0.0,
        junction_deviation: settings.value(Setting::JunctionDeviation).to_f32(),
        #[cfg(not(feature = "curves"))]
        corner_rule: CornerRule::Grbl,
        #[cfg(feature = "curves")]
        corner_rule: if settings.is_on(Setting::GrblCorners) {
            CornerRule::Grbl
        } else {
            CornerRule::Limits
        },
        arc_tolerance: settings.value(Setting::ArcTolerance).to_f32(),
        timer_hz: config.timer_hz,
        shortest_tick,
        longest_segment: 0.0, // `Motion` sets it
        moves: config.moves,
        pixels: config.pixels,
    }
}

/// The acceleration of an axis: `$120` and up, but no more than its motor can have.
fn acceleration<const AXES: usize>(settings: &Settings<AXES>, axis: usize) -> Number {
    let asked = settings.get(Key::Axis(AxisSetting::Acceleration, axis));
    asked.min(largest_acceleration(settings, axis).most)
}

/// Returns how motion follows the sender and the laser.
pub(crate) fn pacing<const AXES: usize>(settings: &Settings<AXES>, laser: bool) -> Pacing {
    let silence = u64::from(settings.whole(Setting::StartSilence)) * 1_000;
    let stall = settings.value(Setting::StallReserve).nanos() / 1_000;
    Pacing {
        silence: Duration::from_ticks(silence),
        stall: Duration::from_ticks(stall.unsigned_abs()),
        lead_us: match laser {
            true => lead_us(settings),
            false => 0,
        },
    }
}

/// The laser's lead, µs.
#[cfg(feature = "rasters")]
fn lead_us<const AXES: usize>(settings: &Settings<AXES>) -> u32 {
    settings.whole(Setting::LaserLead)
}

/// A build without rasters has no lead.
#[cfg(not(feature = "rasters"))]
fn lead_us<const AXES: usize>(_: &Settings<AXES>) -> u32 {
    0
}

/// Counts of the step timer in `ns` nanoseconds, rounded up.
pub(crate) fn counts(ns: u32, timer_hz: u32) -> Ticks {
    let counts = u64::from(ns) * u64::from(timer_hz);
    Ticks(counts.div_ceil(1_000_000_000) as u32) // fits: no caller asks for more than 356 µs
}

/// Returns how `S` maps to power.
pub(crate) fn spindle_scale<const AXES: usize>(settings: &Settings<AXES>) -> SpindleScale {
    SpindleScale {
        max: settings.value(Setting::MaxSpeed).to_f32(),
        min: settings.value(Setting::MinSpeed).to_f32(),
    }
}

/// The distance that an axis may go to either side so that its steps, and the steps of any move,
/// fit 32 bits: 2³⁰ steps.
pub(crate) fn reach<const AXES: usize>(settings: &Settings<AXES>) -> [Coordinate; AXES] {
    settings.axes(AxisSetting::StepsPerMm).map(|steps| {
        let steps = StepsPerMm::from_nanos(steps.nanos());
        steps.coordinate(1 << 30).min(MAX_WORD)
    })
}

pub(crate) fn port_config<const AXES: usize>(settings: &Settings<AXES>) -> PortConfig {
    PortConfig {
        pulse_us: u8::try_from(settings.whole(Setting::StepPulse)).unwrap_or(u8::MAX),
        step_invert: MotorMask::from_bits(settings.mask(Setting::StepInvert)),
        direction_invert: MotorMask::from_bits(settings.mask(Setting::DirectionInvert)),
        enable_invert: settings.is_on(Setting::EnableInvert),
        filter_us: settings.whole(Setting::SwitchFilter),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::values::{Entry, Key};
    use leadscrew_planner::ConfigError;
    use std::vec::Vec;

    /// The planner's answer to the defaults with one setting changed, if the table takes the value.
    fn planned(number: u16, value: Number) -> Option<Result<(), ConfigError>> {
        let build = MachineConfig::<3>::new();
        let mut settings = Settings::<3>::new(&[]);
        let entry = Entry { number, value };
        let limits = build.step_timing.limits(3);
        settings.set(entry, limits).ok()?;
        let config = Config {
            longest_segment: 1e-3,
            ..planner_config(&settings, &build, 3)
        };
        Some(config.validate())
    }

    #[test]
    fn whatever_the_table_takes_can_be_planned_with() {
        let ends = [i64::MIN, -1, 0, 1, 1_000_000_000, 255_000_000_000, i64::MAX];
        let taken: Vec<_> = Key::all(3)
            .flat_map(|key| ends.map(|nanos| (key.number(), Number::from_nanos(nanos))))
            .filter_map(|(number, value)| planned(number, value))
            .collect();
        assert!(taken.len() > 100);
        assert!(taken.iter().all(Result::is_ok), "{taken:?}");
    }

    #[test]
    fn a_build_with_which_nothing_can_be_planned_is_refused() {
        let build = MachineConfig::<3> {
            timer_hz: 0,
            ..MachineConfig::new()
        };
        let config = planner_config(&Settings::new(&[]), &build, 3);
        assert!(config.validate().is_err());
    }
}
