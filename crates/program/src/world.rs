//! The values that a program may know of its machine.

use crate::label::Name;
use crate::value::Value;

/// Axes that parameters name: X, Y, Z, A, B, C, U, V, W.
const AXES: u16 = 9;

/// The machine that runs a program's lines.
pub trait World {
    /// Returns what the machine knows of this, or `None` if it does not know it.
    fn read(&self, item: Item) -> Option<Value>;
}

/// The world of a program without a machine: it knows nothing.
impl World for () {
    fn read(&self, _: Item) -> Option<Value> {
        None
    }
}

/// A value that the machine keeps. Axes count from 0: X, Y, Z, A, B, C, U, V, W. Coordinates are
/// in the program's unit, millimetres or inches, offsets too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Item {
    /// #5061 to #5069: the place at which the probe last touched, work coordinates, axis by axis.
    Probed(u8),
    /// #5070, `#<_probe_state>`: 1 if the last probe touched, else 0.
    ProbeState,
    /// #5161 to #5169: the place of G28, machine coordinates.
    First(u8),
    /// #5181 to #5189: the place of G30, machine coordinates.
    Second(u8),
    /// #5211 to #5219: the offset of G92.
    G92(u8),
    /// #5220: the work system in force, 1 for G54.
    System,
    /// #5221 to #5389: the zero of a work system, 0 for G54, axis by axis.
    Zero(u8, u8),
    /// #5400, `#<_current_tool>`: the tool in the spindle.
    Tool,
    /// #5401 to #5409: the offset of the tool.
    ToolOffset(u8),
    /// #5420 to #5428, `#<_x>` and its like: the present place, work coordinates.
    Position(u8),
    /// `#<_abs_x>` and its like: the present place, machine coordinates.
    Absolute(u8),
    /// `#<_feed>`: F.
    Feed,
    /// `#<_rpm>`: S.
    Speed,
    /// `#<_metric>`: 1 in G21; `#<_imperial>` is its opposite.
    Metric,
    /// `#<_incremental>`: 1 in G91; `#<_absolute>` is its opposite.
    Incremental,
    /// `#<_plane>`: 170 for G17, 180 for G18, 190 for G19.
    Plane,
    /// `#<_spindle_on>`: 1 while it turns.
    SpindleOn,
}

impl Item {
    /// Returns the item of a parameter's number, if the machine keeps it.
    pub(crate) fn from_number(number: u16) -> Option<Self> {
        let axis = |first: u16| (number - first) as u8;
        Some(match number {
            5061..=5069 => Self::Probed(axis(5061)),
            5070 => Self::ProbeState,
            5161..=5169 => Self::First(axis(5161)),
            5181..=5189 => Self::Second(axis(5181)),
            5211..=5219 => Self::G92(axis(5211)),
            5220 => Self::System,
            // Nine systems of nine axes and a rotation, twenty numbers each.
            5221..=5389 if (number - 5221) % 20 < AXES => {
                let (system, axis) = ((number - 5221) / 20, (number - 5221) % 20);
                Self::Zero(system as u8, axis as u8)
            }
            5400 => Self::Tool,
            5401..=5409 => Self::ToolOffset(axis(5401)),
            5420..=5428 => Self::Position(axis(5420)),
            _ => return None,
        })
    }
}

/// Reads what the machine keeps under this name. `None`: no such name; `Some(None)`: the machine
/// does not know the value.
pub(crate) fn named(world: &dyn World, name: &Name) -> Option<Option<Value>> {
    let opposite = |item| {
        let value = world.read(item)?;
        Some(Value::from_bool(value.is_zero()))
    };
    Some(match name.as_bytes() {
        b"_METRIC" => world.read(Item::Metric),
        b"_IMPERIAL" => opposite(Item::Metric),
        b"_INCREMENTAL" => world.read(Item::Incremental),
        b"_ABSOLUTE" => opposite(Item::Incremental),
        b"_FEED" => world.read(Item::Feed),
        b"_RPM" => world.read(Item::Speed),
        b"_PLANE" => world.read(Item::Plane),
        b"_SPINDLE_ON" => world.read(Item::SpindleOn),
        b"_PROBE_STATE" => world.read(Item::ProbeState),
        b"_CURRENT_TOOL" => world.read(Item::Tool),
        b"_COORD_SYSTEM" => coordinate_system(world),
        [b'_', letter] => world.read(Item::Position(axis(*letter)?)),
        [b'_', b'A', b'B', b'S', b'_', letter] => world.read(Item::Absolute(axis(*letter)?)),
        _ => return None,
    })
}

/// 540 for G54, 550 for G55 and so on.
fn coordinate_system(world: &dyn World) -> Option<Value> {
    let system = i32::try_from(world.read(Item::System)?.whole()?).ok()?;
    Some(Value::from_int(system.checked_mul(10)?.checked_add(530)?))
}

fn axis(letter: u8) -> Option<u8> {
    let axis = b"XYZABCUVW".iter().position(|known| *known == letter)?;
    Some(axis as u8)
}
