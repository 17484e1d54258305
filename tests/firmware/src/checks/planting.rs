//! Replaces instructions while the firmware runs, to have the effect of a bug at a chosen instant,
//! and waits for the restart after it.
use super::stopping::{last_step, power_edge};
use crate::{
    bench::{cycles, ensure, Bench, Failure},
    firmware::Build,
    pins::STEP_IRQ,
    wiring::FLASH,
};
use object::{Object, ObjectSection, ObjectSymbol};

/// The longest time until the reset comes, s.
const RESET_SECONDS: f64 = 0.1;
/// Instants after the start at which the bug takes effect, s: in the ramp and in the cruise.
pub(super) const INSTANTS: [f64; 2] = [0.03, 0.4007];
/// The instruction `b .`, an endless loop.
pub(super) const FOR_EVER: [u16; 1] = [0xE7FE];

/// Makes something happen in a few cycles. Returns the part of the program that was replaced for
/// this, if any.
pub(super) type Event = fn(&mut Bench, &Build) -> Result<Option<Replaced>, Failure>;

/// The original bytes of a part of the program.
pub(super) struct Replaced {
    address: u32,
    bytes: Vec<u8>,
}

/// Waits until the main loop sleeps, replaces the next instructions that it will carry out, and
/// waits until the core reaches them. Whatever event comes next wakes the main loop.
pub(super) fn plant(bench: &mut Bench, halfwords: &[u16]) -> Result<Option<Replaced>, Failure> {
    wait_until(bench, |bench| bench.machine.is_asleep())?;
    let address = bench.machine.pc();
    let replaced = replace(bench, address, halfwords)?;
    wait_until(bench, |bench| {
        !bench.machine.is_asleep() && bench.machine.pc() == address
    })?;
    Ok(replaced)
}

/// Runs instruction by instruction until `is_there` holds, 10 ms at most.
fn wait_until(bench: &mut Bench, is_there: impl Fn(&Bench) -> bool) -> Result<(), Failure> {
    let end = bench.machine.cycle() + cycles(0.01);
    while !is_there(bench) {
        ensure(bench.machine.cycle() < end, || {
            format!(
                "the main loop does not get there; at {:#x}",
                bench.machine.pc()
            )
        })?;
        bench.run_to(bench.machine.cycle() + 1)?;
    }
    Ok(())
}

fn replace(
    bench: &mut Bench,
    address: u32,
    halfwords: &[u16],
) -> Result<Option<Replaced>, Failure> {
    // A literal in the code must begin at a word address.
    let nop = (!address.is_multiple_of(4)).then_some(&0xBF00);
    let bytes: Vec<u8> = nop
        .into_iter()
        .chain(halfwords)
        .flat_map(|half| half.to_le_bytes())
        .collect();
    if address < FLASH {
        // This code is in SRAM: the next start copies it there anew.
        bench.machine.poke(address, &bytes);
        return Ok(None);
    }
    let offset = usize::try_from(address.wrapping_sub(FLASH))?;
    let before = bench.machine.flash().get(offset..offset + bytes.len());
    let before = before.ok_or_else(|| Failure(format!("{address:#x} is not in the flash")))?;
    let replaced = Replaced {
        address,
        bytes: before.to_vec(),
    };
    bench.machine.program_flash(address, &bytes);
    Ok(Some(replaced))
}

/// Replaces the first instructions of the step interrupt.
pub(super) fn plant_in_step_interrupt(
    bench: &mut Bench,
    halfwords: &[u16],
) -> Result<Option<Replaced>, Failure> {
    let vector = (16 + usize::from(STEP_IRQ)) * 4;
    let handler = bench.machine.flash().get(vector..vector + 4);
    let handler = handler
        .and_then(|bytes| bytes.try_into().ok())
        .map_or(0, u32::from_le_bytes);
    replace(bench, handler & !1, halfwords)
}

/// Waits for the reset, restores the program, and hears the machine's messages.
pub(super) fn hear_restart(
    bench: &mut Bench,
    replaced: Option<Replaced>,
) -> Result<Vec<String>, Failure> {
    let end = bench.machine.cycle() + cycles(RESET_SECONDS);
    while bench.machine.resets().is_empty() {
        ensure(bench.machine.cycle() < end, || {
            format!("no reset; at {:#x}", bench.machine.pc())
        })?;
        bench.run_to(bench.machine.cycle() + 100)?;
    }
    restore(bench, replaced);
    bench.hear_boot()
}

/// Puts the original bytes back.
pub(super) fn restore(bench: &mut Bench, replaced: Option<Replaced>) {
    if let Some(Replaced { address, bytes }) = replaced {
        bench.machine.program_flash(address, &bytes);
    }
}

/// The code of `ldr r0, [pc]; bx r0`, with the address `to` behind it.
pub(super) fn jump(to: u32) -> [u16; 4] {
    let to = to | 1;
    [0x4800, 0x4700, to as u16, (to >> 16) as u16]
}

/// The address of code that panics because it would divide by zero: it loads the place of the
/// division, and calls the panic.
pub(super) fn panic_site(elf: &[u8]) -> Result<u32, Failure> {
    let file = object::File::parse(elf)?;
    let missing = || Failure("the ELF has no division that panics".into());
    let panic = file
        .symbols()
        .find(|symbol| {
            let name = symbol.name().unwrap_or_default();
            name.contains("panic_const_div_by_zero") && !name.contains("Thunk")
        })
        .ok_or_else(missing)?;
    let panic = u32::try_from(panic.address())? & !1;
    let text = file.section_by_name(".text").ok_or_else(missing)?;
    let bytes = text.data()?;
    let halves: Vec<u16> = bytes
        .chunks_exact(2)
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect();
    let begin = u32::try_from(text.address())?;
    let address = |index: usize| begin + 2 * index as u32;
    let calls = (1..halves.len() - 1)
        .filter(|index| called(address(*index), halves[*index], halves[index + 1]) == Some(panic));
    // The place of the division is r0: a word beside the code, or two halves.
    let site = calls.into_iter().find_map(|index| match halves[..index] {
        [.., load] if load >> 8 == 0x48 => Some(address(index - 1)),
        [.., low, _, high, _] if low & 0xFBF0 == 0xF240 && high & 0xFBF0 == 0xF2C0 => {
            Some(address(index - 4))
        }
        _ => None,
    });
    site.ok_or_else(missing)
}

/// The address that `BL` at `address` calls, if these are its halves (DDI 0403 section A7.7.18).
fn called(address: u32, high: u16, low: u16) -> Option<u32> {
    if high & 0xF800 != 0xF000 || low & 0xD000 != 0xD000 {
        return None;
    }
    let (high, low) = (u32::from(high), u32::from(low));
    let sign = high >> 10 & 1;
    let bit = |place: u32| !(low >> place ^ sign) & 1;
    let offset =
        sign << 24 | bit(13) << 23 | bit(11) << 22 | (high & 0x3FF) << 12 | (low & 0x7FF) << 1;
    let offset = (offset << 7).cast_signed() >> 7;
    Some((address + 4).wrapping_add_signed(offset))
}

/// Returns how long steps and laser went on after the cycle `began`, µs.
pub(super) fn went_on(bench: &Bench, began: u64, hz: f64) -> Result<(f64, f64), Failure> {
    let micros = |cycle: u64| cycle.saturating_sub(began) as f64 * 1e6 / hz;
    Ok((micros(last_step(bench)), micros(power_edge(bench)?.cycle)))
}
