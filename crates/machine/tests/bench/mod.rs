//! A desk with a machine on it: bytes in, lines out, the step interrupt called when its timer is
//! due.
//!
//! Time is counted in timer counts (84 MHz). The main loop polls every 100 µs and whenever it asks
//! to.

#![allow(unreachable_pub, dead_code, reason = "shared by several test files")]

use leadscrew_machine::board::{
    Board, ChannelId, CoolantOutput, Instant, PortConfig, SpindleOutput, Switches,
};
use leadscrew_machine::config::{MachineConfig, MoveQueues, RowPixels, SegmentQueue, CHANNELS};
use leadscrew_machine::extension::Extension;
use leadscrew_machine::inputs::Inputs;
use leadscrew_machine::machine::{Links, Machine};
use leadscrew_machine::protocol::serial::{Receiver, SerialQueue};
use leadscrew_machine::settings::flash::{Area, SettingsStore};
use leadscrew_machine::valid::ConfigError;
use leadscrew_planner::{Cartesian, Kinematics};
use leadscrew_stepper::{
    on_timer, MotorMask, OutputChange, Power, Segment, Shared, StepInterrupt, StepPort, Ticks,
};
use std::cell::Cell;
use std::rc::Rc;

#[path = "../../../settings/tests/mock/flash.rs"]
pub(crate) mod flash;

const COUNTS_PER_US: u64 = 84;
const POLL_EVERY: u64 = 100 * COUNTS_PER_US;

/// Pins and wires, seen from outside.
#[derive(Debug)]
pub struct Pins<'a> {
    pub sent: Vec<u8>,
    /// The sender reads; otherwise the board takes no byte.
    pub reading: bool,
    pub pulses: [u32; 3],
    pub position: [i32; 3],
    direction: MotorMask,
    pub power: Power,
    pub spindle: SpindleOutput,
    pub coolant: CoolantOutput,
    pub enabled: bool,
    pub port: PortConfig,
    pub switches: Cell<Switches>,
    /// After the main loop has read the switches this many times more, they take these levels,
    /// behind its back.
    pub edge: Cell<Option<(u32, Switches)>>,
    inputs: &'a Inputs<3>,
    shared: &'a Shared<3>,
    outputs: Rc<Cell<u8>>,
    /// Each change of the outputs in motion: the position, and the levels.
    pub output_changes: Vec<([i32; 3], u8)>,
    /// The reason why the program ended the last time.
    pub last_end: Option<&'static str>,
    now: u64,
    due: Option<u64>,
    /// The step interrupt is not connected: its timer is started, and nothing happens.
    pub deaf: bool,
}

impl Pins<'_> {
    /// Sets the switches; the switch interrupt follows.
    fn set_switches(&self, switches: Switches) {
        self.switches.set(switches);
        self.inputs.on_switches(&switches, self.shared);
    }
}

impl Board for Pins<'_> {
    fn start_stepping(&mut self, now: Instant) -> Instant {
        assert!(self.enabled, "a motor steps while it is disabled");
        assert_eq!(self.due, None, "the timer is started while it runs");
        self.due = Some(self.now);
        now
    }
    fn write(&mut self, _: ChannelId, bytes: &[u8]) -> usize {
        if !self.reading {
            return 0;
        }
        self.sent.extend_from_slice(bytes);
        bytes.len()
    }
    fn switches(&self) -> Switches {
        let seen = self.switches.get();
        match self.edge.get() {
            Some((0, then)) => {
                self.edge.set(None);
                self.set_switches(then);
            }
            Some((reads, then)) => self.edge.set(Some((reads - 1, then))),
            None => {}
        }
        seen
    }
    fn enable_motors(&mut self, on: bool) {
        self.enabled = on;
    }
    fn set_spindle(&mut self, output: SpindleOutput) {
        self.spindle = output;
    }
    fn set_power(&mut self, power: Power) {
        let may = self.due.is_none() || power == Power::OFF;
        assert!(may, "the main loop sets power in motion");
        self.power = power;
    }
    fn set_coolant(&mut self, output: CoolantOutput) {
        self.coolant = output;
    }
    fn last_end(&self) -> Option<&dyn std::fmt::Display> {
        self.last_end
            .as_ref()
            .map(|end| end as &dyn std::fmt::Display)
    }
    fn configure(&mut self, port: &PortConfig) {
        self.port = *port;
    }
}

