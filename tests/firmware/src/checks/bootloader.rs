//! A bootloader's conditions on a program, and the state that it may leave behind.
use super::Figures;
use crate::{
    bench::{ensure, Bench, Failure},
    firmware::{Build, Firmware},
    wiring::FLASH,
};
use object::{read::elf::FileHeader, Object, ObjectSegment};

/// The condition of ST's template on the stack pointer in the vector table: `(word & 0x2FFE0000) ==
/// 0x20000000`.
const TEMPLATE: (u32, u32) = (0x2FFE_0000, 0x2000_0000);

const AHB1ENR: u32 = 0x4002_3830;
/// A stream of DMA2 that the firmware has no use for, and its bit that switches it on.
const DMA2_S1CR: u32 = 0x4002_6428;
const DMA_ENABLED: u32 = 1;
const SYST_CSR: u32 = 0xE000_E010;
const ICSR: u32 = 0xE000_ED04;
/// Interrupts 32 to 63: USART3's is number 39.
const NVIC_ISER1: u32 = 0xE000_E104;
const NVIC_ISPR1: u32 = 0xE000_E204;
const USART3: u32 = 1 << (39 - 32);
const EXTI_SWIER: u32 = 0x4001_3C10;
const EXTI_IMR: u32 = 0x4001_3C00;

/// Stores with which a bootloader could go: SysTick runs with its interrupt waiting, an interrupt
/// that no program has asked for is on and waits, a line of EXTI is on, a DMA stream writes to SRAM
/// for ever.
const LEFT_BEHIND: [(u32, u32); 13] = [
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

/// The stack pointer in a program's vector table.
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

/// A bootloader after ST's template starts it; what another one left behind has ended when the
/// banner comes.
pub(crate) fn bootloaders(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let (mask, expected) = TEMPLATE;
    let others = &firmware.others;
    for (name, build) in [("discovery", &firmware.usual), ("skr-2", &others.skr_2)] {
        let stack = first_stack(build)?;
        ensure(stack & mask == expected, || {
            format!("{name}: ST's bootloaders refuse a stack at {stack:#010x}")
        })?;
        figures.add(name, format!("stack pointer {stack:#010x}"));
    }
    let mut bench = Bench::switch_on(&others.skr_2)?;
    let image = bootloader(others.skr_2.wiring.start);
    bench.machine.program_flash(FLASH, &image);
    bench.hear_banner()?;
    for (what, register, bits) in [
        ("SysTick runs", SYST_CSR, 1),
        ("SysTick's interrupt waits", ICSR, 1 << 26),
        ("an interrupt of nobody's is on", NVIC_ISER1, USART3),
        ("an interrupt of nobody's waits", NVIC_ISPR1, USART3),
        ("a line of EXTI is on", EXTI_IMR, 1 << 6),
        ("a DMA stream runs", DMA2_S1CR, DMA_ENABLED),
    ] {
        let word = bench.machine.peek(register);
        ensure(word & bits == 0, || {
            format!("left behind: {what}, {word:#x}")
        })?;
    }
    figures.add("left behind", "nothing");
    Ok(figures)
}

/// How fast the edges of pins are: two bits each in OSPEEDR (RM0090 section 8.4.3).
pub(crate) fn edges(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let mut bench = Bench::switch_on(&firmware.usual)?;
    bench.hear_banner()?;
    let mut speed = |port: u32, pin: u32| {
        let word = bench.machine.peek(0x4002_0000 + 0x400 * port + 0x08);
        word >> (2 * pin) & 3
    };
    // Steps and power of the Discovery; its serial line's output; USB (README of the board).
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
