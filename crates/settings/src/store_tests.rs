use super::super::record::RECORD_HEADER;
use super::*;
use mock::{MockFlash, PowerLost};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::vec::Vec as StdVec;

#[path = "store_history_tests.rs"]
mod histories;
#[path = "../tests/mock/flash.rs"]
mod mock;

const SIZE: usize = 256;

fn mounted(flash: &mut MockFlash) -> (Records, Condition) {
    Records::mount(flash).unwrap()
}

/// Stores a value, in as many parts as it takes.
fn write(
    records: &mut Records,
    flash: &mut MockFlash,
    key: RecordKey,
    value: &[u8],
) -> Result<(), StoreError<PowerLost>> {
    while records.write(flash, key, value)? == Written::Part {}
    Ok(())
}

/// A few values of three keys, more than one area holds.
fn program() -> StdVec<(RecordKey, StdVec<u8>)> {
    let keys = [
        RecordKey::Setting(100),
        RecordKey::Offset(0),
        RecordKey::Startup(1),
    ];
    (0..60_u8)
        .map(|step| {
            (
                keys[usize::from(step % 3)],
                std::vec![step; usize::from(step % 7) * 10],
            )
        })
        .collect()
}

/// The acknowledged values, and the value that was being written when power was lost.
type Outcome = (BTreeMap<u16, StdVec<u8>>, Option<(u16, StdVec<u8>)>);

/// Runs the program until it is done or power is lost.
fn run(flash: &mut MockFlash) -> Outcome {
    let (mut records, _) = mounted(flash);
    let mut stored = BTreeMap::new();
    for (key, value) in program() {
        if write(&mut records, flash, key, &value).is_err() {
            return (stored, Some((key.code(), value)));
        }
        stored.insert(key.code(), value);
    }
    (stored, None)
}

fn value(records: &Records, flash: &mut MockFlash, code: u16) -> StdVec<u8> {
    let key = RecordKey::from_code(code).unwrap();
    records
        .read(flash, key)
        .unwrap()
        .map(|payload| payload.to_vec())
        .unwrap_or_default()
}

#[test]
fn a_blank_store_has_no_values_and_is_no_loss() {
    let mut flash = MockFlash::new(SIZE);
    let (records, condition) = mounted(&mut flash);
    assert_eq!(condition, Condition::Blank);
    assert_eq!(records.read(&mut flash, RecordKey::Build), Ok(None));
    assert_eq!(flash.written, 0);
}

#[test]
fn values_are_there_after_a_restart() {
    let mut flash = MockFlash::new(SIZE);
    let (stored, _) = run(&mut flash);
    let (records, condition) = mounted(&mut flash);
    assert_eq!(condition, Condition::Sound);
    for (code, expected) in stored {
        assert_eq!(value(&records, &mut flash, code), expected, "{code:x}");
    }
}

#[test]
fn a_power_loss_after_any_byte_leaves_the_old_or_the_new_value() {
    let mut whole = MockFlash::new(SIZE);
    run(&mut whole);
    assert!(
        whole.written > 4 * SIZE,
        "the program must rewrite areas several times"
    );
    for half_written in [0xff, 0xf0, 0x5a] {
        for fuel in 0..whole.written {
            let mut flash = MockFlash {
                fuel,
                half_written,
                ..MockFlash::new(SIZE)
            };
            let (stored, pending) = run(&mut flash);
            let (key, new) = pending.expect("power was lost");
            flash.restart();
            let (mut records, condition) = mounted(&mut flash);
            for (code, old) in &stored {
                let found = value(&records, &mut flash, *code);
                let is_new = *code == key && found == new;
                assert!(
                    found == *old || is_new,
                    "{code:x} after {fuel} bytes: {found:?}"
                );
            }
            if half_written == 0xff && !flash.died_erasing {
                assert_ne!(
                    condition,
                    Condition::Damaged,
                    "after {fuel} bytes nothing is lost"
                );
            }
            write(&mut records, &mut flash, RecordKey::Build, b"ON").unwrap();
            let (records, condition) = mounted(&mut flash);
            assert_eq!(value(&records, &mut flash, RecordKey::Build.code()), b"ON");
            assert_ne!(condition, Condition::Blank);
        }
    }
}

#[test]
fn every_damaged_byte_is_reported() {
    let mut sound = MockFlash::new(SIZE);
    let (mut records, _) = mounted(&mut sound);
    for (key, value) in program().into_iter().take(5) {
        write(&mut records, &mut sound, key, &value).unwrap();
    }
    let active = records.active.unwrap();
    for at in 0..active.end {
        for flip in [0x01, 0x80, 0xff] {
            let mut flash = sound.clone();
            flash.areas[active.area as usize][at] ^= flip;
            let (damaged, condition) = mounted(&mut flash);
            let same = [100, 0x1000, 0x2001].iter().all(|code| {
                value(&damaged, &mut flash, *code) == value(&records, &mut sound.clone(), *code)
            });
            assert!(
                condition == Condition::Damaged || condition == Condition::Foreign || same,
                "byte {at} ^ {flip:x}: {condition:?}"
            );
        }
    }
}

