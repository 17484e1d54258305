//! The switches and buttons that the user presses.

use crate::desk::Desk;
use crate::key::Key;
use leadscrew_sim::clock::{cycles_of_micros, Cycle};
use leadscrew_sim::plant::Pin;

/// The time for which a button is pressed, cycles.
const PRESS: u64 = cycles_of_micros(100_000);

/// The pressed switches. Inputs are low while a switch is pressed.
#[derive(Default)]
pub struct Buttons {
    /// Switches that stay pressed until they are pressed again, each with the level at which it is
    /// held.
    held: Vec<(Pin, bool)>,
    /// Buttons that are released at a given time.
    pressed: Vec<(Pin, Cycle)>,
}

impl Buttons {
    /// Holds the pressed switches again after a reset of the machine, which does not release them.
    /// Buttons are released.
    pub fn hold_on(&mut self, desk: &mut Desk<'_>) {
        self.pressed.clear();
        for (pin, level) in &self.held {
            desk.force_pin(*pin, Some(*level));
        }
    }

    /// Presses the switch of `key`; does nothing if the machine has no such switch.
    pub fn press(&mut self, key: Key, desk: &mut Desk<'_>) {
        match key {
            Key::Door => self.toggle(Pin::Door, desk),
            Key::Probe => self.toggle(Pin::Probe, desk),
            Key::Limit(axis) if axis < desk.axes() => self.toggle(Pin::Limit(axis), desk),
            Key::SecondMotorLimit if desk.motors() > desk.axes() => {
                self.toggle(Pin::Limit(desk.axes()), desk);
            }
            Key::Hold => self.push(Pin::Hold, desk),
            Key::Start => self.push(Pin::Start, desk),
            Key::Reset => self.push(Pin::Reset, desk),
            Key::Limit(_) | Key::SecondMotorLimit | Key::Quit => {}
        }
    }

    /// Releases the buttons that have been pressed for long enough.
    pub fn release(&mut self, desk: &mut Desk<'_>) {
        let now = desk.now();
        self.pressed.retain(|(pin, until)| {
            let over = *until <= now;
            if over {
                desk.force_pin(*pin, None);
            }
            !over
        });
    }

    fn push(&mut self, pin: Pin, desk: &mut Desk<'_>) {
        self.pressed.retain(|(other, _)| *other != pin);
        self.pressed.push((pin, desk.now() + PRESS));
        desk.force_pin(pin, Some(false));
    }

    fn toggle(&mut self, pin: Pin, desk: &mut Desk<'_>) {
        let before = self.held.len();
        self.held.retain(|(other, _)| *other != pin);
        if self.held.len() == before {
            let level = !desk.level(pin);
            desk.force_pin(pin, Some(level));
            self.held.push((pin, level));
        } else {
            desk.force_pin(pin, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wires::Wires;
    use leadscrew_machine::config::MachineConfig;
    use leadscrew_planner::{Cartesian, Ganged};
    use leadscrew_sim::event_loop::Simulation;
    use leadscrew_sim::link::Rate;
    use leadscrew_sim::setup::{Memory, Setup};
    use std::cell::RefCell;

    fn with_desk(buttons: &mut Buttons, act: impl FnOnce(&mut Buttons, &mut Desk<'_>)) {
        let setup = Setup::<3>::new(MachineConfig::new(), Rate::NeverWaits);
        let mut memory = Memory::new(&setup);
        let mut machine = Simulation::<_, _, 3, 3, 8>::new(&mut memory, &setup, Cartesian, ());
        let trail = RefCell::default();
        act(
            buttons,
            &mut Desk::new(&mut machine, &trail, 3, vec!['X', 'Y', 'Z']),
        );
    }

    #[test]
    fn a_button_is_let_go_after_a_while_and_a_switch_when_it_is_pressed_again() {
        with_desk(&mut Buttons::default(), |buttons, desk| {
            let wires = &mut Wires::new(1);
            for key in [Key::Hold, Key::Start, Key::Reset, Key::Door, Key::Limit(1)] {
                buttons.press(key, desk);
            }
            let pins = [Pin::Hold, Pin::Start, Pin::Reset, Pin::Door, Pin::Limit(1)];
            assert_eq!(pins.map(|pin| desk.level(pin)), [false; 5]);
            desk.run_until(wires, desk.now() + PRESS);
            buttons.release(desk);
            let levels = pins.map(|pin| desk.level(pin));
            assert_eq!(levels, [true, true, true, false, false]);
            buttons.press(Key::Door, desk);
            buttons.press(Key::Limit(1), desk);
            assert_eq!(pins.map(|pin| desk.level(pin)), [true; 5]);
        });
    }

    #[test]
    fn what_is_held_stays_so_when_the_machine_starts_anew() {
        let mut buttons = Buttons::default();
        with_desk(&mut buttons, |buttons, desk| {
            buttons.press(Key::Door, desk);
            buttons.press(Key::Reset, desk);
        });
        with_desk(&mut buttons, |buttons, desk| {
            buttons.hold_on(desk);
            assert!(!desk.level(Pin::Door) && desk.level(Pin::Reset));
            buttons.press(Key::Door, desk);
            assert!(desk.level(Pin::Door));
        });
    }

    #[test]
    fn only_a_machine_with_a_second_motor_has_its_switch() {
        with_desk(&mut Buttons::default(), |buttons, desk| {
            buttons.press(Key::SecondMotorLimit, desk);
            buttons.press(Key::Limit(3), desk);
            assert!(desk.level(Pin::Limit(3)));
        });
        let setup = Setup::<3>::new(MachineConfig::new(), Rate::NeverWaits);
        let mut memory = Memory::new(&setup);
        let ganged = Ganged { axis_of: [1] };
        let mut machine = Simulation::<_, _, 3, 4, 8>::new(&mut memory, &setup, ganged, ());
        let trail = RefCell::default();
        let mut desk = Desk::new(&mut machine, &trail, 4, vec!['X', 'Y', 'Z']);
        Buttons::default().press(Key::SecondMotorLimit, &mut desk);
        assert!(!desk.level(Pin::Limit(3)));
    }
}
