//! A mistake in a line.

/// The mistake in a line, and its column, from 1.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Wrong {
    pub(super) column: usize,
    pub(super) message: String,
}

impl Wrong {
    pub(super) fn at(column: usize, message: impl Into<String>) -> Self {
        Self {
            column,
            message: message.into(),
        }
    }
}
