//! serve.
mod frame_reader;
pub mod line;
mod listener;
mod buttons;
pub mod glitches;
pub mod note;
pub mod pace;
pub mod panel;
pub mod server;
pub mod state_file;
mod wires;
#[cfg(unix)]
mod pty;
#[cfg(not(unix))]
#[path = "no_pty.rs"]
mod pty;
mod tcp;
mod websocket;
pub mod wire_log;

#[cfg(test)]
mod line_tests;
