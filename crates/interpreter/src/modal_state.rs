//! The modes that stay in force from line to line: one enum for each modal group.
//!
//! Modal groups are the groups of RS274/NGC (NISTIR 6556, table 4), as far as GRBL 1.1h knows them.
//! Each enum prints as the word that selects it, so that `$G` is a list of them.

use super::cycle::kind::CycleKind;
use core::fmt::{self, Display, Formatter, Write};
use leadscrew_gcode::Number;

/// The motion that an axis word asks for: modal group 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Motion {
    /// G0: straight, as fast as the axes can.
    #[default]
    Rapid,
    /// G1: straight, at the feed rate.
    Feed,
    /// G2 or G3: an arc or helix at the feed rate.
    Arc(Turn),
    /// G38.2 to G38.5: straight at the feed rate until the probe says stop.
    Probe(ProbeKind),
    /// G73, G81 to G83, G85, G86, G89: a canned cycle at each place that the axis words name.
    Cycle(CycleKind),
    /// G80: none; axis words are refused.
    Cancelled,
}

impl Motion {
    /// Returns whether a laser may be on: in G1, G2 and G3 only.
    pub const fn is_cutting(self) -> bool {
        match self {
            Self::Feed | Self::Arc(_) => true,
            Self::Rapid | Self::Probe(_) | Self::Cycle(_) | Self::Cancelled => false,
        }
    }

    /// Returns true if the build has the motion. No line can choose another.
    pub(crate) const fn is_built(self) -> bool {
        match self {
            Self::Rapid | Self::Feed | Self::Cancelled => true,
            Self::Arc(_) => cfg!(feature = "arcs"),
            Self::Probe(_) => cfg!(feature = "probing"),
            Self::Cycle(_) => cfg!(feature = "cycles"),
        }
    }

    /// Returns whether the motion needs a feed rate: all but G0 and G80.
    pub const fn needs_feed(self) -> bool {
        match self {
            Self::Feed | Self::Arc(_) | Self::Probe(_) | Self::Cycle(_) => true,
            Self::Rapid | Self::Cancelled => false,
        }
    }
}

impl Display for Motion {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rapid => f.write_str("G0"),
            Self::Feed => f.write_str("G1"),
            Self::Arc(turn) => turn.fmt(f),
            Self::Probe(kind) => kind.fmt(f),
            Self::Cycle(kind) => kind.fmt(f),
            Self::Cancelled => f.write_str("G80"),
        }
    }
}

/// The way round an arc, seen from the positive end of the axis at right angles to its plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Turn {
    /// G2.
    Clockwise,
    /// G3.
    Counterclockwise,
}

impl Display for Turn {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Clockwise => "G2",
            Self::Counterclockwise => "G3",
        })
    }
}

/// The event that a probing motion waits for, and whether its absence is an alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ProbeKind {
    /// Stop when contact is made (G38.2, G38.3); otherwise when it is lost (G38.4, G38.5).
    pub toward: bool,
    /// An alarm if the target is reached first (G38.2, G38.4).
    pub must_trigger: bool,
}

impl Display for ProbeKind {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match (self.toward, self.must_trigger) {
            (true, true) => "G38.2",
            (true, false) => "G38.3",
            (false, true) => "G38.4",
            (false, false) => "G38.5",
        })
    }
}

/// The plane in which arcs turn: modal group 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Plane {
    /// G17.
    #[default]
    Xy,
    /// G18.
    Zx,
    /// G19.
    Yz,
}

impl Plane {
    /// Returns the plane's axes, X = 0, in the order in which a counterclockwise turn goes from one
    /// to the other.
    pub const fn axes(self) -> (usize, usize) {
        match self {
            Self::Xy => (0, 1),
            Self::Zx => (2, 0),
            Self::Yz => (1, 2),
        }
    }

    /// Returns the axis across the plane, X = 0: the tool of a canned cycle goes along it.
    pub const fn across(self) -> usize {
        match self {
            Self::Xy => 2,
            Self::Zx => 1,
            Self::Yz => 0,
        }
    }
}

