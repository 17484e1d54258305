//! Between the machine and its store: what is loaded at power-up, what is to be written, and when.
//!
//! Lines change settings, offsets and texts in memory and note what has to be written; [`Machine::save`] then writes one
//! record a call, a long one in parts, while motion rests: writing flash may stop the CPU for a while. The line that made the
//! change is answered after that, so that its `ok` says that the change will survive a power loss.

use crate::interpreter::OffsetId;
use crate::machine::Machine;
use crate::protocol::system_command::STARTUP_LINES;
use crate::settings::flash::SettingsStore;
use crate::settings::record::{decode_numbers, encode_numbers, RecordKey};
use crate::settings::store::{Condition, Records, StoreError, Written};
use crate::settings::values::{Entry, Key, Settings};
use leadscrew_gcode::Number;
use leadscrew_planner::{Coordinate, Kinematics};

/// What is not in the store yet: a bit for each setting, offset, startup line and the text of `$I`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Unsaved {
    /// In the order of [`Settings::keys`].
    settings: u64,
    /// In the order of [`OffsetId::ALL`].
    offsets: u8,
    startup: u8,
    build: bool,
    /// What a part has been written of.
    begun: Option<Item>,
}

impl Unsaved {
    /// Notes a setting by its number.
    pub(crate) fn add_setting<const AXES: usize>(&mut self, number: u16) {
        for (bit, key) in Settings::<AXES>::keys().enumerate() {
            self.settings |= u64::from(key.number() == number) << bit;
        }
    }

    /// Notes all settings.
    pub(crate) fn add_all_settings<const AXES: usize>(&mut self) {
        for (bit, _) in Settings::<AXES>::keys().enumerate() {
            self.settings |= 1 << bit;
        }
    }

    /// Notes an offset.
    pub(crate) fn add_offset(&mut self, id: OffsetId) {
        for (bit, offset) in OffsetId::ALL.iter().enumerate() {
            self.offsets |= u8::from(*offset == id) << bit;
        }
    }

    /// Notes a startup line.
    pub(crate) fn add_startup(&mut self, index: u8) {
        self.startup |= 1 << index;
    }

    /// Notes the text of `$I`.
    pub(crate) fn add_build(&mut self) {
        self.build = true;
    }

    /// Whether everything is in the store.
    pub(crate) fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Takes the first of what is noted.
    fn take<const AXES: usize>(&mut self) -> Option<Item> {
        if let Some(item) = self.begun.take() {
            return Some(item);
        }
        if let Some(bit) = lowest(self.settings) {
            self.settings &= self.settings - 1;
            return Settings::<AXES>::keys().nth(bit).map(Item::Setting);
        }
        if let Some(bit) = lowest(u64::from(self.offsets)) {
            self.offsets &= self.offsets - 1;
            return OffsetId::ALL
                .get(bit)
                .map(|id| Item::Offset(bit as u8, *id));
        }
        if let Some(bit) = lowest(u64::from(self.startup)) {
            self.startup &= self.startup - 1;
            return Some(Item::Startup(bit as u8));
        }
        core::mem::take(&mut self.build).then_some(Item::Build)
    }
}

/// The number of the lowest bit that is set.
fn lowest(bits: u64) -> Option<usize> {
    (bits != 0).then_some(bits.trailing_zeros() as usize)
}

/// One record to write.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Item {
    Setting(Key),
    Offset(u8, OffsetId),
    Startup(u8),
    Build,
}

impl<K, const AXES: usize, const MOTORS: usize, const MOVES: usize>
    Machine<'_, K, AXES, MOTORS, MOVES>
where
    K: Kinematics<AXES, MOTORS> + Clone,
{
    /// Takes over what is stored. Main loop, once, before the first [`Machine::poll`].
    ///
    /// What was damaged keeps its default, and the operator is told with `error:7` before the banner.
    ///
    /// # Errors
    /// The memory could not be read: all defaults are in force.
    pub fn load<S: SettingsStore>(&mut self, store: &mut S) -> Result<Condition, S::Error> {
        let (records, condition) = Records::mount(store)?;
        let keys = Settings::<AXES>::keys();
        for key in keys {
            let number = key.number();
            let payload = records.read(store, RecordKey::Setting(number))?;
            if let Some([value]) = payload.as_deref().and_then(decode_numbers) {
                self.settings.load(Entry { number, value });
            }
        }
        for (index, id) in (0u8..).zip(OffsetId::ALL) {
            let payload = records.read(store, RecordKey::Offset(index))?;
            if let Some(value) = payload.as_deref().and_then(decode_numbers::<AXES>) {
                let value = value.map(|value| Coordinate::from_nanos(value.nanos()));
                self.interpreter.load_offset(id, value);
            }
        }
        for index in 0..STARTUP_LINES {
            let line = records.read(store, RecordKey::Startup(index))?;
            self.memory
                .set_startup(index, line.as_deref().unwrap_or_default());
        }
        let build = records.read(store, RecordKey::Build)?;
        self.memory.set_build(build.as_deref().unwrap_or_default());
        self.work_offset = *self.interpreter.work_offset();
        self.stored_values_lost = condition == Condition::Damaged;
        self.records = Some(records);
        Ok(condition)
    }

    /// Whether there is a store, and something is not in it yet.
    pub(crate) fn has_unsaved(&self) -> bool {
        self.records.is_some() && !self.unsaved.is_empty()
    }

    /// Erases what the store holds in vain, so that no change to come has to wait for that. Main loop, after
    /// [`Machine::load`] and before the first [`Machine::poll`]. Takes as long as the store does: half a second for a flash.
    ///
    /// # Errors
    /// The memory could not be erased; what is stored stands.
    pub fn make_room<S: SettingsStore>(&self, store: &mut S) -> Result<(), S::Error> {
        match &self.records {
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
        self.store_failed |= saved.is_err();
        saved
    }

    /// Notes that what [`Machine::save`] has written did not reach its place after all, where a store hands on many records
    /// together. Main loop, before the next [`Machine::poll`]: the line under way is answered with `error:7`.
    pub fn not_saved(&mut self) {
        self.store_failed = true;
    }

    fn save_one<S: SettingsStore>(&mut self, store: &mut S) -> Result<bool, StoreError<S::Error>> {
        if self.unsaved.is_empty() || !self.motion.is_at_rest() {
            return Ok(!self.unsaved.is_empty());
        }
        let (Some(records), Some(item)) = (&mut self.records, self.unsaved.take::<AXES>()) else {
            return Ok(false);
        };
        let written = match item {
            Item::Setting(key) => {
                let value = encode_numbers(&[self.settings.get(key)]);
                records.write(store, RecordKey::Setting(key.number()), &value)?
            }
            Item::Offset(index, id) => {
                let value = self.interpreter.offsets().get(id);
                let value = value.map(|value| Number::from_nanos(value.nanos()));
                records.write(store, RecordKey::Offset(index), &encode_numbers(&value))?
            }
            Item::Startup(index) => {
                let line = self.memory.startup(index);
                records.write(store, RecordKey::Startup(index), line)?
            }
            Item::Build => records.write(store, RecordKey::Build, self.memory.build())?,
        };
        self.unsaved.begun = (written == Written::Part).then_some(item);
        Ok(!self.unsaved.is_empty())
    }
}
