//! Plays, from outside, the parts of the chip that QEMU's F405 lacks, while the program waits.
//!
//! | part | here |
//! |---|---|
//! | RCC's ready bits | follow the bits that ask for them; the crystal stays away, for QEMU has no USB |
//! | SRAM1 at address 0 | vectors and step interrupts are in the bootloader's place, which QEMU has at 0 |
//! | DMA of the serial line | bytes are carried between its memory and QEMU's USART |
//! | TIM2's compare | the counter is set to the instant, and the interrupt pended |
//! | TIM7 | its interrupt is pended when a byte has come |
//! | TIM5 | its counter is set; its compare wakes nobody |
//! | TIM11 | a pulse has no end |
//! | pins | outputs are read off QEMU's log, inputs are high |
//! | flash, watchdog, power, USB, PVD, EXTI | what is written to them is lost |
use super::process::{Qemu, Stop, PC};
use crate::{
    bench::{ensure, fail, Failure},
    firmware::Build,
    steps::Step,
    wiring::{Wiring, FLASH},
};
use leadscrew_f407emu::Pin;
use object::{
    read::elf::{ElfFile32, ProgramHeader},
    Endianness,
};
use std::{
    collections::HashMap,
    io::{self, Read, Write},
    time::{Duration, Instant},
};

const RCC_CR: u32 = 0x4002_3800;
const RCC_CFGR: u32 = 0x4002_3808;
const TIM2: u32 = 0x4000_0000;
const TIM5: u32 = 0x4000_0C00;
const USART1: u32 = 0x4001_1000;
const IWDG: u32 = 0x4000_3000;
const NVIC_ISPR: u32 = 0xE000_E200;
const GPIO: u32 = 0x4002_0000;
/// Offsets of a timer's registers.
const DIER: u32 = 0x0C;
const CNT: u32 = 0x24;
const CCR1: u32 = 0x34;
const PSC: u32 = 0x28;
/// Offsets of the USART's registers.
const SR: u32 = 0x00;
const DR: u32 = 0x04;
/// Offsets of the streams in DMA2: stream 5 receives on USART1, stream 7 sends.
const RECEIVES: StreamPlace = StreamPlace(0x88);
const SENDS: StreamPlace = StreamPlace(0xB8);
/// Offset of a port's set and reset register.
const BSRR: u32 = 0x18;
/// The numbers of interrupts.
const TIM2_IRQ: u32 = 28;
const TIM7_IRQ: u32 = 55;
const SENDS_IRQ: u32 = 70;
/// The longest time that bytes may take from the line to the USART.
const ARRIVAL: Duration = Duration::from_secs(10);
/// Counts of TIM2 in a microsecond.
const COUNTS_PER_US: u32 = 84;
/// The erased flash behind the program, 256 KiB: the two sectors of the settings.
const SETTINGS: (u32, usize) = (FLASH + 0xC_0000, 0x4_0000);
/// The instruction `wfe`, at which the main loop waits.
const WFE: [u8; 2] = [0x20, 0xBF];

/// The offset of the registers of a DMA2 stream, from its control register on.
struct StreamPlace(u32);

impl StreamPlace {
    const fn control(&self) -> u32 {
        self.0
    }
    const fn items(&self) -> u32 {
        self.0 + 4
    }
    const fn memory(&self) -> u32 {
        self.0 + 12
    }
}

/// Says whether anything happened in a turn of the main loop.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Turn {
    /// Bytes were carried, or a tick came.
    Busy,
    /// Nothing.
    Idle,
}

/// A board in QEMU.
pub(super) struct StandIn {
    qemu: Qemu,
    wiring: &'static Wiring,
    /// The words last written to DMA2, by offset.
    dma: HashMap<u32, u32>,
    /// True if bytes have been sent whose end must still be signalled.
    sent: bool,
    /// The number of bytes on their way to the board.
    coming: usize,
    /// Bytes received since power-up.
    received: u32,
    /// The instant of the last tick, in counts of TIM2 since power-up.
    due: u64,
    /// The time of TIM5, µs.
    micros: u32,
    /// True if ticks are enabled.
    ticks: bool,
    negative: u8,
    steps: Vec<Step>,
}

