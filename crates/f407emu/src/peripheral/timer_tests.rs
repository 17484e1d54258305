//! The manual's rules for a timer's counter, case by case.
use super::super::timer_map::INSTANCES;
use super::*;

const TIM2: usize = 1;
const TIM3: usize = 2;
const CC1IE: u32 = 1 << 1;

fn timer(index: usize, registers: &[(u32, u32)]) -> Timer {
    let mut timer = Timer::new(&INSTANCES[index]);
    timer.set_clock(2, 0);
    for &(offset, value) in registers {
        write(&mut timer, offset, value, 0);
    }
    timer
}

fn write(timer: &mut Timer, offset: u32, value: u32, now: u64) -> TimerRequests {
    timer.write(offset, value, now, &mut Warnings::default())
}

#[test]
fn a_period_is_the_top_and_one_times_the_prescaler_and_one() {
    let mut timer = timer(
        TIM3,
        &[
            (0x28, 3),
            (0x2C, 99),
            (0x14, UG),
            (0x10, 0),
            (0x0C, UIF),
            (0x00, CEN),
        ],
    );
    assert_eq!(timer.next_event(), 2 * 4 * 100);
    assert!(!timer.update_interrupt());
    timer.event(800);
    assert!(timer.update_interrupt());
    assert_eq!(timer.next_event(), 1600);
    write(&mut timer, 0x10, 0, 801);
    assert!(!timer.update_interrupt());
}

#[test]
fn a_prescaler_waits_for_the_update_event() {
    let mut timer = timer(TIM3, &[(0x2C, 9), (0x00, CEN), (0x28, 9)]);
    assert_eq!(timer.next_event(), 20);
    timer.event(20);
    assert_eq!(timer.next_event(), 20 + 200);
}

#[test]
fn a_preloaded_top_waits_for_the_update_event_another_does_not() {
    let mut preloaded = timer(
        TIM3,
        &[
            (0x00, ARPE),
            (0x2C, 99),
            (0x14, UG),
            (0x00, ARPE | CEN),
            (0x2C, 9),
        ],
    );
    assert_eq!(preloaded.next_event(), 200);
    preloaded.event(200);
    assert_eq!(preloaded.next_event(), 220);
    let direct = timer(TIM3, &[(0x2C, 99), (0x00, CEN), (0x2C, 9)]);
    assert_eq!(direct.next_event(), 20);
}

#[test]
fn a_free_counter_of_32_bits_matches_its_compare_register() {
    let mut timer = timer(TIM2, &[(0x0C, CC1IE), (0x34, 840), (0x00, CEN)]);
    assert_eq!(timer.next_event(), 1680);
    timer.event(1680);
    assert!(timer.compare_interrupt());
    assert_eq!(timer.read(0x24, 1684), 842);
    write(&mut timer, 0x10, !CC1IF, 1684);
    assert!(!timer.compare_interrupt());
    // A compare value that has passed is met only after the counter has gone all the way round.
    write(&mut timer, 0x34, 100, 2000);
    assert_eq!(timer.next_event(), 2 << 32);
}

#[test]
fn flags_are_cleared_by_zeroes_and_not_set_by_ones() {
    let mut timer = timer(TIM2, &[(0x34, 10), (0x38, 10), (0x00, CEN)]);
    timer.event(20);
    write(&mut timer, 0x10, !CC1IF, 20);
    assert_eq!(timer.read(0x10, 20), CC1IF << 1);
}

#[test]
fn one_pulse_mode_stops_at_the_update() {
    let mut timer = timer(TIM3, &[(0x2C, 419), (0x00, OPM | URS | CEN)]);
    timer.event(timer.next_event());
    assert_eq!(timer.read(0x00, 0) & CEN, 0);
    assert_eq!(timer.next_event(), NEVER);
}

#[test]
fn an_update_by_the_program_stops_the_counter_in_one_pulse_mode() {
    let mut timer = timer(TIM3, &[(0x2C, 419), (0x00, OPM | CEN)]);
    write(&mut timer, 0x14, UG, 10);
    assert_eq!((timer.read(0x00, 10), timer.next_event()), (OPM, NEVER));
}

#[test]
fn an_update_by_the_program_sets_the_flag_unless_urs_says_otherwise() {
    let update = |control| {
        let mut timer = timer(TIM3, &[(0x00, control), (0x0C, UDE)]);
        let requests = write(&mut timer, 0x14, UG, 0);
        (timer.read(0x10, 0) & UIF, requests.update)
    };
    assert_eq!(update(0), (UIF, true));
    assert_eq!(update(URS), (0, false));
}

