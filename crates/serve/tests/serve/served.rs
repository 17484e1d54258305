//! A server in a thread of its own.

use crate::client::{Client, PATIENCE};
use leadscrew_serve::{
    serve, Allowed, Key, LineSpec, Note, Panel, Service, Snapshot, StateFile, Surroundings,
};
use leadscrew_sim::profile::Profile;
use leadscrew_sim::Rate;
use std::net::TcpStream;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Instant;

/// Passes all messages on.
struct Ear(Sender<String>);

impl Panel for Ear {
    fn note(&mut self, note: &Note<'_>) {
        // The test may have ended already.
        let _ = self.0.send(note.to_string());
    }
    fn show(&mut self, _: &Snapshot) {}
    fn key(&mut self) -> Option<Key> {
        None
    }
}

/// A server in a thread of its own; ends when dropped.
pub(crate) struct Served {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    /// The addresses of the lines.
    pub(crate) ready: Vec<String>,
    /// The other messages before all lines were ready.
    pub(crate) said: Vec<String>,
    /// The messages after all lines were ready.
    pub(crate) heard: Receiver<String>,
}

impl Served {
    pub(crate) fn new(profile: &str, lines: Vec<LineSpec>, speed: f64) -> Self {
        Self::start(Service {
            profile: Profile::parse(Path::new("test.toml"), profile).unwrap(),
            speed,
            lines,
            ..one_line()
        })
    }

    pub(crate) fn start(service: Service) -> Self {
        let (told, heard) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let count = service.lines.len();
        let end = stop.clone();
        let thread = std::thread::spawn(move || {
            let begun = Instant::now();
            let clock = || begun.elapsed();
            let panel = &mut Ear(told);
            serve(
                service,
                Surroundings {
                    clock: &clock,
                    stop: &end,
                    panel,
                },
            );
        });
        let mut served = Self {
            stop,
            thread: Some(thread),
            ready: Vec::new(),
            said: Vec::new(),
            heard,
        };
        while served.ready.len() < count {
            let note = served.heard.recv_timeout(PATIENCE).unwrap();
            match note.split_once(": ready at ") {
                Some((_, at)) => served.ready.push(at.into()),
                None => served.said.push(note),
            }
        }
        served
    }

    /// Serves a machine whose settings are stored in `file`.
    pub(crate) fn remembering(file: &Path) -> Self {
        Self::start(Service {
            state: Some(StateFile::new(file).unwrap()),
            ..one_line()
        })
    }

    pub(crate) fn tcp(profile: &str, speed: f64) -> Self {
        Self::new(profile, vec![LineSpec::Tcp("127.0.0.1:0".into())], speed)
    }

    pub(crate) fn connect(&self) -> Client {
        let stream = TcpStream::connect(&self.ready[0]).unwrap();
        stream.set_nodelay(true).unwrap();
        Client::new(stream.try_clone().unwrap(), stream)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(
                ended.is_ok() || std::thread::panicking(),
                "the server has panicked"
            );
        }
    }
}

pub(crate) const FAST: &str = "[settings]\n\"$110\"=6000\n\"$111\"=6000\n\"$112\"=3000\n\"$120\"=800\n\"$121\"=800\n\"$122\"=800\n";

/// A fast machine on one line, in real time.
pub(crate) fn one_line() -> Service {
    Service {
        profile: Profile::parse(Path::new("test.toml"), FAST).unwrap(),
        rate: Rate::NeverWaits,
        speed: 1.0,
        state: None,
        log: None,
        lines: vec![LineSpec::Tcp("127.0.0.1:0".into())],
        allowed: Allowed::default(),
    }
}
