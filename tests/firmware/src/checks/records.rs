//! Builds without pins: each board's record makes them that board's, and without a sound record
//! nothing moves.
use super::{
    boards::{self, AWAY, MORE_POWER, SKR_2_POWER},
    homing::Belts,
    interrupts::{middle_and_most, Interrupts},
    start_up, timing, Figures,
};
use crate::{
    bench::{ensure, fail, Bench, Failure},
    firmware::{Build, Firmware},
    wiring::{
        Wiring, BLACK_F407VE, DISCOVERY, DUAL_Y, FLY_407ZG, FLY_SUPER_8, MACHINE_003, OCTOPUS,
        ROBIN_NANO_V3, SKR_2, SPIDER,
    },
};
use leadscrew_boards::Board;
use leadscrew_f407emu::{Pin, ResetCause};
use leadscrew_record::{Refusal, FIXED, SETTINGS, SLOTS};
use std::path::Path;

/// The longest time from reset until a pin that could do harm is driven and off, µs: the firmware
/// checks the record before.
const DRIVEN_US: f64 = 50.0;
/// As [`DRIVEN_US`], with as many settings as a record may have.
const DRIVEN_LONGEST_US: f64 = 150.0;
/// The most that a tick which loads a segment may take, cycles: the time of a line in
/// `StepTiming::F407_RECORD`.
const LOADING: u64 = 554;
/// As [`LOADING`], with four motors.
const LOADING_FOUR: u64 = 722;
/// The share by which a tick may take longer than with pins that are compiled in, per cent.
const DEARER_PERCENT: u64 = 10;
/// Levels of the power of the Discovery and of machine 003, which have TIM4 and TIM1.
const DISCOVERY_POWER: (u64, u64) = (10_000, 8_400);
const MACHINE_003_POWER: (u64, u64) = (10_000, 16_800);

const ALL: &str = "<Idle|MPos:-1.000,-1.000,-1.000|";
const ONLY_Z: &str = "<Idle|MPos:0.000,0.000,-1.000|";

/// The power of boards that are run by their records alone: timers on APB1.
const BY_RECORD_POWER: (u64, u64) = (10_000, 8_400);

