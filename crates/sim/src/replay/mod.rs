//! Replays recorded conversations with the simulated machine in virtual time.
//!
//! ```text
//!   Case --Op--> Session --bytes--> Wire ==115200 baud==> Simulation      one Simulation from power-up to power-up
//!    ^             |  |                                      |  ^
//!    +----lines----+  +------ pins, switches, carriages -----|--+
//!                                                          Flash         the values after a power cycle
//! ```
//!
//! A conversation is a list of operations such as `cmd G0 X1` or `pin hold 0`, each with the lines
//! that came before the next one. [`op`] lists the operations. The machine is one of the builds of
//! Grbl in [`case::Build`].

pub mod case;
pub mod judge;
pub mod op;
mod session;
mod wire;
mod world;

pub use case::{Build, Case, Exchange};
pub use judge::{judge, Disagreement};
pub use op::{BadOp, Op};

use crate::clock::Cycle;
use crate::flash::Flash;
use crate::link::Rate;
use crate::setup::{Memory, Setup};
use session::{Ended, Session};
use std::fmt;
use std::num::NonZeroU32;
use wire::Wire;
use world::World;

/// The speed of Grbl's serial line, bits a second.
const BAUD: NonZeroU32 = NonZeroU32::new(115_200).expect("not 0");

/// An exchange whose operation cannot be replayed.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ReplayError {
    /// The exchange, from 0.
    pub exchange: usize,
    /// Its operation.
    pub op: String,
    /// The mistake in the operation.
    pub why: BadOp,
}

impl fmt::Display for ReplayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "exchange {}, `{}`: {}", self.exchange, self.op, self.why)
    }
}

impl std::error::Error for ReplayError {}

/// Replays the conversation of `case` with a machine of its build. Returns the conversation with
/// that machine's lines and times.
///
/// # Errors
/// An operation is not one of [`Op`].
pub fn replay(case: &Case) -> Result<Case, ReplayError> {
    replay_on::<3>(case)
}

/// As [`replay`], with a machine that is built for `N` axes and motors, 3 or more, and uses the
/// first three axes.
///
/// # Errors
/// As [`replay`].
pub fn replay_on<const N: usize>(case: &Case) -> Result<Case, ReplayError> {
    let ops = ops(&case.exchanges)?;
    let mut setup = Setup::<N>::new(case.build.config(), Rate::Baud(BAUD));
    setup.receive_buffer = usize::from(setup.machine.receive_size);
    let (mut flash, mut wire, mut world) = (Flash::blank(), Wire::new(), World::new());
    let (mut exchanges, mut power_up) = (Vec::new(), Cycle::ZERO);
    loop {
        let mut memory = Memory::new(&setup);
        let mut session =
            Session::power_up(&mut memory, &setup, &mut flash, &mut wire, &world, power_up);
        let ended = session.hold(&ops[exchanges.len()..], |t_ms, recv| {
            let op = case.exchanges[exchanges.len()].op.clone();
            exchanges.push(Exchange { op, t_ms, recv });
        });
        power_up = session.now();
        match ended {
            Ended::PowerCycle => world = session.world(),
            Ended::Done => break,
        }
    }
    Ok(Case {
        exchanges,
        ..case.clone()
    })
}

fn ops(exchanges: &[Exchange]) -> Result<Vec<Op>, ReplayError> {
    let parse = |(number, exchange): (usize, &Exchange)| {
        exchange.op.parse().map_err(|why| ReplayError {
            exchange: number,
            op: exchange.op.clone(),
            why,
        })
    };
    exchanges.iter().enumerate().map(parse).collect()
}
