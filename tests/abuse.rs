//! Tests that send any bytes and change any inputs at any time, and check what must always hold.
//!
//! A session is a *script* of bytes, so that a fuzzer can change it, a property test can shorten
//! it, and a failure can be kept as a string. The first byte chooses the machine, a [`Build`]. The
//! other bytes mean:
//!
//! | byte | what happens |
//! |---|---|
//! | 0xE0 to 0xE7 | an input changes its level: limits X, Y, Z, probe, reset, hold, start, door |
//! | 0xF0 to 0xF7 | 1, 2, 4 … 128 ms pass |
//! | 0xFF | the bytes that follow go over the other serial line |
//! | any other | is sent |
//!
//! Grbl gives no meaning to the bytes of the table. Line 0 never waits, and line 1 runs at 115 200
//! baud. The script ignores flow control, so that receive buffers overflow, too.

mod light;
mod wires;

use leadscrew_machine::board::{CoolantOutput, SpindleOutput};
use leadscrew_machine::config::{MachineConfig, ParkingConfig};
use leadscrew_machine::settings::table::{AxisSetting, Setting};
use leadscrew_machine::state::{Door, Lock, State};
use leadscrew_planner::Cartesian;
use leadscrew_sim::plant::Pin;
use leadscrew_sim::{Cycle, Memory, Rate, Setup, Simulation, Stopped};
use leadscrew_stepper::Power;
use light::Light;
use std::num::NonZeroU32;
use wires::{Wires, LINES};

/// Few planned moves, so that the planner is full at times.
const MOVES: usize = 16;

const BAUD: Rate = Rate::Baud(NonZeroU32::new(115_200).unwrap());

/// The longest time that a script may take, ms. The rest of a longer script is left out.
const LONGEST: u64 = 4_000;

/// The inputs in the order of their bytes.
const PINS: [Pin; 8] = [
    Pin::Limit(0),
    Pin::Limit(1),
    Pin::Limit(2),
    Pin::Probe,
    Pin::Reset,
    Pin::Hold,
    Pin::Start,
    Pin::Door,
];

/// Speeds and accelerations so high that much happens in little time.
const SETTINGS: &str = "$110=6000\n$111=6000\n$112=6000\n$120=500\n$121=500\n$122=500\n$10=255\n";

/// One step of a script.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Act {
    Toggle(Pin),
    Wait(u64),
    OtherLine,
    Send(u8),
}

impl Act {
    fn of(byte: u8) -> Self {
        match byte {
            0xE0..=0xE7 => Self::Toggle(PINS[usize::from(byte & 7)]),
            0xF0..=0xF7 => Self::Wait(1 << (byte & 7)),
            0xFF => Self::OtherLine,
            other => Self::Send(other),
        }
    }
}

/// The machine of a script: the bits of a script's first byte.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Build(u8);

impl Build {
    /// The setting lines that each bit of the first byte adds.
    const SETTINGS: [(u8, &'static str); 4] = [
        (0x01, "$32=1\n"),
        (0x02, "$21=1\n"),
        (0x04, "$22=1\n$25=6000\n$24=1000\n$26=5\n"),
        (0x08, "$22=1\n$20=1\n$130=20\n"),
    ];
    /// Stock Grbl's sizes, and motion that starts at once.
    const GRBL: u8 = 0x10;
    /// All options that Grbl fixes when it is compiled.
    const OPTIONS: u8 = 0x20;

    fn has(self, bit: u8) -> bool {
        self.0 & bit != 0
    }

    fn setup(self) -> Setup<3> {
        let mut machine = match self.has(Self::GRBL) {
            true => MachineConfig::grbl(),
            false => MachineConfig::new(),
        };
        if self.has(Self::OPTIONS) {
            let options = &mut machine.options;
            options.door = true;
            options.line_numbers = true;
            options.single_axis_homing = true;
            options.parking = Some(ParkingConfig::GRBL);
            machine.dialect.mist = true;
            machine.dialect.parking_override = true;
        }
        let mut setup = Setup::new(machine, Rate::NeverWaits);
        setup.lines = vec![Rate::NeverWaits, BAUD];
        setup.receive_buffer = usize::from(machine.receive_size);
        setup
    }

    fn settings(self) -> String {
        let chosen = Self::SETTINGS.iter().filter(|(bit, _)| self.has(*bit));
        chosen.fold(SETTINGS.to_owned(), |all, (_, lines)| all + lines)
    }
}

/// A machine under strain, which is checked after every turn of its main loop.
struct Trial<'a> {
    sim: Simulation<'a, Cartesian, Light, 3, 3, MOVES>,
    wires: Wires,
    line: usize,
    levels: [bool; PINS.len()],
    /// The carriages' places when the machine was found locked.
    locked_at: Option<[i32; 3]>,
    /// The banners that had been heard at the last check: each shows a reset. A reset and an alarm
    /// drop the planned moves. The end of a jog may do so, too, since the jog may be cancelled.
    banners: usize,
    jogging: bool,
    /// The machine was asleep at the last check, with nothing under way. Before that, on its way to
    /// sleep, the spindle may still turn until the tool has been pulled out.
    asleep: bool,
}

