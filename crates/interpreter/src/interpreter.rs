//! The interpreter reads a line, checks it, and commits it.
//!
//! To commit a checked line is to carry it out: state, offsets and position change, and commands
//! come out. A commit cannot fail.

use super::check::{Check, Effect, Path, Plan, Purpose};
use super::code::{Group, Groups};
use super::command::{Command, Commands, Feed, OffsetId, Spindle, Travel};
use super::context::Context;
use super::cycle::holes::Cycle;
use super::cycle::series::Series;
use super::fault::Fault;
use super::modal_state::{FeedMode, ModalState, Motion, OverrideControl, Rotation, Units};
use super::setup::Interpreter;
use super::takers::Flow;
use super::units::millimetres_to_inches;
use super::words::{Block, RARE};
use crate::Status;
use leadscrew_gcode::Number;
use leadscrew_planner::Coordinate;

/// The part of a line for which commands stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// All of it.
    Whole,
    /// The M code of an extension that comes first ([`MCode::first`](crate::own::MCode::first)).
    First,
}

impl<const AXES: usize> Interpreter<AXES> {
    /// Reads a line, checks all of it, and carries it out: replaces `commands` by its commands.
    ///
    /// `line` comes without blanks, comments and line end, in capitals. Main loop; bounded by the
    /// line's length. If the answer is [`Extent::First`], call [`Self::interpret_rest`] once the
    /// commands are carried out.
    ///
    /// # Errors
    ///
    /// The first fault in GRBL's order. Then nothing has changed, and there are no commands.
    #[inline]
    pub fn interpret(
        &mut self,
        line: &[u8],
        context: &Context<'_, AXES>,
        commands: &mut Commands<AXES>,
    ) -> Result<Extent, Fault> {
        commands.clear();
        let mut block = self.block(context);
        block.read(line, context, &self.modal)?;
        let mut plan = Plan::new(&self.position);
        self.plan(&mut plan, &block, line, context)?;
        if block.groups.have_any(RARE) {
            if block.has_rest(context.own) {
                self.modal.tool = block.modal.tool;
                push_own(context, commands, |_| true);
                return Ok(Extent::First);
            }
            self.recall(&mut block, &mut plan)?;
        }
        self.commit(&block, &plan, context, commands);
        Ok(Extent::Whole)
    }

    /// Carries out what follows the M code that comes first: replaces `commands` by the commands of
    /// the other words of the same `line`. They are read anew, since the M code may have changed
    /// position and offsets.
    ///
    /// # Errors
    ///
    /// As [`Self::interpret`].
    pub fn interpret_rest(
        &mut self,
        line: &[u8],
        context: &Context<'_, AXES>,
        commands: &mut Commands<AXES>,
    ) -> Result<(), Fault> {
        commands.clear();
        let mut block = self.block(context);
        block.read(line, context, &self.modal)?;
        let mut plan = Plan::new(&self.position);
        self.plan(&mut plan, &block, line, context)?;
        block.groups = block.groups.without(Groups::of(&[Group::Own]));
        self.commit(&block, &plan, context, commands);
        Ok(())
    }

    /// Checks a line as [`Self::interpret`] would, and changes nothing. For startup lines when they
    /// are stored.
    ///
    /// # Errors
    ///
    /// As [`Self::interpret`].
    pub fn check(&self, line: &[u8], context: &Context<'_, AXES>) -> Result<(), Fault> {
        let mut block = self.block(context);
        block.read(line, context, &self.modal)?;
        let mut plan = Plan::new(&self.position);
        self.plan(&mut plan, &block, line, context)?;
        Ok(self.recall(&mut block, &mut plan)?)
    }

