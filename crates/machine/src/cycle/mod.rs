//! Cycles: the machine drives itself. Each is a value that `Machine::poll` advances; none waits.

pub(crate) mod door;
pub(crate) mod homing;
pub(crate) mod startup;
