#![no_std]
#![forbid(unsafe_code)]
#![doc = include_str!("../README.md")]

mod settings;

use core::fmt;
use leadscrew_gcode::{Letter, Number};
use leadscrew_machine::board::{Duration, Instant};
use leadscrew_machine::extension::{Call, Cx, Event, Extension, MCode, Shown, Step};
use leadscrew_machine::protocol::status::Status;
use leadscrew_machine::settings::table::Row;
use leadscrew_machine::state::State;
use leadscrew_planner::Coordinate;
use settings::{tool_of, CLEARANCE, FIRST_LENGTH, LONGEST, RETURN_RATE, SPIN_UP};

pub use settings::TOOLS;

/// The axis along which the tool points: Z.
const TOOL_AXIS: usize = 2;

/// The way in which a machine changes its tools.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ToolChangeConfig {
    /// The state that reports show during a tool change: `Hold:0`, or `Tool` for senders that know
    /// it.
    pub shown: Shown,
    /// `$860` of a new machine, mm.
    pub clearance: Number,
    /// `$861` of a new machine, whole ms.
    pub spin_up: Number,
    /// `$862` of a new machine, mm/min, above 0.
    pub rate: Number,
}

impl ToolChangeConfig {
    /// The values of the settings if the machine's file gives none.
    pub const DEFAULT: Self = Self {
        shown: Shown::Hold,
        clearance: CLEARANCE.default,
        spin_up: SPIN_UP.default,
        rate: RETURN_RATE.default,
    };
}

impl Default for ToolChangeConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// The phase of a tool change.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Phase {
    /// No tool change is under way, or the operator is changing the tool.
    Asked,
    /// The operator has finished: Z goes up.
    Clear,
    /// All axes except Z go back.
    Across,
    /// The spindle runs up until this instant, then Z goes down.
    SpinUp(Instant),
    /// Z goes down to the place at which the program continues.
    Arrives,
}

/// The extension for M6 and the tool table. `AXES` is the machine's number of axes. `KEPT` is the
/// number of bytes of lines that are kept during a tool change: as many as the receive buffer
/// takes.
#[derive(Debug)]
pub struct ToolChange<const AXES: usize, const KEPT: usize> {
    config: ToolChangeConfig,
    clearance: Number,
    spin_up: Number,
    rate: Number,
    lengths: [Number; TOOLS],
    /// The tool in the spindle; 0 if it is not known.
    loaded: u32,
    wanted: u32,
    phase: Phase,
    /// The position at which the program stopped, and the work offset at that time.
    left_at: [Coordinate; AXES],
    offset: [Coordinate; AXES],
    kept: [u8; KEPT],
}

impl<const AXES: usize, const KEPT: usize> ToolChange<AXES, KEPT> {
    /// Makes the extension; all tools have the length 0.
    pub const fn new(config: ToolChangeConfig) -> Self {
        Self {
            config,
            clearance: config.clearance,
            spin_up: config.spin_up,
            rate: config.rate,
            lengths: [Number::from_int(0); TOOLS],
            loaded: 0,
            wanted: 0,
            phase: Phase::Asked,
            left_at: [Coordinate::ZERO; AXES],
            offset: [Coordinate::ZERO; AXES],
            kept: [0; KEPT],
        }
    }

    /// Returns the tool in the spindle; 0 if it is not known.
    pub const fn loaded(&self) -> u32 {
        self.loaded
    }

    fn begin(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) -> Step<AXES> {
        if !cx.at_rest {
            return Step::Rest;
        }
        let tool = match tool_number(call) {
            Ok(tool) => tool,
            Err(status) => return Step::Refuse(status),
        };
        self.wanted = tool;
        (self.left_at, self.offset) = (cx.position, cx.work_offset);
        Step::SetAside(self.config.shown)
    }

    /// The place at which the program continues. Along the tool axis it is the same in work
    /// coordinates, although the work offset may have changed.
    fn goes_on_at(&self, cx: &Cx<'_, AXES>) -> [Coordinate; AXES] {
        let mut end = self.left_at;
        let offsets = cx.work_offset.iter().zip(&self.offset);
        if let Some((end, (now, then))) = end.iter_mut().zip(offsets).nth(TOOL_AXIS) {
            *end = *end + *now - *then;
        }
        end
    }

    /// The height at which the tool crosses to its place: the clearance above the higher end of its
    /// way, and not below its present height.
    fn height(&self, cx: &Cx<'_, AXES>) -> Coordinate {
        let along = |of: &[Coordinate; AXES]| of.get(TOOL_AXIS).copied().unwrap_or_default();
        let ends = along(&self.left_at).max(along(&self.goes_on_at(cx)));
        let clear = ends + Coordinate::from_nanos(self.clearance.nanos());
        clear.max(along(&cx.position))
    }

    fn go(&mut self, target: [Coordinate; AXES], next: Phase, cx: &Cx<'_, AXES>) -> Step<AXES> {
        self.phase = next;
        match target == cx.position {
            true => Step::Wait(Some(cx.now)),
            false => Step::Move {
                target,
                rate: self.rate,
            },
        }
    }

