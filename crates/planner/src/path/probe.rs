//! The time at which the curvature at a turn is measured, and the result, which is kept for the
//! next turn.

/// The time at which a turn is found.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum When {
    /// At once, from the path known so far.
    Now,
    /// Once enough path is known for it.
    Known,
}

/// The measurement at the turn before.
#[derive(Clone, Copy, Debug)]
pub(super) struct Probe<const AXES: usize> {
    /// The length to measure over, so that rounding does not matter, mm.
    pub(super) wanted: f32,
    /// The number of pieces within that length, ahead and back.
    pub(super) pieces: [u32; 2],
    /// The curvature that was measured, divided by the acceleration of each axis, s²/mm².
    pub(super) before: [f32; AXES],
    /// The curvature that was last compared with the one over a shorter length, 1/mm.
    pub(super) compared: f32,
    /// True if the path had a curvature at that turn.
    pub(super) is_curved: bool,
    /// True if the curve went on as at the turn before it: apart from rounding, it explains the
    /// turn.
    pub(super) goes_on: bool,
}

impl<const AXES: usize> Probe<AXES> {
    pub(super) const NEW: Self = Self {
        wanted: 0.0,
        pieces: [0; 2],
        before: [0.0; AXES],
        compared: 0.0,
        is_curved: false,
        goes_on: false,
    };
}
