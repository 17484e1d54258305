//! Resets (RM0090 section 7.1), and the memories after a loss of power.
use crate::{
    art::Art,
    cpu::Cpu,
    machine::Machine,
    memory::{Low, Unfinished, FLASH},
    peripheral::{
        nvic::Nvic,
        rcc::{resets, ResetCause},
        scb::Scb,
    },
    record::Cause,
};
use core::ops::Range;

/// The base address of SYSCFG, which maps a memory to address 0.
const SYSCFG: u32 = 0x4001_3800;

impl Machine {
    /// Stores the contents that an operation of the flash is about to change.
    pub(crate) fn remember(&mut self, range: Range<usize>) {
        self.unfinished = Unfinished {
            before: self.memory.flash[range.clone()].to_vec(),
            range,
        };
    }

    /// Resets the chip. Pins fall back to inputs at `cycle`. RAM survives all resets but a loss of
    /// power.
    pub(crate) fn restart(&mut self, cause: ResetCause, cycle: u64) {
        let mut noise = Noise(cycle | 1);
        self.leave_unfinished(cycle, &mut noise);
        match cause {
            ResetCause::PowerOn => self.lose_power(&mut noise),
            ResetCause::Pin
            | ResetCause::Software
            | ResetCause::Watchdog
            | ResetCause::BrownOut => {}
        }
        self.resets.push((cycle, cause));
        self.cpu = Cpu::default();
        self.nvic = Nvic::new();
        self.scb = Scb::new();
        self.devices.reset(cause, cycle);
        self.art = Art::new();
        self.memory.low = Low::Flash;
        self.profiler.abandon();
        self.buffer_free = cycle;
        self.reset_requested = false;
        self.locked = None;
        self.functions_changed(cycle);
        self.update_all_pins(cycle, Cause::Reset);
        self.boot();
    }

    /// A write of `value` to RCC's register at `offset` (RM0090 sections 7.3.5 to 7.3.9): resets the
    /// peripherals whose bits are set. Pins that they drove go back to the port.
    pub(crate) fn reset_peripherals(&mut self, offset: u32, value: u32, now: u64) {
        if !(0x10..0x28).contains(&offset) || value == 0 {
            return;
        }
        self.devices
            .reset_some(|base| resets(offset, value, base), now);
        if resets(offset, value, SYSCFG) {
            self.memory.low = Low::Flash;
        }
        self.functions_changed(now);
        self.update_all_pins(now, Cause::Reset);
        for index in 0..self.devices.timers.len() {
            self.update_timer_lines(index);
        }
        for index in 0..self.devices.usarts.len() {
            self.usart_changed(index);
        }
        for (index, stream) in (0..2).flat_map(|index| (0..8).map(move |stream| (index, stream))) {
            self.dma_changed(index, stream);
        }
        self.usb_changed();
    }

    /// A reset during an operation of the flash, after which its content is not guaranteed (RM0090
    /// section 3.6). Of a unit being programmed some bits have been cleared, and of a sector being
    /// erased some bits have been set. The choice is noise that is the same in every run.
    fn leave_unfinished(&mut self, cycle: u64, noise: &mut Noise) {
        if cycle < self.devices.flash.busy_until {
            let Unfinished { range, before } = core::mem::take(&mut self.unfinished);
            let after = &self.memory.flash[range.clone()];
            let mixed: Vec<u8> = before
                .iter()
                .zip(after)
                .map(|(&before, &after)| before ^ (before ^ after) & noise.byte())
                .collect();
            self.program_flash(FLASH + range.start as u32, &mixed);
        }
    }

    /// RAM comes up with random contents.
    fn lose_power(&mut self, noise: &mut Noise) {
        self.freeze_apb1 = 0;
        self.memory.sram.fill_with(|| noise.byte());
        self.memory.ccm.fill_with(|| noise.byte());
    }
}

/// A pseudo-random generator, Marsaglia's xorshift.
struct Noise(u64);

