//! `$` lines, and the states of the machine into which they lead.

use super::{mm, refused, Checker, Finding, LineFaultKind};
use crate::machine::{instead, TIMING};
use leadscrew_machine::extension::{Call, Extension};
use leadscrew_machine::interpreter::{
    Context, Fault as LineFault, Interpreter, OffsetId, Own as Codes, OwnCodes,
};
use leadscrew_machine::protocol::status::Status;
use leadscrew_machine::protocol::system_command::{
    Activity, Circumstances, Homing, Restore, SystemCommand,
};
use leadscrew_machine::settings::table::Setting;
use leadscrew_machine::settings::values::{checked, Entry};
use leadscrew_machine::{home, soft_limits};
use leadscrew_planner::Coordinate;
use leadscrew_sim::scene::StrokeKind;

/// The state of the machine, as far as a program can tell.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum State<const AXES: usize> {
    /// It moves, or is ready to.
    Idle,
    /// It has begun a jog, which may go on.
    Jog,
    /// `$C`: lines are checked, and nothing moves from this place.
    Check([Coordinate; AXES]),
    /// `$SLP`: no line is answered.
    Sleep,
}

impl<const AXES: usize> Checker<AXES> {
    /// Refuses the first line after `$SLP`. The lines after it are checked as if it had not slept.
    pub(super) fn wake(&mut self) -> Finding {
        if self.state != State::Sleep {
            return Ok(());
        }
        self.state = State::Idle;
        Err((LineFaultKind::Unanswered, None))
    }

    /// A line of G-code comes: a jog may still go on, and then it is refused.
    pub(super) fn end_jog(&mut self) {
        if self.state == State::Jog {
            self.last.in_motion = true;
            self.state = State::Idle;
        }
    }

    /// Returns true if nothing moves, whatever the program says.
    pub(super) fn is_checking(&self) -> bool {
        matches!(self.state, State::Check(_))
    }

    pub(super) fn check_system(&mut self, line: &[u8]) -> Finding {
        let activity = match self.state {
            State::Idle | State::Jog | State::Sleep => Activity::Idle,
            State::Check(_) => Activity::Check,
        };
        let command = self.parse(line, activity).map_err(refused)?;
        self.last.in_motion = self.moves && self.needs_rest(&command, line);
        self.obey(&command).map_err(|(kind, detail)| match kind {
            LineFaultKind::Refused(fault) => {
                (LineFaultKind::Refused(command.locate(fault, line)), detail)
            }
            other => (other, detail),
        })
    }

