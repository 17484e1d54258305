//! Every output at every end of the program: off is off, whichever level of its pin that is.
use super::{
    planting::{plant, restore, FOR_EVER},
    Figures,
};
use crate::{
    bench::{cycles, ensure, Bench, Failure, BANNER},
    checks::endings::panics,
    firmware::{Build, Firmware},
    pins::{FLOOD, LIMIT, MIST, POWER, REVERSE, SPINDLE},
    plant::Body,
    wiring::{FAN, HEATERS, HEATER_SUPPLY, OUTPUT, SENSORS},
};
use leadscrew_f407emu::{Pin, ResetCause};

/// The second output of M62 to M65.
const SECOND_OUTPUT: Pin = Pin::new('B', 13);

/// Outputs that an alarm switches off.
const OF_JOBS: [Pin; 5] = [POWER, SPINDLE, REVERSE, FLOOD, MIST];

/// The longest time from a reset until the pins are driven, cycles of 16 MHz: 20 µs.
const DRIVEN: u64 = 320;
/// The longest time until the watchdog acts, s.
const RESET_SECONDS: f64 = 0.1;
/// Cycles between two looks at the pins.
const LOOK: u64 = 50;

/// A build, the level at which its outputs are on, and what it has beside those of jobs: the pins,
/// and the lines that switch them on.
struct Case<'a> {
    name: &'static str,
    build: &'a Build,
    on: bool,
    further: &'static [Pin],
    lines: &'static str,
}

/// A sensor at 20 °C, as `heaters` of the machines have it: a thermistor to ground.
fn cold(_: f64) -> f64 {
    let ohms = 100_000.0 * (3950.0_f64 * (1.0 / 293.15 - 1.0 / 298.15)).exp();
    ohms / (ohms + 4_700.0)
}

