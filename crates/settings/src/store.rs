//! Records that survive a power loss at any moment.
//!
//! ```text
//!   area 1: header | G54 | $100 | commit | $110 | $100 | ...
//!   area 2: header | $100 | G54 | $110 | commit | ...
//! ```
//!
//! Each change is appended to the area in use; the last record of a key counts. When the area is
//! full, the records that count are copied to the other area, which is then in use.
//!
//! A record counts once its checksum, written last, is there: before that the old value stands. An
//! area counts once its commit record is there: before that the other area stands. So each value is
//! the old or the new one, never a mixture. All that one [`Records::retain`] removes is removed
//! together, or not at all.
//!
//! The memory may err without saying so. Everything that is written is read back: a record before
//! it counts as stored, a copy before its commit record is written. After a fault the other area is
//! written, once more if need be.
//!
//! After an erase that power interrupted, cells may read as erased and lose later writes. The
//! header is written after the erase: an area without one is erased again, whatever it reads as.

use super::flash::{Area, SettingsStore};
use super::record::{
    area_header, record, Payload, RecordKey, AREA_HEADER, COMMIT, MAX_PAYLOAD, OVERHEAD,
};
use super::scan::{note, read_payload, scan, size, AreaState, Index, Place, Scan, Tail};
use core::fmt;

/// The condition of the store at power-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Condition {
    /// All that was stored is there.
    Sound,
    /// Nothing was ever stored.
    Blank,
    /// Power was lost while a change was being written. The change did not happen; all else is
    /// there.
    CutShort,
    /// Something is lost; readable values are there. The operator is told with `error:7`.
    Damaged,
    /// Another version wrote the store: nothing is read, and the first change erases it.
    Foreign,
}

/// The reason why a change could not be stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StoreError<E> {
    /// The memory failed.
    Flash(E),
    /// The memory accepted bytes and holds others.
    Unfaithful,
    /// There is no room left.
    Full,
    /// The payload is longer than [`MAX_PAYLOAD`].
    TooLong,
}

impl<E> From<E> for StoreError<E> {
    fn from(error: E) -> Self {
        Self::Flash(error)
    }
}

impl<E> fmt::Display for StoreError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Flash(_) => "the memory for settings failed",
            Self::Unfaithful => "the memory for settings holds other bytes than were written",
            Self::Full => "the memory for settings is full",
            Self::TooLong => "the text is too long to be stored",
        })
    }
}

impl<E: fmt::Debug> core::error::Error for StoreError<E> {}

/// Bytes of a record that are written at once: a flash that takes 100 µs for a word holds the CPU
/// up for 1.2 ms.
const AT_ONCE: usize = 48;

/// The part of a record that is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Written {
    /// All of it: it counts.
    All,
    /// Its beginning: write the same value again, before any other.
    Part,
}

/// The area in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Active {
    area: Area,
    sequence: u32,
    /// The next record's place; the size of the area if the records must be copied to the other
    /// area first.
    end: usize,
    /// The number of bytes of that record that are written already.
    begun: usize,
}

/// The records of a store. All methods are called from the main loop.
#[derive(Debug, Clone)]
pub struct Records {
    active: Option<Active>,
    /// The other area is erased and has its header.
    prepared: bool,
    /// The area in use holds all that was ever acknowledged: the other one is not needed.
    sound: bool,
    index: Index,
}

impl Records {
    /// Reads the stored values. Nothing is written.
    ///
    /// # Errors
    ///
    /// The memory could not be read.
    pub fn mount<S: SettingsStore>(flash: &mut S) -> Result<(Self, Condition), S::Error> {
        let scans = [scan(flash, Area::First)?, scan(flash, Area::Second)?];
        let [first, second] = scans;
        let newest = match (first.sequence(), second.sequence()) {
            (Some(one), Some(two)) if (two.wrapping_sub(one) as i32) < 0 => Area::First,
            (_, Some(_)) => Area::Second,
            (Some(_), None) => Area::First,
            (None, None) => return Ok(Self::unread(&first, &second)),
        };
        let (scan, other) = match newest {
            Area::First => (first, second),
            Area::Second => (second, first),
        };
        Ok(Self::with(newest, scan, &other, size(flash)))
    }

    /// Reads the value of a key; `None` if the key has no value, or if its record has become
    /// unreadable.
    ///
    /// # Errors
    ///
    /// The memory could not be read.
    pub fn read<S: SettingsStore>(
        &self,
        flash: &mut S,
        key: RecordKey,
    ) -> Result<Option<Payload>, S::Error> {
        match (self.active, self.place(key.code())) {
            (Some(active), Some(place)) => read_payload(flash, active.area, place),
            (None, _) | (_, None) => Ok(None),
        }
    }