impl<'a> Trial<'a> {
    fn new(memory: &'a mut Memory<3, 3, MOVES>, setup: &Setup<3>) -> Self {
        Self {
            sim: Simulation::new(memory, setup, Cartesian, Light::default()),
            wires: Wires::default(),
            line: 0,
            levels: [true; PINS.len()],
            locked_at: None,
            banners: 0,
            jogging: false,
            asleep: false,
        }
    }

    fn act(&mut self, act: Act) {
        match act {
            Act::Send(byte) => self.wires.0[self.line].send(&[byte]),
            Act::OtherLine => self.line = (self.line + 1) % LINES,
            Act::Wait(millis) => self.wait_ms(millis),
            Act::Toggle(pin) => self.toggle(pin),
        }
    }

    fn toggle(&mut self, pin: Pin) {
        // Deliver the bytes that were sent before this edge.
        self.wait_ms(0);
        let index = PINS.iter().position(|other| *other == pin);
        let level = &mut self.levels[index.expect("a pin of the table")];
        *level = !*level;
        self.sim.set_pin(pin, *level);
    }

    fn wait_ms(&mut self, millis: u64) {
        let end = self.sim.now() + Cycle::from_micros(millis * 1000).0;
        while self.sim.run_while(&mut self.wires, end, |_| false) == Stopped::Condition {
            self.look();
        }
        self.sim.wait_until(&mut self.wires, end);
        self.look();
    }

    /// Checks that nothing moves in Alarm, and that a laser is dark in states that forbid light.
    fn look(&mut self) {
        let place = self.sim.board().plant.position();
        let locked = matches!(self.sim.machine().state(), State::Alarm(_));
        if let (true, Some(before)) = (locked, self.locked_at) {
            assert_eq!(place, before, "motion in Alarm at {}", self.sim.now());
        }
        self.locked_at = locked.then_some(place);
        self.look_at_light();
        self.look_at_outputs();
    }

    /// Checks that no power is put out without M3 or M4, and that all outputs are off in the states
    /// that require it.
    fn look_at_outputs(&mut self) {
        let machine = self.sim.machine();
        let asleep = machine.state() == State::Sleep && machine.is_quiet();
        let slept = std::mem::replace(&mut self.asleep, asleep) && asleep;
        let board = self.sim.board();
        let off = board.spindle() == SpindleOutput::Off;
        assert!(!off || board.power() == Power::OFF, "power without M3, M4");
        let state = self.sim.machine().state();
        let all_off = match state {
            State::Sleep => slept,
            State::Door(Door::Parked) | State::Alarm(Lock::Critical) => true,
            State::Idle
            | State::Run
            | State::Jog(_)
            | State::Hold(_)
            | State::Home
            | State::Door(Door::Stopping | Door::Retracting | Door::Restoring)
            | State::Alarm(Lock::Unlockable)
            | State::Check => false,
        };
        let dry = board.coolant() == CoolantOutput::default();
        assert!(!all_off || off && dry, "something is on: {state:?}");
    }

    fn look_at_light(&mut self) {
        let machine = self.sim.machine();
        let settings = machine.settings();
        let told = settings.is_on(Setting::Laser) && settings.whole(Setting::LaserLead) == 0;
        let state = machine.state();
        let wrong = self.sim.observer().take_wrong();
        assert!(!told || wrong.is_none(), "lit in a dark move at {wrong:?}");
        let jogging = matches!(state, State::Jog(_));
        let dropped = self.banners != self.wires.banners()
            || matches!(state, State::Alarm(_))
            || self.jogging && !jogging;
        self.jogging = jogging;
        let at_door = matches!(state, State::Door(_));
        self.sim.observer().end_turn(at_door, dropped);
        self.banners = self.wires.banners();
    }

    /// Sends bytes on the line that never waits. Returns the bytes that come on it within `millis`.
    fn ask(&mut self, bytes: &[u8], millis: u64) -> String {
        let [heard, _] = self.ask_on(&[0], bytes, millis);
        heard
    }

    /// Sends the same bytes on some lines, after dropping the bytes that wait to be sent. Answers
    /// what is heard on each line within `millis`.
    fn ask_on(&mut self, lines: &[usize], bytes: &[u8], millis: u64) -> [String; LINES] {
        let begin = self.wires.begin();
        lines
            .iter()
            .for_each(|line| self.wires.0[*line].send(bytes));
        self.wait_ms(millis);
        self.wires.heard_since(begin)
    }

    /// Checks that each line answers `?` with a report. Older output goes out first: 1 KiB takes 89
    /// ms at 115 200 baud.
    fn assert_answers(&mut self) {
        self.wait_ms(200);
        for heard in self.ask_on(&[0, 1], b"?", 300) {
            let mut lines = heard.lines();
            let report = lines.any(|line| line.starts_with('<') && line.ends_with('>'));
            assert!(
                report,
                "no report, {:?}: {heard}",
                self.sim.machine().state()
            );
        }
    }

