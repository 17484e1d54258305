//! Between the machine and its store: what is loaded at power-up, what is to be written, and when.
//!
//! Lines change settings, offsets and texts in memory and note what has to be written; [`Machine::save`] then writes one
//! record a call, a long one in parts, while motion rests: writing flash may stop the CPU for a while. The line that made the
//! change is answered after that, so that its `ok` says that the change will survive a power loss.

use crate::extension::Extension;
use crate::interpreter::OffsetId;
use crate::machine::Machine;
use crate::memory::Memory;
use crate::protocol::system_command::{Restore, STARTUP_LINES};
use crate::settings::flash::SettingsStore;
use crate::settings::record::{decode_numbers, encode_numbers, RecordKey, MAX_RECORDS};
use crate::settings::store::{Condition, Records, StoreError, Written};
use crate::settings::values::{Entry, Key, Settings, MAX_AXES};
use leadscrew_gcode::Number;
use leadscrew_planner::{Coordinate, Kinematics};

/// All that outlasts power, besides the settings and offsets in force.
#[derive(Debug, Default)]
pub(crate) struct Store {
    /// Startup lines, the text of `$I`.
    pub(crate) memory: Memory,
    /// What is in the store, once it was loaded.
    pub(crate) records: Option<Records>,
    /// What is not in the store yet.
    pub(crate) unsaved: Unsaved,
    /// Not all that the line under way changed could be stored.
    pub(crate) failed: bool,
    /// The store had lost something: the machine is locked until `$X`, and everybody who comes is told why.
    pub(crate) lost: bool,
}

/// Words of [`Unsaved`]: a bit for each record of the largest machine.
const WORDS: usize = MAX_RECORDS.div_ceil(u32::BITS as usize);

/// What is not in the store yet.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Unsaved {
    /// A bit for each of [`Item::all`].
    items: [u32; WORDS],
    /// What a part has been written of.
    begun: Option<Item>,
    /// A bit for each setting of the extension.
    own: u16,
    /// What goes back to its defaults, all at once, before anything else is written.
    restored: Option<Restore>,
}

impl Unsaved {
    /// Notes a setting by its number.
    pub(crate) fn add_setting<const AXES: usize>(&mut self, number: u16) {
        if let Some(key) = Key::from_number(number, AXES) {
            self.add::<AXES>(Item::Setting(key));
        }
    }

    /// Notes a setting of the extension by its place among them.
    pub(crate) fn add_own(&mut self, index: usize) {
        self.own |= u16::try_from(1_u32 << (index % 16)).unwrap_or(0);
    }

