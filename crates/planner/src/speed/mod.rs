//! The speed along one move: ramps of constant acceleration or of limited jerk.

pub(crate) mod plan;
pub(crate) mod profile;
pub(crate) mod ramp;
pub(crate) mod s_curve;
