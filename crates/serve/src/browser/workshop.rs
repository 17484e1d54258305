//! Where jobs are looked at that somebody has dropped on a page: beside the machine, on a thread of its own.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::sync::Arc;

/// A job to be looked at.
#[derive(Clone, PartialEq, Debug)]
pub struct Job {
    /// The name of its file.
    pub name: String,
    /// Its text.
    pub text: Vec<u8>,
    /// The machine's settings, lines as `$$` prints them.
    pub settings: String,
    /// Where work zero is, machine position, axis by axis, mm.
    pub origin: Vec<f32>,
}

/// Something that is known of a job. They come in this order, [`Finding::Progress`] again and again.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Finding {
    /// Moves of the job in work coordinates: [`Drawn`](leadscrew_sim::scene::Drawn)s.
    Scene(Vec<u8>),
    /// The output of `leadscrew check --json`.
    Check(String),
    /// How much of the job has been timed, percent.
    Progress(u8),
    /// The output of `leadscrew profile --json`.
    Profile(String),
}

/// Looks at jobs.
pub trait Workshop: Send + Sync {
    /// Looks at a job; hands over each finding at once, and ends soon once `go_on` answers no.
    fn look(&self, job: &Job, go_on: &dyn Fn() -> bool, tell: &mut dyn FnMut(Finding));
}

/// The job that is being looked at.
pub(crate) struct Bench {
    workshop: Option<Arc<dyn Workshop>>,
    findings: Option<Receiver<Finding>>,
    stop: Arc<AtomicBool>,
}

impl Bench {
    /// A bench without a job.
    pub(crate) fn new(workshop: Option<Arc<dyn Workshop>>) -> Self {
        Self {
            workshop,
            findings: None,
            stop: Arc::default(),
        }
    }

    /// Looks at a job; gives up on the one before.
    pub(crate) fn begin(&mut self, job: Job) {
        self.stop.store(true, Ordering::Relaxed);
        let Some(workshop) = self.workshop.clone() else {
            return;
        };
        self.stop = Arc::default();
        let stop = self.stop.clone();
        let (found, findings) = mpsc::channel();
        self.findings = Some(findings);
        std::thread::spawn(move || {
            let go_on = || !stop.load(Ordering::Relaxed);
            workshop.look(&job, &go_on, &mut |finding| {
                if found.send(finding).is_err() {
                    stop.store(true, Ordering::Relaxed);
                }
            });
        });
    }

    /// The next finding since the last call.
    pub(crate) fn next(&self) -> Option<Finding> {
        self.findings.as_ref()?.try_recv().ok()
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}
