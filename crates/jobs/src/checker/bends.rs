//! Arcs: whether they stay in the travel, and how far they go. They are cut into chords only for a
//! picture, and when they leave the travel.

use super::{mm, Checker, Finding};
use leadscrew_machine::interpreter::{ArcShape, Travel, Turn};
use leadscrew_machine::settings::table::Setting;
use leadscrew_planner::{Arc, Coordinate};
use leadscrew_sim::scene::StrokeKind;

impl<const AXES: usize> Checker<AXES> {
    /// Checks an arc along its whole way, and notes it.
    pub(super) fn bend(
        &mut self,
        start: &[Coordinate; AXES],
        travel: &Travel<AXES>,
        shape: &ArcShape,
        kind: StrokeKind,
    ) -> Finding {
        let Some(arc) = self.chords(start, &travel.target, shape) else {
            return Ok(());
        };
        let reach: Vec<_> = arc.extremes().collect();
        let stays = reach.iter().all(|at| self.check_travel(at).is_ok());
        if stays && !self.path.is_drawn() {
            if !self.is_checking() {
                let length = length(&arc, start, &travel.target, shape.plane.axes());
                self.path.bend(length, reach.iter().map(mm), kind);
            }
            return reach.iter().try_for_each(|at| self.check_place(at));
        }
        let mut found = Ok(());
        for chord in arc {
            self.draw_to(&chord, kind);
            found = found.and_then(|()| self.check_place(&chord));
        }
        found
    }

    /// The chords into which the machine cuts an arc. The table has no setting without any.
    fn chords(
        &self,
        start: &[Coordinate; AXES],
        target: &[Coordinate; AXES],
        arc: &ArcShape,
    ) -> Option<Arc<AXES>> {
        let tolerance = self.settings.value(Setting::ArcTolerance).to_f32();
        let clockwise = arc.turn == Turn::Clockwise;
        Arc::new(
            *start,
            *target,
            arc.centre,
            arc.plane.axes(),
            clockwise,
            tolerance,
        )
        .ok()
        .map(|chords| chords.with_turns(arc.more_turns, tolerance))
    }
}

/// The length of an arc's chords, mm.
fn length<const AXES: usize>(
    arc: &Arc<AXES>,
    start: &[Coordinate; AXES],
    end: &[Coordinate; AXES],
    plane: (usize, usize),
) -> f64 {
    let chords = f64::from(arc.chords());
    let half = f64::from(arc.angle()).abs() / (2.0 * chords);
    let flat = chords * 2.0 * f64::from(arc.radius()) * half.sin();
    let (start, end) = (mm(start), mm(end));
    let climbs = (0..3).filter(|axis| *axis != plane.0 && *axis != plane.1);
    let climb: f64 = climbs.map(|axis| (end[axis] - start[axis]).powi(2)).sum();
    (flat * flat + climb).sqrt()
}
