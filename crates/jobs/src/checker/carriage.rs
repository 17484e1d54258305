//! The ends of the travel of a simulated machine's carriages. Its file says where they stand at
//! power-up and where the switches are; a real machine's place is not known.

use super::{Checker, Finding, LineFaultKind};
use leadscrew_machine::config::{AxisKind, AxisMask};
use leadscrew_machine::settings::table::Setting;
use leadscrew_planner::{Coordinate, StepsPerMm};
use leadscrew_sim::profile::Room;

/// The carriage of a straight axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Carriage {
    /// Its room. All places in it are on the axis' own scale.
    room: Room,
    /// Its place while the machine counts 0.
    zero: Coordinate,
    /// The steps/mm with which the machine counts as the file does.
    scale: StepsPerMm,
    /// It has been told to leave its frame.
    told: bool,
}

impl<const AXES: usize> Checker<AXES> {
    /// Takes the carriages to stand where the machine's file puts them at power-up.
    pub(super) fn place_carriages(&mut self, rooms: &[Option<Room>]) {
        for (axis, carriage) in self.carriages.iter_mut().enumerate() {
            let is_straight = self.config.axes[axis] == AxisKind::Linear;
            let room = rooms.get(axis).copied().flatten();
            *carriage = room.filter(|_| is_straight).map(|room| Carriage {
                room,
                zero: nanometres(room.start),
                scale: StepsPerMm::from_nanos(nanometres(room.steps_per_mm).nanos()),
                told: false,
            });
        }
    }

    /// These axes have been homed: the machine counts from their switches.
    pub(super) fn home_carriages(&mut self, homed: AxisMask) {
        let (ends, negative) = (
            self.measures.ends,
            self.settings.mask(Setting::HomingDirection),
        );
        for (axis, slot) in self.carriages.iter_mut().enumerate() {
            let Some(carriage) = slot.as_mut().filter(|_| homed >> axis & 1 == 1) else {
                continue;
            };
            let is_low = negative >> axis & 1 == 1;
            let switch = match is_low {
                true => carriage.room.low,
                false => carriage.room.high,
            };
            match switch {
                Some(switch) => {
                    let counted = ends[axis].place(Coordinate::ZERO, is_low);
                    carriage.zero = nanometres(switch) - counted;
                }
                None => *slot = None,
            }
        }
    }

    /// Checks that no carriage leaves its frame on the way to `target`, machine coordinates. Hard
    /// limits raise an alarm at their switches themselves.
    pub(super) fn check_frame(&mut self, target: &[Coordinate; AXES]) -> Finding {
        if self.is_checking() {
            return Ok(());
        }
        let (travel, scales) = (self.measures.travel, self.measures.scales);
        let hard = self.settings.is_on(Setting::HardLimits);
        for (axis, slot) in self.carriages.iter_mut().enumerate() {
            let counts_so = |carriage: &Carriage| carriage.scale == scales[axis];
            *slot = slot.filter(counts_so);
            let Some(carriage) = slot.as_mut().filter(|carriage| !carriage.told) else {
                continue;
            };
            let at = target[axis] + carriage.zero;
            let Some(end) = carriage.end_before(at, travel[axis], hard) else {
                continue;
            };
            carriage.told = true;
            let letter = self.letters.get(axis).copied().unwrap_or('?');
            let detail = format!(
                "{letter} would be at {:.3} mm on the axis' own scale, its frame ends at {:.3} mm",
                at.to_mm(),
                end.to_mm()
            );
            return Err((LineFaultKind::LeavesFrame, Some(detail)));
        }
        Ok(())
    }
}

impl Carriage {
    /// The end of the frame that `at` is beyond, if no switch stops the carriage there. An end
    /// without a switch is a `travel` away from the other end's.
    fn end_before(&self, at: Coordinate, travel: Coordinate, hard: bool) -> Option<Coordinate> {
        let Room { low, high, .. } = self.room;
        let (low, high) = (low.map(nanometres), high.map(nanometres));
        // An alarm tells it, or it is no end.
        let is_excused = hard || self.room.passes;
        let lowest = low.or(high.map(|high| high - travel));
        let highest = high.or(low.map(|low| low + travel));
        let below = lowest.filter(|end| at < *end && !(is_excused && low.is_some()));
        let above = highest.filter(|end| at > *end && !(is_excused && high.is_some()));
        below.or(above)
    }
}

/// A value of the machine's file, exact to a nanometre.
fn nanometres(mm: f64) -> Coordinate {
    Coordinate::from_nanos((mm * 1e9).round() as i64)
}
