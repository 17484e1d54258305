//! What a program may read of the machine that a checker follows.

use super::Checker;
use leadscrew_gcode::Number;
use leadscrew_machine::config::AxisKind;
use leadscrew_machine::interpreter::{Distance, OffsetId, Plane, Rotation, Units, WorkSystem};
use leadscrew_planner::Coordinate;
use leadscrew_program::{Item, Value, World};

/// The letters of the axes that parameters count.
const LETTERS: [char; 9] = ['X', 'Y', 'Z', 'A', 'B', 'C', 'U', 'V', 'W'];

/// The end of the last probe.
#[derive(Clone, Copy)]
pub(super) struct Probed<const AXES: usize> {
    /// Machine position.
    pub(super) at: [Coordinate; AXES],
    pub(super) touched: bool,
}

impl<const AXES: usize> World for Checker<AXES> {
    fn read(&self, item: Item) -> Option<Value> {
        let modal = self.interpreter.modal();
        let offsets = self.interpreter.offsets();
        let whole = |number: i32| Some(Value::from_int(number));
        match item {
            Item::Probed(axis) => {
                let probed = self.probed.as_ref();
                self.length(axis, |axis| {
                    probed.map_or(Coordinate::ZERO, |probed| self.work(&probed.at, axis))
                })
            }
            Item::ProbeState => whole(self.probed.is_some_and(|probed| probed.touched).into()),
            Item::First(axis) => self.length(axis, |axis| offsets.get(OffsetId::G28)[axis]),
            Item::Second(axis) => self.length(axis, |axis| offsets.get(OffsetId::G30)[axis]),
            Item::G92(axis) => self.length(axis, |axis| offsets.g92()[axis]),
            Item::System => whole(modal.system as i32 + 1),
            Item::Zero(system, axis) => {
                let system = *WorkSystem::ALL.get(usize::from(system))?;
                self.length(axis, |axis| offsets.get(OffsetId::Work(system))[axis])
            }
            Item::Tool => i32::try_from(self.tool).ok().and_then(whole),
            Item::ToolOffset(2) => self.length(2, |_| offsets.tool_length()),
            Item::ToolOffset(_) => whole(0),
            Item::Position(axis) => {
                self.length(axis, |axis| self.work(self.interpreter.position(), axis))
            }
            Item::Absolute(axis) => self.length(axis, |axis| self.interpreter.position()[axis]),
            Item::Feed => self.in_units(Value::from_number(modal.feed)),
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

impl<const AXES: usize> Checker<AXES> {
    /// A coordinate of an axis, in the program's unit; 0 for an axis that the machine lacks.
    fn length(&self, axis: u8, of: impl Fn(usize) -> Coordinate) -> Option<Value> {
        let letter = LETTERS.get(usize::from(axis))?;
        let Some(axis) = self.letters.iter().position(|known| known == letter) else {
            return Some(Value::ZERO);
        };
        let value = Value::from_number(Number::from_nanos(of(axis).nanos()));
        match self.config.axes.get(axis) {
            Some(AxisKind::Rotary) => Some(value),
            _ => self.in_units(value),
        }
    }

    /// A length in mm as the program counts it.
    fn in_units(&self, mm: Value) -> Option<Value> {
        match self.interpreter.modal().units {
            Units::Millimetres => Some(mm),
            Units::Inches => mm
                .over(Value::from_number(Number::from_nanos(25_400_000_000)))
                .ok(),
        }
    }

    /// A place as the program counts it, mm.
    fn work(&self, at: &[Coordinate; AXES], axis: usize) -> Coordinate {
        at[axis] - self.interpreter.work_offset()[axis]
    }

    /// Takes over where a probe has ended, machine coordinates, mm.
    pub(super) fn end_probe(&mut self, at: &[f32], touched: bool) {
        let mut place = *self.interpreter.position();
        for (place, at) in place.iter_mut().zip(at) {
            *place = Coordinate::from_mm(*at).unwrap_or(*place);
        }
        self.interpreter.set_position(place);
        let at = place;
        self.probed = Some(Probed { at, touched });
    }
}
