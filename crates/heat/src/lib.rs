#![no_std]
#![forbid(unsafe_code)]
#![doc = include_str!("../README.md")]

mod fault;
mod heater;
mod refusal;
mod sensor;
mod valid;

pub use fault::Fault;
pub use heater::{Heater, HeaterConfig, Limits};
pub use sensor::Sensor;

pub use refusal::errors;
pub use valid::ConfigError;

use core::fmt;
use heapless::Vec;
use leadscrew_gcode::{Letter, Number};
use leadscrew_machine::board::{Duration, Instant};
use leadscrew_machine::extension::{Asked, Call, Cx, Event, Extension, Gate, MCode, OwnCode, Step};
use leadscrew_machine::guard::Load;
use leadscrew_machine::protocol::alarm::Alarm;
use leadscrew_machine::protocol::status::Status;
use leadscrew_machine::state::State;
use libm::roundf;
use refusal::Refusal;

/// The period in which temperatures are read and heaters are switched: 100 ms.
pub const PERIOD: Duration = Duration::from_ticks(100_000);

/// The pins of heaters, sensors and fan.
pub trait HeatPort {
    /// Called before all sensors are read, every [`PERIOD`], so that a board can start its
    /// conversions.
    fn begin(&mut self, now: Instant) {
        let _ = now;
    }

    /// The voltage at a heater's sensor, as a share of the reference voltage, 0 to 1. 12 bits are
    /// enough.
    fn sensor(&mut self, heater: usize) -> f32;

    /// Switches a heater.
    fn heat(&mut self, heater: usize, on: bool);

    /// Sets the fan, 0 to 255. A board whose fan is a relay switches it on from 1.
    fn fan(&mut self, power: u8) {
        let _ = power;
    }

    /// Switches the relay that supplies all heaters, if there is one. It is on at power-up, and
    /// goes off when a heater does not cool.
    fn supply(&mut self, on: bool) {
        let _ = on;
    }

    /// Returns true if another device reports a fault of the heaters, such as another controller or
    /// a thermal cut-out.
    fn external_fault(&mut self) -> bool {
        false
    }
}

/// The axis and the outputs that work only while the nozzle is warm.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Gates {
    /// The extruder's axis, counted from 0, which does not turn below the heater's
    /// [`Limits::extrusion`]; `None` if there is none.
    pub extruder_axis: Option<usize>,
    /// The outputs (M62, M64) that go on only from that temperature on, one bit for each output.
    pub feeders: u8,
    /// True if a program's moves wait until all heaters that have a target have reached it.
    pub wait_until_ready: bool,
}

/// The configuration of the parts besides the heaters.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct HeatConfig {
    /// The axis and the outputs that work only while the nozzle is warm.
    pub gates: Gates,
    /// The heater of M104 and M109, counted from 0.
    pub nozzle: usize,
    /// The heater of M140 and M190, counted from 0; `None` if there is no bed.
    pub bed: Option<usize>,
    /// The reference voltage of the sensors, V.
    pub reference: f32,
    /// True if there is a fan: without one M106 and M107 are refused.
    pub fan: bool,
}

/// Up to `N` heaters, and a fan.
#[derive(Debug)]
pub struct Heat<P, const N: usize> {
    config: HeatConfig,
    heaters: Vec<Heater, N>,
    port: P,
    next: Option<Instant>,
    fan: u8,
    /// The heaters went off in a hold and are on again: the hold ends once they are warm.
    reheats: bool,
    /// The heater's index and the fault that have been reported to the operator.
    told: Option<(usize, Fault)>,
}

impl<P: HeatPort, const N: usize> Heat<P, N> {
    /// Makes the extension for the first `N` heaters, and switches all of them off.
    ///
    /// # Errors
    /// A value with which a heater would not be watched. The pins are left alone.
    pub fn new(
        config: HeatConfig,
        heaters: impl IntoIterator<Item = HeaterConfig>,
        port: P,
    ) -> Result<Self, ConfigError> {
        let heaters: Vec<_, N> = heaters.into_iter().take(N).collect();
        config.validate(&heaters)?;
        let mut heat = Self {
            config,
            heaters: heaters.into_iter().map(Heater::new).collect(),
            port,
            next: None,
            fan: 0,
            reheats: false,
            told: None,
        };
        heat.port.supply(true);
        heat.off();
        Ok(heat)
    }

    /// Returns the heaters, with their temperatures.
    pub fn heaters(&self) -> &[Heater] {
        &self.heaters
    }

    /// Switches all heaters off, until `~` if the machine `resumes` with it.
    fn heaters_off(&mut self, resumes: bool) {
        for (index, heater) in self.heaters.iter_mut().enumerate() {
            match resumes {
                true => heater.put_off(),
                false => heater.set_target(0.0),
            }
            self.port.heat(index, false);
        }
        self.reheats = false;
    }