    /// M70 to M73 stand alone: M72 puts the modes in force again that M70 has kept.
    #[cold] // with `commit_rare` cold as well, a line takes 1.8 % fewer instructions here (`icount`)
    fn recall(&self, block: &mut Block<AXES>, plan: &mut Plan<AXES>) -> Result<(), Status> {
        if !cfg!(feature = "linuxcnc") {
            return Ok(());
        }
        block.check_modes()?;
        if block.groups.contains(Group::Recall) {
            let (kept, _) = self.kept.ok_or(Status::NothingKept)?;
            let tool = block.modal.tool;
            block.modal = ModalState { tool, ..kept };
            plan.feed = kept.feed;
        }
        Ok(())
    }

    /// Returns true if the operator may send this line while a line of the program is put aside. It
    /// may have probing, G4, G10 L1 and L20, tool length, and G words of modes. A line with a fault
    /// may be sent too: it is answered with its error.
    pub fn serves_operator(&self, line: &[u8], context: &Context<'_, AXES>) -> bool {
        let mut block = self.block(context);
        match block.read(line, context, &self.modal) {
            Ok(()) => block.serves_operator(),
            Err(_) => true,
        }
    }

    /// Begins a line.
    fn block(&self, context: &Context<'_, AXES>) -> Block<AXES> {
        let mut block = Block::new(&self.modal);
        if context.dialect.tools {
            block.modal.tool = self.modal.tool;
        }
        block
    }

    #[inline]
    fn plan(
        &self,
        plan: &mut Plan<AXES>,
        block: &Block<AXES>,
        line: &[u8],
        context: &Context<'_, AXES>,
    ) -> Result<(), Fault> {
        Check::new(self, block, context, Purpose::Program)
            .plan(plan)
            .map_err(|refusal| refusal.locate(line))
    }
}

impl<const AXES: usize> Interpreter<AXES> {
    /// Carries a line out, in GRBL's order: feed, speed, tool, spindle, coolant, parking, dwell,
    /// modes, offsets, motion, end of the program. An extension's M codes stand in it as LinuxCNC
    /// documents: below [`FIRST_OF_USERS`] before the spindle, the others before the dwell.
    #[inline]
    fn commit(
        &mut self,
        block: &Block<AXES>,
        plan: &Plan<AXES>,
        context: &Context<'_, AXES>,
        commands: &mut Commands<AXES>,
    ) {
        let modal = &block.modal;
        let rare = block.groups.have_any(RARE);
        if rare && block.groups.contains(Group::Own) {
            push_own(context, commands, |code| code < FIRST_OF_USERS);
        }
        self.switch(modal, &plan.path, context.laser_mode, commands);
        if rare {
            self.commit_rare(block, context, commands);
        }
        let system_changes = modal.system != self.modal.system;
        self.modal = *modal;
        self.modal.feed = plan.feed;
        self.change_offsets(plan, system_changes, commands);
        if block.axis_mask != 0 {
            self.decimals.note(&block.axes, self.modal.units);
        }
        self.go(plan, block.axis_mask != 0, context, commands);
        self.end_line(block.flow, commands);
        if !matches!(self.modal.motion, Motion::Cycle(_)) {
            self.series = None;
        }
    }

    /// Spindle, coolant and parking: a command only if something changes.
    #[inline]
    fn switch(
        &self,
        modal: &ModalState,
        path: &Path,
        laser_mode: bool,
        commands: &mut Commands<AXES>,
    ) {
        if commands_spindle(&self.modal, modal, path, laser_mode) {
            push(commands, Command::Spindle(spindle(modal)));
        }
        if self.modal.coolant != modal.coolant {
            push(commands, Command::Coolant(modal.coolant));
        }
        if self.modal.parking != modal.parking {
            push(commands, Command::ParkingControl(modal.parking));
        }
    }

    /// M48 to M51, M70 to M73, and an extension's M code of the user.
    #[cold] // as at `recall`
    fn commit_rare(
        &mut self,
        block: &Block<AXES>,
        context: &Context<'_, AXES>,
        commands: &mut Commands<AXES>,
    ) {
        if cfg!(feature = "linuxcnc") {
            self.commit_linuxcnc(block, commands);
        }
        if block.groups.contains(Group::Own) {
            push_own(context, commands, |code| code >= FIRST_OF_USERS);
        }
    }