impl StandIn {
    /// Starts the program as a bootloader would, and lets it reach its main loop.
    pub(super) fn power_up(build: &Build) -> Result<Self, Failure> {
        let images = [
            (FLASH, at_zero(build)?),
            (SETTINGS.0, vec![0xFF; SETTINGS.1]),
        ];
        let mut qemu = Qemu::start(&build.elf, &images)?;
        for address in waits(build)? {
            qemu.stop_at(&format!("Z1,{address:x},2"))?;
        }
        // The watchdog is fed once in a turn of the main loop: a write to it ends the turn.
        qemu.stop_at(&format!("Z2,{IWDG:x},2"))?;
        for port in 0..9 {
            qemu.stop_at(&format!("Z3,{:x},4", GPIO + 0x400 * port + 0x10))?;
        }
        let mut board = StandIn {
            qemu,
            wiring: build.wiring,
            dma: HashMap::new(),
            sent: false,
            coming: 0,
            received: 0,
            due: 0,
            micros: 0,
            ticks: false,
            negative: 0,
            steps: Vec::new(),
        };
        board.turn()?;
        // QEMU's timers count as fast as the host runs. At 15 kHz they count next to nothing, and
        // the stand-in sets them.
        for timer in [TIM2, TIM5] {
            board.qemu.set_word(timer + PSC, 0xFFFF)?;
        }
        board.micros = board.qemu.word(TIM5 + CNT)?;
        Ok(board)
    }

    /// The version that QEMU states.
    pub(super) fn version(&self) -> &str {
        &self.qemu.version
    }

    /// Lets the main loop make one turn or reach its wait, and plays the missing parts of the chip.
    pub(super) fn turn(&mut self) -> Result<Turn, Failure> {
        loop {
            match self.qemu.go()? {
                Stop::Reads => self.read_inputs()?,
                Stop::Writes | Stop::Waits => {
                    self.skip()?;
                    break;
                }
                Stop::Runs => self.set_ready_bits()?,
            }
        }
        self.follow()?;
        self.let_pass(0)?;
        // Do each of them, whatever the others answer.
        let happened = [self.end_sending()?, self.receive()?, self.tick()?];
        Ok(match happened.contains(&true) {
            true => Turn::Busy,
            false => Turn::Idle,
        })
    }

    /// Lets time pass. What QEMU's own counter has added meanwhile is overwritten.
    pub(super) fn let_pass(&mut self, micros: u32) -> Result<(), Failure> {
        self.micros = self.micros.wrapping_add(micros);
        self.qemu.set_word(TIM5 + CNT, self.micros)
    }

    /// Sends bytes to the board.
    pub(super) fn send(&mut self, text: &str) -> Result<(), Failure> {
        self.qemu.serial.write_all(text.as_bytes())?;
        self.coming += text.len();
        Ok(())
    }

    /// The bytes that the board has sent.
    pub(super) fn heard(&mut self) -> Result<String, Failure> {
        let mut bytes = [0; 256];
        match self.qemu.serial.read(&mut bytes) {
            Ok(count) => Ok(String::from_utf8_lossy(&bytes[..count]).into_owned()),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(String::new()),
            Err(error) => Err(error.into()),
        }
    }

    /// The steps since the last call.
    pub(super) fn take_steps(&mut self) -> Vec<Step> {
        std::mem::take(&mut self.steps)
    }

    /// Makes oscillators and PLL ready as soon as they are switched on; there is no crystal.
    fn set_ready_bits(&mut self) -> Result<(), Failure> {
        let (control, config) = (self.qemu.word(RCC_CR)?, self.qemu.word(RCC_CFGR)?);
        let asked = control & (1 << 0 | 1 << 24);
        let ready = control & !(asked << 1 | 1 << 1 | 1 << 17 | 1 << 25) | asked << 1;
        self.qemu.set_word(RCC_CR, ready)?;
        let source = (config & 3) << 2;
        self.qemu.set_word(RCC_CFGR, config & !(3 << 2) | source)
    }

    /// Carries out the load of an input register at which the core stands: every input is high.
    fn read_inputs(&mut self) -> Result<(), Failure> {
        let (pc, code) = self.instruction()?;
        let Some((register, size)) = load(code) else {
            return fail(format!("{pc:#x}: {code:08x} is no load that is known here"));
        };
        self.qemu.set_core(register, 0xFFFF)?;
        self.qemu.set_core(PC, pc + size)
    }

    /// Skips the instruction at which the core stands.
    fn skip(&mut self) -> Result<(), Failure> {
        let (pc, code) = self.instruction()?;
        let size = if is_long(code as u16) { 4 } else { 2 };
        self.qemu.set_core(PC, pc + size)
    }

    /// The program counter, and the two half-words at that address.
    fn instruction(&mut self) -> Result<(u32, u32), Failure> {
        let pc = self.qemu.core(PC)?;
        let low = self.qemu.word(pc & !3)?;
        if pc & 2 == 0 {
            return Ok((pc, low));
        }
        let high = self.qemu.word((pc & !3) + 4)?;
        Ok((pc, low >> 16 | high << 16))
    }

