//! What the firmware took on an emulated STM32F407, in cycles. Written by `cargo fw-test --costs`: do not edit.

/// From the timer's compare to the edge of the step pins: the median.
pub const STEP_EDGE: u32 = 49;

/// From the timer's compare to the power that changes with a step: the median.
pub const POWER_EDGE: u32 = 61;

/// A tick at which three motors step and power changes: the median.
pub const STEP: u32 = 194;

/// The same: the longest.
pub const STEP_MOST: u32 = 211;

/// A tick that loads a segment: the median.
pub const LOAD: u32 = 297;

/// The same: the longest, the first of a line.
pub const LOAD_MOST: u32 = 477;

/// A tick that comes to rest where no segment is left.
pub const RUN_OUT: u32 = 232;

/// From the end of a pulse's time to the fall of the step pins: the shortest.
pub const PULSE_EDGE: u32 = 39;

/// To end a pulse: the median.
pub const PULSE_END: u32 = 69;

/// The interrupts of a switch's edge and of the end of its filter's time.
pub const SWITCHES: u32 = 766;

/// To receive a byte of a line of 2 Mbaud that never rests.
pub const BYTE_IN: u32 = 86;

/// To send a byte of `ok`.
pub const BYTE_OUT: u32 = 69;

/// A turn of the main loop at rest.
pub const POLL: u32 = 4650;

/// A byte taken from the receive queue, or given to the sender.
pub const BYTE: u32 = 87;

/// A line of seven words, none of them a place, checked and interpreted, and answered.
pub const LINE: u32 = 1319;

/// A move planned, and its words: in the mean of a thousand.
pub const PLANNED_MOVE: u32 = 8573;

/// A move that became part of a row of pixels, and its words: in the mean of a thousand.
pub const PIXEL: u32 = 3029;

/// To make a segment, and to find no room for the next: in the mean of a thousand moves.
pub const SEGMENT: u32 = 1551;

/// A queued move whose time is added up for a report.
pub const TIMED: u32 = 4108;

/// A status report.
pub const REPORT: u32 = 11812;

/// A hundred instructions of the main loop, while a thousand moves are planned.
pub const HUNDRED_INSTRUCTIONS: u32 = 189;
