//! Acceptance tests: send bytes, watch pins.
//!
//! ```text
//!   test --text--> Session ==serial lines==> Machine --> step interrupt --> pins --> plant
//!    ^                |                                                       |
//!    +--- Run <-------+<-------- Desk: lines heard ------ Recorder <----------+
//! ```
//!
//! A [`Session`] is a machine on its desk, with a [`Desk`] at the other end of its serial lines.
//! [`Session::finish`] ends the session, asserts what must hold after any motion, and answers the
//! recorded events as a [`Run`].
#![forbid(unsafe_code)]

pub mod abuse;

use leadscrew_machine::board::{ChannelId, CoolantOutput, PortConfig};
use leadscrew_machine::config::{MachineConfig, CHANNELS};
use leadscrew_planner::{Cartesian, Kinematics};
use leadscrew_sim::{
    Answers, Cycle, Host, Memory, Observer, Outcome, Rate, Setup, Simulation, StepEvent, Stopped,
    Streamer, Streaming,
};
use leadscrew_stepper::{MotorMask, Power, PowerScale};
use std::collections::VecDeque;
use std::fs;
use std::ops::{Deref, DerefMut};
use std::path::{Path, PathBuf};

/// Moves planned ahead, as on the board.
pub const MOVES: usize = 1024;

/// The end of all waits, counted from power-up: one hour, more than any test takes.
const LIMIT: Cycle = Cycle::from_micros(3_600_000_000);

/// A machine with `N` linear axes and `lines` serial lines that never wait.
pub fn setup<const N: usize>(lines: usize) -> Setup<N> {
    let mut setup = Setup::new(MachineConfig::new(), Rate::NeverWaits);
    setup.lines = vec![Rate::NeverWaits; lines];
    setup
}

/// Runs `settings`, lines as `$$` prints them, and then `program` on a machine of three axes.
pub fn run_program(settings: &str, program: &str) -> Run<3> {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream(settings);
    session.stream(program);
    session.finish()
}

/// The G-code programs in a folder beside the tests, by name.
pub fn programs(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut programs: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "nc"))
        .collect();
    programs.sort();
    programs
}

/// The events of a session.
#[derive(Debug)]
pub struct Run<const N: usize> {
    /// The results of the simulation.
    pub outcome: Outcome<N>,
    /// All step events.
    pub steps: Vec<StepEvent>,
    /// The electrical levels of the pins whenever a pulse begins or ends.
    pub pins: Vec<Pins>,
    /// The changes of other outputs, and their times.
    pub signals: Vec<(Cycle, Signal)>,
    /// Each change of the power with its time.
    pub powers: Vec<(Cycle, Power)>,
}

/// A change of an output other than a step.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Signal {
    /// Spindle or laser power, thousandths of full power.
    Power(u32),
    /// The electrical level of the drivers' enable pin. A low level enables, unless it is inverted.
    EnableHigh(bool),
    /// The flood valve.
    Flood(bool),
}

/// The electrical levels of all step and direction pins, one bit for each motor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Pins {
    /// True if a pulse begins; otherwise one ends.
    pub pulse: bool,
    /// Step pins that are high.
    pub step: u8,
    /// Direction pins that are high. High is the negative direction, unless the pin is inverted.
    pub direction: u8,
}

impl<const N: usize> Run<N> {
    /// Steps of each motor, positive less negative.
    pub fn net_steps(&self) -> [i64; N] {
        self.outcome.motors.map(|motor| motor.net_steps)
    }
}

/// Keeps all step events and levels.
#[derive(Debug, Default)]
pub struct Recorder {
    steps: Vec<StepEvent>,
    pins: Vec<Pins>,
    signals: Vec<(Cycle, Signal)>,
    powers: Vec<(Cycle, Power)>,
    port: PortConfig,
    negative: MotorMask,
    enabled: bool,
}

impl Recorder {
    fn level(&mut self, stepping: MotorMask) {
        self.pins.push(Pins {
            pulse: !stepping.is_empty(),
            step: stepping.bits() ^ self.port.step_invert.bits(),
            direction: self.negative.bits() ^ self.port.direction_invert.bits(),
        });
    }

