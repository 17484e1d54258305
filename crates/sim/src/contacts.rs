//! Between the switches and the machine: contacts that bounce, and a board that looks twice.
//!
//! ```text
//!  contact    ____|‾|_|‾|_|‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾
//!                 |<----->|                   bounces
//!  believed   _______________|‾‾‾‾‾‾‾‾‾‾‾‾
//!                 |<-------->|                $706: is it still there? then it counts
//! ```
//!
//! The filter is the firmware's. An edge starts the filter time (`$706`); further edges within it
//! change nothing; the level at its end becomes the believed level.

use crate::clock::{cycles_of_micros, Cycle};
use leadscrew_machine::board::Switches;
use leadscrew_stepper::MotorMask;

/// The contacts between the switches of a simulated machine and its inputs. [`Contacts::default`]
/// neither bounces nor filters.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Contacts {
    /// The time that a limit switch or a probe bounces at each edge, microseconds.
    pub bounce_us: u16,
    /// True if the board filters its inputs for the time of `$706`, as the firmware does.
    pub filtered: bool,
}

/// The number of parts of equal length in a bounce. The level alternates from part to part, and the
/// first part has the new level.
const BOUNCES: u64 = 8;

/// The number of inputs in a word: limits in the low byte, then probe, reset, hold, start, door.
const INPUTS: usize = 13;

/// The levels of the inputs as they are now, and as the filter believes them.
#[derive(Clone, Debug)]
pub(crate) struct Inputs<const MOTORS: usize> {
    bounce: u64,
    filtered: bool,
    /// The filter's time, cycles.
    time: u64,
    /// The levels at which the contacts come to rest.
    resting: u16,
    /// The time at which each contact was last made or broken; `None` once it no longer bounces.
    moved: [Option<Cycle>; INPUTS],
    /// Levels at the last look.
    seen: u16,
    /// For each input, when its filter time ends; `None` if the filter does not wait for it.
    settling: [Option<Cycle>; INPUTS],
    believed: u16,
    /// The motors' places at the edge of the probe.
    at_probe: [i32; MOTORS],
    due: Cycle,
}

/// A message to the machine that believed levels have changed.
pub(crate) struct Told<const MOTORS: usize> {
    pub(crate) levels: Switches,
    /// The motors' places at the edge.
    pub(crate) position: [i32; MOTORS],
}

impl<const MOTORS: usize> Inputs<MOTORS> {
    /// Makes the inputs of a board with these contacts; `None` if the machine sees its switches
    /// directly.
    pub(crate) fn new(contacts: Contacts) -> Option<Self> {
        let open = word(&Switches::OPEN);
        (contacts != Contacts::default()).then(|| Self {
            bounce: cycles_of_micros(u64::from(contacts.bounce_us)),
            filtered: contacts.filtered,
            time: 0,
            resting: open,
            moved: [None; INPUTS],
            seen: open,
            settling: [None; INPUTS],
            believed: open,
            at_probe: [0; MOTORS],
            due: Cycle::NEVER,
        })
    }

    /// Sets the filter's time: `$706`.
    pub(crate) fn set_filter(&mut self, microseconds: u32) {
        self.time = cycles_of_micros(u64::from(microseconds));
    }

    /// The levels that the filter believes.
    pub(crate) fn believed(&self) -> Switches {
        switches(self.believed)
    }

    /// Returns when to look at the inputs next.
    pub(crate) fn due(&self) -> Cycle {
        self.due
    }

    /// Takes the switches' levels as they are, at power-up.
    pub(crate) fn begin(&mut self, levels: &Switches) {
        self.resting = word(levels);
        self.seen = self.resting;
        self.believed = self.resting;
    }

    /// Takes new levels of the switches. `bounces`: a carriage has moved them, so their contacts
    /// bounce.
    pub(crate) fn change(&mut self, levels: &Switches, bounces: bool, now: Cycle) {
        let levels = word(levels);
        let changed = levels ^ self.resting;
        self.resting = levels;
        let moved = (bounces && self.bounce > 0).then_some(now);
        for (_, since) in each(&mut self.moved, changed) {
            *since = moved;
        }
        self.due = now;
    }

    /// Looks at the inputs; returns a message for the machine if a believed level has changed.
    pub(crate) fn look(&mut self, now: Cycle, position: [i32; MOTORS]) -> Option<Told<MOTORS>> {
        let levels = self.levels(now);
        let edges = levels ^ self.seen;
        self.seen = levels;
        let before = self.believed;
        if self.filtered {
            self.filter(edges, levels, now, position);
        } else {
            self.believed = levels;
            self.at_probe = position;
        }
        self.due = self.next(now);
        (self.believed != before).then(|| Told {
            levels: self.believed(),
            position: self.at_probe,
        })
    }

    fn filter(&mut self, edges: u16, levels: u16, now: Cycle, position: [i32; MOTORS]) {
        let due = now + self.time;
        for (input, settling) in each(&mut self.settling, edges) {
            if settling.is_none() {
                *settling = Some(due);
                if input == PROBE {
                    self.at_probe = position;
                }
            }
        }
        for (input, settling) in each(&mut self.settling, u16::MAX) {
            if settling.is_some_and(|due| due <= now) {
                *settling = None;
                let bit = 1 << input;
                self.believed = self.believed & !bit | levels & bit;
            }
        }
    }

