//! Lines: taken one at a time, wherever they come from, and handed to the interpreter or to `$`
//! commands. The job belongs to the channel that sent the last line of G-code.

use crate::activity::line::{LineKind, Origin};
use crate::board::{Board, ChannelId, Instant};
use crate::extension::{Call, Extension, Known, Line};
use crate::interpreter::{
    Command, Context, Coordinate, Extent, Fault, Own, OwnCodes, Spindle, ToolTable, Travel,
};
use crate::machine::{LineFault, Machine};
use crate::program::startup::Turn;
use crate::program::Probed;
use crate::protocol::decimal::Decimal;
use crate::protocol::message::Message;
use crate::protocol::status::Status;
use crate::protocol::system_command::{SystemCommand, STARTUP_LINES};
use crate::settings::table::Setting;
use crate::state::State;
use leadscrew_gcode::Number;
use leadscrew_planner::Kinematics;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Takes the next line, if the machine can carry one out now. Main loop.
    pub(crate) fn take_line<B: Board>(&mut self, board: &mut B, now: Instant) {
        if !self.can_take_line() {
            return;
        }
        if self.program.startup.is_running() {
            return self.advance_startup(board, now);
        }
        if let Some(id) = self.console.take_closed() {
            return self.end_job_of(id, board, now);
        }
        self.read_kept();
        let has_job = self.state != State::Idle || self.is_about_to_move();
        let owner = self.program.owner.filter(|_| has_job);
        let Some(id) = self.console.read(owner, &mut self.work) else {
            return;
        };
        // The line is filled in its place: moving it would take as long as parsing it.
        let mut line = Line::new();
        let Some(channel) = self.console.channel(id) else {
            return;
        };
        let read = channel.line().map(|text| line.extend_from_slice(text));
        let is_system = read.is_ok() && line.first() == Some(&b'$');
        let may_wait = is_system && owner.is_none_or(|owner| owner == id);
        self.program.line_waits = may_wait && self.awaits_motion(&line);
        if self.program.line_waits {
            return self.motion.release();
        }
        self.console.take(id);
        self.work.lines = self.work.lines.wrapping_add(1);
        self.program.lines = self.program.lines.wrapping_add(u32::from(!is_system));
        match read {
            Err(status) => self.refuse(Origin::Channel(id), status.into()),
            // The line fits: `Line` has as much room as the channel's reader.
            Ok(_) => self.begin_line(id, &line, board, now),
        }
    }

    /// Returns true if a line would be carried out at once.
    pub(crate) fn can_take_line(&self) -> bool {
        let rests = || self.state != State::Run && self.motion.is_idle();
        !self.activity.line.is_busy()
            && self.state.takes_lines()
            && !self.motion.is_stopping()
            && (!self.program.line_waits || rests())
    }

    /// Returns true if a `$` line changes a setting behind moves that have not begun: then it is
    /// carried out after them. One of another line than the job's is refused, as it is a moment
    /// later: while it waited, the job's lines would, and motion would stop in mid-job.
    fn awaits_motion(&self, line: &[u8]) -> bool {
        let command = || SystemCommand::parse(line, &self.circumstances());
        self.is_about_to_move() && matches!(command(), Ok(SystemCommand::Set { .. }))
    }

    /// Returns true if moves are planned that have not begun.
    pub(crate) fn is_about_to_move(&self) -> bool {
        self.state == State::Idle && !self.motion.is_idle()
    }

    fn begin_line<B: Board>(&mut self, id: ChannelId, line: &[u8], board: &mut B, now: Instant) {
        if let Err(status) = self.admit(line) {
            return self.refuse(Origin::Channel(id), status.into());
        }
        match line.first() {
            None => self.console.answer(id, Ok(())),
            Some(b'$') => self.system_line(id, line, board, now),
            Some(_) => {
                self.guard.fed = true;
                if !self.is_aside() {
                    self.take_over(id, board);
                }
                self.begin_program_line(Origin::Channel(id), line, board, now);
            }
        }
    }

    fn begin_program_line<B: Board>(
        &mut self,
        origin: Origin,
        line: &[u8],
        board: &mut B,
        now: Instant,
    ) {
        if let State::Alarm(_) | State::Jog(_) = self.state {
            if let Origin::Channel(id) = origin {
                self.say_lost(Some(id));
            }
            return self.refuse(origin, Status::Locked.into());
        }
        if self.state == State::Idle && self.is_at_limit(board) {
            self.console.message(Message::CheckLimits);
            return self.refuse(origin, Status::Locked.into());
        }
        match self.interpret(line, false) {
            Ok(extent) => self.begin_words(origin, line, extent, board, now),
            Err(fault) if X::IN_USE && fault.status == Status::Calculates => {
                self.calculate(origin, line, fault, board, now);
            }
            Err(fault) => self.refuse(origin, fault),
        }
    }

    /// Begins to carry out a line that was interpreted.
    fn begin_words<B: Board>(
        &mut self,
        origin: Origin,
        line: &[u8],
        extent: Extent,
        board: &mut B,
        now: Instant,
    ) {
        self.activity.line.begin(origin, LineKind::Program);
        if extent == Extent::First {
            self.activity.rest = Line::from_slice(line).unwrap_or_default();
            self.activity.line.set_rest(true);
        }
        self.execute(board, now);
    }

    /// Lets an extension write out a line that has parameters or expressions, and carries it out;
    /// refuses it with `fault` if no extension calculates.
    #[cold]
    fn calculate<B: Board>(
        &mut self,
        origin: Origin,
        line: &[u8],
        fault: Fault,
        board: &mut B,
        now: Instant,
    ) {
        let mut plain = Line::new();
        let probed = self.program.probed;
        let known = Known {
            interpreter: &self.program.interpreter,
            axes: &self.config.axes,
            probed: (probed != Probed::NOTHING).then_some(probed.position),
            contact: probed.contact,
            tool: None,
        };
        let written = self.extension.calculate(line, &known, &mut plain);
        let extent = written.unwrap_or(Err(fault)).and_then(|()| {
            let has_words = !plain.is_empty();
            let interpreted = has_words.then(|| self.interpret(&plain, false));
            // Its column is one of the line as it was written out.
            interpreted.transpose().map_err(|fault| fault.status.into())
        });
        match extent {
            Ok(extent) => {
                self.extension.calculated();
                match extent {
                    Some(extent) => self.begin_words(origin, &plain, extent, board, now),
                    None => self.answer(origin, Ok(())),
                }
            }
            Err(fault) => self.refuse(origin, fault),
        }
    }

    /// Goes on with the line under way after the M code that came first; returns whether the rest
    /// was sound. A fault is answered, and no line is under way any more.
    pub(crate) fn begin_rest(&mut self) -> bool {
        self.activity.line.set_rest(false);
        let line = core::mem::take(&mut self.activity.rest);
        match self.interpret(&line, true) {
            Ok(_) => {
                self.activity.line.start_commands();
                true
            }
            Err(fault) => {
                if let Some(origin) = self.activity.line.finish() {
                    self.refuse(origin, fault);
                }
                false
            }
        }
    }

    /// Puts the commands of a line into the executor; with `rest` those after the M code that comes
    /// first.
    fn interpret(&mut self, line: &[u8], rest: bool) -> Result<Extent, Fault> {
        let find = |number| self.extension.m_code(number);
        let check = |call: &Call| self.extension.check(call);
        let own = Own::new(&find, &check);
        let own = own_codes::<X, AXES>(&own);
        let length = |tool| self.extension.tool_length(tool);
        let context = Context {
            tools: tool_table::<X, AXES>(&length),
            ..self.config.context(&self.settings, &self.motion.reach, own)
        };
        let commands = self.activity.line.commands();
        let interpreter = &mut self.program.interpreter;
        match rest {
            true => interpreter
                .interpret_rest(line, &context, commands)
                .map(|()| Extent::Whole),
            false => interpreter.interpret(line, &context, commands),
        }
    }

    /// Returns true if a line of G-code, sound or not, is one of those that the operator may send
    /// while an M code is put aside.
    pub(crate) fn serves_operator(&self, line: &[u8]) -> bool {
        let find = |number| self.extension.m_code(number);
        let check = |call: &Call| self.extension.check(call);
        let own = Own::new(&find, &check);
        let own = own_codes::<X, AXES>(&own);
        let context = self.config.context(&self.settings, &self.motion.reach, own);
        self.program.interpreter.serves_operator(line, &context)
    }

    /// Answers a line on its channel; a startup line on all.
    pub(crate) fn answer(&mut self, origin: Origin, result: Result<(), Status>) {
        match origin {
            Origin::Channel(id) => self.console.answer(id, result),
            Origin::Startup(line) => self.answer_startup(line, result),
            Origin::Nobody => {}
        }
    }

    /// Answers a line with an error. Its text is sent, too, if a setting asks for texts, and for
    /// an extension's error, whose number no sender knows.
    pub(crate) fn refuse(&mut self, origin: Origin, fault: Fault) {
        if let Origin::Channel(channel) = origin {
            self.console.last_fault = Some(LineFault {
                channel,
                status: fault.status,
                column: fault.column,
            });
        }
        let unknown = X::IN_USE && matches!(fault.status, Status::Own(_));
        let apart = self.program.interpreter.take_mismatch();
        if unknown || self.settings.is_on(Setting::FaultTexts) {
            let text = self.error_text(fault.status);
            match apart {
                None => self.console.say(format_args!("[MSG:{text}]")),
                Some(apart) => {
                    let apart = Decimal::millimetres(Number::from_nanos(apart.nanos()));
                    let args = format_args!("[MSG:{text}: radii of the arc differ by {apart} mm]");
                    self.console.say(args);
                }
            }
        }
        self.answer(origin, Err(fault.status));
    }

    fn advance_startup<B: Board>(&mut self, board: &mut B, now: Instant) {
        match self.program.startup.advance(STARTUP_LINES) {
            Turn::Nothing => {}
            Turn::Answer(origin) => self.answer(origin, Ok(())),
            Turn::Run(index) => {
                let line = Line::from_slice(self.store.memory.startup(index)).unwrap_or_default();
                if !line.is_empty() {
                    self.begin_program_line(Origin::Startup(index), &line, board, now);
                }
            }
        }
    }

    /// Answers a startup line (`>G20:ok`) on all channels: no channel has sent it.
    pub(crate) fn answer_startup(&mut self, index: u8, result: Result<(), Status>) {
        let line = core::str::from_utf8(self.store.memory.startup(index)).unwrap_or_default();
        match result {
            Ok(()) => self.console.broadcast(format_args!(">{line}:ok")),
            Err(status) => self
                .console
                .broadcast(format_args!(">{line}:error:{}", status.number())),
        }
    }
}

