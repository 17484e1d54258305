//! Canned cycles: G73, G81 to G83, G85, G86, G89, as LinuxCNC documents them.
//!
//! ```text
//!   start --rapid--> over the hole           G98: back to the level before the series, or to R if that is higher
//!                     |                      G99: back to R
//!                     v rapid
//!                   R level
//!                     |  feed: at once, or in pecks
//!                     v
//!                   bottom: dwell, spindle stop; then back, in rapid or at the feed rate
//! ```
//!
//! A line becomes one [`Cycle`]. Its moves are made one at a time, as there is room for them: see
//! [`Strokes`].

pub(super) mod holes;
pub(super) mod kind;
pub(super) mod series;
mod strokes;

pub use holes::Cycle;
pub use kind::CycleKind;
pub use strokes::Strokes;
