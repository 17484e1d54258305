//! The queue of planned moves, how fast each may begin, and how long all of them take.

pub(crate) mod lookahead;
mod map;
pub(crate) mod queue;
pub(crate) mod time_left;