impl StepPort for Pins<'_> {
    fn step(&mut self, motors: MotorMask) {
        for motor in (0..3).filter(|motor| motors.contains(*motor)) {
            self.pulses[motor] += 1;
            let negative = self.direction.contains(motor);
            self.position[motor] += if negative { -1 } else { 1 };
        }
    }
    fn set_direction(&mut self, negative: MotorMask) {
        self.direction = negative;
    }
    fn set_power(&mut self, power: Power) {
        self.power = power;
    }
    fn change_outputs(&mut self, change: OutputChange) {
        let levels = change.applied_to(self.outputs.get());
        if levels != self.outputs.get() {
            self.output_changes.push((self.position, levels));
        }
        self.outputs.set(levels);
    }
    fn arm(&mut self, wait: Ticks) {
        let due = self.due.expect("the timer runs") + u64::from(wait.0);
        self.due = Some(due);
    }
    fn make_up(&mut self) -> bool {
        self.due.is_some_and(|due| due < self.now)
    }
    fn rest(&mut self) {
        self.due = None;
    }
}

/// All memory that machine and interrupts share. The sizes are those of [`SerialQueue`] and
/// [`SegmentQueue`].
pub struct Memory<
    const RX: usize = 1025,
    const TX: usize = 1024,
    const REALTIME: usize = 64,
    const SLOTS: usize = 17,
    const LEAD: usize = 16,
> {
    moves: Box<MoveQueues<3, 3, 64>>,
    pixels: Box<RowPixels>,
    segments: SegmentQueue<3, SLOTS, LEAD>,
    shared: Shared<3>,
    inputs: Inputs<3>,
    serial: SerialQueue<RX, TX, REALTIME>,
    /// Levels of the synchronised outputs, for an extension to change, too.
    pub outputs: Rc<Cell<u8>>,
}

impl Memory {
    pub fn new() -> Self {
        Self::default()
    }
}

impl<
        const RX: usize,
        const TX: usize,
        const REALTIME: usize,
        const SLOTS: usize,
        const LEAD: usize,
    > Default for Memory<RX, TX, REALTIME, SLOTS, LEAD>
{
    fn default() -> Self {
        Self {
            moves: Box::default(),
            pixels: Box::default(),
            segments: SegmentQueue::new(),
            shared: Shared::new(),
            inputs: Inputs::new(),
            serial: SerialQueue::new(),
            outputs: Rc::default(),
        }
    }
}

/// A machine, its interrupts, and the sender's view.
pub struct Session<'a, K: Kinematics<3, 3> + Clone = Cartesian, X: Extension<3> = ()> {
    pub machine: Machine<'a, K, 3, 3, X>,
    pub pins: Pins<'a>,
    pub shared: &'a Shared<3>,
    receiver: Receiver<'a>,
    interrupt: StepInterrupt<3>,
    segments: heapless::spsc::Consumer<'a, Segment<3>>,
    /// A switch on the probe input or a limit: closes if the carriage is at or beyond this
    /// (motor, steps).
    pub contact: Option<Contact>,
    next_poll: u64,
}

/// A test that fails prints the machine's last states.
impl<K: Kinematics<3, 3> + Clone, X: Extension<3>> Drop for Session<'_, K, X> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let states = self.machine.history().chain([self.machine.state()]);
            states.for_each(|state| eprintln!("state: {state:?}"));
        }
    }
}

/// A switch that follows the carriage.
#[derive(Clone, Copy, Debug)]
pub enum Contact {
    /// The probe touches if motor 2 is at or below this.
    Probe(i32),
    /// The limit switch of each motor is closed if it is at or above this.
    Limits([i32; 3]),
    /// The limit switches of crossed belts: of each axis, if the carriage is at or above this,
    /// steps.
    Belts([i32; 3]),
}

impl<'a> Session<'a> {
    /// A machine after power-up, with its banner taken away.
    pub fn boot(memory: &'a mut Memory, config: MachineConfig<3>) -> Self {
        Self::boot_with(memory, config, Cartesian)
    }
}

impl<'a, K: Kinematics<3, 3> + Clone> Session<'a, K> {
    /// As [`Session::boot`], with these kinematics.
    pub fn boot_with(memory: &'a mut Memory, config: MachineConfig<3>, kinematics: K) -> Self {
        Self::extended(memory, config, kinematics, ())
    }
}

