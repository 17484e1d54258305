//! The path: arcs and their chords, pieces that are joined, and how sharply two pieces meet, before
//! they enter the look-ahead.

pub(crate) mod arc;
mod curvature;
pub(crate) mod curve;
mod joined;
pub(crate) mod junction;
mod probe;
pub(crate) mod row;
pub(crate) mod short;
pub(crate) mod trigonometry;
mod turn;
mod window;

pub(crate) use probe::When;
pub(crate) use turn::Turn;
pub(crate) use window::{Piece, Window, PIECES};
