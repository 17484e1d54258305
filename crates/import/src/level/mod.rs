//! Bends a job so that its depth follows a surface that is not flat.
//!
//! The user probes the surface at the places of a grid. [`Map::read`] reads the places and their
//! heights, and [`job()`] adds to each Z of the job the height below it. Lines and arcs are cut into
//! pieces that are straight to a tolerance.

mod arc;
mod job;
mod map;

pub use job::job;
pub use map::Map;