/// The boards of three motors: their pins, their power, and where they are once they are home.
fn all() -> [(&'static str, &'static Wiring, (u64, u64), &'static str); 9] {
    let [octopus, fly, spider, nano] = MORE_POWER.map(|(_, power)| power);
    [
        ("discovery", &DISCOVERY, DISCOVERY_POWER, ALL),
        ("machine-003", &MACHINE_003, MACHINE_003_POWER, ONLY_Z),
        ("skr-2", &SKR_2, SKR_2_POWER, ALL),
        ("octopus", &OCTOPUS, octopus, ALL),
        ("fly-407zg", &FLY_407ZG, fly, ALL),
        ("spider", &SPIDER, spider, ALL),
        ("robin-nano-v3", &ROBIN_NANO_V3, nano, ALL),
        ("fly-super8", &FLY_SUPER_8, BY_RECORD_POWER, ALL),
        ("black-f407ve", &BLACK_F407VE, BY_RECORD_POWER, ALL),
    ]
}

/// One build serves all boards with the same start address. It must drive each of them as a build
/// for this board alone does.
pub(crate) fn records(firmware: &Firmware) -> Result<Figures, Failure> {
    let [x, y, z, _] = AWAY;
    let mut figures = Figures::default();
    for (name, wiring, power, homed) in all() {
        let build = firmware.recorded(name, wiring)?;
        let named = |Failure(words)| Failure(format!("{name}: {words}"));
        let safe = start_up::ensure_off_within(&build, &[], DRIVEN_US).map_err(named)?;
        let works = boards::ensure_works(&build, Belts::Straight, power, [x, y, z], homed);
        figures.add(name, format!("{}; {safe}", works.map_err(named)?));
    }
    let longest = longest(firmware)?;
    let safe = start_up::ensure_off_within(&longest, &[], DRIVEN_LONGEST_US)?;
    figures.add(format!("{SETTINGS} settings"), safe);
    Ok(figures)
}

/// Lines that are answered by the machine's axes, and by their settings.
const OF_AXES: [&str; 9] = [
    "$I",
    "$$",
    "$+",
    "$ES",
    "$#",
    "$103",
    "$103=1",
    "G1A1F100",
    "$J=A1F100",
];

/// Checks that two builds answer alike, to the byte.
fn ensure_alike(one: &Build, other: &Build) -> Result<(), Failure> {
    let (mut one, mut other) = (Bench::boot(one)?, Bench::boot(other)?);
    for line in OF_AXES {
        let (expected, found) = (one.say(line)?, other.say(line)?);
        ensure(expected == found && !found.is_empty(), || {
            format!("{line}: {expected:?}, from its record {found:?}")
        })?;
    }
    Ok(())
}

/// One build serves all machines with four motors. With the record of a machine it must do the same
/// as a build with this machine's pins compiled in.
pub(crate) fn machines(firmware: &Firmware) -> Result<Figures, Failure> {
    let [x, y, z, _] = AWAY;
    let power = SKR_2_POWER;
    let mut figures = Figures::default();
    for (name, wiring, wired) in [
        ("skr-2", &SKR_2, firmware.build("skr-2")?),
        ("skr-2-dual-y", &DUAL_Y, firmware.build("dual-y")?),
        ("skr-2-core-xy", &SKR_2, firmware.build("core-xy")?),
    ] {
        let build = firmware.of_four_motors(name, wiring)?;
        let works = || {
            let safe = start_up::ensure_off_within(&build, &[], DRIVEN_US)?;
            ensure_alike(wired, &build)?;
            let works = match name {
                "skr-2-dual-y" => boards::ensure_works(&build, Belts::Straight, power, AWAY, ALL)?,
                "skr-2-core-xy" => {
                    boards::ensure_works(&build, Belts::Crossed, power, [x, y, z], ALL)?
                }
                _ => boards::ensure_works(&build, Belts::Straight, power, [x, y, z], ALL)?,
            };
            Ok(format!("{works}; {safe}"))
        };
        let named = |Failure(words)| Failure(format!("{name}: {words}"));
        figures.add(name, works().map_err(named)?);
    }
    figures.add("four axes", four_axes(firmware)?);
    Ok(figures)
}

/// The machine with a fourth axis, from a record.
fn four_axes(firmware: &Firmware) -> Result<String, Failure> {
    let profile = boards::FOUR_AXES.profile()?;
    let board = Board::find("skr-2", Path::new("")).map_err(Failure)?;
    let record = profile.fitted(&board)?.record_for(&profile.recorded()?)?;
    let build = firmware.four_motors(&record)?;
    // The file has more settings than the board's.
    let safe = start_up::ensure_off_within(&build, &[], DRIVEN_LONGEST_US)?;
    let works = boards::ensure_axes(&build, &boards::FOUR_AXES)?;
    Ok(format!("{works}; {safe}"))
}

/// The Discovery with the longest record: settings that no machine has.
fn longest(firmware: &Firmware) -> Result<Build, Failure> {
    const UNKNOWN: usize = 900;
    let mut board = Board::find("discovery", Path::new("")).map_err(Failure)?;
    let settings = (UNKNOWN..UNKNOWN + SETTINGS).map(|number| (format!("${number}"), 1));
    board.defaults = settings.collect();
    let record = board.record().map_err(|why| Failure(why.to_string()))?;
    Ok(firmware
        .recorded("discovery", &DISCOVERY)?
        .with_record(&record))
}

/// The cost of pins that are not compiled in: on a board with all steps on one port, and on one with
/// three, with three motors and with four.
pub(crate) fn interrupt(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let mut costs = Vec::new();
    let (skr_2, dual_y) = (firmware.build("skr-2")?, firmware.build("dual-y")?);
    let recorded = |name, wiring| firmware.recorded(name, wiring);
    for (name, wired, build, most) in [
        (
            "discovery",
            firmware.build("usual")?,
            recorded("discovery", &DISCOVERY)?,
            LOADING,
        ),
        ("skr-2", skr_2, recorded("skr-2", &SKR_2)?, LOADING),
        (
            "skr-2-dual-y",
            dual_y,
            firmware.of_four_motors("skr-2-dual-y", &DUAL_Y)?,
            LOADING_FOUR,
        ),
    ] {
        let (before, compiled_in) = timing::measure(wired)?;
        let (after, recorded) = timing::measure(&build)?;
        figures.add(format!("{name}, compiled in"), format!("\n{compiled_in}"));
        figures.add(format!("{name}, from its record"), format!("\n{recorded}"));
        let middle = |interrupts: &Interrupts| middle_and_most(&interrupts.stepping).0;
        let longest = (after.longest(), most);
        costs.push((name, middle(&before), middle(&after), longest));
    }
    for (name, before, tick, (longest, most)) in costs {
        ensure(100 * tick <= (100 + DEARER_PERCENT) * before, || {
            format!("{name}: a tick takes {tick} cycles in place of {before}\n{figures}")
        })?;
        ensure(longest <= most, || {
            format!("{name}: a tick takes {longest} cycles\n{figures}")
        })?;
    }
    // A fourth motor that is absent costs as much as one that is there.
    let absent = firmware.of_four_motors("skr-2", &SKR_2)?;
    let longest = Interrupts::of(&timing::busy_with_three_motors(&absent)?).longest();
    figures.add(
        "skr-2, without its fourth motor",
        format!("{longest} cycles at most"),
    );
    ensure(longest <= LOADING_FOUR, || format!("{figures}"))?;
    Ok(figures)
}

/// A record that is wrong, and what the operator is told.
struct Wrong {
    what: &'static str,
    record: Vec<u8>,
    told: Refusal,
}

/// Wrong records for a board: none, one of another version, one with another length, ones with one
/// wrong bit, and one for four motors.
fn wrong(right: &[u8], other: Vec<u8>) -> Vec<Wrong> {
    const LENGTH: usize = 10;
    const SAFE_PINS: usize = 24;
    let one = |what, place: usize, bits: u8, told| {
        let mut record = right.to_vec();
        record[place] ^= bits;
        Wrong { what, record, told }
    };
    vec![
        Wrong {
            what: "none",
            record: Vec::new(),
            told: Refusal::Missing,
        },
        Wrong {
            what: "four motors",
            record: other,
            told: Refusal::Shape,
        },
        one("another version", 8, 2, Refusal::Version),
        one("a wrong length", LENGTH, 1, Refusal::Length),
        one("a wrong checksum", 4, 0x80, Refusal::Checksum),
        one("a wrong safe pin", SAFE_PINS, 1, Refusal::Checksum),
        one("a wrong last bit", FIXED - 1, 0x80, Refusal::Checksum),
    ]
}

/// Without a sound record: locked, one message, and no pin is driven; the settings are left alone.
pub(crate) fn none(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let other = Board::find("skr-2-dual-y", Path::new("")).map_err(Failure)?;
    let other = other.record().map_err(|why| Failure(why.to_string()))?;
    for (name, wiring) in [("discovery", &DISCOVERY), ("skr-2", &SKR_2)] {
        let build = firmware.recorded(name, wiring)?;
        let right = build.record.as_deref().unwrap_or_default();
        let mut count = 0;
        for case in wrong(right, other.clone()) {
            let held = ensure_locked(&build.with_record(&case.record), &case);
            held.map_err(|Failure(words)| Failure(format!("{name}, {}: {words}", case.what)))?;
            count += 1;
        }
        figures.add(name, format!("{count} wrong records, locked with each"));
    }
    Ok(figures)
}

fn ensure_locked(build: &Build, case: &Wrong) -> Result<(), Failure> {
    let mut bench = Bench::switch_on(build)?;
    let before = bench.hear_banner()?;
    let message = format!("[MSG:{}]", case.told);
    let after = bench.hear_until(1.0, |line| line.starts_with("[MSG:"))?;
    let told = before
        .iter()
        .chain(&after)
        .filter(|line| line.starts_with("[MSG:"));
    let told: Vec<&String> = told.collect();
    ensure(told == [&message], || format!("says {told:?}"))?;
    ensure_answers(&mut bench)?;
    bench.command("$22=1")?;
    for line in ["$X", "$H"] {
        let heard = bench.say(line)?;
        ensure(heard == [&message, "error:9"], || {
            format!("{line}: {heard:?}")
        })?;
    }
    for (line, expected) in [
        ("G1X1F100", "error:9"),
        ("M3S1000", "error:9"),
        ("$J=X1F100", "error:8"),
        ("$100=200", "ok"),
    ] {
        let heard = bench.say(line)?;
        ensure(heard == [expected], || format!("{line}: {heard:?}"))?;
    }
    bench.send("\x18");
    bench.hear_boot()?;
    ensure_answers(&mut bench)?;
    let operations = bench.machine.flash_operations().len();
    ensure(operations == 0, || {
        format!("the flash is written {operations} times")
    })?;
    ensure_floats(&bench, build.wiring, case.told)
}

/// Reports and lists come, and the state is Alarm.
fn ensure_answers(bench: &mut Bench) -> Result<(), Failure> {
    let status = bench.status()?;
    ensure(status.starts_with("<Alarm|"), || status.clone())?;
    for (line, row) in [("$I", "[VER:1.1h"), ("$$", "$100=")] {
        let rows = bench.command(line)?;
        ensure(rows.iter().any(|one| one.starts_with(row)), || {
            format!("{line}: {rows:?}")
        })?;
    }
    Ok(())
}

/// Checks that no pin of the board is driven, since the firmware knows no pins. A whole record that
/// is for other motors is left out: its pins are known and have been made safe.
fn ensure_floats(bench: &Bench, wiring: &Wiring, told: Refusal) -> Result<(), Failure> {
    if told == Refusal::Shape {
        return Ok(());
    }
    let motors = wiring.step.iter().chain(wiring.direction);
    let others = [&wiring.power, &wiring.spindle].into_iter();
    let mut pins = motors.chain(others).chain(wiring.high);
    let driven: Option<&Pin> = pins.find(|pin| bench.machine.drives(**pin));
    ensure(driven.is_none(), || format!("{driven:?} is driven"))
}

/// A board's record with another first value of `$100`.
fn with_steps(name: &str, steps_per_mm: i32) -> Result<Vec<u8>, Failure> {
    let mut board = Board::find(name, Path::new("")).map_err(Failure)?;
    board.defaults.insert("$100".to_owned(), steps_per_mm);
    board.record().map_err(|why| Failure(why.to_string()))
}

/// Sends all lines of a record except the last one, which stores the record.
fn bring(bench: &mut Bench, record: &[u8]) -> Result<(), Failure> {
    let lines = Board::record_lines(record);
    let (_, parts) = lines
        .split_last()
        .ok_or_else(|| Failure("no lines".into()))?;
    parts
        .iter()
        .try_for_each(|line| bench.command(line).map(drop))
}

/// The first value of `$100` after a power loss at this cycle; `None` if the machine is locked.
fn steps_after_loss(bench: &mut Bench, cycle: u64) -> Result<Option<String>, Failure> {
    bench.machine.reset_at(cycle, ResetCause::PowerOn);
    bench.run_to(cycle + 100)?;
    bench.hear_boot()?;
    let is_locked = bench.status()?.starts_with("<Alarm|");
    let rows = bench.command("$$")?;
    let steps = rows.into_iter().find(|row| row.starts_with("$100="));
    Ok(steps.filter(|_| !is_locked))
}

/// A record over the serial line: to a board without one, and to a board with one, which has the old
/// or the new one after a power loss at each write of the flash.
pub(crate) fn lines(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    for (name, wiring) in [("discovery", &DISCOVERY), ("skr-2", &SKR_2)] {
        let build = firmware.recorded(name, wiring)?;
        let mut bench = Bench::boot(&build.with_record(&[]))?;
        bring(&mut bench, &with_steps(name, 111)?)?;
        bench.command("$B=")?;
        let now = bench.machine.cycle();
        let first = steps_after_loss(&mut bench, now + 1_000)?;
        ensure(first.as_deref() == Some("$100=111.000"), || {
            format!("{first:?}")
        })?;
        let losses = ensure_old_or_new(&mut bench, name)?;
        figures.add(
            name,
            format!("stored; {losses} power losses, the old or the new one"),
        );
        ensure_refuses(&mut bench, name)?;
    }
    Ok(figures)
}

/// Loses power at each flash write of a second record. Returns the number of these writes.
fn ensure_old_or_new(bench: &mut Bench, name: &str) -> Result<usize, Failure> {
    bring(bench, &with_steps(name, 222)?)?;
    bench.machine.clear_records();
    let before = bench.clone();
    bench.command("$B=")?;
    let operations = bench.machine.flash_operations().to_vec();
    let mut seen = [0; 2];
    for operation in &operations {
        let mut cut = before.clone();
        cut.send("$B=\n");
        let middle = operation.begin.midpoint(operation.end);
        match steps_after_loss(&mut cut, middle)?.as_deref() {
            Some("$100=111.000") => seen[0] += 1,
            Some("$100=222.000") => seen[1] += 1,
            other => return fail(format!("{name}: {other:?} after {seen:?} losses")),
        }
        // And again: the place that was begun is given up.
        bring(&mut cut, &with_steps(name, 333)?)?;
        cut.command("$B=")?;
    }
    let now = bench.machine.cycle();
    let last = steps_after_loss(bench, now + 1_000)?;
    ensure(last.as_deref() == Some("$100=222.000"), || {
        format!("{last:?}")
    })?;
    ensure(seen[0] > 0, || "no loss kept the old one".into())?;
    Ok(operations.len())
}

/// A line with a wrong digit, a record for other motors and a ninth record change nothing.
fn ensure_refuses(bench: &mut Bench, name: &str) -> Result<(), Failure> {
    let heard = bench.say("$B=00004C53421E")?;
    ensure(heard == ["error:2"], || format!("{heard:?}"))?;
    let other = Board::find("skr-2-dual-y", Path::new("")).map_err(Failure)?;
    bring(
        bench,
        &other.record().map_err(|why| Failure(why.to_string()))?,
    )?;
    let heard = bench.say("$B=")?;
    ensure(heard.last().is_some_and(|line| line == "error:7"), || {
        format!("{heard:?}")
    })?;
    for number in 3..=SLOTS as i32 {
        bring(bench, &with_steps(name, number)?)?;
        bench.command("$B=")?;
    }
    bring(bench, &with_steps(name, 9)?)?;
    let heard = bench.say("$B=")?;
    ensure(heard.last().is_some_and(|line| line == "error:7"), || {
        format!("{heard:?}")
    })?;
    let now = bench.machine.cycle();
    let last = steps_after_loss(bench, now + 1_000)?;
    let kept = format!("$100={}.000", SLOTS);
    ensure(last.as_deref() == Some(&kept), || format!("{last:?}"))
}
