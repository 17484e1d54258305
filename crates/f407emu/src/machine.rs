//! The chip as a whole, and the loop that runs it.
//!
//! Time is the count of HCLK cycles since power-on. The core carries out one instruction after the
//! other, and each advances the clock by its cost. Before each instruction, the events of
//! peripherals that are due happen at their own cycles.
use crate::{
    art::{Art, ArtStatistics},
    cpu::{Cpu, SP},
    devices::Devices,
    elf::{self, LoadError},
    instruction::Width,
    memory::{Memory, Region, Unfinished, FLASH},
    peripheral::{
        iwdg,
        nvic::{Exception, Nvic},
        rcc::{Clocks, ResetCause},
        scb::Scb,
    },
    record::{Cause, Duty, Edge, FlashOperation, Match, Pin, Profile, Profiler, Service, Tamper},
    timing::Timing,
    trap::{Stop, Trap},
    turns::{Spent, Turns},
    warning::{Warning, Warnings},
    world::World,
};
use std::collections::BTreeSet;

/// DBGMCU_IDCODE of an STM32F407 of revision Y (RM0090 section 38.6.1).
const IDCODE: u32 = 0x1007_6413;

/// The previous instruction's use of the memory: the next access may overlap it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum LastAccess {
    None,
    /// A load into this register.
    Load(u8),
    Store,
}

/// An STM32F407 with its firmware. A clone goes on from the same instant, so that a test can try
/// many continuations of one beginning.
#[derive(Clone)]
pub struct Machine {
    pub(crate) cpu: Cpu,
    pub(crate) nvic: Nvic,
    pub(crate) scb: Scb,
    pub(crate) memory: Memory,
    pub(crate) devices: Devices,
    pub(crate) art: Art,
    pub(crate) timing: Timing,
    pub(crate) cycle: u64,
    pub(crate) instructions: u64,
    /// Cycles that the core has slept.
    pub(crate) slept: u64,
    /// The cycle of the next event of a peripheral or of the world.
    pub(crate) next_event: u64,
    /// The frequencies that RCC sets.
    pub(crate) clocks: Clocks,
    pub(crate) last_access: LastAccess,
    /// The cycle at which the store buffer is empty again.
    pub(crate) buffer_free: u64,
    /// True if the program has requested a reset.
    pub(crate) reset_requested: bool,
    /// The core has locked up: the reason.
    pub(crate) locked: Option<Stop>,
    /// A stray access to a peripheral ([`Stop::Stray`]); it ends the run.
    pub(crate) stray: Option<Stop>,
    pub(crate) unfinished: Unfinished,
    pub(crate) debugger: bool,
    /// DBGMCU_APB1_FZ: the peripherals that stop while a debugger stops the core. Only a loss of
    /// power resets it.
    pub(crate) freeze_apb1: u32,
    /// The value of DBGMCU_IDCODE.
    pub(crate) idcode: u32,
    pub(crate) world: World,
    pub(crate) edges: Vec<Edge>,
    pub(crate) duties: Vec<Duty>,
    pub(crate) matches: Vec<Match>,
    /// The channels of each timer whose matches are recorded, one bit each.
    pub(crate) watched_channels: [u8; 14],
    /// The pins of each port whose edges are recorded, one bit each.
    pub(crate) watched: [u16; 9],
    /// The exception whose stores to peripherals are recorded, and the stores: address of the
    /// instruction, address of the register.
    pub(crate) writers_of: Option<Exception>,
    pub(crate) writers: BTreeSet<(u32, u32)>,
    pub(crate) flash_operations: Vec<FlashOperation>,
    /// The changes of words that the program writes to registers, by their addresses.
    pub(crate) tampers: Vec<(u32, Tamper)>,
    /// The delay that is planted: the exception and the address of the register before whose next
    /// store the core stands still, and the number of cycles.
    pub(crate) stall: Option<(Exception, u32, u64)>,
    pub(crate) resets: Vec<(u64, ResetCause)>,
    pub(crate) profiler: Profiler,
    pub(crate) turns: Turns,
    /// The cycles spent at each half-word of the flash; empty unless they are recorded.
    spent: Vec<u64>,
    pub(crate) warnings: Warnings,
}

