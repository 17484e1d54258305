//! M codes beyond GRBL's, and their words.

use leadscrew_gcode::{Letter, Number};

/// An M code of an extension.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MCode {
    /// The letters of the words that belong to the code, a bit each.
    letters: u32,
    /// True if the rest of its line waits for its end.
    first: bool,
}

impl MCode {
    /// An M code without words of its own. Its line may have any other words.
    pub const PLAIN: Self = Self {
        letters: 0,
        first: false,
    };

    /// Makes an M code that takes these words, each one of `L`, `P`, `R`, `S` and `T`: on its line
    /// they mean nothing to GRBL. The line may leave out any of them.
    pub const fn with(words: &[Letter]) -> Self {
        let (mut letters, mut rest) = (0, words);
        while let [letter, tail @ ..] = rest {
            letters |= 1 << *letter as u32;
            rest = tail;
        }
        Self {
            letters,
            first: false,
        }
    }

    /// Returns the same M code, carried out before all else of its line: the other words of the
    /// line get their meaning once it is done. An M code that moves axes, or is put aside, has to
    /// come first.
    pub const fn first(self) -> Self {
        Self {
            first: true,
            ..self
        }
    }

    /// The letters of its words, a bit each.
    pub(crate) const fn letters(self) -> u32 {
        self.letters
    }

    /// Returns true if the rest of its line waits for its end.
    pub const fn is_first(self) -> bool {
        self.first
    }

    /// Returns true if this word belongs to it.
    pub const fn takes(self, letter: Letter) -> bool {
        self.letters & 1 << letter as u32 != 0
    }
}

/// An M code of an extension, as a line has it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Call {
    /// Its number.
    pub code: u8,
    /// The words that belong to it.
    pub words: Words,
}

/// Words of a line that belong to an M code of an extension.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Words {
    /// The letters that the line has of them, a bit a letter.
    letters: u32,
    values: [Number; Self::LETTERS.len()],
}

impl Words {
    /// The letters that such words can have.
    pub const LETTERS: [Letter; 5] = [Letter::L, Letter::P, Letter::R, Letter::S, Letter::T];
    /// No words.
    pub const NONE: Self = Self {
        letters: 0,
        values: [Number::from_int(0); Self::LETTERS.len()],
    };

    /// Returns the value of a word, if the line has it.
    pub fn get(&self, letter: Letter) -> Option<Number> {
        let has = self.letters & 1 << letter as u32 != 0;
        let mut words = Self::LETTERS.iter().zip(self.values);
        let value = words.find_map(|(of, value)| (*of == letter).then_some(value));
        value.filter(|_| has)
    }

    /// Adds a word.
    pub fn insert(&mut self, letter: Letter, value: Number) {
        let mut words = Self::LETTERS.iter().zip(&mut self.values);
        if let Some((_, place)) = words.find(|(of, _)| **of == letter) {
            *place = value;
            self.letters |= 1 << letter as u32;
        }
    }
}
