//! Any value of any field of a machine's build: it is refused in words, or a machine boots and moves.

use crate::bench::{Memory, Session};
use leadscrew_machine::board::Duration;
use leadscrew_machine::config::{AxisKind, MachineConfig, ParkingConfig};
use leadscrew_machine::settings::values::Entry;
use leadscrew_planner::Cartesian;

type Build = MachineConfig<3>;

const FLOATS: [f32; 13] = [
    f32::NAN,
    f32::NEG_INFINITY,
    f32::MIN,
    -5.0,
    -1e-30,
    -0.0,
    0.0,
    f32::MIN_POSITIVE,
    0.05,
    2.5,
    1e9,
    f32::MAX,
    f32::INFINITY,
];

/// Returns why the build is refused; otherwise boots it and moves it.
fn refusal(config: Build) -> Option<String> {
    let mut memory = Memory::new();
    let mut session = match Session::try_extended(&mut memory, config, Cartesian, ()) {
        Ok(session) => session,
        Err(error) => return Some(error.to_string()),
    };
    session.line("G0X0.4");
    session.line("G2X0I-0.2F200");
    assert_eq!(session.pins.position, [0; 3]);
    assert!(session.pins.pulses[0] > 100);
    None
}

fn check(name: &str, value: impl std::fmt::Debug, allowed: bool, config: Build) {
    let refused = refusal(config);
    assert_eq!(refused.is_none(), allowed, "{name} {value:?}: {refused:?}");
    let told = refused.is_none_or(|text| text.contains(name));
    assert!(told, "{name} {value:?}");
}

/// A build that parks, for changes to its parking.
fn parking(config: &mut Build) -> &mut ParkingConfig {
    config.options.parking.get_or_insert(ParkingConfig::GRBL)
}

fn is_distance(mm: f32) -> bool {
    (0.0..=2e9).contains(&mm)
}

fn is_rate(rate: f32) -> bool {
    rate > 0.0 && rate <= 2e9
}

