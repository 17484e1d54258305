//! Firmware of an STM32F407 board. On a desk this is a program that says how to build it.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]
#![deny(unsafe_code)]

#[cfg(target_os = "none")]
mod board;
#[cfg(all(target_os = "none", captures))]
mod capture;
#[cfg(target_os = "none")]
mod chip;
#[cfg(target_os = "none")]
mod clock;
#[cfg(target_os = "none")]
mod critical;
#[cfg(target_os = "none")]
mod fast_memory;
#[cfg(target_os = "none")]
mod firmware;
#[cfg(target_os = "none")]
mod gpio;
#[cfg(all(target_os = "none", heaters))]
mod heaters;
#[cfg(all(target_os = "none", outputs))]
mod outputs;
#[cfg(target_os = "none")]
mod profile;
#[cfg(target_os = "none")]
mod pwm;
#[cfg(all(target_os = "none", record))]
mod record_flash;
#[cfg(target_os = "none")]
mod registers;
#[cfg(target_os = "none")]
mod restart;
#[cfg(target_os = "none")]
mod safe_state;
#[cfg(target_os = "none")]
mod sector;
#[cfg(target_os = "none")]
mod serial;
#[cfg(target_os = "none")]
mod settings_flash;
#[cfg(target_os = "none")]
mod step_interrupt;
#[cfg(target_os = "none")]
mod step_port;
#[cfg(target_os = "none")]
mod supply;
#[cfg(target_os = "none")]
mod switches;
#[cfg(all(target_os = "none", tool_switches))]
mod tool;
#[cfg(target_os = "none")]
#[cfg(target_os = "none")]
mod watchdog;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("board-f407 is firmware: build it with `cargo fw`");
}
