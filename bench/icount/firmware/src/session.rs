//! A whole machine with its interrupts, on a board that exists only in memory.

use core::hint::black_box;
use heapless::{spsc::Consumer, Vec};
use leadscrew_machine::{
    board::{Board, ChannelId, CoolantOutput, Instant, PortConfig, SpindleOutput, Switches},
    config::{MachineConfig, MoveQueues, RowPixels, SegmentQueue, CHANNELS},
    inputs::Inputs,
    machine::{Links, Machine},
    protocol::serial::{Receiver, SerialQueue},
};
use leadscrew_planner::Cartesian;
use leadscrew_stepper::{
    on_timer, MotorMask, OutputChange, Power, Segment, Shared, StepInterrupt, StepPort, Ticks,
};

/// The board: counts answers, and keeps the instant of the timer's next interrupt.
pub struct Bench {
    /// Lines answered with `ok`.
    pub answers: u32,
    now: u64,
    due: Option<u64>,
}

impl Board for Bench {
    fn start_stepping(&mut self, now: Instant) -> Instant {
        self.due = Some(self.now);
        now
    }
    fn write(&mut self, _: ChannelId, bytes: &[u8]) -> usize {
        self.answers += u32::from(bytes.starts_with(b"ok"));
        bytes.len()
    }
    fn switches(&self) -> Switches {
        Switches::OPEN
    }
    fn enable_motors(&mut self, _: bool) {}
    fn set_spindle(&mut self, _: SpindleOutput) {}
    fn set_power(&mut self, _: Power) {}
    fn set_coolant(&mut self, _: CoolantOutput) {}
    fn configure(&mut self, _: &PortConfig) {}
}

impl StepPort for Bench {
    fn step(&mut self, _: MotorMask) {}
    fn set_direction(&mut self, _: MotorMask) {}
    fn set_power(&mut self, _: Power) {}
    fn change_outputs(&mut self, _: OutputChange) {}
    fn arm(&mut self, wait: Ticks) {
        self.due = self.due.map(|due| due + u64::from(wait.0));
    }
    fn make_up(&mut self) -> bool {
        false
    }
    fn rest(&mut self) {
        self.due = None;
    }
}

/// A machine and its interrupts.
pub struct Session<'a> {
    /// The machine.
    pub machine: Machine<'a, Cartesian, 3, 3>,
    /// Its board.
    pub bench: Bench,
    /// Words shared with the step interrupt.
    pub shared: &'a Shared<3>,
    receiver: Receiver<'a>,
    interrupt: StepInterrupt<3>,
    segments: Consumer<'a, Segment<3>>,
}

impl Session<'_> {
    /// Makes a machine that has taken `settings` and is at rest, and calls `then` with it.
    pub fn with(settings: &str, then: impl FnOnce(&mut Session<'_>)) {
        let (mut segments, shared, inputs) =
            (SegmentQueue::<3>::new(), Shared::new(), Inputs::new());
        let mut serial = SerialQueue::<1025>::new();
        let (mut moves, mut pixels) = (MoveQueues::<3, 3, 1024>::new(), RowPixels::new());
        let (producer, consumer) = segments.split();
        let (receiver, inbox) = serial.split();
        let mut inboxes = Vec::<_, CHANNELS>::new();
        assert!(inboxes.push(inbox).is_ok());
        let links = Links {
            moves: &mut moves,
            pixels: &mut pixels,
            segments: producer,
            shared: &shared,
            inputs: &inputs,
            inboxes,
        };
        let mut session = Session {
            machine: Machine::new(MachineConfig::new(), Cartesian, links).unwrap(),
            bench: Bench {
                answers: 0,
                now: 0,
                due: None,
            },
            shared: &shared,
            receiver,
            interrupt: StepInterrupt::new(),
            segments: consumer,
        };
        session.main_loop();
        session.receive(settings);
        session.main_loop();
        session.pass_time(8400);
        session.bench.answers = 0;
        then(&mut session);
    }

    /// Puts bytes into the receive queue.
    pub fn receive(&mut self, text: impl AsRef<[u8]>) {
        for byte in black_box(text.as_ref()) {
            self.receiver.receive(*byte);
        }
    }

    /// Calls `poll` once. Answers whether there is more to do at once.
    #[inline(never)]
    pub fn poll(&mut self) -> bool {
        let now = Instant::from_ticks(self.bench.now / 84);
        self.machine.poll(&mut self.bench, now).busy
    }

    /// Polls until nothing is left to do at once.
    #[inline(never)]
    pub fn main_loop(&mut self) {
        while self.poll() {}
    }

    /// Lets `counts` timer counts pass, with the interrupts that are due in them.
    pub fn pass_time(&mut self, counts: u64) {
        self.bench.now += counts;
        while self.bench.due.is_some_and(|due| due <= self.bench.now) {
            on_timer(
                &mut self.interrupt,
                &mut self.segments,
                self.shared,
                &mut self.bench,
            );
        }
    }
}
