//! Wakes a task that sleeps, from any context.

use core::sync::atomic::{AtomicBool, Ordering};
#[cfg(feature = "async")]
use {
    core::cell::RefCell,
    core::future::poll_fn,
    core::task::{Poll, Waker},
    critical_section::Mutex,
};

/// A bell that handlers ring, and that one task hears. Rings that nobody has heard yet are one.
pub(crate) struct Bell {
    rung: AtomicBool,
    #[cfg(feature = "async")]
    sleeper: Mutex<RefCell<Option<Waker>>>,
}

impl Bell {
    pub(crate) const fn new() -> Self {
        Self {
            rung: AtomicBool::new(false),
            #[cfg(feature = "async")]
            sleeper: Mutex::new(RefCell::new(None)),
        }
    }

    /// Rings. Any context.
    pub(crate) fn ring(&self) {
        self.rung.store(true, Ordering::Release);
        #[cfg(feature = "async")]
        if let Some(sleeper) = critical_section::with(|cs| self.sleeper.borrow_ref_mut(cs).take()) {
            sleeper.wake();
        }
    }

    /// Forgets the rings so far. Called before the work that they ask for, so that a ring during
    /// the work is heard after it.
    pub(crate) fn clear(&self) {
        self.rung.store(false, Ordering::Release);
    }

    /// Returns whether the bell was rung since it was cleared.
    pub(crate) fn is_rung(&self) -> bool {
        self.rung.load(Ordering::Acquire)
    }

    /// Sleeps until the bell is rung, or returns at once if it was since it was cleared.
    #[cfg(feature = "async")]
    pub(crate) async fn heard(&self) {
        poll_fn(|context| {
            critical_section::with(|cs| {
                *self.sleeper.borrow_ref_mut(cs) = Some(context.waker().clone());
            });
            // A ring before this line has set the flag; a ring after it wakes the sleeper.
            match self.is_rung() {
                true => Poll::Ready(()),
                false => Poll::Pending,
            }
        })
        .await;
    }
}
