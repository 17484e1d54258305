//! Two extensions as one.

use super::{Asked, Call, Cx, Event, Extension, Fault, Gate, Known, Line, MCode, OwnCode, Step};
use crate::board::Instant;
use crate::guard::Load;
use crate::protocol::status::Status;
use crate::settings::table::Row;
use core::fmt;
use leadscrew_gcode::Number;
use leadscrew_planner::Coordinate;

impl<A, B, const AXES: usize> Extension<AXES> for (A, B)
where
    A: Extension<AXES>,
    B: Extension<AXES>,
{
    const IN_USE: bool = A::IN_USE || B::IN_USE;

    fn m_code(&self, number: u8) -> Option<MCode> {
        let (one, other) = self;
        one.m_code(number).or_else(|| other.m_code(number))
    }

    fn perform(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) -> Step<AXES> {
        let (one, other) = self;
        match one.m_code(call.code) {
            Some(_) => one.perform(call, cx),
            None => other.perform(call, cx),
        }
    }

    fn set_aside(&mut self, call: &Call, cx: &mut Cx<'_, AXES>) {
        let (one, other) = self;
        match one.m_code(call.code) {
            Some(_) => one.set_aside(call, cx),
            None => other.set_aside(call, cx),
        }
    }

    fn check(&self, call: &Call) -> Result<(), Status> {
        let (one, other) = self;
        match one.m_code(call.code) {
            Some(_) => one.check(call),
            None => other.check(call),
        }
    }

    fn gate(&self, asked: &Asked<'_, AXES>) -> Gate {
        let (one, other) = self;
        match (one.gate(asked), other.gate(asked)) {
            (refused @ Gate::Refuse(_), _) | (_, refused @ Gate::Refuse(_)) => refused,
            (Gate::Wait, _) | (_, Gate::Wait) => Gate::Wait,
            (Gate::Open, Gate::Open) => Gate::Open,
        }
    }

    fn errors(&self) -> impl Iterator<Item = &'static OwnCode> {
        let (one, other) = self;
        one.errors().chain(other.errors())
    }

    fn alarms(&self) -> impl Iterator<Item = &'static OwnCode> {
        let (one, other) = self;
        one.alarms().chain(other.alarms())
    }

    fn settings(&self) -> impl Iterator<Item = &'static Row> {
        let (one, other) = self;
        one.settings().chain(other.settings())
    }

    fn value(&self, number: u16) -> Number {
        let (one, other) = self;
        match one.settings().any(|row| row.number == number) {
            true => one.value(number),
            false => other.value(number),
        }
    }

    fn set(&mut self, number: u16, value: Number) -> Result<(), Status> {
        let (one, other) = self;
        let first = one.settings().any(|row| row.number == number);
        match first {
            true => one.set(number, value),
            false => other.set(number, value),
        }
    }

    fn calculate(
        &mut self,
        line: &[u8],
        known: &Known<'_, AXES>,
        plain: &mut Line,
    ) -> Option<Result<(), Fault>> {
        let (one, other) = self;
        let calculated = one.calculate(line, known, plain);
        calculated.or_else(|| other.calculate(line, known, plain))
    }

    fn calculated(&mut self) {
        let (one, other) = self;
        one.calculated();
        other.calculated();
    }

    fn kept(&mut self) -> &mut [u8] {
        let (one, other) = self;
        let kept = one.kept();
        match kept.is_empty() {
            true => other.kept(),
            false => kept,
        }
    }

    fn tool_length(&self, tool: Option<u32>) -> Option<Coordinate> {
        let (one, other) = self;
        one.tool_length(tool).or_else(|| other.tool_length(tool))
    }

    fn set_tool_length(&mut self, tool: u32, length: Coordinate) -> Result<u16, Status> {
        let (one, other) = self;
        let set = one.set_tool_length(tool, length);
        match set {
            Err(Status::UnsupportedCommand) => other.set_tool_length(tool, length),
            Ok(_) | Err(_) => set,
        }
    }

    fn report(&self, fields: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (one, other) = self;
        one.report(fields)?;
        other.report(fields)
    }

    fn realtime(&mut self, byte: u8, cx: &mut Cx<'_, AXES>) {
        let (one, other) = self;
        one.realtime(byte, cx);
        other.realtime(byte, cx);
    }

    fn is_on(&self, load: Load) -> bool {
        let (one, other) = self;
        one.is_on(load) || other.is_on(load)
    }

    fn resumes(&mut self, cx: &mut Cx<'_, AXES>) -> bool {
        let (one, other) = self;
        one.resumes(cx) && other.resumes(cx)
    }

    fn event(&mut self, event: Event) {
        let (one, other) = self;
        one.event(event);
        other.event(event);
    }

    fn poll(&mut self, cx: &mut Cx<'_, AXES>) -> Option<Instant> {
        let (one, other) = self;
        let wakes = [one.poll(cx), other.poll(cx)];
        wakes.into_iter().flatten().min()
    }
}