impl<'a, K: Kinematics<3, 3> + Clone, X: Extension<3>> Session<'a, K, X> {
    /// As [`Session::boot_with`], with this extension.
    pub fn extended<
        const RX: usize,
        const TX: usize,
        const REALTIME: usize,
        const SLOTS: usize,
        const LEAD: usize,
    >(
        memory: &'a mut Memory<RX, TX, REALTIME, SLOTS, LEAD>,
        config: MachineConfig<3>,
        kinematics: K,
        extension: X,
    ) -> Self {
        Self::try_extended(memory, config, kinematics, extension).unwrap()
    }

    /// As [`Session::extended`]; an error if the machine refuses to be built.
    pub fn try_extended<
        const RX: usize,
        const TX: usize,
        const REALTIME: usize,
        const SLOTS: usize,
        const LEAD: usize,
    >(
        memory: &'a mut Memory<RX, TX, REALTIME, SLOTS, LEAD>,
        config: MachineConfig<3>,
        kinematics: K,
        extension: X,
    ) -> Result<Self, ConfigError> {
        let (sender, consumer) = memory.segments.split();
        let (receiver, inbox) = memory.serial.split();
        let mut inboxes = heapless::Vec::<_, CHANNELS>::new();
        assert!(inboxes.push(inbox).is_ok());
        let links = Links {
            moves: &mut memory.moves,
            pixels: &mut memory.pixels,
            segments: sender,
            shared: &memory.shared,
            inputs: &memory.inputs,
            inboxes,
        };
        let pins = Pins {
            sent: Vec::new(),
            reading: true,
            pulses: [0; 3],
            position: [0; 3],
            direction: MotorMask::NONE,
            power: Power::OFF,
            spindle: SpindleOutput::Off,
            coolant: CoolantOutput::default(),
            enabled: false,
            port: PortConfig::default(),
            switches: Cell::new(Switches::OPEN),
            edge: Cell::new(None),
            inputs: &memory.inputs,
            shared: &memory.shared,
            outputs: memory.outputs.clone(),
            output_changes: Vec::new(),
            last_end: None,
            now: 0,
            due: None,
            deaf: false,
        };
        let mut session = Self {
            machine: Machine::with_extension(config, kinematics, links, extension)?,
            pins,
            shared: &memory.shared,
            receiver,
            interrupt: StepInterrupt::new(),
            segments: consumer,
            contact: None,
            next_poll: 0,
        };
        session.wait_ms(1);
        assert_eq!(session.lines(), ["", "Grbl 1.1h ['$' for help]"]);
        Ok(session)
    }

    /// The serial interrupt receives bytes.
    pub fn send(&mut self, bytes: impl AsRef<[u8]>) {
        for byte in bytes.as_ref() {
            self.receiver.receive(*byte);
        }
    }

    /// Sends a line, waits until all is quiet, and returns the received text.
    pub fn line(&mut self, line: &str) -> Vec<String> {
        self.send(line);
        self.send("\n");
        self.until_quiet();
        self.lines()
    }

    /// Sends `?` and returns the report.
    pub fn status(&mut self) -> String {
        self.send("?");
        self.wait_ms(1);
        let lines = self.lines();
        lines
            .into_iter()
            .find(|line| line.starts_with('<'))
            .unwrap_or_default()
    }

    /// Sends `?` and returns the report, as soon as it comes.
    pub fn next_report(&mut self) -> String {
        self.send("?");
        loop {
            self.turn();
            let mut lines = self.lines().into_iter();
            if let Some(report) = lines.find(|line| line.starts_with('<')) {
                return report;
            }
        }
    }

    /// The lines received since this was asked last.
    pub fn lines(&mut self) -> Vec<String> {
        let sent = String::from_utf8(std::mem::take(&mut self.pins.sent)).unwrap();
        assert!(sent.is_empty() || sent.ends_with("\r\n"), "{sent:?}");
        sent.split_terminator("\r\n").map(str::to_owned).collect()
    }

    pub fn now_us(&self) -> u64 {
        self.pins.now / COUNTS_PER_US
    }

