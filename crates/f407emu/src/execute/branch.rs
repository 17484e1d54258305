//! Changes of the program flow.
use crate::{
    cpu::LR,
    instruction::{Branch, Width},
    machine::Machine,
    trap::Trap,
};

impl Machine {
    #[inline(always)]
    pub(super) fn execute_branch(&mut self, branch: Branch) -> Result<(), Trap> {
        match branch {
            Branch::Direct { condition, target } => {
                if self.cpu.holds(condition) {
                    self.branch(target);
                }
            }
            Branch::Link { target } => {
                self.cpu.r[LR] = self.cpu.next | 1;
                self.branch(target);
            }
            Branch::Exchange { rm } => self.exchange(self.cpu.get(rm), self.timing.refill)?,
            Branch::LinkExchange { rm } => {
                let target = self.cpu.get(rm);
                let link = self.cpu.next | 1;
                self.exchange(target, self.timing.refill)?;
                self.cpu.r[LR] = link;
            }
            Branch::Compare {
                nonzero,
                rn,
                target,
            } => {
                if (self.cpu.get(rn) != 0) == nonzero {
                    self.branch(target);
                    self.cycle += 1;
                }
            }
            Branch::Table { width, rn, rm } => self.branch_by_table(width, rn, rm)?,
            Branch::IfThen { state } => self.cpu.it = state,
        }
        self.spend(1);
        Ok(())
    }

    /// A branch within Thumb code.
    #[inline(always)]
    pub(crate) fn branch(&mut self, target: u32) {
        self.cpu.next = target & !1;
        self.cycle += u64::from(self.timing.refill);
        self.align_fetch();
    }

    /// Charges a cycle if an instruction of 32 bits lies across a word boundary, which needs one
    /// more fetch.
    #[inline(always)]
    fn align_fetch(&mut self) {
        if self.cpu.next & 2 != 0 && self.memory.is_wide(self.cpu.next) {
            self.cycle += 1;
        }
    }

    /// BXWritePC: a branch to an address with the Thumb bit, or an exception return.
    pub(super) fn exchange(&mut self, target: u32, refill: u32) -> Result<(), Trap> {
        if target >> 28 == 0xF && self.cpu.exception != 0 {
            return self.return_from_exception(target);
        }
        if target & 1 == 0 {
            return Err(Trap::InvalidState);
        }
        self.cpu.next = target & !1;
        self.cycle += u64::from(refill);
        self.align_fetch();
        Ok(())
    }

    fn branch_by_table(&mut self, width: Width, rn: u8, rm: u8) -> Result<(), Trap> {
        let base = self.cpu.get(rn);
        let index = self.cpu.get(rm) * width.bytes() as u32;
        let halfwords = self.read(base.wrapping_add(index), width)?;
        self.cycle += 3;
        self.branch(self.cpu.get(15).wrapping_add(2 * halfwords));
        Ok(())
    }
}
