//! Events that end the program. The outputs are made safe, the reason and the place are noted, and
//! the chip is reset. The next boot tells the operator both, and `$I` does until power goes off.
//!
//! | event | comes as | source |
//! |---|---|---|
//! | a panic | [`panic`] | the program itself |
//! | a fault: bad address, bad instruction | HardFault | the core (PM0214 section 2.4) |
//! | the stack is full | HardFault: below the stack there is no memory | `memory.x` |
//! | the crystal stops | NMI | the clock security system (RM0090 section 7.2.7) |
//! | the supply is low | the interrupt of the voltage detector | RM0090 section 5.2.3 |
//! | the main loop hangs | a reset, without a handler | the watchdog |
//! | `$DFU` | [`into_loader`] | the operator |
#![allow(unsafe_code)] // an entry in assembly, a variable that start-up leaves alone

use crate::{clock, safe_state};
use core::{
    arch::global_asm,
    fmt::{self, Write},
    panic::PanicInfo,
    sync::atomic::{AtomicU32, AtomicU8, Ordering::Relaxed},
};
use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;
use stm32f4::stm32f407::{RCC, SYSCFG};

/// The reason why the chip was reset.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub(crate) enum Reason {
    /// Power came on, the reset pin was pulled, or a debugger asked for a reset: no message.
    Ordinary,
    Watchdog,
    Panic,
    Fault,
    StackOverflow,
    ClockFailure,
    SupplyLow,
}

impl Reason {
    /// The operator's message.
    pub(crate) const fn text(self) -> Option<&'static str> {
        match self {
            Self::Ordinary => None,
            Self::Watchdog => Some("the main loop hung"),
            Self::Panic => Some("a fault in the program"),
            Self::Fault => Some("a fault of the processor"),
            Self::StackOverflow => Some("the stack was full"),
            Self::ClockFailure => Some("the crystal stopped"),
            Self::SupplyLow => Some("the supply voltage was low"),
        }
    }

    /// The number that stands for the reason in [`NOTE`] until the operator has been told. Memory
    /// is unlikely to hold this number after power-up.
    const fn note(self) -> u32 {
        0x1EAD_5C00 | self as u32
    }

    /// The number that stands for a reason that the operator has been told.
    const fn told(self) -> u32 {
        0x1EAD_5D00 | self as u32
    }
}

/// The reasons that a message tells.
const ALL: [Reason; 6] = [
    Reason::Watchdog,
    Reason::Panic,
    Reason::Fault,
    Reason::StackOverflow,
    Reason::ClockFailure,
    Reason::SupplyLow,
];

/// The note that a program leaves when it ends: 40 bytes, which a reset leaves alone.
struct Note {
    /// [`Reason::note`] or [`Reason::told`]; anything else if nothing has ended.
    reason: AtomicU32,
    /// Of a panic: the line. Of a fault: the instruction, the place from which its function was
    /// called, and the core's configurable fault status (DDI 0403 section B3.2.15).
    words: [AtomicU32; 3],
    /// Of a panic: the end of the file's name; zeros behind it.
    file: [AtomicU8; FILE],
}

/// Bytes of a file's name.
const FILE: usize = 24;

/// The end of the program to come. Start-up does not clear its section.
#[link_section = ".uninit.restart"]
static NOTE: Note = Note {
    reason: AtomicU32::new(0),
    words: [const { AtomicU32::new(0) }; 3],
    file: [const { AtomicU8::new(0) }; FILE],
};

impl Note {
    fn write(&self, reason: u32, words: [u32; 3], file: &str) {
        self.reason.store(reason, Relaxed);
        for (place, word) in self.words.iter().zip(words) {
            place.store(word, Relaxed);
        }
        let file = file.as_bytes();
        let tail = file.get(file.len().saturating_sub(FILE)..);
        let mut tail = tail.unwrap_or_default().iter();
        for place in &self.file {
            place.store(tail.next().copied().unwrap_or(0), Relaxed);
        }
    }
}

/// The program's end, for people: nothing for other reasons than a panic or a fault.
pub(crate) struct Place(Reason);

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [first, caller, status] = [0, 1, 2].map(|word: usize| NOTE.words[word].load(Relaxed));
        match self.0 {
            Reason::Panic => {
                let bytes = NOTE.file.iter().map(|byte| byte.load(Relaxed));
                for byte in bytes.filter(|byte| matches!(byte, b' '..=b'~')) {
                    f.write_char(byte.into())?;
                }
                write!(f, " line {first}")
            }
            Reason::Fault => write!(
                f,
                "{first:#010x}, called from {caller:#010x}, status {status:#010x}"
            ),
            _ => Ok(()),
        }
    }
}

impl Reason {
    /// The program's end, if that is known. Not before [`reason`].
    pub(crate) fn place(self) -> Option<Place> {
        matches!(self, Self::Panic | Self::Fault).then_some(Place(self))
    }
}

/// The last end of the program, for people. Not before [`reason`].
pub(crate) struct LastEnd;

impl LastEnd {
    fn reason() -> Option<Reason> {
        let note = NOTE.reason.load(Relaxed);
        ALL.into_iter().find(|reason| reason.told() == note)
    }

    /// The last end, unless the program has never ended by itself since power came on.
    pub(crate) fn known() -> Option<&'static Self> {
        Self::reason().map(|_| &LastEnd)
    }
}

