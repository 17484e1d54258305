//! Draws the step pulses of one line as text: the crate by itself, on a port that prints.
//!
//! `cargo run -p leadscrew-stepper --example trace_a_line`

use core::num::NonZeroU16;
use heapless::spsc::Queue;
use leadscrew_stepper::{
    on_timer, Early, Interval, IntervalChange, Line, LineStart, MotorMask, OutputChange, Power,
    PowerChange, Segment, Shared, Smoothing, StepInterrupt, StepPort, Ticks,
};

/// A port that draws one character a millisecond for each motor.
#[derive(Default)]
struct Drawing {
    rows: [String; 3],
    running: bool,
}

/// Timer counts to a millisecond, on a timer that counts at 1 MHz.
const COUNTS_PER_MS: u32 = 1000;

impl StepPort for Drawing {
    fn step(&mut self, motors: MotorMask) {
        for (motor, row) in self.rows.iter_mut().enumerate() {
            if motors.contains(motor) {
                row.pop();
                row.push('|');
            }
        }
    }
    fn set_direction(&mut self, _negative: MotorMask) {}
    fn set_power(&mut self, _power: Power) {}
    fn change_outputs(&mut self, _outputs: OutputChange) {}
    fn arm(&mut self, wait: Ticks) {
        let columns = wait.0.div_ceil(COUNTS_PER_MS);
        for row in &mut self.rows {
            row.extend((0..columns).map(|_| '_'));
        }
    }
    fn make_up(&mut self) -> bool {
        false
    }
    fn rest(&mut self) {
        self.running = false;
    }
}

fn main() {
    // 12 steps of X, 5 of Y, 1 of Z, four ticks to a step; each interval 0.2 ms shorter than the
    // last.
    let line = Line::new([12, 5, 1]).expect("12 steps are a line");
    let early = Early::half_a_tick(Smoothing::Fourfold);
    let segment = Segment {
        line: Some(LineStart::new(line, early)),
        ticks: NonZeroU16::new(48).expect("48 is not 0"),
        smoothing: Smoothing::Fourfold,
        motors: MotorMask::ALL,
        ends_event: true,
        early,
        interval: Interval::from_num(6 * COUNTS_PER_MS),
        interval_change: IntervalChange::from_num(-120),
        power: Power::OFF,
        power_change: PowerChange::ZERO,
        outputs: OutputChange::NONE,
        at_rest: Some(Power::OFF),
    };

    let shared = Shared::new();
    let mut queue: Queue<Segment<3>, 4> = Queue::new();
    let (mut producer, mut consumer) = queue.split();
    producer.enqueue(segment).expect("an empty queue has room");

    let mut interrupt = StepInterrupt::new();
    let mut port = Drawing {
        running: true,
        ..Drawing::default()
    };
    while port.running {
        on_timer(&mut interrupt, &mut consumer, &shared, &mut port);
    }
    for (name, row) in ["X", "Y", "Z"].iter().zip(&port.rows) {
        println!("{name} {row}");
    }
    println!("position {:?}", shared.position());
}
