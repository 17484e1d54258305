//! Replaces every store of the step interrupts to a timer or to a port by an instruction that does
//! nothing, one at a time: a flag is not cleared, a compare is not set, a pin does not fall. Other
//! faults: `planted`.
use super::Figures;
use crate::{
    bench::{ensure, Bench, Failure},
    compare, desk,
    firmware::{Build, Firmware},
    job::Job,
    pins::{PULSE_IRQ, STEP_IRQ},
    steps::Step,
    stream::Stream,
};
use leadscrew_f407emu::{Exception, Machine};
use leadscrew_sim::Rate;
use std::collections::BTreeSet;

/// The registers of the step timer (TIM2), of the timer that ends pulses (TIM11), and of the ports.
const TIMER: std::ops::Range<u32> = 0x4000_0000..0x4000_0400;
const PULSE_TIMER: std::ops::Range<u32> = 0x4001_4800..0x4001_4C00;
const PORTS: std::ops::Range<u32> = 0x4002_0000..0x4002_2400;

/// The number of stores whose absence this job cannot show. One arms the first tick: the main loop
/// looks for a tick that has not come, and makes it. One masks the compare at the end of the job:
/// without it the next match comes only after 51 s.
const EQUIVALENT: usize = 2;

/// A job there and back, with a corner.
fn job() -> Job {
    Job::new(
        "stores",
        "$0=5\n$701=300\n$120=500\n$121=500\n$122=500\n",
        "G91G1X2Y-1Z0.5F900\nX-2Y-1\nX1Y2\n",
    )
}

/// The stores of the step interrupts during the job: the address of each instruction, and the
/// register that it writes.
fn stores(build: &Build) -> Result<BTreeSet<(u32, u32)>, Failure> {
    let ranges = [TIMER, PULSE_TIMER, PORTS];
    let mut all = BTreeSet::new();
    for irq in [STEP_IRQ, PULSE_IRQ] {
        let mut bench = Bench::boot(build)?;
        bench.commands(&job().settings)?;
        bench.machine.record_writers(Exception::irq(irq));
        bench.stream(&Stream::new(&job().program))?;
        all.extend(bench.machine.writers());
    }
    all.retain(|(_, register)| ranges.iter().any(|range| range.contains(register)));
    Ok(all)
}

/// Replaces the instruction at an address by one that does nothing. Replaces it in the flash,
/// before the program has copied it to SRAM.
fn plant(machine: &mut Machine, build: &Build, address: u32) -> Result<(), Failure> {
    const NARROW: [u8; 2] = [0x00, 0xBF];
    const WIDE: [u8; 4] = [0xAF, 0xF3, 0x00, 0x80];
    let address = build.load_address(address)?;
    let offset = (address - 0x0800_0000) as usize;
    let is_wide = machine.flash()[offset + 1] >= 0xE8;
    if is_wide {
        machine.program_flash(address, &WIDE);
    } else {
        machine.program_flash(address, &NARROW);
    }
    Ok(())
}

/// Runs the job and compares it with the simulator's. Replaces the instruction at `fault` first, if
/// there is one.
fn run(build: &Build, fault: Option<u32>) -> Result<(), Failure> {
    let job = job();
    let mut bench = Bench::switch_on(build)?;
    if let Some(address) = fault {
        plant(&mut bench.machine, build, address)?;
    }
    bench.hear_banner()?;
    bench.ignore_power();
    bench.commands(&job.settings)?;
    bench.pins.clear();
    Stream::new(&job.program).send_all(&mut bench)?;
    bench.wait_for("Idle", 5.0)?;
    let pulse = bench.pins.extremes.pulse;
    ensure(pulse >= 5 * 168, || format!("a pulse of {pulse} cycles"))?;
    let steps: &[Step] = &bench.pins.steps;
    compare::to_the_tick(
        steps,
        &desk::plan(&job.settings, &job.program, Rate::NeverWaits)?,
    )?;
    Ok(())
}

pub(crate) fn left_out(firmware: &Firmware) -> Result<Figures, Failure> {
    let build = firmware.build("usual")?;
    run(build, None)?;
    let stores = stores(build)?;
    let mut figures = Figures::default();
    let mut survivors = Vec::new();
    for (address, register) in &stores {
        let found = run(build, Some(*address));
        let name = format!("{register:#010x} not written at {address:#010x}");
        match found {
            Err(failure) => figures.add(name, failure.0.chars().take(120).collect::<String>()),
            Ok(()) => survivors.push(name),
        }
    }
    ensure(stores.len() >= 5, || {
        format!("only {} stores found", stores.len())
    })?;
    ensure(survivors.len() <= EQUIVALENT, || {
        format!("not found: {survivors:#?}\n{figures}")
    })?;
    for name in survivors {
        figures.add(name, "makes no difference to this job");
    }
    Ok(figures)
}
