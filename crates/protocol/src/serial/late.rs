//! Realtime commands that find their queue full and must not be lost: `!`, `~`, 0x84 and 0x85.
//!
//! Each kind of command is kept once, in the place of its newest command. So `!~` still ends a hold
//! and `~!` still begins one, however many there were: an earlier command of the same kind changes
//! nothing in the end.
//!
//! The interrupt owns `list`, the main loop owns `taken`: loads and stores are enough. A command
//! that comes while the main loop takes the list is added to it. The main loop then gets some
//! commands twice, which changes nothing.

use crate::realtime::Realtime;
use core::sync::atomic::{AtomicU32, Ordering};

/// The kinds by their number, 1 to 4.
const KINDS: [Realtime; 4] = [
    Realtime::Hold,
    Realtime::Resume,
    Realtime::Door,
    Realtime::JogCancel,
];

/// Bits that the number of a kind takes in the list; the number 0 stands for no command.
const BITS: u32 = 4;
/// The bits of a word that hold the list; above them is a count of its changes.
const LIST: u32 = 0xFFFF;

/// The late commands of one channel.
#[derive(Debug)]
pub(super) struct Late {
    /// Count of changes, and numbers of kinds: the first to be carried out in the lowest bits.
    list: AtomicU32,
    /// The commands that the main loop has taken.
    taken: AtomicU32,
    /// The place of the newest 0x85.
    mark: AtomicU32,
}

impl Late {
    pub(super) const fn new() -> Self {
        Self {
            list: AtomicU32::new(0),
            taken: AtomicU32::new(0),
            mark: AtomicU32::new(0),
        }
    }

    /// Returns true if the main loop has something to take. Any context.
    pub(super) fn waits(&self) -> bool {
        self.list.load(Ordering::Acquire) != self.taken.load(Ordering::Acquire)
    }

    /// Keeps a command that stood at `mark` in the stream; returns whether it is of a kind that is
    /// kept. Serial interrupt.
    pub(super) fn keep(&self, realtime: Realtime, mark: u32) -> bool {
        let Some(number) = number(realtime) else {
            return false;
        };
        if realtime == Realtime::JogCancel {
            self.mark.store(mark, Ordering::Relaxed);
        }
        let word = self.list.load(Ordering::Relaxed);
        let list = if self.waits() { word & LIST } else { 0 };
        self.change(word, moved_back(list, number));
        true
    }

    /// Forgets the commands from before a reset. Serial interrupt.
    pub(super) fn forget(&self) {
        if self.waits() {
            self.change(self.list.load(Ordering::Relaxed), 0);
        }
    }

    fn change(&self, word: u32, list: u32) {
        let count = (word & !LIST).wrapping_add(LIST + 1);
        self.list.store(count | list, Ordering::Release);
    }

    /// The list as it is now. To be taken with [`Late::take`] once all earlier commands are taken.
    /// Main loop.
    pub(super) fn peek(&self) -> u32 {
        self.list.load(Ordering::Acquire)
    }

    /// Takes the commands that [`Late::peek`] has returned. Main loop.
    pub(super) fn take(&self, peeked: u32) -> Taken {
        let fresh = self.taken.load(Ordering::Relaxed) != peeked;
        self.taken.store(peeked, Ordering::Release);
        Taken(if fresh { peeked & LIST } else { 0 })
    }

    /// The place of the newest 0x85. Main loop.
    pub(super) fn mark(&self) -> u32 {
        self.mark.load(Ordering::Relaxed)
    }
}

/// Commands that the main loop has taken, in their order.
#[derive(Debug, Default)]
pub(super) struct Taken(u32);

impl Taken {
    pub(super) fn is_empty(&self) -> bool {
        self.0 == 0
    }

    pub(super) fn next(&mut self) -> Option<Realtime> {
        let number = self.0 % (1 << BITS);
        self.0 >>= BITS;
        KINDS.get(number.checked_sub(1)? as usize).copied()
    }
}

fn number(realtime: Realtime) -> Option<u32> {
    (1..)
        .zip(KINDS)
        .find_map(|(number, kind)| (kind == realtime).then_some(number))
}

/// The list with this number moved to its end.
fn moved_back(list: u32, number: u32) -> u32 {
    let (mut kept, mut end, mut rest) = (0, 0, list);
    while rest != 0 {
        let first = rest % (1 << BITS);
        if first != number {
            kept |= first << end;
            end += BITS;
        }
        rest >>= BITS;
    }
    kept | number << end
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn taken(late: &Late) -> Vec<Realtime> {
        let mut taken = late.take(late.peek());
        core::iter::from_fn(|| taken.next()).collect()
    }

    proptest! {
        #[test]
        fn the_last_of_each_kind_is_kept_in_order(bursts in prop::collection::vec(prop::collection::vec(0..4usize, 0..9), 0..4)) {
            let late = Late::new();
            for burst in bursts {
                let commands: Vec<_> = burst.iter().map(|kind| KINDS[*kind]).collect();
                for command in &commands {
                    prop_assert!(late.keep(*command, 0));
                }
                prop_assert_eq!(late.waits(), !commands.is_empty());
                let mut expected = Vec::new();
                for command in commands.iter().rev() {
                    if !expected.contains(command) {
                        expected.insert(0, *command);
                    }
                }
                prop_assert_eq!(taken(&late), expected);
                prop_assert!(!late.waits());
            }
        }
    }

    #[test]
    fn what_came_before_a_reset_is_forgotten() {
        let late = Late::new();
        late.keep(Realtime::Hold, 0);
        late.forget();
        assert_eq!(taken(&late), []);
        late.keep(Realtime::Resume, 0);
        assert_eq!(taken(&late), [Realtime::Resume]);
    }

    #[test]
    fn overrides_and_reports_are_not_kept() {
        let late = Late::new();
        assert!(!late.keep(Realtime::Report, 0) && !late.keep(Realtime::Flood, 0));
        assert!(!late.waits());
    }
}
