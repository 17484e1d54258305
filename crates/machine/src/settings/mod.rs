//! Settings: their table, their values, and where they survive a power loss.

pub(crate) mod derived;
pub mod flash;
pub mod group;
pub mod record;
mod scan;
pub mod store;
pub mod table;
pub mod values;
