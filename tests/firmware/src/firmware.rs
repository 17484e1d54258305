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
use std::{collections::BTreeMap, fs, path::Path, sync::Arc};

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
    /// The board's record in the flash, if the firmware has no pins of its own.
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

/// An image that `cargo fw-test` builds: its name in the folder of images, the board that it is for,
/// the rate of its serial line, and the times with which it plans.
type Image = (&'static str, &'static Wiring, u32, StepTiming);

/// An image with pins for a board, at the usual rate.
const fn wired(name: &'static str, wiring: &'static Wiring) -> Image {
    (name, wiring, USUAL_BAUD, StepTiming::F407)
}

/// An image without pins, for boards that begin where this one does.
const fn recorded(name: &'static str, wiring: &'static Wiring) -> Image {
    (name, wiring, USUAL_BAUD, StepTiming::F407_RECORD)
}

/// All images that checks run; `xtask/src/fw_test.rs` says how each is built.
const IMAGES: [Image; 21] = [
    wired("usual", &DISCOVERY),
    ("fast", &DISCOVERY, FAST_BAUD, StepTiming::F407),
    wired("machine-003", &MACHINE_003),
    wired("skr-2", &SKR_2),
    wired("dual-y", &DUAL_Y),
    wired("core-xy", &SKR_2),
    wired("octopus", &OCTOPUS),
    wired("fly-407zg", &FLY_407ZG),
    wired("spider", &SPIDER),
    wired("robin-nano-v3", &ROBIN_NANO_V3),
    wired("six-axes", &DISCOVERY_6),
    wired("machine-file-000", &DISCOVERY_4),
    wired("machine-file-001", &MACHINE_001),
    wired("machine-file-002", &DISCOVERY),
    wired("machine-file-003", &MACHINE_003),
    wired("machine-file-004", &DISCOVERY_4),
    wired("inverted", &DISCOVERY),
    recorded("record", &DISCOVERY),
    recorded("record-behind", &SKR_2),
    recorded("record-behind-48", &ROBIN_NANO_V3),
    (
        FOUR_MOTORS,
        &DUAL_Y,
        USUAL_BAUD,
        StepTiming::F407_RECORD_FOUR,
    ),
];

/// The image without pins for four motors behind a bootloader of 32 KiB: a record says how the
/// motors move the axes.
const FOUR_MOTORS: &str = "record-four";

/// The firmware, built several times.
#[derive(Clone)]
pub(crate) struct Firmware {
    builds: BTreeMap<&'static str, Build>,
}

impl Firmware {
    /// Reads the images with these names, which `cargo fw-test` has put into a folder.
    pub(crate) fn read(folder: &str, names: &[&str]) -> Result<Self, Failure> {
        let asked = IMAGES.iter().filter(|(name, ..)| names.contains(name));
        let builds = asked.map(|&(name, wiring, baud, timing)| {
            let build = Build::read(&Path::new(folder).join(name), wiring, baud)?;
            Ok((name, Build { timing, ..build }))
        });
        let builds = builds.collect::<Result<_, Failure>>()?;
        Ok(Firmware { builds })
    }

    /// The build that limits no step rate, at 2 Mbaud: `cargo fw-test --highest-rate` makes it.
    pub(crate) fn uncapped(folder: &str) -> Result<Build, Failure> {
        Build::read(&Path::new(folder).join("uncapped"), &DISCOVERY, FAST_BAUD)
    }

    /// A build.
    ///
    /// # Errors
    /// The check does not say that it needs this build.
    pub(crate) fn build(&self, name: &str) -> Result<&Build, Failure> {
        let build = self.builds.get(name);
        build.ok_or_else(|| Failure(format!("this check does not say that it needs {name}")))
    }

    /// These builds only, so that no check runs another one than it says.
    pub(crate) fn only(&self, names: &[&str]) -> Self {
        let mut few = self.clone();
        few.builds.retain(|name, _| names.contains(name));
        few
    }

    /// The build without pins for a board that comes with the firmware, and its record in the flash.
    pub(crate) fn recorded(&self, name: &str, wiring: &'static Wiring) -> Result<Build, Failure> {
        let mut images = IMAGES
            .iter()
            .filter(|(_, _, _, timing)| *timing == StepTiming::F407_RECORD);
        let image = images.find(|(_, other, ..)| other.start == wiring.start);
        let image = image.ok_or_else(|| Failure(format!("no build begins where {name} does")))?;
        with_record_of(self.build(image.0)?, name, wiring)
    }

    /// The build without pins for four motors, with this record in its flash.
    pub(crate) fn four_motors(&self, record: &[u8]) -> Result<Build, Failure> {
        Ok(self.build(FOUR_MOTORS)?.with_record(record))
    }

    /// The build without pins for four motors, and the record of a board that comes with the
    /// firmware in the flash.
    pub(crate) fn of_four_motors(
        &self,
        name: &str,
        wiring: &'static Wiring,
    ) -> Result<Build, Failure> {
        with_record_of(self.build(FOUR_MOTORS)?, name, wiring)
    }

    /// The same builds with a fault.
    pub(crate) fn with(&self, fault: Fault) -> Self {
        let mut faulty = self.clone();
        for build in faulty.builds.values_mut() {
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
