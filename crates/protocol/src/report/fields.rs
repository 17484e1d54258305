//! The bits of `$10`: which fields a status report has.

/// Machine position rather than work position.
pub const MACHINE_POSITION: u8 = 1;
/// The bit of `Bf:`.
pub const ROOM: u8 = 2;
/// `Ln:` for lines without an `N` word, too.
pub const LINE: u8 = 4;
/// The bit of `Fin:`.
pub const TIME_LEFT: u8 = 8;
