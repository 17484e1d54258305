//! Lines with parameters and expressions on a serial line: an extension of a machine.

use crate::calculator::Calculator;
use crate::fault::ErrorKind;
use crate::value::Value;
use crate::world::{Item, World};
use core::borrow::BorrowMut;
use leadscrew_gcode::Number;
use leadscrew_machine::config::AxisKind;
use leadscrew_machine::extension::{Event, Extension, Fault, Known, Line, OwnCode};
use leadscrew_machine::interpreter::{Distance, OffsetId, Plane, Rotation, Units, WorkSystem};
use leadscrew_machine::protocol::status::Status;
use leadscrew_planner::Coordinate;

/// The errors with which lines are answered.
pub static ERRORS: [OwnCode; 4] = [SPELLING, MATH, PARAMETER, ROOM];

const SPELLING: OwnCode = OwnCode {
    number: 240,
    text: "The expression is misspelt",
    explanation:
        "Expressions stand in brackets: X[#1 + 2]. Brackets may stand 8 deep, names have 32 characters at most.",
};
const MATH: OwnCode = OwnCode {
    number: 241,
    text: "The calculation has no result",
    explanation:
        "It divides by 0, takes a root, logarithm, power or arc of a number that has none, or its result is too large.",
};
const PARAMETER: OwnCode = OwnCode {
    number: 242,
    text: "There is no such parameter to read or to set",
    explanation:
        "Numbers go from 1 to 5602, those from 5061 to 5428 are the machine's, which sets them. A name has to be set on an earlier line.",
};
const ROOM: OwnCode = OwnCode {
    number: 243,
    text: "There is no room for so many parameters or characters",
    explanation:
        "A reset forgets all parameters; #1 to #30 always have room. With its numbers written out a line has 128 characters at most, and it sets 16 parameters.",
};

/// Lets lines have parameters and expressions. `M` is its memory: a [`Calculator`], or what lends
/// one, such as `&mut`.
///
/// A reset forgets the parameters; they outlast the end of a program.
#[derive(Debug)]
pub struct Expressions<M, const NUMBERED: usize, const NAMED: usize> {
    memory: M,
}

impl<M, const NUMBERED: usize, const NAMED: usize> Expressions<M, NUMBERED, NAMED>
where
    M: BorrowMut<Calculator<NUMBERED, NAMED>>,
{
    /// Makes the extension.
    pub const fn new(memory: M) -> Self {
        Self { memory }
    }
}

impl<M, const NUMBERED: usize, const NAMED: usize, const AXES: usize> Extension<AXES>
    for Expressions<M, NUMBERED, NAMED>
where
    M: BorrowMut<Calculator<NUMBERED, NAMED>>,
{
    fn calculate(
        &mut self,
        line: &[u8],
        known: &Known<'_, AXES>,
        plain: &mut Line,
    ) -> Option<Result<(), Fault>> {
        let written = self.memory.borrow_mut().line(line, known, plain);
        Some(written.map_err(|error| Fault {
            status: Status::Own(code(error.kind).number),
            column: error.column,
        }))
    }

    fn calculated(&mut self) {
        self.memory.borrow_mut().keep();
    }

    fn errors(&self) -> impl Iterator<Item = &'static OwnCode> {
        ERRORS.iter()
    }

    fn event(&mut self, event: Event) {
        if event == Event::Reset {
            self.memory.borrow_mut().forget();
        }
    }
}

