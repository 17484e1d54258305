//! Tests of heaters from the sender's view and at their pins, with a plant that gets warm and
//! cools.

#[path = "../../machine/tests/bench/mod.rs"]
mod bench;

use bench::{Memory, Session};
use leadscrew_heat::{
    ConfigError, Gates, Heat, HeatConfig, HeatPort, HeaterConfig, Limits, Sensor,
};
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::extension::{Extension, OutputChange};
use leadscrew_outputs::{OutputPort, Outputs, OutputsConfig};
use leadscrew_planner::Cartesian;
use leadscrew_toolchange::{ToolChange, ToolChangeConfig};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// A body that a heater warms and the room cools: `dT/dt = power·on − (T − room)/tau`.
#[derive(Clone, Debug)]
struct Body {
    celsius: f32,
    on: bool,
    /// The speed at which the heater warms the body, K/s.
    power: f32,
    /// The time constant with which the body cools, s.
    tau: f32,
    /// The temperature that the sensor reads in place of the real one.
    reads: Option<f32>,
    /// True if the relay is stuck.
    stuck: bool,
    most: f32,
    switched: u32,
}

#[derive(Debug)]
struct Plant {
    bodies: [Body; 2],
    fan: u8,
    supply: bool,
    fault: bool,
}

const ROOM: f32 = 22.0;
/// Sensors are read every 100 ms, and the plant is simulated in the same steps, s.
const STEP: f32 = 0.1;

impl Plant {
    fn new() -> Rc<RefCell<Self>> {
        let body = |power, tau| Body {
            celsius: ROOM,
            on: false,
            power,
            tau,
            reads: None,
            stuck: false,
            most: ROOM,
            switched: 0,
        };
        Rc::new(RefCell::new(Self {
            bodies: [body(4.0, 90.0), body(1.0, 300.0)],
            fan: 0,
            supply: false,
            fault: false,
        }))
    }
}

struct Pins(Rc<RefCell<Plant>>);

impl HeatPort for Pins {
    fn sensor(&mut self, heater: usize) -> f32 {
        let mut plant = self.0.borrow_mut();
        let supply = plant.supply;
        let body = &mut plant.bodies[heater];
        let heated = (body.on || body.stuck) && supply;
        let rate = body.power * f32::from(u8::from(heated)) - (body.celsius - ROOM) / body.tau;
        body.celsius += rate * STEP;
        body.most = body.most.max(body.celsius);
        body.reads.unwrap_or(body.celsius) * 0.010 / 5.0
    }
    fn heat(&mut self, heater: usize, on: bool) {
        let body = &mut self.0.borrow_mut().bodies[heater];
        body.switched += u32::from(body.on != on);
        body.on = on;
    }
    fn fan(&mut self, power: u8) {
        self.0.borrow_mut().fan = power;
    }
    fn supply(&mut self, on: bool) {
        self.0.borrow_mut().supply = on;
    }
    fn external_fault(&mut self) -> bool {
        self.0.borrow().fault
    }
}

const CONFIG: HeatConfig = HeatConfig {
    gates: Gates {
        extruder_axis: None,
        feeders: 0b1,
        wait_until_ready: false,
    },
    nozzle: 0,
    bed: Some(1),
    reference: 5.0,
    fan: true,
};

fn heater(name: &'static str) -> HeaterConfig {
    HeaterConfig {
        name,
        sensor: Sensor::AD595,
        hysteresis: 2.0,
        limits: Limits::NOZZLE,
    }
}

fn heat(config: HeatConfig) -> (Heat<Pins, 2>, Rc<RefCell<Plant>>) {
    let plant = Plant::new();
    let heaters = [heater("N"), heater("B")];
    let heat = Heat::new(config, heaters, Pins(plant.clone())).unwrap();
    (heat, plant)
}

