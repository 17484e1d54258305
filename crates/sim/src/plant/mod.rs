//! The machine beyond the pins: motor drivers, carriage and switches.
//!
//! A driver takes one step at each rising edge, in the direction that its pin shows at that
//! instant. The plant counts these steps, knows nothing of G-code, and checks the times that a
//! driver requires:
//!
//! ```text
//!  direction ____/‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾
//!                |<- setup ->|
//!  step      ________________/‾‾‾‾‾‾\____
//!                            |width|
//! ```
//!
//! Every motor has a carriage of its own. Two motors on one axis are the two sides of a gantry. The
//! gantry is square if both carriages stand at the same place; the plant does not limit its
//! skew.
//!
//! On crossed belts the first two motors move one carriage in X and Y: it stands at half their sum
//! and half their difference.

mod carriage;
mod plate;
mod rate;
mod switch;

use crate::clock::{Cycle, CPU_HZ};
use carriage::{Carriage, NOWHERE};
use leadscrew_machine::board::Switches;
use leadscrew_stepper::MotorMask;
use switch::set_level;

pub use plate::{Edges, Plate};
pub use switch::{Pin, Side, Switch};

/// Least time from a change of direction to the step, in cycles: 650 ns (TI DRV8825 data sheet
/// SLVSA73F, timing requirements; Allegro's A4988 asks for 200 ns).
pub const LEAST_SETUP: u64 = (650 * (CPU_HZ / 1_000_000)).div_ceil(1000);

/// The effect of rising step pins.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Rise {
    /// Motors whose pin was high already: no edge, no step.
    pub lost: MotorMask,
    /// The shortest time from a change of direction to this step, in cycles; `None` if no motor
    /// has changed its direction since its last step.
    pub setup: Option<u64>,
    /// True if a switch may have changed.
    pub switches: bool,
}

/// Drivers, carriages and switches.
#[derive(Clone, Debug)]
pub struct Plant<const MOTORS: usize> {
    carriages: [Carriage; MOTORS],
    high: MotorMask,
    negative: MotorMask,
    /// Motors whose direction has changed since their last step.
    unsettled: MotorMask,
    raised: Cycle,
    shortest_pulse: u64,
    shortest_setup: u64,
    /// The levels on the pins.
    levels: Switches,
    /// The levels that the pins would have if none were held.
    wired: Switches,
    switches: Vec<Switch>,
    /// Motors 0 and 1 are on crossed belts.
    crossed: bool,
    /// The shape of the plate that the probe meets, if it is uneven.
    plate: Option<Plate>,
    /// Pins that are held at a level.
    forced: Vec<(Pin, bool)>,
}

impl<const MOTORS: usize> Default for Plant<MOTORS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const MOTORS: usize> Plant<MOTORS> {
    /// Makes a plant whose carriages stand at 0, without a switch.
    pub fn new() -> Self {
        Self {
            carriages: core::array::from_fn(|_| Carriage::new()),
            high: MotorMask::NONE,
            negative: MotorMask::NONE,
            unsettled: MotorMask::NONE,
            raised: Cycle::ZERO,
            shortest_pulse: u64::MAX,
            shortest_setup: u64::MAX,
            levels: Switches::OPEN,
            wired: Switches::OPEN,
            switches: Vec::new(),
            crossed: false,
            plate: None,
            forced: Vec::new(),
        }
    }

    /// Raises the step pins of `motors`. Each motor whose pin was low makes a step.
    #[inline(always)] // 2.3 % fewer host instructions a step event (docs/benchmarks.md)
    pub fn raise(&mut self, now: Cycle, motors: MotorMask) -> Rise {
        let rising = motors.without(self.high);
        let mut switches = false;
        for (motor, carriage) in self.carriages.iter_mut().enumerate() {
            if rising.bits() >> motor & 1 == 1 {
                let by = 1 - 2 * i32::from(self.negative.bits() >> motor & 1);
                switches |= carriage.step(now, by);
            }
        }
        let lost = motors.without(rising);
        self.high = self.high.with(rising);
        self.raised = now;
        let setup = self.settle(now, rising);
        Rise {
            lost,
            setup,
            switches,
        }
    }

    /// Returns true if each motor may make `steps` more steps without passing a switch.
    pub(crate) fn is_free_for(&self, steps: u32) -> bool {
        let far = steps.cast_signed();
        let is_inside = |carriage: &Carriage| {
            let (low, high) = carriage.window;
            carriage.position.saturating_sub(far) >= low
                && carriage.position.saturating_add(far) <= high
        };
        self.carriages.iter().all(is_inside)
    }

