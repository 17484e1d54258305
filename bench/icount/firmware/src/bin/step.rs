//! The whole body of the step interrupt, with three motors that step at every tick, and changing
//! power.
//!
//! Region 0: a tick within a segment. Region 1: a tick that loads a segment of the same line.
//! Region 2: a tick that loads the first segment of a line.
#![no_std]
#![no_main]

use core::{
    hint::black_box,
    num::NonZeroU16,
    ptr::{read_volatile, write_volatile},
};
use fixed::types::U1F31;
use heapless::spsc::{Consumer, Queue};
use icount_firmware::{count, done};
use leadscrew_stepper::{
    on_timer, Early, Interval, IntervalChange, Line, LineStart, MotorMask, OutputChange, Power,
    PowerChange, PowerScale, Segment, Shared, Smoothing, StepInterrupt, StepPort, Ticks,
};

const MOTORS: usize = 3;
/// The ticks in a segment: 1 ms at 20 kHz.
const TICKS: u32 = 20;
/// Segments in a line.
const SEGMENTS: u32 = 4;
const PULSE: u32 = 840;
/// Flags of the timer's compare registers (RM0090 section 18.4.5).
const TICK_DUE: u32 = 1 << 1;
const PULSE_OVER: u32 = 1 << 2;
const FIRST_STEP_PIN: u32 = 7;
const FIRST_DIRECTION_PIN: u32 = 10;
const ALL: u32 = (1 << MOTORS) - 1;

/// Memory in place of the registers of a general-purpose timer and a port: those that the board's
/// port uses.
#[derive(Default)]
struct Registers {
    status: u32,
    event: u32,
    counter: u32,
    compare_tick: u32,
    compare_pulse: u32,
    pins: u32,
    output: u32,
    power: u32,
}

impl Registers {
    /// Plays the timer: counts on to the next tick, and sets its flag.
    fn pass_to_tick(&mut self) {
        self.counter = self.compare_tick;
        self.status = TICK_DUE;
    }
}

/// The same stores as in `board-f407/src/step_port.rs`.
struct Port<'a> {
    registers: &'a mut Registers,
    power_scale: PowerScale,
    resting: bool,
    directions: u32,
}

macro_rules! read {
    ($port:expr, $register:ident) => {
        // SAFETY: a reference is valid for reads.
        unsafe { read_volatile(&$port.registers.$register) }
    };
}

macro_rules! write {
    ($port:expr, $register:ident, $value:expr) => {
        // SAFETY: an exclusive reference is valid for writes.
        unsafe { write_volatile(&mut $port.registers.$register, $value) }
    };
}

impl Port<'_> {
    /// Returns true if the tick is due, by the timer's flag. The end of a pulse comes as an
    /// interrupt of its own.
    #[inline]
    fn acknowledge(&mut self) -> bool {
        let flags = read!(self, status) & (TICK_DUE | PULSE_OVER);
        if flags != TICK_DUE || self.resting {
            return self.acknowledge_other(flags);
        }
        write!(self, status, !TICK_DUE);
        true
    }

    #[cold]
    fn acknowledge_other(&mut self, flags: u32) -> bool {
        if flags & PULSE_OVER != 0 {
            write!(self, status, !PULSE_OVER);
            self.end_pulse();
        }
        if flags & TICK_DUE != 0 {
            write!(self, status, !TICK_DUE);
        }
        !self.resting && flags & TICK_DUE != 0
    }

    #[inline]
    fn end_pulse(&mut self) {
        write!(self, pins, ALL << FIRST_STEP_PIN << 16);
        write!(self, pins, self.directions);
    }
}

