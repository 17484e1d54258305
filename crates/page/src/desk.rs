//! A machine under power, as the code that shows it on pages uses it.

use crate::trail::Trail;
use crate::wires::Wires;
use leadscrew_machine::settings::table::Kind;
use leadscrew_machine::settings::values::Key;
use leadscrew_sim::clock::Cycle;
use leadscrew_sim::plant::Pin;
use leadscrew_sim::powered::Powered;
use serde_json::{json, Value};
use std::cell::{RefCell, RefMut};
use std::ops::{Deref, DerefMut};

/// A machine, and the trail of its tool.
pub struct Desk<'m> {
    machine: &'m mut (dyn Powered + 'm),
    trail: &'m RefCell<Trail>,
    motors: usize,
    /// Letters of the axes, in order.
    letters: Vec<char>,
}

impl<'m> Deref for Desk<'m> {
    type Target = dyn Powered + 'm;

    fn deref(&self) -> &Self::Target {
        self.machine
    }
}

impl DerefMut for Desk<'_> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        self.machine
    }
}

impl<'m> Desk<'m> {
    /// Makes the desk of a machine with `motors` motors and axes of these `letters`; the machine's
    /// observer writes `trail`.
    pub fn new(
        machine: &'m mut (dyn Powered + 'm),
        trail: &'m RefCell<Trail>,
        motors: usize,
        letters: Vec<char>,
    ) -> Self {
        Self {
            machine,
            trail,
            motors,
            letters,
        }
    }

    /// Lets time pass up to `end`.
    pub fn run_until(&mut self, wires: &mut Wires, end: Cycle) {
        wires.begin_slice();
        self.machine.wait_until(wires, end);
    }

    /// Returns the level of an input.
    pub fn level(&self, pin: Pin) -> bool {
        let levels = self.levels();
        match pin {
            Pin::Limit(motor) => levels.limits.contains(motor),
            Pin::Probe => levels.probe,
            Pin::Reset => levels.reset,
            Pin::Hold => levels.hold,
            Pin::Start => levels.start,
            Pin::Door => levels.door,
        }
    }

    /// Returns the number of motors: one for each axis, and a second one if there is one.
    pub fn motors(&self) -> usize {
        self.motors
    }

    /// Returns the trail of the tool.
    pub fn trail(&self) -> RefMut<'_, Trail> {
        self.trail.borrow_mut()
    }

    /// Returns all settings with their names and limits, as pages get them.
    pub fn settings_table(&self) -> Value {
        let one = |(key, line): &(Key, String)| {
            let row = key.row();
            json!({
                "number": key.number(),
                "name": self.name_of(*key),
                "unit": row.unit,
                "description": row.description,
                "value": line.split_once('=').map_or("", |(_, value)| value),
                "range": range_of(row.kind),
            })
        };
        self.settings().iter().map(one).collect()
    }

    /// The name of a setting, with its axis.
    fn name_of(&self, key: Key) -> String {
        match key {
            Key::Machine(setting) => setting.row().name.to_owned(),
            Key::Axis(setting, axis) => {
                let letter = self.letters.get(axis).copied().unwrap_or('?');
                format!("{letter} {}", setting.row().name)
            }
        }
    }

    /// Returns all settings as `$$` prints them, including those beyond Grbl's.
    pub fn settings_text(&self) -> String {
        let settings = self.settings().into_iter();
        settings.map(|(_, line)| line + "\n").collect()
    }
}

/// The values that a setting takes, in words.
fn range_of(kind: Kind) -> String {
    match kind {
        Kind::AxisMask => "one bit an axis, X is 1, Y is 2, Z is 4".to_owned(),
        Kind::Bits(names) => format!("bits from 1 on: {names}"),
        Kind::Switch => "0 or 1".to_owned(),
        Kind::Whole { max } => format!("0 to {max}"),
        Kind::Decimal { zero: true, .. } => "0 or more".to_owned(),
        Kind::Decimal { zero: false, .. } => "more than 0".to_owned(),
        Kind::Signed { most } => format!("-{most} to {most}"),
    }
}
