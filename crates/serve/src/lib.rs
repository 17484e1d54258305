//! `leadscrew serve`: a virtual machine in real time, on lines that real senders can open.
//!
//! ```text
//!   LaserGRBL, UGS, ... --tcp, ws, pty--> Lines --> Server --> Simulation     one thread each line and client,
//!                                                     |            |          one for everything else
//!                                        Panel, WireLog        StateFile
//! ```
//!
//! No client can stop the server. A client that vanishes, floods the line or does not read causes
//! one message, and the machine goes on. A line that cannot be opened is tried again until it can.
#![forbid(unsafe_code)]

mod allowance;
mod bench;
mod frame_reader;
mod line;
mod lines;
mod listener;
mod note;
mod page;
mod panel;
#[cfg(unix)]
mod pty;
#[cfg(not(unix))]
#[path = "no_pty.rs"]
mod pty;
mod remembered;
mod request;
mod screen;
mod seat;
mod server;
mod spool;
mod state_file;
mod tcp;
mod token;
mod uplink;
mod web;
mod websocket;
mod wire_log;

#[cfg(test)]
mod lines_tests;

pub use allowance::{allowance, NoAllowance};
pub use line::{LineError, LineSpec, Refusal, What};
pub use note::Note;
pub use panel::{Key, Panel, Plain, Snapshot};
pub use screen::Screen;
pub use server::Surroundings;
pub use state_file::{NoStateFile, StateFile};
pub use token::Token;
pub use web::{Allowed, Foreign};
pub use wire_log::WireLog;

use bench::Bench;
use leadscrew_jobs::Workshop;
use leadscrew_machine::config::CHANNELS;
use leadscrew_page::{hello, Desk, Glitches, Pages, Trail, Watcher};
use leadscrew_sim::link::Rate;
use leadscrew_sim::powered::Supply;
use leadscrew_sim::profile::Profile;
use leadscrew_sim::Fixtures;
use leadscrew_sim::PowerUp;
use remembered::Remembered;
use server::{End, Server};
use std::cell::RefCell;

/// The served machine and its lines.
pub struct Service {
    /// The machine.
    pub profile: Profile,
    /// The lines on which programs can connect, at most as many as a machine has channels.
    pub lines: Vec<LineSpec>,
    /// The web pages that may connect, and the names of this computer that they may use.
    pub allowed: Allowed,
    /// The speed of the lines.
    pub rate: Rate,
    /// Simulated seconds in a second.
    pub speed: f64,
    /// The file in which settings survive a restart; `None` for none.
    pub state: Option<StateFile>,
    /// The log of the bytes on the lines; `None` for none.
    pub log: Option<WireLog>,
}

/// Serves until the user ends the server.
pub fn serve(service: Service, around: Surroundings<'_>) {
    let Service {
        profile,
        lines,
        allowed,
        rate,
        speed,
        state,
        log,
    } = service;
    let channel = pages_channel(&lines);
    let count = lines.len() + usize::from(channel.is_some());
    let pages = Pages::new(channel, count, profile.switches.normally_closed);
    let bench = Bench::new(Workshop::new(&profile));
    let mut server = Server::new(lines, allowed, speed, log, pages, bench, around);
    run(&profile, rate, state, &mut server);
}

/// The examples of the package's README, compiled as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

/// The channel on which pages move the machine: the one after the last line's. `None` if no line
/// takes pages or the machine has no channel left.
fn pages_channel(lines: &[LineSpec]) -> Option<usize> {
    let has_port = lines
        .iter()
        .any(|line| matches!(line, LineSpec::WebSocket(_)));
    (has_port && lines.len() < CHANNELS).then_some(lines.len())
}

/// Powers the machine up, and again after each reset.
fn run(profile: &Profile, rate: Rate, state: Option<StateFile>, server: &mut Server<'_>) {
    let mut remembered = Remembered::new(state, &mut |note| server.note(note));
    let glitches = Glitches::of(profile);
    let motors = profile.motor_count();
    let mut supply = Supply {
        // The settings stay in memory for ever, so they are made once, not at each restart.
        first: Some(profile.first_settings().leak()),
        lines: server.line_count(),
        ..profile.supply(rate)
    };
    loop {
        let trail = RefCell::new(Trail::new(profile.tooling()));
        let mut end = End::Stopped;
        profile.power_up(supply, &mut Watcher(&trail), &mut |machine| {
            let mut desk = Desk::new(machine, &trail, motors, profile.letters());
            remembered.load(&mut desk, &mut |note| server.note(note));
            server.greet(&hello(profile, server.pages_channel()));
            end = server.run(&mut desk, glitches.clone(), &mut remembered);
            supply.carriages = Some(desk.carriages());
        });
        match end {
            End::Stopped => return,
            End::Restart => server.note(&Note::Restarted),
        }
    }
}
