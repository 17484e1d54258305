//! Hints, barriers, exceptions and special registers.
use crate::{instruction::System, machine::Machine, peripheral::nvic::Exception, trap::Trap};

impl Machine {
    pub(super) fn execute_system(&mut self, system: System) -> Result<(), Trap> {
        match system {
            System::Nop => {}
            System::WaitForInterrupt => self.cpu.asleep = true,
            System::WaitForEvent => self.cpu.asleep = !core::mem::take(&mut self.cpu.event),
            System::SendEvent => self.cpu.event = true,
            System::DataBarrier => {
                self.drain_stores();
                self.wait_for_clocks();
                self.cycle += 2;
            }
            System::InstructionBarrier => self.cycle += 3,
            System::Breakpoint => return Err(Trap::Breakpoint),
            System::SupervisorCall => self.call_supervisor()?,
            System::ChangeState {
                disable,
                primask,
                faultmask,
            } => self.change_state(disable, primask, faultmask),
            System::ReadSpecial { rd, register } => {
                let value = self.cpu.special(register);
                self.cpu.set(rd, value);
                self.cycle += 1;
            }
            System::WriteSpecial { rn, register, mask } => {
                let value = self.cpu.get(rn);
                self.cpu.set_special(register, mask, value);
                self.nvic.changed = true;
                self.cycle += 1;
            }
        }
        self.spend(1);
        Ok(())
    }

    /// A supervisor call (SVC) that cannot be served at once is a fault.
    fn call_supervisor(&mut self) -> Result<(), Trap> {
        let call = Exception::SUPERVISOR_CALL;
        let current = self.nvic.execution_priority(self.cpu.masks);
        if self.nvic.group_priority(call) >= current {
            return Err(Trap::SupervisorCall);
        }
        self.nvic.pend(call);
        Ok(())
    }

    fn change_state(&mut self, disable: bool, primask: bool, faultmask: bool) {
        if primask {
            self.cpu.masks.primask = disable;
        }
        if faultmask {
            self.cpu.masks.faultmask = disable;
        }
        self.nvic.changed = true;
        self.cycle += 1;
    }
}