impl Display for Plane {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Xy => "G17",
            Self::Zx => "G18",
            Self::Yz => "G19",
        })
    }
}

/// The origin that axis words count from: modal group 3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Distance {
    /// G90: the origin of the work coordinates.
    #[default]
    Absolute,
    /// G91: where the axis is.
    Incremental,
}

impl Display for Distance {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Absolute => "G90",
            Self::Incremental => "G91",
        })
    }
}

/// The meaning of F: modal group 5.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FeedMode {
    /// G93: the motion of the line takes 1/F minutes.
    InverseTime,
    /// G94: length units a minute.
    #[default]
    PerMinute,
}

impl Display for FeedMode {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::InverseTime => "G93",
            Self::PerMinute => "G94",
        })
    }
}

/// The length unit of words: modal group 6.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Units {
    /// G20: 25.4 mm.
    Inches,
    /// G21.
    #[default]
    Millimetres,
}

impl Display for Units {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Inches => "G20",
            Self::Millimetres => "G21",
        })
    }
}

/// The level to which canned cycles go back: modal group 10.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Retract {
    /// G98: to the level before the series of cycles, or to the R level if that is higher.
    #[default]
    Initial,
    /// G99: to the R level.
    Clear,
}

/// The work coordinate system in force: modal group 12.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the words are their own names")]
pub enum WorkSystem {
    #[default]
    G54,
    G55,
    G56,
    G57,
    G58,
    G59,
    G59_1,
    G59_2,
    G59_3,
}

impl WorkSystem {
    /// All systems in order: `ALL[system as usize] == system`.
    pub const ALL: [Self; 9] = [
        Self::G54,
        Self::G55,
        Self::G56,
        Self::G57,
        Self::G58,
        Self::G59,
        Self::G59_1,
        Self::G59_2,
        Self::G59_3,
    ];
    /// The number of them that Grbl has: the first ones.
    pub const GRBL: usize = 6;
}

impl Display for WorkSystem {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::G54 => "G54",
            Self::G55 => "G55",
            Self::G56 => "G56",
            Self::G57 => "G57",
            Self::G58 => "G58",
            Self::G59 => "G59",
            Self::G59_1 => "G59.1",
            Self::G59_2 => "G59.2",
            Self::G59_3 => "G59.3",
        })
    }
}

/// The rotation of the spindle: modal group M7.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Rotation {
    /// M3; a laser at constant power.
    Clockwise,
    /// M4; a laser whose power follows the speed of the motion.
    Counterclockwise,
    /// M5.
    #[default]
    Off,
}

impl Display for Rotation {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Clockwise => "M3",
            Self::Counterclockwise => "M4",
            Self::Off => "M5",
        })
    }
}

/// The coolant in use: modal group M8.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Coolant {
    /// True if mist coolant is on (M7), if the machine has it.
    pub mist: bool,
    /// True if flood coolant is on (M8).
    pub flood: bool,
}

impl Coolant {
    /// No coolant (M9).
    pub const OFF: Self = Self {
        mist: false,
        flood: false,
    };
}

impl Display for Coolant {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match (self.mist, self.flood) {
            (false, false) => "M9",
            (false, true) => "M8",
            (true, false) => "M7",
            (true, true) => "M7 M8",
        })
    }
}

/// The overrides that the program lets act (M48 to M51).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OverrideControl {
    /// The override of feeds.
    pub feed: bool,
    /// The override of the spindle's speed.
    pub spindle: bool,
}

impl OverrideControl {
    /// M48: both, as after power-up.
    pub const ALL: Self = Self {
        feed: true,
        spindle: true,
    };
}

