//! Likely mistakes with the spindle, the laser and the feed: each is told once.

use super::Checker;
use crate::remark::Remark;
use leadscrew_gcode::{Letter, Number};
use leadscrew_machine::config::{extruder, AxisKind};
use leadscrew_machine::extension::Call;
use leadscrew_machine::interpreter::{Feed, Rotation, Spindle, Travel};
use leadscrew_machine::settings::table::{AxisSetting, Setting};
use leadscrew_planner::Coordinate;

/// A likely mistake, and the details of this case.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Doubt {
    /// The mistake.
    pub remark: Remark,
    /// The words that differ from case to case.
    pub detail: Option<String>,
}

impl Doubt {
    pub(super) fn new(remark: Remark, detail: String) -> Self {
        let detail = Some(detail).filter(|detail| !detail.is_empty());
        Self { remark, detail }
    }
}

/// A line of the program that a doubt at its end is about.
#[derive(Clone, Debug)]
struct Place {
    line: u64,
    text: Vec<u8>,
}

/// The habits of a program so far.
#[derive(Default)]
pub(super) struct Habits {
    /// Doubts about the line that is being checked.
    pub(super) found: Vec<Doubt>,
    /// Remarks that have been told.
    told: Vec<Remark>,
    /// The line that switched the spindle or the laser on first.
    switched_on: Option<Place>,
    /// The first feed move with power.
    powered: Option<Place>,
    /// The highest S of a feed move with power.
    highest: Number,
    /// The spindle or the laser was on with an S above 0.
    has_power: bool,
    /// The nozzle is still to be heated.
    pub(super) is_cold: bool,
    /// The spindle at the end of the last command.
    spindle: Spindle,
    /// The lowest rate of all straight axes, mm/min. A slower feed needs no second look.
    slowest: Number,
}

impl Habits {
    /// Returns true if a doubt at the end of the program may quote the line that is being checked.
    pub(super) fn may_need_lines(&self) -> bool {
        self.switched_on.is_none() || self.powered.is_none()
    }

    fn has_told(&self, remark: Remark) -> bool {
        self.told.contains(&remark)
    }

    /// Notes a doubt, if its kind has not been told before.
    pub(super) fn note(&mut self, remark: Remark, detail: impl FnOnce() -> String) {
        if !self.has_told(remark) {
            self.told.push(remark);
            self.found.push(Doubt::new(remark, detail()));
        }
    }
}

impl<const AXES: usize> Checker<AXES> {
    /// Takes over rates that have changed.
    pub(super) fn learn_rates(&mut self) {
        let rates = self.settings.axes(AxisSetting::MaxRate);
        let straight = rates.into_iter().zip(&self.config.axes);
        let straight = straight.filter(|(_, kind)| **kind == AxisKind::Linear);
        self.habits.slowest = straight.map(|(rate, _)| rate).min().unwrap_or_default();
    }

    /// Takes the spindle that a line switches.
    pub(super) fn see_spindle(&mut self, spindle: &Spindle) {
        self.habits.spindle = *spindle;
        self.habits.has_power |= is_powered(spindle);
        if spindle.rotation != Rotation::Off && self.habits.switched_on.is_none() {
            self.habits.switched_on = Some(self.place());
        }
    }

    /// Takes a move that begins at `start`.
    pub(super) fn see_move(&mut self, start: &[Coordinate; AXES], travel: &Travel<AXES>) {
        self.habits.spindle = travel.spindle;
        self.habits.has_power |= is_powered(&travel.spindle);
        self.see_filament(start, travel);
        if travel.feed != Feed::Rapid {
            self.see_power(&travel.spindle);
            self.see_rate(start, travel);
        }
    }

    /// Notes filament that is fed by a nozzle which nothing has heated.
    fn see_filament(&mut self, start: &[Coordinate; AXES], travel: &Travel<AXES>) {
        if !self.habits.is_cold {
            return;
        }
        let axis = extruder(&self.config.axes);
        if axis.is_some_and(|axis| travel.target[axis] != start[axis]) {
            self.habits.note(Remark::ColdNozzle, String::new);
        }
    }

    /// Takes a call of an M code of an extension.
    pub(super) fn see_call(&mut self, call: &Call) {
        let heats = matches!(call.code, 104 | 109);
        let degrees = call.words.get(Letter::S).unwrap_or_default();
        self.habits.is_cold &= !(heats && degrees > Number::default());
    }

