//! An extension's M codes, a setting, a report field and a realtime byte, seen from the sender.

#[path = "../examples/vacuum/extension.rs"]
mod vacuum;

use crate::bench::flash::MockFlash;
use crate::bench::{Memory, Session};
use embedded_hal::digital::{ErrorType, OutputPin};
use leadscrew_gcode::{Letter, Number};
use leadscrew_machine::board::{Duration, Instant, SpindleOutput};
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::extension::{Call, Cx, Event, Extension, MCode, Shown, Step};
use leadscrew_machine::protocol::alarm::Alarm;
use leadscrew_machine::protocol::status::Status;
use leadscrew_machine::state::State;
use leadscrew_planner::{Cartesian, Coordinate};
use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use vacuum::Vacuum;

/// A relay that others see.
struct Relay<'p>(&'p Cell<bool>);

impl ErrorType for Relay<'_> {
    type Error = Infallible;
}

impl OutputPin for Relay<'_> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.set(false);
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.set(true);
        Ok(())
    }
}

fn boot<X: Extension<3>>(memory: &mut Memory, extension: X) -> Session<'_, Cartesian, X> {
    Session::extended(memory, MachineConfig::grbl(), Cartesian, extension)
}

/// A session with a vacuum on its relay.
macro_rules! vacuum {
    ($session:ident, $relay:ident) => {
        let $relay = Cell::new(true);
        let mut memory = Memory::new();
        #[allow(unused_mut, reason = "some tests only look")]
        let mut $session = boot(&mut memory, Vacuum::new(Relay(&$relay)));
    };
}

#[test]
fn m10_waits_until_the_hose_draws_and_shows_run_meanwhile() {
    vacuum!(session, relay);
    assert!(!relay.get(), "off from the start");
    session.send("M10\n");
    session.wait_ms(400);
    assert!(relay.get());
    assert!(session.status().starts_with("<Run|"));
    assert_eq!(session.lines(), [""; 0]);
    session.wait_ms(200);
    assert_eq!(session.lines(), ["ok"]);
    assert!(session.status().starts_with("<Idle|"));
}

#[test]
fn m10_comes_after_the_motion_before_it_and_before_the_motion_of_its_line() {
    vacuum!(session, relay);
    session.send("G1X5F600\nM10P0.2X10\n");
    session.until(|session| session.pins.position[0] == 5 * 250);
    assert!(!relay.get());
    session.until(|_| relay.get());
    session.wait_ms(150);
    assert_eq!(session.pins.position[0], 5 * 250);
    session.until_quiet();
    assert_eq!(session.pins.position[0], 10 * 250);
    assert_eq!(session.lines(), ["ok", "ok"]);
}

#[test]
fn reports_have_its_field_last() {
    vacuum!(session, _relay);
    let report = session.status();
    assert!(report.ends_with("|Vac:0>"), "{report}");
    session.line("M10P0");
    let report = session.status();
    assert!(report.ends_with("|Vac:1>"), "{report}");
}

#[test]
fn its_setting_is_shown_described_checked_and_put_back() {
    vacuum!(session, _relay);
    assert_eq!(session.line("$800"), ["$800=500", "ok"]);
    assert_eq!(session.line("$800=250"), ["ok"]);
    assert_eq!(session.line("$800=10001"), ["error:52"]);
    assert_eq!(session.line("$800=-1"), ["error:4"]);
    assert_eq!(session.line("$801=1"), ["error:3"]);
    assert_eq!(session.line("$+").iter().rev().nth(1).unwrap(), "$800=250");
    let all = session.line("$ES");
    let row = "[SETTING:800|5|Vacuum run-up|ms|5|####0|0|10000|0|0]";
    assert_eq!(all.iter().rev().nth(1).unwrap(), row);
    let described = "[SETTINGDESCR:800|M10 waits for so long after it has switched the vacuum on.]";
    assert_eq!(session.line("$SED=800"), [described, "ok"]);
    session.line("$RST=$");
    assert_eq!(session.line("$800"), ["$800=500", "ok"]);
    assert_eq!(session.line("$$").len(), 34 + 1);
}

