//! The conditions that a bootloader sets on a program, and the state that it may leave behind.
use super::Figures;
use crate::{
    bench::{cycles, ensure, fail, Bench, Failure},
    firmware::{Build, Firmware},
    wiring::FLASH,
};
use leadscrew_f407emu::{ResetCause, Stop};
use object::{read::elf::FileHeader, Object, ObjectSegment};

/// ST's template starts a program only if the stack pointer in its vector table meets `(word &
/// 0x2FFE0000) == 0x20000000`: mask and value.
const TEMPLATE: (u32, u32) = (0x2FFE_0000, 0x2000_0000);

const AHB1ENR: u32 = 0x4002_3830;
/// The control register of a DMA2 stream that the firmware does not use, and its enable bit.
const DMA2_S1CR: u32 = 0x4002_6428;
const DMA_ENABLED: u32 = 1;
const SYST_CSR: u32 = 0xE000_E010;
const ICSR: u32 = 0xE000_ED04;
/// Enable and pending bits of interrupts 32 to 63; USART3 has number 39.
const NVIC_ISER1: u32 = 0xE000_E104;
const NVIC_ISPR1: u32 = 0xE000_E204;
const USART3: u32 = 1 << (39 - 32);
const EXTI_SWIER: u32 = 0x4001_3C10;
const EXTI_IMR: u32 = 0x4001_3C00;
const APB1ENR: u32 = 0x4002_3840;
const TIM2_ON: u32 = 1;
const TIM2_PSC: u32 = 0x4000_0028;

/// The stores of a bootloader that leaves things switched on: SysTick runs with its interrupt
/// pending, an interrupt that the program does not use is enabled and pending, a line of EXTI is
/// enabled, a DMA stream writes to SRAM for ever, and the step timer counts each fourth clock.
const LEFT_BEHIND: [(u32, u32); 16] = [
    (AHB1ENR, 0x0050_0000),
    (AHB1ENR, 0x0050_0000),
    (0xE000_E014, 15_999),
    (0xE000_E018, 0),
    (SYST_CSR, 0b111),
    (ICSR, 1 << 26),
    (NVIC_ISER1, USART3),
    (NVIC_ISPR1, USART3),
    (EXTI_IMR, 1 << 6),
    (EXTI_SWIER, 1 << 6),
    (DMA2_S1CR + 0x4, 16),
    (DMA2_S1CR + 0xC, 0x2001_0000),
    (DMA2_S1CR, 1 << 10 | 1 << 8 | DMA_ENABLED),
    (APB1ENR, TIM2_ON),
    (APB1ENR, TIM2_ON),
    (TIM2_PSC, 3),
];

/// A bootloader that makes these stores, then goes to the program whose vector table is at `start`.
fn bootloader(start: u32) -> Vec<u8> {
    const CODE: u32 = 0x8;
    const TABLE: u32 = 0x28;
    // cpsid i; nop; ldr r0, =TABLE; next: ldm r0!, {r1, r2}; cbz r1, go; str r2, [r1]; b next;
    // go: ldr r0, =start; ldr r1, [r0]; mov sp, r1; ldr r1, [r0, #4]; bx r1
    let code: [u16; 12] = [
        0xB672, 0xBF00, 0x4804, 0xC806, 0xB109, 0x600A, 0xE7FB, 0x4803, 0x6801, 0x468D, 0x6841,
        0x4708,
    ];
    let mut image: Vec<u8> = [0x2000_1000u32, FLASH + CODE + 1]
        .iter()
        .flat_map(|word| word.to_le_bytes())
        .collect();
    image.extend(code.iter().flat_map(|half| half.to_le_bytes()));
    let end = [(0, 0)];
    let table = LEFT_BEHIND.iter().chain(&end);
    let words = [FLASH + TABLE, start].into_iter();
    let words = words.chain(table.flat_map(|&(address, value)| [address, value]));
    image.extend(words.flat_map(u32::to_le_bytes));
    image
}

/// The initial stack pointer in a program's vector table.
fn first_stack(build: &Build) -> Result<u32, Failure> {
    let file = object::read::elf::ElfFile32::<object::Endianness>::parse(&*build.elf)?;
    let endian = file.elf_header().endian()?;
    let _ = file.architecture();
    for segment in file.segments() {
        let physical = segment.elf_program_header().p_paddr.get(endian);
        if physical == build.wiring.start {
            let bytes = segment.data()?.first_chunk::<4>();
            return bytes.map_or_else(
                || Err(Failure("no vector table".into())),
                |bytes| Ok(u32::from_le_bytes(*bytes)),
            );
        }
    }
    Err(Failure("nothing where the vector table should be".into()))
}

