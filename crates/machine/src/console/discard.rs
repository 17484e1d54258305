//! What is dropped of the bytes received so far.

use crate::board::ChannelId;
use crate::protocol::serial::Mark;

/// What a reset drops of the bytes received so far.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Discard {
    /// Nothing: the machine reset itself.
    Nothing,
    /// Everything: the reset button.
    All,
    /// What one channel received before its 0x18, and everything of the others.
    Before(ChannelId, Mark),
}
