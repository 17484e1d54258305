//! The memory behind each address (RM0090 section 2.3), and the time of an access.
use crate::{
    cpu::PC,
    instruction::Width,
    machine::Machine,
    memory::{Low, Region, SRAM, SRAM1_SIZE},
    peripheral::bitband,
    record::Cause,
    timing::FlashTiming,
    trap::Trap,
    warning::Warning,
};

impl Machine {
    /// Reads a word.
    #[inline(always)]
    pub(crate) fn read_word(&mut self, address: u32) -> Result<u32, Trap> {
        match self.memory.sram_word(address) {
            Some(word) => {
                self.share_sram(address.wrapping_sub(SRAM));
                Ok(word)
            }
            None => self.read(address, Width::Word),
        }
    }

    /// Writes a word.
    #[inline(always)]
    pub(crate) fn write_word(&mut self, address: u32, value: u32) -> Result<(), Trap> {
        self.write(address, Width::Word, value)
    }

    /// Reads a value, zero-extended.
    pub(crate) fn read(&mut self, address: u32, width: Width) -> Result<u32, Trap> {
        if let Some(place) = self.memory.place(address) {
            match place.0 {
                Region::Flash => self.wait_for_constant(address),
                Region::Sram => self.share_sram(place.1 as u32),
                Region::Ccm | Region::Signature | Region::System => {}
            }
            let value = self.memory.read(place, width);
            return value.ok_or(Trap::Bus { address });
        }
        if let Some(bit) = bitband::bit(address) {
            return Ok(bit.of(self.read(bit.word, Width::Word)?));
        }
        match address {
            0x4000_0000..=0x5FFF_FFFF => self.read_peripheral(address, width),
            0xE000_0000..=0xE00F_FFFF => {
                let word = self.private_read(address & !3);
                Ok(word >> (8 * (address & 3)) & width.mask())
            }
            _ => Err(Trap::Bus { address }),
        }
    }

    /// Writes a value's lower bits.
    #[inline(always)]
    pub(crate) fn write(&mut self, address: u32, width: Width, value: u32) -> Result<(), Trap> {
        match self.memory.place(address) {
            Some((Region::Flash, offset)) => {
                self.program(offset, width, value);
                Ok(())
            }
            Some(place) => {
                if place.0 == Region::Sram {
                    self.share_sram(place.1 as u32);
                }
                let written = self.memory.write(place, width, value);
                written.ok_or(Trap::Bus { address })
            }
            None => self.write_elsewhere(address, width, value),
        }
    }

    /// Charges an access to SRAM1, at an offset in SRAM, while the core fetches its instructions
    /// from the same memory. Both buses then meet at one slave of the bus matrix (RM0090 section
    /// 2.1), and one of them waits a cycle. The prefetch unit would hide some of these cycles, so
    /// that a cycle for each access is an upper bound.
    #[inline(always)]
    fn share_sram(&mut self, offset: u32) {
        let executes_low = self.cpu.r[PC] < SRAM1_SIZE;
        if executes_low && offset < SRAM1_SIZE && self.memory.low == Low::Sram1 {
            self.cycle += 1;
        }
    }

    fn write_elsewhere(&mut self, address: u32, width: Width, value: u32) -> Result<(), Trap> {
        if let Some(bit) = bitband::bit(address) {
            let word = self.read(bit.word, Width::Word)?;
            return self.write(bit.word, Width::Word, bit.set(word, value));
        }
        match address {
            0x4000_0000..=0x5FFF_FFFF => self.write_peripheral(address, width, value),
            0xE000_0000..=0xE00F_FFFF => {
                self.private_write(address, width, value);
                Ok(())
            }
            _ => Err(Trap::Bus { address }),
        }
    }

    /// Reads a peripheral. The read waits for the store buffer, and for the bridge to a slower bus.
    fn read_peripheral(&mut self, address: u32, width: Width) -> Result<u32, Trap> {
        must_align(address, width)?;
        self.drain_stores();
        let word = self.register_read(address & !3, self.cycle);
        self.cycle += u64::from(self.bus_latency(address));
        Ok(word >> (8 * (address & 3)) & width.mask())
    }