    pub fn wait_ms(&mut self, ms: u64) {
        let end = self.pins.now + ms * 1000 * COUNTS_PER_US;
        while self.pins.now < end {
            self.turn();
        }
    }

    /// Runs until nothing moves and nothing waits; at most ten minutes.
    pub fn until_quiet(&mut self) {
        let end = self.pins.now + 600_000_000 * COUNTS_PER_US;
        self.turn();
        while !(self.machine.is_quiet() && self.pins.due.is_none()) {
            self.turn();
            assert!(
                self.pins.now < end,
                "never quiet: {:?}",
                self.machine.state()
            );
        }
    }

    /// Runs until `done` says so; at most ten minutes.
    pub fn until(&mut self, mut done: impl FnMut(&Self) -> bool) {
        let end = self.pins.now + 600_000_000 * COUNTS_PER_US;
        while !done(self) {
            self.turn();
            assert!(self.pins.now < end, "never: {:?}", self.machine.state());
        }
    }

    /// Runs one interrupt or one poll, whichever is due first.
    pub fn turn(&mut self) {
        match self.pins.due {
            Some(due) if due <= self.next_poll && !self.pins.deaf => {
                self.pins.now = self.pins.now.max(due);
                on_timer(
                    &mut self.interrupt,
                    &mut self.segments,
                    self.shared,
                    &mut self.pins,
                );
                self.follow_contact();
                assert_eq!(self.shared.position(), self.counted());
            }
            _ => {
                self.pins.now = self.pins.now.max(self.next_poll);
                let now = Instant::from_ticks(self.pins.now / COUNTS_PER_US);
                let next = self.machine.poll(&mut self.pins, now);
                let pause = if next.busy { COUNTS_PER_US } else { POLL_EVERY };
                self.next_poll = self.pins.now + pause;
            }
        }
        assert_eq!(
            self.shared.underruns(),
            0,
            "the segments ran out at {} us",
            self.now_us()
        );
    }

    /// All clocks go on and nothing is called, as when a debugger halts main loop and interrupts.
    pub fn stand_still_ms(&mut self, ms: u64) {
        let pause = ms * 1000 * COUNTS_PER_US;
        self.pins.now += pause;
        self.next_poll += pause;
        self.pins.due = self.pins.due.map(|due| due + pause);
    }

    /// Polls only when the machine has asked for it, with nothing but time to wake it.
    pub fn sleep_ms(&mut self, ms: u64) {
        let now = |session: &Self| Instant::from_ticks(session.pins.now / COUNTS_PER_US);
        let end = now(self).ticks() + ms * 1000;
        loop {
            let at = now(self);
            let next = self.machine.poll(&mut self.pins, at);
            let when = match (next.busy, next.when) {
                (true, _) => at.ticks() + 1,
                (false, Some(when)) => when.ticks(),
                (false, None) => break,
            };
            if when > end {
                break;
            }
            self.pins.now = when * COUNTS_PER_US;
        }
    }

    /// Sets switches; the switch interrupt follows.
    pub fn switch(&mut self, change: impl FnOnce(&mut Switches)) {
        let mut switches = self.pins.switches.get();
        change(&mut switches);
        self.pins.set_switches(switches);
    }

    fn follow_contact(&mut self) {
        let before = self.pins.switches.get();
        let mut after = before;
        let [a, b, z] = self.pins.position;
        let closed = |at: [i32; 3], above: [i32; 3]| {
            let open = (0..3).filter(|axis| at[*axis] < above[*axis]);
            MotorMask::from_bits(open.fold(0, |bits, axis| bits | 1 << axis))
        };
        match self.contact {
            None => return,
            Some(Contact::Probe(below)) => after.probe = z > below,
            Some(Contact::Limits(above)) => after.limits = closed([a, b, z], above),
            Some(Contact::Belts(above)) => {
                after.limits = closed([(a + b) / 2, (a - b) / 2, z], above);
            }
        }
        if after != before {
            self.pins.set_switches(after);
        }
    }

    /// The position of the plant. With limit switches it is the machine's count, which is the same
    /// until somebody declares another one (homing does).
    fn counted(&self) -> [i32; 3] {
        match self.contact {
            Some(Contact::Limits(_) | Contact::Belts(_)) => self.shared.position(),
            Some(Contact::Probe(_)) | None => self.pins.position,
        }
    }
}