#[test]
fn its_setting_outlasts_power() {
    let mut flash = MockFlash::new(1024);
    {
        vacuum!(session, _relay);
        session.machine.load(&mut flash).unwrap();
        session.send("$800=250\n$100=300\n");
        for _ in 0..1_000 {
            session.turn();
            session.machine.save(&mut flash).unwrap();
        }
        assert_eq!(session.lines(), ["ok", "ok"]);
    }
    flash.restart();
    vacuum!(session, _relay);
    session.machine.load(&mut flash).unwrap();
    assert_eq!(session.line("$800"), ["$800=250", "ok"]);
    session.send("$RST=$\n");
    for _ in 0..1_000 {
        session.turn();
        session.machine.save(&mut flash).unwrap();
    }
    flash.restart();
    vacuum!(again, _relay);
    again.machine.load(&mut flash).unwrap();
    assert_eq!(again.line("$800"), ["$800=500", "ok"]);
    // A firmware without the extension does not mind its setting.
    let mut memory = Memory::new();
    let mut stock = Session::boot(&mut memory, MachineConfig::grbl());
    stock.machine.load(&mut flash).unwrap();
    assert_eq!(stock.line("$800"), ["error:3"]);
}

#[test]
fn a_realtime_byte_acts_at_once_and_no_utf8_text_has_it() {
    vacuum!(session, relay);
    session.send("G1X5F600\n(\u{e4}\u{b0}\u{20ac})\n");
    session.wait_ms(100);
    assert!(!relay.get());
    session.send([0xF8]);
    session.wait_ms(1);
    assert!(relay.get());
    assert_ne!(session.pins.position[0], 5 * 250);
    assert_eq!(session.lines(), ["ok", "ok", "[MSG:Vacuum on]"]);
}

#[test]
fn an_alarm_a_reset_and_the_end_of_the_program_switch_it_off() {
    for stop in ["M30\n", "\x18", "G38.2Z-1F100\n"] {
        vacuum!(session, relay);
        if stop.starts_with("G38") {
            session.switch(|switches| switches.probe = false);
        }
        session.line("M10P0");
        assert!(relay.get());
        session.send(stop);
        session.wait_ms(20);
        assert!(!relay.get(), "{stop:?}");
    }
}

#[test]
fn check_mode_switches_nothing() {
    vacuum!(session, relay);
    session.line("$C");
    assert_eq!(session.line("M10"), ["ok"]);
    assert!(!relay.get());
}

#[test]
fn a_hold_puts_the_end_of_its_line_off() {
    vacuum!(session, _relay);
    session.send("M10\n");
    session.wait_ms(100);
    session.send("!");
    session.wait_ms(1000);
    assert!(session.status().starts_with("<Hold:0|"));
    session.send("~");
    session.wait_ms(5);
    assert_eq!(session.lines(), ["ok"]);
}

#[test]
fn a_machine_without_it_refuses_its_codes() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    assert_eq!(session.line("M10"), ["error:20"]);
    assert_eq!(session.line("$800=1"), ["error:3"]);
    session.send([0xF8]);
    session.wait_ms(5);
    assert_eq!(session.lines(), [""; 0]);
}

#[test]
fn two_extensions_are_one() {
    let (vacuum, heard) = (Cell::new(false), RefCell::new(Vec::new()));
    let mut memory = Memory::new();
    let both = (Heater::new(&heard), Vacuum::new(Relay(&vacuum)));
    let mut session = boot(&mut memory, both);
    assert_eq!(session.line("M10P0"), ["ok"]);
    assert!(vacuum.get());
    assert_eq!(session.line("M105"), ["[HEAT:20]", "ok"]);
    let report = session.status();
    assert!(report.ends_with("|Heat:20|Vac:1>"), "{report}");
    assert_eq!(session.line("$800"), ["$800=500", "ok"]);
}

/// A heater that warms by 1 degree a millisecond.
struct Heater<'h> {
    target: i64,
    now: i64,
    at: u64,
    broken: bool,
    events: &'h RefCell<Vec<Event>>,
}

