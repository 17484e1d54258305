//! The machine: owns all parts of the main loop, and lends them to each other in [`Machine::poll`].

use crate::activity::door_cycle::DoorCycle;
use crate::activity::switch_cycle::SwitchCycle;
use crate::activity::Activity;
use crate::board::{Board, Duration, Instant};
use crate::config::{AxisKind, MachineConfig, MoveQueues, SegmentSender, CHANNELS};
use crate::console::Console;
pub use crate::console::LineFault;
use crate::derived::{planner_config, spindle_scale};
use crate::dual::{self, DualAxis};
use crate::extension::Extension;
use crate::guard::Guard;
use crate::inputs::Inputs;
use crate::interpreter::Coordinate;
use crate::motion::{Hunger, Motion};
use crate::overrides::Overrides;
use crate::program::Program;
use crate::protocol::alarm::Alarm;
use crate::protocol::serial::{Inbox, LINE};
use crate::settings::table::Setting;
use crate::settings::values::Settings;
use crate::state::{History, Lock, State};
use crate::switches::SwitchWatch;
use crate::tool::Tool;
use crate::unsaved::Store;
use crate::valid::ConfigError;
use crate::work::Work;
use heapless::Vec;
use leadscrew_planner::{Kinematics, PixelQueue};
use leadscrew_stepper::Shared;

/// The memory that a machine borrows: room for its moves, and the main loop's ends of all queues
/// and words that it shares with interrupts.
pub struct Links<
    'a,
    const AXES: usize,
    const MOTORS: usize,
    const MOVES: usize,
    const PIXELS: usize,
    const BLOCKS: usize,
> {
    /// The memory of planned moves. No interrupt uses them, but they are too large to be a part of
    /// the machine.
    pub moves: &'a mut MoveQueues<AXES, MOTORS, MOVES, BLOCKS>,
    /// The memory of the pixels of rows: [`crate::config::RowPixels`], or fewer; 1 on a machine
    /// without a laser.
    pub pixels: &'a mut PixelQueue<PIXELS>,
    /// Segments for the step interrupt, from a [`crate::config::SegmentQueue`].
    pub segments: SegmentSender<'a, MOTORS>,
    /// Words shared with the step interrupt.
    pub shared: &'a Shared<MOTORS>,
    /// Words shared with the switch interrupts.
    pub inputs: &'a Inputs<MOTORS>,
    /// Serial lines, in the order of their `ChannelId`s.
    pub inboxes: Vec<Inbox<'a>, CHANNELS>,
}

/// The time at which [`Machine::poll`] wants to be called again.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Next {
    /// At once: there is more to do.
    pub busy: bool,
    /// At this instant at the latest; `None`: no time needs a poll.
    ///
    /// In either case, and before this instant, also after each byte, each switch edge, and each
    /// step interrupt for which [`leadscrew_stepper::on_timer`] returns `true`. On a Cortex-M any
    /// interrupt ends `wfi`. A main loop that is an asynchronous task is woken by nobody but the
    /// handlers: each of the three has to signal it.
    pub when: Option<Instant>,
    /// `when` is for the extension's regular work only. No activity waits for it, except perhaps a
    /// line ([`Machine::line_goes_on`]).
    pub is_chore: bool,
}

/// The answer of [`Machine::turn`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Turn {
    /// When the machine wants the next turn.
    pub next: Next,
    /// When something besides motion is to be done, if nothing comes before; `None`: never.
    pub quiet_until: Option<Instant>,
}

/// A GRBL machine with `AXES` axes on `MOTORS` motors, and an extension.
pub struct Machine<'a, K, const AXES: usize, const MOTORS: usize, X = ()> {
    pub(crate) config: MachineConfig<AXES>,
    pub(crate) settings: Settings<AXES>,
    pub(crate) state: State,
    pub(crate) history: History,
    pub(crate) console: Console<'a>,
    pub(crate) program: Program<AXES>,
    pub(crate) activity: Activity<AXES>,
    pub(crate) motion: Motion<'a, K, AXES, MOTORS>,
    pub(crate) tool: Tool,
    pub(crate) guard: Guard,
    pub(crate) switches: SwitchWatch<'a, AXES, MOTORS>,
    pub(crate) overrides: Overrides,
    pub(crate) store: Store,
    pub(crate) work: Work,
    pub(crate) extension: X,
}

