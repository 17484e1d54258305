//! The received bytes that a reset drops.

use crate::board::ChannelId;
use crate::protocol::serial::Mark;

/// Says which received bytes a reset drops.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Discard {
    /// Nothing: the machine reset itself.
    Nothing,
    /// Everything: the reset button.
    All,
    /// The bytes of one channel before its 0x18, and all bytes of the others.
    Before(ChannelId, Mark),
}