    fn enable(&mut self, cycle: Cycle) {
        let high = self.enabled == self.port.enable_invert;
        self.signals.push((cycle, Signal::EnableHigh(high)));
    }
}

impl Observer for Recorder {
    fn step(&mut self, event: &StepEvent) {
        self.steps.push(*event);
        self.level(event.motors);
    }

    fn pulse_end(&mut self, _: Cycle) {
        self.level(MotorMask::NONE);
    }

    fn direction(&mut self, _: Cycle, negative: MotorMask) {
        self.negative = negative;
    }

    fn configured(&mut self, cycle: Cycle, port: &PortConfig) {
        self.port = *port;
        self.enable(cycle);
    }

    fn power(&mut self, cycle: Cycle, power: Power) {
        self.signals
            .push((cycle, Signal::Power(power.level(PowerScale::new(1000)))));
        self.powers.push((cycle, power));
    }

    fn motors_enabled(&mut self, cycle: Cycle, on: bool) {
        self.enabled = on;
        self.enable(cycle);
    }

    fn coolant(&mut self, cycle: Cycle, output: CoolantOutput) {
        self.signals.push((cycle, Signal::Flood(output.flood)));
    }
}

/// One serial line at the desk.
#[derive(Debug, Default)]
struct Wire {
    to_send: VecDeque<u8>,
    /// The sender goes away once all bytes are sent.
    leaves: bool,
    incoming: Vec<u8>,
    heard: Vec<String>,
}

/// The other end of all serial lines: it sends the bytes that it is given and keeps the lines that
/// it hears.
#[derive(Debug, Default)]
pub struct Desk([Wire; CHANNELS]);

impl Host for Desk {
    fn next_byte(&mut self, channel: ChannelId) -> Option<u8> {
        self.0[usize::from(channel.0)].to_send.pop_front()
    }

    fn closes(&mut self, channel: ChannelId) -> bool {
        let wire = &mut self.0[usize::from(channel.0)];
        wire.to_send.is_empty() && std::mem::take(&mut wire.leaves)
    }

    fn receive(&mut self, channel: ChannelId, byte: u8, _: Cycle) {
        let wire = &mut self.0[usize::from(channel.0)];
        match byte {
            b'\r' => {}
            b'\n' => {
                let line = String::from_utf8(std::mem::take(&mut wire.incoming)).unwrap();
                wire.heard
                    .extend(Some(line).filter(|line| !line.is_empty()));
            }
            other => wire.incoming.push(other),
        }
    }
}

/// A machine at work, and the desk that it is connected to.
pub struct Session<'a, K: Kinematics<N, N> + Clone, const N: usize> {
    /// The machine, its board and its plant.
    pub sim: Traced<'a, K, N>,
    desk: Desk,
    window: usize,
}

/// A simulation that prints the machine's last states when its test fails.
pub struct Traced<'a, K: Kinematics<N, N> + Clone, const N: usize>(Option<Sim<'a, K, N>>);

type Sim<'a, K, const N: usize> = Simulation<'a, K, Recorder, N, N, MOVES>;

impl<'a, K: Kinematics<N, N> + Clone, const N: usize> Traced<'a, K, N> {
    fn new(sim: Sim<'a, K, N>) -> Self {
        Self(Some(sim))
    }

    fn take(mut self) -> Sim<'a, K, N> {
        self.0.take().expect("it is taken once, at the end")
    }
}

impl<'a, K: Kinematics<N, N> + Clone, const N: usize> Deref for Traced<'a, K, N> {
    type Target = Sim<'a, K, N>;
    fn deref(&self) -> &Self::Target {
        self.0.as_ref().expect("it is taken at the end only")
    }
}

impl<K: Kinematics<N, N> + Clone, const N: usize> DerefMut for Traced<'_, K, N> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        self.0.as_mut().expect("it is taken at the end only")
    }
}