#[test]
fn a_heater_that_nobody_would_watch_is_refused() {
    /// A value, and how it is put into a configuration.
    type Place = (fn(&mut HeatConfig, &mut HeaterConfig, f32), ConfigError);
    const PLACES: [Place; 12] = [
        (
            |all, _, value| all.reference = value,
            ConfigError::Reference,
        ),
        (
            |_, one, value| one.limits.most = value,
            ConfigError::Temperatures(1),
        ),
        (
            |_, one, value| one.limits.hottest = value,
            ConfigError::Temperatures(1),
        ),
        (
            |_, one, value| one.limits.coldest = -value,
            ConfigError::Temperatures(1),
        ),
        (
            |_, one, value| one.limits.extrusion = value,
            ConfigError::Temperatures(1),
        ),
        (
            |_, one, value| one.limits.answer = value,
            ConfigError::Answer(1),
        ),
        (
            |_, one, value| one.limits.band = value,
            ConfigError::Band(1),
        ),
        (|_, one, value| one.hysteresis = value, ConfigError::Band(1)),
        (
            |_, one, gain| one.sensor = Sensor::Linear { offset: 0.0, gain },
            ConfigError::Sensor(1),
        ),
        (
            |_, one, r25| {
                one.sensor = Sensor::Thermistor {
                    r25,
                    beta: 1.0,
                    pull_up: 1.0,
                }
            },
            ConfigError::Sensor(1),
        ),
        (
            |_, one, beta| {
                one.sensor = Sensor::Thermistor {
                    r25: 1.0,
                    beta,
                    pull_up: 1.0,
                }
            },
            ConfigError::Sensor(1),
        ),
        (
            |_, one, pull_up| {
                one.sensor = Sensor::Thermistor {
                    r25: 1.0,
                    beta: 1.0,
                    pull_up,
                }
            },
            ConfigError::Sensor(1),
        ),
    ];
    for (place, (put, error)) in PLACES.into_iter().enumerate() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let (mut config, mut second) = (CONFIG, heater("B"));
            put(&mut config, &mut second, value);
            let made: Result<Heat<_, 2>, _> =
                Heat::new(config, [heater("N"), second], Pins(Plant::new()));
            assert_eq!(made.err(), Some(error), "place {place}, {value}");
        }
    }
    const USUAL: Limits = Limits::NOZZLE;
    let limits = [
        (
            Limits {
                patience: 0,
                ..USUAL
            },
            ConfigError::Answer(0),
        ),
        (
            Limits {
                most: 310.0,
                ..USUAL
            },
            ConfigError::Temperatures(0),
        ),
        (Limits { band: 1.9, ..USUAL }, ConfigError::Band(0)),
    ];
    let refused = |config, limits| {
        let only = HeaterConfig {
            limits,
            ..heater("N")
        };
        Heat::<_, 2>::new(config, [only], Pins(Plant::new())).err()
    };
    let alone = HeatConfig {
        bed: None,
        ..CONFIG
    };
    for (limits, error) in limits {
        assert_eq!(refused(alone, limits), Some(error));
    }
    for absent in [
        HeatConfig {
            bed: Some(1),
            ..alone
        },
        HeatConfig { nozzle: 1, ..alone },
    ] {
        assert_eq!(refused(absent, USUAL), Some(ConfigError::NoSuchHeater));
    }
    assert_eq!(refused(alone, USUAL), None);
}

fn boot<X: Extension<3>>(memory: &mut Memory, extension: X) -> Session<'_, Cartesian, X> {
    let mut config = MachineConfig::grbl();
    config.dialect.tools = true;
    Session::extended(memory, config, Cartesian, extension)
}