    fn go_back(&mut self, cx: &Cx<'_, AXES>) -> Step<AXES> {
        let mut over = self.goes_on_at(cx);
        if let Some(height) = over.get_mut(TOOL_AXIS) {
            *height = self.height(cx);
        }
        match self.phase {
            Phase::Asked | Phase::Clear => {
                let mut up = cx.position;
                if let Some(height) = up.get_mut(TOOL_AXIS) {
                    *height = self.height(cx);
                }
                self.go(up, Phase::Across, cx)
            }
            Phase::Across => {
                let micros = self.spin_up.trunc().unsigned_abs() * 1_000;
                let ready = cx.now + Duration::from_ticks(micros);
                self.go(over, Phase::SpinUp(ready), cx)
            }
            Phase::SpinUp(ready) if cx.now < ready => Step::Wait(Some(ready)),
            Phase::SpinUp(_) => self.go(self.goes_on_at(cx), Phase::Arrives, cx),
            Phase::Arrives => {
                self.phase = Phase::Asked;
                Step::Done
            }
        }
    }
}

/// The number of the tool that M6 asks for, from its own T word or from the T word of an earlier
/// line.
///
/// # Errors
/// The number does not fit 32 bits.
fn tool_number(call: &Call) -> Result<u32, Status> {
    let tool = call.words.get(Letter::T).unwrap_or_default().trunc();
    u32::try_from(tool).map_err(|_| Status::ToolTooLarge)
}

/// The place of a tool in the table; tool 0 has none.
fn place_of(tool: u32) -> Option<usize> {
    usize::try_from(tool.checked_sub(1)?).ok()
}

impl<const AXES: usize, const KEPT: usize> Extension<AXES> for ToolChange<AXES, KEPT> {
    fn m_code(&self, number: u8) -> Option<MCode> {
        (number == 6).then_some(MCode::with(&[Letter::T]).first())
    }

    fn check(&self, call: &Call) -> Result<(), Status> {
        tool_number(call).map(|_| ())
    }

    fn perform(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) -> Step<AXES> {
        match self.phase {
            Phase::Asked => self.begin(call, cx),
            _ if !cx.at_rest => Step::Wait(None),
            _ => self.go_back(cx),
        }
    }

    fn set_aside(&mut self, _: &Call, cx: &mut Cx<'_, AXES>) {
        let (tool, comment) = (self.wanted, cx.comment());
        match comment.trim() {
            "" => cx.message(format_args!("Tool {tool}, then ~")),
            comment => cx.message(format_args!("Tool {tool}: {comment}, then ~")),
        }
    }

    fn settings(&self) -> impl Iterator<Item = &'static Row> {
        settings::all()
    }

    fn value(&self, number: u16) -> Number {
        match number {
            _ if number == CLEARANCE.number => self.clearance,
            _ if number == SPIN_UP.number => self.spin_up,
            _ if number == RETURN_RATE.number => self.rate,
            _ => {
                let tool = tool_of(number).and_then(|index| self.lengths.get(index));
                tool.copied().unwrap_or_default()
            }
        }
    }

    fn set(&mut self, number: u16, value: Number) -> Result<(), Status> {
        let place = match number {
            _ if number == CLEARANCE.number => &mut self.clearance,
            _ if number == SPIN_UP.number => &mut self.spin_up,
            _ if number == RETURN_RATE.number => &mut self.rate,
            _ => {
                let tool = tool_of(number).and_then(|index| self.lengths.get_mut(index));
                tool.ok_or(Status::InvalidStatement)?
            }
        };
        *place = value;
        Ok(())
    }

    fn kept(&mut self) -> &mut [u8] {
        &mut self.kept
    }

    fn tool_length(&self, tool: Option<u32>) -> Option<Coordinate> {
        match tool.unwrap_or(self.loaded) {
            0 => Some(Coordinate::ZERO),
            tool => {
                let length = self.lengths.get(place_of(tool)?)?;
                Some(Coordinate::from_nanos(length.nanos()))
            }
        }
    }

    fn set_tool_length(&mut self, tool: u32, length: Coordinate) -> Result<u16, Status> {
        let index = place_of(tool).ok_or(Status::NoSuchTool)?;
        if length.nanos().unsigned_abs() > u64::from(LONGEST) * 1_000_000_000 {
            return Err(Status::OutOfRange);
        }
        let place = self.lengths.get_mut(index).ok_or(Status::NoSuchTool)?;
        *place = Number::from_nanos(length.nanos());
        Ok(FIRST_LENGTH + index as u16)
    }

    fn report(&self, fields: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(fields, "|T:{}", self.loaded)
    }

    fn event(&mut self, event: Event) {
        match event {
            Event::TakesBack => {
                self.loaded = self.wanted;
                self.phase = Phase::Clear;
            }
            Event::Reset | Event::Enters(State::Alarm(_)) => self.phase = Phase::Asked,
            _ => {}
        }
    }
}