impl<'a, K, const AXES: usize, const MOTORS: usize> Machine<'a, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS> + Clone,
{
    /// Makes a machine that will boot at its first [`Machine::poll`].
    ///
    /// # Errors
    /// [`MachineConfig::validate`] refuses `config`, or nothing can be planned with it.
    pub fn new<const MOVES: usize, const PIXELS: usize, const BLOCKS: usize>(
        config: MachineConfig<AXES>,
        kinematics: K,
        links: Links<'a, AXES, MOTORS, MOVES, PIXELS, BLOCKS>,
    ) -> Result<Self, ConfigError> {
        Self::with_extension(config, kinematics, links, ())
    }
}

impl<'a, K, X, const AXES: usize, const MOTORS: usize> Machine<'a, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// As [`Machine::new`], with a firmware's extension.
    ///
    /// # Errors
    /// As [`Machine::new`].
    pub fn with_extension<const MOVES: usize, const PIXELS: usize, const BLOCKS: usize>(
        mut config: MachineConfig<AXES>,
        kinematics: K,
        links: Links<'a, AXES, MOTORS, MOVES, PIXELS, BLOCKS>,
        extension: X,
    ) -> Result<Self, ConfigError> {
        config.validate()?;
        config.moves = config.moves.min(MOVES);
        let count = AxisKind::count(&config.axes);
        let settings = Settings::of_axes(count, config.defaults);
        let planner = planner_config(&settings, &config, MOTORS);
        let dual = DualAxis::of(&kinematics);
        let absent = dual::absent(&kinematics, count);
        let motion = Motion::new(
            planner,
            kinematics,
            (links.moves, links.pixels),
            links.segments,
            links.shared,
        )?;
        Ok(Self {
            state: State::Idle,
            history: History::new(),
            console: Console::new(links.inboxes, config.line_length.min(LINE)),
            program: Program::new(),
            activity: Activity::new(),
            motion,
            tool: Tool::new(spindle_scale(&settings), settings.is_on(Setting::Laser)),
            guard: Guard::default(),
            switches: SwitchWatch::new(links.inputs, dual, absent),
            overrides: Overrides::NONE,
            store: Store::default(),
            work: Work::default(),
            extension,
            settings,
            config,
        })
    }

    /// Does a bounded amount of work: never waits; at most one line, a few segments, a few rows.
    ///
    /// Main loop. `now` never goes back.
    pub fn poll<B: Board>(&mut self, board: &mut B, now: Instant) -> Next {
        let extension = self.work_through(board, now);
        self.next(extension, now)
    }

    /// As [`Machine::poll`], for simulators that may call [`Machine::carry_on`] next.
    pub fn turn<B: Board>(&mut self, board: &mut B, now: Instant) -> Turn {
        let extension = self.work_through(board, now);
        Turn {
            next: self.next(extension, now),
            quiet_until: earlier(
                extension,
                earlier(self.deadline(Hunger::None), self.load_ends(true)),
            ),
        }
    }

    /// Does the work of [`Machine::poll`]; returns when the extension wants the next turn.
    fn work_through<B: Board>(&mut self, board: &mut B, now: Instant) -> Option<Instant> {
        self.work.polls = self.work.polls.wrapping_add(1);
        let segments = self.work.segments;
        if !self.history.booted {
            self.boot(board, now);
        }
        self.motion.look(now);
        self.take_requests(board, now);
        self.take_edges(board, now);
        if self.motion.is_short() {
            self.feed(board, now);
        }
        self.watch_motion(board, now);
        self.advance_homing(board, now);
        self.advance_door(board, now);
        self.end_spin_up(now);
        let extension = self.poll_extension(board, now);
        self.execute(board, now);
        self.report(board);
        self.list(board);
        self.console.flush(board, &mut self.work);
        self.take_line(board, now);
        self.watch_sender(board, now);
        // Realtime commands that have come meanwhile act on the segments that are made now.
        self.take_requests(board, now);
        self.feed(board, now);
        self.explain_segments(segments, board);
        self.console.flush(board, &mut self.work);
        extension
    }

    /// Does the part of [`Machine::poll`] that follows a segment which the step interrupt has
    /// taken, if nothing else is to be done; otherwise does nothing and returns `None`. A cruise that
    /// nothing can change any more becomes one segment.
    ///
    /// For simulators that ask for times only. The last turn was not busy, and since then no byte
    /// has come, no switch has moved, and [`Turn::quiet_until`] has not come.
    pub fn carry_on(&mut self, now: Instant) -> Option<Next> {
        let waits_for_room = || self.activity.line.moves_next() && self.motion.wants_more();
        let is_plain = self.state == State::Run
            && self.motion.goes_on()
            && !self.activity.line.is_running()
            && !waits_for_room();
        if !is_plain {
            return None;
        }
        self.work.polls = self.work.polls.wrapping_add(1);
        self.motion.look(now);
        if self.motion.carry_on(&mut self.work) {
            return Some(self.next(None, now));
        }
        let hunger = self.motion.hunger(now, true);
        let next = earlier(hunger.at(), self.motion.look_at(now));
        Some(Next {
            busy: hunger == Hunger::Now,
            is_chore: false,
            when: next.map(|instant| instant.max(now + SHORTEST_SLEEP)),
        })
    }

    /// Returns the state of the machine.
    pub fn state(&self) -> State {
        self.state
    }

    /// Returns the states that the machine has left, the last eight at most, the oldest first: for
    /// tests and for those who look for a fault.
    pub fn history(&self) -> impl Iterator<Item = State> + '_ {
        self.history.states()
    }

    /// Returns the position of the axes, counted from steps: machine position.
    pub fn position(&self) -> [Coordinate; AXES] {
        self.motion.position()
    }

    /// Returns the work zero: work coordinate system, G92 and tool length of the line that was
    /// taken last.
    pub fn work_offset(&self) -> [Coordinate; AXES] {
        self.program.work_offset
    }

    /// Returns the settings in force.
    pub fn settings(&self) -> &Settings<AXES> {
        &self.settings
    }

    /// Returns the overrides in force.
    pub fn overrides(&self) -> Overrides {
        self.overrides
    }

    /// Returns the speed on the path, mm/s; 0 at rest.
    pub fn speed(&self) -> f32 {
        self.motion.speed()
    }

    /// Returns the number of lines of the program since it began: since power-up, a reset, or the
    /// end of the program before.
    pub fn program_lines(&self) -> u32 {
        self.program.lines
    }

    /// Returns the time to finish the queued moves, s. Not for a controller: takes time in
    /// proportion to the queue.
    pub fn time_to_finish(&self) -> f32 {
        let mut left = self.motion.time_left();
        while self.motion.add_time(&mut left) {}
        left.seconds()
    }

    /// Returns the work since power-up.
    pub fn work(&self) -> &Work {
        &self.work
    }

    /// Takes the reason why the last line was refused; `None` if no line was refused since the last
    /// call. [`Machine::poll`] refuses one line at most.
    pub fn take_fault(&mut self) -> Option<LineFault> {
        self.console.last_fault.take()
    }

    /// Returns the last alarm since power-up.
    pub fn last_alarm(&self) -> Option<Alarm> {
        self.history.last_alarm
    }

    /// Returns true if nothing is under way: no motion, no line, no list, no output that waits.
    pub fn is_quiet(&self) -> bool {
        self.motion.is_idle()
            && !self.activity.line.is_busy()
            && !self.program.startup.is_running()
            && self.activity.switch_cycle.is_none()
            && self.activity.kept.is_none()
            && self.console.is_quiet()
    }

    /// Returns true if the machine performs a line that waits neither for the operator nor for a
    /// reset.
    pub fn line_goes_on(&self) -> bool {
        self.activity.line.is_busy() && self.state.takes_lines()
    }

    /// Returns the number of bytes of output that were lost since power-up because a line's other
    /// end had stopped reading.
    pub fn lost_output(&self) -> u32 {
        self.console.lost_output()
    }

    fn boot<B: Board>(&mut self, board: &mut B, now: Instant) {
        self.history.booted = true;
        // An input that is closed at power-up counts as a level, not as an edge: nothing was under
        // way.
        self.switches.edges = self.switches.inputs.edges();
        if self.motion.shared.is_stopped() {
            self.motion.stop();
        }
        self.apply_settings(board);
        board.set_coolant(self.tool.coolant.output());
        board.enable_motors(false);
        if self.settings.is_on(Setting::Homing) || self.store.lost {
            self.enter(State::Alarm(Lock::Unlockable));
        }
        self.greet(board, now);
    }

    /// Keeps the step interrupt supplied, and the drivers enabled while it runs. The power at rest,
    /// with all changes of this poll so far, is put out before motion begins.
    fn feed<B: Board>(&mut self, board: &mut B, now: Instant) {
        self.put_out_tool(board);
        if self.console.hears() {
            self.motion.put_off(now);
        }
        let may_start = self.state.may_start();
        if self.motion.prepare(now, may_start, &mut self.work) {
            self.motion.drivers.enable(board);
            self.tool.leave_rest();
            self.motion.start(board, now);
            if let Some(next) = self.state.motion_begins() {
                self.enter(next);
            }
        } else if self.motion.is_at_rest() {
            let (settings, locked) = (&self.settings, self.is_locked());
            let delay = || settings.whole(Setting::IdleDelay);
            self.motion.drivers.rest(delay, locked, board, now);
        }
    }

    /// Returns true if the motors are not needed in this state: their drivers go off, even if `$1`
    /// keeps them on.
    pub(crate) fn is_locked(&self) -> bool {
        match self.state {
            State::Alarm(_) => true,
            State::Sleep => self.activity.door.is_none(),
            State::Idle
            | State::Run
            | State::Jog(_)
            | State::Hold(_)
            | State::Home
            | State::Door(_)
            | State::Check => false,
        }
    }

    /// Returns when [`Machine::poll`] wants to be called again. `extension`: when the extension
    /// wants the next turn at the latest.
    fn next(&mut self, extension: Option<Instant>, now: Instant) -> Next {
        let hunger = self.motion.hunger(now, self.state.may_start());
        if hunger == Hunger::Now || self.is_busy() {
            return Next {
                busy: true,
                ..Next::default()
            };
        }
        let mut next = self.deadline(hunger);
        let is_chore = X::IN_USE && next.is_none();
        next = earlier(next, self.motion.look_at(now));
        if X::IN_USE {
            next = earlier(next, earlier(extension, self.load_ends(true)));
        }
        Next {
            busy: false,
            is_chore,
            when: next.map(|instant| instant.max(now + SHORTEST_SLEEP)),
        }
    }

    /// Returns when something is to be done that no interrupt will announce, besides the regular
    /// work of the extension.
    fn deadline(&self, hunger: Hunger) -> Option<Instant> {
        let delay = || self.settings.whole(Setting::IdleDelay);
        let deadlines = [
            self.motion.starts_at(),
            hunger.at(),
            self.activity.line.wakes(),
            self.load_ends(false),
            self.activity
                .switch_cycle
                .as_ref()
                .and_then(SwitchCycle::settles_at),
            self.activity.door.as_ref().and_then(DoorCycle::waits_until),
            self.spin_up_ends_at(),
            self.motion.drivers.rest_at(delay, self.is_locked()),
        ];
        deadlines.into_iter().fold(None, earlier)
    }

    /// Returns true if there is something to do, besides segments, that no interrupt will announce.
    fn is_busy(&mut self) -> bool {
        let takes_lines = self.can_take_line();
        let resting = self.motion.is_at_rest();
        self.console
            .is_busy(takes_lines && !self.program.startup.is_running())
            || takes_lines && self.program.startup.is_running()
            || takes_lines && self.activity.kept.is_some()
            || self.motion.is_renewing()
            || self
                .activity
                .line
                .can_advance(resting, || self.motion.wants_more())
                && self.state.takes_lines()
            || self
                .activity
                .door
                .as_ref()
                .is_some_and(DoorCycle::can_advance)
                && resting
            // A move of no length never begins: no interrupt announces its end.
            || self
                .activity
                .switch_cycle
                .as_ref()
                .is_some_and(|cycle| cycle.settles_at().is_none())
                && resting
    }
}

/// The earlier of two instants; `None` is later than any.
fn earlier(one: Option<Instant>, other: Option<Instant>) -> Option<Instant> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one.min(other)),
        (one, other) => one.or(other),
    }
}

/// If a deadline has passed, the machine asks for the next poll this long after now (1 µs). So
/// time goes on for a caller that sleeps from one deadline to the next.
const SHORTEST_SLEEP: Duration = Duration::from_ticks(1);