impl<K: Kinematics<N, N> + Clone, const N: usize> Drop for Traced<'_, K, N> {
    fn drop(&mut self) {
        if let (true, Some(sim)) = (std::thread::panicking(), &self.0) {
            let machine = sim.machine();
            for state in machine.history().chain([machine.state()]) {
                eprintln!("state: {state:?}");
            }
        }
    }
}

impl<'a, K: Kinematics<N, N> + Clone, const N: usize> Session<'a, K, N> {
    /// Switches a machine on and hears its greeting.
    pub fn new(memory: &'a mut Memory<N, N>, setup: &Setup<N>, kinematics: K) -> Self {
        let mut session = Self {
            sim: Traced::new(Simulation::new(
                memory,
                setup,
                kinematics,
                Recorder::default(),
            )),
            desk: Desk::default(),
            window: setup.receive_buffer,
        };
        session.until_quiet();
        let greeting = session.heard(0);
        assert_eq!(greeting, ["Grbl 1.1h ['$' for help]"]);
        session
    }

    /// Sends bytes on a line; they arrive when time passes.
    pub fn send(&mut self, line: usize, bytes: impl AsRef<[u8]>) {
        self.desk.0[line].to_send.extend(bytes.as_ref());
    }

    /// Goes away from a line once its bytes are sent: the socket closes, the cable is pulled.
    pub fn leave(&mut self, line: usize) {
        self.desk.0[line].leaves = true;
    }

    /// Returns true if bytes still wait to be sent on a line.
    pub fn is_sending(&self, line: usize) -> bool {
        !self.desk.0[line].to_send.is_empty()
    }

    /// The lines heard on a serial line since the last call; empty ones are left out.
    pub fn heard(&mut self, line: usize) -> Vec<String> {
        std::mem::take(&mut self.desk.0[line].heard)
    }

    /// Sends `text` on line 0 and waits until nothing moves. Returns the lines heard on it.
    pub fn say(&mut self, text: &str) -> Vec<String> {
        self.send(0, text);
        self.until_quiet();
        self.heard(0)
    }

    /// Lets time pass until nothing is left to happen.
    pub fn until_quiet(&mut self) {
        let stopped = self.sim.run_until(&mut self.desk, LIMIT);
        assert_eq!(stopped, Stopped::Quiet);
    }

    /// Lets `micros` microseconds pass.
    pub fn wait_us(&mut self, micros: u64) {
        let end = self.sim.now() + Cycle::from_micros(micros).0;
        self.sim.wait_until(&mut self.desk, end);
    }

    /// Streams lines on line 0 by character counting until all are answered with `ok` and motion
    /// rests.
    pub fn stream(&mut self, text: &str) {
        let streaming = Streaming {
            window: self.window,
            keep_going: false,
        };
        let mut host = Streamer::new(text.as_bytes(), streaming, Answers::default());
        assert_eq!(self.sim.run_until(&mut host, LIMIT), Stopped::Quiet);
        assert!(host.is_done(), "the machine stands still");
        let answers = host.finish().unwrap();
        assert!(answers.errors.is_empty(), "{answers:?}");
        assert_eq!(answers.alarm, None);
    }

    /// Ends the session without any check. Returns all step events.
    pub fn into_steps(self) -> Vec<StepEvent> {
        self.sim.take().finish().1.steps
    }

    /// Ends the session. Asserts that nothing was late, that no rule was violated, and that the
    /// carriages stand where they are counted.
    pub fn finish(self) -> Run<N> {
        let late = self.sim.outcome().late;
        assert!(late.is_empty(), "{late:?}");
        self.finish_late()
    }

    /// As [`Session::finish`], but permits that something was late: bytes lost, segments run out.
    pub fn finish_late(self) -> Run<N> {
        let counted = self.sim.counted_position().map(i64::from);
        let (outcome, recorder) = self.sim.take().finish();
        assert!(outcome.violations.is_empty(), "{:?}", outcome.violations);
        let run = Run {
            outcome,
            steps: recorder.steps,
            pins: recorder.pins,
            signals: recorder.signals,
            powers: recorder.powers,
        };
        assert_eq!(run.net_steps(), counted, "plant and count");
        run
    }
}