#[test]
fn a_damaged_record_costs_its_own_value_only() {
    let mut flash = MockFlash::new(SIZE);
    let (mut records, _) = mounted(&mut flash);
    write(&mut records, &mut flash, RecordKey::Setting(1), &[1; 8]).unwrap();
    write(&mut records, &mut flash, RecordKey::Setting(2), &[2; 8]).unwrap();
    let place = records.place(1).unwrap();
    flash.areas[0][place.offset() + RECORD_HEADER] ^= 4;
    let (records, condition) = mounted(&mut flash);
    assert_eq!(condition, Condition::Damaged);
    assert_eq!(value(&records, &mut flash, 1), b"");
    assert_eq!(value(&records, &mut flash, 2), [2; 8]);
}

#[test]
fn after_damage_the_next_change_makes_the_store_sound_again() {
    let mut flash = MockFlash::new(SIZE);
    run(&mut flash);
    let (records, _) = mounted(&mut flash);
    let active = records.active.unwrap();
    flash.areas[active.area as usize][active.end - 1] ^= 1;
    let (mut records, condition) = mounted(&mut flash);
    assert_eq!(condition, Condition::Damaged);
    write(&mut records, &mut flash, RecordKey::Build, b"NEW").unwrap();
    write(&mut records, &mut flash, RecordKey::Build, b"NEWER").unwrap();
    flash.erase(active.area).unwrap();
    assert_eq!(mounted(&mut flash).1, Condition::Sound);
}

#[test]
fn removing_many_keys_happens_as_a_whole() {
    let mut sound = MockFlash::new(SIZE);
    run(&mut sound);
    let keeps = |key| !matches!(key, RecordKey::Setting(_) | RecordKey::Offset(_));
    let values = |flash: &mut MockFlash| {
        let (records, _) = mounted(flash);
        [100, 0x1000, 0x2001].map(|code| value(&records, flash, code))
    };
    let before = values(&mut sound);
    let mut after = before.clone();
    (after[0], after[1]) = (StdVec::new(), StdVec::new());
    assert_ne!(before, after);
    let (records, _) = mounted(&mut sound);
    let mut fuel = 0;
    loop {
        let mut flash = MockFlash {
            fuel,
            ..sound.clone()
        };
        let done = records.clone().retain(&mut flash, keeps).is_ok();
        flash.restart();
        assert_eq!(
            values(&mut flash),
            if done { after.clone() } else { before.clone() },
            "after {fuel} bytes"
        );
        if done {
            break;
        }
        fuel += 1;
    }
}

#[test]
fn a_spare_area_erased_early_costs_no_value_and_spares_the_next_change_the_erasing() {
    let mut sound = MockFlash::new(SIZE);
    run(&mut sound);
    let (records, _) = mounted(&mut sound);
    let values = |flash: &mut MockFlash| {
        let (records, _) = mounted(flash);
        [100, 0x1000, 0x2001].map(|code| value(&records, flash, code))
    };
    let before = values(&mut sound);
    const ALL: usize = SIZE / 64 + AREA_HEADER;
    for fuel in 0..=ALL {
        let mut flash = MockFlash {
            fuel,
            ..sound.clone()
        };
        let done = records.clone().erase_spare(&mut flash).is_ok();
        assert_eq!(done, fuel == ALL);
        flash.restart();
        assert_eq!(values(&mut flash), before, "after {fuel} blocks");
        let spare = records.active.unwrap().area.other();
        let spare = &flash.areas[spare as usize];
        assert!(!done || spare[AREA_HEADER..] == [0xff; SIZE - AREA_HEADER]);
    }
}

#[test]
fn a_store_that_nobody_could_read_is_not_erased() {
    let mut flash = MockFlash::new(SIZE);
    run(&mut flash);
    for area in &mut flash.areas {
        area[0] ^= 1;
    }
    let (mut records, _) = mounted(&mut flash);
    let before = flash.areas.clone();
    records.erase_spare(&mut flash).unwrap();
    assert_eq!(flash.areas, before);
}

#[test]
fn a_value_that_is_stored_already_is_not_written_again() {
    let mut flash = MockFlash::new(SIZE);
    let (mut records, _) = mounted(&mut flash);
    write(&mut records, &mut flash, RecordKey::Build, b"A").unwrap();
    let written = flash.written;
    write(&mut records, &mut flash, RecordKey::Build, b"A").unwrap();
    write(&mut records, &mut flash, RecordKey::Startup(0), b"").unwrap();
    assert_eq!(flash.written, written);
}

