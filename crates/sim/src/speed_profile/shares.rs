//! The share of the job's time in which each limit binds.

use super::{Limit, Stretch};
use std::collections::BTreeMap;

/// The time in which a limit binds.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Share {
    /// The limit.
    pub limit: Limit,
    /// CPU cycles.
    pub cycles: u64,
}

/// Returns the limits of a job, those that bind longest first.
pub fn shares(stretches: &[Stretch]) -> Vec<Share> {
    add_up(BTreeMap::new(), stretches)
}

/// As [`shares`], beginning with `sums`.
pub(super) fn add_up(mut sums: BTreeMap<Limit, u64>, stretches: &[Stretch]) -> Vec<Share> {
    for stretch in stretches {
        *sums.entry(stretch.limit).or_insert(0) += stretch.cycles();
    }
    let mut shares: Vec<Share> = sums
        .into_iter()
        .map(|(limit, cycles)| Share { limit, cycles })
        .collect();
    shares.sort_by_key(|share| std::cmp::Reverse(share.cycles));
    shares
}
