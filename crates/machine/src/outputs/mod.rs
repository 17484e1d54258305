//! What the machine switches besides motors.

pub mod beam;
pub mod coolant;
pub mod spindle;

pub(crate) mod dead_man;
pub(crate) mod motors;