impl<'h> Heater<'h> {
    fn new(events: &'h RefCell<Vec<Event>>) -> Self {
        Self {
            target: 20,
            now: 20,
            at: 0,
            broken: false,
            events,
        }
    }
}

impl Extension<3> for Heater<'_> {
    fn m_code(&self, number: u8) -> Option<MCode> {
        match number {
            104 | 109 => Some(MCode::with(&[Letter::S, Letter::P, Letter::T])),
            105 => Some(MCode::PLAIN),
            _ => None,
        }
    }

    fn perform(&mut self, call: &Call, cx: &mut Cx<'_, 3>) -> Step<3> {
        let target = call.words.get(Letter::S).map(|target| target.trunc());
        match call.code {
            105 => cx.line(format_args!("[HEAT:{}]", self.now)),
            _ if target > Some(300) => return Step::Refuse(Status::OutOfRange),
            _ => self.target = target.unwrap_or(self.target),
        }
        let waits = call.code == 109 && self.now < self.target;
        match waits {
            true => Step::Wait(None),
            false => Step::Done,
        }
    }

    fn report(&self, fields: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(fields, "|Heat:{}", self.now)
    }

    fn event(&mut self, event: Event) {
        if matches!(event, Event::Enters(State::Alarm(_))) {
            self.target = 0;
        }
        self.events.borrow_mut().push(event);
    }

    fn realtime(&mut self, byte: u8, _: &mut Cx<'_, 3>) {
        self.broken |= byte == 0xFF;
    }

    fn poll(&mut self, cx: &mut Cx<'_, 3>) -> Option<leadscrew_machine::board::Instant> {
        let ms = cx.now.ticks() / 1000;
        if ms > self.at && self.now < self.target {
            self.now += 1;
        }
        self.at = ms;
        if self.broken {
            cx.message(format_args!("Sensor of heater 1 is open"));
            cx.alarm(Alarm::AbortedMotion);
            self.broken = false;
        }
        Some(leadscrew_machine::board::Instant::from_ticks(
            (ms + 1) * 1000,
        ))
    }
}

#[test]
fn s_of_a_heater_is_not_the_spindles() {
    let heard = RefCell::default();
    let mut memory = Memory::new();
    let mut session = boot(&mut memory, Heater::new(&heard));
    session.line("M3S500");
    assert_eq!(session.line("M104S180P1T2"), ["ok"]);
    let modes = session.line("$G");
    assert!(
        modes[0].contains(" S500]") && modes[0].contains("T0"),
        "{modes:?}"
    );
    assert_eq!(session.line("M104S301"), ["error:52"]);
    let own = session.line("M105S1");
    assert_eq!(own, ["[HEAT:20]", "ok"], "its S stays GRBL's");
    assert!(session.line("$G")[0].contains(" S1]"));
    assert_eq!(session.line("M105P1"), ["error:36"]);
    assert_eq!(session.line("M104M105"), ["error:21"]);
}

#[test]
fn a_line_waits_for_its_temperature_while_the_heater_does_its_work() {
    let heard = RefCell::default();
    let mut memory = Memory::new();
    let mut session = boot(&mut memory, Heater::new(&heard));
    session.send("M109S180\nG1X1F600\n");
    session.wait_ms(100);
    assert!(session.status().starts_with("<Run|"));
    assert_eq!(session.pins.position, [0; 3]);
    session.until_quiet();
    assert_eq!(session.lines(), ["ok", "ok"]);
    assert_eq!(session.pins.position, [250, 0, 0]);
}

#[test]
fn an_extension_can_stop_the_machine() {
    let heard = RefCell::default();
    let mut memory = Memory::new();
    let mut session = boot(&mut memory, Heater::new(&heard));
    session.send("M104S180\nG1X50F600\n");
    session.wait_ms(300);
    session.send([0xFF]);
    session.wait_ms(10);
    let position = session.pins.position;
    session.wait_ms(500);
    assert_eq!(session.pins.position, position);
    let lines = session.lines();
    assert!(lines.contains(&"[MSG:Sensor of heater 1 is open]".to_owned()));
    assert!(lines.contains(&"ALARM:3".to_owned()));
    assert!(heard
        .borrow()
        .iter()
        .any(|event| matches!(event, Event::Enters(State::Alarm(_)))));
}

