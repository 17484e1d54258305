//! Switches by `embedded-hal`: limits, probe, buttons.

use crate::fault::Fault;
use crate::words::Words;
use embedded_hal::digital::InputPin;
use leadscrew_machine::board::{Duration, Instant, Switches as Levels};
use leadscrew_stepper::MotorMask;

/// The switch interrupt before it has pins: see [`Switches::on`].
pub struct Switches<'a, const MOTORS: usize> {
    words: &'a Words<MOTORS>,
}

/// The pins of switches, each of which may be missing. They are pulled up; a closed switch is low,
/// or high with `$5` (limits) and `$6` (probe).
///
/// All pins have the same type, as in [`crate::Outputs`].
#[must_use]
pub struct SwitchPins<P, const MOTORS: usize> {
    limits: [Option<P>; MOTORS],
    probe: Option<P>,
    buttons: [Option<P>; 4],
}

impl<P: InputPin, const MOTORS: usize> SwitchPins<P, MOTORS> {
    /// Takes the limit switch of each motor.
    pub fn new(limits: [Option<P>; MOTORS]) -> Self {
        Self {
            limits,
            probe: None,
            buttons: [const { None }; 4],
        }
    }

    /// Adds the probe.
    pub fn with_probe(mut self, pin: P) -> Self {
        self.probe = Some(pin);
        self
    }

    /// Adds the reset button.
    pub fn with_reset(mut self, pin: P) -> Self {
        self.buttons[0] = Some(pin);
        self
    }

    /// Adds the feed hold button.
    pub fn with_hold(mut self, pin: P) -> Self {
        self.buttons[1] = Some(pin);
        self
    }

    /// Adds the cycle start button.
    pub fn with_start(mut self, pin: P) -> Self {
        self.buttons[2] = Some(pin);
        self
    }

    /// Adds the safety door's switch, for a machine with `Options::door`.
    pub fn with_door(mut self, pin: P) -> Self {
        self.buttons[3] = Some(pin);
        self
    }

    /// Reads all pins. A missing switch is open, and so is the pin of a motor that has none.
    fn read(&mut self) -> Result<Levels, P::Error> {
        let mut limits = MotorMask::ALL;
        for (motor, pin) in self.limits.iter_mut().enumerate() {
            if !is_high(pin)? {
                limits = limits.without(MotorMask::only(motor));
            }
        }
        let [reset, hold, start, door] = &mut self.buttons;
        Ok(Levels {
            limits,
            probe: is_high(&mut self.probe)?,
            reset: is_high(reset)?,
            hold: is_high(hold)?,
            start: is_high(start)?,
            door: is_high(door)?,
        })
    }
}

fn is_high<P: InputPin>(pin: &mut Option<P>) -> Result<bool, P::Error> {
    pin.as_mut().map_or(Ok(true), InputPin::is_high)
}

/// The switch interrupt. Give it to the handler of the pins' edges, below the step interrupt and
/// above the main loop.
pub struct Watch<'a, P, const MOTORS: usize> {
    pins: SwitchPins<P, MOTORS>,
    words: &'a Words<MOTORS>,
    believed: Levels,
    /// Levels that are not believed yet, since when, and where the motors stood then.
    change: Option<(Levels, Instant, [i32; MOTORS])>,
}

impl<'a, const MOTORS: usize> Switches<'a, MOTORS> {
    pub(crate) fn new(words: &'a Words<MOTORS>) -> Self {
        Self { words }
    }

    /// Watches `pins`, and reads them once. Before the first poll, so that a switch that is closed
    /// at power-up is known.
    pub fn on<P: InputPin>(self, mut pins: SwitchPins<P, MOTORS>) -> Watch<'a, P, MOTORS> {
        let believed = pins.read().unwrap_or_else(|_| {
            self.words.fail(Fault::Switch);
            Levels::OPEN
        });
        self.words.set_levels(&believed);
        Watch {
            pins,
            words: self.words,
            believed,
            change: None,
        }
    }
}

impl<P: InputPin, const MOTORS: usize> Watch<'_, P, MOTORS> {
    /// Looks at all switches: at every edge of any of them, and at the instant that was returned
    /// last. Stops, locks and latches at once, and wakes the main loop for the rest. Bounded; must
    /// not be interrupted by itself.
    ///
    /// Returns when to look again, if a level is not believed yet: it has to last for `$706`. Without
    /// an interrupt for edges, look every millisecond; then nothing has to be done with the answer.
    pub fn look(&mut self, now: Instant) -> Option<Instant> {
        let Ok(levels) = self.pins.read() else {
            self.words.fail(Fault::Switch);
            return None;
        };
        if levels == self.believed {
            self.change = None;
            return None;
        }
        let (since, position) = match self.change {
            Some((before, since, position)) if before == levels => (since, position),
            Some(_) | None => (now, self.words.shared.position()),
        };
        let ripe = since + Duration::from_ticks(self.words.filter_us().into());
        if now < ripe {
            self.change = Some((levels, since, position));
            return Some(ripe);
        }
        self.believed = levels;
        self.change = None;
        self.words.set_levels(&levels);
        let Words { inputs, shared, .. } = self.words;
        inputs.on_switches_at(&levels, shared, &position);
        self.words.bells.machine.ring();
        None
    }
}