#[test]
fn m109_waits_until_the_nozzle_is_warm_and_the_relay_keeps_it_so() {
    let mut memory = Memory::new();
    let (extension, plant) = heat(CONFIG);
    let mut session = boot(&mut memory, extension);
    session.send("M109S180\nG1X1F600\n");
    session.wait_ms(5_000);
    assert!(session.status().starts_with("<Run|"));
    assert_eq!(session.lines(), [""; 0]);
    assert_eq!(session.pins.position, [0; 3]);
    session.until_quiet();
    assert_eq!(session.lines(), ["ok", "ok"]);
    assert!((178.0..182.0).contains(&plant.borrow().bodies[0].celsius));
    let before = plant.borrow().bodies[0].switched;
    for _ in 0..600 {
        session.wait_ms(100);
        let celsius = plant.borrow().bodies[0].celsius;
        assert!((176.0..184.0).contains(&celsius), "{celsius}");
    }
    let often = plant.borrow().bodies[0].switched - before;
    assert!((4..60).contains(&often), "{often} times a minute");
    assert!(!plant.borrow().bodies[1].on, "the bed is its own");
}

#[test]
fn m104_and_m140_do_not_wait_m116_waits_for_both() {
    let mut memory = Memory::new();
    let (extension, plant) = heat(CONFIG);
    let mut session = boot(&mut memory, extension);
    assert_eq!(session.line("M104S100"), ["ok"]);
    assert_eq!(session.line("M140S50"), ["ok"]);
    session.send("M116\n");
    session.wait_ms(1_000);
    assert_eq!(session.lines(), [""; 0]);
    session.until_quiet();
    let plant = plant.borrow();
    assert!(
        plant
            .bodies
            .iter()
            .zip([97.0, 47.0])
            .all(|(body, least)| body.celsius > least),
        "{:?} {:?}",
        plant.bodies,
        session.lines()
    );
}

#[test]
fn m105_and_reports_show_temperatures_and_s_stays_the_spindles() {
    let mut memory = Memory::new();
    let (extension, plant) = heat(CONFIG);
    let mut session = boot(&mut memory, extension);
    session.line("M3S500");
    session.line("M104S180");
    session.wait_ms(200);
    let now = plant.borrow().bodies[0].celsius;
    assert_eq!(
        session.line("M105"),
        [format!("[HEAT:N,{now:.1},180.0;B,22.0,0.0]"), "ok".into()]
    );
    assert!(
        session.status().contains("|Heat:N,"),
        "{}",
        session.status()
    );
    assert!(session.line("$G")[0].contains(" S500]"));
    session.line("M106S128");
    assert_eq!(plant.borrow().fan, 128);
    session.line("M106");
    assert_eq!(plant.borrow().fan, 255);
    session.line("M107");
    assert_eq!(plant.borrow().fan, 0);
}

#[test]
fn what_a_heater_does_not_take_changes_nothing() {
    let mut memory = Memory::new();
    let (extension, plant) = heat(CONFIG);
    let mut session = boot(&mut memory, extension);
    for (line, error) in [
        ("M104S276", "error:221"),
        ("M104S100P2", "error:222"),
        ("M104", "error:28"),
        ("M104S-1", "error:4"),
        ("G1X1F600M104S276", "error:221"),
    ] {
        assert_eq!(session.line(line).last().unwrap(), error, "{line}");
    }
    session.wait_ms(500);
    assert!(!plant.borrow().bodies[0].on);
    assert_eq!(session.pins.position, [0; 3]);
}

#[test]
fn nothing_is_extruded_below_the_minimum() {
    let mut memory = Memory::new();
    let gates = Gates {
        extruder_axis: Some(2),
        ..CONFIG.gates
    };
    let (extension, _) = heat(HeatConfig { gates, ..CONFIG });
    let mut session = boot(&mut memory, extension);
    assert_eq!(session.line("G1X1F600"), ["ok"]);
    for line in ["G1X2Z1F600", "$J=Z1F600"] {
        assert_eq!(session.line(line).last().unwrap(), "error:220", "{line}");
    }
    session.send("M109S180\n");
    session.until_quiet();
    session.lines();
    assert_eq!(session.line("G1X2Z1F600"), ["ok"]);
    assert_eq!(session.pins.position, [500, 0, 250]);
}