/// A tool between two switches: M3 goes down until the lower one closes.
struct Tool<'t> {
    /// Steps of Z at which the lower switch closes; read as the carriage moves.
    down: &'t Cell<bool>,
    phase: u8,
}

impl Extension<3> for Tool<'_> {
    fn m_code(&self, number: u8) -> Option<MCode> {
        (number == 3).then_some(MCode::with(&[Letter::S]).first())
    }

    fn perform(&mut self, _: &Call, cx: &mut Cx<'_, 3>) -> Step<3> {
        match self.phase {
            0 if !cx.at_rest => Step::Rest,
            0 => {
                self.phase = 1;
                let mut target = cx.position;
                target[2] = target[2] + Coordinate::from_mm(-20.0).unwrap();
                let rate = Number::from_int(600);
                Step::Move { target, rate }
            }
            1 if self.down.get() => {
                self.phase = 2;
                Step::Stop
            }
            1 if cx.at_rest => {
                cx.alarm(Alarm::ProbeNoContact);
                self.phase = 0;
                Step::Done
            }
            1 => Step::Wait(None),
            _ => {
                self.phase = 0;
                Step::Done
            }
        }
    }
}

#[test]
fn an_extension_can_move_until_its_switch_closes() {
    let down = Cell::new(false);
    let mut memory = Memory::new();
    let extension = Tool {
        down: &down,
        phase: 0,
    };
    let mut session = boot(&mut memory, extension);
    session.line("G1X1F600");
    session.send("M3\nX2\n");
    session.until(|session| session.pins.position[2] <= -4 * 250);
    down.set(true);
    session.until_quiet();
    let [x, _, z] = session.pins.position;
    assert_eq!(x, 2 * 250);
    // From 10 mm/s it stops in 5 mm.
    assert!((-9 * 250..=-4 * 250).contains(&z), "{z}");
    assert_eq!(session.lines(), ["ok", "ok"]);
    // The program goes on from the switch's place.
    session.line("G91G1Z1F600");
    assert_eq!(session.pins.position[2], z + 250);
    assert_eq!(session.line("M3S100"), ["ok"]);
    down.set(false);
    session.line("G90G0Z0");
    assert_eq!(session.line("M3P1"), ["error:36"]);
    let lines = session.line("M3");
    assert!(lines.contains(&"ALARM:5".to_owned()), "{lines:?}");
}

#[test]
fn motion_beside_a_code_that_moves_begins_where_the_code_has_ended() {
    let down = Cell::new(false);
    let mut memory = Memory::new();
    let extension = Tool {
        down: &down,
        phase: 0,
    };
    let mut session = boot(&mut memory, extension);
    session.send("G1X1F600\nG91X2Z1M3S7\n");
    session.until(|session| session.pins.position[2] <= -4 * 250);
    assert_eq!(session.pins.position[0], 250, "the code comes first");
    down.set(true);
    session.until(|session| session.pins.position[0] > 250);
    let lowest = session.pins.position[2];
    session.until_quiet();
    assert_eq!(session.lines(), ["ok", "ok"]);
    let [x, _, z] = session.pins.position;
    assert_eq!(x, 3 * 250);
    assert!((lowest..=lowest + 250).contains(&z), "{lowest} {z}");
    assert!(
        session.line("$G")[0].contains(" S0]"),
        "its S is the code's"
    );
}

/// Notes each code, and whether an axis has moved before it; takes 10 ms for it.
struct Log<'l> {
    codes: &'l RefCell<Vec<(u8, bool)>>,
    ends: Option<Instant>,
}

