//! How the curvature of a path was measured at a turn, for the turn after it.

/// How the curvature was measured at the turn before.
#[derive(Clone, Copy, Debug)]
pub(super) struct Probe<const AXES: usize> {
    /// The length that rounding asks for, mm.
    pub(super) wanted: f32,
    /// How many pieces that is, ahead and behind.
    pub(super) pieces: [u32; 2],
    /// The curvature that was found, over the acceleration of each axis, s²/mm².
    pub(super) before: [f32; AXES],
    /// The curvature when it was last compared with that over a shorter length, 1/mm.
    pub(super) compared: f32,
    /// Whether the path had a curvature at that turn.
    pub(super) is_curved: bool,
    /// Whether the curve goes on as it did: rounding explains what the two pieces turn besides.
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
