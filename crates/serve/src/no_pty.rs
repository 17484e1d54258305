//! The pty line where there is none.

use super::line::{LineError, What};
use super::uplink::Uplink;
use std::io;
use std::path::Path;

/// Says that there are no pseudo-terminals here.
pub(super) fn run(_link: &Path, uplink: &Uplink) {
    uplink.tell(What::Unavailable(LineError::NoPty(
        io::ErrorKind::Unsupported.into(),
    )));
}
