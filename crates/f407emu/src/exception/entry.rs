//! Exception entry (DDI 0403, B1.5.6, B1.5.7): stacks the registers and starts the handler named in
//! the vector table.
use crate::{
    cpu::{CONTROL_FLOAT, CONTROL_PROCESS_STACK, LR, SP},
    machine::{LastAccess, Machine},
    peripheral::nvic::Exception,
    timing::FlashTiming,
    trap::{Stop, Trap},
};

/// Bytes of a stack frame, without and with floating-point registers.
pub(super) const BASIC_FRAME: u32 = 0x20;
pub(super) const FLOAT_FRAME: u32 = 0x68;
/// Cycles of the stacking during which the vector is fetched.
const VECTOR_OVERLAP: u64 = 6;

impl Machine {
    /// Enters a handler, which will return to the next instruction of the interrupted program.
    pub(crate) fn enter(&mut self, exception: Exception) -> Result<(), Stop> {
        let began = self.cycle;
        let value = self.exception_return_value();
        let exception = match self.stack_context() {
            Ok(()) => exception,
            Err(trap) => self.stacking_failed(exception, trap),
        };
        self.cpu.r[LR] = value;
        self.cycle += u64::from(self.timing.entry);
        self.profiler.enter(exception, began, self.instructions);
        self.start_handler(exception)
    }

    /// The value of the link register in a handler, which says how to return from it (table B1-8).
    fn exception_return_value(&self) -> u32 {
        let mode = if self.cpu.exception != 0 {
            0xFFFF_FFF1
        } else if self.cpu.on_process_stack() {
            0xFFFF_FFFD
        } else {
            0xFFFF_FFF9
        };
        let float = self.cpu.control & CONTROL_FLOAT != 0;
        mode & if float { !0x10 } else { !0 }
    }

    /// The registers could not be stacked. That is a fault of its own, unless a fault is being
    /// entered already.
    fn stacking_failed(&mut self, exception: Exception, trap: Trap) -> Exception {
        self.scb.note(Trap::Stacking);
        if exception <= Exception::HARD_FAULT {
            return exception;
        }
        self.scb.note_hard_fault(trap);
        Exception::HARD_FAULT
    }

    fn stack_context(&mut self) -> Result<(), Trap> {
        let float = self.cpu.control & CONTROL_FLOAT != 0;
        let size = if float { FLOAT_FRAME } else { BASIC_FRAME };
        let before = self.cpu.r[SP];
        let aligns = self.scb.aligns_stack();
        let stack = before.wrapping_sub(size) & if aligns { !4 } else { !0 };
        let aligned = aligns && before & 4 != 0;
        let xpsr = self.cpu.xpsr() | u32::from(aligned) << 9;
        let process = self.cpu.on_process_stack();
        self.cpu.r[SP] = stack;
        if process {
            self.cpu.swap_stacks();
        }
        let r = self.cpu.r;
        let frame = [r[0], r[1], r[2], r[3], r[12], r[LR], self.cpu.next, xpsr];
        for (address, value) in (stack..).step_by(4).zip(frame) {
            self.write_word(address, value)?;
        }
        if float && self.scb.stacks_lazily() {
            self.scb.promise(stack + BASIC_FRAME);
        } else if float {
            self.stack_float(stack + BASIC_FRAME)?;
        }
        Ok(())
    }

    /// Stacks s0 to s15 and the status register.
    pub(crate) fn stack_float(&mut self, address: u32) -> Result<(), Trap> {
        self.cycle += u64::from(self.timing.float_context);
        for index in 0..16 {
            self.write_word(address + 4 * index, self.cpu.s[index as usize])?;
        }
        self.write_word(address + 0x40, self.cpu.fpscr)
    }

    /// Changes to handler mode and goes to the handler's address in the vector.
    pub(super) fn start_handler(&mut self, exception: Exception) -> Result<(), Stop> {
        self.cpu.control &= !(CONTROL_FLOAT | CONTROL_PROCESS_STACK);
        self.cpu.it = 0;
        self.cpu.exception = exception.number();
        self.cpu.exclusive = None;
        self.cpu.event = true;
        self.cpu.asleep = false;
        self.last_access = LastAccess::None;
        self.nvic.activate(exception);
        if self.timing.flash == FlashTiming::ArtCold {
            self.art.flush();
        }
        let vector = self.fetch_vector(exception);
        self.cpu.next = vector & !1;
        if vector & 1 == 0 {
            return self.fault(Trap::InvalidState, vector);
        }
        Ok(())
    }

    /// The vector of an exception; 0 if it cannot be read.
    fn fetch_vector(&mut self, exception: Exception) -> u32 {
        let began = self.cycle;
        let address = self.scb.vtor + 4 * u32::from(exception.number());
        let vector = self.read_word(address).unwrap_or(0);
        self.cycle -= VECTOR_OVERLAP.min(self.cycle - began);
        vector
    }
}
