//! Windings switched by the board, against the states that the document of machine 001
//! (`examples/machines/001`) prints for each of its motors.

use core::num::NonZeroU16;
use heapless::spsc::Queue;
use leadscrew_stepper::{
    on_timer, Early, Interval, IntervalChange, Line, LineStart, MotorMask, OutputChange, Power,
    PowerChange, Segment, Shared, Smoothing, StepInterrupt, StepPort, Ticks, WindingPort, Windings,
    FIVE_PHASE_HALF_STEPS,
};
use std::cell::RefCell;
use std::rc::Rc;

const SEQUENCES: &str = include_str!("five_phase_sequences.csv");

/// The states of a sequence in the document, such as `cw_motor_1`: five lines each.
fn document(name: &str) -> Vec<[u8; 5]> {
    let rows = SEQUENCES.lines().filter_map(|row| row.strip_prefix(name));
    let states = rows.map(|row| {
        let cells = row.split(',').skip(2).map(|cell| cell.parse().unwrap());
        <[u8; 5]>::try_from(cells.collect::<Vec<u8>>()).unwrap()
    });
    states.collect()
}

/// A motor and its lines.
type Put = (usize, [u8; 5]);

/// All that was put out.
#[derive(Clone, Default)]
struct Lines(Rc<RefCell<Vec<Put>>>);

impl WindingPort for Lines {
    fn put(&mut self, motor: usize, lines: u8) {
        let lines = [0, 1, 2, 3, 4].map(|line| lines >> line & 1);
        self.0.borrow_mut().push((motor, lines));
    }
}

impl Lines {
    /// The states that one motor was given, and forgets all.
    fn take(&self, motor: usize) -> Vec<[u8; 5]> {
        let all = self.0.take();
        let of_motor = all.into_iter().filter(|(of, _)| *of == motor);
        of_motor.map(|(_, lines)| lines).collect()
    }
}

/// A timer that is always in time.
#[derive(Default)]
struct Timer {
    rests: bool,
}

impl StepPort for Timer {
    fn step(&mut self, _: MotorMask) {
        panic!("windings have no step pins");
    }
    fn set_power(&mut self, _: Power) {}
    fn set_direction(&mut self, _: MotorMask) {}
    fn change_outputs(&mut self, _: OutputChange) {}
    fn arm(&mut self, _: Ticks) {}
    fn make_up(&mut self) -> bool {
        false
    }
    fn rest(&mut self) {
        self.rests = true;
    }
}

type Port = Windings<Timer, Lines, 3, 10>;

fn port() -> (Port, Lines) {
    let lines = Lines::default();
    let port = Windings::new(Timer::default(), lines.clone(), &FIVE_PHASE_HALF_STEPS);
    (port, lines)
}

/// Makes a line's steps by the step interrupt.
fn make(port: &mut Port, steps: [i32; 3], events: u16) {
    let line = Line::new(steps).unwrap();
    let early = Early::half_a_tick(Smoothing::Fourfold);
    let segment = Segment {
        line: Some(LineStart::new(line, early)),
        ticks: NonZeroU16::new(4 * events).unwrap(),
        smoothing: Smoothing::Fourfold,
        motors: MotorMask::ALL,
        ends_event: true,
        early,
        interval: Interval::from_num(1000),
        interval_change: IntervalChange::ZERO,
        power: Power::OFF,
        power_change: PowerChange::ZERO,
        outputs: OutputChange::NONE,
        at_rest: Some(Power::OFF),
    };
    let mut queue: Queue<Segment<3>, 4> = Queue::new();
    let (mut producer, mut consumer) = queue.split();
    assert!(producer.enqueue(segment).is_ok());
    let (shared, mut interrupt) = (Shared::new(), StepInterrupt::new());
    port.port().rests = false;
    while !port.port().rests {
        on_timer(&mut interrupt, &mut consumer, &shared, port);
    }
    assert_eq!(shared.position(), steps);
}

#[test]
fn each_motor_goes_through_the_document_s_states_either_way() {
    for (motor, number) in [(0, 1), (1, 2), (2, 3)] {
        let (cw, ccw) = (
            document(&format!("cw_motor_{number}")),
            document(&format!("ccw_motor_{number}")),
        );
        assert_eq!((cw.len(), ccw.len()), (10, 10));
        let (mut port, lines) = port();
        port.energise(true);
        assert_eq!(lines.take(motor), [cw[0]]);
        let mut steps = [0; 3];
        steps[motor] = 25;
        make(&mut port, steps, 25);
        let forward: Vec<_> = (1..=25).map(|step| cw[step % 10]).collect();
        assert_eq!(lines.take(motor), forward);
        // Back from state 6, which is the document's fifth one the other way.
        steps[motor] = -25;
        make(&mut port, steps, 25);
        let begin = ccw.iter().position(|state| *state == cw[5]).unwrap();
        let back: Vec<_> = (1..=25).map(|step| ccw[(begin + step) % 10]).collect();
        assert_eq!(lines.take(motor), back);
    }
}

#[test]
fn a_single_line_changes_with_each_step_of_three_motors_together() {
    let (mut port, lines) = port();
    port.energise(true);
    make(&mut port, [40, -23, 7], 40);
    let all = lines.0.take();
    for (motor, steps) in [(0, 40), (1, 23), (2, 7)] {
        let states: Vec<_> = all.iter().filter(|(of, _)| *of == motor).collect();
        assert_eq!(states.len(), steps + 1, "the idle state and one a step");
        for pair in states.windows(2) {
            let changed = pair[0].1.iter().zip(pair[1].1).filter(|(a, b)| **a != *b);
            assert_eq!(changed.count(), 1);
        }
    }
}

#[test]
fn without_current_all_lines_are_off_and_the_state_is_kept() {
    let (mut port, lines) = port();
    make(&mut port, [4, 0, 0], 4);
    assert_eq!(
        lines.take(0),
        [[0; 5]; 4],
        "no current before it is asked for"
    );
    port.energise(true);
    let held = document("cw_motor_1")[4];
    assert_eq!(lines.take(0), [held]);
    port.energise(false);
    assert_eq!(lines.take(1), [[0; 5]]);
    port.energise(true);
    assert_eq!(lines.take(0), [held]);
}