#[test]
fn no_program_moves_until_the_heaters_are_ready_where_that_is_asked_for() {
    let mut memory = Memory::new();
    let gates = Gates {
        wait_until_ready: true,
        ..CONFIG.gates
    };
    let (extension, plant) = heat(HeatConfig { gates, ..CONFIG });
    let mut session = boot(&mut memory, extension);
    session.send("M104S100\nG1X1F600\n");
    session.wait_ms(2_000);
    assert_eq!(session.pins.position, [0; 3]);
    session.until_quiet();
    assert_eq!(session.pins.position, [250, 0, 0]);
    assert!(plant.borrow().bodies[0].celsius > 97.0);
}

/// Warms up and lets something go wrong during a job. Returns the output with the alarm that
/// follows within a minute, and the plant.
fn alarm_after(go_wrong: impl FnOnce(&mut Plant)) -> (Vec<String>, Rc<RefCell<Plant>>) {
    let mut memory = Memory::new();
    let (extension, plant) = heat(CONFIG);
    let mut session = boot(&mut memory, extension);
    session.send("M109S180\n");
    session.until_quiet();
    session.wait_ms(20_000);
    session.send("G1X1000F600\n");
    session.wait_ms(1_000);
    session.lines();
    go_wrong(&mut plant.borrow_mut());
    session.wait_ms(60_000);
    let (stood, lines) = (session.pins.position, session.lines());
    session.wait_ms(1_000);
    assert_eq!(session.pins.position, stood, "motion has stopped");
    assert!(session.status().starts_with("<Alarm|"));
    assert!(plant.borrow().bodies.iter().all(|body| !body.on), "all off");
    (lines, plant)
}

#[test]
fn each_fault_stops_the_job_switches_off_and_has_its_name() {
    type GoWrong = fn(&mut Plant);
    let cases: [(GoWrong, &str, &str); 5] = [
        (
            |plant| plant.bodies[0].reads = Some(400.0),
            "ALARM:220",
            "Heater N: Temperature sensor is open",
        ),
        (
            |plant| plant.bodies[0].reads = Some(-20.0),
            "ALARM:221",
            "Heater N: Temperature sensor is shorted",
        ),
        (
            |plant| plant.bodies[0].reads = Some(170.0),
            "ALARM:222",
            "Heater N: Temperature does not rise",
        ),
        (
            |plant| plant.bodies[0].reads = Some(140.0),
            "ALARM:223",
            "Heater N: Temperature runs away from its target",
        ),
        (
            |plant| plant.fault = true,
            "ALARM:225",
            "Heater N: Fault input of the heaters",
        ),
    ];
    for (go_wrong, alarm, message) in cases {
        let (lines, _) = alarm_after(go_wrong);
        let count = |wanted: &str| lines.iter().filter(|line| **line == wanted).count();
        assert_eq!(count(alarm), 1, "{lines:?}");
        assert_eq!(count(&format!("[MSG:{message}]")), 1, "{lines:?}");
    }
}

#[test]
fn a_fault_that_lasts_is_told_again_after_an_unlock() {
    let mut memory = Memory::new();
    let (extension, plant) = heat(CONFIG);
    let mut session = boot(&mut memory, extension);
    plant.borrow_mut().fault = true;
    session.wait_ms(2_000);
    session.lines();
    session.line("$X");
    session.wait_ms(2_000);
    let lines = session.lines();
    let alarms = lines.iter().filter(|line| *line == "ALARM:225").count();
    assert_eq!(alarms, 1, "{lines:?}");
    assert!(session.status().starts_with("<Alarm|"));
}

