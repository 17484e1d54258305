//! The places of the axes, and their limits: exact coordinates, the map to motors, limits as
//! polygons.

pub(crate) mod axis_limits;
mod coarse;
pub(crate) mod polygon;
pub(crate) mod target;
pub(crate) mod train;
pub(crate) mod zones;
