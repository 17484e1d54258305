//! The wire: bytes to lines and commands, answers to text. No machine inside.

pub mod alarm;
pub mod cadence;
pub mod decimal;
mod late;
pub mod line_reader;
pub mod message;
pub(crate) mod own_code;
pub mod realtime;
pub mod report;
pub mod serial;
pub mod system_command;

pub use leadscrew_interpreter::status;
