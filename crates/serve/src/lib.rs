//! `leadscrew serve`: a virtual machine in real time, on lines that real senders can open.
//!
//! ```text
//!   LaserGRBL, UGS, ... --tcp, ws, pty--> Lines --> Server --> Simulation     one thread each line and client,
//!                                                     |            |          one for everything else
//!                                        Panel, WireLog        StateFile
//! ```
//!
//! Nothing that a client does can stop the server: one that vanishes, floods or does not read costs
//! one message, and the machine goes on. A line that cannot be opened is tried again until it can.
#![forbid(unsafe_code)]

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

pub use line::{LineError, LineSpec, Refusal, What};
pub use note::Note;
pub use panel::{Key, Panel, Plain, Snapshot};
pub use screen::Screen;
pub use server::Surroundings;
pub use state_file::StateFile;
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
use remembered::Remembered;
use server::{End, Server};
use std::cell::RefCell;

/// The served machine and its lines.
pub struct Service {
    /// The machine.
    pub profile: Profile,
    /// Where programs can connect: as many as a machine has channels at most.
    pub lines: Vec<LineSpec>,
    /// Which web pages may connect, and by which names of this computer.
    pub allowed: Allowed,
    /// How fast the lines are.
    pub rate: Rate,
    /// Simulated seconds in a second.
    pub speed: f64,
    /// Where settings survive a restart.
    pub state: Option<StateFile>,
    /// Where the wire is written down.
    pub log: Option<WireLog>,
}

/// Serves until the user wants it to end.
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

/// The channel that pages move the machine on: one more than the lines, where there is a port for
/// pages and the machine has one left.
fn pages_channel(lines: &[LineSpec]) -> Option<usize> {
    let has_port = lines
        .iter()
        .any(|line| matches!(line, LineSpec::WebSocket(_)));
    (has_port && lines.len() < CHANNELS).then_some(lines.len())
}

/// Powers a machine up, and again after each restart.
fn run(profile: &Profile, rate: Rate, state: Option<StateFile>, server: &mut Server<'_>) {
    let mut remembered = Remembered::new(state, &mut |note| server.note(note));
    let glitches = Glitches::of(profile);
    let motors = profile.motor_count();
    let mut supply = Supply {
        // Once, and not at each restart: they stay in memory.
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
