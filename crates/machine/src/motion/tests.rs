use super::*;

fn at(micros: u64) -> Instant {
    Instant::from_ticks(micros)
}

/// The wait of motion after the first of `moves` moves that come every `every` microseconds, µs.
fn waits(silence_ms: u64, moves: usize, every: u64) -> u64 {
    let mut start = Start::new(Duration::from_ticks(silence_ms * 1_000));
    let mut planned = 0;
    (0..)
        .find(|now| {
            if planned < moves && now % every == 0 {
                start.planned(planned == 0, false, at(*now));
                planned += 1;
            }
            start.is_over(planned, at(*now))
        })
        .unwrap_or(u64::MAX)
}

#[test]
fn motion_begins_in_a_silence_or_with_fifteen_moves() {
    assert_eq!(waits(0, 1, 100), 200);
    assert_eq!(waits(0, 3, 150), 500);
    assert_eq!(waits(0, 1000, 100), 1_400);
}

#[test]
fn a_longer_silence_knows_no_other_end() {
    assert_eq!(waits(20, 1, 100), 20_000);
    assert_eq!(waits(20, 1000, 100), 119_900);
}

#[test]
fn a_line_of_many_moves_is_waited_for_until_there_are_enough() {
    let mut start = Start::new(Duration::from_ticks(0));
    start.planned(true, true, at(0));
    assert!(!start.is_over(1, at(1_000_000)));
    assert!(start.is_over(DEPTH, at(1_000_000)));
    start.planned(false, true, at(1_000_001));
    assert!(start.is_over(1, at(1_000_001)), "it has begun");
}

#[test]
fn lines_put_motion_off_for_five_milliseconds_at_most() {
    let mut start = Start::new(Duration::from_ticks(0));
    start.planned(true, false, at(0));
    for now in (0..5_000).step_by(100) {
        start.put_off(at(now));
        assert!(!start.is_over(1, at(now)), "{now}");
    }
    assert!(start.is_over(1, at(5_000)));
}
