//! The situations in which realtime bytes are tested, and how a machine is brought into them.

use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::settings::flash::{Area, SettingsStore};
use leadscrew_machine::state::{Door, Hold, Jog, State};
use leadscrew_planner::Cartesian;
use leadscrew_sim::{Memory, Rate};
use leadscrew_tests::{setup, Session};
use std::convert::Infallible;
use std::num::NonZeroU32;

pub(super) type Desk<'a> = Session<'a, Cartesian, 3>;

const SETTINGS: &str =
    "$100=80\n$101=80\n$102=80\n$110=9000\n$111=9000\n$112=9000\n$120=300\n$121=300\n$122=300\n\
                        $22=1\n$25=3000\n$24=500\n";

/// A situation: the bytes that bring the machine into it, and how it is recognised.
pub(super) struct Situation {
    pub(super) name: &'static str,
    bytes: &'static [u8],
    /// The time that the machine takes to get there, µs.
    wait: u64,
    is_there: fn(&Desk<'_>) -> bool,
}

pub(super) fn state(session: &Desk<'_>) -> State {
    session.sim.machine().state()
}

/// Long moves, and more of them than are planned ahead.
const MANY: &[u8] = &{
    let mut lines = [0; 40 * 30];
    let line = b"G1X9Y9F6000\nG1X0Y0\nG1X9Y0Z3\nG1\n";
    let mut at = 0;
    while at < lines.len() {
        lines[at] = line[at % line.len()];
        at += 1;
    }
    lines[lines.len() - 1] = b'\n';
    lines
};

pub(super) const SITUATIONS: [Situation; 18] = [
    Situation {
        name: "Idle",
        bytes: b"",
        wait: 1,
        is_there: |session| state(session) == State::Idle,
    },
    Situation {
        name: "Run",
        bytes: b"G1X50Y20F6000\n",
        wait: 300_000,
        is_there: |session| state(session) == State::Run,
    },
    Situation {
        name: "Run, planner and receive buffer full",
        bytes: MANY,
        wait: 300_000,
        is_there: |session| state(session) == State::Run && !session.sim.machine().is_quiet(),
    },
    Situation {
        name: "Hold, slowing down",
        bytes: b"G1X50Y20F6000\n",
        wait: 0,
        is_there: |session| matches!(state(session), State::Hold(Hold::Stopping { .. })),
    },
    Situation {
        name: "Hold",
        bytes: b"G1X50Y20F6000\n",
        wait: 0,
        is_there: |session| matches!(state(session), State::Hold(Hold::Complete { .. })),
    },
    Situation {
        name: "Jog",
        bytes: b"$J=X50F6000\n",
        wait: 300_000,
        is_there: |session| state(session) == State::Jog(Jog::Moving),
    },
    Situation {
        name: "Jog, cancelled",
        bytes: b"$J=X50F6000\n",
        wait: 0,
        is_there: |session| matches!(state(session), State::Jog(Jog::Cancelling { .. })),
    },
    Situation {
        name: "Home",
        bytes: b"$H\n",
        wait: 300_000,
        is_there: |session| state(session) == State::Home,
    },
    Situation {
        name: "Door, slowing down",
        bytes: b"G1X50Y20F6000\n",
        wait: 0,
        is_there: |session| state(session) == State::Door(Door::Stopping),
    },
    Situation {
        name: "Door",
        bytes: b"G1X5Y2F6000\n\x84",
        wait: 500_000,
        is_there: |session| state(session) == State::Door(Door::Parked),
    },
    Situation {
        name: "Alarm",
        bytes: b"G1X50Y20F6000\n",
        wait: 0,
        is_there: |session| matches!(state(session), State::Alarm(_)),
    },
    Situation {
        name: "Check",
        bytes: b"$C\nG1X5F100\n",
        wait: 10_000,
        is_there: |session| state(session) == State::Check,
    },
    Situation {
        name: "Sleep",
        bytes: b"$SLP\n",
        wait: 10_000,
        is_there: |session| state(session) == State::Sleep,
    },
    Situation {
        name: "in a list",
        bytes: b"$$\n",
        wait: 0,
        is_there: |session| !session.sim.machine().is_quiet(),
    },
    Situation {
        name: "in a dwell",
        bytes: b"G4P2\n",
        wait: 100_000,
        is_there: |session| !session.sim.machine().is_quiet(),
    },
    Situation {
        name: "in a line",
        bytes: b"G1X5",
        wait: 1_000,
        is_there: |session| state(session) == State::Idle,
    },
    Situation {
        name: "in a comment",
        bytes: b"G1X5(a comment; ",
        wait: 1_000,
        is_there: |session| state(session) == State::Idle,
    },
    Situation {
        name: "while a setting is written",
        bytes: b"$110=6000\n",
        wait: 5_000,
        is_there: |session| !session.sim.machine().is_quiet(),
    },
];

/// Memory in which nothing was ever stored; nobody writes to it.
struct Blank;

impl SettingsStore for Blank {
    type Error = Infallible;
    fn size(&self) -> usize {
        1024
    }
    fn read(&mut self, _: Area, _: usize, bytes: &mut [u8]) -> Result<(), Infallible> {
        bytes.fill(0xFF);
        Ok(())
    }
    fn write(&mut self, _: Area, _: usize, _: &[u8]) -> Result<(), Infallible> {
        Ok(())
    }
    fn erase(&mut self, _: Area) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Brings a machine into a situation, and calls `then` with it.
pub(super) fn in_situation(situation: &Situation, rate: Rate, then: impl FnOnce(&mut Desk<'_>)) {
    let mut setup = setup::<3>(1);
    setup.machine = MachineConfig::grbl();
    setup.machine.dialect.mist = true;
    setup.lines = vec![rate];
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream(SETTINGS);
    session.stream("M3S500");
    if situation.name == "while a setting is written" {
        let Ok(_) = session.sim.machine_mut().load(&mut Blank);
    }
    session.send(0, situation.bytes);
    match situation.name {
        "Hold, slowing down" | "Hold" => interrupt(&mut session, b"!", situation),
        "Jog, cancelled" => interrupt(&mut session, b"\x85", situation),
        "Door, slowing down" => interrupt(&mut session, b"\x84", situation),
        "Alarm" => interrupt(&mut session, b"\x18", situation),
        "in a list" => wait_for(&mut session, situation, 1),
        _ => session.wait_us(situation.wait),
    }
    assert!(
        (situation.is_there)(&session),
        "{}: {:?}",
        situation.name,
        state(&session)
    );
    then(&mut session);
}

/// Sends a byte in motion and waits until the machine is in the situation. It waits longer than one
/// burst of bytes, because within a burst a hold keeps later bytes from resuming.
fn interrupt(session: &mut Desk<'_>, byte: &[u8], situation: &Situation) {
    session.wait_us(500_000);
    session.heard(0);
    session.send(0, byte);
    session.wait_us(3_000);
    wait_for(session, situation, 50);
}

/// Waits until the machine is in the situation, `step` microseconds at a time.
fn wait_for(session: &mut Desk<'_>, situation: &Situation, step: u64) {
    for _ in 0..20_000 {
        if (situation.is_there)(session) {
            return;
        }
        session.wait_us(step);
    }
}

pub(super) fn baud(baud: u32) -> Rate {
    Rate::Baud(NonZeroU32::new(baud).unwrap())
}

/// The time that a byte takes on its line, µs, rounded up.
pub(super) fn byte_time(rate: Rate) -> u64 {
    rate.byte_time().map_or(0, |cycles| cycles.div_ceil(168))
}