    /// Follows the program's writes to peripherals that QEMU does not have. A turn has one tick at
    /// most.
    fn follow(&mut self) -> Result<(), Failure> {
        let mut step: Option<Step> = None;
        for write in self.qemu.log()?.lines().filter_map(Logged::read) {
            match write {
                Logged::Dma2(offset, word) => {
                    self.dma.insert(offset, word);
                    if offset == SENDS.control() && word & 1 != 0 {
                        self.carry_out()?;
                    }
                }
                Logged::Port(port, word) => {
                    let motors = mask(self.wiring.step, port, word);
                    if motors != 0 {
                        step.get_or_insert(self.step()).motors |= motors;
                    }
                    let (pins, negative) = (self.wiring.direction, self.negative);
                    self.negative =
                        negative & !mask(pins, port, word >> 16) | mask(pins, port, word);
                }
            }
        }
        self.steps.extend(step);
        Ok(())
    }

    /// A step event at the last tick, without a motor yet. Its directions are taken now, because
    /// the next line may change them.
    fn step(&self) -> Step {
        Step {
            due: self.due,
            latency: 0,
            late: false,
            motors: 0,
            negative: self.negative,
        }
    }

    /// The sending stream has been switched on: copies its bytes to the USART.
    fn carry_out(&mut self) -> Result<(), Failure> {
        let word = |offset| self.dma.get(&offset).copied().unwrap_or(0);
        let (memory, items) = (word(SENDS.memory()), word(SENDS.items()));
        for place in 0..items {
            let byte = self.qemu.byte(memory + place)?;
            self.qemu.set_word(USART1 + DR, byte.into())?;
        }
        self.sent = true;
        Ok(())
    }

    /// Signals that sending has ended. Returns whether something was sent.
    fn end_sending(&mut self) -> Result<bool, Failure> {
        let sent = std::mem::take(&mut self.sent);
        if sent {
            self.pend(SENDS_IRQ)?;
        }
        Ok(sent)
    }

    /// Puts the received bytes in the place in which the stream would put them, all at once.
    /// Returns whether there were any.
    fn receive(&mut self) -> Result<bool, Failure> {
        let word = |offset| self.dma.get(&offset).copied().unwrap_or(0);
        let (memory, items) = (word(RECEIVES.memory()), word(RECEIVES.items()));
        if items == 0 || self.coming == 0 {
            return Ok(false);
        }
        let begin = Instant::now();
        while self.coming > 0 {
            // QEMU's USART holds one byte, and takes the next when that has been read.
            if self.qemu.word(USART1 + SR)? & 1 << 5 != 0 {
                let datum = self.qemu.word(USART1 + DR)? as u16;
                self.qemu
                    .set_half(memory + 2 * (self.received % items), datum)?;
                self.received += 1;
                self.coming -= 1;
            }
            ensure(begin.elapsed() < ARRIVAL, || {
                format!("{} bytes have not come", self.coming)
            })?;
        }
        self.pend(TIM7_IRQ)?;
        Ok(true)
    }

    /// If a tick is armed, goes to its instant and makes it. Returns whether there was one. The
    /// first tick comes at once: its instant is the present.
    fn tick(&mut self) -> Result<bool, Failure> {
        let ticked = std::mem::replace(&mut self.ticks, self.qemu.word(TIM2 + DIER)? & 1 << 1 != 0);
        if !self.ticks {
            return Ok(false);
        }
        let instant = if ticked { CCR1 } else { CNT };
        let due = self.qemu.word(TIM2 + instant)?;
        let wait = due.wrapping_sub(self.due as u32);
        self.due += u64::from(wait);
        self.qemu.set_word(TIM2 + CNT, due)?;
        self.let_pass(wait / COUNTS_PER_US)?;
        self.pend(TIM2_IRQ)?;
        Ok(true)
    }

    fn pend(&mut self, interrupt: u32) -> Result<(), Failure> {
        let place = NVIC_ISPR + interrupt / 32 * 4;
        self.qemu.set_word(place, 1 << (interrupt % 32))
    }
}

/// A write that QEMU has logged.
enum Logged {
    /// Offset and word.
    Dma2(u32, u32),
    /// The port's letter, and the word to set and reset its pins.
    Port(char, u32),
}

impl Logged {
    /// Reads `GPIOE: unimplemented device write (size 4, offset 0x018, value 0x00000004)`.
    fn read(line: &str) -> Option<Self> {
        let (device, rest) = line.split_once(": unimplemented device write")?;
        let number = |name: &str| {
            let digits = rest.split_once(name)?.1.split([',', ')']).next()?;
            u32::from_str_radix(digits, 16).ok()
        };
        let (offset, word) = (number("offset 0x")?, number("value 0x")?);
        match (device.strip_prefix("GPIO"), device) {
            (Some(port), _) if offset == BSRR => Some(Logged::Port(port.chars().next()?, word)),
            (_, "DMA2") => Some(Logged::Dma2(offset, word)),
            _ => None,
        }
    }
}