/// The state that one line leaves to the next, offsets and position apart.
///
/// The default is the state after power-up and soft reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ModalState {
    /// Motion mode.
    pub motion: Motion,
    /// Plane of arcs.
    pub plane: Plane,
    /// Absolute or incremental.
    pub distance: Distance,
    /// M82 or M83: how E counts; `None` if E counts as the other axes do. G90 and G91 set this
    /// to `None`.
    pub extrusion: Option<Distance>,
    /// The meaning of F.
    pub feed_mode: FeedMode,
    /// Inches or millimetres.
    pub units: Units,
    /// Work coordinate system.
    pub system: WorkSystem,
    /// The level to which canned cycles go back.
    pub retract: Retract,
    /// Spindle.
    pub rotation: Rotation,
    /// Coolant.
    pub coolant: Coolant,
    /// M56: whether the spindle axis parks when the safety door opens.
    pub parking: bool,
    /// The T word of the last line; GRBL forgets it with the next.
    pub tool: u32,
    /// Feed rate: mm/min in G94 whatever the units, 1/min in G93; zero if none is set.
    pub feed: Number,
    /// Spindle speed, rev/min, or laser power: the last S word.
    pub speed: Number,
}

impl Default for ModalState {
    fn default() -> Self {
        Self {
            motion: Motion::default(),
            plane: Plane::default(),
            distance: Distance::default(),
            extrusion: None,
            feed_mode: FeedMode::default(),
            units: Units::default(),
            system: WorkSystem::default(),
            retract: Retract::default(),
            rotation: Rotation::default(),
            coolant: Coolant::default(),
            parking: true,
            tool: 0,
            feed: Number::default(),
            speed: Number::default(),
        }
    }
}

impl ModalState {
    /// Returns the state after M2 or M30: units, feed, speed, tool and parking stay, motion becomes
    /// G1, and all other modes are as after power-up.
    #[must_use]
    pub(super) fn after_program_end(self) -> Self {
        Self {
            motion: Motion::Feed,
            units: self.units,
            tool: self.tool,
            feed: self.feed,
            speed: self.speed,
            parking: self.parking,
            ..Self::default()
        }
    }
}

impl Display for ModalState {
    /// Writes the modal words in the order of `$G`, without M56, T, F and S; G99 alone of its
    /// group, as Grbl has no G98; M82 and M83 if they are in force.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let extrusion = self.extrusion.map(|distance| match distance {
            Distance::Absolute => "M82",
            Distance::Incremental => "M83",
        });
        let groups: [Option<&dyn Display>; 10] = [
            Some(&self.motion),
            Some(&self.system),
            Some(&self.plane),
            Some(&self.units),
            Some(&self.distance),
            Some(&self.feed_mode),
            (self.retract == Retract::Clear).then_some(&"G99"),
            Some(&self.rotation),
            Some(&self.coolant),
            extrusion.as_ref().map(|word| word as &dyn Display),
        ];
        for (index, group) in groups.iter().flatten().enumerate() {
            if index > 0 {
                f.write_char(' ')?;
            }
            group.fmt(f)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn power_up_prints_as_grbl_does() {
        let words = ModalState::default().to_string();
        assert_eq!(words, "G0 G54 G17 G21 G90 G94 M5 M9");
    }

    #[test]
    fn program_end_keeps_units_feed_and_speed_and_selects_g1() {
        let state = ModalState {
            motion: Motion::Cancelled,
            plane: Plane::Zx,
            distance: Distance::Incremental,
            extrusion: None,
            feed_mode: FeedMode::InverseTime,
            units: Units::Inches,
            system: WorkSystem::G55,
            retract: Retract::Clear,
            rotation: Rotation::Clockwise,
            coolant: Coolant {
                mist: true,
                flood: true,
            },
            parking: false,
            tool: 3,
            feed: Number::from_int(254),
            speed: Number::from_int(100),
        };
        assert_eq!(state.to_string(), "G80 G55 G18 G20 G91 G93 G99 M3 M7 M8");
        let after = state.after_program_end();
        assert_eq!(after.to_string(), "G1 G54 G17 G20 G90 G94 M5 M9");
        assert_eq!((after.feed, after.speed), (state.feed, state.speed));
        assert!(!after.parking);
    }
}
