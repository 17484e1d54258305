//! Events that end the program. The outputs are made safe, the reason is noted, and the chip is
//! reset. The next boot tells the operator the reason.
//!
//! | event | comes as | source |
//! |---|---|---|
//! | a panic | [`panic`] | the program itself |
//! | a fault: bad address, bad instruction | HardFault | the core (PM0214 section 2.4) |
//! | the stack is full | HardFault: below the stack there is no memory | `memory.x` |
//! | the crystal stops | NMI | the clock security system (RM0090 section 7.2.7) |
//! | the supply is low | the interrupt of the voltage detector | RM0090 section 5.2.3 |
//! | the main loop hangs | a reset, without a handler | the watchdog |
#![allow(unsafe_code)] // an entry in assembly, a variable that start-up leaves alone

use crate::safe_state;
use core::{
    arch::global_asm,
    panic::PanicInfo,
    sync::atomic::{AtomicU32, Ordering::Relaxed},
};
use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;
use stm32f4::stm32f407::RCC;

/// Why the chip was reset.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub(crate) enum Reason {
    /// Power came on, the reset pin was pulled, or a debugger asked for a reset: no message.
    Ordinary,
    Watchdog,
    Panic,
    Fault,
    StackOverflow,
    ClockFailure,
    SupplyLow,
}

impl Reason {
    /// The operator's message.
    pub(crate) const fn text(self) -> Option<&'static str> {
        match self {
            Self::Ordinary => None,
            Self::Watchdog => Some("the main loop hung"),
            Self::Panic => Some("a fault in the program"),
            Self::Fault => Some("a fault of the processor"),
            Self::StackOverflow => Some("the stack was full"),
            Self::ClockFailure => Some("the crystal stopped"),
            Self::SupplyLow => Some("the supply voltage was low"),
        }
    }

    /// The number that stands for the reason in [`NOTE`]. Memory is unlikely to hold this number
    /// after power-up.
    const fn note(self) -> u32 {
        0x1EAD_5C00 | self as u32
    }
}

/// The reason of the reset to come. Start-up does not clear its section.
#[link_section = ".uninit.restart"]
static NOTE: AtomicU32 = AtomicU32::new(0);

/// Makes the outputs safe and resets the chip.
pub(crate) fn because(reason: Reason) -> ! {
    safe_state::enter();
    NOTE.store(reason.note(), Relaxed);
    SCB::sys_reset()
}

/// Why the chip was reset. This clears the chip's flags and the note: a second call would find
/// nothing. Once, at start-up.
pub(crate) fn reason(rcc: &RCC) -> Reason {
    let flags = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    let note = NOTE.swap(0, Relaxed);
    let noted = [
        Reason::Panic,
        Reason::Fault,
        Reason::StackOverflow,
        Reason::ClockFailure,
        Reason::SupplyLow,
    ];
    let power_up = flags.porrstf().bit_is_set();
    if flags.wdgrstf().bit_is_set() {
        Reason::Watchdog
    } else if flags.borrstf().bit_is_set() && !power_up {
        Reason::SupplyLow
    } else if flags.sftrstf().bit_is_set() {
        let known = noted.into_iter().find(|reason| reason.note() == note);
        known.unwrap_or(Reason::Ordinary)
    } else {
        Reason::Ordinary
    }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    because(Reason::Panic)
}

// The stack pointer itself may be wrong, so it is set to the top of the stack before anything is
// pushed. Its old value is the argument of `on_fault`.
global_asm!(
    ".section .text.HardFault, \"ax\"",
    ".global HardFault",
    ".type HardFault,%function",
    ".thumb_func",
    "HardFault:",
    "mov r0, sp",
    "ldr r1, =__stack_top",
    "mov sp, r1",
    "b {on_fault}",
    ".ltorg",
    on_fault = sym on_fault,
);

/// A fault, with the stack pointer at which the core gave up.
extern "C" fn on_fault(stack: u32) -> ! {
    extern "C" {
        static _stack_end: u32;
    }
    /// Bytes for the registers that an exception pushes, the floating-point ones included, and for
    /// a frame below them.
    const MARGIN: u32 = 0x400;
    let end = (&raw const _stack_end) as u32;
    because(if stack < end + MARGIN {
        Reason::StackOverflow
    } else {
        Reason::Fault
    })
}

/// The crystal has stopped; the internal oscillator goes on.
#[exception]
unsafe fn NonMaskableInt() -> ! {
    because(Reason::ClockFailure)
}

/// An interrupt that nobody asked for.
#[exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    because(Reason::Fault)
}