    /// Checks that each line has had its answer and, at rest with nothing to do, that pins and
    /// reports are what the modes say.
    fn assert_true_to_its_word(&mut self) {
        self.ask_on(&[0, 1], b"\n", 300);
        let idle = self.is_idle();
        // The board may still be sending: it buffers as much output as it sends in 0.7 ms.
        self.wait_ms(2);
        for (number, wire) in self.wires.0.iter().enumerate() {
            wire.assert_answered(idle && self.sim.lost_bytes(number) == 0);
        }
        // A full receive buffer may have lost the end of a line, too.
        if !idle || self.sim.lost_bytes(0) > 0 {
            return;
        }
        let modes = self.ask(b"$G\n", 50);
        self.assert_pins(&modes);
        let report = self.ask(b"?", 50);
        self.assert_position(&report);
    }

    fn is_idle(&self) -> bool {
        let machine = self.sim.machine();
        machine.is_quiet() && machine.state() == State::Idle
    }

    fn assert_pins(&self, modes: &str) {
        let words: Vec<_> = modes.split([':', ' ', ']']).collect();
        let has = |mode: &str| words.contains(&mode);
        let board = self.sim.board();
        let spindle = match board.spindle() {
            SpindleOutput::Off => "M5",
            SpindleOutput::Clockwise => "M3",
            SpindleOutput::CounterClockwise => "M4",
        };
        let stands = spindle == "M5" && self.wires.stop_the_spindle();
        assert!(has(spindle) || stands, "{spindle}: {modes}");
        let coolant = CoolantOutput {
            flood: has("M8"),
            mist: has("M7"),
        };
        assert_eq!(board.coolant(), coolant, "{modes}");
        let burns = has("M3") && ["G1", "G2", "G3"].into_iter().any(has);
        let laser = self.sim.machine().settings().is_on(Setting::Laser);
        let on = board.power() > Power::OFF;
        let may_be_on = if laser { burns } else { !has("M5") };
        assert!(!on || may_be_on, "power is on: {modes}");
        let zero = has("S0");
        let may_be_off = laser || zero || has("M5") || stands;
        assert!(on || may_be_off, "power is off: {modes}");
    }

    fn assert_position(&self, report: &str) {
        let settings = self.sim.machine().settings();
        let Some((_, rest)) = report.split_once("MPos:") else {
            return;
        };
        let unit = if settings.is_on(Setting::Inches) {
            25.4
        } else {
            1.0
        };
        let places = rest.split('|').next().unwrap_or_default().split(',');
        let scales = settings.axes(AxisSetting::StepsPerMm);
        let counts = self.sim.counted_position();
        for ((place, steps), scale) in places.zip(counts).zip(scales) {
            let place: f64 = place.parse().expect("a number");
            let counted = f64::from(steps) / f64::from(scale.to_f32());
            // Allows for three decimals, and for steps/mm rounded to f32.
            let near = (place * unit - counted).abs() <= 0.001 * unit + 1e-6 * counted.abs();
            assert!(near, "{report}: counted {counts:?}");
        }
    }

    /// Checks that the machine takes lines again after its inputs are released, a reset and an
    /// unlock, unless a startup line keeps it busy. After the reset it is locked if it was locked,
    /// asleep or moving before, and only then.
    fn assert_recovers(&mut self) {
        for (pin, level) in PINS.into_iter().zip(&mut self.levels) {
            *level = true;
            self.sim.set_pin(pin, true);
        }
        let before = self.sim.machine().state();
        let heard = self.ask(b"\x18", 300);
        let (farewell, greeting) = heard.split_once("Grbl 1.1h").expect("a greeting");
        let was_locked = matches!(before, State::Alarm(_) | State::Sleep | State::Home);
        let locks = was_locked || farewell.contains("ALARM:") || greeting.contains("Check Limits");
        assert_eq!(greeting.contains("to unlock"), locks, "{before:?}: {heard}");
        self.assert_answers();
        let machine = self.sim.machine();
        if machine.is_quiet() && machine.state().takes_lines() {
            let answer = self.ask(b"\n", 50);
            assert!(answer.contains("ok\r\n"), "{answer}");
        }
    }
}

/// Plays a script. Checks that nothing panics, nothing moves in Alarm, a laser is dark wherever it
/// has to be, no pulse is lost, the carriages stand where they are counted and where reports say,
/// each line has one answer, outputs are what `$G` says, and `?` is answered, after a reset, too.
pub fn endure(script: &[u8]) {
    let Some((build, script)) = script.split_first() else {
        return;
    };
    let build = Build(*build);
    let setup = build.setup();
    let mut memory = Memory::new(&setup);
    let mut trial = Trial::new(&mut memory, &setup);
    trial.ask(build.settings().as_bytes(), 200);
    let end = trial.sim.now() + Cycle::from_micros(LONGEST * 1000).0;
    for act in script.iter().map(|byte| Act::of(*byte)) {
        trial.act(act);
        if trial.sim.now() > end {
            break;
        }
    }
    trial.assert_answers();
    trial.assert_true_to_its_word();
    trial.assert_recovers();
    let outcome = trial.sim.outcome();
    let violations = outcome.violations;
    assert!(violations.is_empty(), "{:?}", violations.first());
}
