//! Prelude

pub use eh0::prelude::*;
