//! What goes over the wire: bytes to lines and commands, answers to text. No machine inside.

pub mod alarm;
mod codes;
pub mod realtime;
pub mod serial;
pub mod status;
