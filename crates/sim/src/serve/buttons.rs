//! The user's fingers on the machine's switches.

use super::panel::Key;
use crate::clock::{cycles_of_micros, Cycle};
use crate::event_loop::Simulation;
use crate::observer::Observer;
use crate::plant::Pin;
use leadscrew_planner::Kinematics;

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
    pub(super) fn press<K, O, const AXES: usize, const MOTORS: usize, const MOVES: usize>(
        &mut self,
        key: Key,
        simulation: &mut Simulation<'_, K, O, AXES, MOTORS, MOVES>,
    ) where
        K: Kinematics<AXES, MOTORS>,
        O: Observer,
    {
        let until = simulation.now() + PRESS;
        match key {
            Key::Door => self.toggle(Pin::Door, simulation),
            Key::Probe => self.toggle(Pin::Probe, simulation),
            Key::Limit(motor) => self.toggle(Pin::Limit(motor), simulation),
            Key::Hold => self.pressed.push((Pin::Hold, until)),
            Key::Start => self.pressed.push((Pin::Start, until)),
            Key::Reset => self.pressed.push((Pin::Reset, until)),
            Key::Quit => {}
        }
        for (pin, _) in &self.pressed {
            simulation.force_pin(*pin, Some(false));
        }
    }

    /// Lets go of buttons that have been pressed for long enough.
    pub(super) fn release<K, O, const AXES: usize, const MOTORS: usize, const MOVES: usize>(
        &mut self,
        simulation: &mut Simulation<'_, K, O, AXES, MOTORS, MOVES>,
    ) where
        K: Kinematics<AXES, MOTORS>,
        O: Observer,
    {
        let now = simulation.now();
        self.pressed.retain(|(pin, until)| {
            let over = *until <= now;
            if over {
                simulation.force_pin(*pin, None);
            }
            !over
        });
    }

    fn toggle<K, O, const AXES: usize, const MOTORS: usize, const MOVES: usize>(
        &mut self,
        pin: Pin,
        simulation: &mut Simulation<'_, K, O, AXES, MOTORS, MOVES>,
    ) where
        K: Kinematics<AXES, MOTORS>,
        O: Observer,
    {
        let before = self.held.len();
        self.held.retain(|other| *other != pin);
        if self.held.len() == before {
            let high = level(simulation, pin);
            simulation.force_pin(pin, Some(!high));
            self.held.push(pin);
        } else {
            simulation.force_pin(pin, None);
        }
    }
}

/// The level of an input now.
pub(super) fn level<K, O, const AXES: usize, const MOTORS: usize, const MOVES: usize>(
    simulation: &Simulation<'_, K, O, AXES, MOTORS, MOVES>,
    pin: Pin,
) -> bool
where
    K: Kinematics<AXES, MOTORS>,
    O: Observer,
{
    let levels = simulation.board().plant.levels();
    match pin {
        Pin::Limit(motor) => levels.limits.contains(motor),
        Pin::Probe => levels.probe,
        Pin::Reset => levels.reset,
        Pin::Hold => levels.hold,
        Pin::Start => levels.start,
        Pin::Door => levels.door,
    }
}
