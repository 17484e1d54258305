//! Settings in a flash of `embedded-storage`.

use crate::bench::{Timer, World};
use crate::pins::step_dir;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use leadscrew::{Cartesian, Config, Flash, FlashError, Instant, Outputs, Resources};
use std::{cell::RefCell, rc::Rc};

/// A flash in memory that keeps the rules of its kind, or fails.
#[derive(Clone)]
struct Chip<const READ: usize, const WRITE: usize> {
    bytes: Rc<RefCell<Vec<u8>>>,
    broken: Rc<RefCell<bool>>,
}

#[derive(Debug, PartialEq, Eq)]
struct Dead;

impl NorFlashError for Dead {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl<const READ: usize, const WRITE: usize> Chip<READ, WRITE> {
    fn new() -> Self {
        Self {
            bytes: Rc::new(RefCell::new(std::vec![0xFF; 16 * 1024])),
            broken: Rc::default(),
        }
    }
    fn check(&self, sizes: &[usize], unit: usize) -> Result<(), Dead> {
        assert!(
            sizes.iter().all(|size| size % unit == 0),
            "{sizes:?} of {unit}"
        );
        match *self.broken.borrow() {
            true => Err(Dead),
            false => Ok(()),
        }
    }
}

impl<const READ: usize, const WRITE: usize> ErrorType for Chip<READ, WRITE> {
    type Error = Dead;
}
impl<const READ: usize, const WRITE: usize> ReadNorFlash for Chip<READ, WRITE> {
    const READ_SIZE: usize = READ;
    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Dead> {
        self.check(&[offset as usize, bytes.len()], READ)?;
        let from = offset as usize;
        bytes.copy_from_slice(&self.bytes.borrow()[from..from + bytes.len()]);
        Ok(())
    }
    fn capacity(&self) -> usize {
        self.bytes.borrow().len()
    }
}
impl<const READ: usize, const WRITE: usize> NorFlash for Chip<READ, WRITE> {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = 2048;
    fn erase(&mut self, from: u32, to: u32) -> Result<(), Dead> {
        self.check(&[from as usize, to as usize], Self::ERASE_SIZE)?;
        self.bytes.borrow_mut()[from as usize..to as usize].fill(0xFF);
        Ok(())
    }
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Dead> {
        self.check(&[offset as usize, bytes.len()], WRITE)?;
        let mut all = self.bytes.borrow_mut();
        for (to, from) in all[offset as usize..].iter_mut().zip(bytes) {
            assert_eq!(*to, 0xFF, "a byte is written twice");
            *to = *from;
        }
        Ok(())
    }
}

/// Powers a machine up, sends it lines, and returns what it says.
fn session<F: NorFlash>(flash: F, lines: &str) -> String {
    let world = World::new();
    let resources = Box::leak(Box::new(Resources::<3, 3, 16>::new()));
    let config = Config::new().timer_hz(1_000_000);
    let (mut machine, steps, mut serial, _) = leadscrew::new(resources, config, Cartesian).unwrap();
    let mut steps = steps.on(step_dir(&world), Timer(world.clone()));
    let mut outputs = Outputs::new(|| {}, world.pin("enable"));
    let mut store = Flash::new(flash, 8192..12_288).unwrap();
    let _ = machine.load(&mut store);
    for byte in lines.bytes() {
        serial.receive(byte);
    }
    let mut said = String::new();
    for turn in 0..5_000 {
        machine.poll(&mut outputs, Instant::from_ticks(turn * 100));
        let _ = machine.save(&mut store);
        steps.tick();
        said.extend(core::iter::from_fn(|| serial.next_to_send()).map(char::from));
    }
    said
}

fn survives<const READ: usize, const WRITE: usize>() {
    let chip = Chip::<READ, WRITE>::new();
    // So many that the areas change over.
    let many: String = (0..400)
        .map(|n| std::format!("$110={}\n", 500 + n))
        .collect();
    for part in many.lines().collect::<Vec<_>>().chunks(40) {
        let said = session(chip.clone(), &(part.join("\n") + "\n"));
        assert_eq!(said.matches("ok\r\n").count(), part.len(), "{said}");
    }
    let said = session(chip.clone(), "$$\n$#\n");
    assert!(said.contains("$110=899.000\r\n"), "{READ} {WRITE}: {said}");
    let outside = chip.bytes.borrow();
    assert!(outside[..8192]
        .iter()
        .chain(&outside[12_288..])
        .all(|byte| *byte == 0xFF));
}

#[test]
fn settings_survive_power_downs_whatever_words_the_flash_has() {
    survives::<1, 1>();
    survives::<4, 4>();
    survives::<1, 2>();
    survives::<4, 1>();
}

#[test]
fn a_flash_that_fails_refuses_the_line_and_at_power_up_it_locks() {
    let chip = Chip::<1, 4>::new();
    let said = session(chip.clone(), "$110=700\n");
    assert!(said.contains("ok\r\n"), "{said}");
    *chip.broken.borrow_mut() = true;
    let said = session(chip, "");
    assert!(said.contains("[MSG:"), "{said}");
    assert!(said.starts_with("error:7"), "{said}");
}

#[test]
fn a_range_that_cannot_keep_settings_is_refused_with_one_that_can() {
    let table = [
        (0..20_000, FlashError::Beyond(16 * 1024), "ends at 16384"),
        (
            0..2048,
            FlashError::Sectors(2048),
            "whole sectors of 2048 bytes",
        ),
        (1024..5120, FlashError::Sectors(2048), "whole sectors"),
        (0..6144, FlashError::Sectors(2048), "whole sectors"),
    ];
    for (range, error, words) in table {
        let refused = Flash::new(Chip::<1, 4>::new(), range).err();
        assert_eq!(refused, Some(error));
        assert!(error.to_string().contains(words), "{error}");
    }
}