impl StepPort for Port<'_> {
    #[inline]
    fn step(&mut self, motors: MotorMask) {
        write!(self, pins, u32::from(motors.bits()) << FIRST_STEP_PIN);
        let end = read!(self, counter).wrapping_add(PULSE);
        write!(self, compare_pulse, end);
    }

    #[inline]
    fn set_direction(&mut self, negative: MotorMask) {
        let high = u32::from(negative.bits()) & ALL;
        self.directions = (high | (!high & ALL) << 16) << FIRST_DIRECTION_PIN;
        if read!(self, output) & ALL << FIRST_STEP_PIN == 0 {
            write!(self, pins, self.directions);
        }
    }

    fn change_outputs(&mut self, _: OutputChange) {}

    #[inline]
    fn set_power(&mut self, power: Power) {
        write!(self, power, power.level(self.power_scale));
    }

    #[inline]
    fn arm(&mut self, wait: Ticks) {
        let due = read!(self, compare_tick).wrapping_add(wait.0);
        write!(self, compare_tick, due);
    }

    fn make_up(&mut self) -> bool {
        let due = read!(self, compare_tick);
        let late = read!(self, counter).wrapping_sub(due).cast_signed() >= 0;
        if late {
            write!(self, event, 2);
        }
        late
    }

    fn rest(&mut self) {
        self.resting = true;
    }
}

/// The body of the interrupt.
#[inline(never)]
fn step_interrupt(
    state: &mut StepInterrupt<MOTORS>,
    source: &mut Consumer<'_, Segment<MOTORS>>,
    shared: &Shared<MOTORS>,
    port: &mut Port<'_>,
) {
    if port.acknowledge() {
        on_timer(state, source, shared, port);
    }
}

/// Segment `number` of the run: a line has four segments, with rising speed and power.
fn segment(number: u32) -> Segment<MOTORS> {
    let steps = (TICKS * SEGMENTS) as i32;
    let steps = if number / SEGMENTS % 2 == 0 {
        [steps; MOTORS]
    } else {
        [-steps; MOTORS]
    };
    let begins = number % SEGMENTS == 0;
    let early = Early::half_a_tick(Smoothing::None);
    let line = begins.then(|| Line::new(steps)).transpose().unwrap();
    Segment {
        line: line.map(|line| LineStart::new(line, early)),
        ticks: NonZeroU16::new(TICKS as u16).unwrap(),
        smoothing: Smoothing::None,
        motors: MotorMask::ALL,
        ends_event: true,
        early,
        interval: Interval::from_num(4200),
        interval_change: IntervalChange::from_num(-0.25),
        power: Power::from_share(U1F31::from_num(0.5)),
        power_change: PowerChange::from_num(0.001),
        outputs: OutputChange::NONE,
        at_rest: None,
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut queue: Queue<Segment<MOTORS>, 4> = Queue::new();
    let (mut sink, mut source) = queue.split();
    let mut registers = Registers {
        status: TICK_DUE,
        ..Registers::default()
    };
    let registers = black_box(&mut registers);
    let mut port = Port {
        registers,
        power_scale: PowerScale::new(8400),
        resting: false,
        directions: 0,
    };
    let mut state = StepInterrupt::new();
    // A black box: for the compiler, another context may stop, lock or switch off at any time.
    let shared = Shared::new();
    let shared = black_box(&shared);

    // The first call starts from rest: no step is due, and it is not counted.
    sink.enqueue(segment(0)).ok().unwrap();
    step_interrupt(&mut state, &mut source, shared, &mut port);
    port.registers.pass_to_tick();
    for tick in 1..100 * TICKS * SEGMENTS {
        let call = || step_interrupt(&mut state, &mut source, shared, &mut port);
        if tick % TICKS != 0 {
            count::<0, _>(call);
        } else {
            sink.enqueue(segment(tick / TICKS)).ok().unwrap();
            if tick % (TICKS * SEGMENTS) != 0 {
                count::<1, _>(call);
            } else {
                count::<2, _>(call);
            }
        }
        assert_eq!(
            sink.len(),
            0,
            "a segment is loaded in the call for which it was queued"
        );
        port.registers.pass_to_tick();
        port.end_pulse();
    }
    assert_eq!(shared.underruns(), 0);
    assert_eq!(shared.late_ticks(), 0);
    assert_eq!(shared.position().map(|steps| steps != 0), [true; MOTORS]);
    done()
}
