//! `$` commands carried out.

use crate::activity::line::{LineKind, Origin};
use crate::board::{Board, ChannelId, Instant};
use crate::console::{Discard, Listing};
use crate::extension::{Call, Extension};
use crate::interpreter::{Command, Fault, OffsetId, Own};
use crate::lines::own_codes;
use crate::listing::LISTINGS;
use crate::machine::Machine;
use crate::protocol::message::Message;
use crate::protocol::report::HELP;
use crate::protocol::status::Status;
use crate::protocol::system_command::{Activity, Circumstances, Homing, Restore, SystemCommand};
use crate::settings::enumeration::Description;
use crate::settings::table::Setting;
use crate::settings::values::{Entry, Key};
use crate::soft_limits;
use crate::state::{Lock, State};
use crate::step_rate;
use leadscrew_gcode::Number;
use leadscrew_planner::{Coordinate, Kinematics};

/// The time at which a command's line is answered.
enum Reply {
    /// Now.
    Now,
    /// Once the change is stored.
    Stored,
    /// The command has answered, or will do so.
    Later,
}

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Carries out a line that begins with `$`. Main loop.
    pub(crate) fn system_line<B: Board>(
        &mut self,
        id: ChannelId,
        line: &[u8],
        board: &mut B,
        now: Instant,
    ) {
        if let Some(part) = line.strip_prefix(b"$B=").filter(|_| B::TAKES_RECORD) {
            return self.take_record(id, part, board);
        }
        if B::HAS_LOADER && line == b"$DFU" {
            return self.start_loader(id, board, now);
        }
        let result = match SystemCommand::parse(line, &self.circumstances()) {
            Ok(command) if command.needs_rest() && self.is_about_to_move() => {
                Err(Status::NotIdle.into())
            }
            Ok(command) => self
                .obey(id, command, board, now)
                .map_err(|fault| command.locate(fault, line)),
            Err(fault) => Err(fault),
        };
        match result {
            Ok(Reply::Now) => self.console.answer(id, Ok(())),
            Ok(Reply::Stored) => {
                self.activity.line.begin_storing(Origin::Channel(id), false);
                self.execute(board, now);
            }
            Ok(Reply::Later) => {}
            Err(fault) => self.refuse(Origin::Channel(id), fault),
        }
    }

    /// Returns true if nothing moves and nothing is asked to: the board itself may be changed.
    fn rests(&self) -> bool {
        match self.state {
            State::Idle | State::Alarm(_) => self.motion.is_idle(),
            State::Run
            | State::Jog(_)
            | State::Hold(_)
            | State::Home
            | State::Door(_)
            | State::Check
            | State::Sleep => false,
        }
    }

    /// `$DFU`: new firmware, if the board has a loader, at rest.
    fn start_loader<B: Board>(&mut self, id: ChannelId, board: &mut B, now: Instant) {
        if !self.rests() {
            return self.refuse(Origin::Channel(id), Status::NotIdle.into());
        }
        self.console
            .message(Message::Board("The loader waits for firmware"));
        self.console.answer(id, Ok(()));
        board.start_loader(now);
    }

    /// `$B=`: the board's description, if the board takes one, at rest.
    fn take_record<B: Board>(&mut self, id: ChannelId, part: &[u8], board: &mut B) {
        let (taken, message) = match self.rests() {
            true => board.take_record(part),
            false => (Err(Status::NotIdle), None),
        };
        if let Some(text) = message {
            self.console.message(Message::Board(text));
        }
        match taken {
            Ok(()) => self.console.answer(id, Ok(())),
            Err(status) => self.refuse(Origin::Channel(id), status.into()),
        }
    }

    pub(crate) fn circumstances(&self) -> Circumstances {
        Circumstances {
            activity: match self.state {
                State::Idle => Activity::Idle,
                State::Alarm(_) => Activity::Alarm,
                State::Jog(_) => Activity::Jog,
                State::Check => Activity::Check,
                State::Run | State::Hold(_) | State::Home | State::Door(_) | State::Sleep => {
                    Activity::Busy
                }
            },
            homing: self.settings.is_on(Setting::Homing),
            single_axis_homing: self.config.options.single_axis_homing,
        }
    }

    fn obey<B: Board>(
        &mut self,
        id: ChannelId,
        command: SystemCommand<'_>,
        board: &mut B,
        now: Instant,
    ) -> Result<Reply, Fault> {
        match command {
            SystemCommand::ShowAllSettings
            | SystemCommand::Enumerate(_)
            | SystemCommand::Describe(_)
                if !LISTINGS =>
            {
                return Err(Status::InvalidStatement.into());
            }
            SystemCommand::Help => self.console.line(id, HELP),
            SystemCommand::ShowSettings => return Ok(self.begin_list(id, Listing::Settings(0))),
            SystemCommand::ShowAllSettings => {
                return Ok(self.begin_list(id, Listing::AllSettings(0)))
            }
            SystemCommand::Enumerate(what) => {
                return Ok(self.begin_list(id, Listing::Enumeration(what, 0)))
            }
            SystemCommand::ShowSetting(number) => {
                let line = match self.own_row(number) {
                    Some(row) => self.own_line(row),
                    None => self.settings.line(self.key(number)?),
                };
                self.console.line(id, line);
            }
            SystemCommand::Describe(number) => {
                let description = match self.own_row(number) {
                    Some(row) => Description {
                        number,
                        text: row.description,
                    },
                    None => self.key(number)?.into(),
                };
                self.console.line(id, description);
            }
            SystemCommand::ShowParameters => return Ok(self.begin_list(id, Listing::Parameters(0))),
            SystemCommand::ShowModes => self.console.line(id, self.modes()),
            SystemCommand::ShowBuild => return Ok(self.begin_list(id, Listing::Version)),
            SystemCommand::ShowStartup => return Ok(self.begin_list(id, Listing::Startup(0))),
            SystemCommand::StoreBuild(text) => {
                self.store.memory.set_build(text);
                self.store.unsaved.add_build::<AXES>();
                return Ok(Reply::Stored);
            }
            SystemCommand::StoreStartup { index, line } => return self.store_startup(index, line),
            SystemCommand::Check => return Ok(self.toggle_check(id, board, now)),
            SystemCommand::Unlock => self.unlock(board)?,
            SystemCommand::Home(homing) => return Ok(self.home(id, homing, board, now)?),
            SystemCommand::Jog(line) => return self.jog(id, line, board, now),
            SystemCommand::Sleep => return Ok(self.sleep(id, board, now)),
            SystemCommand::Restore(what) => return Ok(self.restore_defaults(id, what, board, now)),
            SystemCommand::Set { number, value } => return Ok(self.set(number, value, board)?),
        }
        Ok(Reply::Now)
    }

    fn begin_list(&mut self, id: ChannelId, listing: Listing) -> Reply {
        if let Some(channel) = self.console.channel(id) {
            channel.listing = Some(listing);
        }
        Reply::Later
    }

    /// Checks the line in the present modal state and keeps it, without carrying it out.
    fn store_startup(&mut self, index: u8, line: &[u8]) -> Result<Reply, Fault> {
        if !line.is_empty() {
            let find = |number| self.extension.m_code(number);
            let check = |call: &Call| self.extension.check(call);
            let own = Own::new(&find, &check);
            let own = own_codes::<X, AXES>(&own);
            let context = self.config.context(&self.settings, &self.motion.reach, own);
            self.program.interpreter.check(line, &context)?;
        }
        self.store.memory.set_startup(index, line);
        self.store.unsaved.add_startup::<AXES>(index);
        Ok(Reply::Stored)
    }

    /// `$C`: leaving check mode resets the machine.
    fn toggle_check<B: Board>(&mut self, id: ChannelId, board: &mut B, now: Instant) -> Reply {
        if self.state != State::Check {
            // Moves that have not begun are dropped.
            self.motion.forget();
            self.enter(State::Check);
            self.console.message(Message::CheckEnabled);
            return Reply::Now;
        }
        self.console.message(Message::CheckDisabled);
        self.console.answer(id, Ok(()));
        self.restart(Discard::Nothing, board, now);
        Reply::Later
    }

    fn unlock<B: Board>(&mut self, board: &B) -> Result<(), Status> {
        let State::Alarm(Lock::Unlockable) = self.state else {
            return Ok(());
        };
        self.allow_leaving(board)?;
        self.store.lost = false;
        self.enter(State::Idle);
        self.console.message(Message::Unlocked);
        Ok(())
    }

    fn home<B: Board>(
        &mut self,
        id: ChannelId,
        homing: Homing,
        board: &B,
        now: Instant,
    ) -> Result<Reply, Status> {
        self.allow_leaving(board)?;
        if self.store.lost {
            // Which way an axis homes, and how its switches are wired, may be lost, too.
            self.say_lost(Some(id));
            return Err(Status::Locked);
        }
        let groups = match homing {
            Homing::All => self.config.homing_cycles,
            Homing::Axis(axis) => [1u8.checked_shl(u32::from(axis)).unwrap_or(0), 0, 0, 0],
        };
        self.begin_homing(Origin::Channel(id), groups, now);
        Ok(Reply::Later)
    }

    fn jog<B: Board>(
        &mut self,
        id: ChannelId,
        line: &[u8],
        board: &mut B,
        now: Instant,
    ) -> Result<Reply, Fault> {
        let find = |number| self.extension.m_code(number);
        let check = |call: &Call| self.extension.check(call);
        let own = Own::new(&find, &check);
        let own = own_codes::<X, AXES>(&own);
        let context = self.config.context(&self.settings, &self.motion.reach, own);
        let Some(mut jog) = self.program.interpreter.jog(line, &context)? else {
            return Ok(Reply::Now);
        };
        if !self.is_within_travel(&jog.travel.target) {
            if !self.settings.is_on(Setting::JogsEnd) {
                return Err(Status::JogOutOfTravel.into());
            }
            let from = self.program.interpreter.position();
            let (ends, axes) = (&self.motion.bounds, &self.config.axes);
            soft_limits::clip(&mut jog.travel.target, from, ends, axes);
        }
        let target = jog.travel.target;
        let channel = self.console.channel(id);
        if channel.is_some_and(|channel| channel.is_jog_cancelled()) {
            return Ok(Reply::Now);
        }
        self.bound_jog(&mut jog, board)?;
        self.program.interpreter.set_position(target);
        let commands = self.activity.line.commands();
        commands.clear();
        // The first of an empty list always fits.
        let _ = commands.push(Command::Line(jog.travel));
        self.activity.line.begin(Origin::Channel(id), LineKind::Jog);
        self.execute(board, now);
        Ok(Reply::Later)
    }

    /// `$SLP`: answered first, as Grbl does. From Alarm it does not park: the position may be
    /// wrong.
    fn sleep<B: Board>(&mut self, id: ChannelId, board: &mut B, now: Instant) -> Reply {
        self.console.answer(id, Ok(()));
        let parks = self.state == State::Idle && self.parks();
        self.enter(State::Sleep);
        if parks {
            self.begin_retracting(now);
        } else {
            self.fall_asleep(board);
        }
        Reply::Later
    }

    /// The end of `$SLP`, at rest.
    pub(crate) fn fall_asleep<B: Board>(&mut self, board: &mut B) {
        self.switch_outputs_off(board);
        self.console.message(Message::Sleeping);
    }

    fn restore_defaults<B: Board>(
        &mut self,
        id: ChannelId,
        what: Restore,
        board: &mut B,
        now: Instant,
    ) -> Reply {
        if matches!(what, Restore::Settings | Restore::All) {
            self.settings.restore_defaults();
            self.restore_own();
            self.apply_settings(board);
        }
        if matches!(what, Restore::Parameters | Restore::All) {
            for offset in OffsetId::ALL {
                let zero = [Coordinate::ZERO; AXES];
                self.program.interpreter.load_offset(offset, zero);
            }
        }
        if what == Restore::All {
            self.store.memory.clear();
        }
        self.store.unsaved.restore::<AXES>(what);
        self.console.message(Message::RestoringDefaults);
        self.activity.line.begin_storing(Origin::Channel(id), true);
        self.execute(board, now);
        Reply::Later
    }

    fn set<B: Board>(
        &mut self,
        number: u16,
        value: Number,
        board: &mut B,
    ) -> Result<Reply, Status> {
        let entry = Entry { number, value };
        if let Some(row) = self.own_row(number) {
            return self.set_own(row, value).map(|()| Reply::Stored);
        }
        let limits = self.config.step_timing.limits(MOTORS);
        let changes = self.settings.set(entry, limits);
        self.say_capped(number, changes.as_ref().err());
        let changes = changes?;
        for change in changes {
            self.store.unsaved.add_setting::<AXES>(change.number);
        }
        let scales = [Setting::MaxSpeed, Setting::MinSpeed];
        if scales.iter().any(|scale| scale.row().number == number) {
            self.tool.spindle.stand(self.reported_speed());
        }
        self.apply_settings(board);
        if number == Setting::Inches.row().number {
            self.console.cadence.work_offset_changed();
        }
        Ok(Reply::Stored)
    }

    /// Says which values would work if settings together ask for more than can be made, if the
    /// operator has asked for texts.
    fn say_capped(&mut self, number: u16, refused: Option<&Status>) {
        let key = self.settings.key(number);
        let key = key.filter(|_| self.settings.is_on(Setting::FaultTexts));
        let Some(key) = key else { return };
        let timing = &self.config.step_timing;
        match refused {
            None => step_rate::capped_by(&self.settings, timing, MOTORS, key)
                .for_each(|capped| self.console.message(Message::Capped(capped))),
            Some(Status::StepRateTooHigh) => {
                let instead = step_rate::instead(&self.settings, timing, MOTORS, key);
                if let Some(instead) = instead {
                    self.console.message(Message::Capped(instead));
                }
            }
            Some(_) => {}
        }
    }

    /// The setting with this number.
    fn key(&self, number: u16) -> Result<Key, Fault> {
        self.settings.key(number).ok_or(Fault {
            status: Status::InvalidStatement,
            column: 1,
        })
    }

    /// Checks that nothing keeps the machine locked: neither the board itself, nor the reset input,
    /// nor the door.
    fn allow_leaving<B: Board>(&mut self, board: &B) -> Result<(), Status> {
        if let Some(why) = board.locked() {
            self.console.message(Message::Board(why));
            return Err(Status::Locked);
        }
        let active = self.switches.inputs.active(&board.switches());
        if active.reset {
            self.console.message(Message::ResetHeld);
            return Err(Status::Locked);
        }
        if active.door {
            return Err(Status::DoorOpen);
        }
        Ok(())
    }

    /// Returns true if there is a door, and it is open now.
    pub(crate) fn is_door_open<B: Board>(&self, board: &B) -> bool {
        self.switches.inputs.active(&board.switches()).door
    }
}
