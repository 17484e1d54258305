//! The picture of a job: the toolpath seen from above, and the speed along time under it.
//!
//! ```text
//!  title, summary line
//!  +------------------------+
//!  | Y mm                   |   cuts (laser power grey, depth in colour), travels dashed,
//!  |      toolpath          |   as wide as its tool, equal scales, grid, direction, start and end
//!  |                        |   marked, holes as wide as their drills
//!  +------------------ X mm +
//!  | mm/min                 |
//!  |      speed             |
//!  +---------------- time s +
//!  legend
//! ```

mod caption;
mod columns;
mod ink;
mod legend;
mod limits;
mod line;
mod page;
mod plot;
mod raster;
mod scale;
mod speed;
mod svg;
mod window;

pub(crate) use caption::Caption;
pub(crate) use limits::draw_limits;
pub(crate) use svg::draw;
