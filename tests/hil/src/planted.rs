//! Faults planted in an emulated board, each with the check that must find it: `cargo hil
//! --planted`.
use crate::{
    board::Board,
    checks::CHECKS,
    emulated::{Emulated, Fault},
    failure::{fail, Failure},
    wires::{Signal, Wires},
};
use leadscrew_f407emu::Tamper;

/// A fault.
pub(crate) struct Planted {
    pub(crate) name: &'static str,
    fault: Fault,
    /// The check that must find it.
    found_by: &'static str,
}

const fn planted(name: &'static str, fault: Fault, found_by: &'static str) -> Planted {
    Planted {
        name,
        fault,
        found_by,
    }
}

/// A fault that applies `tamper` to the words that the program writes to `register`.
const fn tamper(register: u32, tamper: Tamper) -> Fault {
    Fault::Tamper { register, tamper }
}

/// Sets and resets the pins of port E: steps are 7 to 9, directions 10 to 12.
const GPIOE_BSRR: u32 = 0x4002_1018;
const EXTI_IMR: u32 = 0x4001_3C00;
/// The compare register of the switches' filter, µs.
const TIM5_CCR2: u32 = 0x4000_0C38;
/// The counts of a pulse, 168 in a microsecond.
const TIM11_ARR: u32 = 0x4001_482C;
/// Power: the counts of a period, and the high counts.
const TIM4_ARR: u32 = 0x4000_082C;
const TIM4_CCR1: u32 = 0x4000_0834;
/// The control register of the DMA stream that stores the edges of steps.
const DMA1_S1CR: u32 = 0x4002_6028;
/// The number of the ticks' interrupt.
const TICK: u8 = 28;

/// All planted faults.
pub(crate) const PLANTED: &[Planted] = &[
    planted(
        "the wires of step and direction swapped",
        Fault::Swapped(Signal::StepX as usize, Signal::DirectionX as usize),
        "wires",
    ),
    planted(
        "the wire of power broken",
        Fault::Broken(Signal::Power as usize),
        "duty",
    ),
    planted(
        "the direction 5 us late",
        Fault::Late(Signal::DirectionX as usize, 840),
        "steps",
    ),
    planted(
        "edges not taken by DMA",
        tamper(DMA1_S1CR, |word| Some(word & !1)),
        "second motor",
    ),
    planted(
        "one tick 0.6 us late",
        Fault::Stall {
            irq: TICK,
            register: GPIOE_BSRR,
            cycles: 100,
        },
        "steps",
    ),
    planted(
        "the pulse a microsecond short",
        tamper(TIM11_ARR, |word| Some(word.wrapping_sub(168))),
        "steps",
    ),
    planted(
        "the pulse 5 us long",
        tamper(TIM11_ARR, |word| Some(word.wrapping_add(840))),
        "second motor",
    ),
    planted(
        "X makes no step where Y makes one",
        tamper(GPIOE_BSRR, |word| {
            Some(if word & 0x180 == 0x180 {
                word & !0x80
            } else {
                word
            })
        }),
        "steps",
    ),
    planted(
        "X makes no step where Y and Z make one",
        tamper(GPIOE_BSRR, |word| {
            Some(if word & 0x380 == 0x380 {
                word & !0x80
            } else {
                word
            })
        }),
        "highest rate",
    ),
    planted(
        "the direction of X stays positive",
        tamper(GPIOE_BSRR, |word| Some(word & !(1 << 10))),
        "steps",
    ),
    planted(
        "power a count off",
        tamper(TIM4_CCR1, |word| Some(word + 1)),
        "duty",
    ),
    planted(
        "the period of power a count off",
        tamper(TIM4_ARR, |word| Some(word + 1)),
        "duty",
    ),
    planted(
        "half the power in motion",
        tamper(TIM4_CCR1, |word| Some(word / 2)),
        "laser",
    ),
    planted(
        "the stop 50 us late",
        tamper(TIM5_CCR2, |word| Some(word.wrapping_add(50))),
        "stop",
    ),
    planted(
        "the reset button not listened to",
        tamper(EXTI_IMR, |word| Some(word & !(1 << 8))),
        "stop",
    ),
    planted("the crystal 1 % fast", Fault::Crystal(8_080_000), "clock"),
    planted(
        "a word of the flash takes 150 us, not 16",
        Fault::SlowFlash(150),
        "flash",
    ),
];

impl Planted {
    /// Plants the fault and runs the check that must find it. Returns the first row that does not
    /// hold.
    ///
    /// # Errors
    /// The check finds nothing.
    pub(crate) fn hold(&self, elf: &[u8], wires: &Wires) -> Result<String, Failure> {
        let Some(check) = CHECKS.iter().find(|check| check.name == self.found_by) else {
            return fail(format!("there is no check {}", self.found_by));
        };
        let mut link = Emulated::switch_on(elf, wires, self.fault)?;
        let mut board = Board::new(&mut link);
        board.hear_boot()?;
        let section = check.run(&mut board);
        let found = section.rows.iter().find(|row| !row.holds);
        match found {
            Some(row) => Ok(format!("{}: {}, {}", check.name, row.what, row.measured)),
            None => fail(format!("{}: not found", check.name)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_names_a_check_that_there_is_and_every_check_finds_a_fault() {
        let names = |check: &str| PLANTED.iter().filter(|one| one.found_by == check).count();
        assert!(CHECKS.iter().all(|check| names(check.name) > 0));
        let known: usize = CHECKS.iter().map(|check| names(check.name)).sum();
        assert_eq!(known, PLANTED.len());
    }
}
