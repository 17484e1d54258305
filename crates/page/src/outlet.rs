//! The way for bytes to one client.

use std::sync::mpsc::{self, SyncSender};

/// Pieces of output that may wait for a client that does not read.
const ROOM: usize = 1024;

/// Takes bytes for one client; after the client has disconnected, it drops them.
#[derive(Debug)]
pub struct Outlet(SyncSender<Vec<u8>>);

impl Outlet {
    /// Makes an outlet, and the receiver of its bytes.
    pub fn new() -> (Self, mpsc::Receiver<Vec<u8>>) {
        let (sender, receiver) = mpsc::sync_channel(ROOM);
        (Self(sender), receiver)
    }

    /// Sends `bytes`; returns whether there was room for them. Never waits.
    pub fn send(&self, bytes: Vec<u8>) -> bool {
        !matches!(self.0.try_send(bytes), Err(mpsc::TrySendError::Full(_)))
    }
}
