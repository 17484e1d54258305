//! Whole histories of a store: power that is lost, words that go wrong, erases that are cut.
use super::*;

/// A step of a store's history.
#[derive(Clone, Debug)]
enum Step {
    Set(u16, StdVec<u8>),
    /// All settings go, the texts stay.
    Restore,
    /// Power goes and comes again, and the spare area is prepared.
    Restart,
    /// Power is lost after this number of bytes, in any record or header.
    Cut(usize),
    /// The word after this number of words goes wrong without a sign.
    Err(usize),
}

fn steps() -> impl Strategy<Value = StdVec<Step>> {
    let key = prop_oneof![0..6_u16, Just(0x2000_u16)];
    let payload = prop::collection::vec(any::<u8>(), 0..60);
    let step = prop_oneof![
        10 => (key, payload).prop_map(|(key, payload)| Step::Set(key, payload)),
        1 => Just(Step::Restore),
        1 => Just(Step::Restart),
        2 => (0..400_usize).prop_map(Step::Cut),
        2 => (0..100_usize).prop_map(Step::Err),
    ];
    prop::collection::vec(step, 0..60)
}

/// The values of all keys of a history, as they are read.
type Values = BTreeMap<u16, StdVec<u8>>;

fn values_of(records: &Records, flash: &mut MockFlash) -> Values {
    let codes = (0..6).chain([0x2000]);
    codes
        .map(|code| (code, value(records, flash, code)))
        .collect()
}

/// Carries a step out; returns whether it is acknowledged, and the values after it if it is.
fn carry_out(
    records: &mut Records,
    flash: &mut MockFlash,
    step: &Step,
    old: &Values,
) -> (bool, Values) {
    let mut new = old.clone();
    let done = match step {
        Step::Set(code, payload) => {
            new.insert(*code, payload.clone());
            let key = RecordKey::from_code(*code).unwrap();
            write(records, flash, key, payload).is_ok()
        }
        Step::Restore => {
            (0..6).for_each(|code| {
                new.insert(code, StdVec::new());
            });
            let keep = |key| !matches!(key, RecordKey::Setting(_));
            records.retain(flash, keep).is_ok()
        }
        Step::Restart | Step::Cut(_) | Step::Err(_) => true,
    };
    (done, new)
}

/// Power comes back; returns the values that are read then.
fn boot(flash: &mut MockFlash) -> (Records, Values) {
    flash.restart();
    let (mut records, _) = mounted(flash);
    let values = values_of(&records, flash);
    let _ = records.erase_spare(flash);
    (records, values)
}

/// Every acknowledged value is there. A value that was not acknowledged is there whole or not at
/// all.
fn survive(history: &[Step], half_written: u8, weakens: bool) -> Result<(), TestCaseError> {
    let mut flash = MockFlash {
        half_written,
        weakens,
        ..MockFlash::new(1024)
    };
    let (mut records, mut known) = boot(&mut flash);
    for step in history {
        match step {
            Step::Cut(bytes) => flash.fuel = *bytes,
            Step::Err(words) => flash.errs.push(flash.words + words),
            Step::Set(..) | Step::Restore | Step::Restart => {}
        }
        let (done, new) = carry_out(&mut records, &mut flash, step, &known);
        if done && !matches!(step, Step::Restart) {
            known = new;
            continue;
        }
        let found;
        (records, found) = boot(&mut flash);
        prop_assert!(
            found == known || !done && found == new,
            "{step:?}: {found:?} in place of {known:?}"
        );
        known = found;
    }
    let (_, found) = boot(&mut flash);
    prop_assert_eq!(found, known);
    Ok(())
}

/// A number of cases, and as many times more as `PROPTEST_CASES` is more than proptest's own 256.
fn times(cases: u32) -> ProptestConfig {
    let times = ProptestConfig::default().cases / 256;
    ProptestConfig::with_cases(cases * times.max(1))
}

proptest! {
    #![proptest_config(times(4000))]

    #[test]
    fn what_was_acknowledged_survives_lost_power_silent_faults_and_cut_erases(
        history in steps(), half_written in prop::sample::select(&[0xff_u8, 0xf0, 0x5a][..]), weakens in any::<bool>(),
    ) {
        survive(&history, half_written, weakens)?;
    }
}

#[test]
fn the_spare_area_is_kept_after_damage_until_all_was_copied_and_read_back() {
    let mut flash = MockFlash::new(SIZE);
    run(&mut flash);
    let active = mounted(&mut flash).0.active.unwrap();
    flash.areas[active.area as usize][AREA_HEADER] ^= 1;
    let before = flash.areas.clone();
    let (mut records, condition) = mounted(&mut flash);
    assert_eq!(condition, Condition::Damaged);
    records.erase_spare(&mut flash).unwrap();
    assert_eq!(flash.areas, before);
    write(&mut records, &mut flash, RecordKey::Build, b"ON").unwrap();
    records.erase_spare(&mut flash).unwrap();
    assert_eq!(mounted(&mut flash).1, Condition::Sound);
    assert_ne!(
        flash.areas[active.area as usize],
        before[active.area as usize]
    );
}

#[test]
fn an_area_whose_erase_was_cut_is_erased_again_although_it_reads_as_erased() {
    let mut flash = MockFlash {
        weakens: true,
        ..MockFlash::new(SIZE)
    };
    run(&mut flash);
    let (mut records, _) = mounted(&mut flash);
    let spare = records.active.unwrap().area.other();
    flash.fuel = 1;
    assert!(records.erase_spare(&mut flash).is_err());
    assert_eq!(flash.areas[spare as usize], [0xff; SIZE]);
    let (mut records, _) = boot(&mut flash);
    records.retain(&mut flash, |_| true).unwrap();
    write(&mut records, &mut flash, RecordKey::Build, b"KEPT").unwrap();
    let (records, _) = boot(&mut flash);
    assert_eq!(
        value(&records, &mut flash, RecordKey::Build.code()),
        b"KEPT"
    );
}

#[test]
fn a_word_that_goes_wrong_in_silence_costs_an_attempt_and_three_in_a_row_an_error() {
    for (errs, done) in [(1, Ok(())), (2, Ok(())), (3, Err(StoreError::Unfaithful))] {
        let mut flash = MockFlash::new(1024);
        let (mut records, _) = mounted(&mut flash);
        write(&mut records, &mut flash, RecordKey::Setting(1), &[1; 8]).unwrap();
        // The record's own last word, and the first one of the other area's header, twice.
        flash.errs = [3, 4, 7][..errs]
            .iter()
            .map(|word| flash.words + word)
            .collect();
        let again = write(&mut records, &mut flash, RecordKey::Setting(1), &[2; 8]);
        assert_eq!(again, done);
        let (found, _) = mounted(&mut flash);
        let expected = if done.is_ok() { [2; 8] } else { [1; 8] };
        assert_eq!(value(&found, &mut flash, 1), expected);
    }
}