impl Machine {
    /// Returns a chip with erased flash and a crystal of `crystal_hz`; 0 for no crystal.
    pub fn new(crystal_hz: u32) -> Box<Machine> {
        let devices = Devices::new(crystal_hz);
        let clocks = devices.rcc.clocks();
        Box::new(Machine {
            cpu: Cpu::default(),
            nvic: Nvic::new(),
            scb: Scb::new(),
            memory: Memory::new(),
            devices,
            art: Art::new(),
            timing: Timing::default(),
            cycle: 0,
            instructions: 0,
            slept: 0,
            next_event: 0,
            clocks,
            last_access: LastAccess::None,
            buffer_free: 0,
            reset_requested: false,
            locked: None,
            stray: None,
            unfinished: Unfinished::default(),
            debugger: false,
            freeze_apb1: 0,
            idcode: IDCODE,
            world: World::default(),
            edges: Vec::new(),
            duties: Vec::new(),
            matches: Vec::new(),
            watched_channels: [0; 14],
            watched: [u16::MAX; 9],
            writers_of: None,
            writers: BTreeSet::new(),
            flash_operations: Vec::new(),
            tampers: Vec::new(),
            stall: None,
            resets: Vec::new(),
            profiler: Profiler::new(),
            turns: Turns::default(),
            spent: Vec::new(),
            warnings: Warnings::default(),
        })
    }

    /// Makes it a chip with `kilobytes` of flash in place of 1024, before anything is loaded.
    pub fn set_flash_size(&mut self, kilobytes: u16) {
        self.memory.set_flash_size(kilobytes);
    }

    /// A chip whose peripherals all have running clocks.
    #[cfg(test)]
    pub(crate) fn with_clocks() -> Box<Machine> {
        let mut machine = Machine::new(8_000_000);
        machine.devices.rcc.switch_all_on();
        machine
    }

    /// Loads the segments of a 32-bit ELF at their physical addresses and starts the core at its
    /// reset vector.
    ///
    /// # Errors
    /// When the file is not an ELF for this chip.
    pub fn load_elf(&mut self, elf: &[u8]) -> Result<(), LoadError> {
        elf::load(&mut self.memory, elf)?;
        self.boot();
        Ok(())
    }

    /// Sets stack pointer and program counter from the vector table (DDI 0403, B1.5.5).
    pub(crate) fn boot(&mut self) {
        let word = |offset: usize| {
            let bytes = &self.memory.flash[offset..offset + 4];
            bytes
                .iter()
                .rev()
                .fold(0, |all, &byte| all << 8 | u32::from(byte))
        };
        let (stack, start) = (word(0), word(4));
        self.cpu.r[SP] = stack & !3;
        self.cpu.next = start & !1;
        self.update_clocks(self.cycle);
        let cycle = self.cycle;
        self.update_all_pins(cycle, Cause::Reset);
    }

    /// Runs until the clock reaches `cycle`; the core finishes its instruction.
    ///
    /// # Errors
    /// When the core locks up and no watchdog is running, at a breakpoint with a debugger, and
    /// when an access to a peripheral goes astray.
    pub fn run_until(&mut self, cycle: u64) -> Result<(), Stop> {
        while self.cycle < cycle {
            if self.locked.is_some() {
                self.wait_locked(cycle)?;
            } else if self.cpu.asleep {
                self.end_turn();
                self.sleep(cycle);
            } else {
                self.step()?;
            }
        }
        Ok(())
    }

    /// One instruction, after the events and the exception that are due before it.
    #[inline(always)]
    pub(crate) fn step(&mut self) -> Result<(), Stop> {
        if self.cycle >= self.next_event {
            self.run_events();
        }
        if self.cycle < self.devices.flash.busy_until && self.needs_flash() {
            self.cycle = self.devices.flash.busy_until.min(self.next_event);
            return Ok(());
        }
        let before = self.cycle;
        if self.nvic.changed {
            self.take_pending()?;
        }
        let (address, it) = (self.cpu.next, self.cpu.it);
        let carried_out = self.carry_out(address).or_else(|trap| {
            self.cpu.it = it;
            self.fault(trap, address)
        });
        let place = address.wrapping_sub(FLASH) as usize / 2;
        if let Some(spent) = self.spent.get_mut(place) {
            *spent += self.cycle - before;
        }
        match self.stray.take() {
            Some(stop) => Err(stop),
            None => carried_out,
        }
    }

    /// Returns true if the next instruction, or the vector of an interrupt, must be read from the
    /// flash.
    fn needs_flash(&self) -> bool {
        let in_flash = |address: u32| {
            let place = self.memory.place(address);
            place.is_none_or(|(region, _)| region == Region::Flash)
        };
        in_flash(self.cpu.next) || (self.nvic.changed && in_flash(self.scb.vtor))
    }

    #[inline(always)]
    fn carry_out(&mut self, address: u32) -> Result<(), Trap> {
        let decoded = self.fetch(address)?;
        self.cpu.r[15] = address.wrapping_add(4);
        self.cpu.next = address.wrapping_add(u32::from(decoded.length));
        self.instructions += 1;
        self.cpu.in_it = self.cpu.it != 0;
        if self.cpu.in_it && !self.cpu.passes_it() {
            self.spend(1);
            return Ok(());
        }
        self.execute(decoded.instruction)
    }

