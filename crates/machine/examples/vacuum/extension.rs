use core::fmt;
use embedded_hal::digital::OutputPin;
use leadscrew_gcode::{Letter, Number};
use leadscrew_machine::board::{Duration, Instant};
use leadscrew_machine::extension::{Call, Cx, Event, Extension, MCode, Step};
use leadscrew_machine::protocol::status::Status;
use leadscrew_machine::settings::group::Group;
use leadscrew_machine::settings::table::{Kind, Row};
use leadscrew_machine::state::State;

/// `$800`: how long M10 waits until the hose draws.
static RUN_UP: Row = Row {
    number: 800,
    name: "Vacuum run-up",
    unit: "ms",
    description: "M10 waits for so long after it has switched the vacuum on.",
    group: Group::Tool,
    kind: Kind::Whole { max: 10_000 },
    default: Number::from_int(500),
    listed: false,
};

/// M10 switches a vacuum on, M11 off: after the motion before it, and M10 waits until the hose
/// draws (`P`, s, or `$800`). Reports show `Vac:`, byte 0xF8 toggles it. It goes off with an alarm,
/// a reset and the end of the program.
pub(crate) struct Vacuum<P> {
    pin: P,
    on: bool,
    run_up: Number,
    ready_at: Option<Instant>,
}

impl<P: OutputPin> Vacuum<P> {
    pub(crate) fn new(pin: P) -> Self {
        let mut vacuum = Self {
            pin,
            on: false,
            run_up: RUN_UP.default,
            ready_at: None,
        };
        vacuum.switch(false);
        vacuum
    }

    fn switch(&mut self, on: bool) {
        self.on = on;
        self.ready_at = None;
        let _cannot_fail = self.pin.set_state(on.into());
    }

    fn wait(&self, call: &Call) -> Duration {
        let millis = match call.words.get(Letter::P) {
            Some(seconds) => seconds.nanos() / 1_000_000,
            None => self.run_up.trunc(),
        };
        Duration::from_ticks(millis.unsigned_abs() * 1_000)
    }
}

impl<P: OutputPin, const AXES: usize> Extension<AXES> for Vacuum<P> {
    fn m_code(&self, number: u8) -> Option<MCode> {
        match number {
            10 => Some(MCode::with(&[Letter::P])),
            11 => Some(MCode::PLAIN),
            _ => None,
        }
    }

    fn perform(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) -> Step<AXES> {
        match self.ready_at {
            Some(ready) if cx.now >= ready => {
                self.ready_at = None;
                Step::Done
            }
            Some(ready) => Step::Wait(Some(ready)),
            None if !cx.at_rest => Step::Rest,
            None if call.code == 11 || self.on => {
                self.switch(call.code == 10);
                Step::Done
            }
            None => {
                self.switch(true);
                let ready = cx.now + self.wait(call);
                self.ready_at = Some(ready);
                Step::Wait(Some(ready))
            }
        }
    }

    fn settings(&self) -> impl Iterator<Item = &'static Row> {
        [&RUN_UP].into_iter()
    }

    fn value(&self, _: u16) -> Number {
        self.run_up
    }

    fn set(&mut self, _: u16, value: Number) -> Result<(), Status> {
        self.run_up = value;
        Ok(())
    }

    fn report(&self, fields: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(fields, "|Vac:{}", u8::from(self.on))
    }

    fn realtime(&mut self, byte: u8, cx: &mut Cx<'_, AXES>) {
        if byte == 0xF8 {
            self.switch(!self.on);
            cx.message(format_args!(
                "Vacuum {}",
                if self.on { "on" } else { "off" }
            ));
        }
    }

    fn event(&mut self, event: Event) {
        match event {
            Event::Enters(State::Alarm(_)) | Event::Reset | Event::ProgramEnd => self.switch(false),
            _ => {}
        }
    }
}
