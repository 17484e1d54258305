//! The services of the step interrupts by kind: plain ticks, ticks that load a segment, ends of
//! pulses.
use crate::{
    bench::Bench,
    pins::{PULSE_IRQ, STEP_IRQ},
};
use leadscrew_f407emu::{Exception, Service};

/// An end of a pulse that comes later than this after a tick belongs to no tick in motion, cycles:
/// 0.1 ms.
const REST: u64 = 16_800;
/// Ticks nearer to each other than this may come too late, cycles: 168 000 a second.
const FAST: u64 = 1_000;
/// A tick that takes longer than this is taken to load a segment, cycles, with three motors. The
/// check `step-interrupt` makes sure that such ticks are few.
pub(super) const TICK: u64 = 230;
/// The number of cycles by which a tick of four motors may be longer.
const FOURTH: u64 = 40;

/// The lengths of services in cycles, in order of time, without the interrupts nested in them.
#[derive(Default)]
pub(super) struct Interrupts {
    /// Ticks at which all motors stepped, and no segment was loaded.
    pub(super) stepping: Vec<u64>,
    /// Ticks that loaded a segment.
    pub(super) loads: Vec<u64>,
    /// The last tick of all, which finds no segment to load.
    pub(super) run_out: u64,
    /// Ends of pulses that no tick interrupted.
    pub(super) ends: Vec<u64>,
    /// The most cycles that all these interrupts took from one tick to the next, if the next
    /// tick came within [`FAST`].
    pub(super) busiest: u64,
}

impl Interrupts {
    /// Sorts all services that a bench has recorded.
    pub(super) fn of(bench: &Bench) -> Interrupts {
        let services = |irq| {
            let exception = Exception::irq(irq);
            let all = bench.machine.services().iter();
            all.filter(move |service| service.exception == exception)
        };
        let edges = &bench.pins.steps;
        let motors = bench.wiring.step.len();
        let all_motors = (1 << motors) - 1;
        let plain = TICK + if motors > 3 { FOURTH } else { 0 };
        let all_step = |tick: &&Service| {
            let next = edges.partition_point(|step| step.edge() < tick.entry);
            let step = edges.get(next).filter(|step| step.edge() < tick.exit);
            step.is_some_and(|step| step.motors == all_motors)
        };
        let ticks: Vec<&Service> = services(STEP_IRQ).collect();
        let Some((last, before)) = ticks.split_last() else {
            return Interrupts::default();
        };
        let (loads, others): (Vec<&Service>, Vec<&Service>) =
            before.iter().partition(|tick| length(tick) > plain);
        let stepping = others.into_iter().filter(all_step).map(length);
        let mut interrupts = Interrupts {
            stepping: stepping.collect(),
            loads: loads.into_iter().map(length).collect(),
            run_out: length(last),
            ..Interrupts::default()
        };
        let mut busy: Vec<u64> = ticks.iter().copied().map(length).collect();
        for untimed in services(PULSE_IRQ) {
            let next = ticks.partition_point(|tick| tick.entry < untimed.entry);
            let Some(before) = next.checked_sub(1) else {
                continue;
            };
            let nested = ticks.get(next).filter(|tick| tick.exit <= untimed.exit);
            let taken = length(untimed) - nested.copied().map_or(0, length);
            let since = untimed.entry - ticks[before].exit;
            if since < REST {
                busy[before] += taken;
            }
            if nested.is_none() && since < REST {
                interrupts.ends.push(taken);
            }
        }
        let fast = |pair: &&[&Service]| pair[1].entry - pair[0].entry < FAST;
        let pairs = ticks.windows(2).zip(busy);
        let at_speed = pairs.filter(|(pair, _)| fast(pair)).map(|(_, busy)| busy);
        interrupts.busiest = at_speed.max().unwrap_or(0);
        interrupts
    }

    /// The longest tick of all.
    pub(super) fn longest(&self) -> u64 {
        let ticks = self.stepping.iter().chain(&self.loads);
        ticks.copied().fold(self.run_out, u64::max)
    }
}

fn length(service: &Service) -> u64 {
    service.exit - service.entry
}

/// The median of some lengths, and the longest; 0 if there are none.
pub(super) fn middle_and_most(lengths: &[u64]) -> (u64, u64) {
    let mut lengths = lengths.to_vec();
    lengths.sort_unstable();
    let middle = lengths.get(lengths.len() / 2).copied();
    let most = lengths.last().copied();
    (middle.unwrap_or(0), most.unwrap_or(0))
}
