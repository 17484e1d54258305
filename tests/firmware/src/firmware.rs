//! The firmware under test, as it was built or with a fault planted in it.
use crate::{
    bench::Failure,
    wiring::{
        Wiring, DISCOVERY, DISCOVERY_4, DISCOVERY_6, DUAL_Y, FLY_407ZG, MACHINE_001, MACHINE_003,
        OCTOPUS, ROBIN_NANO_V3, SKR_2, SPIDER,
    },
};
use leadscrew_boards::Board;
use leadscrew_f407emu::Tamper;
use leadscrew_machine::step_timing::StepTiming;
use std::{fs, path::Path, sync::Arc};

/// The rate of the serial line, baud, unless the firmware is built for another.
const USUAL_BAUD: u32 = 115_200;
/// The rate of the fast line, baud, for which `cargo fw-test` builds.
const FAST_BAUD: u32 = 2_000_000;

/// A fault: words that the program writes to a register are changed or dropped.
#[derive(Clone, Copy)]
pub(crate) struct Fault {
    /// The register's address.
    pub(crate) register: u32,
    pub(crate) tamper: Tamper,
}

/// The firmware, built for one board and one rate of its serial line.
#[derive(Clone)]
pub(crate) struct Build {
    pub(crate) elf: Arc<[u8]>,
    /// The devices on the board's pins.
    pub(crate) wiring: &'static Wiring,
    /// The rate of its serial line, baud.
    pub(crate) baud: u32,
    /// The times of making steps with which it plans.
    pub(crate) timing: StepTiming,
    /// The board's record in the flash, where the firmware has no pins of its own.
    pub(crate) record: Option<Arc<[u8]>>,
    /// The fault that is planted from power-up on.
    pub(crate) fault: Option<Fault>,
}

impl Build {
    fn read(path: &Path, wiring: &'static Wiring, baud: u32) -> Result<Self, Failure> {
        let unread = |error| Failure(format!("{}: {error}", path.display()));
        Ok(Build {
            elf: fs::read(path).map_err(unread)?.into(),
            wiring,
            baud,
            timing: StepTiming::F407,
            record: None,
            fault: None,
        })
    }
}

impl Build {
    /// The same build with this record in the flash.
    pub(crate) fn with_record(&self, record: &[u8]) -> Self {
        Build {
            record: Some(record.into()),
            ..self.clone()
        }
    }

    /// The flash address of the byte that is at `address` when the program runs.
    pub(crate) fn load_address(&self, address: u32) -> Result<u32, Failure> {
        let file = object::read::elf::ElfFile32::<object::Endianness>::parse(&*self.elf)?;
        let (endian, address) = (file.endian(), u64::from(address));
        let segments = file.elf_program_headers().iter();
        let mut places = segments.filter_map(|segment| {
            let (begin, size) = (segment.p_vaddr.get(endian), segment.p_filesz.get(endian));
            let offset = address.checked_sub(begin.into())?;
            (offset < u64::from(size)).then(|| segment.p_paddr.get(endian) + offset as u32)
        });
        let place = places.next();
        place.ok_or_else(|| Failure(format!("{address:#x} is not in the ELF")))
    }
}

