//! An arc, fed to the planner chord by chord as room appears.

use crate::interpreter::{ArcShape, Feed, Travel, Turn};
use leadscrew_planner::{Arc, ArcError, Coordinate, Curve};

/// Chords planned in one poll: bounds its time.
pub(crate) const CHORDS_A_POLL: usize = if cfg!(feature = "without-fpu") { 1 } else { 4 };

/// The rest of an arc.
#[derive(Clone, Debug)]
pub(crate) struct ArcFeed<const AXES: usize> {
    chords: Arc<AXES>,
    /// The end of the next chord, drawn but not planned yet.
    next: Option<[Coordinate; AXES]>,
    /// The bounds of the speed on the arc; `None` on one without a radius, which is one chord.
    curve: Option<Curve>,
}

impl<const AXES: usize> ArcFeed<AXES> {
    /// Makes the arc from `start`. `acceleration`: the lower limit of the two axes of its plane,
    /// mm/s². `tolerance`: in mm.
    ///
    /// # Errors
    /// The machine has no such plane, or the tolerance is none: settings and builds have neither.
    pub(crate) fn new(
        start: [Coordinate; AXES],
        travel: &Travel<AXES>,
        shape: &ArcShape,
        acceleration: f32,
        tolerance: f32,
    ) -> Result<Self, ArcError> {
        let plane = shape.plane.axes();
        let clockwise = shape.turn == Turn::Clockwise;
        let centre = shape.centre;
        let arc = Arc::new(start, travel.target, centre, plane, clockwise, tolerance)?;
        let mut chords = arc.with_turns(shape.more_turns, tolerance);
        let curve = chords.curve(acceleration);
        let next = chords.next();
        Ok(Self {
            chords,
            next,
            curve,
        })
    }

    /// The end of the next chord; `None` once all are planned.
    pub(crate) fn peek(&self) -> Option<[Coordinate; AXES]> {
        self.next
    }

    /// The bounds of the speed along the path of all axes, which is `stretch` times as long as the
    /// way on the arc.
    pub(crate) fn curve_of(&self, stretch: f32) -> Option<Curve> {
        self.curve.map(|curve| Curve {
            radius: curve.radius * stretch * stretch,
            ..curve
        })
    }

    /// Goes on to the next chord.
    pub(crate) fn advance(&mut self) {
        self.next = self.chords.next();
    }

    /// The number of chords that share the time of the feed. In G93 (inverse time) all chords do:
    /// the time is for the whole arc. Any other feed holds for each chord: 1.
    pub(crate) fn shares(&self, feed: Feed) -> f32 {
        match feed {
            Feed::InverseTime(_) => self.chords.chords() as f32,
            Feed::Rapid | Feed::PerMinute(_) => 1.0,
        }
    }
}
