//! The reasons why an instruction is not carried out, and the ends of a run.
use core::fmt;

/// Why an instruction was not carried out. The core answers with a fault exception (DDI 0403,
/// B1.5.14).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Trap {
    /// The instruction is undefined.
    Undefined,
    /// A branch to an address whose lowest bit is 0, where a Cortex-M has no instruction set.
    InvalidState,
    /// An exception return that fits no exception.
    InvalidReturn,
    /// The floating-point unit is switched off.
    NoCoprocessor,
    /// An access that must be aligned is not.
    Unaligned {
        /// Address of the access.
        address: u32,
    },
    /// A division by zero, where CCR.DIV_0_TRP asks for a fault.
    DivideByZero,
    /// No instruction can be fetched there.
    Fetch {
        /// Address of the instruction.
        address: u32,
    },
    /// Nothing answers at that address, or not to such an access.
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
    /// A supervisor call where its priority does not allow it.
    SupervisorCall,
}

/// Why a run ended before its time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stop {
    /// A fault in the handler of a fault: the core has locked up (DDI 0403, B1.5.15). Only a reset
    /// helps, such as that of the watchdog, which [`crate::Machine::run_until`] waits for where one
    /// is running.
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
    /// The program broke a rule of the manual for a peripheral. On the chip it would go on, and
    /// nobody knows how.
    Stray {
        /// Address of the instruction.
        pc: u32,
        /// Address of the register.
        address: u32,
        /// The breach.
        stray: Stray,
    },
}

/// An access to a peripheral that goes astray.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stray {
    /// RCC keeps the peripheral's clock off: reads say nothing, writes are lost.
    ClockOff,
    /// The peripheral's clock has only just been switched on: the access may be lost (ES0182,
    /// "Delay after an RCC peripheral clock enabling").
    ClockTooFresh {
        /// Cycles of HCLK that are left until it has come.
        left: u64,
    },
    /// The peripheral has no register there.
    NoRegister,
    /// The register can only be read.
    ReadOnly,
    /// Reserved bits do not keep the value that they had after the reset.
    Reserved {
        /// The written value.
        value: u32,
        /// The bits that had to stay.
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
            Stray::NoRegister => f.write_str("there is no register"),
            Stray::ReadOnly => f.write_str("it cannot be written"),
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
        }
    }
}

impl core::error::Error for Stop {}