#[test]
fn repetitions_are_overflows_without_an_update() {
    let mut timer = timer(
        0,
        &[(0x2C, 9), (0x30, 1), (0x14, UG), (0x10, 0), (0x00, CEN)],
    );
    timer.event(20);
    assert_eq!(timer.read(0x10, 20) & UIF, 0);
    timer.event(40);
    assert_eq!(timer.read(0x10, 40) & UIF, UIF);
}

#[test]
fn requests_for_dma_come_where_they_are_enabled() {
    let mut timer = timer(TIM3, &[(0x2C, 9), (0x34, 5), (0x0C, UDE), (0x00, CEN)]);
    let matched = TimerRequests {
        matched: 1,
        ..TimerRequests::default()
    };
    assert_eq!(timer.event(10), matched);
    assert!(timer.event(20).update);
    write(&mut timer, 0x0C, CC1DE, 20);
    assert_eq!(timer.event(30).compare, 1);
}

#[test]
fn a_top_of_zero_stops_the_counter_until_there_is_another() {
    let mut timer = timer(TIM3, &[(0x24, 5), (0x2C, 0), (0x00, CEN)]);
    assert_eq!((timer.next_event(), timer.read(0x24, 100)), (NEVER, 5));
    write(&mut timer, 0x2C, 9, 100);
    assert_eq!(timer.read(0x24, 104), 7);
    assert_eq!(timer.next_event(), 110);
}

#[test]
fn a_compare_value_above_the_top_raises_its_flag_at_the_overflow() {
    let mut timer = timer(TIM3, &[(0x2C, 9), (0x34, 10), (0x38, 9), (0x00, CEN)]);
    let second = CC1IF << 1;
    assert_eq!(timer.event(18).matched, 2);
    assert_eq!(timer.read(0x10, 18), second);
    assert_eq!(timer.event(20).matched & 3, 1);
    assert_eq!(timer.read(0x10, 20) & (CC1IF | second), CC1IF | second);
}

#[test]
fn an_update_by_the_program_matches_compare_values_of_zero() {
    let timer = timer(TIM3, &[(0x34, 1), (0x14, UG)]);
    assert_eq!(timer.read(0x10, 0), UIF | COMPARES & !CC1IF);
}

#[test]
fn a_capture_can_be_made_by_the_program() {
    let mut timer = timer(TIM3, &[(0x18, 1), (0x20, 1), (0x00, CEN)]);
    assert_eq!(write(&mut timer, 0x14, CC1IF, 84).matched, 0);
    assert_eq!((timer.read(0x34, 84), timer.read(0x10, 84)), (42, CC1IF));
    write(&mut timer, 0x14, CC1IF, 100);
    assert_eq!(timer.read(0x34, 100), 50);
    assert_eq!(timer.read(0x10, 100), CC1IF | CC1OF);
}

#[test]
fn a_count_that_is_written_leaves_the_prescaler_where_it_is() {
    let mut timer = timer(TIM3, &[(0x28, 9), (0x14, UG), (0x00, CEN)]);
    write(&mut timer, 0x24, 100, 50);
    assert_eq!((timer.read(0x24, 59), timer.read(0x24, 60)), (100, 101));
}

#[test]
fn registers_that_are_preloaded_no_longer_count_at_once() {
    let mut timer = timer(
        TIM3,
        &[(0x00, ARPE), (0x2C, 99), (0x18, 1 << 3), (0x34, 30)],
    );
    write(&mut timer, 0x00, CEN, 0);
    assert_eq!(timer.next_event(), 200);
    write(&mut timer, 0x18, 0, 0);
    assert_eq!(timer.next_event(), 60);
}

#[test]
fn what_is_not_modelled_is_said() {
    for (register, value) in [
        (0x00, 1 << 4),
        (0x04, 1 << 3),
        (0x08, 7),
        (0x08, 1 << 14),
        (0x0C, 1 << 6),
        (0x14, 1 << 6),
        (0x18, 3),
        (0x18, 1 << 7),
        (0x1C, 1 << 15),
        (0x44, 1 << 12),
        (0x44, 1 << 8),
        (0x48, 1),
        (0x4C, 1),
    ] {
        let (mut timer, mut warnings) = (Timer::new(&INSTANCES[0]), Warnings::default());
        timer.write(register, value, 0, &mut warnings);
        let base = INSTANCES[0].base;
        let expected = [Warning::TimerMode { base }];
        assert_eq!(warnings.all(), expected, "{register:#x} {value:#x}");
    }
}
