#![no_std]
#![forbid(unsafe_code)]
#![doc = include_str!("../README.md")]

use leadscrew_gcode::{Letter, Number};
use leadscrew_machine::extension::{Call, Cx, Event, Extension, MCode, OwnCode, Step};
use leadscrew_machine::protocol::alarm::Alarm;
use leadscrew_machine::state::State;
use leadscrew_planner::Coordinate;

/// The axis of the tool: Z.
const TOOL_AXIS: usize = 2;

/// An end of the tool's travel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum End {
    /// In the work: M3.
    Lower,
    /// Above the work: M5.
    Upper,
}

/// The two switches of the tool.
pub trait ToolPort {
    /// Returns true if the switch at this end is closed. It is read at every turn of the main loop
    /// while the tool moves.
    fn is_closed(&self, end: End) -> bool;
}

/// The speed and the longest way of the tool.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ZToolConfig {
    /// The speed of the tool, mm/min, above 0.
    pub rate: Number,
    /// The distance that the tool moves without reaching a switch before an alarm, mm, above 0.
    pub most_mm: f32,
}

/// The alarm of a tool that has moved as far as `most_mm` allows and has reached no switch.
pub static NO_SWITCH: OwnCode = OwnCode {
    number: 230,
    text: "The tool does not reach its switch",
    explanation:
        "It is stuck, its switch is broken, or the way is longer than the configuration has it.",
};

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Phase {
    Rests,
    Goes,
    /// The switch has closed, and the tool slows down.
    Stops,
}

/// The extension for M3 and M5 with a tool between two switches, on a machine with `AXES` axes.
#[derive(Debug)]
pub struct ZTool<P, const AXES: usize> {
    config: ZToolConfig,
    port: P,
    phase: Phase,
    /// The end at which the tool stands, and its Z there; `None` if it is not known.
    stands: Option<(End, Coordinate)>,
}

impl<P: ToolPort, const AXES: usize> ZTool<P, AXES> {
    /// Makes the extension; where the tool stands is not known yet.
    pub const fn new(config: ZToolConfig, port: P) -> Self {
        Self {
            config,
            port,
            phase: Phase::Rests,
            stands: None,
        }
    }

    /// Returns the end at which the tool stands; `None` if it is not known.
    pub fn stands_at(&self) -> Option<End> {
        self.stands.map(|(end, _)| end)
    }

    fn begin(&mut self, end: End, cx: &Cx<'_, AXES>) -> Step<AXES> {
        if !cx.at_rest {
            return Step::Rest;
        }
        let z = height(cx);
        if self.stands == Some((end, z)) || self.port.is_closed(end) {
            return self.arrive(end, cx);
        }
        let way = Coordinate::from_mm(self.config.most_mm).unwrap_or_default();
        let mut target = cx.position;
        if let Some(z) = target.get_mut(TOOL_AXIS) {
            *z = match end {
                End::Lower => *z - way,
                End::Upper => *z + way,
            };
        }
        (self.phase, self.stands) = (Phase::Goes, None);
        Step::Move {
            target,
            rate: self.config.rate,
        }
    }

    fn go_on(&mut self, end: End, cx: &mut Cx<'_, AXES>) -> Step<AXES> {
        match (self.port.is_closed(end), cx.at_rest) {
            (true, true) => self.arrive(end, cx),
            (true, false) => {
                self.phase = Phase::Stops;
                Step::Stop
            }
            (false, true) => {
                self.phase = Phase::Rests;
                cx.alarm(Alarm::Own(NO_SWITCH.number));
                Step::Done
            }
            (false, false) => Step::Wait(None),
        }
    }

    fn arrive(&mut self, end: End, cx: &Cx<'_, AXES>) -> Step<AXES> {
        (self.phase, self.stands) = (Phase::Rests, Some((end, height(cx))));
        Step::Done
    }
}

fn height<const AXES: usize>(cx: &Cx<'_, AXES>) -> Coordinate {
    cx.position.get(TOOL_AXIS).copied().unwrap_or_default()
}

impl<P: ToolPort, const AXES: usize> Extension<AXES> for ZTool<P, AXES> {
    fn m_code(&self, number: u8) -> Option<MCode> {
        matches!(number, 3..=5).then_some(MCode::with(&[Letter::S]).first())
    }

    fn perform(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) -> Step<AXES> {
        let end = match call.code {
            5 => End::Upper,
            _ => End::Lower,
        };
        match self.phase {
            Phase::Rests => self.begin(end, cx),
            Phase::Goes => self.go_on(end, cx),
            Phase::Stops => self.arrive(end, cx),
        }
    }

    fn alarms(&self) -> impl Iterator<Item = &'static OwnCode> {
        core::iter::once(&NO_SWITCH)
    }

    fn event(&mut self, event: Event) {
        if let Event::Reset | Event::Enters(State::Alarm(_)) = event {
            (self.phase, self.stands) = (Phase::Rests, None);
        }
    }
}
