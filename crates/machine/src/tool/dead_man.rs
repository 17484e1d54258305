//! The dead-man's switch of a laser that is lit at rest: its sender has to be heard, or the laser
//! goes dark.
//!
//! ```text
//!            lit at rest               silent for $707
//!   Dark  ----------------> Lit since  ---------------> Expired
//!     ^ <------------------                                |
//!     |    anything else                                   |
//!     +------- G1, G2, G3 of the same line, M5, a reset ---+
//! ```

use crate::board::{Duration, Instant};

/// The state of a laser that may be lit at rest.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) enum DeadMan {
    /// Nothing is lit at rest.
    #[default]
    Dark,
    /// Lit at rest, and its sender was heard last at this instant.
    Lit(Instant),
    /// The sender was silent for too long: dark, until the program cuts again.
    Expired,
}

impl DeadMan {
    /// Looks at the laser: `lit` at rest, with nothing under way; `heard`: a byte has come from its
    /// sender since the last look. Returns `true` once, when the sender has been silent for
    /// `limit`. Main loop, at every turn.
    pub(crate) fn watch(
        &mut self,
        lit: bool,
        heard: bool,
        limit: Option<Duration>,
        now: Instant,
    ) -> bool {
        *self = match *self {
            Self::Expired => return false,
            Self::Dark | Self::Lit(_) if !lit => Self::Dark,
            Self::Lit(since) if !heard => Self::Lit(since),
            Self::Dark | Self::Lit(_) => Self::Lit(now),
        };
        let expires = self.expires_at(|| limit).is_some_and(|end| now >= end);
        if expires {
            *self = Self::Expired;
        }
        expires
    }

    /// When the laser goes dark if nothing is heard until then; `None` if it is not lit.
    pub(crate) fn expires_at(&self, limit: impl FnOnce() -> Option<Duration>) -> Option<Instant> {
        match *self {
            Self::Lit(since) => since.checked_add_duration(limit()?),
            Self::Dark | Self::Expired => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: Option<Duration> = Some(Duration::from_ticks(100));

    /// When the laser expires. `looks`: instants of a look, each with whether its sender was heard.
    fn expiry(limit: Option<Duration>, looks: &[(u64, bool)]) -> Option<u64> {
        let mut dead_man = DeadMan::default();
        let mut expires = |(at, heard): &(u64, bool)| {
            dead_man.watch(true, *heard, limit, Instant::from_ticks(*at))
        };
        looks.iter().find(|look| expires(look)).map(|(at, _)| *at)
    }

    #[test]
    fn a_silent_sender_expires_once_the_time_is_over() {
        let looks = [(0, true), (99, false), (100, false), (101, false)];
        assert_eq!(expiry(LIMIT, &looks), Some(100));
        assert_eq!(expiry(None, &looks), None);
    }

    #[test]
    fn each_byte_begins_the_time_anew() {
        let looks = [(0, true), (99, true), (198, false), (199, false)];
        assert_eq!(expiry(LIMIT, &looks), Some(199));
    }

    #[test]
    fn a_laser_that_was_dark_meanwhile_has_all_its_time() {
        let mut dead_man = DeadMan::Lit(Instant::from_ticks(0));
        dead_man.watch(false, false, LIMIT, Instant::from_ticks(99));
        assert_eq!(dead_man, DeadMan::Dark);
        let now = Instant::from_ticks(150);
        assert!(!dead_man.watch(true, false, LIMIT, now));
        let end = dead_man.expires_at(|| LIMIT).unwrap();
        assert_eq!(end, Instant::from_ticks(250));
    }

    #[test]
    fn what_has_expired_expires_no_second_time() {
        let mut dead_man = DeadMan::Expired;
        assert!(!dead_man.watch(true, true, LIMIT, Instant::from_ticks(1000)));
        assert_eq!(dead_man, DeadMan::Expired);
    }
}