impl Noise {
    fn byte(&mut self) -> u8 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 32) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        instruction::Width,
        peripheral::nvic::Exception,
        trap::{Stop, Stray},
    };

    fn unlocked() -> Box<Machine> {
        let mut machine = Machine::new(8_000_000);
        for key in [0x4567_0123, 0xCDEF_89AB] {
            machine.write_word(0x4002_3C04, key).unwrap();
        }
        machine
    }

    #[test]
    fn a_smaller_chip_has_no_upper_sectors() {
        let mut machine = unlocked();
        machine.set_flash_size(512);
        machine
            .write_word(0x4002_3C10, 1 << 16 | 10 << 3 | 2 | 2 << 8)
            .unwrap();
        assert_eq!(machine.warnings(), [crate::Warning::NoSuchSector]);
        let address = 0x080C_0000;
        let nothing = Err(crate::Trap::Bus { address });
        assert_eq!(machine.read_word(address), nothing);
        assert_eq!(machine.write_word(address, 0), nothing.map(|_| ()));
    }

    #[test]
    fn the_control_register_keeps_the_bus_while_the_flash_is_busy() {
        let mut machine = unlocked();
        machine.write_word(0x4002_3C10, 1 | 2 << 8).unwrap();
        machine.write_word(0x0800_4000, 0).unwrap();
        let done = machine.devices.flash.busy_until;
        assert!(machine.cycle() < done);
        machine.write_word(0x4002_3C10, 1 << 31).unwrap();
        assert_eq!(machine.cycle(), done);
    }

    #[test]
    fn a_wrong_key_for_the_flash_ends_the_run() {
        let mut machine = Machine::new(8_000_000);
        machine.write_word(0x4002_3C04, 1).unwrap();
        let stop = machine.stray.take();
        assert!(matches!(
            stop,
            Some(Stop::Stray {
                stray: Stray::WrongKey,
                ..
            })
        ));
    }

    #[test]
    fn power_lost_while_a_word_is_programmed_clears_some_of_its_bits() {
        let mut machine = unlocked();
        machine.write_word(0x4002_3C10, 1 | 2 << 8).unwrap();
        machine.write_word(0x0800_4000, 0).unwrap();
        machine.restart(ResetCause::PowerOn, machine.cycle() + 10);
        let word = machine.read(0x0800_4000, Width::Word).unwrap();
        assert!(word != 0 && word != u32::MAX, "{word:#x}");
    }

    #[test]
    fn any_reset_in_an_operation_leaves_something_in_between() {
        let mut machine = unlocked();
        machine.write_word(0x4002_3C10, 1 | 2 << 8).unwrap();
        machine.write_word(0x0800_4000, 0).unwrap();
        let operation = machine.flash_operations()[0];
        assert_eq!((operation.address, operation.erases), (0x0800_4000, false));
        assert_eq!(operation.end - operation.begin, 256); // 16 us at 16 MHz
        machine.restart(ResetCause::Watchdog, operation.end - 1);
        let word = machine.read(0x0800_4000, Width::Word).unwrap();
        assert!(word != 0 && word != u32::MAX, "{word:#x}");
    }

    #[test]
    fn power_lost_after_the_operation_changes_nothing_more() {
        let mut machine = unlocked();
        machine.write_word(0x4002_3C10, 1 | 2 << 8).unwrap();
        machine.write_word(0x0800_4000, 0x1234).unwrap();
        let done = machine.devices.flash.busy_until;
        machine.restart(ResetCause::PowerOn, done);
        assert_eq!(machine.read_word(0x0800_4000), Ok(0x1234));
    }

    #[test]
    fn ram_survives_a_reset_and_not_a_loss_of_power() {
        let mut machine = Machine::new(8_000_000);
        machine.write_word(0x2000_0100, 0x5AFE).unwrap();
        machine.restart(ResetCause::Watchdog, 5);
        assert_eq!(machine.read_word(0x2000_0100), Ok(0x5AFE));
        machine.restart(ResetCause::PowerOn, 6);
        assert_ne!(machine.read_word(0x2000_0100), Ok(0x5AFE));
        assert_eq!(machine.resets().len(), 2);
    }

    #[test]
    fn a_peripheral_is_reset_by_its_bit_alone() {
        const TIM2_ARR: u32 = 0x4000_002C;
        const TIM3_ARR: u32 = 0x4000_042C;
        const APB1RSTR: u32 = 0x4002_3820;
        let mut machine = Machine::with_clocks();
        for (address, value) in [
            (TIM2_ARR, 99),
            (TIM3_ARR, 99),
            (TIM2_ARR - 0x20, 1),
            (TIM2_ARR - 0x18, 1),
            (APB1RSTR, 1),
        ] {
            machine.write_word(address, value).unwrap();
        }
        assert!(machine.nvic.is_pending(Exception::irq(28)));
        machine.read_word(TIM2_ARR).unwrap();
        let held = machine.stray.take();
        assert!(matches!(
            held,
            Some(Stop::Stray {
                stray: Stray::InReset,
                ..
            })
        ));
        machine.write_word(APB1RSTR, 0).unwrap();
        assert_eq!(machine.read_word(TIM2_ARR), Ok(u32::MAX));
        assert_eq!(machine.read_word(TIM3_ARR), Ok(99));
        assert_eq!(machine.stray, None);
    }

    #[test]
    fn the_reset_of_a_port_gives_up_its_pins() {
        const PORT_E: u32 = 0x4002_1000;
        const AHB1RSTR: u32 = 0x4002_3810;
        let mut machine = Machine::with_clocks();
        for (address, value) in [(PORT_E, 1), (PORT_E + 0x18, 1), (AHB1RSTR, 1 << 4)] {
            machine.write_word(address, value).unwrap();
        }
        let pin = crate::record::Pin::new('E', 0);
        assert!(!machine.level(pin) && !machine.drives(pin));
    }

    #[test]
    fn pins_fall_back_to_inputs() {
        let mut machine = Machine::with_clocks();
        machine.write_word(0x4002_1000, 1).unwrap();
        machine.write_word(0x4002_1018, 1).unwrap();
        machine.restart(ResetCause::Software, 50);
        let last = machine.edges().last().unwrap();
        assert_eq!(
            (last.cycle, last.level, last.cause),
            (50, false, Cause::Reset)
        );
    }
}
