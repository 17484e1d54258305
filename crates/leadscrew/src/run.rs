//! The main loop as a task, under any executor.
//!
//! | who wakes the task | when |
//! |---|---|
//! | [`crate::Serial`] | after each byte, and when a full queue of answers has room again |
//! | [`crate::Watch::look`] | after an edge |
//! | [`crate::Stepping::tick`] | after a tick that looked for a segment |
//! | the [`Clock`] | at the instant that the machine asked for |

use crate::machine::Machine;
use crate::outputs::Actuators;
use core::convert::Infallible;
use core::future::{poll_fn, Future};
use core::pin::pin;
use core::task::Poll;
use leadscrew_machine::board::Instant;
use leadscrew_machine::extension::Extension;
use leadscrew_machine::machine::Next;
use leadscrew_machine::settings::flash::SettingsStore;
use leadscrew_planner::Kinematics;

/// The time, and a way to await it. Under embassy it is `EmbassyClock`, by the feature `embassy`.
pub trait Clock {
    /// Microseconds since power-up; never goes back.
    fn now(&self) -> Instant;

    /// Waits until `instant` at the least.
    fn until(&self, instant: Instant) -> impl Future<Output = ()>;
}

/// The clock of embassy's time driver, with the feature `embassy`.
///
/// A tick of the driver is to be a microsecond (`embassy-time`'s feature `tick-hz-1_000_000`, its
/// default) or shorter. A longer one is rounded down: the task wakes up to a tick early, and polls
/// until the instant has come.
#[cfg(feature = "embassy")]
#[derive(Clone, Copy, Debug, Default)]
pub struct EmbassyClock;

#[cfg(feature = "embassy")]
impl Clock for EmbassyClock {
    fn now(&self) -> Instant {
        Instant::from_ticks(embassy_time::Instant::now().as_micros())
    }

    async fn until(&self, instant: Instant) {
        // What the driver cannot count to never comes.
        let at = embassy_time::Instant::try_from_micros(instant.ticks());
        embassy_time::Timer::at(at.unwrap_or(embassy_time::Instant::MAX)).await;
    }
}

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Runs the machine for ever, and keeps its settings in `store`. A task of its own.
    ///
    /// A store that cannot be read locks the machine, which says so; a setting that cannot be
    /// written is answered with `error:7`. Writing may keep the executor waiting, for half a second
    /// on some chips: it happens at rest.
    pub async fn run<O, S, C>(&mut self, outputs: &mut O, store: &mut S, clock: &C) -> Infallible
    where
        O: Actuators,
        S: SettingsStore,
        C: Clock,
    {
        // Either error leaves its trace in the machine: it is locked, or the next line that stores
        // something is refused.
        let _ = self.load(store);
        let _ = self.make_room(store);
        loop {
            let mut next = self.poll(outputs, clock.now());
            next.busy |= self.save(store).unwrap_or(false);
            self.rest(next, clock).await;
        }
    }

    /// As [`Machine::run`], without a store: settings are Grbl's after each power-up.
    pub async fn run_without_store<O, C>(&mut self, outputs: &mut O, clock: &C) -> Infallible
    where
        O: Actuators,
        C: Clock,
    {
        loop {
            let next = self.poll(outputs, clock.now());
            self.rest(next, clock).await;
        }
    }

    /// Waits until the machine has to be polled again: the other tasks get at least one turn.
    ///
    /// For a loop of your own around [`Machine::poll`].
    pub async fn rest<C: Clock>(&self, next: Next, clock: &C) {
        if next.busy {
            return yield_now().await;
        }
        let mut heard = pin!(self.bell().heard());
        let mut time = pin!(async {
            match next.when {
                Some(instant) => clock.until(instant).await,
                None => core::future::pending().await,
            }
        });
        poll_fn(|context| {
            // Both are asked, so that either can wake the task.
            let heard = heard.as_mut().poll(context).is_ready();
            match heard || time.as_mut().poll(context).is_ready() {
                true => Poll::Ready(()),
                false => Poll::Pending,
            }
        })
        .await;
    }
}

/// Lets the other tasks run once.
async fn yield_now() {
    let mut yielded = false;
    poll_fn(|context| {
        if core::mem::replace(&mut yielded, true) {
            return Poll::Ready(());
        }
        context.waker().wake_by_ref();
        Poll::Pending
    })
    .await;
}