    /// Makes many steps of each motor at once, as its direction pin is.
    pub(crate) fn carry(&mut self, steps: &[u32; MOTORS]) {
        for (motor, (carriage, steps)) in self.carriages.iter_mut().zip(steps).enumerate() {
            let by = 1 - 2 * i32::from(self.negative.bits() >> motor & 1);
            let way = steps.cast_signed().wrapping_mul(by);
            carriage.position = carriage.position.wrapping_add(way);
            carriage.pulses += u64::from(*steps);
        }
    }

    /// Makes a step of each of `motors`, as its direction pin is.
    pub(crate) fn carry_once(&mut self, motors: MotorMask) {
        for (motor, carriage) in self.carriages.iter_mut().enumerate() {
            let steps = i32::from(motors.bits() >> motor & 1);
            let by = 1 - 2 * i32::from(self.negative.bits() >> motor & 1);
            carriage.position = carriage.position.wrapping_add(steps * by);
            carriage.pulses += u64::from(motors.bits() >> motor & 1);
        }
    }

    /// Lets all step pins fall; returns the width of the last pulse in cycles.
    #[inline]
    pub fn fall(&mut self, now: Cycle) -> u64 {
        let width = now - self.raised;
        self.high = MotorMask::NONE;
        self.shortest_pulse = self.shortest_pulse.min(width);
        width
    }

    /// Sets the direction pins. Returns the motors that changed direction in the middle of a pulse.
    #[inline]
    pub fn set_direction(&mut self, now: Cycle, negative: MotorMask) -> MotorMask {
        let changed = MotorMask::from_bits(self.negative.bits() ^ negative.bits());
        if changed.is_empty() {
            return MotorMask::NONE;
        }
        self.negative = negative;
        self.unsettled = self.unsettled.with(changed);
        for (motor, carriage) in self.carriages.iter_mut().enumerate() {
            if changed.contains(motor) {
                carriage.direction_changed = now;
            }
        }
        changed.without(changed.without(self.high))
    }

    /// Returns the direction pins as they are.
    #[inline]
    pub fn direction(&self) -> MotorMask {
        self.negative
    }

    /// Returns true if a step pin is high.
    #[inline]
    pub fn in_pulse(&self) -> bool {
        !self.high.is_empty()
    }

    /// Moves the carriages to another place without steps; the controller does not notice.
    pub fn place(&mut self, position: [i32; MOTORS]) {
        self.place_unseen(position);
        self.update_switches();
    }

    /// As [`Plant::place`], but the switches keep their levels until a carriage steps.
    pub fn place_unseen(&mut self, position: [i32; MOTORS]) {
        for (carriage, place) in self.carriages.iter_mut().zip(position) {
            carriage.origin += i64::from(place) - i64::from(carriage.position);
            carriage.position = place;
            carriage.window = NOWHERE;
        }
    }

    /// Puts motors 0 and 1 on crossed belts. To be called before switches are added.
    pub fn cross_belts(&mut self) {
        self.crossed = true;
    }

    /// Bends and tilts the plate that the probe's switch stands for.
    pub fn bend_plate(&mut self, plate: Plate) {
        self.plate = Some(plate);
    }

    /// Adds a switch that a carriage works. From then on the switch sets its pin, not
    /// [`Plant::set_pin`].
    pub fn add_switch(&mut self, switch: Switch) {
        self.switches.push(switch);
        self.update_switches();
    }

    /// Removes all switches; the pins keep their levels.
    pub fn remove_switches(&mut self) {
        self.switches.clear();
        self.update_switches();
    }

    /// Sets the level of a pin without a switch that a carriage works, such as a button's pin.
    pub fn set_pin(&mut self, pin: Pin, high: bool) {
        set_level(&mut self.wired, pin, high);
        self.update_switches();
    }

    /// Holds a pin at a level whatever its switch does, as a finger or a disturbance would; `None`
    /// releases it. Returns the level at which it was held before.
    pub fn force(&mut self, pin: Pin, level: Option<bool>) -> Option<bool> {
        let held = self.forced.iter().position(|(other, _)| *other == pin);
        let before = held.map(|held| self.forced.swap_remove(held).1);
        self.forced.extend(level.map(|level| (pin, level)));
        self.update_switches();
        before
    }

    /// Returns the levels of all inputs.
    pub fn levels(&self) -> &Switches {
        &self.levels
    }

