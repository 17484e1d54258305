//! Regions with a known number of instructions, which show that the plugin counts right on this
//! QEMU.
#![no_std]
#![no_main]

use core::arch::asm;
use icount_firmware::{close, done, open};

/// One sample of region `$region`: the given instructions, between the markers.
macro_rules! sample {
    ($region:literal, $instructions:literal) => {
        open::<$region>();
        // SAFETY: the instructions change r0, s0 and the flags only, as declared.
        unsafe { asm!($instructions, out("r0") _, out("s0") _) };
        close::<$region>();
    };
}

/// One sample of each region. It is a function of its own, so that the compiler moves no code of a
/// caller between the markers.
#[inline(never)]
fn samples() {
    sample!(0, "");
    sample!(1, "nop; nop; nop; nop; nop");
    // 1 + 10 · 2
    sample!(2, "movs r0, #10; 2: subs r0, #1; bne 2b");
    // The addition is not carried out, but counts as an instruction.
    sample!(3, "movs r0, #0; cmp r0, #1; it eq; addeq r0, #1");
    sample!(
        4,
        "vmov.f32 s0, #1.0; vdiv.f32 s0, s0, s0; vsqrt.f32 s0, s0"
    );
}

#[cortex_m_rt::entry]
fn main() -> ! {
    for _ in 0..3 {
        samples();
    }
    done()
}
