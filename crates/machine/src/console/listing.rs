//! A list under way on one channel.

use crate::protocol::system_command::Enumeration;

/// A list under way on one channel, with the row that is next.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) enum Listing {
    /// `$$`.
    Settings(usize),
    /// `$+`.
    AllSettings(usize),
    /// `$ES`, `$EG`, `$EE`, `$EA`.
    Enumeration(Enumeration, usize),
    /// `$#`.
    Parameters(usize),
    /// `$N`.
    Startup(u8),
    /// `$I`: its first line.
    Version,
    /// `$I`: its second line.
    Options,
    LastEnd,
    /// The answer, after the last row.
    Answer,
}
