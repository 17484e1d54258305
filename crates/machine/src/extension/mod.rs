//! Additions of a firmware to GRBL, without a fork: M codes, settings, report fields, realtime
//! bytes, and pins of its own.
//!
//! ```text
//!   M10 P1          m_code(10) --> perform(call) --> Step: done, again later, move there, refused
//!   $800=2          settings() --> set(800, 2), stored as all settings are
//!   ?               report()   --> <Idle|MPos:0.000,0.000,0.000|FS:0,0|Vac:1>
//!   0xF8 to 0xFF    realtime(byte)
//!   each turn       poll()     --> when to ask again
//!   a reset, ...    event()
//! ```
//!
//! All methods are called from the main loop and none may wait: a long activity is a value that
//! [`Extension::perform`] advances. A pair of extensions is an extension: `(Heat, Vacuum)`. If
//! both know an M code or a setting, the first one has it. `()` is no extension: no code is
//! compiled for it.
//!
//! An extension owns its pins. GRBL's own pins stay with the [`Board`](crate::board::Board).
//!
//! ```
#![doc = include_str!("../../examples/vacuum/extension.rs")]
//! ```

mod aside;
mod cx;
mod host;
mod known;
mod option;
mod own_code;
mod pair;
mod settings;

pub use cx::{Comment, Cx, Out, LONGEST_TEXT};
pub use known::Known;

use crate::board::Instant;
use crate::guard::Load;
use crate::protocol::serial::LINE;
use crate::protocol::status::Status;
use crate::settings::table::Row;
use crate::state::State;
use core::fmt;
use leadscrew_gcode::Number;
use leadscrew_planner::Coordinate;

pub use leadscrew_interpreter::own::{Call, MCode, Words};
pub use leadscrew_interpreter::Fault;
pub use leadscrew_stepper::OutputChange;
pub use own_code::OwnCode;

/// A line without blanks, comments and line end, in capitals.
pub type Line = heapless::Vec<u8, LINE>;

/// An addition to a machine with `AXES` axes.
///
/// Every method has a default, which adds nothing.
pub trait Extension<const AXES: usize> {
    /// True if calls to the extension are compiled at all. `false` for `()` alone.
    const IN_USE: bool = true;

    /// The M code of this number, 0 to 255, if it is one of this extension's. Asked before GRBL's
    /// own codes.
    fn m_code(&self, number: u8) -> Option<MCode> {
        let _ = number;
        None
    }

    /// Checks an M code of [`Extension::m_code`] with its words, before anything of its line is
    /// carried out; in check mode, too.
    ///
    /// # Errors
    /// The answer to the line, of which nothing is carried out.
    fn check(&self, call: &Call) -> Result<(), Status> {
        let _ = call;
        Ok(())
    }

    /// Says whether a move may be planned, or an M code of any extension be begun. Asked once more
    /// at every turn while the answer is [`Gate::Wait`]. Not asked in check mode, nor for homing
    /// and parking.
    fn gate(&self, asked: &Asked<'_, AXES>) -> Gate {
        let _ = asked;
        Gate::Open
    }

    /// Carries out an M code of [`Extension::m_code`], or goes on with it: called at every turn of
    /// the main loop until it is done. Not called in check mode.
    fn perform(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) -> Step<AXES> {
        let _ = (call, cx);
        Step::Done
    }

    /// Tells the operator what to do, after [`Step::SetAside`]: from now on the operator has the
    /// machine. From this message on `~` is obeyed.
    fn set_aside(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) {
        let _ = (call, cx);
    }

