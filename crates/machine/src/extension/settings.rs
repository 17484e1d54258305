//! An extension's settings: found, changed, stored and restored beside GRBL's.

use super::Extension;
use crate::activity::line::Progress;
use crate::machine::Machine;
use crate::protocol::status::Status;
use crate::settings::flash::SettingsStore;
use crate::settings::record::{decode_numbers, encode_numbers, RecordKey};
use crate::settings::store::{Records, StoreError};
use crate::settings::table::Row;
use crate::settings::values::{checked, SettingLine};
use crate::state::State;
use leadscrew_gcode::Number;
use leadscrew_planner::{Coordinate, Kinematics};

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// The setting at place `index` in the extension's list.
    pub(crate) fn own_setting(&self, index: usize) -> Option<&'static Row> {
        match X::IN_USE {
            true => self.extension.settings().nth(index),
            false => None,
        }
    }

    /// The extension's setting with this number.
    pub(crate) fn own_row(&self, number: u16) -> Option<&'static Row> {
        match X::IN_USE {
            true => self.extension.settings().find(|row| row.number == number),
            false => None,
        }
    }

    /// A setting of the extension as `$$` prints settings.
    pub(crate) fn own_line(&self, row: &Row) -> SettingLine {
        SettingLine::new(row.number, row.kind, self.extension.value(row.number))
    }

    /// Changes a setting of the extension, and notes it for the store.
    ///
    /// # Errors
    /// The value is negative or out of its range, or the extension refuses it. Nothing is changed
    /// then.
    pub(crate) fn set_own(&mut self, row: &Row, value: Number) -> Result<(), Status> {
        let value = checked(row.kind, value)?;
        self.extension.set(row.number, value)?;
        let mut places = self.extension.settings();
        let place = places.position(|of| of.number == row.number);
        self.store.unsaved.add_own(place.unwrap_or(0));
        Ok(())
    }

    /// Notes the length of a tool, and waits until it is stored.
    pub(crate) fn perform_store_tool(&mut self, tool: u32, length: Coordinate) -> Progress {
        if !X::IN_USE || self.state == State::Check || self.activity.line.is_storing() {
            return Progress::Done;
        }
        if !self.is_motion_over() {
            return Progress::Wait;
        }
        match self.extension.set_tool_length(tool, length) {
            Err(status) => self.refuse_own(status),
            Ok(number) => {
                let mut places = self.extension.settings();
                let place = places.position(|of| of.number == number);
                self.store.unsaved.add_own(place.unwrap_or(0));
                self.activity.line.begin_waiting_for_store();
                match self.has_unsaved() {
                    true => Progress::Wait,
                    false => Progress::Done,
                }
            }
        }
    }

    /// Puts the extension's settings back to their defaults: `$RST=$`.
    pub(crate) fn restore_own(&mut self) {
        let mut index = 0;
        while let Some(row) = self.own_setting(index) {
            // A default is in the range of its row; if the extension refuses it, the value in
            // force stays.
            let _refused = self.extension.set(row.number, row.default);
            index += 1;
        }
    }

    /// Loads the extension's settings from the store; returns whether all records were sound.
    pub(crate) fn load_own<S: SettingsStore>(
        &mut self,
        records: &Records,
        store: &mut S,
    ) -> Result<bool, S::Error> {
        let (mut sound, mut index) = (true, 0);
        while let Some(row) = self.own_setting(index) {
            index += 1;
            let Some(payload) = records.read(store, RecordKey::Setting(row.number))? else {
                continue;
            };
            let value = decode_numbers(&payload).and_then(|[value]| checked(row.kind, value).ok());
            let taken = value.map(|value| self.extension.set(row.number, value));
            sound &= taken.is_some_and(|taken| taken.is_ok());
        }
        Ok(sound)
    }

    /// Writes a setting of the extension that is not in the store yet, if there is one.
    pub(crate) fn save_own<S: SettingsStore>(
        &mut self,
        store: &mut S,
    ) -> Result<(), StoreError<S::Error>> {
        if !X::IN_USE {
            return Ok(());
        }
        let index = self.store.unsaved.take_own();
        let Some(row) = index.and_then(|index| self.own_setting(index)) else {
            return Ok(());
        };
        let value = encode_numbers(&[self.extension.value(row.number)]);
        if let Some(records) = &mut self.store.records {
            // A number is short: it is never written in part.
            records.write(store, RecordKey::Setting(row.number), &value)?;
        }
        Ok(())
    }
}