#[test]
fn a_relay_that_is_stuck_cuts_the_supply_and_tells_the_operator() {
    let mut memory = Memory::new();
    let (extension, plant) = heat(CONFIG);
    let mut session = boot(&mut memory, extension);
    plant.borrow_mut().bodies[1].stuck = true;
    session.wait_ms(30_000);
    let lines = session.lines();
    assert!(lines.contains(&"ALARM:224".to_owned()), "{lines:?}");
    assert!(lines.contains(&"[MSG:Cut the power: heater B does not go off]".to_owned()));
    assert!(!plant.borrow().supply);
    let most = plant.borrow().bodies[1].most;
    session.wait_ms(60_000);
    assert_eq!(plant.borrow().bodies[1].most, most, "it cools");
}

#[test]
fn a_reset_switches_heaters_and_fan_off_at_rest_and_in_motion() {
    let mut memory = Memory::new();
    let (extension, plant) = heat(CONFIG);
    let mut session = boot(&mut memory, extension);
    session.line("M104S180");
    session.line("M106");
    session.wait_ms(500);
    assert!(plant.borrow().bodies[0].on && plant.borrow().fan > 0);
    session.send([0x18]);
    session.wait_ms(10);
    assert!(!plant.borrow().bodies[0].on && plant.borrow().fan == 0);
    session.wait_ms(500);
    assert!(!plant.borrow().bodies[0].on);
    session.send("M104S180\nG1X50F600\n");
    session.wait_ms(500);
    session.send([0x18]);
    session.wait_ms(500);
    assert!(!plant.borrow().bodies[0].on);
    assert!(session.status().contains("Heat:N,"));
}

#[test]
fn a_hold_keeps_a_nozzle_warm_and_the_end_of_the_program_does_not() {
    let mut memory = Memory::new();
    let (extension, plant) = heat(CONFIG);
    let mut session = boot(&mut memory, extension);
    session.send("M109S180\n");
    session.until_quiet();
    session.send("G1X50F600\n");
    session.wait_ms(500);
    session.send("!");
    session.wait_ms(60_000);
    assert!(plant.borrow().bodies[0].celsius > 175.0);
    session.send("~");
    session.until_quiet();
    session.line("M2");
    session.wait_ms(500);
    assert!(!plant.borrow().bodies[0].on);
}

struct Wires(Rc<Cell<u8>>);

impl OutputPort for Wires {
    fn change(&mut self, change: OutputChange) {
        self.0.set(change.applied_to(self.0.get()));
    }
    fn levels(&self) -> u8 {
        self.0.get()
    }
}

#[test]
fn heaters_a_feeder_and_a_tool_change_are_one_extension() {
    let mut memory = Memory::new();
    let levels = memory.outputs.clone();
    let outputs = Outputs::new(
        OutputsConfig {
            count: 1,
            ..OutputsConfig::default()
        },
        Wires(levels.clone()),
    );
    let (heat, plant) = heat(CONFIG);
    let tools = ToolChange::<3, 1024>::new(ToolChangeConfig::default());
    let mut session = boot(&mut memory, ((heat, outputs), tools));
    assert_eq!(
        session.line("M62P0").last().unwrap(),
        "error:220",
        "too cold for the feeder"
    );
    assert_eq!(session.line("M64P0").last().unwrap(), "error:220");
    session.send("M109S180\n");
    session.until_quiet();
    session.lines();
    session.send("M62P0\nG1X2F600\nT1M6\nG1X4\nM63P0\nX5\n");
    session.until(|session| session.pins.position[0] > 250);
    assert_eq!(levels.get(), 1);
    session.wait_ms(3_000);
    assert!(session.status().starts_with("<Hold:0|"));
    assert!(
        plant.borrow().bodies[0].celsius > 175.0,
        "warm during the tool change"
    );
    assert_eq!(levels.get(), 0, "and the feeder stands");
    session.send("~");
    session.until(|session| session.pins.position[0] > 3 * 250);
    assert_eq!(levels.get(), 1);
    session.until_quiet();
    assert_eq!(levels.get(), 0);
    let report = session.status();
    for field in ["|Heat:", "|Out:0", "|T:1"] {
        assert!(report.contains(field), "{field} in {report}");
    }
}
