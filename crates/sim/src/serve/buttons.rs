//! The user's fingers on the machine's switches.

use super::desk::Desk;
use super::panel::Key;
use crate::clock::{cycles_of_micros, Cycle};
use crate::plant::Pin;

/// How long a button is pressed, cycles.
const PRESS: u64 = cycles_of_micros(100_000);

/// What is being pressed. Inputs are low while a switch is pressed.
#[derive(Default)]
pub(super) struct Buttons {
    /// Switches that stay until they are pressed again.
    held: Vec<Pin>,
    /// Buttons that are let go after a while.
    pressed: Vec<(Pin, Cycle)>,
}

impl Buttons {
    /// Presses what `key` stands for.
    pub(super) fn press(&mut self, key: Key, desk: &mut dyn Desk) {
        let until = desk.now() + PRESS;
        match key {
            Key::Door => self.toggle(Pin::Door, desk),
            Key::Probe => self.toggle(Pin::Probe, desk),
            Key::Limit(motor) => self.toggle(Pin::Limit(motor), desk),
            Key::Hold => self.pressed.push((Pin::Hold, until)),
            Key::Start => self.pressed.push((Pin::Start, until)),
            Key::Reset => self.pressed.push((Pin::Reset, until)),
            Key::Quit => {}
        }
        for (pin, _) in &self.pressed {
            desk.force_pin(*pin, Some(false));
        }
    }

    /// Lets go of buttons that have been pressed for long enough.
    pub(super) fn release(&mut self, desk: &mut dyn Desk) {
        let now = desk.now();
        self.pressed.retain(|(pin, until)| {
            let over = *until <= now;
            if over {
                desk.force_pin(*pin, None);
            }
            !over
        });
    }

    fn toggle(&mut self, pin: Pin, desk: &mut dyn Desk) {
        let before = self.held.len();
        self.held.retain(|other| *other != pin);
        if self.held.len() == before {
            let high = desk.level(pin);
            desk.force_pin(pin, Some(!high));
            self.held.push(pin);
        } else {
            desk.force_pin(pin, None);
        }
    }
}
