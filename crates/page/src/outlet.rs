//! Where bytes for one client go.

use std::sync::mpsc::{self, SyncSender};

/// Pieces of output that may wait for a client that does not read.
const ROOM: usize = 1024;

/// Takes bytes for one client; once the client has gone, nothing.
#[derive(Debug)]
pub struct Outlet(SyncSender<Vec<u8>>);

impl Outlet {
    /// Makes an outlet, and the end at which its reader waits.
    pub fn new() -> (Self, mpsc::Receiver<Vec<u8>>) {
        let (sender, receiver) = mpsc::sync_channel(ROOM);
        (Self(sender), receiver)
    }

    /// Sends `bytes`; answers whether there was room for them. Never waits.
    pub fn send(&self, bytes: Vec<u8>) -> bool {
        !matches!(self.0.try_send(bytes), Err(mpsc::TrySendError::Full(_)))
    }
}
