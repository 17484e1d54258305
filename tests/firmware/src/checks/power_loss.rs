//! Settings in the flash: the power is lost during any operation of the flash.
use super::{stall, Figures};
use crate::{
    bench::{ensure, Bench, Failure},
    firmware::{Build, Firmware},
};
use leadscrew_f407emu::{FlashOperation, ResetCause, LSI_FASTEST_HZ};

/// The settings in the store before the change: none is a default.
const KNOWN: &str = "$30=12000\n$100=123.456\n$101=80\n$110=4000\n$120=77\n$N0=G54\nG10L2P1X1.5Y2.25\nG10L2P3Z-4\nG28.1\n$I=old\n";
/// Lines that each write a record: a setting, an offset, a startup line, the text of `$I`; and
/// lines that take many records away.
const WRITES: [&str; 8] = [
    "$100=250.125",
    "G10L2P1X-3.5Y0Z7",
    "$N0=G21G90G94G54G17(and no more than this)",
    "$I=a board on a bench",
    LONGEST,
    "$RST=$",
    "$RST=#",
    "$RST=*",
];
/// A startup line of 79 characters, the most that a line may have: the longest record.
pub(super) const LONGEST: &str = concat!(
    "$N1=G21G90G94G54G17G40G49G80F",
    "00000000000000000000000000000000000000000000001000"
);
/// A time longer than the pauses between the parts of a record, s.
const AFTER_SECONDS: f64 = 0.02;

/// All that is stored, as the machine reports it.
pub(super) fn stored(bench: &mut Bench) -> Result<Vec<String>, Failure> {
    let mut all = Vec::new();
    for question in ["$$", "$#", "$N", "$I"] {
        all.append(&mut bench.command(question)?);
    }
    all.retain(|line| line.starts_with(['$', '[']) && !line.starts_with("[MSG:"));
    Ok(all)
}

/// A board with something in its store.
pub(super) fn with_known(build: &Build) -> Result<Bench, Failure> {
    let mut bench = Bench::switch_on(build)?;
    bench.machine.set_lsi(LSI_FASTEST_HZ);
    bench.hear_banner()?;
    bench.commands(KNOWN)?;
    bench.machine.clear_records();
    Ok(bench)
}

/// Loses power at a cycle and switches on again. Returns the settings stored after that.
fn after_loss(mut bench: Bench, cycle: u64) -> Result<(Bench, Vec<String>), Failure> {
    bench.machine.reset_at(cycle, ResetCause::PowerOn);
    bench.run_to(cycle + 100)?;
    bench.hear_boot()?;
    let stored = stored(&mut bench)?;
    Ok((bench, stored))
}

/// Instants in an operation: before anything has happened, just after, in the middle, just before
/// the end.
fn instants(operation: &FlashOperation) -> [u64; 4] {
    let FlashOperation { begin, end, .. } = *operation;
    [begin, begin + 1, begin.midpoint(end), end - 1]
}

/// Checks that the store still works: it takes another change, which survives a loss of power.
fn ensure_usable(mut bench: Bench) -> Result<(), Failure> {
    bench.command("$121=55.5")?;
    let expected = stored(&mut bench)?;
    let now = bench.machine.cycle();
    let (_, found) = after_loss(bench, now + 1_000)?;
    ensure(found == expected, || differences(&found, &expected))
}

fn differences(found: &[String], expected: &[String]) -> String {
    let others = found.iter().filter(|line| !expected.contains(line));
    let missing = expected.iter().filter(|line| !found.contains(line));
    let (others, missing): (Vec<_>, Vec<_>) = (others.collect(), missing.collect());
    format!("found {others:?} in place of {missing:?}")
}

/// The number of times that the old settings, and that the new ones, were found after a loss of
/// power: never a mixture.
#[derive(Default)]
struct Found {
    old: usize,
    new: usize,
}

/// A change that writes the flash, started from the same instant each time.
struct Change<'a> {
    start: &'a Bench,
    /// Starts the change.
    begin: &'a dyn Fn(&mut Bench),
    old: &'a [String],
    new: &'a [String],
}

impl Change<'_> {
    /// Loses power at `cycle` after the change was started.
    fn cut(&self, cycle: u64, found: &mut Found) -> Result<Bench, Failure> {
        let mut bench = self.start.clone();
        (self.begin)(&mut bench);
        let (bench, stored) = after_loss(bench, cycle)?;
        if stored == self.new {
            found.new += 1;
        } else if stored == self.old {
            ensure(found.new == 0, || "the old value comes back".into())?;
            found.old += 1;
        } else {
            return Err(Failure(format!(
                "a mixture: {}",
                differences(&stored, self.new)
            )));
        }
        Ok(bench)
    }

    /// Loses power during every one of these operations, and after them.
    fn cut_at_all(&self, operations: &[FlashOperation]) -> Result<Found, Failure> {
        let mut found = Found::default();
        for operation in operations {
            for (index, cycle) in instants(operation).into_iter().enumerate() {
                let bench = self.cut(cycle, &mut found);
                let bench = bench.map_err(|Failure(words)| {
                    Failure(format!(
                        "power lost at instant {index} of {operation:x?}: {words}"
                    ))
                })?;
                if index == 2 {
                    ensure_usable(bench)?;
                }
            }
        }
        let end = operations.last().map_or(0, |operation| operation.end);
        self.cut(end, &mut found)?;
        Ok(found)
    }
}