impl Extension<3> for Log<'_> {
    fn m_code(&self, number: u8) -> Option<MCode> {
        matches!(number, 62 | 104).then_some(MCode::with(&[Letter::P]))
    }

    fn perform(&mut self, call: &Call, cx: &mut Cx<'_, 3>) -> Step<3> {
        match self.ends {
            Some(end) if cx.now >= end => Step::Done,
            Some(end) => Step::Wait(Some(end)),
            None => {
                let moved = cx.position != [Coordinate::ZERO; 3];
                self.codes.borrow_mut().push((call.code, moved));
                let end = cx.now + Duration::from_ticks(10_000);
                self.ends = Some(end);
                Step::Wait(Some(end))
            }
        }
    }
}

#[test]
fn codes_below_100_come_before_the_spindle_and_the_others_after_the_coolant() {
    for (code, spindle_is_on) in [(62, false), (104, true)] {
        let log = RefCell::default();
        let mut memory = Memory::new();
        let extension = Log {
            codes: &log,
            ends: None,
        };
        let mut session = boot(&mut memory, extension);
        session.send(format!("M3S500M8G1X1F600M{code}P1\n"));
        session.until(|_| !log.borrow().is_empty());
        assert_eq!(
            session.pins.spindle != SpindleOutput::Off,
            spindle_is_on,
            "M{code}"
        );
        assert_eq!(session.pins.coolant.flood, spindle_is_on, "M{code}");
        session.until_quiet();
        assert_eq!(
            *log.borrow(),
            [(code, false)],
            "M{code} comes before motion"
        );
        assert_eq!(session.pins.position[0], 250, "M{code}");
        assert_eq!(session.lines(), ["ok"]);
    }
}

/// Raises an alarm with M151 and refuses the line; M152 sends a long message, M153 a long line.
struct Loud;

impl Extension<3> for Loud {
    fn m_code(&self, number: u8) -> Option<MCode> {
        matches!(number, 151..=153).then_some(MCode::PLAIN)
    }

    fn perform(&mut self, call: &Call, cx: &mut Cx<'_, 3>) -> Step<3> {
        let long = "\u{e4}".repeat(150);
        match call.code {
            151 => {
                cx.alarm(Alarm::Own(220));
                return Step::Refuse(Status::Own(220));
            }
            152 => cx.message(format_args!("a{long}")),
            _ => cx.line(format_args!("[{long}")),
        }
        Step::Done
    }
}

#[test]
fn a_line_that_is_refused_with_an_alarm_is_answered_with_the_refusal() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory, Loud);
    let said = session.line("M151G1X1F600");
    assert_eq!(said[0], "ALARM:220");
    assert_eq!(said.last().unwrap(), "error:220", "{said:?}");
    assert!(!said.contains(&"ok".to_owned()), "{said:?}");
    assert!(session.status().starts_with("<Alarm|"));
}

#[test]
fn a_text_that_is_too_long_is_cut_between_two_letters() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory, Loud);
    let letters = |count| "\u{e4}".repeat(count);
    let said = session.line("M152");
    assert_eq!(said, [format!("[MSG:a{}]", letters(99)), "ok".to_owned()]);
    let said = session.line("M153");
    assert_eq!(said, [format!("[{}", letters(99)), "ok".to_owned()]);
}

/// Puts M150 aside, and finds a fault just then.
struct Faulty([u8; 64]);

impl Extension<3> for Faulty {
    fn m_code(&self, number: u8) -> Option<MCode> {
        (number == 150).then_some(MCode::PLAIN.first())
    }

    fn perform(&mut self, _: &Call, _: &mut Cx<'_, 3>) -> Step<3> {
        Step::SetAside(Shown::Hold)
    }

    fn set_aside(&mut self, _: &Call, cx: &mut Cx<'_, 3>) {
        cx.alarm(Alarm::AbortedMotion);
    }

    fn kept(&mut self) -> &mut [u8] {
        &mut self.0
    }
}

#[test]
fn an_alarm_as_the_operator_gets_the_machine_stays() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory, Faulty([0; 64]));
    session.send("M150\n");
    session.wait_ms(500);
    assert!(session.lines().contains(&"ALARM:3".to_owned()));
    assert!(session.status().starts_with("<Alarm|"));
    assert_eq!(session.line("G1X1F600"), ["error:9"]);
}