    /// Stores the value of a key, or a part of it. An empty value removes the key; a value that is
    /// stored already is not written again.
    ///
    /// # Errors
    ///
    /// The value is too long, there is no room, or the memory failed in both areas. The old value
    /// stands then; after a failure of the memory the new value may stand instead.
    pub fn write<S: SettingsStore>(
        &mut self,
        flash: &mut S,
        key: RecordKey,
        value: &[u8],
    ) -> Result<Written, StoreError<S::Error>> {
        match self.try_write(flash, key, value) {
            // Nothing more is written to the area that failed: the second attempt changes to the
            // other one.
            Err(StoreError::Flash(_) | StoreError::Unfaithful) => self.try_write(flash, key, value),
            done => done,
        }
    }

    fn try_write<S: SettingsStore>(
        &mut self,
        flash: &mut S,
        key: RecordKey,
        value: &[u8],
    ) -> Result<Written, StoreError<S::Error>> {
        let record = record(key.code(), value).ok_or(StoreError::TooLong)?;
        if !self.has_begun(flash, &record)? {
            let old = self.read(flash, key)?;
            if old.as_deref().unwrap_or(&[]) == value {
                return Ok(Written::All);
            }
            self.make_room(flash, key, record.len())?;
        }
        let Some(offset) = self.append(flash, &record)? else {
            return Ok(Written::Part);
        };
        let length = value.len() as u8; // at most MAX_PAYLOAD
        note(&mut self.index, Place::new(key.code(), offset), length);
        Ok(Written::All)
    }

    /// Returns true if the writing of `record` has begun. If another record has been begun, it is
    /// in the way: the records will be copied to the other area.
    fn has_begun<S: SettingsStore>(
        &mut self,
        flash: &mut S,
        record: &[u8],
    ) -> Result<bool, S::Error> {
        let Some(active) = self.active.as_mut().filter(|active| active.begun > 0) else {
            return Ok(false);
        };
        let mut begun = [0; MAX_PAYLOAD + OVERHEAD];
        let begun = begun.get_mut(..active.begun).unwrap_or(&mut []);
        flash.read(active.area, active.end, begun)?;
        let same = record.starts_with(begun);
        if !same {
            (active.end, active.begun) = (size(flash), 0);
        }
        Ok(same)
    }

    fn make_room<S: SettingsStore>(
        &mut self,
        flash: &mut S,
        key: RecordKey,
        length: usize,
    ) -> Result<(), StoreError<S::Error>> {
        if self.place(key.code()).is_none() && self.index.is_full() {
            return Err(StoreError::Full);
        }
        if self.room(flash) < length {
            self.retain(flash, |_| true)?;
        }
        if self.room(flash) < length {
            return Err(StoreError::Full);
        }
        Ok(())
    }

    /// Removes all keys but those that `keep` is true for: all of them or, if power is lost, none.
    ///
    /// # Errors
    ///
    /// The memory failed twice, or there is no room. The old contents stand.
    pub fn retain<S: SettingsStore>(
        &mut self,
        flash: &mut S,
        keep: impl Fn(RecordKey) -> bool,
    ) -> Result<(), StoreError<S::Error>> {
        match self.rewrite(flash, &keep) {
            Err(StoreError::Flash(_) | StoreError::Unfaithful) => self.rewrite(flash, &keep),
            done => done,
        }
    }

    /// Copies the kept records to the spare area, which is the one in use from then on.
    fn rewrite<S: SettingsStore>(
        &mut self,
        flash: &mut S,
        keep: &impl Fn(RecordKey) -> bool,
    ) -> Result<(), StoreError<S::Error>> {
        self.prepare(flash)?;
        self.prepared = false;
        let (area, sequence) = self.next_area();
        let mut copy = Copy {
            area,
            end: AREA_HEADER,
            index: Index::new(),
        };
        if let Some(active) = self.active {
            for place in &self.index {
                if RecordKey::from_code(place.code).is_some_and(keep) {
                    copy.take(flash, active.area, *place)?;
                }
            }
        }
        copy.append(flash, COMMIT, &[])?;
        let end = copy.end;
        self.active = Some(Active {
            area,
            sequence,
            end,
            begun: 0,
        });
        self.sound = true;
        self.index = copy.index;
        Ok(())
    }

    /// The area that is written next, and its sequence number.
    fn next_area(&self) -> (Area, u32) {
        match self.active {
            Some(active) => (active.area.other(), active.sequence.wrapping_add(1)),
            None => (Area::First, 0),
        }
    }

    /// Erases the spare area and writes its header, unless that is done.
    fn prepare<S: SettingsStore>(&mut self, flash: &mut S) -> Result<(), StoreError<S::Error>> {
        if self.prepared {
            return Ok(());
        }
        let (area, sequence) = self.next_area();
        flash.erase(area)?;
        write_faithfully(flash, area, 0, &area_header(sequence))?;
        self.prepared = true;
        Ok(())
    }

    /// Prepares the area that is not in use, so that no later change has to wait for that. If
    /// something was lost, the area stays as it is until all that is left was copied and read back.
    ///
    /// # Errors
    ///
    /// The memory could not be erased: the change that needs the area tries again.
    pub fn erase_spare<S: SettingsStore>(
        &mut self,
        flash: &mut S,
    ) -> Result<(), StoreError<S::Error>> {
        if self.sound {
            self.prepare(flash)
        } else {
            Ok(())
        }
    }

