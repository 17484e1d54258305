//! The speed along one move: ramps of constant acceleration, and their mean over a time.

pub(crate) mod mean;
pub(crate) mod plan;
pub(crate) mod profile;