    /// Charges the cycles of an instruction which the next access cannot overlap.
    #[inline(always)]
    pub(crate) fn spend(&mut self, cycles: u32) {
        self.last_access = LastAccess::None;
        self.cycle += u64::from(cycles);
    }

    /// Goes on to the next event that may wake the core; PRIMASK does not keep it asleep (DDI 0403,
    /// B1.5.19).
    fn sleep(&mut self, limit: u64) {
        let mut masks = self.cpu.masks;
        masks.primask = false;
        let woken = self.nvic.next(masks).is_some() || self.reset_requested;
        if woken {
            self.cpu.asleep = false;
            return;
        }
        let until = self.next_event.min(limit).max(self.cycle);
        self.slept += until - self.cycle;
        self.cycle = until;
        if self.cycle >= self.next_event {
            self.run_events();
        }
    }

    /// Lets a core that has locked up wait for the watchdog.
    fn wait_locked(&mut self, limit: u64) -> Result<(), Stop> {
        if let (Some(stop), false) = (self.locked, self.devices.iwdg.is_running()) {
            return Err(stop);
        }
        self.cycle = self.next_event.min(limit).max(self.cycle);
        if self.cycle >= self.next_event {
            self.run_events();
        }
        Ok(())
    }

    /// Returns the cycle that the clock has reached.
    pub fn cycle(&self) -> u64 {
        self.cycle
    }

    /// Returns the number of instructions carried out since power-on.
    pub fn instructions(&self) -> u64 {
        self.instructions
    }

    /// Cycles that the core has slept.
    pub fn slept(&self) -> u64 {
        self.slept
    }

    /// Address of the next instruction.
    pub fn pc(&self) -> u32 {
        self.cpu.next
    }

    /// Returns the frequencies that the firmware has set.
    pub fn clocks(&self) -> Clocks {
        self.clocks
    }

    /// Returns the cycle model's constants, which may be changed at any time.
    pub fn timing_mut(&mut self) -> &mut Timing {
        &mut self.timing
    }

    /// Makes the chip say that it is another one: its device number, of 12 bits (RM0090 section
    /// 38.6.1). Nothing else of the chip changes.
    pub fn set_device_number(&mut self, number: u16) {
        self.idcode = IDCODE & !0xFFF | u32::from(number & 0xFFF);
    }

    /// With a debugger a breakpoint instruction ends the run; without one it is a HardFault.
    pub fn set_debugger(&mut self, attached: bool) {
        self.debugger = attached;
    }

    /// Stops the core for a number of cycles, as a debugger does. Everything else goes on;
    /// DBGMCU_APB1_FZ says whether the watchdog does (RM0090 section 38.16.4). Ends early if the
    /// watchdog resets the chip. Not modelled: the other peripherals that this register stops.
    pub fn halt(&mut self, cycles: u64) {
        if self.freeze_apb1 & iwdg::DBG_STOP != 0 {
            self.devices.iwdg.stand_still(cycles);
            self.reschedule();
        }
        let (end, resets) = (self.cycle + cycles, self.resets.len());
        while self.cycle < end && self.resets.len() == resets {
            self.cycle = self.next_event.min(end).max(self.cycle);
            if self.cycle >= self.next_event {
                self.run_events();
            }
        }
    }

    /// Returns the word in a register of a peripheral or of the core, as a debugger reads it.
    pub fn peek(&mut self, register: u32) -> u32 {
        match register {
            0xE000_0000.. => self.private_read(register),
            _ => self.register_read(register, self.cycle),
        }
    }

    /// Edges of watched pins since the last [`Machine::clear_records`], in order.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Takes the edges out of the records, for runs whose edges would fill the memory.
    pub fn take_edges(&mut self) -> Vec<Edge> {
        core::mem::take(&mut self.edges)
    }

    /// Takes the matches out of the records.
    pub fn take_matches(&mut self) -> Vec<Match> {
        core::mem::take(&mut self.matches)
    }

    /// Edges of one pin.
    pub fn edges_of(&self, pin: Pin) -> impl Iterator<Item = &Edge> {
        self.edges.iter().filter(move |edge| edge.pin == pin)
    }

    /// Changes of PWM since the last [`Machine::clear_records`], in order.
    pub fn duties(&self) -> &[Duty] {
        &self.duties
    }

    /// Matches of watched channels ([`Machine::watch_channel`]) since the last
    /// [`Machine::clear_records`], in order.
    pub fn matches(&self) -> &[Match] {
        &self.matches
    }

    /// Operations of the flash since the last [`Machine::clear_records`], in order.
    pub fn flash_operations(&self) -> &[FlashOperation] {
        &self.flash_operations
    }

