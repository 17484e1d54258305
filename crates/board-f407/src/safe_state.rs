//! The state in which the outputs do no harm, and the ways into it that end the program.
use crate::profile::PROFILE;
use core::panic::PanicInfo;
use cortex_m::peripheral::SCB;

/// Makes every pin that could do harm an output that is off: steps low, power, spindle and coolant off.
pub(crate) fn enter() {
    PROFILE.power.pin.make_output(false);
    for motor in PROFILE.motors {
        motor.step.make_output(false);
        motor.direction.make_output(false);
    }
    let outputs = [
        PROFILE.spindle,
        PROFILE.spindle_reverse,
        PROFILE.flood,
        PROFILE.mist,
    ];
    for output in outputs.into_iter().flatten() {
        output.make_output();
    }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    enter();
    SCB::sys_reset()
}