/// A bootloader after ST's template must start the program. What another bootloader left running
/// must be off when the banner comes.
pub(crate) fn bootloaders(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let (mask, expected) = TEMPLATE;
    let skr_2 = firmware.build("skr-2")?;
    for (name, build) in [("discovery", firmware.build("usual")?), ("skr-2", skr_2)] {
        let stack = first_stack(build)?;
        ensure(stack & mask == expected, || {
            format!("{name}: ST's bootloaders refuse a stack at {stack:#010x}")
        })?;
        figures.add(name, format!("stack pointer {stack:#010x}"));
    }
    let mut bench = Bench::switch_on(skr_2)?;
    let image = bootloader(skr_2.wiring.start);
    bench.machine.program_flash(FLASH, &image);
    bench.hear_banner()?;
    for (what, register, bits) in [
        ("SysTick runs", SYST_CSR, 1),
        ("SysTick's interrupt waits", ICSR, 1 << 26),
        ("an interrupt of nobody's is on", NVIC_ISER1, USART3),
        ("an interrupt of nobody's waits", NVIC_ISPR1, USART3),
        ("a line of EXTI is on", EXTI_IMR, 1 << 6),
        ("a DMA stream runs", DMA2_S1CR, DMA_ENABLED),
        ("the step timer is slow", TIM2_PSC, 0xFFFF),
    ] {
        let word = bench.machine.peek(register);
        ensure(word & bits == 0, || {
            format!("left behind: {what}, {word:#x}")
        })?;
    }
    figures.add("left behind", "nothing");
    Ok(figures)
}

/// The state in which AN2606 wants the chip when its loader begins: the system memory at address 0,
/// the internal oscillator, no interrupt on. Each register with the bits that are looked at, and
/// their value.
const FRESH: [(&str, u32, u32, u32); 7] = [
    ("memory at 0", 0x4001_3800, 0b11, 0b01),
    ("system clock", 0x4002_3808, 0b1111, 0),
    ("PLL and crystal", 0x4002_3800, 1 << 24 | 1 << 16, 0),
    ("interrupts 0 to 31", 0xE000_E100, u32::MAX, 0),
    ("interrupts 32 to 63", NVIC_ISER1, u32::MAX, 0),
    ("interrupts 64 to 95", 0xE000_E108, u32::MAX, 0),
    ("vector table", 0xE000_ED08, u32::MAX, 0x1FFF_0000),
];
/// The longest time from `$DFU` to the loader, s.
const TO_LOADER_SECONDS: f64 = 0.2;

/// `$DFU` is refused in motion. At rest it is answered, and ST's loader begins on a fresh chip whose
/// outputs are off; after the next reset the program runs as usual.
pub(crate) fn loader(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let build = firmware.build("usual")?;
    let mut bench = Bench::switch_on(build)?;
    bench.hear_banner()?;
    bench.commands("M3 S1000\nG91 G1 X1 F600")?;
    let refused = bench.say("$DFU")?;
    ensure(
        refused.last().is_some_and(|answer| answer == "error:8"),
        || format!("in motion: {refused:?}"),
    )?;
    bench.wait_for("Idle", 1.0)?;
    let told = bench.command("$DFU")?;
    ensure(told.iter().any(|line| line.contains("loader")), || {
        format!("not told: {told:?}")
    })?;
    let asked = bench.machine.cycle();
    let end = asked + cycles(TO_LOADER_SECONDS);
    let stop = bench.machine.run_until(end).err();
    let Some(Stop::Loader { stack, masked }) = stop else {
        return fail(format!("no loader: {stop:?}"));
    };
    figures.add("$DFU", format!("loader, stack pointer {stack:#010x}"));
    ensure(!masked, || {
        "PRIMASK keeps interrupts from the loader".into()
    })?;
    for (what, register, bits, value) in FRESH {
        let word = bench.machine.peek(register);
        ensure(word & bits == value, || format!("{what}: {word:#010x}"))?;
    }
    for pin in [build.wiring.power, build.wiring.spindle] {
        let off = bench.machine.drives(pin) && !bench.machine.level(pin);
        ensure(off, || format!("{pin} is not off"))?;
    }
    let now = bench.machine.cycle();
    bench.machine.reset_at(now, ResetCause::Pin);
    let again = bench.hear_banner()?;
    ensure(again.iter().all(|line| !line.contains("MSG")), || {
        format!("after the loader: {again:?}")
    })?;
    Ok(figures)
}

/// Returns how fast the edges of pins are: each pin has two bits in OSPEEDR (RM0090 section 8.4.3).
pub(crate) fn edges(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let mut bench = Bench::switch_on(firmware.build("usual")?)?;
    bench.hear_banner()?;
    let mut speed = |port: u32, pin: u32| {
        let word = bench.machine.peek(0x4002_0000 + 0x400 * port + 0x08);
        word >> (2 * pin) & 3
    };
    // The Discovery's step and power pins, the output of its serial line, and its USB pins (README
    // of the board), each with the least speed that it needs.
    for (what, port, pin, least) in [
        ("step X", 4, 7, 1),
        ("step Y", 4, 8, 1),
        ("step Z", 4, 9, 1),
        ("power", 3, 12, 1),
        ("serial line", 0, 2, 1),
        ("USB D-", 0, 11, 3),
        ("USB D+", 0, 12, 3),
    ] {
        let found = speed(port, pin);
        ensure(found >= least, || {
            format!("{what}: edges of speed {found}, {least} is needed")
        })?;
        figures.add(what, format!("speed {found}"));
    }
    Ok(figures)
}