    /// Switches all heaters and the fan off, and sets all targets to 0.
    fn off(&mut self) {
        self.heaters_off(false);
        self.fan = 0;
        self.port.fan(0);
    }

    /// The heater that an M code is for: the one with number P, or else nozzle or bed. T does not
    /// choose a heater, since it may come from an earlier line.
    fn heater_of(&self, call: &Call) -> Option<usize> {
        let index = match (call.words.get(Letter::P), call.code) {
            (Some(number), _) => usize::try_from(number.trunc()).ok()?,
            (None, 140 | 190) => self.config.bed?,
            (None, _) => self.config.nozzle,
        };
        (index < self.heaters.len()).then_some(index)
    }

    fn set_target(&mut self, call: &Call) {
        let (index, target) = (self.heater_of(call), call.words.get(Letter::S));
        if let (Some(index), Some(target)) = (index, target) {
            if let Some(heater) = self.heaters.get_mut(index) {
                heater.set_target(target.to_f32());
            }
        }
    }

    /// Returns true if the heaters that an M code waits for are ready.
    fn is_ready(&self, call: &Call) -> bool {
        match call.code {
            116 => self.heaters.iter().all(Heater::is_ready),
            _ => {
                let index = self.heater_of(call);
                index
                    .and_then(|index| self.heaters.get(index))
                    .is_none_or(Heater::is_ready)
            }
        }
    }

    fn is_warm(&self) -> bool {
        let nozzle = self.heaters.get(self.config.nozzle);
        nozzle.is_none_or(Heater::may_extrude)
    }

    fn show<const AXES: usize>(&self, cx: &mut Cx<'_, AXES>) {
        cx.line(format_args!("[HEAT:{}]", Temperatures(&self.heaters)));
    }

    /// Reads all sensors and switches all heaters; returns the first fault that it finds.
    fn regulate(&mut self, now: Instant) -> Option<(usize, Fault)> {
        let mut found = None;
        self.port.begin(now);
        for (index, heater) in self.heaters.iter_mut().enumerate() {
            let share = self.port.sensor(index);
            match heater.regulate(share, self.config.reference, now) {
                Ok(on) => self.port.heat(index, on),
                Err(fault) => found = found.or(Some((index, fault))),
            }
        }
        let external = self.port.external_fault();
        found.or(external.then_some((self.config.nozzle, Fault::External)))
    }

    /// Switches everything off while a fault lasts. Reports the fault once, and again only after
    /// `$X`.
    fn stop_for<const AXES: usize>(&mut self, index: usize, fault: Fault, cx: &mut Cx<'_, AXES>) {
        self.off();
        if fault == Fault::DoesNotCool {
            self.port.supply(false);
        }
        let is_known = self.told.replace((index, fault)) == Some((index, fault));
        if is_known && matches!(cx.state, State::Alarm(_)) {
            return;
        }
        let name = self.heaters.get(index).map_or("", Heater::name);
        match fault {
            Fault::DoesNotCool => {
                cx.message(format_args!("Cut the power: heater {name} does not go off"));
            }
            _ => cx.message(format_args!("Heater {name}: {}", fault.text())),
        }
        cx.alarm(Alarm::Own(fault.alarm().number));
    }
}

impl<P: HeatPort, const AXES: usize, const N: usize> Extension<AXES> for Heat<P, N> {
    fn m_code(&self, number: u8) -> Option<MCode> {
        const HEATER: MCode = MCode::with(&[Letter::S, Letter::P, Letter::T]);
        match number {
            104 | 109 if !self.heaters.is_empty() => Some(HEATER),
            140 | 190 if self.config.bed.is_some() => Some(HEATER),
            105 => Some(MCode::with(&[Letter::T])),
            106 if self.config.fan => Some(MCode::with(&[Letter::S, Letter::P])),
            107 if self.config.fan => Some(MCode::with(&[Letter::P])),
            116 => Some(MCode::PLAIN),
            _ => None,
        }
    }

    fn check(&self, call: &Call) -> Result<(), Status> {
        if !matches!(call.code, 104 | 109 | 140 | 190) {
            return Ok(());
        }
        let heater = self
            .heater_of(call)
            .and_then(|index| self.heaters.get(index));
        let heater = heater.ok_or(Refusal::NoSuchHeater.status())?;
        let target = call.words.get(Letter::S).map(Number::to_f32);
        match target {
            None if matches!(call.code, 104 | 140) => Err(Status::MissingWord),
            Some(target) if !heater.takes(target) => Err(Refusal::OutOfRange.status()),
            Some(_) | None => Ok(()),
        }
    }