    /// Writes a peripheral through the store buffer: this write does not wait, but the next access
    /// to a peripheral does.
    fn write_peripheral(&mut self, address: u32, width: Width, value: u32) -> Result<(), Trap> {
        must_align(address, width)?;
        self.stall_as_planted(address);
        self.drain_stores();
        self.buffer_free = self.cycle + 1 + u64::from(self.bus_latency(address));
        let current = self.cpu.current();
        if self
            .writers_of
            .is_some_and(|of| of.number() == self.cpu.exception)
        {
            self.writers.insert((current, address));
        }
        let cause = Cause::Core(current);
        self.write_part(address, width, value, self.cycle, cause);
        Ok(())
    }

    fn stall_as_planted(&mut self, address: u32) {
        if let Some((exception, register, cycles)) = self.stall {
            if exception.number() == self.cpu.exception && register == address {
                self.stall = None;
                self.cycle += cycles;
            }
        }
    }

    /// Writes a part of a register. The bridges to APB repeat that part over the whole register
    /// (RM0090 section 2.1.11). On AHB the other bits keep their value, or are zero in a write-only
    /// register.
    pub(crate) fn write_part(
        &mut self,
        address: u32,
        width: Width,
        value: u32,
        cycle: u64,
        cause: Cause,
    ) {
        let (word, shift) = (address & !3, 8 * (address & 3));
        let mask = width.mask() << shift;
        let written = if word < 0x4002_0000 {
            let part = value & width.mask();
            part * (u32::MAX / width.mask())
        } else if width == Width::Word || is_write_only(word) {
            value << shift & mask
        } else {
            self.register_read(word, cycle) & !mask | value << shift & mask
        };
        self.register_write(word, written, mask, cycle, cause);
    }

    /// Waits until the store buffer is empty.
    pub(crate) fn drain_stores(&mut self) {
        self.cycle = self.cycle.max(self.buffer_free);
    }

    /// Waits until the clocks that have been switched on are running, as DSB is said to do (ES0182,
    /// "Delay after an RCC peripheral clock enabling", workaround 1).
    pub(crate) fn wait_for_clocks(&mut self) {
        self.cycle = self.cycle.max(self.devices.rcc.clocks_come_at());
    }

    /// The cycles that a bus bridge adds: AHB has no bridge, and the APBs have clocks of their own.
    fn bus_latency(&self, address: u32) -> u32 {
        match address {
            0x4002_0000.. => 0,
            0x4001_0000.. => self.timing.apb_clocks * self.clocks.apb2,
            _ => self.timing.apb_clocks * self.clocks.apb1,
        }
    }

    fn program(&mut self, offset: usize, width: Width, value: u32) {
        self.cycle = self.cycle.max(self.devices.flash.busy_until);
        let time = (self.cycle, self.clocks.hclk);
        let micros = self.timing.program_us;
        let flash = &mut self.devices.flash;
        if flash.program(width, micros, time, &mut self.warnings) {
            self.remember(offset..offset + width.bytes());
            self.memory.program(offset, width, value);
            self.record_flash_operation(self.cycle, offset, false);
            self.reschedule();
        }
    }

    /// Waits until the flash has delivered a constant.
    fn wait_for_constant(&mut self, address: u32) {
        self.cycle = self.cycle.max(self.devices.flash.busy_until);
        if self.timing.flash != FlashTiming::ZeroWait {
            self.cycle += self.art.read(address, self.devices.flash.acr);
            self.tell_stale_use();
        }
    }

    /// Warns if the program has read old content of the flash from a cache.
    pub(crate) fn tell_stale_use(&mut self) {
        if self.art.take_stale_use() {
            self.warnings.add(Warning::StaleCache);
        }
    }
}