/// The firmware, built several times.
#[derive(Clone)]
pub(crate) struct Firmware {
    /// For the Discovery at 115200 baud.
    pub(crate) usual: Build,
    /// At 2 Mbaud, otherwise the same.
    pub(crate) fast: Build,
    /// For the other boards, at 115200 baud.
    pub(crate) others: Others,
    /// For machines 000 to 004, each for its own file.
    pub(crate) machines: [Build; 5],
    /// For more boards, by name, as far as they have been built: three motors each.
    pub(crate) more: Vec<(&'static str, Build)>,
    /// Without pins: for boards of three motors that begin where the flash does, for those that
    /// begin behind a bootloader of 32 KiB, and, if built, for those behind one of 48 KiB.
    pub(crate) without_pins: Vec<Build>,
    /// Without pins, for boards of four motors behind a bootloader of 32 KiB: their records say how
    /// the motors move the axes.
    pub(crate) four_motors: Build,
    /// For the machine of `six_axes.toml`, if built.
    pub(crate) six_axes: Option<Build>,
}

/// The builds for boards other than the unmodified Discovery.
#[derive(Clone)]
pub(crate) struct Others {
    pub(crate) machine_003: Build,
    pub(crate) skr_2: Build,
    pub(crate) dual_y: Build,
    pub(crate) core_xy: Build,
}

impl Firmware {
    /// Reads the files that `cargo fw-test` has put into a folder.
    pub(crate) fn read(folder: &str) -> Result<Self, Failure> {
        let read = |name, wiring, baud| Build::read(&Path::new(folder).join(name), wiring, baud);
        let without_pins = |name, wiring, timing| {
            let build = read(name, wiring, USUAL_BAUD)?;
            Ok::<_, Failure>(Build { timing, ..build })
        };
        let three = StepTiming::F407_RECORD;
        let four_motors = without_pins("record-four", &DUAL_Y, StepTiming::F407_RECORD_FOUR)?;
        let more = [
            ("octopus", &OCTOPUS),
            ("fly-407zg", &FLY_407ZG),
            ("robin-nano-v3", &ROBIN_NANO_V3),
            ("spider", &SPIDER),
        ];
        let built = |(name, wiring)| Some((name, read(name, wiring, USUAL_BAUD).ok()?));
        let behind_48 = without_pins("record-behind-48", &ROBIN_NANO_V3, three);
        let mut without_pins = vec![
            without_pins("record", &DISCOVERY, three)?,
            without_pins("record-behind", &SKR_2, three)?,
        ];
        without_pins.extend(behind_48);
        Ok(Firmware {
            more: more.into_iter().filter_map(built).collect(),
            six_axes: read("six-axes", &DISCOVERY_6, USUAL_BAUD).ok(),
            without_pins,
            four_motors,
            machines: [
                read("machine-file-000", &DISCOVERY_4, USUAL_BAUD)?,
                read("machine-file-001", &MACHINE_001, USUAL_BAUD)?,
                read("machine-file-002", &DISCOVERY, USUAL_BAUD)?,
                read("machine-file-003", &MACHINE_003, USUAL_BAUD)?,
                read("machine-file-004", &DISCOVERY_4, USUAL_BAUD)?,
            ],
            usual: read("usual", &DISCOVERY, USUAL_BAUD)?,
            fast: read("fast", &DISCOVERY, FAST_BAUD)?,
            others: Others {
                machine_003: read("machine-003", &MACHINE_003, USUAL_BAUD)?,
                skr_2: read("skr-2", &SKR_2, USUAL_BAUD)?,
                dual_y: read("dual-y", &DUAL_Y, USUAL_BAUD)?,
                core_xy: read("core-xy", &SKR_2, USUAL_BAUD)?,
            },
        })
    }

    /// The build that limits no step rate, at 2 Mbaud: `cargo fw-test --highest-rate` makes it.
    pub(crate) fn uncapped(folder: &str) -> Result<Build, Failure> {
        Build::read(&Path::new(folder).join("uncapped"), &DISCOVERY, FAST_BAUD)
    }

    /// The build for the SKR 2, the only one that `cargo fw-test qemu` needs.
    pub(crate) fn skr_2(folder: &str) -> Result<Build, Failure> {
        Build::read(&Path::new(folder).join("skr-2"), &SKR_2, USUAL_BAUD)
    }

    /// The build without pins for a board that comes with the firmware, and its record in the flash.
    pub(crate) fn recorded(&self, name: &str, wiring: &'static Wiring) -> Result<Build, Failure> {
        let start = |build: &&Build| build.wiring.start == wiring.start;
        let build = self.without_pins.iter().find(start);
        let build = build.ok_or_else(|| Failure(format!("no build begins where {name} does")))?;
        with_record_of(build, name, wiring)
    }

    /// The build without pins for four motors, and the record of a board that comes with the
    /// firmware in the flash.
    pub(crate) fn of_four_motors(
        &self,
        name: &str,
        wiring: &'static Wiring,
    ) -> Result<Build, Failure> {
        with_record_of(&self.four_motors, name, wiring)
    }

    /// The same builds with a fault.
    pub(crate) fn with(&self, fault: Fault) -> Self {
        let mut faulty = self.clone();
        faulty.usual.fault = Some(fault);
        faulty.fast.fault = Some(fault);
        faulty.others.machine_003.fault = Some(fault);
        faulty.others.skr_2.fault = Some(fault);
        faulty.others.dual_y.fault = Some(fault);
        faulty.others.core_xy.fault = Some(fault);
        let without_pins = faulty.without_pins.iter_mut();
        let without_pins = without_pins.chain([&mut faulty.four_motors]);
        for build in faulty.machines.iter_mut().chain(without_pins) {
            build.fault = Some(fault);
        }
        let more = faulty.more.iter_mut().map(|(_, build)| build);
        for build in more.chain(&mut faulty.six_axes) {
            build.fault = Some(fault);
        }
        faulty
    }
}

/// A build without pins, and the record of a board that comes with the firmware in its flash.
fn with_record_of(build: &Build, name: &str, wiring: &'static Wiring) -> Result<Build, Failure> {
    let board = Board::find(name, Path::new("")).map_err(Failure)?;
    let record = board.record().map_err(|why| Failure(why.to_string()))?;
    Ok(Build {
        wiring,
        ..build.with_record(&record)
    })
}
