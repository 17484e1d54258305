//! The parameters of a program.

use crate::expression::Values;
use crate::fault::{ErrorKind, Fault};
use crate::label::{Name, Target};
use crate::numbered::{Locals, Numbered, OWN};
use crate::value::Value;
use crate::world::{named, Item, World};
use heapless::Vec;

/// The highest number of a parameter, as LinuxCNC has it.
const HIGHEST: u16 = 5602;
/// The numbers that the machine keeps, gaps included: no program sets one.
const KEPT: core::ops::RangeInclusive<u16> = 5061..=5428;

/// Parameters that a line may set.
const ASSIGNMENTS: usize = 16;

/// The values that a line sets, each with its column.
pub(crate) type Set = Vec<(Target, Value, usize), ASSIGNMENTS>;

/// A named parameter.
#[derive(Debug, Clone, Copy)]
struct Named {
    name: Name,
    /// The depth of the calls that it belongs to; 0 for the main program and for global names.
    depth: u8,
    value: Value,
}

/// All parameters that a program has set.
#[derive(Debug)]
pub(crate) struct Parameters<const NUMBERED: usize, const NAMED: usize> {
    pub(crate) locals: Locals,
    numbered: Numbered<NUMBERED>,
    named: Vec<Named, NAMED>,
    /// The depth of calls that have parameters of their own.
    depth: u8,
    /// The value of the subprogram that has ended last, if it has one: `#<_value>`.
    pub(crate) returned: Option<Value>,
}

impl<const NUMBERED: usize, const NAMED: usize> Parameters<NUMBERED, NAMED> {
    pub(crate) const fn new() -> Self {
        Self {
            locals: [Value::ZERO; OWN],
            numbered: Numbered::new(),
            named: Vec::new(),
            depth: 0,
            returned: None,
        }
    }

    /// Begins a call with these arguments; returns the parameters of its caller.
    pub(crate) fn enter(&mut self, arguments: Locals) -> Locals {
        self.depth = self.depth.saturating_add(1);
        core::mem::replace(&mut self.locals, arguments)
    }

    /// Ends a call: its caller's parameters come back, its own are forgotten.
    pub(crate) fn leave(&mut self, callers: Locals) {
        self.depth = self.depth.saturating_sub(1);
        self.locals = callers;
        let depth = self.depth;
        self.named.retain(|named| named.depth <= depth);
    }

    fn find(&self, name: &Name) -> Option<usize> {
        let depth = if name.is_global() { 0 } else { self.depth };
        let is_it = |named: &Named| named.depth == depth && named.name == *name;
        self.named.iter().position(is_it)
    }

    /// Checks whether there is room for all of these at once.
    pub(crate) fn has_room(&self, set: &Set) -> Result<(), Fault> {
        let (mut numbered, mut named) = (self.numbered.room(), NAMED - self.named.len());
        for (index, (target, _, column)) in set.iter().enumerate() {
            let earlier = set.get(..index).unwrap_or_default();
            let is_new = match target {
                Target::Number(number) => local(*number).is_none() && !self.numbered.has(*number),
                Target::Name(name) => self.find(name).is_none(),
            };
            if !is_new || earlier.iter().any(|(other, ..)| other == target) {
                continue;
            }
            let (room, kind) = match target {
                Target::Number(_) => (&mut numbered, ErrorKind::ManyParameters),
                Target::Name(_) => (&mut named, ErrorKind::ManyNames),
            };
            let column = *column;
            *room = room.checked_sub(1).ok_or(Fault { kind, column })?;
        }
        Ok(())
    }

    /// Sets a parameter.
    pub(crate) fn set(&mut self, target: &Target, value: Value) -> Result<(), ErrorKind> {
        match target {
            Target::Number(number) => self.set_number(*number, value),
            Target::Name(name) => self.set_name(name, value),
        }
    }

    fn set_number(&mut self, number: u16, value: Value) -> Result<(), ErrorKind> {
        if let Some(local) = local(number).and_then(|index| self.locals.get_mut(index)) {
            *local = value;
            return Ok(());
        }
        self.numbered.set(number, value)
    }

    /// Sets a named parameter.
    pub(crate) fn set_name(&mut self, name: &Name, value: Value) -> Result<(), ErrorKind> {
        if let Some(named) = self.find(name).and_then(|at| self.named.get_mut(at)) {
            named.value = value;
            return Ok(());
        }
        let depth = if name.is_global() { 0 } else { self.depth };
        let named = Named {
            name: *name,
            depth,
            value,
        };
        self.named.push(named).map_err(|_| ErrorKind::ManyNames)
    }
}

/// The place of a number among a subprogram's own.
fn local(number: u16) -> Option<usize> {
    let index = usize::from(number).checked_sub(1)?;
    (index < OWN).then_some(index)
}

/// Parameters and machine together, to be read.
#[derive(Clone, Copy)]
pub(crate) struct Scope<'s, const NUMBERED: usize, const NAMED: usize> {
    pub(crate) parameters: &'s Parameters<NUMBERED, NAMED>,
    pub(crate) world: &'s dyn World,
}

impl<const NUMBERED: usize, const NAMED: usize> Scope<'_, NUMBERED, NAMED> {
    /// Reads a parameter that no program sets. `None`: no such name; `Some(None)`: the machine does
    /// not know the value.
    fn kept(&self, name: &Name) -> Option<Option<Value>> {
        let returned = self.parameters.returned;
        match name.as_bytes() {
            b"_VALUE" => Some(Some(returned.unwrap_or_default())),
            b"_VALUE_RETURNED" => Some(Some(Value::from_bool(returned.is_some()))),
            _ => named(self.world, name),
        }
    }
}

impl<const NUMBERED: usize, const NAMED: usize> Values for Scope<'_, NUMBERED, NAMED> {
    fn numbered(&self, number: u16) -> Result<Value, ErrorKind> {
        if let Some(own) = local(number).and_then(|index| self.parameters.locals.get(index)) {
            return Ok(*own);
        }
        match Item::from_number(number) {
            Some(item) => self.world.read(item).ok_or(ErrorKind::UnknownHere),
            None if (1..=HIGHEST).contains(&number) => Ok(self.parameters.numbered.get(number)),
            None => Err(ErrorKind::NoParameter),
        }
    }

    fn named(&self, name: &Name) -> Result<Value, ErrorKind> {
        if let Some(kept) = self.kept(name) {
            return kept.ok_or(ErrorKind::UnknownHere);
        }
        let own = self.parameters.find(name);
        let own = own.and_then(|at| self.parameters.named.get(at));
        own.map(|named| named.value).ok_or(ErrorKind::UnknownName)
    }

    fn exists(&self, target: &Target) -> bool {
        match target {
            Target::Number(_) => true,
            Target::Name(name) => self.kept(name).is_some() || self.parameters.find(name).is_some(),
        }
    }

    fn may_set(&self, target: &Target) -> Result<(), ErrorKind> {
        let is_kept = match target {
            Target::Number(number) if !(1..=HIGHEST).contains(number) => {
                return Err(ErrorKind::NoParameter)
            }
            Target::Number(number) => KEPT.contains(number),
            Target::Name(name) => self.kept(name).is_some(),
        };
        match is_kept {
            true => Err(ErrorKind::ReadOnly),
            false => Ok(()),
        }
    }
}
