//! The reasons why an instruction is not carried out, and the ends of a run.
use core::fmt;

/// The reason why an instruction was not carried out. The core answers with a fault exception (DDI
/// 0403, B1.5.14).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Trap {
    /// The instruction is undefined.
    Undefined,
    /// A branch to an address whose lowest bit is 0: that asks for the Arm state, which a Cortex-M
    /// does not have.
    InvalidState,
    /// An exception return with a value that fits no active exception.
    InvalidReturn,
    /// The floating-point unit is switched off.
    NoCoprocessor,
    /// An access that must be aligned is not.
    Unaligned {
        /// Address of the access.
        address: u32,
    },
    /// A division by zero, if CCR.DIV_0_TRP asks for a fault.
    DivideByZero,
    /// No instruction can be fetched there.
    Fetch {
        /// Address of the instruction.
        address: u32,
    },
    /// Nothing at this address answers an access of this kind.
    Bus {
        /// Address of the access.
        address: u32,
    },
    /// Registers could not be stacked on exception entry.
    Stacking,
    /// Registers could not be restored on exception return.
    Unstacking,
    /// A breakpoint instruction.
    Breakpoint,
    /// A supervisor call if its priority does not allow it.
    SupervisorCall,
}

/// The reason why a run ended before its time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stop {
    /// A fault in the handler of a fault: the core has locked up (DDI 0403, B1.5.15). Only a reset
    /// helps. If a watchdog is running, [`crate::Machine::run_until`] waits for its reset instead
    /// of stopping.
    Lockup {
        /// Address of the instruction.
        pc: u32,
        /// The fault.
        trap: Trap,
    },
    /// A breakpoint instruction, with [`crate::Machine::set_debugger`].
    Breakpoint {
        /// Address of the instruction.
        pc: u32,
    },
    /// The program broke a rule of the manual for a peripheral. The chip would go on, with unknown
    /// effects.
    Stray {
        /// Address of the instruction.
        pc: u32,
        /// Address of the register.
        address: u32,
        /// The breach.
        stray: Stray,
    },
    /// The program has gone to ST's loader in the system memory, which is not emulated.
    Loader {
        /// The stack pointer.
        stack: u32,
        /// True if PRIMASK keeps interrupts away.
        masked: bool,
    },
}

/// A wrong access to a peripheral.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stray {
    /// RCC keeps the peripheral's clock off: reads return nothing useful, and writes are lost.
    ClockOff,
    /// The peripheral's clock has only just been switched on: the access may be lost (ES0182,
    /// "Delay after an RCC peripheral clock enabling").
    ClockTooFresh {
        /// Cycles of HCLK that are left until the clock runs.
        left: u64,
    },
    /// RCC holds the peripheral in reset.
    InReset,
    /// The peripheral has no register there.
    NoRegister,
    /// The register can only be read.
    ReadOnly,
    /// A wrong key for the flash: a bus error, and locked until the next reset (RM0090 section
    /// 3.6.1).
    WrongKey,
    /// The program changes reserved bits, which must keep the value that they had after the reset.
    Reserved {
        /// The written value.
        value: u32,
        /// The reserved bits that were changed.
        bits: u32,
    },
}

impl fmt::Display for Stray {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Stray::ClockOff => f.write_str("its clock is off"),
            Stray::ClockTooFresh { left } => {
                write!(f, "its clock comes only in {left} cycles")
            }
            Stray::InReset => f.write_str("it is held in reset"),
            Stray::NoRegister => f.write_str("there is no register"),
            Stray::ReadOnly => f.write_str("it cannot be written"),
            Stray::WrongKey => f.write_str("the key is wrong"),
            Stray::Reserved { value, bits } => {
                write!(f, "{value:#010x} changes the reserved bits {bits:#010x}")
            }
        }
    }
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Stop::Lockup { pc, trap } => write!(f, "locked up at {pc:#010x}: {trap:?}"),
            Stop::Breakpoint { pc } => write!(f, "breakpoint at {pc:#010x}"),
            Stop::Stray { pc, address, stray } => {
                write!(f, "access to {address:#010x} at {pc:#010x}: {stray}")
            }
            Stop::Loader { .. } => f.write_str("gone to the chip's loader"),
        }
    }
}

impl core::error::Error for Stop {}
