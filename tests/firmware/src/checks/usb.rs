//! The second serial line: USB, with a host at the other end of the cable.
use super::{
    floods::floods,
    stopping::{last_step, moving},
    Figures,
};
use crate::{
    bench::{ensure, fail, micros_between, Bench, Failure, BANNER},
    compare, desk,
    firmware::{Build, Firmware},
    job::Job,
    pins::{LINE, POWER},
    steps::{jitter, Step},
    stream::Stream,
};
use leadscrew_sim::Rate;

/// The time between two status queries, s.
const POLL_SECONDS: f64 = 0.1;
/// The most by which the time of a job may be off, as a share.
const TOLERANCE: f64 = 0.01;
/// The most by which step edges may be off the schedule, cycles.
const JITTER: u32 = 40;
/// The longest time from the sending of 0x18 to the last step edge, µs: 1000, and the packets in
/// front of it.
const RESET_US: f64 = 1_000.0;
/// Other bytes in front of 0x18.
const BEFORE: usize = 300;
/// The device's identification, as docs/hardware.md has it.
const VENDOR: u16 = 0x16C0;
/// The number of the emulated chip as three little-endian words, the last one first.
const SERIAL: &str = "37303477657263736461656C";
const PRODUCT: u16 = 0x27DD;
/// The number of `$$` lists that nobody reads for a while, six times the board's output buffer; and
/// the rows of one list.
const LISTS: usize = 10;
const ROWS: usize = 34;
/// A job that goes on for a second after the cable is pulled.
const LONG: &str = "G91 G1 X30 F1500";

/// Checks the device's description to the host: a serial device, whose descriptors state the right
/// lengths.
fn descriptors(bench: &Bench) -> Result<(), Failure> {
    let answers = bench.machine.usb_answers();
    // Behind the configuration: the languages, the maker, the product, the serial number.
    let [_, _, device, _, configuration, _, _, _, serial, ..] = answers else {
        return fail(format!("too few answers: {answers:02x?}"));
    };
    let word = |bytes: &[u8], at: usize| {
        bytes
            .get(at..at + 2)
            .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
    };
    // USB 2.0 tables 9-8 and 9-10; class 2 is a communications device.
    let whole = device.len() == 18 && device[4] == 2;
    let ours = word(device, 8) == Some(VENDOR) && word(device, 10) == Some(PRODUCT);
    // A string (USB 2.0 table 9-16) of the chip's 96 bits, the highest first: `leadscrew407`.
    let digits: Vec<u8> = SERIAL.bytes().flat_map(|digit| [digit, 0]).collect();
    let named = device[16] == 3 && serial[..] == [&[50, 3], &digits[..]].concat();
    ensure(named, || {
        format!("serial number: {device:02x?} {serial:02x?}")
    })?;
    let total = word(configuration, 2).map(usize::from);
    ensure(whole && ours && total == Some(configuration.len()), || {
        format!("descriptors: {device:02x?} {configuration:02x?}")
    })
}

/// A board whose greeting at start has come over USB.
pub(super) fn plugged(build: &Build) -> Result<Bench, Failure> {
    let mut bench = Bench::boot(build)?;
    bench.plug_usb()?;
    bench.hear_until(0.1, |line| line == BANNER)?;
    Ok(bench)
}

/// Streams an example over USB, with queries on both lines. Returns its steps.
fn stream(bench: &Bench, job: &Job) -> Result<Vec<Step>, Failure> {
    let mut bench = bench.clone();
    bench.ignore_power();
    bench.commands(&job.settings)?;
    bench.pins.clear();
    bench.machine.uart_out(LINE).clear();
    bench.machine.uart_send(LINE, &b"?".repeat(200));
    bench.stream(&Stream::new(&job.program).polling(POLL_SECONDS))?;
    let other = String::from_utf8_lossy(bench.machine.uart_out(LINE)).into_owned();
    ensure(other.contains('<') && !other.contains("ok"), || {
        format!("the other line heard {other:?}")
    })?;
    Ok(std::mem::take(&mut bench.pins.steps))
}

fn jobs(bench: &Bench, figures: &mut Figures) -> Result<(), Failure> {
    for name in ["raster.nc", "drill_dip14.nc"] {
        let job = Job::example(name)?;
        let steps = stream(bench, &job)?;
        let planned = desk::plan(&job.settings, &job.program, Rate::NeverWaits)?;
        let ratio = compare::in_path(&steps, &planned, TOLERANCE)?;
        let jitter = jitter(&steps);
        figures.add(
            format!("{name} over USB"),
            format!(
                "{} step events, {:+.3} % of the time, jitter {jitter} cycles",
                steps.len(),
                100.0 * (ratio - 1.0)
            ),
        );
        ensure(jitter <= JITTER, || figures.to_string())?;
    }
    Ok(())
}

