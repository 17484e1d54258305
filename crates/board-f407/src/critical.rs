//! Critical sections that leave the step interrupt alone.
//!
//! The usual way masks every interrupt (PRIMASK), so that a tick that is due meanwhile is late.
//! Here BASEPRI masks all interrupts except the two of the steps: a tick, and the end of a pulse.
//! These two share no data that needs a lock.
use cortex_m::register::{basepri, basepri_max};
use critical_section::RawRestoreState;

/// The four bits of a priority on the F407 are the upper ones (RM0090 table 62, PM0214 section
/// 2.3.6). Ticks have priority 0.
pub(crate) const PULSE_END_PRIORITY: u8 = 1 << 4;
/// The most urgent priority that is masked, as BASEPRI has it. RTIC's tasks have priority 14 at
/// most, which is this one.
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
