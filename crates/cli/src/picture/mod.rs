//! The picture of a job: the toolpath seen from above, and the speed along time under it.
//!
//! ```text
//!  title, summary line
//!  +------------------------+
//!  | Y mm                   |   cuts (laser power grey, depth in colour), travels dashed,
//!  |      toolpath          |   equal scales, grid, direction, start and end marked
//!  +------------------ X mm +
//!  | mm/min                 |
//!  |      speed             |
//!  +---------------- time s +
//!  legend
//! ```

mod columns;
mod ink;
mod limits;
mod page;
mod raster;
mod scale;
mod speed;
mod svg;
mod toolpath;

pub(crate) use limits::draw_limits;
pub(crate) use svg::{draw, Caption};
pub(crate) use toolpath::{StrokeKind, Toolpath};
