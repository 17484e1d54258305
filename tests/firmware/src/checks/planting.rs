//! Replaces instructions while the firmware runs, to have the effect of a bug at a chosen instant,
//! and waits for the restart after it.
use super::stopping::{last_step, power_edge};
use crate::{
    bench::{cycles, ensure, Bench, Failure},
    firmware::Build,
    pins::STEP_IRQ,
    wiring::FLASH,
};
use object::{Object, ObjectSymbol};

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
    if let Some(replaced) = replaced {
        bench
            .machine
            .program_flash(replaced.address, &replaced.bytes);
    }
    bench.hear_boot()
}

/// The code of `ldr r0, [pc]; bx r0`, with the address `to` behind it.
pub(super) fn jump(to: u32) -> [u16; 4] {
    let to = to | 1;
    [0x4800, 0x4700, to as u16, (to >> 16) as u16]
}

/// The address of the panic handler.
pub(super) fn panic_handler(elf: &[u8]) -> Result<u32, Failure> {
    let file = object::File::parse(elf)?;
    let mut symbols = file.symbols();
    let symbol = symbols.find(|symbol| {
        let name = symbol.name().unwrap_or_default();
        name.contains("rust_begin_unwind")
    });
    let symbol = symbol.ok_or_else(|| Failure("the ELF has no handler of panics".into()))?;
    Ok(u32::try_from(symbol.address())? & !1)
}

/// How long steps and laser went on after the cycle `began`, µs.
pub(super) fn went_on(bench: &Bench, began: u64, hz: f64) -> Result<(f64, f64), Failure> {
    let micros = |cycle: u64| cycle.saturating_sub(began) as f64 * 1e6 / hz;
    Ok((micros(last_step(bench)), micros(power_edge(bench)?.cycle)))
}