impl Case<'_> {
    fn pins(&self) -> Vec<Pin> {
        OF_JOBS.iter().chain(self.further).copied().collect()
    }

    /// The pins that are off until a line switches them on: the heaters' supply goes on at
    /// start-up, and off with a fault.
    fn pins_at_rest(&self) -> Vec<Pin> {
        let pins = self.pins().into_iter();
        pins.filter(|pin| *pin != HEATER_SUPPLY).collect()
    }

    fn ensure_all(&self, bench: &Bench, pins: &[Pin], on: bool, when: &str) -> Result<(), Failure> {
        let is = |pin: &Pin| bench.machine.drives(*pin) && bench.machine.level(*pin) == self.on;
        let wrong: Vec<String> = pins
            .iter()
            .filter(|pin| is(pin) != on)
            .map(Pin::to_string)
            .collect();
        ensure(wrong.is_empty(), || {
            let not = if on { "not on" } else { "on" };
            format!("{}, {when}: {wrong:?} are {not}", self.name)
        })
    }

    /// Boots, and looks at the pins from the first instruction to the banner.
    fn boot(&self) -> Result<Bench, Failure> {
        let mut bench = Bench::switch_on(self.build)?;
        let bodies = (0..2).map(|index| Body::new(HEATERS[index], SENSORS[index], 0.0, cold));
        bench.plant.bodies = bodies.collect();
        self.ensure_off_until_banner(&mut bench, "at power-up")?;
        self.ensure_all(&bench, &self.pins_at_rest(), false, "after the banner")?;
        Ok(bench)
    }

    /// From the first instruction on: all driven in time, and off, most until the banner has come.
    fn ensure_off_until_banner(&self, bench: &mut Bench, when: &str) -> Result<(), Failure> {
        let (pins, at_rest, began) = (self.pins(), self.pins_at_rest(), bench.machine.cycle());
        let end = began + cycles(2.0);
        while !bench.heard().iter().any(|line| line == BANNER) {
            bench.run_to(bench.machine.cycle() + LOOK)?;
            let now = bench.machine.cycle();
            let in_time = now <= began + DRIVEN + LOOK;
            self.ensure_all(bench, if in_time { &pins } else { &at_rest }, false, when)?;
            let floats = pins.iter().find(|pin| !bench.machine.drives(**pin));
            ensure(floats.is_none() || in_time, || {
                format!("{}, {when}: {floats:?} floats", self.name)
            })?;
            ensure(now < end, || format!("{}, {when}: no banner", self.name))?;
        }
        Ok(())
    }

    /// Switches everything on.
    fn switch_on(&self, bench: &mut Bench) -> Result<(), Failure> {
        bench.commands("$X\n$30=1000\n$32=0\n$1=255\nM4S1000\nM8\nM7\n")?;
        bench.commands(self.lines)?;
        bench.run_for(0.3)?;
        self.ensure_all(bench, &self.pins(), true, "switched on")
    }

    fn walk(&self) -> Result<(), Failure> {
        let mut base = self.boot()?;
        self.switch_on(&mut base)?;
        self.alarm(base.clone())?;
        let mut bench = base.clone();
        let now = bench.machine.cycle();
        bench.machine.reset_at(now + 100, ResetCause::Pin);
        self.ends(bench, None, false, "reset pin")?;
        let mut bench = base.clone();
        let replaced = plant(&mut bench, &panics(self.build)?)?;
        self.ends(bench, replaced, true, "panic")?;
        let mut bench = base;
        let replaced = plant(&mut bench, &FOR_EVER)?;
        self.ends(bench, replaced, false, "watchdog")
    }

    /// A limit switch in motion switches off what belongs to a job. Machine 004's stops only motion
    /// towards its own end, the low one.
    fn alarm(&self, mut bench: Bench) -> Result<(), Failure> {
        bench.commands("$21=1\nG91G1X-50F600\n")?;
        bench.run_for(0.2)?;
        bench.set(LIMIT[0], false);
        bench.hear_until(0.5, |line| line.starts_with("ALARM:"))?;
        bench.run_for(0.01)?;
        self.ensure_all(&bench, &OF_JOBS, false, "alarm")
    }

    /// Waits for the reset. If a handler ends the program, it has switched everything off before.
    fn ends(
        &self,
        mut bench: Bench,
        replaced: Option<super::planting::Replaced>,
        by_handler: bool,
        when: &str,
    ) -> Result<(), Failure> {
        let end = bench.machine.cycle() + cycles(RESET_SECONDS);
        let mut before = Ok(());
        while bench.machine.resets().is_empty() {
            before = self.ensure_all(&bench, &self.pins(), false, when);
            ensure(bench.machine.cycle() < end, || format!("{when}: no reset"))?;
            bench.run_to(bench.machine.cycle() + 2)?;
        }
        if by_handler {
            before?;
        }
        restore(&mut bench, replaced);
        bench.heard();
        self.ensure_off_until_banner(&mut bench, when)
    }
}

pub(crate) fn polarity(firmware: &Firmware) -> Result<Figures, Failure> {
    let (printer, inverted) = (
        firmware.build("machine-file-004")?,
        firmware.build("inverted")?,
    );
    let cases = [
        Case {
            name: "machine 004, high is on",
            build: printer,
            on: true,
            further: &[HEATERS[0], HEATERS[1], FAN],
            lines: "M104S100\nM140S100\nM106S255\n",
        },
        Case {
            name: "every output, low is on",
            build: inverted,
            on: false,
            further: &[
                HEATERS[0],
                HEATERS[1],
                FAN,
                HEATER_SUPPLY,
                OUTPUT,
                SECOND_OUTPUT,
            ],
            lines: "M104S100\nM140S100\nM106S255\nM64P0\nM64P1\n",
        },
    ];
    let mut figures = Figures::default();
    for case in &cases {
        case.walk()?;
        let ends = "power-up, banner, alarm, reset pin, panic, watchdog";
        figures.add(
            case.name,
            format!("{} outputs off at {ends}", case.pins().len()),
        );
    }
    Ok(figures)
}
