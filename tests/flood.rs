//! A line that floods the machine with realtime bytes keeps no other line waiting: neither its `!`
//! and 0x18, nor its reports.

use leadscrew_machine::board::ChannelId;
use leadscrew_machine::config::MachineConfig;
use leadscrew_planner::Cartesian;
use leadscrew_sim::{Cycle, Host, Memory, Rate, Setup, Simulation};
use std::collections::VecDeque;
use std::num::NonZeroU32;

/// Bytes that one line repeats for ever, as fast as it can.
const FLOODS: [&[u8]; 9] = [
    b"?",
    b"\x91",
    b"\x91\x92",
    b"?\x91?\x92",
    b"~",
    b"\x9a\x9b",
    b"\xa0",
    b"x",
    b"\n",
];

/// The rates of the flood: as fast as turns of the main loop allow, and 200 000 and a million bytes
/// a second, of which the interrupts alone take half of the CPU.
const RATES: [Rate; 3] = [
    Rate::NeverWaits,
    Rate::Baud(NonZeroU32::new(2_000_000).unwrap()),
    Rate::Baud(NonZeroU32::new(10_000_000).unwrap()),
];

const FEED_S: f64 = 100.0; // 6000 mm/min
const SETTINGS: &str = "$100=80\n$101=80\n$110=6000\n$111=6000\n$120=2000\n$121=2000\n";

/// One line floods, the others say what they are told.
struct Desk {
    flooding: ChannelId,
    flood: &'static [u8],
    is_on: bool,
    at: usize,
    to_send: [VecDeque<u8>; 3],
    /// The time at which each report of the line that is answered came, and its text.
    reports: Vec<(Cycle, String)>,
    incoming: [Vec<u8>; 3],
}

impl Host for Desk {
    fn next_byte(&mut self, channel: ChannelId) -> Option<u8> {
        if channel == self.flooding && self.is_on {
            self.at += 1;
            return Some(self.flood[self.at % self.flood.len()]);
        }
        self.to_send[usize::from(channel.0)].pop_front()
    }
    fn receive(&mut self, channel: ChannelId, byte: u8, now: Cycle) {
        let incoming = &mut self.incoming[usize::from(channel.0)];
        if byte != b'\n' {
            return incoming.push(byte);
        }
        let line = String::from_utf8(std::mem::take(incoming)).unwrap();
        if channel != self.flooding && line.starts_with('<') {
            self.reports.push((now, line));
        }
    }
}

/// Line `job` moves at 100 mm/s, and line `flooding` floods; then `byte` comes on line `from`.
/// Returns the speed after 5 ms, mm/s, and the time to the next report, ms.
fn disturb(rate: Rate, flood: &'static [u8], flooding: u8, from: u8, byte: u8) -> (f32, f64) {
    let mut setup = Setup::<3>::new(MachineConfig::new(), Rate::NeverWaits);
    setup.lines = vec![Rate::NeverWaits; 3];
    setup.lines[usize::from(flooding)] = rate;
    let mut memory = Memory::new(&setup);
    let mut sim: Simulation<'_, _, _, 3, 3, 1024> =
        Simulation::new(&mut memory, &setup, Cartesian, ());
    let mut desk = Desk {
        flooding: ChannelId(flooding),
        flood,
        is_on: false,
        at: 0,
        to_send: Default::default(),
        reports: Vec::new(),
        incoming: Default::default(),
    };
    let job = format!("{SETTINGS}G1X199F6000\n");
    desk.to_send[usize::from(from)].extend(job.bytes());
    wait(&mut sim, &mut desk, 400_000);
    assert_eq!(f64::from(sim.machine().speed()).round(), FEED_S);
    desk.is_on = true;
    wait(&mut sim, &mut desk, 200_000);
    // The flood may have changed the feed override.
    let before = sim.machine().speed();
    assert!(before > 5.0, "{before}");
    desk.reports.clear();
    let sent = sim.now();
    desk.to_send[usize::from(from)].extend([byte, b'?']);
    wait(&mut sim, &mut desk, 5_000);
    let state = sim.machine().state();
    let shown = format!("{flood:x?} on {flooding}, {byte:#x} on {from}: {state:?}");
    assert!(
        !matches!(state, leadscrew_machine::state::State::Run),
        "{shown}"
    );
    let report = desk
        .reports
        .first()
        .map(|(at, _)| (*at - sent) as f64 / 168_000.0);
    (sim.machine().speed() / before, report.unwrap_or(f64::MAX))
}

fn wait(sim: &mut Simulation<'_, Cartesian, (), 3, 3, 1024>, desk: &mut Desk, micros: u64) {
    let end = sim.now() + Cycle::from_micros(micros).0;
    sim.wait_until(desk, end);
}

#[test]
fn a_hold_and_a_reset_act_within_five_milliseconds_while_another_line_floods() {
    for rate in RATES {
        for flood in FLOODS {
            for (flooding, from) in [(0, 1), (1, 0), (0, 2), (1, 2)] {
                for byte in [b'!', 0x18, 0x84] {
                    if flood == b"~" && byte != 0x18 {
                        continue; // the flood resumes: last heard, last obeyed
                    }
                    let (speed, report) = disturb(rate, flood, flooding, from, byte);
                    let case = format!("{rate:?} {flood:x?} {flooding} {from} {byte:#x}");
                    assert!(speed < 1.0, "{case}: {speed}");
                    assert!(report < 5.0, "{case}: a report after {report} ms");
                }
            }
        }
    }
}

/// As it is a moment later, when the job moves: had the setting waited, all lines would have.
#[test]
fn a_setting_of_another_line_stops_no_job_that_is_about_to_move() {
    let mut setup = Setup::<3>::new(MachineConfig::new(), Rate::NeverWaits);
    setup.lines = vec![Rate::NeverWaits; 3];
    let mut memory = Memory::new(&setup);
    let mut sim: Simulation<'_, _, _, 3, 3, 1024> =
        Simulation::new(&mut memory, &setup, Cartesian, ());
    let mut desk = Desk {
        flooding: ChannelId(2),
        flood: b"",
        is_on: false,
        at: 0,
        to_send: Default::default(),
        reports: Vec::new(),
        incoming: Default::default(),
    };
    // It begins 100 ms after its line.
    let job = format!("$701=100\n{SETTINGS}G1X20F6000\n");
    desk.to_send[0].extend(job.bytes());
    wait(&mut sim, &mut desk, 50_000);
    desk.to_send[1].extend(b"$100=81\n");
    wait(&mut sim, &mut desk, 10_000);
    desk.to_send[0].extend(b"X40\n");
    let mut speeds = Vec::new();
    while sim.machine().position()[0].to_mm() < 35.0 {
        wait(&mut sim, &mut desk, 5_000);
        speeds.push(f64::from(sim.machine().speed()).round());
    }
    let ramp = speeds.iter().position(|speed| *speed == FEED_S).unwrap();
    let cruise = &speeds[ramp..speeds.len() - 1];
    assert!(cruise.iter().all(|speed| *speed == FEED_S), "{speeds:?}");
}