    /// Brings the levels and the windows up to the carriages' positions; returns whether a level
    /// changed.
    pub fn update_switches(&mut self) -> bool {
        let before = self.levels;
        let surface = self.surface();
        for carriage in &mut self.carriages {
            carriage.window = (i32::MIN, i32::MAX);
        }
        // Several switches may share a pin. A switch on whose `side` the carriage is overrides the
        // others.
        for decisive in [false, true] {
            for switch in &self.switches {
                let place = match self.carriages.as_slice() {
                    [a, b, ..] if self.crossed && switch.motor < 2 => {
                        let both = [a.position + b.position, a.position - b.position];
                        Some(both[switch.motor].div_euclid(2))
                    }
                    all => all.get(switch.motor).map(|carriage| carriage.position),
                };
                let Some(place) = place else { continue };
                let uneven = surface.filter(|_| switch.pin == Pin::Probe);
                let level = switch.level_at(place - uneven.unwrap_or(0));
                if (level == switch.level) == decisive {
                    set_level(&mut self.wired, switch.pin, level);
                }
                if uneven.is_some() {
                    // Any step of X, Y or Z may reach the plate's surface.
                    let all = self.carriages.iter_mut();
                    all.for_each(|carriage| carriage.window = NOWHERE);
                } else if self.crossed && switch.motor < 2 {
                    // Any step of either motor may pass the switch.
                    self.carriages[..2]
                        .iter_mut()
                        .for_each(|carriage| carriage.window = NOWHERE);
                } else if let Some(carriage) = self.carriages.get_mut(switch.motor) {
                    let (low, high) = switch.window(place);
                    carriage.window = (carriage.window.0.max(low), carriage.window.1.min(high));
                }
            }
        }
        self.levels = self.wired;
        for (pin, level) in &self.forced {
            set_level(&mut self.levels, *pin, *level);
        }
        self.levels != before
    }

    /// The height of an uneven plate under the carriages of X and Y, above the switch's place, in
    /// steps of Z.
    fn surface(&self) -> Option<i32> {
        let [a, b, ..] = self.carriages.as_slice() else {
            return None;
        };
        let (a, b) = (a.position, b.position);
        let place = match self.crossed {
            true => [(a + b).div_euclid(2), (a - b).div_euclid(2)],
            false => [a, b],
        };
        Some(self.plate?.height(place))
    }

    /// Returns the carriages' places, in steps.
    pub fn position(&self) -> [i32; MOTORS] {
        self.carriages.each_ref().map(|carriage| carriage.position)
    }

    /// Returns the steps that each motor has made since power-up, positive less negative, by the
    /// level of its direction pin.
    pub fn net_steps(&self) -> [i64; MOTORS] {
        self.carriages
            .each_ref()
            .map(|carriage| i64::from(carriage.position) - carriage.origin)
    }

    /// Returns the steps that each motor has made, in either direction.
    pub fn pulses(&self) -> [u64; MOTORS] {
        self.carriages.each_ref().map(|carriage| carriage.pulses)
    }

    /// Returns the highest rate of each motor in steps/s, over 16 steps.
    pub fn peak_rates(&self) -> [f64; MOTORS] {
        self.carriages
            .each_ref()
            .map(|carriage| carriage.rate.hertz())
    }

    /// Returns the shortest pulse in cycles; `None` if there was none.
    pub fn shortest_pulse(&self) -> Option<u64> {
        Some(self.shortest_pulse).filter(|width| *width != u64::MAX)
    }

    /// Returns the shortest time from a change of direction to its motor's next step in cycles;
    /// `None` if there was none.
    pub fn shortest_setup(&self) -> Option<u64> {
        Some(self.shortest_setup).filter(|setup| *setup != u64::MAX)
    }

    #[inline]
    fn settle(&mut self, now: Cycle, rising: MotorMask) -> Option<u64> {
        if self.unsettled.bits() & rising.bits() == 0 {
            return None;
        }
        self.settle_some(now, rising)
    }

