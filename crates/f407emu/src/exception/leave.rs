//! Exception return (DDI 0403, B1.5.8): a branch to a special value that is no code address.
use super::entry::{BASIC_FRAME, FLOAT_FRAME};
use crate::{
    cpu::{CONTROL_FLOAT, CONTROL_PROCESS_STACK, LR, SP},
    machine::{LastAccess, Machine},
    peripheral::nvic::Exception,
    trap::{Stop, Trap},
};

/// Bits of the special value: return to thread mode; use the process stack; the frame has no
/// floating-point registers.
const TO_THREAD: u32 = 1 << 3;
const TO_PROCESS_STACK: u32 = 1 << 2;
const BASIC: u32 = 1 << 4;

impl Machine {
    /// Returns from the handler under way, as the value from the link register says.
    pub(crate) fn return_from_exception(&mut self, value: u32) -> Result<(), Trap> {
        let exception = Exception(self.cpu.exception);
        self.nvic.deactivate(exception);
        if exception > Exception::NMI {
            self.cpu.masks.faultmask = false;
        }
        let to_thread = value & TO_THREAD != 0;
        let known = matches!(value | BASIC, 0xFFFF_FFF1 | 0xFFFF_FFF9 | 0xFFFF_FFFD);
        if !known || to_thread != (self.nvic.active_count() == 0) {
            return Err(Trap::InvalidReturn);
        }
        match self.nvic.next(self.cpu.masks) {
            Some(next) => self.chain(next, value),
            None => self.unstack_context(value),
        }
    }

    /// Goes straight to the next handler (tail-chaining): the stack does not change.
    fn chain(&mut self, next: Exception, value: u32) -> Result<(), Trap> {
        self.profiler.leave(self.cycle, self.instructions);
        self.profiler.enter(next, self.cycle, self.instructions);
        self.cycle += u64::from(self.timing.tail_chain);
        self.cpu.r[LR] = value;
        match self.start_handler(next) {
            Ok(()) => Ok(()),
            Err(Stop::Lockup { trap, .. }) => Err(trap),
            Err(Stop::Breakpoint { .. } | Stop::Stray { .. } | Stop::Loader { .. }) => {
                Err(Trap::Breakpoint)
            }
        }
    }

    fn unstack_context(&mut self, value: u32) -> Result<(), Trap> {
        self.cpu.exception = 0;
        if value & TO_PROCESS_STACK != 0 {
            self.cpu.swap_stacks();
            self.cpu.control |= CONTROL_PROCESS_STACK;
        } else {
            self.cpu.control &= !CONTROL_PROCESS_STACK;
        }
        let stack = self.cpu.r[SP];
        let mut frame = [0; 8];
        for (address, word) in (stack..).step_by(4).zip(&mut frame) {
            *word = self.read_word(address).map_err(|_| Trap::Unstacking)?;
        }
        let float = value & BASIC == 0;
        if float {
            self.unstack_float(stack + BASIC_FRAME)?;
        }
        self.restore(frame);
        self.cpu.control &= !CONTROL_FLOAT;
        self.cpu.control |= if float { CONTROL_FLOAT } else { 0 };
        let size = if float { FLOAT_FRAME } else { BASIC_FRAME };
        let aligned = self.scb.aligns_stack() && frame[7] >> 9 & 1 != 0;
        self.cpu.r[SP] = stack.wrapping_add(size) | u32::from(aligned) << 2;
        self.cycle += u64::from(self.timing.exit);
        self.profiler.leave(self.cycle, self.instructions);
        Ok(())
    }

    fn restore(&mut self, frame: [u32; 8]) {
        let [r0, r1, r2, r3, r12, link, next, xpsr] = frame;
        self.cpu.r[..4].copy_from_slice(&[r0, r1, r2, r3]);
        (self.cpu.r[12], self.cpu.r[LR]) = (r12, link);
        self.cpu.next = next & !1;
        self.cpu.set_xpsr(xpsr);
        self.cpu.exclusive = None;
        self.cpu.event = true;
        self.last_access = LastAccess::None;
    }

    /// Restores the floating-point registers from the stack. If lazy stacking has not stored them,
    /// the registers still have their values.
    fn unstack_float(&mut self, address: u32) -> Result<(), Trap> {
        if self.scb.lazy_pending() {
            self.scb.end_promise();
            return Ok(());
        }
        for index in 0..16 {
            let word = self.read_word(address + 4 * index);
            self.cpu.s[index as usize] = word.map_err(|_| Trap::Unstacking)?;
        }
        self.cpu.fpscr = self
            .read_word(address + 0x40)
            .map_err(|_| Trap::Unstacking)?;
        self.cycle += u64::from(self.timing.float_context);
        Ok(())
    }
}
