//! Groups of settings, as senders show them.

/// Settings that belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say it")]
pub enum Group {
    Motors,
    Switches,
    Homing,
    Motion,
    Tool,
    Streaming,
    Reports,
    Axes,
    Silence,
}

impl Group {
    /// All groups: `ALL[x as usize] == x`.
    pub const ALL: [Self; 9] = [
        Self::Motors,
        Self::Switches,
        Self::Homing,
        Self::Motion,
        Self::Tool,
        Self::Streaming,
        Self::Reports,
        Self::Axes,
        Self::Silence,
    ];

    /// Returns the group's number for senders, from 1: 0 is the root of all groups.
    pub const fn id(self) -> u8 {
        self as u8 + 1
    }

    /// Returns the group's title.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Motors => "Motors",
            Self::Switches => "Limits, probe",
            Self::Homing => "Homing",
            Self::Motion => "Path and cycles",
            Self::Tool => "Spindle and laser",
            Self::Streaming => "Streaming",
            Self::Reports => "Reports",
            Self::Axes => "Axes",
            Self::Silence => "Silent sender",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_follow_the_list() {
        let ids = Group::ALL.map(Group::id);
        assert!(ids.iter().copied().eq(1..=9));
    }
}