/// The motors, one bit each, whose pins on `port` are named in the lower half of `word`.
fn mask(pins: &[Pin], port: char, word: u32) -> u8 {
    let named =
        |pin: &Pin| (0..16).any(|number| word >> number & 1 == 1 && *pin == Pin::new(port, number));
    let motors = pins.iter().enumerate();
    motors.fold(0, |motors, (motor, pin)| {
        motors | u8::from(named(pin)) << motor
    })
}

/// Returns true if an instruction with this first half-word has two half-words (DDI 0403, A5.1).
fn is_long(half: u16) -> bool {
    matches!(half >> 11, 0b11101..=0b11111)
}

/// The target register and the size of a load with an offset: `LDR` T1 and T3 (DDI 0403, A7.7.43).
fn load(code: u32) -> Option<(u8, u32)> {
    let (first, second) = (code as u16, (code >> 16) as u16);
    if first & 0xF800 == 0x6800 {
        return Some(((first & 7) as u8, 2));
    }
    (first & 0xFFF0 == 0xF8D0).then_some(((second >> 12) as u8, 4))
}

/// The image of address 0 once SRAM1 is mapped there: the vectors and the step interrupts.
fn at_zero(build: &Build) -> Result<Vec<u8>, Failure> {
    let mut image = Vec::new();
    for (address, place, bytes) in segments(build)? {
        let begin = match address {
            // The vector table is copied from the program's start.
            address if address == build.wiring.start => 0,
            address if address < FLASH && place >= FLASH => address as usize,
            _ => continue,
        };
        let bytes = if begin == 0 {
            &bytes[..vectors(&bytes)]
        } else {
            &bytes
        };
        let end = begin + bytes.len();
        image.resize(image.len().max(end), 0xFF);
        image[begin..end].copy_from_slice(bytes);
    }
    match image.len() {
        0 => fail("the ELF has nothing for address 0"),
        _ => Ok(image),
    }
}

/// The bytes of the vector table: 16 core vectors and 82 interrupts (RM0090 table 62).
fn vectors(segment: &[u8]) -> usize {
    segment.len().min((16 + 82) * 4)
}

/// The addresses at which the program waits.
fn waits(build: &Build) -> Result<Vec<u32>, Failure> {
    let mut places = Vec::new();
    for (address, _, bytes) in segments(build)? {
        let halves = (address..).step_by(2).zip(bytes.chunks_exact(2));
        places.extend(
            halves
                .filter(|(_, half)| *half == WFE)
                .map(|(place, _)| place),
        );
    }
    match places.len() {
        0 => fail("the program waits nowhere"),
        _ => Ok(places),
    }
}

/// The loaded segments: the address at which each runs, the address at which it is kept, its bytes.
fn segments(build: &Build) -> Result<Vec<(u32, u32, Vec<u8>)>, Failure> {
    let file = ElfFile32::<Endianness>::parse(&*build.elf)?;
    let endian = file.endian();
    let mut found = Vec::new();
    for header in file.elf_program_headers() {
        let bytes = header.data(endian, &*build.elf);
        let bytes = bytes.map_err(|()| Failure("the ELF is cut off".into()))?;
        if !bytes.is_empty() {
            let (runs, kept) = (header.p_vaddr.get(endian), header.p_paddr.get(endian));
            found.push((runs, kept, bytes.to_vec()));
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loads_are_read_as_the_manual_has_them() {
        assert_eq!(load(0x0000_6901), Some((1, 2)), "ldr r1, [r0, #16]");
        assert_eq!(load(0x2808_F8D4), Some((2, 4)), "ldr.w r2, [r4, #2056]");
        assert_eq!(load(0x0000_6101), None, "str r1, [r0, #16]");
        assert!(is_long(0xF8D4) && !is_long(0xBF20));
    }

    #[test]
    fn a_line_of_the_log_is_a_write() {
        let line = "GPIOE: unimplemented device write (size 4, offset 0x018, value 0x00000004)";
        assert!(matches!(Logged::read(line), Some(Logged::Port('E', 4))));
        let line = "DMA2: unimplemented device write (size 4, offset 0x0b8, value 0x08000451)";
        assert!(matches!(
            Logged::read(line),
            Some(Logged::Dma2(0xB8, 0x0800_0451))
        ));
        let line = "GPIOE: unimplemented device read  (size 4, offset 0x018)";
        assert!(Logged::read(line).is_none());
    }
}