fn code(kind: ErrorKind) -> &'static OwnCode {
    match kind {
        ErrorKind::Math(_) | ErrorKind::TooLarge => &MATH,
        ErrorKind::NoParameter
        | ErrorKind::UnknownName
        | ErrorKind::UnknownHere
        | ErrorKind::ReadOnly
        | ErrorKind::NotWhole => &PARAMETER,
        ErrorKind::ManyParameters
        | ErrorKind::ManyNames
        | ErrorKind::ManyAssignments
        | ErrorKind::LongLine => &ROOM,
        // The others from `UnknownKeyword` on are no line's that is read alone.
        ErrorKind::Expected(..)
        | ErrorKind::LongName
        | ErrorKind::UnknownFunction
        | ErrorKind::DeepBrackets
        | ErrorKind::UnknownKeyword
        | ErrorKind::NoSubprogram
        | ErrorKind::NotOpen
        | ErrorKind::NotClosed
        | ErrorKind::DeepCalls
        | ErrorKind::DeepLoops
        | ErrorKind::ManyArguments
        | ErrorKind::OtherWords
        | ErrorKind::Endless => &SPELLING,
    }
}

impl<const AXES: usize> World for Known<'_, AXES> {
    fn read(&self, item: Item) -> Option<Value> {
        let modal = self.interpreter.modal();
        let offsets = self.interpreter.offsets();
        let position = self.interpreter.position();
        let whole = |number: i32| Some(Value::from_int(number));
        match item {
            Item::Probed(axis) => match &self.probed {
                Some(probed) => work(self, axis, probed),
                None => whole(0),
            },
            Item::ProbeState => whole(self.contact.into()),
            Item::First(axis) => length(self, axis, offsets.get(OffsetId::G28)),
            Item::Second(axis) => length(self, axis, offsets.get(OffsetId::G30)),
            Item::G92(axis) => length(self, axis, offsets.g92()),
            Item::System => whole(modal.system as i32 + 1),
            Item::Zero(system, axis) => {
                let system = *WorkSystem::ALL.get(usize::from(system))?;
                length(self, axis, offsets.get(OffsetId::Work(system)))
            }
            Item::Tool => i32::try_from(self.tool?).ok().and_then(whole),
            Item::ToolOffset(2) => in_units(modal.units, value(offsets.tool_length())),
            Item::ToolOffset(_) => whole(0),
            Item::Position(axis) => work(self, axis, position),
            Item::Absolute(axis) => length(self, axis, position),
            Item::Feed => in_units(modal.units, Value::from_number(modal.feed)),
            Item::Speed => Some(Value::from_number(modal.speed)),
            Item::Metric => whole((modal.units == Units::Millimetres).into()),
            Item::Incremental => whole((modal.distance == Distance::Incremental).into()),
            Item::Plane => whole(match modal.plane {
                Plane::Xy => 170,
                Plane::Zx => 180,
                Plane::Yz => 190,
            }),
            Item::SpindleOn => whole((modal.rotation != Rotation::Off).into()),
        }
    }
}

/// A coordinate of an axis, in the program's unit; 0 for an axis that the machine lacks.
fn length<const AXES: usize>(
    known: &Known<'_, AXES>,
    axis: u8,
    place: &[Coordinate; AXES],
) -> Option<Value> {
    let axis = usize::from(axis);
    let here = value(place.get(axis).copied().unwrap_or(Coordinate::ZERO));
    match known.axes.get(axis) {
        Some(AxisKind::Linear) => in_units(known.interpreter.modal().units, here),
        Some(AxisKind::Rotary) => Some(here),
        Some(AxisKind::Extruder | AxisKind::Absent) | None => Some(Value::ZERO),
    }
}

/// A place as the program counts it.
fn work<const AXES: usize>(
    known: &Known<'_, AXES>,
    axis: u8,
    place: &[Coordinate; AXES],
) -> Option<Value> {
    let zero = known.interpreter.work_offset();
    let mut here = *place;
    for (here, zero) in here.iter_mut().zip(zero) {
        *here = *here - *zero;
    }
    length(known, axis, &here)
}

fn value(place: Coordinate) -> Value {
    Value::from_number(Number::from_nanos(place.nanos()))
}

/// A length in mm as the program counts it.
fn in_units(units: Units, mm: Value) -> Option<Value> {
    match units {
        Units::Millimetres => Some(mm),
        Units::Inches => mm
            .over(Value::from_number(Number::from_nanos(25_400_000_000)))
            .ok(),
    }
}
