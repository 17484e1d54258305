//! What the firmware took on an emulated STM32F407, in cycles. Written by `cargo fw-test --costs`: do not edit.

/// From the timer's compare to the edge of the step pins: the median.
pub const STEP_EDGE: u32 = 47;

/// From the timer's compare to the power that changes with a step: the median.
pub const POWER_EDGE: u32 = 60;

/// A tick at which three motors step and power changes: the median.
pub const STEP: u32 = 185;

/// The same: the longest.
pub const STEP_MOST: u32 = 202;

/// A tick that loads a segment: the median.
pub const LOAD: u32 = 290;

/// The same: the longest, the first of a line.
pub const LOAD_MOST: u32 = 448;

/// A tick that comes to rest when no segment is left.
pub const RUN_OUT: u32 = 216;

/// From the end of a pulse's time to the fall of the step pins: the shortest.
pub const PULSE_EDGE: u32 = 37;

/// To end a pulse: the median.
pub const PULSE_END: u32 = 68;

/// The interrupts of a switch's edge and of the end of its filter's time.
pub const SWITCHES: u32 = 704;

/// To receive a byte of a line of 2 Mbaud that never rests.
pub const BYTE_IN: u32 = 94;

/// To send a byte of `ok`.
pub const BYTE_OUT: u32 = 70;

/// A turn of the main loop at rest.
pub const POLL: u32 = 4373;

/// A byte taken from the receive queue, or given to the sender.
pub const BYTE: u32 = 94;

/// A line of seven words, none of them a place, checked and interpreted, and answered.
pub const LINE: u32 = 1252;

/// A move planned, and its words: in the mean of a thousand.
pub const PLANNED_MOVE: u32 = 8872;

/// A move that became part of a row of pixels, and its words: in the mean of a thousand.
pub const PIXEL: u32 = 2349;

/// To make a segment, and to find no room for the next: in the mean of a thousand moves.
pub const SEGMENT: u32 = 1601;

/// A queued move whose time is added up for a report.
pub const TIMED: u32 = 4564;

/// A status report.
pub const REPORT: u32 = 10997;

/// A hundred instructions of the main loop, while a thousand moves are planned.
pub const HUNDRED_INSTRUCTIONS: u32 = 191;
