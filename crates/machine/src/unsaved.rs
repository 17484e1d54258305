//! The machine's side of its store: stored texts, and the changes that are not in the store yet.

use crate::interpreter::OffsetId;
use crate::memory::Memory;
use crate::protocol::system_command::{Restore, STARTUP_LINES};
use crate::settings::record::{RecordKey, MAX_RECORDS};
use crate::settings::store::Records;
use crate::settings::values::{Key, MAX_AXES};

/// The machine's side of its store. Settings and offsets are not here: they are in force elsewhere.
#[derive(Debug, Default)]
pub(crate) struct Store {
    /// Startup lines, the text of `$I`.
    pub(crate) memory: Memory,
    /// The records of the store, once it was loaded.
    pub(crate) records: Option<Records>,
    /// The changes that are not in the store yet.
    pub(crate) unsaved: Unsaved,
    /// A change of the line under way could not be stored.
    pub(crate) failed: bool,
    /// Stored values were lost: the machine is locked until `$X`, and each sender that connects is
    /// told why.
    pub(crate) lost: bool,
}

/// Words of [`Unsaved`]: a bit for each record of the largest machine.
const WORDS: usize = MAX_RECORDS.div_ceil(u32::BITS as usize);

/// The changes that are not in the store yet.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Unsaved {
    /// A bit for each of [`Item::all`].
    items: [u32; WORDS],
    /// The item of which a part has been written.
    pub(crate) begun: Option<Item>,
    /// A bit for each setting of the extension.
    own: u32,
    /// The values that go back to their defaults, all at once, before anything else is written.
    pub(crate) restored: Option<Restore>,
}

impl Unsaved {
    /// Notes a setting by its number.
    pub(crate) fn add_setting<const AXES: usize>(&mut self, number: u16) {
        if let Some(key) = Key::from_number(number, AXES) {
            self.add::<AXES>(Item::Setting(key));
        }
    }

    /// Notes a setting of the extension by its place in the extension's list.
    pub(crate) fn add_own(&mut self, index: usize) {
        self.own |= 1 << (index % 32);
    }

    /// Takes a setting of the extension that is noted; returns its place in the extension's list.
    pub(crate) fn take_own(&mut self) -> Option<usize> {
        let index = self.own.trailing_zeros();
        self.own &= self.own.wrapping_sub(1);
        (index < u32::BITS).then_some(index as usize)
    }

    /// Notes an offset.
    pub(crate) fn add_offset<const AXES: usize>(&mut self, id: OffsetId) {
        self.add::<AXES>(Item::Offset(id));
    }

    /// Notes a startup line.
    pub(crate) fn add_startup<const AXES: usize>(&mut self, index: u8) {
        self.add::<AXES>(Item::Startup(index));
    }

    /// Notes the text of `$I`.
    pub(crate) fn add_build<const AXES: usize>(&mut self) {
        self.add::<AXES>(Item::Build);
    }

    /// Notes that all values that `what` names are back at their defaults: their records are to be
    /// removed.
    pub(crate) fn restore<const AXES: usize>(&mut self, what: Restore) {
        for (place, item) in Item::all(AXES).enumerate() {
            if goes(what, item.key()) {
                self.clear(place);
            }
        }
        if goes(what, RecordKey::Setting(0)) {
            self.own = 0;
        }
        self.begun = self.begun.filter(|item| !goes(what, item.key()));
        self.restored = match self.restored {
            Some(before) if before != what => Some(Restore::All),
            _ => Some(what),
        };
    }

    /// Returns true if everything is in the store.
    pub(crate) fn is_empty(&self) -> bool {
        let noted = self.items.iter().fold(self.own, |noted, word| noted | word);
        noted == 0 && self.begun.is_none() && self.restored.is_none()
    }

    fn add<const AXES: usize>(&mut self, item: Item) {
        const { assert!(AXES <= MAX_AXES, "more axes than `Unsaved` has bits for") };
        let place = item.place(AXES);
        if let Some(word) = self.items.get_mut(place / 32) {
            *word |= 1 << (place % 32);
        }
    }