    /// Plants a fault: from now on `tamper` changes each word that the program writes to the
    /// register at `address`, or drops it.
    pub fn tamper_with(&mut self, address: u32, tamper: Tamper) {
        self.tampers.push((address, tamper));
    }

    /// Plants a delay: the core stands still once, for some cycles, before the next store that
    /// `exception`'s handler makes to the register at `address`.
    pub fn stall_before(&mut self, exception: Exception, address: u32, cycles: u64) {
        self.stall = Some((exception, address, cycles));
    }

    /// Returns true if a planted delay has still to come.
    pub fn is_stall_planted(&self) -> bool {
        self.stall.is_some()
    }

    /// Returns true if the core sleeps.
    pub fn is_asleep(&self) -> bool {
        self.cpu.asleep
    }

    /// Returns the resets so far, with their cycles.
    pub fn resets(&self) -> &[(u64, ResetCause)] {
        &self.resets
    }

    /// Returns the statistics of an exception.
    pub fn profile(&self, exception: Exception) -> &Profile {
        self.profiler.profile(exception)
    }

    /// Adds up, from now on, the cycles that each instruction of the flash takes. The entry into an
    /// exception counts for its first instruction.
    pub fn record_cycles(&mut self) {
        self.spent = vec![0; self.memory.flash.len() / 2];
    }

    /// Returns the cycles of each half-word of the flash since [`Machine::record_cycles`]; empty
    /// without that call.
    pub fn cycles_spent(&self) -> &[u64] {
        &self.spent
    }

    /// Records every service of every exception from now on.
    pub fn record_services(&mut self) {
        self.profiler.services = Some(Vec::new());
    }

    /// Records from now on which instructions of an exception's handler store to peripherals.
    pub fn record_writers(&mut self, exception: Exception) {
        self.writers_of = Some(exception);
    }

    /// Returns the stores recorded since [`Machine::record_writers`]: the address of the
    /// instruction and the address of the register.
    pub fn writers(&self) -> &BTreeSet<(u32, u32)> {
        &self.writers
    }

    /// Returns the services recorded since [`Machine::record_services`]; empty without that call.
    pub fn services(&self) -> &[Service] {
        self.profiler.services.as_deref().unwrap_or(&[])
    }

    /// Actions of the program that would not work as intended on the chip.
    pub fn warnings(&self) -> &[Warning] {
        self.warnings.all()
    }

    /// Returns how often the ART accelerator held a line, and how often the flash had to be read.
    pub fn art_statistics(&self) -> ArtStatistics {
        self.art.statistics
    }

    /// Forgets edges, changes of PWM, matches, operations of the flash, statistics and services;
    /// the state of the chip stays.
    pub fn clear_records(&mut self) {
        self.edges.clear();
        self.duties.clear();
        self.matches.clear();
        self.flash_operations.clear();
        self.profiler.clear();
        if let Some(services) = &mut self.profiler.services {
            services.clear();
        }
    }

    /// Returns the flash's content; its first byte is at 0x08000000.
    pub fn flash(&self) -> &[u8] {
        &self.memory.flash
    }

    /// Changes the flash's content, as a programmer outside the chip does.
    ///
    /// # Panics
    /// When the bytes do not fit behind `address`.
    pub fn program_flash(&mut self, address: u32, bytes: &[u8]) {
        let offset = address.wrapping_sub(FLASH) as usize;
        let loaded = self.memory.load(offset, bytes);
        assert!(loaded.is_some(), "{address:#010x} is not in the flash");
    }

    /// Changes RAM as a debugger does: at the addresses that the core sees.
    ///
    /// # Panics
    /// If there is no RAM.
    pub fn poke(&mut self, address: u32, bytes: &[u8]) {
        for (address, byte) in (address..).zip(bytes) {
            let place = self.memory.place(address);
            let written =
                place.and_then(|place| self.memory.write(place, Width::Byte, u32::from(*byte)));
            assert!(written.is_some(), "{address:#010x} is not in RAM");
        }
    }

    /// Returns the content of SRAM1 and SRAM2; its first byte is at 0x20000000.
    pub fn sram(&self) -> &[u8] {
        &self.memory.sram[..]
    }

    /// Turns of the main loop since power-on.
    pub fn turns(&self) -> Turns {
        self.turns
    }

    /// The watchdog is fed: a turn of the main loop begins.
    pub(crate) fn begin_turn(&mut self) {
        self.turns.begin(self.spent_outside_exceptions());
    }

    /// The core has fallen asleep: a turn of the main loop ends.
    pub(crate) fn end_turn(&mut self) {
        self.turns.end(self.spent_outside_exceptions());
    }

    fn spent_outside_exceptions(&self) -> Spent {
        Spent {
            cycles: self.cycle - self.profiler.cycles,
            instructions: self.instructions - self.profiler.instructions,
        }
    }
}