    /// The records of a store without any area in use.
    fn unread(first: &Scan, second: &Scan) -> (Self, Condition) {
        let condition = unreadable(first, second);
        let records = Self {
            active: None,
            prepared: first.area == AreaState::Prepared { sequence: 0 },
            sound: !matches!(condition, Condition::Damaged | Condition::Foreign),
            index: Index::new(),
        };
        (records, condition)
    }

    /// Makes the records of the area in use.
    fn with(area: Area, scan: Scan, other: &Scan, size: usize) -> (Self, Condition) {
        let condition = match (scan.tail, &other.area) {
            (Tail::Damaged, _) | (_, AreaState::Damaged) => Condition::Damaged,
            (Tail::CutShort, _) | (_, AreaState::Unfinished) => Condition::CutShort,
            (Tail::Clean, _) => Condition::Sound,
        };
        let sound = condition != Condition::Damaged;
        let active = scan.sequence().map(|sequence| Active {
            area,
            sequence,
            // If something is lost, the first change copies all records to the other area.
            // Otherwise that area might be readable at a later power-up, and its values would count
            // again.
            end: if sound { scan.end } else { size },
            begun: 0,
        });
        let next = active.map(|active| active.sequence.wrapping_add(1));
        let records = Self {
            active,
            prepared: next.is_some_and(|sequence| other.area == AreaState::Prepared { sequence }),
            sound,
            index: scan.index,
        };
        (records, condition)
    }

    fn place(&self, code: u16) -> Option<Place> {
        self.index.iter().find(|place| place.code == code).copied()
    }

    fn room<S: SettingsStore>(&self, flash: &S) -> usize {
        self.active
            .map_or(0, |active| size(flash).saturating_sub(active.end))
    }

    /// Appends a record, or a part of it ([`AT_ONCE`]); returns the record's offset once all of it
    /// is written. After a failure the records will be copied to the other area.
    fn append<S: SettingsStore>(
        &mut self,
        flash: &mut S,
        record: &[u8],
    ) -> Result<Option<usize>, StoreError<S::Error>> {
        let active = self.active.as_mut().ok_or(StoreError::Full)?;
        let (offset, begun) = (active.end, active.begun);
        let rest = record.get(begun..).unwrap_or(&[]);
        let part = rest.get(..AT_ONCE).unwrap_or(rest);
        (active.end, active.begun) = (size(flash), 0);
        write_faithfully(flash, active.area, offset + begun, part)?;
        if part.len() < rest.len() {
            (active.end, active.begun) = (offset, begun + part.len());
            return Ok(None);
        }
        active.end = offset + record.len();
        Ok(Some(offset))
    }
}

/// A rewrite under way.
struct Copy {
    area: Area,
    end: usize,
    index: Index,
}

impl Copy {
    /// Copies a record that can be read.
    fn take<S: SettingsStore>(
        &mut self,
        flash: &mut S,
        from: Area,
        place: Place,
    ) -> Result<(), StoreError<S::Error>> {
        if let Some(payload) = read_payload(flash, from, place)? {
            let copy = Place::new(place.code, self.end);
            self.append(flash, place.code, &payload)?;
            note(&mut self.index, copy, payload.len() as u8); // at most MAX_PAYLOAD
        }
        Ok(())
    }

    fn append<S: SettingsStore>(
        &mut self,
        flash: &mut S,
        code: u16,
        payload: &[u8],
    ) -> Result<(), StoreError<S::Error>> {
        let record = record(code, payload).ok_or(StoreError::TooLong)?;
        if size(flash).saturating_sub(self.end) < record.len() {
            return Err(StoreError::Full);
        }
        write_faithfully(flash, self.area, self.end, &record)?;
        self.end += record.len();
        Ok(())
    }
}

/// Writes bytes, one record at most, and reads them back.
fn write_faithfully<S: SettingsStore>(
    flash: &mut S,
    area: Area,
    offset: usize,
    bytes: &[u8],
) -> Result<(), StoreError<S::Error>> {
    flash.write(area, offset, bytes)?;
    let mut found = [0; MAX_PAYLOAD + OVERHEAD];
    let found = found.get_mut(..bytes.len()).ok_or(StoreError::TooLong)?;
    flash.read(area, offset, found)?;
    let same = found == bytes;
    same.then_some(()).ok_or(StoreError::Unfaithful)
}

/// Returns the condition of a store if neither area has a commit record.
fn unreadable(first: &Scan, second: &Scan) -> Condition {
    let any = |area| first.area == area || second.area == area;
    if any(AreaState::Foreign) {
        Condition::Foreign
    } else if any(AreaState::Damaged) {
        Condition::Damaged
    } else if any(AreaState::Unfinished) {
        Condition::CutShort
    } else {
        Condition::Blank
    }
}

#[cfg(test)]
#[path = "store_tests.rs"]
mod tests;
