//! An error or alarm number of an extension.

use crate::settings::enumeration::{AlarmInfo, ErrorInfo};

/// An error or alarm number of an extension, with its texts. Numbers 220 to 254 are free for
/// extensions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OwnCode {
    /// The number that is sent.
    pub number: u8,
    /// The event in a few words without a full stop, 60 characters at most; neither `ok`, `error`
    /// nor `alarm` in it.
    pub text: &'static str,
    /// The cause and the remedy, in whole sentences.
    pub explanation: &'static str,
}

impl From<&OwnCode> for ErrorInfo {
    fn from(of: &OwnCode) -> Self {
        Self {
            number: of.number,
            text: of.text,
        }
    }
}

impl From<&OwnCode> for AlarmInfo {
    fn from(of: &OwnCode) -> Self {
        Self {
            number: of.number,
            text: of.text,
        }
    }
}
