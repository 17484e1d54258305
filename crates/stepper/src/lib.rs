//! Segments in, step events out: the integer half of motion.
//!
//! ```text
//!  main loop                    |  step interrupt
//!                               |
//!  Segment --> SPSC queue ------+--> Stepper::tick --> Tick --> StepPort --> pins
//!  (steps of a Line, interval,  |    (Bresenham,        (wait, steps, direction,
//!   power, their changes)       |     adds only)         power, outputs)
//!                               |
//!  Shared: stop, motor lock, laser off  -->  read first in every interrupt
//!  Shared: position, running, underruns <--  written by the interrupt only
//! ```
//!
//! A [`Line`] is one straight move counted in motor steps. A [`Segment`] is a run of *ticks* of
//! that line whose interval (and power) changes linearly from tick to tick. With step smoothing at
//! level *L* there are `2^L` ticks to a step of the dominant motor, so that the other motors step
//! within half a tick of the true line.
//!
//! The time of tick *k* (from 1) after the segment's start is `p·k + d·k(k−1)/2` timer counts, with
//! the first interval `p` and its change `d`: two additions a tick, no division, no float.
//!
//! [`on_timer`] is the whole body of the step interrupt. The board and the simulator call the same
//! function; they differ in their [`StepPort`] only. Each tick looks ahead for the power that
//! begins with the next one, so that power changes with its step.
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::float_arithmetic)]

mod interrupt;
mod outputs;
mod port;
mod segment;
mod shared;
mod stepper;
mod windings;

#[cfg(test)]
mod quiet_tests;

pub use interrupt::{on_timer, start, Glide, StepInterrupt};
pub use outputs::OutputChange;
pub use port::StepPort;
pub use segment::{
    Early, Interval, IntervalChange, Line, LineError, LineStart, MotorMask, Power, PowerChange,
    PowerScale, Segment, Smoothing, Ticks, MAX_MOTORS, MAX_SMOOTHING_LEVEL, MAX_STEP_EVENTS,
};
pub use shared::Shared;
pub use stepper::{Progress, Stepper, Tick};
pub use windings::{next_state, WindingPort, WindingTable, Windings, FIVE_PHASE_HALF_STEPS};

/// The examples of the package's README, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