    /// The levels on the inputs. Clears the entries of contacts that no longer bounce.
    fn levels(&mut self, now: Cycle) -> u16 {
        let (bounce, mut levels) = (self.bounce, self.resting);
        for (input, moved) in each(&mut self.moved, u16::MAX) {
            let since = moved.map(|moved| now - moved);
            match since.filter(|since| *since < bounce) {
                Some(since) if since * BOUNCES / bounce % 2 == 1 => levels ^= 1 << input,
                Some(_) => {}
                None => *moved = None,
            }
        }
        levels
    }

    fn next(&self, now: Cycle) -> Cycle {
        let flips = self.moved.iter().flatten().map(|moved| {
            let flips = (now - *moved) * BOUNCES / self.bounce + 1;
            *moved + (flips * self.bounce).div_ceil(BOUNCES)
        });
        let looks = self.settling.iter().flatten().copied();
        flips.chain(looks).min().unwrap_or(Cycle::NEVER)
    }
}

const PROBE: usize = 8;

/// The entries of `all` whose bits are set, with their numbers.
fn each<T>(all: &mut [T; INPUTS], bits: u16) -> impl Iterator<Item = (usize, &mut T)> {
    let all = all.iter_mut().enumerate();
    all.filter(move |(input, _)| bits >> input & 1 == 1)
}

fn word(levels: &Switches) -> u16 {
    let rest = [
        levels.probe,
        levels.reset,
        levels.hold,
        levels.start,
        levels.door,
    ];
    let rest = rest.into_iter().enumerate();
    let rest = rest.fold(0, |word, (place, level)| word | u16::from(level) << place);
    u16::from(levels.limits.bits()) | rest << PROBE
}

fn switches(word: u16) -> Switches {
    let level = |place: usize| word >> (PROBE + place) & 1 == 1;
    Switches {
        limits: MotorMask::from_bits(word.to_le_bytes()[0]),
        probe: level(0),
        reset: level(1),
        hold: level(2),
        start: level(3),
        door: level(4),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLOSED: Switches = Switches {
        limits: MotorMask::from_bits(0xFE),
        ..Switches::OPEN
    };

    fn inputs(bounce_us: u16, filter_us: Option<u32>) -> Inputs<1> {
        let contacts = Contacts {
            bounce_us,
            filtered: filter_us.is_some(),
        };
        let mut inputs = Inputs::new(contacts).unwrap();
        inputs.set_filter(filter_us.unwrap_or(0));
        inputs
    }

    /// The times at which the machine learns of each level, in microseconds, if a carriage
    /// closes the switch at 1000.
    fn learns(inputs: &mut Inputs<1>) -> Vec<(u64, bool)> {
        let mut learned = Vec::new();
        inputs.change(&CLOSED, true, Cycle::from_micros(1000));
        while inputs.due() != Cycle::NEVER {
            let now = inputs.due();
            let told = inputs.look(now, [7]);
            learned.extend(told.map(|told| (now.0 / 168, told.levels.limits.contains(0))));
        }
        learned
    }

    #[test]
    fn a_word_of_levels_is_read_as_it_was_written() {
        for bit in 0..INPUTS {
            let levels = 0x1FFF ^ 1 << bit;
            assert_eq!(word(&switches(levels)), levels);
        }
    }

    #[test]
    fn a_contact_bounces_between_both_levels_and_stays_at_the_new_one() {
        let learned = learns(&mut inputs(800, None));
        let expected = (0..9).map(|k| (1000 + 100 * k, k % 2 == 1));
        assert_eq!(learned, expected.collect::<Vec<_>>());
    }

    #[test]
    fn a_filter_longer_than_the_bounce_lets_one_edge_through() {
        assert_eq!(learns(&mut inputs(800, Some(900))), [(1900, false)]);
    }

    #[test]
    fn a_filter_shorter_than_the_bounce_ends_at_the_level_that_stays() {
        let learned = learns(&mut inputs(800, Some(250)));
        assert_eq!(learned.last().map(|(_, open)| *open), Some(false));
        assert!(learned.len() > 1, "{learned:?}");
    }

    #[test]
    fn a_spike_that_is_shorter_than_the_filter_is_forgotten() {
        let mut inputs = inputs(0, Some(200));
        inputs.change(&CLOSED, false, Cycle::from_micros(10));
        assert!(inputs.look(Cycle::from_micros(10), [0]).is_none());
        inputs.change(&Switches::OPEN, false, Cycle::from_micros(15));
        assert!(inputs.look(Cycle::from_micros(15), [0]).is_none());
        assert_eq!(inputs.due(), Cycle::from_micros(210));
        assert!(inputs.look(inputs.due(), [0]).is_none());
        assert_eq!(inputs.due(), Cycle::NEVER);
    }

    #[test]
    fn the_probe_s_position_is_that_of_its_edge() {
        let mut inputs = inputs(0, Some(200));
        let touched = Switches {
            probe: false,
            ..Switches::OPEN
        };
        inputs.change(&touched, true, Cycle::from_micros(10));
        assert!(inputs.look(Cycle::from_micros(10), [5]).is_none());
        let told = inputs.look(Cycle::from_micros(210), [9]).unwrap();
        assert_eq!((told.levels.probe, told.position), (false, [5]));
    }
}