impl fmt::Display for LastEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reason = Self::reason();
        f.write_str(reason.and_then(Reason::text).unwrap_or_default())?;
        match reason.and_then(Reason::place) {
            Some(place) => write!(f, ", {place}"),
            None => Ok(()),
        }
    }
}

/// The note of a reset after which the loader is to start.
const LOADER: u32 = 0x1EAD_5B00;
/// The system memory, which holds ST's loader (RM0090 section 2.4).
const SYSTEM_MEMORY: u32 = 0x1FFF_0000;

/// Makes the outputs safe, resets the chip, and goes to ST's loader. Main loop.
pub(crate) fn into_loader() -> ! {
    safe_state::enter();
    end_as(LOADER, [0; 3], "")
}

/// Goes to ST's loader if [`into_loader`] has reset the chip. It takes over the chip as after a
/// reset, with the system memory at address 0 and interrupts on (AN2606); pins that could do harm
/// stay off. The first thing at start-up.
pub(crate) fn go_to_loader(rcc: &RCC, syscfg: &SYSCFG, core: &mut cortex_m::Peripherals) {
    if NOTE.reason.load(Relaxed) != LOADER {
        return;
    }
    NOTE.reason.store(0, Relaxed);
    clock::switch_on(rcc, |rcc| {
        rcc.apb2enr().modify(|_, w| w.syscfgen().enabled());
    });
    syscfg.memrmp().write(|w| w.mem_mode().system_flash());
    // SAFETY: nothing of this program runs after this. No interrupt of it is on, and the loader's
    // table has its stack and its first instruction.
    unsafe {
        for enabled in &core.NVIC.icer {
            enabled.write(u32::MAX);
        }
        core.SCB.vtor.write(SYSTEM_MEMORY);
        cortex_m::interrupt::enable();
        cortex_m::asm::bootload(SYSTEM_MEMORY as *const u32)
    }
}

/// Makes the outputs safe and resets the chip.
pub(crate) fn because(reason: Reason) -> ! {
    safe_state::enter();
    end(reason, [0; 3], "")
}

/// Notes the end and resets the chip.
fn end(reason: Reason, words: [u32; 3], file: &str) -> ! {
    end_as(reason.note(), words, file)
}

fn end_as(note: u32, words: [u32; 3], file: &str) -> ! {
    NOTE.write(note, words, file);
    SCB::sys_reset()
}

/// Returns why the chip was reset. This clears the chip's flags, and marks the note as told: a
/// second call would find nothing. Once, at start-up.
pub(crate) fn reason(rcc: &RCC) -> Reason {
    let flags = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    let note = NOTE.reason.load(Relaxed);
    let power_up = flags.porrstf().bit_is_set();
    let reason = if flags.wdgrstf().bit_is_set() {
        Reason::Watchdog
    } else if flags.borrstf().bit_is_set() && !power_up {
        Reason::SupplyLow
    } else if flags.sftrstf().bit_is_set() {
        let known = ALL.into_iter().find(|reason| reason.note() == note);
        known.unwrap_or(Reason::Ordinary)
    } else {
        Reason::Ordinary
    };
    if reason != Reason::Ordinary {
        NOTE.reason.store(reason.told(), Relaxed);
    } else if power_up {
        NOTE.reason.store(0, Relaxed);
    }
    reason
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    safe_state::enter();
    let (file, line) = info
        .location()
        .map_or(("", 0), |place| (place.file(), place.line()));
    end(Reason::Panic, [line, 0, 0], file)
}

// The stack pointer itself may be wrong, so it is set to the top of the stack before anything is
// pushed. Its old value is the argument of `on_fault`.
global_asm!(
    ".section .text.HardFault, \"ax\"",
    ".global HardFault",
    ".type HardFault,%function",
    ".thumb_func",
    "HardFault:",
    "mov r0, sp",
    "ldr r1, =__stack_top",
    "mov sp, r1",
    "b {on_fault}",
    ".ltorg",
    on_fault = sym on_fault,
);

/// A fault, with the stack pointer at which the core gave up.
extern "C" fn on_fault(stack: u32) -> ! {
    extern "C" {
        static _stack_end: u32;
        static __stack_top: u32;
    }
    /// Bytes for the registers that an exception pushes, the floating-point ones included, and for
    /// a frame below them.
    const MARGIN: u32 = 0x400;
    /// Bytes of the eight registers that an exception always pushes.
    const PUSHED: u32 = 32;
    safe_state::enter();
    let (least, top) = (
        (&raw const _stack_end) as u32,
        (&raw const __stack_top) as u32,
    );
    if stack < least + MARGIN {
        end(Reason::StackOverflow, [0; 3], "");
    }
    let is_whole = stack.is_multiple_of(4) && stack <= top - PUSHED;
    let pushed = |register: usize| match is_whole {
        // SAFETY: within the stack, which is memory.
        true => unsafe { (stack as *const u32).add(register).read_volatile() },
        false => 0,
    };
    // SAFETY: a register of the core, which can be read at any time.
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    // The core pushes r0 to r3, r12, lr, pc and the program's status (DDI 0403 section B1.5.6).
    end(Reason::Fault, [pushed(6), pushed(5), status], "")
}

/// The crystal has stopped; the internal oscillator goes on.
#[exception]
unsafe fn NonMaskableInt() -> ! {
    because(Reason::ClockFailure)
}

/// An interrupt that nobody asked for: its number is noted.
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    safe_state::enter();
    end(Reason::Fault, [0, 0, u32::from(number.cast_unsigned())], "")
}
