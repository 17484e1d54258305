//! The end of the path, before its pieces enter the look-ahead: how sharply it turns where two of them meet.

mod curvature;
mod turn;
mod window;

pub(crate) use turn::Turn;
pub(crate) use window::{Piece, Window};
