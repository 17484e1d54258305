//! Faults (DDI 0403, B1.5.14): the exception that is raised when an instruction cannot be carried
//! out, its escalation to HardFault, and lock-up (B1.5.15).
use crate::{
    cpu::SP,
    machine::Machine,
    memory::LOADER_START,
    peripheral::nvic::Exception,
    trap::{Stop, Trap},
};

/// The priority of HardFault: at this priority or above a fault cannot escalate further.
const HARD_FAULT_PRIORITY: i32 = -1;

impl Machine {
    /// Enters the handler for a trap at `address`.
    pub(crate) fn fault(&mut self, trap: Trap, address: u32) -> Result<(), Stop> {
        self.cpu.next = address;
        if trap == Trap::Breakpoint && self.debugger {
            return Err(Stop::Breakpoint { pc: address });
        }
        if (trap
            == Trap::Fetch {
                address: LOADER_START,
            })
        {
            return Err(Stop::Loader {
                stack: self.cpu.r[SP],
                masked: self.cpu.masks.primask,
            });
        }
        self.scb.note(trap);
        let current = self.nvic.execution_priority(self.cpu.masks);
        let own = handler(trap);
        let handled = own != Exception::HARD_FAULT && self.nvic.is_enabled(own);
        if handled && self.nvic.group_priority(own) < current {
            return self.enter(own);
        }
        if current <= HARD_FAULT_PRIORITY {
            return self.lock_up(trap, address);
        }
        self.scb.note_hard_fault(trap);
        self.enter(Exception::HARD_FAULT)
    }

    /// The core locks up. That ends the run, unless a running watchdog will reset the chip.
    fn lock_up(&mut self, trap: Trap, pc: u32) -> Result<(), Stop> {
        let stop = Stop::Lockup { pc, trap };
        self.locked = Some(stop);
        if self.devices.iwdg.is_running() {
            Ok(())
        } else {
            Err(stop)
        }
    }
}

/// The exception that a trap raises if that exception is enabled. Without an MPU the only
/// MemManage fault would be a fetch from a region that is never executable; the emulator reports
/// that as a bus fault.
fn handler(trap: Trap) -> Exception {
    match trap {
        Trap::Undefined
        | Trap::InvalidState
        | Trap::InvalidReturn
        | Trap::NoCoprocessor
        | Trap::Unaligned { .. }
        | Trap::DivideByZero => Exception::USAGE_FAULT,
        Trap::Fetch { .. } | Trap::Bus { .. } | Trap::Stacking | Trap::Unstacking => {
            Exception::BUS_FAULT
        }
        Trap::Breakpoint | Trap::SupervisorCall => Exception::HARD_FAULT,
    }
}
