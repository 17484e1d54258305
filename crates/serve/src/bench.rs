//! Checks and times a job that somebody has dropped on a page, on a thread of its own beside the
//! machine's.

use leadscrew_jobs::{Finding, Job, Workshop};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::sync::Arc;

/// The job that is being checked and timed.
pub(super) struct Bench {
    workshop: Arc<Workshop>,
    findings: Option<Receiver<Finding>>,
    stop: Arc<AtomicBool>,
}

impl Bench {
    /// A bench without a job.
    pub(super) fn new(workshop: Workshop) -> Self {
        Self {
            workshop: Arc::new(workshop),
            findings: None,
            stop: Arc::default(),
        }
    }

    /// Starts on a job; gives up the job before it.
    pub(super) fn begin(&mut self, job: Job) {
        self.stop.store(true, Ordering::Relaxed);
        let workshop = Arc::clone(&self.workshop);
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

    /// The next finding that the thread has sent, if one waits.
    pub(super) fn next(&self) -> Option<Finding> {
        self.findings.as_ref()?.try_recv().ok()
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}
