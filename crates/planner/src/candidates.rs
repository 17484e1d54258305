//! The moves that may be the minimum of the look-ahead, in order: their keys (see `lookahead`) rise.
//!
//! While caps change (an override), there are two lists, each with rising keys:
//!
//! ```text
//!      [ old ones, of moves to be done ->  ][ new ones, of those that are done -> ]  gap, and round to the begin
//! ```
//!
//! A list has no more entries than there are moves in its part of the queue, so the two together have room in the ring, and the
//! new one does not catch up with the old one. The minimum is that of both first entries.

/// Numbers of moves, modulo 2¹⁶.
#[derive(Debug)]
pub(crate) struct Candidates<'q> {
    ring: &'q mut [u16],
    done: Span,
    to_do: Span,
}

/// A part of the ring.
#[derive(Clone, Copy, Debug)]
struct Span {
    start: usize,
    len: usize,
}

impl Span {
    const EMPTY: Self = Self { start: 0, len: 0 };
}

impl<'q> Candidates<'q> {
    /// None, in room for as many as there can be moves.
    pub(crate) fn new(ring: &'q mut [u16]) -> Self {
        Self {
            ring,
            done: Span::EMPTY,
            to_do: Span::EMPTY,
        }
    }

    pub(crate) fn clear(&mut self) {
        self.done = Span::EMPTY;
        self.to_do = Span::EMPTY;
    }

    /// The first candidates: among moves with new caps, and among those with old ones.
    pub(crate) fn first(&self) -> [Option<u16>; 2] {
        [self.done, self.to_do].map(|span| self.at(span, 0))
    }

    /// The place in each list of its first candidate that does not come `before`, by halving.
    pub(crate) fn places(&self, before: impl Fn(u16) -> bool) -> [usize; 2] {
        [self.done, self.to_do].map(|span| {
            let (mut low, mut high) = (0, span.len);
            while low < high {
                let middle = (low + high) / 2;
                if self.at(span, middle).is_some_and(&before) {
                    low = middle + 1;
                } else {
                    high = middle;
                }
            }
            low
        })
    }

    /// The candidates at `places`, one of each list.
    pub(crate) fn at_places(&self, [done, to_do]: [usize; 2]) -> [Option<u16>; 2] {
        [self.at(self.done, done), self.at(self.to_do, to_do)]
    }

    /// Moves `places` past the move `number` where it is the candidate there.
    pub(crate) fn skip(&self, places: &mut [usize; 2], number: u16) {
        let found = self.at_places(*places);
        for (place, candidate) in places.iter_mut().zip(found) {
            if candidate == Some(number) {
                *place += 1;
            }
        }
    }

    /// Removes the move `number` if it is the first of a list.
    pub(crate) fn leave(&mut self, number: u16) {
        if self.at(self.done, 0) == Some(number) {
            self.done = self.rest(self.done);
        }
        if self.at(self.to_do, 0) == Some(number) {
            self.to_do = self.rest(self.to_do);
        }
    }

    /// Removes the move `number` if it is the last one.
    pub(crate) fn drop_last(&mut self, number: u16) {
        let last = self.done.len.wrapping_sub(1);
        if self.at(self.done, last) == Some(number) {
            self.done.len = last;
        }
    }

    /// Keeps those for which `stays`: all up to some place, none after it. One or two questions where one or none goes, two
    /// for each doubling of their number otherwise.
    pub(crate) fn keep(&mut self, stays: impl Fn(u16) -> bool) {
        let stays = |list: &Self, index| list.at(list.done, index).is_some_and(&stays);
        let Some(last) = self.done.len.checked_sub(1) else {
            return;
        };
        if stays(self, last) {
            return;
        }
        let (mut gone, mut reach) = (last, 1);
        let mut kept = loop {
            match last.checked_sub(reach) {
                None => break 0,
                Some(place) if stays(self, place) => break place + 1,
                Some(place) => gone = place,
            }
            reach *= 2;
        };
        while kept < gone {
            let middle = (kept + gone) / 2;
            if stays(self, middle) {
                kept = middle + 1;
            } else {
                gone = middle;
            }
        }
        self.done.len = kept;
    }

    /// Appends a candidate. There is room: no more candidates than moves.
    pub(crate) fn push(&mut self, number: u16) {
        let place = self.wrapped(self.done.start + self.done.len);
        if let Some(entry) = self.ring.get_mut(place) {
            *entry = number;
            self.done.len += 1;
        }
    }

    /// Makes one list of both: a change of caps is broken off by the next one. An old entry is read before its place is needed.
    pub(crate) fn join(&mut self, key: impl Fn(u16) -> Option<u64>) {
        let old = self.to_do;
        self.to_do = Span::EMPTY;
        if let Some(first) = self.at(old, 0) {
            self.keep(|number| key(number) < key(first));
        }
        for index in 0..old.len {
            if let Some(number) = self.at(old, index) {
                self.push(number);
            }
        }
    }

    /// Has the caps of all moves done anew: from now on the candidates are those to be done.
    pub(crate) fn begin_anew(&mut self) {
        self.to_do = self.done;
        self.done = Span {
            start: self.wrapped(self.to_do.start + self.to_do.len),
            len: 0,
        };
    }

    fn at(&self, span: Span, index: usize) -> Option<u16> {
        if index >= span.len {
            return None;
        }
        self.ring.get(self.wrapped(span.start + index)).copied()
    }

    fn rest(&self, span: Span) -> Span {
        Span {
            start: self.wrapped(span.start + 1),
            len: span.len.saturating_sub(1),
        }
    }

    /// A place below twice the capacity, brought into the ring.
    fn wrapped(&self, place: usize) -> usize {
        if place >= self.ring.len() {
            place - self.ring.len()
        } else {
            place
        }
    }
}
