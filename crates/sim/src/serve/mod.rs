//! serve.
mod frame_reader;
pub mod line;
mod listener;
#[cfg(unix)]
mod pty;
#[cfg(not(unix))]
#[path = "no_pty.rs"]
mod pty;
mod tcp;
mod websocket;

#[cfg(test)]
mod line_tests;
