//! The pty line on systems that have no pseudo-terminals.

use super::line::{LineError, What};
use super::uplink::Uplink;
use std::io;
use std::path::Path;

/// Reports that this system has no pseudo-terminals.
pub(super) fn run(_link: &Path, uplink: &Uplink) {
    uplink.tell(What::Unavailable(LineError::NoPty(
        io::ErrorKind::Unsupported.into(),
    )));
}
