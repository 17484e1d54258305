//! The second serial line of an STM32F407: USB. Compiled for a computer, this crate is empty.
#![cfg_attr(target_os = "none", no_std)]
#![deny(unsafe_code)]

#[cfg(target_os = "none")]
mod otg_fs;

#[cfg(target_os = "none")]
pub use otg_fs::{Place, Port, Registers, Writer};