    /// Takes a dwell, s.
    pub(super) fn see_dwell(&mut self, seconds: Number) {
        if seconds >= Number::from_int(LONG_DWELL) {
            let words = || format!("it takes {seconds} s");
            self.habits.note(Remark::LongDwell, words);
        }
    }

    /// Takes the spindle of a feed move.
    fn see_power(&mut self, spindle: &Spindle) {
        let (speed, zero) = (spindle.speed, Number::default());
        let is_on = spindle.rotation != Rotation::Off;
        if speed <= zero {
            return;
        }
        if !is_on {
            if self.habits.switched_on.is_none() {
                let words = || format!("S{speed}");
                self.habits.note(Remark::PowerWithoutStart, words);
            }
            return;
        }
        let full = self.settings.value(Setting::MaxSpeed);
        if speed > full {
            let words = || format!("S{speed}, full power is $30={full}");
            self.habits.note(Remark::AboveFullPower, words);
        }
        self.habits.highest = self.habits.highest.max(speed);
        if self.habits.powered.is_none() {
            self.habits.powered = Some(self.place());
        }
    }

    /// The line under way.
    fn place(&self) -> Place {
        Place {
            line: u64::from(self.path.line),
            text: self.raw.clone(),
        }
    }

    /// Notes a feed that the axes do not reach on a straight way.
    fn see_rate(&mut self, start: &[Coordinate; AXES], travel: &Travel<AXES>) {
        let Feed::PerMinute(feed) = travel.feed else {
            return;
        };
        if feed <= self.habits.slowest || self.habits.has_told(Remark::AboveRate) {
            return;
        }
        let way: [f64; AXES] =
            std::array::from_fn(|axis| (travel.target[axis] - start[axis]).to_mm().into());
        let turns = |(way, kind): (&f64, &AxisKind)| *way != 0.0 && *kind != AxisKind::Linear;
        let length = way.iter().map(|way| way * way).sum::<f64>().sqrt();
        if length == 0.0 || way.iter().zip(&self.config.axes).any(turns) {
            return;
        }
        let rates = self.settings.axes(AxisSetting::MaxRate);
        let most = rates.iter().zip(way).filter(|(_, way)| *way != 0.0);
        let most = most.map(|(rate, way)| rate.nanos() as f64 * 1e-9 * length / way.abs());
        let most = most.fold(f64::INFINITY, f64::min);
        // A hundredth: rates in inches are rounded.
        if feed.nanos() as f64 * 1e-9 > most * 1.01 {
            self.habits.note(Remark::AboveRate, || {
                format!("F{feed} mm/min, the axes reach {most:.0} mm/min on this way")
            });
        }
    }

    /// Takes the end of the program at its last line; returns the doubts, each with its line.
    pub(super) fn see_end(&mut self, last: u64, raw: &[u8]) -> Vec<(u64, Vec<u8>, Doubt)> {
        let mut found = Vec::new();
        let Spindle {
            rotation,
            speed,
            cutting,
        } = self.habits.spindle;
        let is_laser = self.settings.is_on(Setting::Laser);
        let zero = Number::default();
        if is_laser && rotation == Rotation::Clockwise && cutting && speed > zero {
            let doubt = Doubt::new(Remark::LeftOn, format!("M3 S{speed} is in force"));
            found.push((last, raw.to_vec(), doubt));
        }
        if let Some(Place { line, text }) = self.habits.switched_on.take() {
            if !self.habits.has_power {
                found.push((
                    line,
                    text,
                    Doubt::new(Remark::StartWithoutPower, String::new()),
                ));
            }
        }
        if let Some(Place { line, text }) = self.habits.powered.take() {
            let (highest, full) = (self.habits.highest, self.settings.value(Setting::MaxSpeed));
            if highest <= Number::from_int(EIGHT_BITS) && full >= Number::from_int(1000) {
                let words = format!("the highest is S{highest}, full power is $30={full}");
                found.push((line, text, Doubt::new(Remark::EightBitPower, words)));
            }
        }
        found
    }
}

/// Nobody waits that long for a spindle, s.
const LONG_DWELL: i32 = 100;

fn is_powered(spindle: &Spindle) -> bool {
    spindle.rotation != Rotation::Off && spindle.speed > Number::default()
}

/// Full power of senders that count it in a byte.
const EIGHT_BITS: i32 = 255;
