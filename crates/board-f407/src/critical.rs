//! Critical sections that leave the step interrupt alone.
//!
//! The usual way masks every interrupt (PRIMASK), so that a tick that is due meanwhile is late.
//! Here BASEPRI masks all interrupts except the two of the steps: a tick, and the end of a pulse.
//! These two share no data that needs a lock.
use cortex_m::register::{basepri, basepri_max};
use critical_section::RawRestoreState;

/// The priority of a pulse's end: 1, one below the ticks, which have priority 0. The F407 uses the
/// upper four bits of a priority (RM0090 table 62, PM0214 section 2.3.6).
pub(crate) const PULSE_END_PRIORITY: u8 = 1 << 4;
/// The most urgent priority that is masked, as BASEPRI has it. It is 2; RTIC calls it priority 14,
/// and no task of RTIC is more urgent.
const BELOW_STEPS: u8 = 2 << 4;

struct BelowSteps;

critical_section::set_impl!(BelowSteps);

// SAFETY: only the step interrupts and faults run while the section is held. The step interrupts
// use no critical section and no data that is kept in one; a fault ends the program. BASEPRI is put
// back as it was, so sections nest.
#[allow(unsafe_code)]
unsafe impl critical_section::Impl for BelowSteps {
    unsafe fn acquire() -> RawRestoreState {
        let before = basepri::read();
        basepri_max::write(BELOW_STEPS);
        before.into()
    }

    unsafe fn release(before: RawRestoreState) {
        // SAFETY: the value was read from this register.
        unsafe { basepri::write(before as u8) }
    }
}
