//! Settings: their table, their values, and where they survive a power loss.

pub mod table;
pub mod values;