    fn gate(&self, asked: &Asked<'_, AXES>) -> Gate {
        let gates = &self.config.gates;
        let cold = Gate::Refuse(Refusal::TooCold.status());
        match asked {
            Asked::Move { from, target, jog } => {
                let ends = gates
                    .extruder_axis
                    .map(|axis| (from.get(axis), target.get(axis)));
                let extrudes = ends.is_some_and(|(from, target)| from != target);
                let ready = self.heaters.iter().all(Heater::is_ready);
                match extrudes && !self.is_warm() {
                    true => cold,
                    false if gates.wait_until_ready && !jog && !ready => Gate::Wait,
                    false => Gate::Open,
                }
            }
            Asked::Code(call) if matches!(call.code, 62 | 64) => {
                let output = call.words.get(Letter::P).unwrap_or_default().trunc();
                let bit = u32::try_from(output)
                    .ok()
                    .and_then(|output| 1u8.checked_shl(output));
                let feeds = gates.feeders & bit.unwrap_or(0) != 0;
                match feeds && !self.is_warm() {
                    true => cold,
                    false => Gate::Open,
                }
            }
            _ => Gate::Open,
        }
    }

    fn perform(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) -> Step<AXES> {
        match call.code {
            104 | 140 => self.set_target(call),
            105 => self.show(cx),
            106 => {
                let power = call.words.get(Letter::S).map_or(255, |power| power.trunc());
                self.fan = u8::try_from(power.clamp(0, 255)).unwrap_or(255);
                self.port.fan(self.fan);
            }
            107 => {
                self.fan = 0;
                self.port.fan(0);
            }
            _ if !cx.at_rest => return Step::Rest,
            _ => {
                self.set_target(call);
                if !self.is_ready(call) {
                    return Step::Wait(self.next);
                }
            }
        }
        Step::Done
    }

    fn errors(&self) -> impl Iterator<Item = &'static OwnCode> {
        errors()
    }

    fn alarms(&self) -> impl Iterator<Item = &'static OwnCode> {
        Fault::ALL.iter().map(|fault| fault.alarm())
    }

    fn report(&self, fields: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.heaters.is_empty() {
            true => Ok(()),
            false => write!(fields, "|Heat:{}", Temperatures(&self.heaters)),
        }
    }

    fn event(&mut self, event: Event) {
        match event {
            Event::Enters(State::Alarm(_) | State::Sleep) | Event::Reset | Event::ProgramEnd => {
                self.off();
            }
            Event::LeftAlone {
                load: Load::Heat,
                resumes: true,
            } => self.heaters_off(true),
            Event::LeftAlone {
                load: Load::Heat, ..
            } => self.off(),
            _ => {}
        }
    }

    fn is_on(&self, load: Load) -> bool {
        load == Load::Heat && self.heaters.iter().any(|heater| heater.target() > 0.0)
    }

    fn resumes(&mut self, cx: &mut Cx<'_, AXES>) -> bool {
        for heater in &mut self.heaters {
            self.reheats |= heater.take_back();
        }
        self.reheats &= !self.heaters.iter().all(Heater::is_ready);
        if self.reheats {
            cx.message(format_args!("Heaters on again, ~ once they are warm"));
        }
        !self.reheats
    }

    fn poll(&mut self, cx: &mut Cx<'_, AXES>) -> Option<Instant> {
        if self.next.is_none_or(|next| cx.now >= next) {
            self.next = Some(cx.now + PERIOD);
            match self.regulate(cx.now) {
                Some((index, fault)) => self.stop_for(index, fault, cx),
                None => self.told = None,
            }
        }
        self.next
    }
}

/// Prints all heaters as `name,temperature,target`, separated by `;`.
struct Temperatures<'a>(&'a [Heater]);

impl fmt::Display for Temperatures<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, heater) in self.0.iter().enumerate() {
            let separator = if index > 0 { ";" } else { "" };
            let (now, target) = (Tenths(heater.celsius()), Tenths(heater.target()));
            write!(f, "{separator}{},{now},{target}", heater.name())?;
        }
        Ok(())
    }
}

/// Prints a temperature with one decimal. The formatting of floats in `core` would take 9 KB of a
/// microcontroller's flash.
struct Tenths(f32);

impl fmt::Display for Tenths {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tenths = roundf(self.0 * 10.0) as i32;
        let sign = if tenths < 0 { "-" } else { "" };
        let tenths = tenths.unsigned_abs();
        write!(f, "{sign}{}.{}", tenths / 10, tenths % 10)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_temperature_has_one_decimal_and_its_sign() {
        extern crate std;
        use std::string::ToString;
        for (celsius, text) in [
            (0.0, "0.0"),
            (-0.04, "0.0"),
            (-0.06, "-0.1"),
            (-39.96, "-40.0"),
            (254.85, "254.9"),
            (1e12, "214748364.7"),
        ] {
            assert_eq!(Tenths(celsius).to_string(), text);
        }
    }
}
