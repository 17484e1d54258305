//! What a run leaves behind: a picture, a waveform, a list of steps.

pub mod picture;
pub mod steps_csv;
pub mod vcd;
