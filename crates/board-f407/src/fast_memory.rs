//! Memory that never waits, for the step interrupts.
//!
//! ```text
//!  instruction bus  0x00000000  SRAM1 a second time: vectors, step interrupts
//!                               (no wait states; the flash has five)
//!  data bus         0x10000000  core coupled memory: stack, data of ticks, machine, pixels
//!                               (no DMA there)
//!  system bus       0x20000000  SRAM for all else, DMA, peripherals
//! ```
//!
//! Code is fetched over the instruction bus below 0x20000000 only, and SRAM1 is there once SYSCFG
//! says so (RM0090 sections 2.3.1 and 9.2.1). Data that a tick reads must not be in SRAM1 as well:
//! fetch and data would wait for each other. `memory/fast.x` places code and data. `cargo xtask
//! thumb` fails if a step interrupt reaches code in the flash.
#![allow(unsafe_code)] // memory that the linker has laid out
use core::ptr::{addr_of, addr_of_mut};
use cortex_m::{asm, peripheral::SCB};
use stm32f4::stm32f407::SYSCFG;

/// Gives a static its section: `.bss.ccm.NAME`, all zero at the start, or `.fast_code.NAME`.
macro_rules! placed {
    ($section:literal; $(#[$doc:meta])* static $name:ident: $type:ty = $value:expr;) => {
        $(#[$doc])*
        #[allow(unsafe_code)]
        #[link_section = $section]
        static $name: $type = $value;
    };
}
pub(crate) use placed;

#[cfg(record)]
use core::{mem::offset_of, slice};
#[cfg(record)]
use leadscrew_machine::settings::values::Entry;
#[cfg(record)]
use leadscrew_record::{Setting, FIXED, SLOT, SLOTS};

extern "C" {
    static __vector_table: u32;
    #[cfg(record)]
    static __record: [[u8; SLOT]; SLOTS];
    #[cfg(record)]
    static __sidata: u32;
    #[cfg(record)]
    static __sdata: u32;
    #[cfg(record)]
    static __edata: u32;
    static __fast_vectors: u32;
    static __fast_code_load: u32;
    static __fast_code: u32;
    static __fast_code_end: u32;
    static mut __ccm_bss: u32;
    static mut __ccm_bss_end: u32;
}

/// The real address of SRAM1: data for address 0 is written there.
const SRAM1: usize = 0x2000_0000;
/// Words of the vector table: the core's 16, and 82 interrupts (RM0090 table 62).
const VECTORS: usize = 16 + 82;

/// Copies vectors and code to SRAM1, maps SRAM1 to address 0, and clears the data in the core
/// coupled memory. SYSCFG has to have its clock. Once, before anything uses this code or data.
pub(crate) fn load(syscfg: &SYSCFG, scb: &mut SCB) {
    // SAFETY: the linker has kept these places for this, and nobody uses them yet.
    unsafe {
        copy(addr_of!(__vector_table), addr_of!(__fast_vectors), VECTORS);
        let words = (addr_of!(__fast_code_end) as usize - addr_of!(__fast_code) as usize) / 4;
        copy(addr_of!(__fast_code_load), addr_of!(__fast_code), words);
        let (mut word, end) = (addr_of_mut!(__ccm_bss), addr_of_mut!(__ccm_bss_end));
        while word < end {
            word.write_volatile(0);
            word = word.add(1);
        }
    }
    asm::dsb();
    // SAFETY: the value is a mode of the register: SRAM1 at address 0.
    syscfg.memrmp().write(|w| unsafe { w.bits(0b11) });
    // The register is read back so that the store has reached it before anything is fetched from 0.
    syscfg.memrmp().read();
    // SAFETY: the vectors are there, aligned to 512 bytes as 98 of them require (DDI 0403, B3.2.5).
    unsafe { scb.vtor.write(addr_of!(__fast_vectors) as u32) };
    asm::dsb();
    asm::isb();
}

/// The bytes at a place for the board's record, 0 to 7. Nobody writes to the place of the record in
/// force.
#[cfg(record)]
pub(crate) fn record(place: usize) -> &'static [u8; SLOT] {
    // SAFETY: the linker has kept this sector of the flash for the record, and any value is valid
    // for a byte.
    unsafe { &(*addr_of!(__record))[place % SLOTS] }
}

/// A word of a place for the record, as the flash has it now.
#[cfg(record)]
pub(crate) fn record_word(place: usize, word: usize) -> u32 {
    let bytes = record(place).as_ptr().cast::<u32>();
    // SAFETY: within the place; volatile, since a write of the flash changes it unseen.
    unsafe { bytes.add(word % (SLOT / 4)).read_volatile() }
}

/// The settings in a record as the machine takes them. They lie in the flash in the same layout.
#[cfg(record)]
pub(crate) fn entries(settings: &'static [Setting]) -> &'static [Entry] {
    const {
        assert!(
            size_of::<Entry>() == size_of::<Setting>() && FIXED.is_multiple_of(align_of::<Entry>())
        );
        assert!(offset_of!(Entry, number) == offset_of!(Setting, number));
        assert!(offset_of!(Entry, value) == offset_of!(Setting, nanos));
    }
    let first = settings.as_ptr().cast::<Entry>();
    match first.is_aligned() {
        // SAFETY: aligned; both have a number and a value at the same places, of which any bits are
        // sound, and the core is little-endian as a record is.
        true => unsafe { slice::from_raw_parts(first, settings.len()) },
        false => &[],
    }
}

/// The first address of the image.
#[cfg(record)]
pub(crate) fn start() -> usize {
    addr_of!(__vector_table) as usize
}

/// The first address behind the image: the first values of the variables are its end.
#[cfg(record)]
pub(crate) fn end() -> usize {
    let values = addr_of!(__edata) as usize - addr_of!(__sdata) as usize;
    addr_of!(__sidata) as usize + values
}

/// Copies words to the place that `to` names after the remapping.
///
/// # Safety
/// `from` is readable and `to` is kept for this.
unsafe fn copy(from: *const u32, to: *const u32, words: usize) {
    let to = (SRAM1 + to as usize) as *mut u32;
    for index in 0..words {
        // SAFETY: the caller has promised it.
        unsafe {
            to.add(index)
                .write_volatile(from.add(index).read_volatile())
        };
    }
}