    /// Takes the place of a setting of the extension that is noted.
    pub(crate) fn take_own(&mut self) -> Option<usize> {
        let index = self.own.trailing_zeros();
        self.own &= self.own.wrapping_sub(1);
        (index < u16::BITS).then_some(index as usize)
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

    /// Notes that all of this has its defaults, which no record says.
    pub(crate) fn restore<const AXES: usize>(&mut self, what: Restore) {
        for (index, item) in Item::all::<AXES>().enumerate() {
            if goes(what, item.key()) {
                self.clear(index);
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

    /// Whether everything is in the store.
    pub(crate) fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    fn add<const AXES: usize>(&mut self, item: Item) {
        const { assert!(AXES <= MAX_AXES, "more axes than `Unsaved` has bits for") };
        for (index, _) in Item::all::<AXES>()
            .enumerate()
            .filter(|(_, of)| *of == item)
        {
            if let Some(word) = self.items.get_mut(index / 32) {
                *word |= 1 << (index % 32);
            }
        }
    }

    fn clear(&mut self, index: usize) {
        if let Some(word) = self.items.get_mut(index / 32) {
            *word &= !(1 << (index % 32));
        }
    }

    /// Takes the first of what is noted.
    fn take<const AXES: usize>(&mut self) -> Option<Item> {
        if let Some(item) = self.begun.take() {
            return Some(item);
        }
        let (word, bits) = (0..).zip(self.items).find(|(_, bits)| *bits != 0)?;
        let index = 32 * word + bits.trailing_zeros() as usize;
        self.clear(index);
        Item::all::<AXES>().nth(index)
    }
}

/// One record to write.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Item {
    Setting(Key),
    Offset(OffsetId),
    Startup(u8),
    Build,
}

impl Item {
    /// All that a machine stores, always in the same order.
    fn all<const AXES: usize>() -> impl Iterator<Item = Self> {
        let settings = Settings::<AXES>::keys().map(Self::Setting);
        let offsets = OffsetId::ALL.into_iter().map(Self::Offset);
        let lines = (0..STARTUP_LINES).map(Self::Startup);
        settings.chain(offsets).chain(lines).chain([Self::Build])
    }

    /// What stands for it in the store.
    fn key(self) -> RecordKey {
        match self {
            Self::Setting(key) => RecordKey::Setting(key.number()),
            Self::Offset(id) => {
                let index = (0..).zip(OffsetId::ALL).find(|(_, of)| *of == id);
                RecordKey::Offset(index.map_or(0, |(index, _)| index)) // all are there
            }
            Self::Startup(index) => RecordKey::Startup(index),
            Self::Build => RecordKey::Build,
        }
    }
}

/// Whether `$RST=` takes a record away.
fn goes(what: Restore, key: RecordKey) -> bool {
    match (what, key) {
        (Restore::Settings, RecordKey::Setting(_)) => true,
        (Restore::Parameters, RecordKey::Offset(_)) => true,
        (Restore::All, _) => true,
        (Restore::Settings | Restore::Parameters, _) => false,
    }
}

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Takes over what is stored. Main loop, before the first [`Machine::poll`].
    ///
    /// What was damaged keeps its default. Then the machine is locked until `$X`, and tells everybody who comes why.
    ///
    /// # Errors
    /// The memory could not be read: all defaults are in force, and the machine is locked as well.
    pub fn load<S: SettingsStore>(&mut self, store: &mut S) -> Result<Condition, S::Error> {
        let loaded = self.load_all(store);
        match loaded {
            Ok(Condition::Sound | Condition::Blank | Condition::CutShort) => {}
            Ok(Condition::Damaged | Condition::Foreign) | Err(_) => self.distrust_settings(),
        }
        loaded
    }

    /// Notes that something is lost that was stored, as [`Machine::load`] does where it finds that out. Before the first
    /// [`Machine::poll`].
    pub fn distrust_settings(&mut self) {
        self.store.lost = true;
    }

    fn load_all<S: SettingsStore>(&mut self, store: &mut S) -> Result<Condition, S::Error> {
        let (records, condition) = Records::mount(store)?;
        let mut sound = true;
        let keys = Settings::<AXES>::keys();
        for key in keys {
            let number = key.number();
            if let Some(payload) = records.read(store, RecordKey::Setting(number))? {
                let value = decode_numbers(&payload);
                sound &= value.is_some_and(|[value]| self.settings.load(Entry { number, value }));
            }
        }
        sound &= self.load_own(&records, store)?;
        for (index, id) in (0u8..).zip(OffsetId::ALL) {
            let Some(payload) = records.read(store, RecordKey::Offset(index))? else {
                continue;
            };
            let value = decode_numbers::<AXES>(&payload);
            sound &= value.is_some();
            if let Some(value) = value {
                let value = value.map(|value| Coordinate::from_nanos(value.nanos()));
                self.program.interpreter.load_offset(id, value);
            }
        }
        for index in 0..STARTUP_LINES {
            let line = records.read(store, RecordKey::Startup(index))?;
            self.store
                .memory
                .set_startup(index, line.as_deref().unwrap_or_default());
        }
        let build = records.read(store, RecordKey::Build)?;
        self.store
            .memory
            .set_build(build.as_deref().unwrap_or_default());
        self.program.work_offset = *self.program.interpreter.work_offset();
        self.store.records = Some(records);
        Ok(if sound { condition } else { Condition::Damaged })
    }

    /// Whether there is a store, and something is not in it yet.
    pub(crate) fn has_unsaved(&self) -> bool {
        self.store.records.is_some() && !self.store.unsaved.is_empty()
    }

    /// Erases what the store holds in vain, so that no change to come has to wait for that. Where something was lost, nothing is
    /// erased yet. Main loop, after [`Machine::load`] and before the first [`Machine::poll`]. Takes as long as the store does:
    /// half a second for a flash.
    ///
    /// # Errors
    /// The memory could not be erased; what is stored stands.
    pub fn make_room<S: SettingsStore>(
        &mut self,
        store: &mut S,
    ) -> Result<(), StoreError<S::Error>> {
        match &mut self.store.records {
            Some(records) => records.erase_spare(store),
            None => Ok(()),
        }
    }

    /// Writes one record of what changed, or a part of a long one, if motion rests; returns whether more is left to write.
    ///
    /// Main loop, after every [`Machine::poll`]: lines that change something wait for it. Does nothing before
    /// [`Machine::load`]. Takes as long as the store does.
    ///
    /// # Errors
    /// [`StoreError`]: the change is in force, but will not survive a power loss; its line is answered with `error:7`.
    pub fn save<S: SettingsStore>(&mut self, store: &mut S) -> Result<bool, StoreError<S::Error>> {
        let saved = self.save_one(store);
        self.store.failed |= saved.is_err();
        saved
    }

    /// Notes that what [`Machine::save`] has written did not reach its place after all, where a store hands on many records
    /// together. Main loop, before the next [`Machine::poll`]: the line under way is answered with `error:7`.
    pub fn not_saved(&mut self) {
        self.store.failed = true;
    }

    fn save_one<S: SettingsStore>(&mut self, store: &mut S) -> Result<bool, StoreError<S::Error>> {
        if self.store.unsaved.is_empty() || !self.motion.is_at_rest() {
            return Ok(!self.store.unsaved.is_empty());
        }
        let Some(records) = &mut self.store.records else {
            return Ok(false);
        };
        if let Some(what) = self.store.unsaved.restored.take() {
            records.retain(store, |key| !goes(what, key))?;
            return Ok(!self.store.unsaved.is_empty());
        }
        let Some(item) = self.store.unsaved.take::<AXES>() else {
            self.save_own(store)?;
            return Ok(!self.store.unsaved.is_empty());
        };
        let written = match item {
            Item::Setting(key) => {
                let value = encode_numbers(&[self.settings.get(key)]);
                records.write(store, item.key(), &value)?
            }
            Item::Offset(id) => {
                let value = self.program.interpreter.offsets().get(id);
                let value = value.map(|value| Number::from_nanos(value.nanos()));
                records.write(store, item.key(), &encode_numbers(&value))?
            }
            Item::Startup(index) => {
                records.write(store, item.key(), self.store.memory.startup(index))?
            }
            Item::Build => records.write(store, item.key(), self.store.memory.build())?,
        };
        self.store.unsaved.begun = (written == Written::Part).then_some(item);
        Ok(!self.store.unsaved.is_empty())
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
        let all: Vec<_> = Item::all::<9>().collect();
        assert_eq!(all.len(), MAX_RECORDS);
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
