//! An update of the firmware as probe-rs makes it: it erases and writes the sectors that the
//! program needs, and no others.
use super::{
    power_loss::{stored, with_known},
    Figures,
};
use crate::{
    bench::{ensure, Failure},
    firmware::{Build, Firmware},
    wiring::FLASH,
};
use leadscrew_f407emu::ResetCause;
use object::{
    elf::{FileHeader32, PT_LOAD},
    read::elf::{FileHeader, ProgramHeader},
    Endianness,
};
use std::{collections::BTreeSet, ops::Range};

/// The sizes of the sectors, KiB (RM0090 table 5): four of 16, one of 64, seven of 128.
const SECTORS: [u32; 12] = [16, 16, 16, 16, 64, 128, 128, 128, 128, 128, 128, 128];

/// The addresses of each sector.
fn sectors() -> impl Iterator<Item = Range<u32>> {
    SECTORS.iter().scan(FLASH, |next, kibibytes| {
        let begin = *next;
        *next += kibibytes * 1024;
        Some(begin..*next)
    })
}

/// The start and end of each sector that a program has bytes in.
fn needed(elf: &[u8]) -> Result<BTreeSet<(u32, u32)>, Failure> {
    let header = FileHeader32::<Endianness>::parse(elf)?;
    let endian = header.endian()?;
    let mut all = BTreeSet::new();
    for segment in header.program_headers(endian, elf)? {
        let (begin, size) = (segment.p_paddr(endian), segment.p_filesz(endian));
        if segment.p_type(endian) == PT_LOAD && size > 0 {
            let meets = |sector: &Range<u32>| sector.start < begin + size && begin < sector.end;
            all.extend(
                sectors()
                    .filter(meets)
                    .map(|sector| (sector.start, sector.end)),
            );
        }
    }
    Ok(all)
}

/// Compares the settings before and after an update. Returns how many sectors it takes.
fn ensure_survives(build: &Build) -> Result<String, Failure> {
    let mut bench = with_known(build)?;
    let before = stored(&mut bench)?;
    let needed = needed(&build.elf)?;
    for (begin, end) in &needed {
        bench
            .machine
            .program_flash(*begin, &vec![0xFF; (end - begin) as usize]);
    }
    bench.machine.load_elf(&build.elf)?;
    let now = bench.machine.cycle();
    bench.machine.reset_at(now + 1_000, ResetCause::PowerOn);
    bench.run_to(now + 1_100)?;
    bench.hear_boot()?;
    let after = stored(&mut bench)?;
    ensure(before == after, || {
        format!("{after:?} in place of {before:?}")
    })?;
    Ok(format!(
        "{} sectors written, all settings kept",
        needed.len()
    ))
}

pub(crate) fn update(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    for (name, build) in [
        ("discovery", firmware.build("usual")?),
        ("skr-2", firmware.build("skr-2")?),
    ] {
        let words = ensure_survives(build);
        figures.add(
            name,
            words.map_err(|Failure(words)| Failure(format!("{name}: {words}")))?,
        );
    }
    Ok(figures)
}
