//! The picture of a job: the toolpath seen from above, and the speed along time under it.
//!
//! ```text
//!  title, summary line
//!  +------------------------+
//!  | Y mm                   |   cuts (laser power as shade), rapids dashed,
//!  |      toolpath          |   equal scales, grid, start and end marked
//!  +------------------ X mm +
//!  | mm/min                 |
//!  |      speed             |
//!  +---------------- time s +
//!  legend
//! ```

mod columns;
mod limits;
mod page;
mod scale;
mod speed;
mod svg;
mod toolpath;

pub(crate) use limits::draw_limits;
pub(crate) use speed::SpeedChart;
pub(crate) use svg::{draw, Caption};
pub(crate) use toolpath::{Stroke, StrokeKind, Toolpath};
