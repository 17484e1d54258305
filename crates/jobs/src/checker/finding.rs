//! The findings about a line of a program, and the words for them.

use super::Checker;
use crate::complaint::{Complaint, Fault};
use crate::remark::Remark;
use leadscrew_gcode::Number;
use leadscrew_machine::interpreter::{Fault as LineFault, Interpreter};
use leadscrew_machine::protocol::alarm::Alarm;
use leadscrew_machine::protocol::line_reader::raw_column;
use leadscrew_machine::settings::table::Setting;

/// The finding about a line: a fault, with details if there are any.
pub(super) type Finding = Result<(), (LineFaultKind, Option<String>)>;

/// A fault that the interpreter found, with its column in the filtered line, or a fault of the
/// whole line.
pub(super) enum LineFaultKind {
    Refused(LineFault),
    OutOfTravel,
    MayLeaveTravel,
    CannotFit,
    LeavesFrame,
    TooLong,
    Unanswered,
}

impl<const AXES: usize> Checker<AXES> {
    /// Words a fault in a line of the file.
    pub(super) fn complaint(
        &self,
        line: u64,
        raw: &[u8],
        kind: &LineFaultKind,
        detail: Option<String>,
    ) -> Complaint {
        let (fault, column) = match kind {
            LineFaultKind::Refused(fault) => (
                Fault::Error(fault.status),
                Some(raw_column(raw, fault.column)),
            ),
            LineFaultKind::OutOfTravel if self.settings.is_on(Setting::SoftLimits) => {
                (Fault::Alarm(Alarm::SoftLimit), None)
            }
            LineFaultKind::OutOfTravel
                if self.homed != 0 && self.settings.is_on(Setting::HardLimits) =>
            {
                (Fault::Alarm(Alarm::HardLimit), None)
            }
            LineFaultKind::OutOfTravel | LineFaultKind::MayLeaveTravel => {
                (Fault::Remark(Remark::OutsideTravel), None)
            }
            LineFaultKind::CannotFit => (Fault::CannotFit, None),
            LineFaultKind::LeavesFrame => (Fault::LeavesFrame, None),
            LineFaultKind::TooLong => (Fault::TooLong, None),
            LineFaultKind::Unanswered => (Fault::Unanswered, None),
        };
        Complaint {
            detail,
            ..Complaint::new(&self.file, line, column, fault, raw)
        }
    }
}

/// A line that the interpreter refuses; of an arc whose radii differ it says by how much.
pub(super) fn refused_by<const AXES: usize>(
    interpreter: &Interpreter<AXES>,
    fault: LineFault,
) -> (LineFaultKind, Option<String>) {
    let apart = interpreter.take_mismatch();
    let detail = apart.map(|apart| {
        let apart = Number::from_nanos(apart.nanos());
        format!("the radii of the arc at its ends differ by {apart} mm")
    });
    (LineFaultKind::Refused(fault), detail)
}

/// A line that is refused, without details.
pub(super) fn refused(fault: LineFault) -> (LineFaultKind, Option<String>) {
    (LineFaultKind::Refused(fault), None)
}