    /// Its settings. All extensions together have 32 at most. Numbers 800 to 999 are free for
    /// extensions.
    fn settings(&self) -> impl Iterator<Item = &'static Row> {
        core::iter::empty()
    }

    /// The value in force of one of [`Extension::settings`].
    fn value(&self, number: u16) -> Number {
        let _ = number;
        Number::default()
    }

    /// Puts a value of one of [`Extension::settings`] into effect: it is in the range of its row.
    /// At rest.
    ///
    /// # Errors
    /// The answer to the line. The value in force must stay.
    fn set(&mut self, number: u16, value: Number) -> Result<(), Status> {
        let _ = (number, value);
        Err(Status::InvalidStatement)
    }

    /// The errors with which it answers lines, besides GRBL's, as [`Status::Own`].
    fn errors(&self) -> impl Iterator<Item = &'static OwnCode> {
        core::iter::empty()
    }

    /// The alarms that it raises besides GRBL's, as
    /// [`Alarm::Own`](crate::protocol::alarm::Alarm::Own).
    fn alarms(&self) -> impl Iterator<Item = &'static OwnCode> {
        core::iter::empty()
    }

    /// Writes out a line of a program that has parameters or expressions: puts its words with plain
    /// numbers into `plain`, which is empty. Nothing is put there of a line that only sets
    /// parameters. Returns `None` if it does not calculate: the line is then refused.
    ///
    /// What the line sets may count only after [`Extension::calculated`].
    ///
    /// # Errors
    /// The answer to the line, of which nothing is carried out.
    fn calculate(
        &mut self,
        line: &[u8],
        known: &Known<'_, AXES>,
        plain: &mut Line,
    ) -> Option<Result<(), Fault>> {
        let _ = (line, known, plain);
        None
    }

    /// The machine has taken the line that was calculated last: what it sets counts from now on.
    fn calculated(&mut self) {}

    /// Its memory for lines that come while an M code is put aside: as large as the receive buffer.
    fn kept(&mut self) -> &mut [u8] {
        &mut []
    }

    /// The length of tool number `tool`, or of the tool in the spindle if `tool` is `None`: for
    /// G43. Returns `None` if there is no such tool.
    fn tool_length(&self, tool: Option<u32>) -> Option<Coordinate> {
        let _ = tool;
        None
    }

    /// Notes the length of a tool (G10 L1); returns the number of the setting that holds it.
    ///
    /// # Errors
    /// The answer to the line.
    fn set_tool_length(&mut self, tool: u32, length: Coordinate) -> Result<u16, Status> {
        let _ = (tool, length);
        Err(Status::UnsupportedCommand)
    }

    /// Writes its fields of a status report, each with a `|` before it, 64 characters at most.
    ///
    /// # Errors
    /// Writing to `fields` failed.
    fn report(&self, fields: &mut fmt::Formatter<'_>) -> fmt::Result {
        let _ = fields;
        Ok(())
    }

    /// Takes a realtime byte, 0xF8 to 0xFF: no UTF-8 text has them.
    fn realtime(&mut self, byte: u8, cx: &mut Cx<'_, AXES>) {
        let _ = (byte, cx);
    }

    /// Returns true if it has something of this kind on that must not stay so without a sender: the
    /// machine watches it, and says [`Event::LeftAlone`].
    fn is_on(&self, load: Load) -> bool {
        let _ = load;
        false
    }

    /// Asked when `~` comes, whether it may take effect. An extension that says no tells the
    /// operator why.
    fn resumes(&mut self, cx: &mut Cx<'_, AXES>) -> bool {
        let _ = cx;
        true
    }

    /// Learns of an event at which outputs may have to be switched.
    fn event(&mut self, event: Event) {
        let _ = event;
    }

    /// Does its regular work: at every turn of the main loop. Returns when it wants the next turn
    /// at the latest.
    fn poll(&mut self, cx: &mut Cx<'_, AXES>) -> Option<Instant> {
        let _ = cx;
        None
    }
}

impl<const AXES: usize> Extension<AXES> for () {
    const IN_USE: bool = false;
}

/// The question to [`Extension::gate`]: a move or an M code to which an extension may object.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum Asked<'a, const AXES: usize> {
    /// A straight move, a whole arc, or a stroke of a cycle.
    Move {
        /// Its start, machine position.
        from: &'a [Coordinate; AXES],
        /// Its end, machine position.
        target: &'a [Coordinate; AXES],
        /// True if it is a jog.
        jog: bool,
    },
    /// An M code of an extension, this one or another.
    Code(&'a Call),
}

/// The answer of [`Extension::gate`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Gate {
    /// The move or the M code may go on.
    Open,
    /// Not yet: ask again at the next turn. The line has no answer meanwhile, motion planned before
    /// goes on, and the machine shows `Run`.
    Wait,
    /// The line is answered with this error; nothing else of it is carried out.
    Refuse(Status),
}

/// The way in which an M code goes on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Step<const AXES: usize> {
    /// It is carried out.
    Done,
    /// Ask again at the next turn, and at this instant at the latest. The machine shows `Run`.
    Wait(Option<Instant>),
    /// Ask again once all motion has ended.
    Rest,
    /// Go straight to the target, and ask again at every turn on the way. For an M code that comes
    /// first on its line. Motion that was planned before has to have ended ([`Step::Rest`]). A
    /// laser is dark on the way.
    Move {
        /// Machine position. Outside the travel it is ALARM:2, with soft limits.
        target: [Coordinate; AXES],
        /// Speed along the path, mm/min, above 0; as of F if axes turn.
        rate: Number,
    },
    /// Slow down on the way to a target of [`Step::Move`], forget the rest of it, and ask again at
    /// rest.
    Stop,
    /// Put the line aside. For an M code that comes first on its line, at rest. Spindle and
    /// coolant go off, the line has no answer yet, and lines that its sender has sent already go to
    /// [`Extension::kept`]. Until `~` the operator has the machine: `$J`, `$H`, `$X` and `$`
    /// questions, G38, G10 L1 and L20, G43.1, G49 and words of modes are obeyed, all else is
    /// `error:9`. After `~`, modes, spindle and coolant are as before, and the code is asked again.
    /// Once the code is done, its line is answered and the kept lines follow.
    SetAside(Shown),
    /// The line is answered with this error; nothing else of it is carried out.
    Refuse(Status),
}

/// The state that reports show while the operator has the machine.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Shown {
    /// `Hold:0`, which every sender knows.
    #[default]
    Hold,
    /// `Tool`, for senders that know it.
    Tool,
}

impl Shown {
    /// Returns the state as status reports spell it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hold => "Hold:0",
            Self::Tool => "Tool",
        }
    }
}

/// An event at which outputs may have to be switched.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Event {
    /// The machine enters a state: an alarm, a hold, the way back to Idle.
    Enters(State),
    /// What is on has been without its sender for too long: it has to go off.
    LeftAlone {
        /// The load that is on.
        load: Load,
        /// The machine is held, at the door or with the operator, and may go on at `~`.
        resumes: bool,
    },
    /// A soft reset, 0x18, after any alarm that it raised: an M code under way is forgotten.
    Reset,
    /// M2 or M30, at rest.
    ProgramEnd,
    /// The operator has the machine from now on: [`Step::SetAside`].
    SetAside,
    /// `~` gives the machine back to the program.
    TakesBack,
}
