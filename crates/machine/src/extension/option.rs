//! An extension that may be missing: only a configuration says whether there is one.

use super::{Asked, Call, Cx, Event, Extension, Fault, Gate, Known, Line, MCode, OwnCode, Step};
use crate::board::Instant;
use crate::guard::Load;
use crate::protocol::status::Status;
use crate::settings::table::Row;
use core::fmt;
use leadscrew_gcode::Number;
use leadscrew_planner::Coordinate;

impl<X, const AXES: usize> Extension<AXES> for Option<X>
where
    X: Extension<AXES>,
{
    const IN_USE: bool = X::IN_USE;

    fn m_code(&self, number: u8) -> Option<MCode> {
        self.as_ref()?.m_code(number)
    }

    fn check(&self, call: &Call) -> Result<(), Status> {
        self.as_ref().map_or(Ok(()), |own| own.check(call))
    }

    fn gate(&self, asked: &Asked<'_, AXES>) -> Gate {
        self.as_ref().map_or(Gate::Open, |own| own.gate(asked))
    }

    fn perform(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) -> Step<AXES> {
        match self {
            Some(own) => own.perform(call, cx),
            None => Step::Done,
        }
    }

    fn set_aside(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) {
        if let Some(own) = self {
            own.set_aside(call, cx);
        }
    }

    fn settings(&self) -> impl Iterator<Item = &'static Row> {
        self.iter().flat_map(X::settings)
    }

    fn value(&self, number: u16) -> Number {
        self.as_ref()
            .map(|own| own.value(number))
            .unwrap_or_default()
    }

    fn set(&mut self, number: u16, value: Number) -> Result<(), Status> {
        match self {
            Some(own) => own.set(number, value),
            None => Err(Status::InvalidStatement),
        }
    }

    fn errors(&self) -> impl Iterator<Item = &'static OwnCode> {
        self.iter().flat_map(X::errors)
    }

    fn alarms(&self) -> impl Iterator<Item = &'static OwnCode> {
        self.iter().flat_map(X::alarms)
    }

    fn calculate(
        &mut self,
        line: &[u8],
        known: &Known<'_, AXES>,
        plain: &mut Line,
    ) -> Option<Result<(), Fault>> {
        self.as_mut()?.calculate(line, known, plain)
    }

    fn calculated(&mut self) {
        if let Some(own) = self {
            own.calculated();
        }
    }

    fn kept(&mut self) -> &mut [u8] {
        self.as_mut().map(X::kept).unwrap_or_default()
    }

    fn tool_length(&self, tool: Option<u32>) -> Option<Coordinate> {
        self.as_ref()?.tool_length(tool)
    }

    fn set_tool_length(&mut self, tool: u32, length: Coordinate) -> Result<u16, Status> {
        match self {
            Some(own) => own.set_tool_length(tool, length),
            None => Err(Status::UnsupportedCommand),
        }
    }

    fn report(&self, fields: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.as_ref().map_or(Ok(()), |own| own.report(fields))
    }

    fn realtime(&mut self, byte: u8, cx: &mut Cx<'_, AXES>) {
        if let Some(own) = self {
            own.realtime(byte, cx);
        }
    }

    fn is_on(&self, load: Load) -> bool {
        self.as_ref().is_some_and(|own| own.is_on(load))
    }

    fn resumes(&mut self, cx: &mut Cx<'_, AXES>) -> bool {
        self.as_mut().is_none_or(|own| own.resumes(cx))
    }

    fn event(&mut self, event: Event) {
        if let Some(own) = self {
            own.event(event);
        }
    }

    fn poll(&mut self, cx: &mut Cx<'_, AXES>) -> Option<Instant> {
        self.as_mut()?.poll(cx)
    }
}
