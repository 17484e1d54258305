//! Exceptions of the core (DDI 0403, B1.5): the choice of the next one, entry, return, and faults.
mod entry;
mod fault;
mod leave;

use crate::{machine::Machine, peripheral::rcc::ResetCause, trap::Stop};

impl Machine {
    /// Takes the exception that is due, if there is one.
    #[cold]
    pub(crate) fn take_pending(&mut self) -> Result<(), Stop> {
        if self.reset_requested {
            self.restart(ResetCause::Software, self.cycle);
        }
        match self.nvic.next(self.cpu.masks) {
            Some(exception) => self.enter(exception),
            None => {
                // Whatever can make another exception due sets `changed` again.
                self.nvic.changed = false;
                Ok(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        machine::Machine,
        peripheral::nvic::Exception,
        trap::{Stop, Trap},
    };

    const STACK: u32 = 0x2000_1000;

    /// A machine with programs at addresses in the flash. All handlers in its vector table return
    /// at once (`bx lr`).
    fn machine(programs: &[(u32, &[u16])]) -> Box<Machine> {
        let mut machine = Machine::new(8_000_000);
        let mut vectors = vec![STACK, 0x0800_0401];
        vectors.resize(98, 0x0800_0301);
        for (index, vector) in vectors.iter().enumerate() {
            machine.program_flash(0x0800_0000 + 4 * index as u32, &vector.to_le_bytes());
        }
        machine.program_flash(0x0800_0300, &[0x70, 0x47]);
        for (address, program) in programs {
            let bytes: Vec<u8> = program.iter().flat_map(|half| half.to_le_bytes()).collect();
            machine.program_flash(*address, &bytes);
        }
        machine.boot();
        machine
    }

    fn steps(machine: &mut Machine, count: usize) {
        for _ in 0..count {
            machine.step().unwrap();
        }
    }

    #[test]
    fn entry_stacks_eight_words_and_the_return_restores_them() {
        let mut machine = machine(&[(0x0800_0400, &[0xBF00, 0xBF00, 0xBF00])]);
        machine.cpu.r[0] = 0x1234;
        steps(&mut machine, 1);
        machine.nvic.pend(Exception::PEND_SV);
        let before = machine.cycle();
        machine.take_pending().unwrap();
        assert_eq!(machine.cycle() - before, 12);
        assert_eq!(machine.cpu.r[13], STACK - 32);
        assert_eq!(machine.cpu.r[14], 0xFFFF_FFF9);
        assert_eq!(machine.read_word(STACK - 32), Ok(0x1234));
        assert_eq!(machine.read_word(STACK - 8), Ok(0x0800_0402));
        machine.cpu.r[0] = 0;
        steps(&mut machine, 1);
        assert_eq!((machine.cpu.r[0], machine.cpu.r[13]), (0x1234, STACK));
        assert_eq!(machine.pc(), 0x0800_0402);
        assert_eq!(machine.profile(Exception::PEND_SV).count, 1);
    }

    #[test]
    fn the_stack_is_aligned_to_eight_bytes_on_entry() {
        let mut machine = machine(&[(0x0800_0400, &[0xBF00, 0xBF00])]);
        machine.cpu.r[13] = STACK - 4;
        machine.nvic.pend(Exception::PEND_SV);
        machine.take_pending().unwrap();
        assert_eq!(machine.cpu.r[13] % 8, 0);
        steps(&mut machine, 1);
        assert_eq!(machine.cpu.r[13], STACK - 4);
    }

    #[test]
    fn a_second_exception_follows_without_unstacking() {
        let mut machine = machine(&[(0x0800_0400, &[0xBF00, 0xBF00])]);
        machine.nvic.pend(Exception::PEND_SV);
        machine.nvic.pend(Exception::SYSTICK);
        steps(&mut machine, 1); // PendSV's handler returns into SysTick's
        assert_eq!(machine.cpu.exception, Exception::SYSTICK.number());
        assert_eq!(machine.cpu.r[13], STACK - 32);
        steps(&mut machine, 1);
        assert_eq!(machine.cpu.r[13], STACK);
    }

    #[test]
    fn floating_point_registers_are_stacked_when_the_handler_needs_them() {
        let vmov: &[u16] = &[0xEE30, 0x0A00, 0x4770]; // vadd.f32 s0, s0, s0; bx lr
        let mut machine = machine(&[(0x0800_0400, vmov), (0x0800_0300, vmov)]);
        machine.scb.cpacr = 0xF << 20;
        machine.cpu.s[0] = 1f32.to_bits();
        steps(&mut machine, 1);
        machine.nvic.pend(Exception::PEND_SV);
        machine.take_pending().unwrap();
        assert_eq!(machine.cpu.r[13], STACK - 0x68);
        assert!(machine.scb.lazy_pending());
        steps(&mut machine, 1);
        assert!(!machine.scb.lazy_pending());
        assert_eq!(machine.read_word(STACK - 0x48), Ok(2f32.to_bits()));
        assert_eq!(machine.cpu.s[0], 4f32.to_bits());
        steps(&mut machine, 1);
        assert_eq!(machine.cpu.s[0], 2f32.to_bits());
    }

    #[test]
    fn a_fault_without_a_handler_of_its_own_becomes_a_hard_fault_at_its_instruction() {
        let mut machine = machine(&[(0x0800_0400, &[0xBF00, 0xDE00])]); // nop; udf
        steps(&mut machine, 2);
        assert_eq!(machine.cpu.exception, Exception::HARD_FAULT.number());
        assert_eq!(machine.read_word(STACK - 8), Ok(0x0800_0402));
        assert_eq!(machine.read_word(0xE000_ED28), Ok(1 << 16));
        assert_eq!(machine.read_word(0xE000_ED2C), Ok(1 << 30));
    }

    #[test]
    fn a_fault_with_a_handler_of_its_own_goes_there() {
        let mut machine = machine(&[(0x0800_0400, &[0xDE00])]);
        machine.write_word(0xE000_ED24, 1 << 18).unwrap();
        steps(&mut machine, 1);
        assert_eq!(machine.cpu.exception, Exception::USAGE_FAULT.number());
    }

    #[test]
    fn a_load_from_nowhere_leaves_its_register_as_it_was() {
        let mut machine = machine(&[(0x0800_0400, &[0x6808])]); // ldr r0, [r1]
        (machine.cpu.r[0], machine.cpu.r[1]) = (7, 0x3000_0000);
        steps(&mut machine, 1);
        assert_eq!(machine.cpu.r[0], 7);
        assert_eq!(machine.read_word(0xE000_ED38), Ok(0x3000_0000));
    }

    #[test]
    fn a_fault_in_the_hard_fault_handler_locks_up() {
        let mut machine = machine(&[(0x0800_0400, &[0xDE00]), (0x0800_0300, &[0xDE00])]);
        let locked = Err(Stop::Lockup {
            pc: 0x0800_0300,
            trap: Trap::Undefined,
        });
        assert_eq!(machine.run_until(1000), locked);
    }

    #[test]
    fn a_watchdog_resets_a_core_that_has_locked_up() {
        let mut machine = machine(&[(0x0800_0400, &[0xDE00]), (0x0800_0300, &[0xDE00])]);
        machine.write_word(0x4000_3000, 0xCCCC).unwrap();
        machine.run_until(10_000_000).unwrap_err();
        assert_eq!(
            machine.resets().len(),
            1,
            "the second lock-up has no watchdog"
        );
    }

    #[test]
    fn a_stack_that_has_run_out_of_memory_still_reaches_the_hard_fault_handler() {
        let mut machine = machine(&[(0x0800_0400, &[0xB401])]); // push {r0}
        machine.cpu.r[13] = 0x2000_0000;
        steps(&mut machine, 1);
        assert_eq!(machine.cpu.exception, Exception::HARD_FAULT.number());
        assert_eq!(machine.pc(), 0x0800_0300);
        assert_ne!(machine.scb.cfsr & 1 << 12, 0, "STKERR");
    }

    #[test]
    fn a_supervisor_call_that_is_masked_is_a_hard_fault() {
        let mut machine = machine(&[(0x0800_0400, &[0xB672, 0xDF00])]); // cpsid i; svc 0
        steps(&mut machine, 2);
        assert_eq!(machine.cpu.exception, Exception::HARD_FAULT.number());
    }

    #[test]
    fn a_breakpoint_stops_only_with_a_debugger() {
        let mut machine = machine(&[(0x0800_0400, &[0xBE00])]);
        machine.set_debugger(true);
        assert_eq!(
            machine.run_until(100),
            Err(Stop::Breakpoint { pc: 0x0800_0400 })
        );
        machine.set_debugger(false);
        steps(&mut machine, 1);
        assert_eq!(machine.scb.hfsr, 1 << 31);
    }

    #[test]
    fn a_sleeping_core_wakes_for_an_interrupt_that_primask_holds_off() {
        let mut machine = machine(&[(0x0800_0400, &[0xB672, 0xBF30, 0xBF00, 0xE7FE])]); // cpsid i; wfi; nop; b .
        machine.run_until(1000).unwrap();
        assert_eq!(machine.pc(), 0x0800_0404);
        machine.nvic.pend(Exception::PEND_SV);
        machine.run_until(1020).unwrap();
        assert_eq!((machine.cpu.exception, machine.pc()), (0, 0x0800_0406));
        assert!(machine.slept() > 900);
    }
}
