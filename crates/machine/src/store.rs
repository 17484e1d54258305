//! Between the machine and its store: loads at power-up, and writes changes at rest.
//!
//! Lines change settings, offsets and texts in memory, and note the change. [`Machine::save`] then
//! writes one record a call, a long record in parts. It writes while motion rests: writing flash
//! may stop the CPU for a while. The line that made the change is answered after that, so its `ok`
//! says that the change will survive a power loss.

use crate::extension::Extension;
use crate::interpreter::OffsetId;
use crate::machine::Machine;
use crate::protocol::system_command::STARTUP_LINES;
use crate::settings::flash::SettingsStore;
use crate::settings::record::{decode_numbers, encode_numbers, RecordKey};
use crate::settings::store::{Condition, Records, StoreError, Written};
use crate::settings::values::Entry;
use crate::unsaved::{goes, Item};
use leadscrew_gcode::Number;
use leadscrew_planner::{Coordinate, Kinematics};

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Takes over the stored values. Main loop, before the first [`Machine::poll`].
    ///
    /// Damaged values keep their defaults. Then the machine is locked until `$X`, and tells the
    /// reason to everybody who comes.
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

    /// Notes that stored values are lost, as [`Machine::load`] does if it finds that. Before the
    /// first [`Machine::poll`].
    pub fn distrust_settings(&mut self) {
        self.store.lost = true;
    }

    fn load_all<S: SettingsStore>(&mut self, store: &mut S) -> Result<Condition, S::Error> {
        let (records, condition) = Records::mount(store)?;
        let mut sound = true;
        for key in self.settings.keys() {
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

    /// Returns true if there is a store, and something is not in it yet.
    pub(crate) fn has_unsaved(&self) -> bool {
        self.store.records.is_some() && !self.store.unsaved.is_empty()
    }

    /// Erases the area of the store that is not in use, so that no later change has to wait for
    /// that. If something was lost, nothing is erased yet. Main loop, after [`Machine::load`]
    /// and before the first [`Machine::poll`]. Takes as long as the store does: half a second for a
    /// flash.
    ///
    /// # Errors
    /// The memory could not be erased; the stored values stand.
    pub fn make_room<S: SettingsStore>(
        &mut self,
        store: &mut S,
    ) -> Result<(), StoreError<S::Error>> {
        match &mut self.store.records {
            Some(records) => records.erase_spare(store),
            None => Ok(()),
        }
    }

    /// Writes one changed record, or a part of a long one, if motion rests; returns whether more is
    /// left to write.
    ///
    /// Main loop, after every [`Machine::poll`]: lines that change something wait for it. Does
    /// nothing before [`Machine::load`]. Takes as long as the store does.
    ///
    /// # Errors
    /// [`StoreError`]: the change is in force, but will not survive a power loss; its line is
    /// answered with `error:7`.
    pub fn save<S: SettingsStore>(&mut self, store: &mut S) -> Result<bool, StoreError<S::Error>> {
        let saved = self.save_one(store);
        self.store.failed |= saved.is_err();
        saved
    }

    /// Notes that a write of [`Machine::save`] did not reach its place after all, if a store
    /// hands on many records together. Main loop, before the next [`Machine::poll`]: the line under
    /// way is answered with `error:7`.
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