#[test]
fn a_number_of_a_build_is_in_its_range_or_refused_by_name() {
    type Field = (&'static str, fn(&mut Build, f32), fn(f32) -> bool);
    let fields: [Field; 8] = [
        ("squaring", |of, x| of.squaring.tolerance = x, is_distance),
        ("squaring", |of, x| of.squaring.least_mm = x, is_distance),
        ("squaring", |of, x| of.squaring.most_mm = x, is_distance),
        ("back_off", |of, x| of.rules.back_off_mm = x, is_distance),
        (
            "parking",
            |of, x| parking(of).target_mm = x,
            |x| x.abs() <= 2e9,
        ),
        ("parking", |of, x| parking(of).rate = x, is_rate),
        ("parking", |of, x| parking(of).pull_out_rate = x, is_rate),
        ("parking", |of, x| parking(of).pull_out_mm = x, is_distance),
    ];
    for (name, set, allows) in fields {
        for value in FLOATS {
            let mut config = Build::new();
            set(&mut config, value);
            check(name, value, allows(value), config);
        }
    }
}

#[test]
fn a_time_of_making_steps_is_in_its_range_or_refused_by_name() {
    type Field = (&'static str, fn(&mut Build, u32), fn(u32) -> bool);
    let fields: [Field; 6] = [
        (
            "step_timing",
            |of, x| of.step_timing.tick_ns = x,
            |x| (1..=100_000).contains(&x),
        ),
        (
            "step_timing",
            |of, x| of.step_timing.motor_ns = x,
            |x| x <= 20_000,
        ),
        (
            "step_timing",
            |of, x| of.step_timing.line_ns = x,
            |x| x <= 100_000,
        ),
        (
            "step_timing",
            |of, x| of.step_timing.pulse_end_ns = x,
            |x| x <= 100_000,
        ),
        (
            "step_timing",
            |of, x| of.step_timing.setup_ns = x,
            |x| x <= 100_000,
        ),
        (
            "step_timing",
            |of, x| of.step_timing.shortest_pulse_us = u8::try_from(x).unwrap_or(0),
            |x| (1..=255).contains(&x),
        ),
    ];
    for (name, set, allows) in fields {
        for value in [
            0,
            1,
            255,
            2_100,
            20_000,
            100_000,
            1_000_000,
            1 << 31,
            u32::MAX,
        ] {
            let mut config = Build::new();
            set(&mut config, value);
            check(name, value, allows(value), config);
        }
    }
    let mut none = Build::new();
    let timing = &mut none.step_timing;
    (timing.tick_ns, timing.motor_ns, timing.line_ns) = (0, 0, 0);
    check("tick_ns", "all 0", false, none);
}

#[test]
fn a_whole_number_of_a_build_is_in_its_range_or_refused_by_name() {
    type Field = (&'static str, fn(&mut Build, usize), fn(usize) -> bool);
    let fields: [Field; 8] = [
        (
            "timer",
            |of, x| of.timer_hz = x as u32,
            |x| (x as u32) >= 1_000_000,
        ),
        ("move", |of, x| of.moves = x, |x| x > 0),
        ("pixels", |of, x| of.pixels = x, |_| true),
        (
            "receive_size",
            |of, x| of.receive_size = x as u16,
            |x| x as u16 > 0,
        ),
        ("line_length", |of, x| of.line_length = x, |x| x > 0),
        (
            "delay",
            |of, x| of.spindle_delay = Duration::from_ticks(x as u64),
            |x| x <= 3_600_000_000,
        ),
        (
            "delay",
            |of, x| of.coolant_delay = Duration::from_ticks(x as u64),
            |x| x <= 3_600_000_000,
        ),
        ("axis", |of, x| parking(of).axis = x, |x| x < 3),
    ];
    for (name, set, allows) in fields {
        for value in [
            0,
            1,
            2,
            3,
            7,
            999_999,
            84_000_000,
            u32::MAX as usize,
            usize::MAX,
        ] {
            // The bench's timer counts 84 MHz, and its lines are longer than a few characters.
            let runs = match name {
                "timer" => value == 84_000_000 || !allows(value),
                "line_length" => value > 20 || !allows(value),
                _ => true,
            };
            if runs {
                let mut config = Build::new();
                set(&mut config, value);
                check(name, value, allows(value), config);
            }
        }
    }
}

#[test]
fn axes_are_those_of_a_machine_or_refused() {
    use AxisKind::{Absent, Extruder, Linear, Rotary};
    let kinds = [Linear, Rotary, Extruder, Absent];
    for x in kinds {
        for y in kinds {
            let config = Build {
                axes: [x, y, Linear],
                ..Build::new()
            };
            let allowed = [x, y].iter().all(|kind| matches!(kind, Linear | Rotary));
            check("axes", [x, y], allowed, config);
        }
    }
    let of = |axes| {
        MachineConfig::<6> {
            axes,
            ..MachineConfig::new()
        }
        .validate()
        .is_ok()
    };
    assert!(of([Linear, Linear, Linear, Rotary, Extruder, Absent]));
    assert!(of([Linear, Linear, Linear, Absent, Absent, Absent]));
    assert!(!of([Linear, Linear, Linear, Absent, Linear, Absent]));
    assert!(!of([Linear, Linear, Linear, Extruder, Extruder, Absent]));
    assert!(!of([Absent; 6]));
    assert!(MachineConfig::<0>::new().validate().is_err());
}

/// The table refuses each by itself, and the default stays.
#[test]
fn defaults_that_the_table_does_not_take_change_nothing() {
    use leadscrew_gcode::Number;
    const ODD: &[Entry] = &[
        Entry {
            number: 9_999,
            value: Number::from_int(1),
        },
        Entry {
            number: 100,
            value: Number::from_int(0),
        },
        Entry {
            number: 110,
            value: Number::from_int(-5),
        },
        Entry {
            number: 0,
            value: Number::from_int(i32::MAX),
        },
        Entry {
            number: 12,
            value: Number::from_nanos(0),
        },
    ];
    let mut memory = Memory::new();
    let config = Build {
        defaults: ODD,
        ..Build::new()
    };
    let mut session = Session::boot(&mut memory, config);
    let mut usual = Memory::new();
    let mut plain = Session::boot(&mut usual, Build::new());
    assert_eq!(session.line("$$"), plain.line("$$"));
}