/// The laser and its sender: the laser goes off when its sender falls silent, goes away, or another
/// sender takes over.
///
/// The sender is the serial line that sent the last line of G-code. A laser lit by a startup line
/// belongs to every sender.
impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// The spindle's state for a motion. Once the sender has been silent for too long, a laser
    /// stays dark, until a cut of a program lights it up again.
    pub(crate) fn light_of(&mut self, travel: &Travel<AXES>, kind: LineKind) -> Spindle {
        if kind == LineKind::Program && travel.spindle.cutting {
            self.guard.is_dark = false;
        }
        self.light_at_rest(&travel.spindle)
    }

    /// As [`Machine::light_of`], for a line that moves nothing.
    pub(crate) fn light_at_rest(&self, spindle: &Spindle) -> Spindle {
        Spindle {
            cutting: spindle.cutting && !self.guard.is_dark,
            ..*spindle
        }
    }

    /// Ends the job of `id`, whose other end has gone away: M5 after its last line, if its job
    /// used a laser.
    fn end_job_of<B: Board>(&mut self, id: ChannelId, board: &mut B, now: Instant) {
        if self.program.owner != Some(id) {
            return;
        }
        self.program.owner = None;
        self.guard.is_gone = true;
        if self.tool.spindle.is_laser() && self.tool.spindle.is_wanted() {
            self.program.interpreter.stop_spindle();
            let commands = self.activity.line.commands();
            commands.clear();
            // The first of an empty list always fits.
            let _ = commands.push(Command::Spindle(Spindle::default()));
            self.activity.line.begin(Origin::Nobody, LineKind::Program);
            self.execute(board, now);
        }
    }
}

/// The tool table of an extension, if there is one.
fn tool_table<'a, X: Extension<AXES>, const AXES: usize>(
    length: &'a dyn Fn(Option<u32>) -> Option<Coordinate>,
) -> ToolTable<'a> {
    match X::IN_USE {
        true => ToolTable::some(length),
        false => ToolTable::NONE,
    }
}

/// The M codes of an extension, if there is one.
pub(crate) fn own_codes<'a, X: Extension<AXES>, const AXES: usize>(
    own: &'a Own<'a>,
) -> OwnCodes<'a> {
    match X::IN_USE {
        true => OwnCodes::some(own),
        false => OwnCodes::NONE,
    }
}
