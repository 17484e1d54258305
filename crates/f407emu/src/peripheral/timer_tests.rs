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
    // An instant that has passed comes once the counter has been all the way round.
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
fn an_update_by_the_program_sets_the_flag_unless_urs_says_otherwise() {
    let plain = timer(TIM3, &[(0x14, UG)]);
    assert_eq!(plain.read(0x10, 0), UIF);
    let quiet = timer(TIM3, &[(0x00, URS), (0x14, UG)]);
    assert_eq!(quiet.read(0x10, 0), 0);
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
