//! The running move, cut into segments: times, ticks and power.

pub(crate) mod fit;
pub(crate) mod lead;
pub(crate) mod pixel;
pub(crate) mod running;
pub(crate) mod segmenter;
