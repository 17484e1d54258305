//! The moves of a job or of a machine as they are drawn: the common part of pictures and pages.

mod sizes;
mod toolpath;
mod tools;

pub use sizes::ToolSizes;
pub use toolpath::{Hole, StrokeKind, Tooling, Toolpath};
pub use tools::note_tools;

/// The bytes of one move, as pages and pictures get it.
pub const MOVE_BYTES: usize = 20;

/// The use of the tool on a move.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Way {
    /// The tool moves without cutting, as [`StrokeKind::Travel`].
    Travel = 0,
    /// The tool cuts, as [`StrokeKind::Cut`].
    Cut = 1,
    /// The path begins anew at this place: nothing is drawn.
    Jump = 2,
}

/// A move as pages and pictures get it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Drawn {
    /// The end of the move: X, Y, Z in mm.
    pub to: [f32; 3],
    /// The line that asked for the move; 0 for none.
    pub line: u32,
    /// The use of the tool.
    pub way: Way,
    /// Programmed power, as a share of full power.
    pub power: f32,
    /// Diameter of the tool, mm; 0 if it is not known.
    pub tool_mm: f32,
}

/// The units per millimetre in which pages get a tool's diameter.
const TOOL_UNITS: f32 = 100.0;

impl Drawn {
    /// Adds its 20 bytes: X, Y, Z (f32, mm), line (u32), way, power (255 is full), the tool's
    /// diameter (u16, 0.01 mm; 0 unknown); little-endian.
    pub fn write(&self, to: &mut Vec<u8>) {
        for place in self.to {
            to.extend(place.to_le_bytes());
        }
        to.extend(self.line.to_le_bytes());
        let power = (self.power * 255.0).round() as u8;
        to.extend([self.way as u8, power]);
        to.extend(((self.tool_mm * TOOL_UNITS).round() as u16).to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_is_twenty_bytes_in_the_order_that_pages_read() {
        let one = Drawn {
            to: [1.0, -2.0, 0.5],
            line: 7,
            way: Way::Cut,
            power: 0.5,
            tool_mm: 3.2,
        };
        let mut bytes = Vec::new();
        one.write(&mut bytes);
        assert_eq!(bytes.len(), MOVE_BYTES);
        assert_eq!(bytes[..4], 1.0f32.to_le_bytes());
        assert_eq!(bytes[12..], [7, 0, 0, 0, 1, 128, 0x40, 1]);
    }
}
