//! The path of a line in its motion mode, with the numbers of the errors in brackets: axis words in
//! G80 (31), feed rate (22), arcs (26, 32, then R: 33, 34, or I, J, K: 35, 33), probing (26, 33).

use super::{pick, Check, Path, AXIS_WORDS, CENTRE_WORDS, P, R};
use crate::arc::{centre_from_radius, fitted_centre};
use crate::code::Letters;
use crate::command::ArcShape;
use crate::fault::Refusal;
use crate::modal_state::{Motion, Plane, Turn};
use crate::takers::AxisCommand;
use crate::units::millimetres;
use crate::Coordinate;
use crate::Status;
use leadscrew_gcode::{Letter, Number};

/// The most turns of an arc: the ends of its chords are then within 2 µm at a radius of 50 mm.
const MOST_TURNS: u8 = 100;

impl<const AXES: usize> Check<'_, AXES> {
    /// Returns how the line moves to its target, by its motion mode.
    #[inline]
    pub(super) fn path(
        &mut self,
        feed: Number,
        target: &[Coordinate; AXES],
    ) -> Result<Path, Refusal> {
        let (motion, still) = (self.block.modal.motion, self.block.axis_mask == 0);
        match self.block.axis_command {
            AxisCommand::Motion => {}
            AxisCommand::CancelToolLength if motion == Motion::Cancelled => {}
            AxisCommand::None
            | AxisCommand::NonModal
            | AxisCommand::SetToolLength
            | AxisCommand::CancelToolLength => return Ok(Path::None),
        }
        if motion == Motion::Cancelled && !still {
            return Err(Refusal::words(Status::AxisWordsUnused, AXIS_WORDS));
        }
        if motion.needs_feed() && feed == Number::default() {
            return Err(self.without_feed());
        }
        if !motion.is_built() {
            return Err(Refusal::words(Status::UnsupportedCommand, AXIS_WORDS));
        }
        match motion {
            Motion::Rapid | Motion::Feed if still => Ok(Path::None),
            Motion::Rapid | Motion::Feed => Ok(Path::Straight),
            Motion::Arc(turn) => self.arc(turn, target),
            Motion::Probe(_) if still => Err(Refusal::g(Status::NoAxisWords, 38)),
            Motion::Probe(_) if *target == self.state.position => {
                Err(Refusal::words(Status::InvalidTarget, AXIS_WORDS))
            }
            Motion::Probe(kind) => Ok(Path::Probe(kind)),
            Motion::Cycle(kind) if still => Err(Refusal::g(Status::NoAxisWords, kind.code())),
            Motion::Cycle(_) => Ok(Path::Cycle),
            Motion::Cancelled => Ok(Path::None),
        }
    }

    /// The refusal of a feed motion without a feed rate. For a cycle, missing axis words come
    /// first, as in LinuxCNC.
    fn without_feed(&self) -> Refusal {
        match self.block.modal.motion {
            Motion::Cycle(kind) if self.block.axis_mask == 0 => {
                Refusal::g(Status::NoAxisWords, kind.code())
            }
            Motion::Rapid
            | Motion::Feed
            | Motion::Arc(_)
            | Motion::Probe(_)
            | Motion::Cycle(_)
            | Motion::Cancelled => self.feed_undefined(),
        }
    }

    /// An arc; if its radius is given and only the axis across the plane moves, a straight line
    /// along that axis.
    fn arc(&mut self, turn: Turn, target: &[Coordinate; AXES]) -> Result<Path, Refusal> {
        let plane = self.block.modal.plane;
        let (first, second) = plane.axes();
        let turns_about_centre = self.context.dialect.has_linuxcnc() && self.gives(CENTRE_WORDS);
        if self.block.axis_mask == 0 && !turns_about_centre {
            let code = match turn {
                Turn::Clockwise => 2,
                Turn::Counterclockwise => 3,
            };
            return Err(Refusal::g(Status::NoAxisWords, code));
        }
        if !self.moves(first) && !self.moves(second) && !turns_about_centre {
            return Err(Refusal::words(Status::NoAxisWordsInPlane, AXIS_WORDS));
        }
        let travel =
            [first, second].map(|axis| pick(target, axis) - pick(&self.state.position, axis));
        let stays_in_plane = travel == [Coordinate::ZERO; 2];
        let centre = match self.gives(R) {
            true if stays_in_plane && *target != self.state.position => {
                self.unused = self.unused.without(R);
                return Ok(Path::Straight);
            }
            true => self.centre_by_radius(travel, turn)?,
            false => self.centre_by_offset(travel, plane, turn)?,
        };
        Ok(Path::Arc(ArcShape {
            plane,
            turn,
            centre,
            more_turns: self.more_turns()?,
        }))
    }

    /// The turns of P beyond the first.
    fn more_turns(&mut self) -> Result<u8, Refusal> {
        if !self.context.dialect.has_linuxcnc() || !self.unused.contains(Letter::P) {
            return Ok(0);
        }
        self.unused = self.unused.without(P);
        let whole = self.block.p.trunc();
        let turns = u8::try_from(whole)
            .ok()
            .filter(|_| self.block.p == Number::from_int(whole as i32));
        match turns {
            Some(turns @ 1..=MOST_TURNS) => Ok(turns - 1),
            Some(_) | None => Err(Refusal::words(Status::OutOfRange, P)),
        }
    }

    fn centre_by_radius(
        &mut self,
        travel: [Coordinate; 2],
        turn: Turn,
    ) -> Result<[Coordinate; 2], Refusal> {
        self.unused = self.unused.without(R);
        let radius = self.length(self.block.r, R)?;
        centre_from_radius(travel, radius, turn).map_err(|status| Refusal::words(status, R))
    }

    fn centre_by_offset(
        &mut self,
        travel: [Coordinate; 2],
        plane: Plane,
        turn: Turn,
    ) -> Result<[Coordinate; 2], Refusal> {
        let in_plane = match plane {
            Plane::Xy => Letters::of(&[Letter::I, Letter::J]),
            Plane::Zx => Letters::of(&[Letter::K, Letter::I]),
            Plane::Yz => Letters::of(&[Letter::J, Letter::K]),
        };
        if !self.gives(in_plane) {
            return Err(Refusal::words(Status::ArcCentreMissing, AXIS_WORDS));
        }
        self.unused = self.unused.without(CENTRE_WORDS);
        let [i, j, k] = self.block.centre;
        let (first, second) = match plane {
            Plane::Xy => (i, j),
            Plane::Zx => (k, i),
            Plane::Yz => (j, k),
        };
        let centre = [
            self.length(first, CENTRE_WORDS)?,
            self.length(second, CENTRE_WORDS)?,
        ];
        fitted_centre(travel, centre, turn, self.context.arcs).map_err(|apart| {
            self.state.apart.note(apart);
            Refusal::words(Status::InvalidTarget, CENTRE_WORDS)
        })
    }

    /// A radius or an offset to a centre.
    pub(super) fn length(&self, value: Number, letter: Letters) -> Result<Coordinate, Refusal> {
        millimetres(self.in_millimetres(value)).map_err(|status| Refusal::words(status, letter))
    }
}