#[test]
fn a_long_record_is_written_in_parts_and_counts_with_the_last() {
    let mut flash = MockFlash::new(SIZE);
    let (mut records, _) = mounted(&mut flash);
    write(&mut records, &mut flash, RecordKey::Build, b"OLD").unwrap();
    let before = flash.written;
    let first = records.write(&mut flash, RecordKey::Build, &[1; 80]);
    assert_eq!((first, flash.written - before), (Ok(Written::Part), 48));
    let (found, condition) = mounted(&mut flash);
    assert_eq!(condition, Condition::CutShort);
    assert_eq!(value(&found, &mut flash, RecordKey::Build.code()), b"OLD");
    let second = records.write(&mut flash, RecordKey::Build, &[1; 80]);
    assert_eq!((second, flash.written - before), (Ok(Written::All), 88));
    let (found, condition) = mounted(&mut flash);
    assert_eq!(condition, Condition::Sound);
    assert_eq!(value(&found, &mut flash, RecordKey::Build.code()), [1; 80]);
}

#[test]
fn another_record_behind_a_part_leaves_the_old_value_of_the_first() {
    let mut flash = MockFlash::new(SIZE);
    let (mut records, _) = mounted(&mut flash);
    write(&mut records, &mut flash, RecordKey::Build, b"OLD").unwrap();
    let first = records.write(&mut flash, RecordKey::Build, &[1; 80]);
    assert_eq!(first, Ok(Written::Part));
    write(&mut records, &mut flash, RecordKey::Setting(1), &[2; 80]).unwrap();
    let (found, condition) = mounted(&mut flash);
    assert_eq!(condition, Condition::Sound);
    assert_eq!(value(&found, &mut flash, RecordKey::Build.code()), b"OLD");
    assert_eq!(value(&found, &mut flash, 1), [2; 80]);
}

#[test]
fn what_does_not_fit_is_refused_and_the_old_values_stand() {
    let mut flash = MockFlash::new(SIZE);
    let (mut records, _) = mounted(&mut flash);
    assert_eq!(
        write(&mut records, &mut flash, RecordKey::Build, &[0; 81]),
        Err(StoreError::TooLong)
    );
    for number in 0..2 {
        write(
            &mut records,
            &mut flash,
            RecordKey::Setting(number),
            &[1; 80],
        )
        .unwrap();
    }
    assert_eq!(
        write(&mut records, &mut flash, RecordKey::Setting(2), &[1; 80]),
        Err(StoreError::Full)
    );
    let (records, _) = mounted(&mut flash);
    assert_eq!(value(&records, &mut flash, 1), [1; 80]);
}

#[test]
fn another_version_is_not_read() {
    let mut flash = MockFlash::new(SIZE);
    run(&mut flash);
    for area in &mut flash.areas {
        area[..12].copy_from_slice(&[0x4c, 0x53, 9, 0, 1, 0, 0, 0, 0, 0, 0, 0]);
        let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&area[..8]);
        area[8..12].copy_from_slice(&checksum.to_le_bytes());
    }
    let (records, condition) = mounted(&mut flash);
    assert_eq!((condition, records.index.len()), (Condition::Foreign, 0));
}

proptest! {
    #[test]
    fn any_history_reads_back_as_a_map_does(
        steps in prop::collection::vec((0..12_u16, prop::collection::vec(any::<u8>(), 0..12), prop::bool::weighted(0.1)), 0..120),
    ) {
        let mut flash = MockFlash::new(512);
        let (mut records, _) = mounted(&mut flash);
        let mut reference = BTreeMap::new();
        for (number, payload, restart) in steps {
            write(&mut records, &mut flash, RecordKey::Setting(number), &payload).unwrap();
            reference.insert(number, payload);
            if restart {
                records = mounted(&mut flash).0;
            }
        }
        for (number, payload) in reference {
            prop_assert_eq!(value(&records, &mut flash, number), payload);
        }
    }

    #[test]
    fn no_content_of_the_memory_makes_it_panic(bytes in prop::collection::vec(any::<u8>(), 2 * SIZE), sound_header in any::<bool>()) {
        let mut flash = MockFlash::new(SIZE);
        flash.areas = [bytes[..SIZE].to_vec(), bytes[SIZE..].to_vec()];
        if sound_header {
            flash.areas[0][..AREA_HEADER].copy_from_slice(&area_header(1));
        }
        let (mut records, _) = mounted(&mut flash);
        prop_assert_eq!(write(&mut records, &mut flash, RecordKey::Build, b"A"), Ok(()));
        prop_assert_eq!(value(&records, &mut flash, RecordKey::Build.code()), b"A");
    }
}