/// Fails if an access is not aligned: peripherals answer to aligned accesses only.
fn must_align(address: u32, width: Width) -> Result<(), Trap> {
    if address as usize & (width.bytes() - 1) == 0 {
        Ok(())
    } else {
        Err(Trap::Unaligned { address })
    }
}

/// Returns true if a register is GPIOx_BSRR. It is write-only, so that a write of a part of it must
/// not read the other bits first.
fn is_write_only(address: u32) -> bool {
    (0x4002_0000..0x4002_2400).contains(&address) && address & 0x3FF == 0x18
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        peripheral::nvic::Exception,
        trap::{Stop, Stray},
    };

    #[test]
    fn half_of_a_set_reset_register_can_be_written_alone() {
        let mut machine = Machine::with_clocks();
        machine.write_word(0x4002_0000, 0x5555_5555).unwrap();
        machine.write(0x4002_0018, Width::Half, 0b11).unwrap();
        machine.write(0x4002_001A, Width::Half, 0b01).unwrap();
        assert_eq!(machine.read(0x4002_0014, Width::Word), Ok(0b10));
    }

    #[test]
    fn a_part_of_a_register_behind_a_bridge_is_written_to_all_of_it() {
        const TIM2_CCR1: u32 = 0x4000_0034;
        let mut machine = Machine::with_clocks();
        let mut after = |address, width, value| {
            machine.write_word(TIM2_CCR1, 0).unwrap();
            machine.write(address, width, value).unwrap();
            machine.read_word(TIM2_CCR1).unwrap()
        };
        assert_eq!(after(TIM2_CCR1, Width::Half, 0x1234), 0x1234_1234);
        assert_eq!(after(TIM2_CCR1 + 2, Width::Half, 0x1234), 0x1234_1234);
        assert_eq!(after(TIM2_CCR1 + 1, Width::Byte, 0xAB), 0xABAB_ABAB);
    }

    #[test]
    fn the_stores_of_an_exception_are_recorded_and_no_others() {
        let mut machine = Machine::with_clocks();
        machine.record_writers(Exception::irq(28));
        machine.cpu.exception = Exception::irq(28).number();
        machine.cpu.r[15] = 0x0800_1004;
        machine.write_word(0x4002_0018, 1).unwrap();
        machine.write_word(0x2000_0000, 1).unwrap();
        let stores: Vec<_> = machine.writers().iter().copied().collect();
        assert_eq!(stores, [(0x0800_1000, 0x4002_0018)]);
    }

    #[test]
    fn a_clock_enable_is_set_through_its_bit_alias() {
        let mut machine = Machine::new(8_000_000);
        machine
            .write_word(0x4200_0000 + 0x23830 * 32 + 3 * 4, 1)
            .unwrap();
        assert_eq!(machine.read_word(0x4002_3830), Ok(0x0010_0008));
    }

    fn stray(machine: &mut Machine) -> Option<Stray> {
        match machine.stray.take() {
            Some(Stop::Stray { stray, .. }) => Some(stray),
            _ => None,
        }
    }

    #[test]
    fn an_access_to_a_peripheral_without_its_clock_ends_the_run() {
        let mut machine = Machine::new(8_000_000);
        assert_eq!(machine.read_word(0x4002_0000), Ok(0));
        assert_eq!(stray(&mut machine), Some(Stray::ClockOff));
        machine.write_word(0x4002_0000, 1).unwrap();
        assert_eq!(stray(&mut machine), Some(Stray::ClockOff));
    }

    #[test]
    fn a_store_right_after_its_clock_was_switched_on_ends_the_run() {
        let mut machine = Machine::new(8_000_000);
        machine.write_word(0x4002_3840, 1 << 2).unwrap(); // TIM4
        machine.cycle += 2;
        machine.write_word(0x4000_0828, 1).unwrap();
        assert_eq!(stray(&mut machine), Some(Stray::ClockTooFresh { left: 1 }));
        machine.write_word(0x4000_0828, 1).unwrap();
        assert_eq!(stray(&mut machine), None);
    }

    #[test]
    fn a_barrier_waits_until_clocks_have_come() {
        let mut machine = Machine::new(8_000_000);
        machine.clocks.apb1 = 4;
        machine
            .devices
            .rcc
            .write(0x08, 5 << 10, 0, &mut Default::default());
        machine.write_word(0x4002_3840, 1 << 2).unwrap();
        machine.wait_for_clocks();
        machine.write_word(0x4000_0828, 1).unwrap();
        assert_eq!((stray(&mut machine), machine.cycle), (None, 6));
    }

    #[test]
    fn a_planted_delay_comes_once_before_the_store_of_its_handler() {
        let mut machine = Machine::with_clocks();
        machine.stall_before(Exception::irq(28), 0x4002_0018, 100);
        machine.write_word(0x4002_0018, 1).unwrap();
        assert!(machine.is_stall_planted() && machine.cycle < 100);
        machine.cpu.exception = Exception::irq(28).number();
        machine.write_word(0x4002_0018, 1).unwrap();
        assert!(!machine.is_stall_planted() && machine.cycle >= 100);
    }

    #[test]
    fn reserved_bits_have_to_stay() {
        let mut machine = Machine::with_clocks();
        machine.write_word(0x4002_0004, 1 << 16).unwrap();
        let reserved = Stray::Reserved {
            value: 1 << 16,
            bits: 0xFFFF_0000,
        };
        assert_eq!(stray(&mut machine), Some(reserved));
        machine.write(0x4002_0004, Width::Half, 1).unwrap();
        assert_eq!(stray(&mut machine), None);
        machine.write_word(0x4002_0010, 0).unwrap();
        assert_eq!(stray(&mut machine), Some(Stray::ReadOnly));
        machine.write_word(0x4002_0028, 0).unwrap();
        assert_eq!(stray(&mut machine), Some(Stray::NoRegister));
    }

    #[test]
    fn a_read_of_a_slow_bus_costs_its_clocks_and_waits_for_the_write_before() {
        let mut machine = Machine::with_clocks();
        machine.clocks.apb1 = 4;
        machine.cycle = 100;
        machine.buffer_free = 0;
        machine.write_word(0x4000_0034, 5).unwrap();
        assert_eq!(machine.cycle, 100);
        machine.read_word(0x4000_0034).unwrap();
        assert_eq!(machine.cycle, 100 + 1 + 8 + 8);
    }

    #[test]
    fn data_beside_the_code_in_sram1_costs_a_cycle_and_data_elsewhere_none() {
        let mut machine = Machine::new(8_000_000);
        machine.devices.rcc.switch_all_on();
        machine.write_word(0x4001_3800, 3).unwrap(); // MEMRMP: SRAM1 at 0
        machine.buffer_free = 0;
        let mut cost = |pc: u32, address: u32| {
            let before = machine.cycle;
            machine.cpu.r[15] = pc;
            machine.write_word(address, 5).unwrap();
            assert_eq!(machine.read_word(address), Ok(5));
            machine.cycle - before
        };
        assert_eq!(cost(0x0000_0204, 0x2000_1000), 2);
        assert_eq!(cost(0x0000_0204, 0x0000_1000), 2);
        assert_eq!(cost(0x0000_0204, 0x2001_C000), 0, "SRAM2");
        assert_eq!(cost(0x0000_0204, 0x1000_0000), 0, "CCM");
        assert_eq!(cost(0x0800_0204, 0x2000_1000), 0, "code in the flash");
    }

    #[test]
    fn nothing_answers_beyond_the_memories() {
        let mut machine = Machine::new(8_000_000);
        let address = 0x2002_0000;
        assert_eq!(machine.read_word(address), Err(Trap::Bus { address }));
        assert_eq!(machine.write_word(address, 0), Err(Trap::Bus { address }));
        let address = 0x4002_3831;
        assert_eq!(machine.read_word(address), Err(Trap::Unaligned { address }));
    }
}