/// The flash operations that a line causes, and the settings stored after it.
fn operations_of(start: &Bench, line: &str) -> Result<(Vec<FlashOperation>, Vec<String>), Failure> {
    let mut bench = start.clone();
    bench.command(line)?;
    let operations = bench.machine.flash_operations().to_vec();
    bench.run_for(AFTER_SECONDS)?;
    let all = bench.machine.flash_operations().len();
    ensure(all == operations.len(), || {
        format!("{line}: answered before it is stored")
    })?;
    ensure(!operations.is_empty(), || format!("{line} is not stored"))?;
    Ok((operations, stored(&mut bench)?))
}

pub(crate) fn power_loss(firmware: &Firmware) -> Result<Figures, Failure> {
    let start = with_known(firmware.build("fast")?)?;
    let old = stored(&mut start.clone())?;
    let mut figures = Figures::default();
    for line in WRITES {
        let (operations, new) = operations_of(&start, line)?;
        ensure(old != new, || format!("{line} changes nothing"))?;
        let change = Change {
            start: &start,
            begin: &|bench| bench.send(format!("{line}\n")),
            old: &old,
            new: &new,
        };
        let found = change.cut_at_all(&operations);
        let found = found.map_err(|failure| Failure(format!("{line}: {failure}")))?;
        ensure(found.old > 0 && found.new > 0, || {
            format!("{line}: never the old or never the new value")
        })?;
        figures.add(
            line,
            format!(
                "{} operations; {} times the old value, {} times the new one",
                operations.len(),
                found.old,
                found.new
            ),
        );
    }
    Ok(figures)
}

/// Bytes of a sector.
const SECTOR: u32 = 16 * 1024;
/// The most lines that it takes to fill a sector of 16 KiB.
const FILLING: u32 = 2_000;

/// Changes a setting until a sector is full. Returns the board before the line that changes to the
/// other sector, and that line.
pub(super) fn fill(mut bench: Bench) -> Result<(Bench, String), Failure> {
    for value in 0..FILLING {
        let line = format!("$102={}", 100 + value % 900);
        bench.machine.clear_records();
        let before = bench.clone();
        bench.command(&line)?;
        let operations = bench.machine.flash_operations();
        // A sector begins with its header.
        let copies = |operation: &FlashOperation| operation.address.is_multiple_of(SECTOR);
        if operations.iter().any(copies) {
            return Ok((before, line));
        }
    }
    Err(Failure("the sector never fills".into()))
}

/// Loses power at operations of the change from one sector to the other, and of the erase at the
/// next start-up.
pub(crate) fn sector_change(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let mut start = with_known(firmware.build("fast")?)?;
    start.commands("$100=250\nG91G1F3000")?;
    for name in [
        "the spare sector blank",
        "the spare sector full of old records",
    ] {
        let (before, line) = fill(start)?;
        let old = stored(&mut before.clone())?;
        let (operations, new) = operations_of(&before, &line)?;
        let change = Change {
            start: &before,
            begin: &|bench| bench.send(format!("{line}\n")),
            old: &old,
            new: &new,
        };
        let found = change.cut_at_all(&operations)?;
        let erased = operations
            .iter()
            .filter(|operation| operation.erases)
            .count();
        let waited = stall::ensure_window_survives(&before, &line)?;
        figures.add(
            "a full window of lines behind it",
            format!("none is lost, {:.0} ms", waited / 1000.0),
        );
        figures.add(
            name,
            format!("{} operations, {erased} of them an erase; {} times the old value, {} times the new one", operations.len(), found.old, found.new),
        );
        start = before;
        start.command(&line)?;
    }
    ensure(start.machine.resets().is_empty(), || {
        format!("{:?}", start.machine.resets())
    })?;
    figures.add(
        "the spare sector erased at start-up",
        at_start_up(&mut start)?,
    );
    Ok(figures)
}

fn at_start_up(start: &mut Bench) -> Result<String, Failure> {
    let all = stored(start)?;
    start.machine.clear_records();
    let restart = |bench: &mut Bench| {
        let now = bench.machine.cycle();
        bench.machine.reset_at(now + 1_000, ResetCause::Pin);
    };
    let mut booted = start.clone();
    restart(&mut booted);
    booted.run_for(0.001)?;
    booted.hear_boot()?;
    let operations = booted.machine.flash_operations().to_vec();
    ensure(operations.iter().any(|operation| operation.erases), || {
        "nothing is erased".into()
    })?;
    let change = Change {
        start,
        begin: &restart,
        old: &all,
        new: &all,
    };
    let found = change.cut_at_all(&operations)?;
    Ok(format!(
        "{} operations, {} times all that was stored",
        operations.len(),
        found.new
    ))
}
