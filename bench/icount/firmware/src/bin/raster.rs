//! A raster at 10 000 lines a second through the whole machine: `G1X123.45S752`, pixels of 0.05 mm at 450 mm/s, the most that a row
//! of them is given.
//!
//! Region 0: what the main loop does for one line, from its bytes in the receive queue to `ok`, and for the segments that are
//! made in its 100 µs. The step interrupt runs between the samples and is not counted.
#![no_std]
#![no_main]

use core::fmt::Write;
use core::hint::black_box;
use heapless::{spsc::Consumer, String, Vec};
use icount_firmware::{count, done};
use leadscrew_machine::{
    board::{Board, ChannelId, CoolantOutput, Instant, PortConfig, SpindleOutput, Switches},
    config::{MachineConfig, MoveQueues, SegmentQueue, CHANNELS},
    inputs::Inputs,
    machine::{Links, Machine},
    protocol::serial::{Receiver, SerialQueue},
};
use leadscrew_planner::Cartesian;
use leadscrew_stepper::{
    on_timer, MotorMask, Outputs, Power, Segment, Shared, StepInterrupt, StepPort, Ticks,
};

/// Timer counts in the 100 µs of a line.
const A_LINE: u64 = 8400;
/// Lines planned before motion begins.
const AHEAD: u32 = 1500;
/// Lines until the row has its speed: 25 mm at 5000 mm/s².
const SPEEDING_UP: u32 = 1000;
const COUNTED: u32 = 2000;

const SETTINGS: &str = "$0=3\n$110=30000\n$120=5000\n$32=1\n$30=1000\nM4S0F30000\n";

/// Counts answers; keeps the timer's next interrupt.
struct Bench {
    answers: u32,
    now: u64,
    due: Option<u64>,
}

impl Board for Bench {
    fn start_stepping(&mut self) {
        self.due = Some(self.now);
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
    fn set_outputs(&mut self, _: Outputs) {}
    fn arm(&mut self, wait: Ticks) -> bool {
        self.due = self.due.map(|due| due + u64::from(wait.0));
        false
    }
    fn rest(&mut self) {
        self.due = None;
    }
}

/// A machine and its interrupts.
struct Session<'a> {
    machine: Machine<'a, Cartesian, 3, 3, 1024>,
    bench: Bench,
    shared: &'a Shared<3>,
    receiver: Receiver<'a>,
    interrupt: StepInterrupt<3>,
    segments: Consumer<'a, Segment<3>>,
}

impl Session<'_> {
    fn receive(&mut self, text: &str) {
        for byte in text.bytes() {
            self.receiver.receive(byte);
        }
    }

    /// Polls until nothing is left to do at once.
    #[inline(never)]
    fn main_loop(&mut self) {
        let now = Instant::from_ticks(self.bench.now / 84);
        while self.machine.poll(&mut self.bench, now).busy {}
    }

    /// Lets the interrupts of the next 100 µs come.
    fn pass_time(&mut self) {
        self.bench.now += A_LINE;
        while self.bench.due.is_some_and(|due| due <= self.bench.now) {
            on_timer(
                &mut self.interrupt,
                &mut self.segments,
                self.shared,
                &mut self.bench,
            );
        }
    }

    /// Brings pixel `k` of the row.
    fn pixel(&mut self, k: u32) {
        let mut line = String::<20>::new();
        let at = k * 5;
        let power = 100 + k * 37 % 900;
        assert!(write!(line, "G1X{:03}.{:02}S{:03}\n", at / 100, at % 100, power).is_ok());
        assert!(line.len() == 14);
        self.receive(black_box(&line));
    }

    fn answered(&self, lines: u32) {
        assert!(self.bench.answers == lines);
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let (mut segments, shared, inputs) = (SegmentQueue::new(), Shared::new(), Inputs::new());
    let mut serial = SerialQueue::<1025>::new();
    let mut moves = MoveQueues::new();
    let (producer, consumer) = segments.split();
    let (receiver, inbox) = serial.split();
    let mut inboxes = Vec::<_, CHANNELS>::new();
    assert!(inboxes.push(inbox).is_ok());
    let links = Links {
        moves: &mut moves,
        segments: producer,
        shared: &shared,
        inputs: &inputs,
        inboxes,
    };
    let mut session = Session {
        machine: Machine::new(MachineConfig::new(), Cartesian, links),
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
    session.receive(SETTINGS);
    session.main_loop();
    session.pass_time();
    session.bench.answers = 0;
    run(&mut session);
    done()
}

fn run(session: &mut Session<'_>) {
    // All at one instant: motion waits for a pause of the sender.
    for k in 1..=AHEAD {
        session.pixel(k);
        session.main_loop();
    }
    session.answered(AHEAD);
    for _ in 0..200 {
        session.pass_time();
        session.main_loop();
    }
    for k in AHEAD + 1..=AHEAD + SPEEDING_UP {
        session.pass_time();
        session.pixel(k);
        session.main_loop();
    }
    for k in AHEAD + SPEEDING_UP + 1..=AHEAD + SPEEDING_UP + COUNTED {
        session.pass_time();
        session.pixel(k);
        count::<0, _>(|| session.main_loop());
    }
    session.answered(AHEAD + SPEEDING_UP + COUNTED);
    assert!(session.shared.underruns() == 0);
    assert!((session.machine.speed() - 450.0).abs() < 1.0);
}
