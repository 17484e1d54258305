//! What a line's meaning depends on besides the lines before it.

use super::Coordinate;
use crate::config::{AxisKind, Options};
use crate::extension::MCode;
use core::fmt;

/// The settings and build options that decide what a line means.
#[derive(Debug, Clone, Copy)]
pub struct Context<'a, const AXES: usize> {
    /// Linear axes take inches in G20, rotary ones never.
    pub axes: &'a [AxisKind; AXES],
    /// M7 and M56 are refused where the machine is built without them.
    pub options: &'a Options,
    /// `$32`: spindle words are laser words.
    pub laser_mode: bool,
    /// `$20`: a target beyond `reach` is taken, as one just beyond it, which lies outside every travel: the alarm is
    /// then the answer, as in Grbl. Without, it is refused.
    pub soft_limits: bool,
    /// The farthest machine coordinate to either side, by axis: what steps can count. Half the range of `i32` divided
    /// by the steps per mm keeps every move countable, too. At most [`MAX_WORD`](super::MAX_WORD).
    pub reach: &'a [Coordinate; AXES],
    /// M codes beyond GRBL's.
    pub own: OwnCodes<'a>,
}

/// The M codes of an extension.
#[derive(Clone, Copy, Default)]
pub struct OwnCodes<'a>(Option<&'a dyn Fn(u8) -> Option<MCode>>);

impl<'a> OwnCodes<'a> {
    /// None at all.
    pub const NONE: Self = Self(None);

    /// Those for which `find` has an answer.
    pub const fn new(find: &'a dyn Fn(u8) -> Option<MCode>) -> Self {
        Self(Some(find))
    }

    /// The M code of this number.
    pub(super) fn find(self, number: u8) -> Option<MCode> {
        self.0?(number)
    }
}

impl fmt::Debug for OwnCodes<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("OwnCodes").field(&self.0.is_some()).finish()
    }
}
