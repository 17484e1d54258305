//! Disturbances on the limit inputs: wrong levels for microseconds. Their instants look random, but
//! are the same in every run.

use crate::desk::Desk;
use crate::wires::Wires;
use leadscrew_sim::clock::{cycles_of_micros, Cycle, CPU_HZ};
use leadscrew_sim::plant::Pin;
use leadscrew_sim::profile::Profile;

/// The length of a glitch if the file does not say, microseconds.
const GLITCH_US: u16 = 5;

/// Draws the instants and inputs of glitches.
#[derive(Clone, Debug)]
pub struct Glitches {
    /// Mean time between two glitches, cycles; `None` if there are none.
    mean: Option<f64>,
    /// The length of a glitch, cycles.
    width: u64,
    /// State of the generator: xorshift64 (Marsaglia 2003), never 0.
    random: u64,
    next: Cycle,
}

impl Glitches {
    /// Makes the glitches of the machine of this file.
    pub fn of(file: &Profile) -> Self {
        let width_us = file.switches.glitch_us.unwrap_or(GLITCH_US);
        Self::new(file.switches.glitches.get(), width_us)
    }

    /// Makes glitches of `width_us` microseconds, on average `per_second` of them in a second.
    fn new(per_second: f64, width_us: u16) -> Self {
        let mean = (per_second > 0.0).then(|| CPU_HZ as f64 / per_second);
        let mut glitches = Self {
            mean,
            width: cycles_of_micros(u64::from(width_us)),
            random: 0x2545_F491_4F6C_DD1D,
            next: Cycle::NEVER,
        };
        glitches.schedule(Cycle::ZERO);
        glitches
    }

    /// Runs the simulation up to `end`, with glitches on the way.
    pub fn run_until(&mut self, desk: &mut Desk<'_>, wires: &mut Wires, end: Cycle) {
        while self.next <= end {
            desk.run_until(wires, self.next);
            let pin = Pin::Limit((self.draw() % desk.motors() as u64) as usize);
            let wrong = !desk.level(pin);
            // The user may hold the switch at the same time.
            let before = desk.force_pin(pin, Some(wrong));
            desk.run_until(wires, self.next + self.width);
            desk.force_pin(pin, before);
            self.schedule(self.next + self.width);
        }
        desk.run_until(wires, end);
    }

    /// Draws the instant of the next glitch: the times between them are exponentially distributed.
    fn schedule(&mut self, after: Cycle) {
        let share = (self.draw() >> 11) as f64 / (1u64 << 53) as f64;
        self.next = match self.mean {
            Some(mean) => after + (-mean * (1.0 - share).ln()) as u64,
            None => Cycle::NEVER,
        };
    }

    fn draw(&mut self) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_come_as_were_asked_for_on_the_average() {
        let mut glitches = Glitches::new(50.0, 5);
        for _ in 0..2000 {
            glitches.schedule(glitches.next);
        }
        let rate = 2001.0 / glitches.next.seconds();
        assert!((47.0..53.0).contains(&rate), "{rate}");
    }

    #[test]
    fn none_come_where_none_were_asked_for() {
        assert_eq!(Glitches::new(0.0, 5).next, Cycle::NEVER);
    }
}
