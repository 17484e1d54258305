//! A simulated machine on a web page: the page, the frames that it exchanges, and the machine
//! behind it, which runs in real time.
//!
//! ```text
//!   page (web/*.js) <==frames== Pages <--- Desk: machine, Trail, Buttons, Glitches
//!                   ==Said====>            Wires: its serial lines    Pace: its clock beside the wall's
//! ```
//!
//! Nothing here waits, opens a connection or asks for the time: time is an argument. So the same
//! code serves pages over a network (`leadscrew-serve`) and, compiled for a browser, a page without
//! a server (`leadscrew-wasm`).
#![forbid(unsafe_code)]

mod alone;
mod buttons;
mod desk;
mod document;
mod frames;
mod glitches;
mod key;
mod outlet;
mod pace;
mod pages;
mod trail;
mod wires;

pub use alone::Alone;
pub use buttons::Buttons;
pub use desk::Desk;
pub use document::{document, Playback, Standalone};
pub use frames::{finding as finding_frame, Nonsense, Said, SaidReader};
pub use glitches::Glitches;
pub use key::Key;
pub use outlet::Outlet;
pub use pace::Pace;
pub use pages::{hello, Errand, PageAction, PageEvent, Pages};
pub use trail::{Trail, Watcher};
pub use wires::Wires;

/// The example of the package's README, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
