//! A pseudo-terminal behind a symbolic link: a serial port for local programs.
//!
//! ```text
//!   sender -- opens --> LINK -> /dev/pts/7 (raw) ==== kernel ==== our end, polled
//! ```
//!
//! The server's end reports a hang-up while no program has the other end open (Linux, tty_ioctl(4)
//! and pty(7)). So the server notices that the port is opened or closed. A program that closes the
//! port and opens it again within a few milliseconds may count as the same client.

use super::line::{LineError, What, CHUNK, RETRY};
use super::uplink::Uplink;
use leadscrew_page::Outlet;
use nix::fcntl::OFlag;
use nix::poll::{poll, PollFd, PollFlags};
use nix::sys::stat::Mode;
use nix::sys::termios::{self, FlushArg, SetArg};
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::sync::Arc;
use std::time::Duration;

/// The time between two checks of whether a program has opened the port.
const CLOSED_POLL: Duration = Duration::from_millis(2);

/// The time between two checks of whether the server ends, milliseconds.
const OPEN_POLL: u16 = 50;

/// Serves one program after the other until the server ends.
pub(super) fn run(link: &Path, uplink: &Uplink) {
    let Some(mut port) = open(link, uplink) else {
        return;
    };
    while !uplink.stopped() {
        if port.is_open() {
            serve(&mut port, uplink);
        } else {
            std::thread::sleep(CLOSED_POLL);
        }
    }
}

/// Makes the port. While it cannot be made, tries again and again, and says so once. `None` if
/// the server ends first.
fn open(link: &Path, uplink: &Uplink) -> Option<Port> {
    let mut said = false;
    while !uplink.stopped() {
        match Port::new(link) {
            Ok(port) => {
                uplink.tell(What::Ready(leadscrew_files::shown(&port.link.device)));
                return Some(port);
            }
            Err(error) => {
                if !std::mem::replace(&mut said, true) {
                    uplink.tell(What::Unavailable(error));
                }
                uplink.pause(RETRY);
            }
        }
    }
    None
}

fn serve(port: &mut Port, uplink: &Uplink) {
    let Ok(writer) = port.master.try_clone() else {
        return;
    };
    let (outlet, pieces) = Outlet::new();
    let peer = leadscrew_files::shown(&port.link.path);
    uplink.tell(What::Opened { peer, outlet });
    let gone = Arc::new(AtomicBool::new(false));
    let seen = gone.clone();
    // This thread ends when the server drops the outlet. After the program has gone, it writes
    // nothing to the next program.
    std::thread::spawn(move || write_all(writer, &pieces, &seen));
    port.read_all(uplink);
    gone.store(true, Ordering::Relaxed);
    uplink.tell(What::Closed);
    port.forget_unread();
}

fn write_all(mut writer: File, pieces: &Receiver<Vec<u8>>, gone: &AtomicBool) {
    for piece in pieces {
        if gone.load(Ordering::Relaxed) || writer.write_all(&piece).is_err() {
            return;
        }
    }
}

/// The server's end, and the link to the other end.
struct Port {
    master: File,
    link: Link,
}

impl Port {
    fn new(link: &Path) -> Result<Self, LineError> {
        let (master, device) = raw_pty().map_err(LineError::NoPty)?;
        let link = Link::new(link, device)?;
        Ok(Self {
            master: File::from(master),
            link,
        })
    }

    fn events(&self, timeout: u16) -> PollFlags {
        let mut fds = [PollFd::new(self.master.as_fd(), PollFlags::POLLIN)];
        match poll(&mut fds, timeout) {
            Ok(_) => fds[0].revents().unwrap_or(PollFlags::empty()),
            Err(_) => PollFlags::empty(),
        }
    }

    /// Returns true if a program has the port open, or has closed it and left bytes to be read.
    fn is_open(&self) -> bool {
        let events = self.events(0);
        !events.contains(PollFlags::POLLHUP) || events.contains(PollFlags::POLLIN)
    }

    /// Reads until the program closes the port or the server ends.
    fn read_all(&mut self, uplink: &Uplink) {
        let mut chunk = [0; CHUNK];
        while !uplink.stopped() {
            if self.events(OPEN_POLL).is_empty() {
                continue;
            }
            match self.master.read(&mut chunk) {
                // The read fails with EIO once the other end is closed and all bytes have been
                // read.
                Ok(0) | Err(_) => return,
                Ok(count) => uplink.pass(&chunk[..count]),
            }
        }
    }

    /// Drops the bytes that the program left unread, so that the next program does not get them.
    /// Only the other end can drop them, so it is opened for this.
    fn forget_unread(&self) {
        let flags = OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_NONBLOCK;
        if let Ok(other) = nix::fcntl::open(&self.link.device, flags, Mode::empty()) {
            // If this fails, the next program sees old lines, as it might on a real port.
            let _ = termios::tcflush(other, FlushArg::TCIFLUSH);
        }
    }
}

/// Opens a pseudo-terminal without echo and line editing. Returns the server's end, and the path of
/// the other end.
fn raw_pty() -> io::Result<(OwnedFd, PathBuf)> {
    let pair = nix::pty::openpty(None, None)?;
    let mut mode = termios::tcgetattr(&pair.slave)?;
    termios::cfmakeraw(&mut mode);
    termios::tcsetattr(&pair.slave, SetArg::TCSANOW, &mode)?;
    let device = nix::unistd::ttyname(&pair.slave)?;
    Ok((pair.master, device))
}

/// The symbolic link; removed when dropped.
struct Link {
    path: PathBuf,
    device: PathBuf,
}

impl Link {
    fn new(path: &Path, device: PathBuf) -> Result<Self, LineError> {
        // A server that was killed may have left this link; its device may be this server's by now.
        let names_ours = std::fs::read_link(path).is_ok_and(|target| target == device);
        // Links elsewhere are not this program's, whether or not something is at their end.
        let to = std::fs::read_link(path);
        let among_ours = to.is_ok_and(|to| to.parent() == device.parent());
        if names_ours || (among_ours && !path.exists()) {
            // If it cannot be removed, making the link fails and reports it.
            let _ = std::fs::remove_file(path);
        }
        symlink(&device, path).map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => LineError::LinkExists,
            _ => LineError::Link(error),
        })?;
        let path = path.to_owned();
        Ok(Self { path, device })
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        if std::fs::read_link(&self.path).is_ok_and(|target| target == self.device) {
            // A link that cannot be removed stays.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_left_behind_to_a_device_that_is_ours_by_now_is_replaced_and_another_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ttyGRBL");
        let [ours, other] = ["ours", "other"].map(|name| folder.path().join(name));
        std::fs::write(&ours, "").unwrap();
        std::fs::write(&other, "").unwrap();
        symlink(&ours, &path).unwrap();
        assert!(Link::new(&path, ours.clone()).is_ok());
        let unplugged = folder.path().join("by-id").join("usb-router");
        for theirs in [other, unplugged] {
            symlink(&theirs, &path).unwrap();
            let refused = Link::new(&path, ours.clone());
            assert!(matches!(refused, Err(LineError::LinkExists)));
            assert_eq!(std::fs::read_link(&path).unwrap(), theirs);
            std::fs::remove_file(&path).unwrap();
        }
    }
}
