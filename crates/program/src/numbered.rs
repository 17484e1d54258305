//! Numbered parameters that have been set.

use crate::fault::ErrorKind;
use crate::value::Value;
use heapless::Vec;

/// Parameters of a subprogram's own: #1 to #30.
pub(crate) const OWN: usize = 30;

/// #1 to #30, of one call.
pub(crate) type Locals = [Value; OWN];

/// Numbers above 30 and their values, sorted.
#[derive(Debug)]
pub(crate) struct Numbered<const ROOM: usize>(Vec<(u16, Value), ROOM>);

impl<const ROOM: usize> Numbered<ROOM> {
    pub(crate) const fn new() -> Self {
        Self(Vec::new())
    }

    fn find(&self, number: u16) -> Result<usize, usize> {
        self.0.binary_search_by_key(&number, |(number, _)| *number)
    }

    /// The value; 0 if it has not been set.
    pub(crate) fn get(&self, number: u16) -> Value {
        let found = self.find(number).ok().and_then(|at| self.0.get(at));
        found.map_or(Value::ZERO, |(_, value)| *value)
    }

    /// Returns true if it has been set.
    pub(crate) fn has(&self, number: u16) -> bool {
        self.find(number).is_ok()
    }

    /// Returns how many more can be set.
    pub(crate) fn room(&self) -> usize {
        ROOM - self.0.len()
    }

    pub(crate) fn set(&mut self, number: u16, value: Value) -> Result<(), ErrorKind> {
        match self.find(number) {
            Ok(at) => {
                if let Some((_, old)) = self.0.get_mut(at) {
                    *old = value;
                }
                Ok(())
            }
            Err(at) => self
                .0
                .insert(at, (number, value))
                .map_err(|_| ErrorKind::ManyParameters),
        }
    }
}
