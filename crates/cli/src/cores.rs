//! Does the same work for many files on all cores.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

/// Does `work` for each of `items` on all cores. Hands the results to `take` in the order of the
/// items, each as soon as it and all before it are there.
///
/// # Errors
/// The first error of `take`; no further item is begun after it.
pub(super) fn in_order<T: Sync, R: Send, E>(
    items: &[T],
    work: impl Fn(&T) -> R + Sync,
    mut take: impl FnMut(R) -> Result<(), E>,
) -> Result<(), E> {
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let (sender, results) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..cores.min(items.len()) {
            let (sender, next, work) = (sender.clone(), &next, &work);
            scope.spawn(move || loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(item) = items.get(index) else { return };
                if sender.send((index, work(item))).is_err() {
                    return;
                }
            });
        }
        drop(sender);
        let mut early = BTreeMap::new();
        let mut due = 0;
        for (index, result) in results {
            early.insert(index, result);
            while let Some(result) = early.remove(&due) {
                due += 1;
                if let Err(error) = take(result) {
                    next.store(items.len(), Ordering::Relaxed);
                    return Err(error);
                }
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn results_come_in_the_order_of_the_items_whoever_is_done_first() {
        let items: Vec<u64> = (0..40).collect();
        let mut seen = Vec::new();
        let slow_at_first = |item: &u64| {
            thread::sleep(Duration::from_millis(9 * u64::from(*item < 3)));
            item * item
        };
        let done: Result<(), ()> = in_order(&items, slow_at_first, |result| {
            seen.push(result);
            Ok(())
        });
        assert_eq!(done, Ok(()));
        assert_eq!(seen, (0..40).map(|item| item * item).collect::<Vec<u64>>());
    }

    #[test]
    fn no_result_is_taken_after_an_error() {
        let items: Vec<u64> = (0..40).collect();
        let mut taken = 0;
        let done = in_order(
            &items,
            |item| *item,
            |item| {
                taken += 1;
                if item == 3 {
                    Err("full")
                } else {
                    Ok(())
                }
            },
        );
        assert_eq!((done, taken), (Err("full"), 4));
    }
}