    #[cold]
    fn settle_some(&mut self, now: Cycle, rising: MotorMask) -> Option<u64> {
        let stepped = MotorMask::from_bits(self.unsettled.bits() & rising.bits());
        self.unsettled = self.unsettled.without(stepped);
        let setup = (0..MOTORS)
            .filter(|motor| stepped.contains(*motor))
            .map(|motor| now - self.carriages[motor].direction_changed)
            .min();
        self.shortest_setup = self.shortest_setup.min(setup.unwrap_or(u64::MAX));
        setup
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const X: MotorMask = MotorMask::from_bits(1);
    const XY: MotorMask = MotorMask::from_bits(3);

    #[test]
    fn a_step_is_made_at_a_rising_edge_in_the_direction_of_the_pin() {
        let mut plant = Plant::<2>::new();
        assert!(plant.raise(Cycle(1000), XY).lost.is_empty());
        assert_eq!(plant.fall(Cycle(1500)), 500);
        plant.set_direction(Cycle(1500), X);
        let rise = plant.raise(Cycle(3000), XY);
        assert_eq!(rise.setup, Some(1500));
        assert_eq!(plant.position(), [0, 2]);
        assert_eq!(plant.pulses(), [2, 2]);
    }

    #[test]
    fn a_pin_that_is_high_already_makes_no_step() {
        let mut plant = Plant::<2>::new();
        plant.raise(Cycle(1000), X);
        let rise = plant.raise(Cycle(1100), XY);
        assert_eq!(rise.lost, X);
        assert_eq!(plant.position(), [1, 1]);
    }

    #[test]
    fn a_direction_that_changes_in_a_pulse_is_noticed() {
        let mut plant = Plant::<2>::new();
        plant.raise(Cycle(1000), X);
        assert_eq!(plant.set_direction(Cycle(1100), XY), X);
    }

    #[test]
    fn a_switch_closes_where_it_stands_and_opens_on_the_way_back() {
        let mut plant = Plant::<1>::new();
        plant.add_switch(Switch {
            pin: Pin::Limit(0),
            motor: 0,
            side: Side::AtOrBelow,
            place: -3,
            level: false,
        });
        let mut now = Cycle(1000);
        let mut step = |plant: &mut Plant<1>, negative| {
            now = now + 1000;
            plant.set_direction(now, negative);
            let rise = plant.raise(now + 500, X);
            plant.fall(now + 900);
            rise.switches && plant.update_switches()
        };
        assert_eq!([0; 3].map(|_| step(&mut plant, X)), [false, false, true]);
        assert!(!plant.levels().limits.contains(0));
        assert!(!step(&mut plant, X));
        assert_eq!(
            [0; 2].map(|_| step(&mut plant, MotorMask::NONE)),
            [false, true]
        );
        assert!(plant.levels().limits.contains(0));
    }

    #[test]
    fn two_switches_of_one_carriage_keep_to_their_own_places() {
        let mut plant = Plant::<1>::new();
        let switch = |pin, side, place| Switch {
            pin,
            motor: 0,
            side,
            place,
            level: false,
        };
        plant.add_switch(switch(Pin::Limit(0), Side::AtOrAbove, 10));
        plant.add_switch(switch(Pin::Probe, Side::AtOrBelow, -10));
        for (position, limit, probe) in [(9, true, true), (10, false, true), (-10, true, false)] {
            plant.place([position]);
            assert_eq!(plant.levels().limits.contains(0), limit);
            assert_eq!(plant.levels().probe, probe);
        }
        plant.remove_switches();
        assert!(!plant.levels().probe);
    }

    #[test]
    fn a_pin_that_is_let_go_is_as_its_switch_or_its_wire_has_it() {
        let mut plant = Plant::<1>::new();
        plant.set_pin(Pin::Door, false);
        assert_eq!(plant.force(Pin::Door, Some(true)), None);
        assert_eq!(plant.force(Pin::Hold, Some(false)), None);
        assert!(plant.levels().door && !plant.levels().hold);
        assert_eq!(plant.force(Pin::Hold, Some(true)), Some(false));
        assert_eq!(plant.force(Pin::Hold, None), Some(true));
        plant.force(Pin::Door, None);
        assert!(!plant.levels().door && plant.levels().hold);
    }

    #[test]
    fn a_carriage_put_elsewhere_unseen_works_its_switch_with_the_next_step() {
        let mut plant = Plant::<1>::new();
        plant.add_switch(Switch {
            pin: Pin::Probe,
            motor: 0,
            side: Side::AtOrAbove,
            place: 10,
            level: false,
        });
        plant.place_unseen([50]);
        assert!(plant.levels().probe);
        assert!(plant.raise(Cycle(1000), X).switches && plant.update_switches());
        assert!(!plant.levels().probe);
    }

    #[test]
    fn a_carriage_put_elsewhere_has_made_no_steps() {
        let mut plant = Plant::<1>::new();
        plant.raise(Cycle(1000), X);
        plant.place([50]);
        plant.fall(Cycle(1500));
        plant.raise(Cycle(2000), X);
        assert_eq!((plant.position(), plant.net_steps()), ([51], [2]));
    }
}
