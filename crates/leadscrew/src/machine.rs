//! The machine as a board's main loop has it.

use crate::fault::Fault;
use crate::outputs::Actuators;
use crate::words::Words;
use core::ops::{Deref, DerefMut};
use core::sync::atomic::Ordering;
use heapless::spsc::Producer;
use leadscrew_machine::board::{
    Board, ChannelId, CoolantOutput, Duration, Instant, PortConfig, SpindleOutput, Switches,
};
use leadscrew_machine::extension::Extension;
use leadscrew_machine::machine::{Machine as Inner, Next};
use leadscrew_machine::state::State;
use leadscrew_planner::Kinematics;
use leadscrew_stepper::Power;

/// A GRBL machine on a board. It belongs to the main loop, which calls [`Machine::poll`] for ever,
/// or awaits `Machine::run`. All that it knows is told by the methods of the machine beneath it:
/// `position`, `state`, `settings`, `load`, `save`.
pub struct Machine<'a, K, const AXES: usize, const MOTORS: usize, X = ()> {
    inner: Inner<'a, K, AXES, MOTORS, X>,
    link: Link<'a, MOTORS>,
    latest: Instant,
    /// When the next poll is due, if the step interrupt runs.
    due: Option<Instant>,
    /// The most by which a poll came late in motion.
    lateness: Duration,
    underruns: u32,
    /// The operator was told about a fault; that ticks come late.
    told: (bool, bool),
}

/// The machine's end of what it shares with the interrupts.
struct Link<'a, const MOTORS: usize> {
    words: &'a Words<MOTORS>,
    wire: Producer<'a, u8>,
    /// The power that the outputs have.
    power: Power,
    enabled: bool,
    enable_invert: bool,
}

/// After this many late ticks the operator is told.
const LATE_TICKS: u32 = 16;

/// The message to the operator in that case, 64 characters at most.
const TICKS_ARE_LATE: &str = "Steps come late: give them the highest priority, or a lower rate";

/// The message to the operator if motion ran out of segments: how late a poll came at most, ms, and
/// the text, 64 characters at most.
const RAN_DRY: [(u64, &str); 4] = [
    (1, "Motion ran dry: a poll came up to 1 ms late"),
    (3, "Motion ran dry: a poll came up to 3 ms late"),
    (10, "Motion ran dry: a poll came up to 10 ms late"),
    (u64::MAX, "Motion ran dry: a poll came over 10 ms late"),
];

impl<'a, K, X, const AXES: usize, const MOTORS: usize> Machine<'a, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    pub(crate) fn new(
        inner: Inner<'a, K, AXES, MOTORS, X>,
        words: &'a Words<MOTORS>,
        wire: Producer<'a, u8>,
    ) -> Self {
        Self {
            inner,
            link: Link {
                words,
                wire,
                power: Power::OFF,
                enabled: false,
                enable_invert: false,
            },
            latest: Instant::from_ticks(0),
            due: None,
            lateness: Duration::from_ticks(0),
            underruns: 0,
            told: (false, false),
        }
    }

    /// Does a bounded amount of work, and returns when to call again: see [`Next`]. Main loop. A
    /// `now` that goes back counts as the latest one.
    pub fn poll<O: Actuators>(&mut self, outputs: &mut O, now: Instant) -> Next {
        self.link.words.bells.machine.clear();
        self.latest = self.latest.max(now);
        let now = self.latest;
        let late = self.due.and_then(|due| now.checked_duration_since(due));
        self.lateness = self.lateness.max(late.unwrap_or(Duration::from_ticks(0)));
        let alarmed = matches!(self.inner.state(), State::Alarm(_));
        let mut desk = Desk {
            link: &mut self.link,
            outputs,
        };
        let next = self.inner.poll(&mut desk, now);
        desk.follow_power();
        if desk.link.words.fault().is_some() && !self.told.0 {
            self.told.0 = true;
            self.inner.fail(&mut desk, now);
        }
        if desk.link.words.shared.late_ticks() >= LATE_TICKS && !self.told.1 {
            self.told.1 = true;
            self.inner.tell(TICKS_ARE_LATE);
        }
        self.tell_underrun(alarmed);
        let due = if next.busy { Some(now) } else { next.when };
        self.due = due.filter(|_| self.link.words.shared.is_running());
        next
    }

    /// Says by how much polls come late, if motion has run out of segments. `alarmed`: that, or
    /// something else, was told before.
    fn tell_underrun(&mut self, alarmed: bool) {
        let underruns = self.link.words.shared.underruns();
        let before = core::mem::replace(&mut self.underruns, underruns);
        if alarmed || underruns == before {
            return;
        }
        let ms = self.lateness.ticks().div_ceil(1_000);
        if let Some((_, text)) = RAN_DRY.iter().find(|(most, _)| ms <= *most) {
            self.inner.tell(text);
        }
    }

    /// Returns whether a handler has woken the main loop since the last poll. Ask with interrupts
    /// masked, right before `wfi`: an interrupt that is pending still ends it.
    pub fn is_woken(&self) -> bool {
        self.link.words.bells.machine.is_rung()
    }

    /// Returns the part of the board that failed, if one did since power-up. Nothing moves any
    /// more.
    pub fn fault(&self) -> Option<Fault> {
        self.link.words.fault()
    }

    /// Returns how many ticks came late since power-up: more than a few mean that the step
    /// interrupt is kept waiting, or that the board is slower than `Config::with_steps_per_second`
    /// says.
    pub fn late_ticks(&self) -> u32 {
        self.link.words.shared.late_ticks()
    }

    /// Returns the most by which a poll has come late in motion since power-up: after the instant
    /// that the poll before it asked for, or after that poll began, if it asked for the next one at
    /// once. If it is 0.45 ms (2.8 ms with the feature `without-fpu`), motion runs dry: `ALARM:3`.
    pub fn lateness(&self) -> Duration {
        self.lateness
    }

    #[cfg(feature = "async")]
    pub(crate) fn bell(&self) -> &'a crate::bell::Bell {
        &self.link.words.bells.machine
    }
}