    /// M48 to M51, M70 to M73.
    fn commit_linuxcnc(&mut self, block: &Block<AXES>, commands: &mut Commands<AXES>) {
        let mut acts = block.overrides(self.overrides);
        if block.groups.contains(Group::Keep) {
            self.kept = Some((self.modal, acts));
        } else if block.groups.contains(Group::Modes) {
            let kept = self.kept.take(); // M71 and M72: both forget, as in LinuxCNC
            let recalled = kept.filter(|_| block.groups.contains(Group::Recall));
            acts = recalled.map_or(acts, |(_, kept)| kept);
        }
        if self.overrides != acts {
            self.overrides = acts;
            push(commands, Command::OverrideControl(acts));
        }
    }

    /// Commits a dwell and all changes of offsets: tool length, work coordinate system, G10, G28.1,
    /// G30.1, G92.
    #[inline]
    fn change_offsets(
        &mut self,
        plan: &Plan<AXES>,
        system_changes: bool,
        commands: &mut Commands<AXES>,
    ) {
        let mut shifted = system_changes;
        if let Some(length) = plan.tool_length {
            shifted |= length != self.offsets.tool_length();
            self.offsets.set_tool_length(length);
        }
        match plan.effect {
            Effect::None | Effect::GoTo(_) => {}
            Effect::Dwell(seconds) => push(commands, Command::Dwell(seconds)),
            Effect::SetOrigin(system, origin) => {
                self.store(OffsetId::Work(system), origin, commands);
                shifted |= system == self.modal.system;
            }
            Effect::SetTool(tool, length) => push(commands, Command::StoreTool { tool, length }),
            Effect::SetG92(offset) => {
                self.offsets.set_g92(offset);
                shifted = true;
            }
            Effect::UseG92(again) => {
                self.offsets.use_g92(again);
                shifted = true;
            }
            Effect::Store(id) => self.store(id, self.position, commands),
        }
        if shifted {
            self.shift_work(commands);
        }
    }

    fn store(&mut self, id: OffsetId, value: [Coordinate; AXES], commands: &mut Commands<AXES>) {
        self.offsets.set(id, value);
        push(commands, Command::StoreOffset { id, value });
    }

    fn shift_work(&mut self, commands: &mut Commands<AXES>) {
        self.work_offset = self.offsets.work_offset(self.modal.system);
        push(commands, Command::WorkOffset(self.work_offset));
    }

    /// Commits G28, G30 and the motion of the motion mode.
    #[inline]
    fn go(
        &mut self,
        plan: &Plan<AXES>,
        by_way: bool,
        context: &Context<'_, AXES>,
        commands: &mut Commands<AXES>,
    ) {
        if let Effect::GoTo(end) = plan.effect {
            if by_way {
                self.rapid(plan, plan.target, commands);
            }
            self.rapid(plan, end, commands);
        }
        let feed = match (self.modal.motion, self.modal.feed_mode) {
            (Motion::Rapid, _) => Feed::Rapid,
            (_, FeedMode::PerMinute) => Feed::PerMinute(match self.modal.units {
                Units::Millimetres => plan.feed,
                Units::Inches => self.rate_in_inches(plan, context),
            }),
            (_, FeedMode::InverseTime) => Feed::InverseTime(plan.feed),
        };
        let travel = Travel {
            target: plan.target,
            feed,
            spindle: spindle(&self.modal),
            line_number: plan.line_number,
        };
        match plan.path {
            Path::None => return,
            Path::Straight => push(commands, Command::Line(travel)),
            Path::Arc(arc) => push(commands, Command::Arc { travel, arc }),
            Path::Probe(kind) => push(commands, Command::Probe { travel, kind }),
            Path::Cycle => {
                if let Some((cycle, series)) = plan.cycle {
                    self.begin_cycle(cycle, series, travel, commands);
                }
            }
        }
        self.position = plan.target;
    }