/// Sends 0x18 behind other bytes, in motion.
fn reset(build: &Build, figures: &mut Figures) -> Result<(), Failure> {
    let mut bench = moving(build, 0.4)?;
    bench.plug_usb()?;
    // Hear the lines that have waited since power-up.
    bench.hear_until(0.1, |line| line == BANNER)?;
    let mut bytes = b"(traffic)\n".repeat(BEFORE / 10);
    bytes.push(0x18);
    let sent = bench.machine.cycle();
    bench.send(bytes);
    bench.hear_until(0.1, |line| line == BANNER)?;
    bench.run_for(0.3)?;
    let stopped = micros_between(sent, last_step(&bench));
    figures.add(
        format!("0x18 behind {BEFORE} bytes"),
        format!("last step edge {stopped:.0} us after the first of them was sent"),
    );
    ensure(stopped <= RESET_US, || figures.to_string())
}

/// The cable is pulled while motors step, and plugged in again.
fn pulled(bench: &Bench, figures: &mut Figures) -> Result<(), Failure> {
    let mut bench = bench.clone();
    bench.command(LONG)?;
    bench.run_for(0.2)?;
    bench.unplug_usb();
    bench.machine.uart_out(LINE).clear();
    let before = bench.wait_for("Run", 0.1)?;
    let after = bench.wait_for("Idle", 5.0)?;
    ensure(after.contains("MPos:30.000,0.000,0.000"), || {
        format!("the job did not go on: {before} {after}")
    })?;
    bench.plug_usb()?;
    let again = bench.wait_for("Idle", 0.1)?;
    bench.command("G91 G0 X-1")?;
    figures.add("cable pulled and plugged in again", again);
    Ok(())
}

/// A job that leaves a laser lit at rest; no silence of the sender switches it off.
const LIT: &str = "$32=1\n$707=0\n$110=3000\n$120=4000\nG91 M3 S1000\nG1 X1 F3000\n";
/// A time of silence after which a device cannot know that its host is gone, s: it knows after 6 ms
/// (RM0090 section 34.5.2).
const TOO_SHORT_TO_SUSPEND: f64 = 5e-3;
/// The longest time from the end of [`TOO_SHORT_TO_SUSPEND`] until the laser is off, s: the rest of
/// the 6 ms, and turns of the main loop.
const M5_SECONDS: f64 = 3e-3;
/// The time in which the host sees the device, waits and resets the bus, s.
const BUS_RESET_SECONDS: f64 = 0.12;

/// The cable is pulled, or the host resets the bus, while a laser that was lit over USB stands
/// still: M5 must follow.
fn left_lit(bench: &Bench, figures: &mut Figures) -> Result<(), Failure> {
    let mut bench = bench.clone();
    bench.ignore_power();
    bench.commands(LIT)?;
    bench.wait_for("Idle", 2.0)?;
    let is_lit = |bench: &Bench| bench.machine.level(POWER);
    ensure(is_lit(&bench), || "the laser is off".into())?;
    for (name, comes_back, seconds) in [
        ("cable pulled", false, M5_SECONDS),
        ("bus reset", true, BUS_RESET_SECONDS),
    ] {
        let mut bench = bench.clone();
        bench.unplug_usb();
        bench.run_for(TOO_SHORT_TO_SUSPEND)?;
        ensure(is_lit(&bench), || format!("{name}: dark at once"))?;
        if comes_back {
            bench.machine.usb_plug(true);
        }
        bench.run_for(seconds)?;
        ensure(!is_lit(&bench), || format!("{name}: the laser stays lit"))?;
        let modes = bench.say("$G")?.concat();
        ensure(modes.contains(" M5 "), || format!("{name}: {modes}"))?;
        figures.add(format!("{name}, laser lit at rest"), "M5");
    }
    Ok(())
}

/// A host that does not read blocks nobody else, and finds all answers when it reads again.
fn unread(bench: &Bench, figures: &mut Figures) -> Result<(), Failure> {
    let mut bench = bench.clone();
    bench.machine.usb_read(false);
    bench.send("$$\n".repeat(LISTS));
    bench.run_for(0.1)?;
    bench.machine.uart_out(LINE).clear();
    bench.machine.uart_send(LINE, b"$G\n");
    bench.run_for(0.1)?;
    let other = String::from_utf8_lossy(bench.machine.uart_out(LINE)).into_owned();
    ensure(other.contains("[GC:") && other.contains("ok"), || {
        format!("the other line heard {other:?}")
    })?;
    bench.machine.usb_read(true);
    bench.run_for(0.2)?;
    let heard = bench.heard();
    let count = |begin: &str| heard.iter().filter(|line| line.starts_with(begin)).count();
    let (oks, rows) = (count("ok"), count("$"));
    figures.add(
        "read late",
        format!("{oks} lists, {rows} rows, the other line answered meanwhile"),
    );
    ensure(oks == LISTS && rows == LISTS * ROWS, || {
        format!("{oks} answers and {rows} rows: {heard:?}")
    })
}

pub(crate) fn usb(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let bench = plugged(firmware.build("usual")?)?;
    descriptors(&bench)?;
    jobs(&bench, &mut figures)?;
    reset(firmware.build("usual")?, &mut figures)?;
    pulled(&bench, &mut figures)?;
    left_lit(&bench, &mut figures)?;
    unread(&bench, &mut figures)?;
    floods(firmware.build("fast")?, &mut figures)?;
    Ok(figures)
}
