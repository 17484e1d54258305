//! Runs firmware for a while and prints what it did:
//! `cargo run --release -p leadscrew-f407emu --example run -- ELF [MILLISECONDS [LINE]...]`.
//!
//! The lines go to USART2 at PA2 and PA3, each after the answer to the line before (a line with `ok`). Each line
//! has the given time, MILLISECONDS, to be answered.
use leadscrew_f407emu::{Exception, Machine, Pin, SerialLine, SerialPort, Stop};
use std::{env, error::Error, fs, time::Instant};

const CRYSTAL_HZ: u32 = 8_000_000;
const LINE: SerialLine = SerialLine {
    port: SerialPort::Usart2,
    output: Pin::new('A', 2),
    input: Pin::new('A', 3),
};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [elf, rest @ ..] = arguments.as_slice() else {
        return Err("usage: run ELF [MILLISECONDS [LINE]...]".into());
    };
    let milliseconds: u64 = rest.first().map_or(Ok(100), |word| word.parse())?;
    let mut machine = Machine::new(CRYSTAL_HZ);
    machine.plug_serial(LINE);
    machine.load_elf(&fs::read(elf)?)?;
    let started = Instant::now();
    machine.run_until(CRYSTAL_HZ.into())?;
    for line in rest.iter().skip(1) {
        machine.uart_send(LINE, format!("{line}\n").as_bytes());
        wait(&mut machine, milliseconds)?;
    }
    wait(&mut machine, milliseconds)?;
    report(&machine, started.elapsed().as_secs_f64());
    Ok(())
}

/// Runs until the firmware has answered, for `milliseconds` at most, and prints the answer.
fn wait(machine: &mut Machine, milliseconds: u64) -> Result<(), Stop> {
    let cycles = milliseconds * u64::from(machine.clocks().hclk) / 1000;
    let end = machine.cycle() + cycles;
    while machine.cycle() < end && !machine.uart_out(LINE).ends_with(b"\n") {
        machine.run_until(end.min(machine.cycle() + 20_000))?;
    }
    let said = std::mem::take(machine.uart_out(LINE));
    print!("{}", String::from_utf8_lossy(&said));
    Ok(())
}

fn report(machine: &Machine, seconds: f64) {
    let (cycles, instructions) = (machine.cycle(), machine.instructions());
    let mips = instructions as f64 / seconds / 1e6;
    println!("{cycles} cycles, {} of them asleep", machine.slept());
    println!("{instructions} instructions in {seconds:.2} s: {mips:.1} million a second");
    for irq in 0..82 {
        let profile = machine.profile(Exception::irq(irq));
        if profile.count > 0 {
            println!(
                "interrupt {irq}: {} times, {} to {} cycles, at most {} instructions",
                profile.count, profile.min, profile.max, profile.max_instructions
            );
        }
    }
    for warning in machine.warnings() {
        println!("warning: {warning}");
    }
    println!("{} edges", machine.edges().len());
}
