//! Whatever comes over the wires and the pins, at whatever moment: what must hold all the same.
//!
//! A session is a *script* of bytes, so that a fuzzer can change it, a property test can shorten it, and a failure can be
//! kept as a string. Its first byte is the machine, a [`Build`]; of the others
//!
//! | byte | what happens |
//! |---|---|
//! | 0xE0 to 0xE7 | an input changes its level: limits X, Y, Z, probe, reset, hold, start, door |
//! | 0xF0 to 0xF7 | 1, 2, 4 … 128 ms pass |
//! | 0xFF | the bytes that follow go over the other serial line |
//! | any other | is sent |
//!
//! Grbl knows none of the bytes of the table. Line 0 never waits, line 1 has 115 200 baud; neither counts characters, so
//! that receive buffers overflow, too.

use crate::Recorder;
use leadscrew_machine::board::ChannelId;
use leadscrew_machine::config::{MachineConfig, ParkingConfig};
use leadscrew_machine::state::State;
use leadscrew_planner::Cartesian;
use leadscrew_sim::plant::Pin;
use leadscrew_sim::{Cycle, Host, Memory, Rate, Setup, Simulation, Stopped};
use std::collections::VecDeque;
use std::num::NonZeroU32;

/// Few, so that the planner is full at times.
const MOVES: usize = 16;

/// Serial lines.
const LINES: usize = 2;

const BAUD: Rate = Rate::Baud(NonZeroU32::new(115_200).unwrap());

/// The longest that a script may take, after which its rest is left out, ms.
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

/// Speed enough that much happens in little time.
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

/// Which machine it is: the bits of a script's first byte.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Build(u8);

impl Build {
    /// Bits and the settings that they stand for.
    const SETTINGS: [(u8, &'static str); 4] = [
        (0x01, "$32=1\n"),
        (0x02, "$21=1\n"),
        (0x04, "$22=1\n$25=6000\n$24=1000\n$26=5\n"),
        (0x08, "$22=1\n$20=1\n$130=20\n"),
    ];
    /// Stock Grbl's sizes, and motion that starts at once.
    const GRBL: u8 = 0x10;
    /// All that Grbl decides when it is compiled.
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
            options.mist = true;
            options.door = true;
            options.line_numbers = true;
            options.single_axis_homing = true;
            options.parking = Some(ParkingConfig::GRBL);
            options.parking_override = true;
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

/// Both ends of the serial lines that are not the machine's.
#[derive(Default)]
struct Wires {
    to_send: [VecDeque<u8>; LINES],
    heard: [Vec<u8>; LINES],
}

impl Host for Wires {
    fn next_byte(&mut self, channel: ChannelId) -> Option<u8> {
        self.to_send[usize::from(channel.0)].pop_front()
    }
    fn receive(&mut self, channel: ChannelId, byte: u8, _: Cycle) {
        self.heard[usize::from(channel.0)].push(byte);
    }
}

/// A machine that is put under strain, and looked at after every turn of its main loop.
struct Trial<'a> {
    sim: Simulation<'a, Cartesian, Recorder, 3, 3, MOVES>,
    wires: Wires,
    line: usize,
    levels: [bool; PINS.len()],
    /// Where the carriages stood when the machine was found locked.
    locked_at: Option<[i32; 3]>,
}

impl<'a> Trial<'a> {
    fn new(memory: &'a mut Memory<3, MOVES>, setup: &Setup<3>) -> Self {
        Self {
            sim: Simulation::new(memory, setup, Cartesian, Recorder::default()),
            wires: Wires::default(),
            line: 0,
            levels: [true; PINS.len()],
            locked_at: None,
        }
    }

    fn act(&mut self, act: Act) {
        match act {
            Act::Send(byte) => self.wires.to_send[self.line].push_back(byte),
            Act::OtherLine => self.line = (self.line + 1) % LINES,
            Act::Wait(millis) => self.wait_ms(millis),
            Act::Toggle(pin) => self.toggle(pin),
        }
    }

    fn toggle(&mut self, pin: Pin) {
        // What was sent before the edge has come in before it.
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

    /// Nothing moves in Alarm.
    fn look(&mut self) {
        let place = self.sim.board().plant.position();
        let locked = matches!(self.sim.machine().state(), State::Alarm(_));
        if let (true, Some(before)) = (locked, self.locked_at) {
            assert_eq!(place, before, "motion in Alarm at {}", self.sim.now());
        }
        self.locked_at = locked.then_some(place);
    }

    /// Sends bytes on both lines and waits; what is heard on each.
    fn ask(&mut self, bytes: &[u8], millis: u64) -> [String; LINES] {
        self.wires.heard = Default::default();
        for line in &mut self.wires.to_send {
            line.clear();
            line.extend(bytes);
        }
        self.wait_ms(millis);
        let heard = std::mem::take(&mut self.wires.heard);
        heard.map(|bytes| String::from_utf8(bytes).expect("text"))
    }

    /// A report on each line, after what still has to go out: 1 KiB takes 89 ms at 115 200 baud.
    fn assert_answers(&mut self) {
        self.wait_ms(200);
        for heard in self.ask(b"?", 300) {
            let mut lines = heard.lines();
            let report = lines.any(|line| line.starts_with('<') && line.ends_with('>'));
            assert!(
                report,
                "no report, {:?}: {heard}",
                self.sim.machine().state()
            );
        }
    }

    /// Released, reset and unlocked, it takes lines again, but where a startup line keeps it busy.
    fn assert_recovers(&mut self) {
        for (pin, level) in PINS.into_iter().zip(&mut self.levels) {
            *level = true;
            self.sim.set_pin(pin, true);
        }
        let greeting = self.ask(b"\x18", 300);
        assert!(greeting[0].contains("Grbl 1.1h"), "{greeting:?}");
        self.assert_answers();
        let machine = self.sim.machine();
        if machine.is_quiet() && machine.state().takes_lines() {
            let [first, _] = self.ask(b"\n", 50);
            assert!(first.contains("ok\r\n"), "{first}");
        }
    }
}

/// Plays a script. Nothing panics, nothing moves in Alarm, a laser under M4 is dark at rest, no pulse is lost, the
/// carriages stand where they are counted, and `?` is answered, after a reset, too.
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
    trial.assert_recovers();
    let outcome = trial.sim.outcome();
    let violations = outcome.violations;
    assert!(violations.is_empty(), "{:?}", violations.first());
}