impl<'a, K, X, const AXES: usize, const MOTORS: usize> Deref for Machine<'a, K, AXES, MOTORS, X> {
    type Target = Inner<'a, K, AXES, MOTORS, X>;

    fn deref(&self) -> &Self::Target {
        &self.inner
    }
}

impl<K, X, const AXES: usize, const MOTORS: usize> DerefMut for Machine<'_, K, AXES, MOTORS, X> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.inner
    }
}

/// The board under the machine, for one poll.
struct Desk<'d, 'a, O, const MOTORS: usize> {
    link: &'d mut Link<'a, MOTORS>,
    outputs: &'d mut O,
}

impl<O: Actuators, const MOTORS: usize> Desk<'_, '_, O, MOTORS> {
    fn check<E>(&self, done: Result<(), E>) {
        if done.is_err() {
            self.link.words.fail(Fault::Output);
        }
    }

    /// Gives the outputs the power that motion has by now.
    fn follow_power(&mut self) {
        let power = self.link.words.power();
        if power != self.link.power {
            self.link.power = power;
            let put = self.outputs.set_power(power);
            self.check(put);
        }
    }
}

impl<O: Actuators, const MOTORS: usize> Board for Desk<'_, '_, O, MOTORS> {
    fn start_stepping(&mut self, now: Instant) -> Instant {
        self.outputs.pend_step_interrupt();
        now
    }

    fn write(&mut self, _: ChannelId, bytes: &[u8]) -> usize {
        let queued = bytes
            .iter()
            .map_while(|byte| self.link.wire.enqueue(*byte).ok());
        let count = queued.count();
        let bells = &self.link.words.bells;
        if count < bytes.len() {
            bells.wire_is_full.store(true, Ordering::Release);
        }
        if !bytes.is_empty() {
            bells.wire.ring();
        }
        count
    }

    fn switches(&self) -> Switches {
        self.link.words.levels()
    }

    fn enable_motors(&mut self, on: bool) {
        self.link.enabled = on;
        let put = self
            .outputs
            .enable_motors(on, on == self.link.enable_invert);
        self.check(put);
    }

    fn set_spindle(&mut self, output: SpindleOutput) {
        let put = self.outputs.set_spindle(output);
        self.check(put);
    }

    fn set_power(&mut self, power: Power) {
        self.link.words.order_power(power);
        self.outputs.pend_step_interrupt();
        self.follow_power();
    }

    fn set_coolant(&mut self, output: CoolantOutput) {
        let put = self.outputs.set_coolant(output);
        self.check(put);
    }

    fn configure(&mut self, port: &PortConfig) {
        self.link.words.order_wiring(port);
        self.outputs.pend_step_interrupt();
        self.link.enable_invert = port.enable_invert;
        self.enable_motors(self.link.enabled);
    }

    fn locked(&self) -> Option<&'static str> {
        self.link.words.fault().map(Fault::text)
    }
}
