//! The wire: bytes to lines and commands, answers to text. No machine inside.

pub mod alarm;
pub mod cadence;
pub(crate) mod codes;
pub mod decimal;
mod late;
pub mod line_reader;
pub mod message;
pub mod realtime;
pub mod report;
pub mod serial;
pub mod status;
pub mod system_command;