    /// The speed of a motion to the plan's target in G20. If only axes move that turn, F counts
    /// degrees, which have no inches.
    pub(super) fn rate_in_inches(&self, plan: &Plan<AXES>, context: &Context<'_, AXES>) -> Number {
        match context.turns_alone(&self.position, &plan.target) {
            true => millimetres_to_inches(plan.feed),
            false => plan.feed,
        }
    }

    /// Asks for a cycle, and keeps its words for the next line of its series.
    fn begin_cycle(
        &mut self,
        cycle: Cycle,
        series: Series,
        travel: Travel<AXES>,
        commands: &mut Commands<AXES>,
    ) {
        self.series = Some(series);
        push(commands, Command::Cycle { travel, cycle });
    }

    fn rapid(
        &mut self,
        plan: &Plan<AXES>,
        target: [Coordinate; AXES],
        commands: &mut Commands<AXES>,
    ) {
        let spindle = Spindle {
            cutting: false,
            ..spindle(&self.modal)
        };
        self.position = target;
        let travel = Travel {
            target,
            feed: Feed::Rapid,
            spindle,
            line_number: plan.line_number,
        };
        push(commands, Command::Line(travel));
    }

    /// Commits M0, M2 and M30.
    #[inline]
    fn end_line(&mut self, flow: Flow, commands: &mut Commands<AXES>) {
        match flow {
            Flow::Continue => {}
            Flow::Pause => push(commands, Command::Pause),
            Flow::End => {
                push(commands, Command::ProgramEnd);
                self.modal = self.modal.after_program_end();
                self.overrides = OverrideControl::ALL;
                if self.work_offset != self.offsets.work_offset(self.modal.system) {
                    self.shift_work(commands);
                }
            }
        }
    }
}

/// Returns true if the line makes a [`Command::Spindle`].
///
/// In laser mode the motion carries the power. Then a line makes a command if it switches the laser
/// on or off, or if it has no motion and changes S. Under M3 a line without motion also makes one
/// if it changes between a cutting motion mode and another, because that changes the power at rest.
#[inline]
fn commands_spindle(
    before: &ModalState,
    after: &ModalState,
    path: &Path,
    laser_mode: bool,
) -> bool {
    if before.rotation != after.rotation {
        return true;
    }
    if after.rotation == Rotation::Off {
        return false;
    }
    let still = matches!(path, Path::None);
    let mode_changes = before.motion.is_cutting() != after.motion.is_cutting();
    let speed_changes = before.speed != after.speed;
    match after.rotation {
        Rotation::Off => false,
        Rotation::Clockwise if laser_mode => still && (speed_changes || mode_changes),
        Rotation::Counterclockwise if laser_mode => still && speed_changes,
        Rotation::Clockwise | Rotation::Counterclockwise => speed_changes,
    }
}

/// The spindle as the modal state has it.
pub(super) fn spindle(modal: &ModalState) -> Spindle {
    Spindle {
        rotation: modal.rotation,
        speed: modal.speed,
        cutting: modal.motion.is_cutting(),
    }
}

/// The first of LinuxCNC's user-defined M codes, which follow spindle and coolant.
const FIRST_OF_USERS: u8 = 100;

/// Adds the M code of an extension, if its number is one of these.
fn push_own<const AXES: usize>(
    context: &Context<'_, AXES>,
    commands: &mut Commands<AXES>,
    belongs: impl Fn(u8) -> bool,
) {
    if let Some((_, call)) = context.own.found().filter(|(_, call)| belongs(call.code)) {
        push(commands, Command::Own(call));
    }
}

/// Adds a command. There is always room: a line asks for
/// [`MAX_COMMANDS`](super::MAX_COMMANDS) at most.
#[inline]
fn push<const AXES: usize>(commands: &mut Commands<AXES>, command: Command<AXES>) {
    let pushed = commands.push(command);
    debug_assert!(pushed.is_ok(), "a line asks for too many commands");
}
