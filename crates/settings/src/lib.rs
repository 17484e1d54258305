//! Settings: their table, their values, and where they survive a power loss.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod enumeration;
pub mod flash;
pub mod group;
pub mod record;
mod scan;
pub mod store;
pub mod table;
pub mod values;

/// The examples of the package's README, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