    fn parse<'a>(
        &self,
        line: &'a [u8],
        activity: Activity,
    ) -> Result<SystemCommand<'a>, LineFault> {
        let now = Circumstances {
            activity,
            homing: self.settings.is_on(Setting::Homing),
            single_axis_homing: self.config.options.single_axis_homing,
        };
        SystemCommand::parse(line, &now)
    }

    /// Returns true if the machine refuses the command in motion. A setting does not count here,
    /// because it has a remark of its own.
    fn needs_rest(&self, command: &SystemCommand<'_>, line: &[u8]) -> bool {
        match command {
            SystemCommand::Set { .. } => false,
            SystemCommand::Jog(_) => self.state != State::Jog,
            other => other.needs_rest() || self.parse(line, Activity::Busy).is_err(),
        }
    }

    fn obey(&mut self, command: &SystemCommand<'_>) -> Finding {
        match *command {
            SystemCommand::Jog(line) => return self.jog(line),
            SystemCommand::Set { number, value } => return self.set(Entry { number, value }),
            SystemCommand::StoreStartup { line, .. } => return self.check_startup(line),
            SystemCommand::ShowSetting(number) | SystemCommand::Describe(number) => {
                return self.find_setting(number)
            }
            SystemCommand::Home(homing) => self.home(homing),
            SystemCommand::Check => self.toggle_check(),
            SystemCommand::Sleep => self.state = State::Sleep,
            SystemCommand::Restore(values) => self.restore(values),
            SystemCommand::Help
            | SystemCommand::ShowSettings
            | SystemCommand::ShowAllSettings
            | SystemCommand::Enumerate(_)
            | SystemCommand::ShowParameters
            | SystemCommand::ShowModes
            | SystemCommand::ShowBuild
            | SystemCommand::StoreBuild(_)
            | SystemCommand::ShowStartup
            | SystemCommand::Unlock => {}
        }
        Ok(())
    }

    fn jog(&mut self, line: &[u8]) -> Finding {
        let jog = self.with_context(|interpreter, context| interpreter.jog(line, context));
        let Some(jog) = jog.map_err(refused)? else {
            return Ok(());
        };
        let mut target = jog.travel.target;
        if self.settings.is_on(Setting::SoftLimits) && self.settings.is_on(Setting::JogsEnd) {
            let (ends, from) = (self.measures.ends, self.interpreter.position());
            soft_limits::clip(&mut target, from, &ends, &self.config.axes);
        }
        let refuses = self.settings.is_on(Setting::SoftLimits);
        let outside = |(kind, detail)| match refuses {
            true => (
                LineFaultKind::Refused(Status::JogOutOfTravel.into()),
                detail,
            ),
            false => (kind, detail),
        };
        self.check_travel(&target).map_err(outside)?;
        self.check_frame(&target)?;
        if target != *self.interpreter.position() {
            (self.state, self.moves) = (State::Jog, true);
        }
        self.draw_to(&target, StrokeKind::Travel);
        self.interpreter.set_position(target);
        if let Some(standing) = &mut self.standing {
            standing.jog(self.number, line, &self.letters, &self.interpreter);
        }
        Ok(())
    }

    fn set(&mut self, entry: Entry) -> Finding {
        let own = self.own.settings().find(|row| row.number == entry.number);
        if let Some(row) = own {
            let value = checked(row.kind, entry.value);
            let done = value.and_then(|value| self.own.set(entry.number, value));
            return done.map_err(|status| refused(status.into()));
        }
        let laser = self.settings.is_on(Setting::Laser);
        let Err(status) = self.settings.set(entry, TIMING.limits(self.motors)) else {
            self.learn_settings();
            if self.settings.is_on(Setting::Laser) != laser {
                // Laser and spindle are different tools: the new one has not been switched on.
                self.interpreter.stop_spindle();
            }
            return Ok(());
        };
        let words = || {
            instead(&self.settings, self.motors, entry.number)
                .trim()
                .to_owned()
        };
        let detail = (status == Status::StepRateTooHigh).then(words);
        Err((LineFaultKind::Refused(status.into()), detail))
    }

    /// Checks a line that the machine is to run after each start.
    fn check_startup(&self, line: &[u8]) -> Finding {
        if line.is_empty() {
            return Ok(());
        }
        let checked = self.with_context(|interpreter, context| interpreter.check(line, context));
        checked.map_err(refused)
    }

    fn find_setting(&self, number: u16) -> Finding {
        let is_own = self.own.settings().any(|row| row.number == number);
        if is_own || self.settings.key(number).is_some() {
            return Ok(());
        }
        let status = Status::InvalidStatement;
        Err(refused(LineFault { status, column: 1 }))
    }

    /// Enters check mode, or leaves it: the machine starts anew where it was.
    fn toggle_check(&mut self) {
        let place = *self.interpreter.position();
        match self.state {
            State::Check(place) => self.restart(place),
            State::Idle | State::Jog | State::Sleep => {
                (self.state, self.moves) = (State::Check(place), false);
            }
        }
    }

    fn restore(&mut self, values: Restore) {
        if matches!(values, Restore::Settings | Restore::All) {
            self.settings.restore_defaults();
            self.learn_settings();
            let rows: Vec<_> = self.own.settings().collect();
            for row in rows {
                // As on the machine, if an extension refuses its default, its value stays.
                let _refused = self.own.set(row.number, row.default);
            }
        }
        if matches!(values, Restore::Parameters | Restore::All) {
            for offset in OffsetId::ALL {
                self.interpreter
                    .load_offset(offset, [Coordinate::ZERO; AXES]);
            }
        }
        self.restart(*self.interpreter.position());
    }

    /// The machine starts anew at `place`.
    fn restart(&mut self, place: [Coordinate; AXES]) {
        self.interpreter.reset();
        self.interpreter.set_position(place);
        (self.state, self.moves) = (State::Idle, false);
    }

    /// The machine homes axes; the program continues from there.
    fn home(&mut self, homing: Homing) {
        let cycles = self.config.homing_cycles.iter();
        let mask = match homing {
            Homing::All => cycles.fold(0, |all, cycle| all | cycle),
            Homing::Axis(axis) => 1 << axis,
        };
        let ends = self.measures.ends;
        let negative = self.settings.mask(Setting::HomingDirection);
        let mut position = *self.interpreter.position();
        for (axis, place) in position.iter_mut().enumerate() {
            if mask >> axis & 1 == 1 {
                let pull_off = home::pull_off(&self.settings, axis);
                let is_negative = negative >> axis & 1 == 1;
                *place = ends[axis].place(pull_off, is_negative);
            }
        }
        self.interpreter.set_position(position);
        self.path.resume_at(mm(&position));
        self.moves = false;
        self.homed |= mask;
        self.home_carriages(mask);
        if let Some(standing) = &mut self.standing {
            standing.home(mask);
        }
    }

    /// Calls `check` with the interpreter and the context of its lines.
    fn with_context<T>(
        &self,
        check: impl FnOnce(&Interpreter<AXES>, &Context<'_, AXES>) -> T,
    ) -> T {
        let find = |code| self.own.m_code(code);
        let call = |call: &Call| self.own.check(call);
        let own = Codes::new(&find, &call);
        let own = OwnCodes::some(&own);
        let context = self
            .config
            .context(&self.settings, &self.measures.reach, own);
        check(&self.interpreter, &context)
    }
}
