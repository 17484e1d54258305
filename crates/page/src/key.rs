//! The switches that a user can press.

/// Something that the user presses.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Key {
    /// Opens or shuts the safety door.
    Door,
    /// Presses the feed hold button.
    Hold,
    /// Presses the cycle start button.
    Start,
    /// Presses the reset button.
    Reset,
    /// Touches the probe, or releases it.
    Probe,
    /// Presses the limit switch of an axis, or releases it.
    Limit(usize),
    /// Presses the limit switch of the second motor, or releases it.
    SecondMotorLimit,
    /// Ends the server.
    Quit,
}
