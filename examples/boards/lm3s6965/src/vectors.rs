//! The chip's part of the vector table, and the names of its interrupts (data sheet, interrupt
//! table).
#![allow(unsafe_code)]

use cortex_m::interrupt::InterruptNumber;

/// The interrupts that the board uses.
#[derive(Clone, Copy)]
#[repr(u16)]
pub(crate) enum Interrupt {
    Uart0 = 5,
    Timer0A = 19,
    Timer2A = 23,
}

// SAFETY: each number belongs to one interrupt, and never changes.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

/// An entry of the vector table.
#[derive(Clone, Copy)]
#[repr(C)]
pub(crate) union Vector {
    handler: unsafe extern "C" fn(),
    none: u32,
}

extern "C" {
    fn UART0();
    fn TIMER_0A();
    fn TIMER_2A();
}

const NONE: Vector = Vector { none: 0 };

/// The chip's interrupts, by number.
#[link_section = ".vector_table.interrupts"]
#[no_mangle]
pub(crate) static __INTERRUPTS: [Vector; 24] = {
    let mut table = [NONE; 24];
    table[Interrupt::Uart0 as usize] = Vector { handler: UART0 };
    table[Interrupt::Timer0A as usize] = Vector { handler: TIMER_0A };
    table[Interrupt::Timer2A as usize] = Vector { handler: TIMER_2A };
    table
};
