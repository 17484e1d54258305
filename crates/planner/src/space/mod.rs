//! Where the axes are, and what they leave: exact coordinates, the map to motors, limits as polygons.

pub(crate) mod coordinate;
pub(crate) mod ground;
pub(crate) mod kinematics;
pub(crate) mod polygon;