    fn clear(&mut self, place: usize) {
        if let Some(word) = self.items.get_mut(place / 32) {
            *word &= !(1 << (place % 32));
        }
    }

    /// Takes the first noted item.
    pub(crate) fn take<const AXES: usize>(&mut self) -> Option<Item> {
        if let Some(item) = self.begun.take() {
            return Some(item);
        }
        let (word, bits) = (0..).zip(self.items).find(|(_, bits)| *bits != 0)?;
        let place = 32 * word + bits.trailing_zeros() as usize;
        self.clear(place);
        Item::at(place, AXES)
    }
}

/// One record to write.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Item {
    Setting(Key),
    Offset(OffsetId),
    Startup(u8),
    Build,
}

impl Item {
    /// All that a machine with `axes` axes stores, always in the same order.
    fn all(axes: usize) -> impl Iterator<Item = Self> {
        (0..).map_while(move |place| Self::at(place, axes))
    }

    /// The item at a place in [`Item::all`], from 0; `None` beyond the last.
    fn at(place: usize, axes: usize) -> Option<Self> {
        let Some(place) = place.checked_sub(Key::count(axes)) else {
            return Key::at(place, axes).map(Self::Setting);
        };
        let Some(place) = place.checked_sub(OffsetId::ALL.len()) else {
            return OffsetId::ALL.get(place).copied().map(Self::Offset);
        };
        match u8::try_from(place).ok()? {
            line if line < STARTUP_LINES => Some(Self::Startup(line)),
            STARTUP_LINES => Some(Self::Build),
            _ => None,
        }
    }

    /// Its place in [`Item::all`].
    fn place(self, axes: usize) -> usize {
        let lines = Key::count(axes) + OffsetId::ALL.len();
        match self {
            Self::Setting(key) => key.place(axes),
            Self::Offset(id) => Key::count(axes) + usize::from(id.index()),
            Self::Startup(line) => lines + usize::from(line),
            Self::Build => lines + usize::from(STARTUP_LINES),
        }
    }

    /// Its key in the store.
    pub(crate) fn key(self) -> RecordKey {
        match self {
            Self::Setting(key) => RecordKey::Setting(key.number()),
            Self::Offset(id) => RecordKey::Offset(id.index()),
            Self::Startup(index) => RecordKey::Startup(index),
            Self::Build => RecordKey::Build,
        }
    }
}

/// Returns true if `$RST=` takes a record away.
pub(crate) fn goes(what: Restore, key: RecordKey) -> bool {
    match (what, key) {
        (Restore::Settings, RecordKey::Setting(_)) => true,
        (Restore::Parameters, RecordKey::Offset(_)) => true,
        (Restore::All, _) => true,
        (Restore::Settings | Restore::Parameters, _) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn noted<const AXES: usize>(mut unsaved: Unsaved) -> Vec<RecordKey> {
        let mut keys = Vec::new();
        while let Some(item) = unsaved.take::<AXES>() {
            keys.push(item.key());
        }
        keys
    }

    #[test]
    fn every_record_of_nine_axes_is_noted_once() {
        let mut unsaved = Unsaved::default();
        let all: Vec<_> = Item::all(9).collect();
        assert_eq!(all.len(), MAX_RECORDS);
        assert!((0..).zip(&all).all(|(place, item)| item.place(9) == place));
        for item in &all {
            unsaved.add::<9>(*item);
            unsaved.add::<9>(*item);
        }
        let keys: Vec<_> = all.iter().map(|item| item.key()).collect();
        assert_eq!(noted::<9>(unsaved), keys);
        assert!(keys.contains(&RecordKey::Setting(138)));
    }

    #[test]
    fn what_goes_back_to_its_default_is_no_longer_to_be_written() {
        let mut unsaved = Unsaved::default();
        unsaved.add_setting::<3>(100);
        unsaved.add_build::<3>();
        unsaved.restore::<3>(Restore::Settings);
        assert_eq!(noted::<3>(unsaved), [RecordKey::Build]);
        assert!(!unsaved.is_empty());
    }
}
