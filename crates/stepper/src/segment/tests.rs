use super::*;
use proptest::prelude::*;

#[test]
fn a_motor_beyond_the_last_is_in_no_set() {
    assert_eq!(MotorMask::only(MAX_MOTORS), MotorMask::NONE);
    assert!(!MotorMask::from_bits(0xFF).contains(MAX_MOTORS));
}

#[test]
fn with_and_without_undo_each_other() {
    let xz = MotorMask::only(0).with(MotorMask::only(2));
    assert_eq!(xz.bits(), 0b101);
    assert_eq!(xz.without(MotorMask::only(2)), MotorMask::only(0));
}

#[test]
fn the_motor_with_the_most_steps_is_dominant() {
    let line = Line::new([3, -7, 0]).unwrap();
    assert_eq!(line.step_events().get(), 7);
    assert_eq!(line.direction(), MotorMask::only(1));
}

#[test]
fn no_steps_and_too_many_steps_are_refused() {
    assert_eq!(Line::new([0, 0]), Err(LineError::NoSteps));
    assert_eq!(Line::new([i32::MIN, 0]), Err(LineError::TooLong));
    assert!(Line::new([MAX_STEP_EVENTS as i32]).is_ok());
}

#[test]
fn the_rest_of_a_line_and_what_was_taken_make_the_line() {
    let line = Line::new([100, -37, 100, 1]).unwrap();
    let rest = line
        .rest(41, Early::half_a_tick(Smoothing::Sixteenfold))
        .unwrap();
    assert_eq!(rest.steps(), &[59, 37 - 15, 59, 1]);
    assert_eq!(rest.direction(), line.direction());
    assert_eq!(line.rest(100, Early::NOT), None);
    assert_eq!(line.rest(101, Early::NOT), None);
}

fn segment(ticks: u16, interval: u32, change: f64) -> Segment<1> {
    Segment {
        line: None,
        ticks: NonZeroU16::new(ticks).unwrap(),
        smoothing: Smoothing::None,
        motors: MotorMask::ALL,
        ends_event: true,
        early: Early::NOT,
        interval: Interval::from_num(interval),
        interval_change: IntervalChange::from_num(change),
        power: Power::OFF,
        power_change: PowerChange::ZERO,
        outputs: OutputChange::NONE,
        at_rest: None,
    }
}

#[test]
fn a_segment_lasts_as_long_as_its_intervals_together() {
    assert_eq!(segment(4, 100, 0.0).duration(), 400);
    assert_eq!(segment(4, 100, 10.0).duration(), 460);
    assert_eq!(segment(4, 100, -10.5).duration(), 337);
    assert_eq!(segment(u16::MAX, u32::MAX, 0.0).duration(), u32::MAX);
}

#[test]
fn full_power_is_the_whole_period_and_off_is_nothing() {
    assert_eq!(Power::FULL.level(PowerScale::new(8400)), 8400);
    assert_eq!(
        Power::FULL.level(PowerScale::new(u16::MAX)),
        u32::from(u16::MAX)
    );
    assert_eq!(Power::OFF.level(PowerScale::new(8400)), 0);
}

#[test]
fn a_change_never_leaves_the_range() {
    let step = PowerChange::from_num(0.75);
    assert_eq!(Power::OFF.changed_by(-step), Power::OFF);
    assert_eq!(Power::FULL.changed_by(step), Power::FULL);
    assert_eq!(Power::OFF.changed_by(step).level(PowerScale::new(100)), 75);
}

#[test]
fn more_than_full_is_full() {
    assert_eq!(Power::from_share(U1F31::MAX), Power::FULL);
    assert_eq!(Power::from_share(U1F31::ZERO), Power::default());
}

proptest! {
    /// Compares with sums of 64 bits, which cannot overflow.
    #[test]
    fn a_change_is_an_addition_kept_within_the_range(share in 0u32..=1 << 31, change: i32) {
        let power = Power::from_share(U1F31::from_bits(share));
        prop_assert_eq!(power.share().to_bits(), share);
        let sum = i64::from(share) + i64::from(change);
        let changed = power.changed_by(PowerChange::from_bits(change));
        prop_assert_eq!(i64::from(changed.share().to_bits()), sum.clamp(0, 1 << 31));
    }
}

#[test]
fn the_levels_are_the_logarithms_of_the_ticks_to_a_step() {
    let all = [
        Smoothing::None,
        Smoothing::Twofold,
        Smoothing::Fourfold,
        Smoothing::Eightfold,
        Smoothing::Sixteenfold,
    ];
    assert_eq!(all.map(Smoothing::level), [0, 1, 2, 3, MAX_SMOOTHING_LEVEL]);
}

#[test]
fn early_is_half_a_tick() {
    let of = |smoothing| Early::half_a_tick(smoothing).of(10);
    assert_eq!(of(Smoothing::None), 80);
    assert_eq!(of(Smoothing::Eightfold), 10);
    assert_eq!(of(Smoothing::Sixteenfold), 5);
    assert_eq!(Early::NOT.of(10), 0);
}
