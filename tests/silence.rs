//! A laser that is lit at rest under M3 needs a sender that is present. If the sender falls silent,
//! goes away or is replaced by another, the laser goes dark.

use leadscrew_planner::Cartesian;
use leadscrew_sim::Memory;
use leadscrew_stepper::Power;
use leadscrew_tests::{setup, Session};

type Desk<'a> = Session<'a, Cartesian, 3>;

/// The message to the operator; it comes once.
const WHY: &str = "[MSG:Laser off, its sender is silent ($707)]";

const SECOND: u64 = 1_000_000;

/// Runs `test` on a machine with a laser and two lines; line 0 has left it lit at rest at X1.
fn lit_at_rest(test: impl FnOnce(&mut Desk<'_>)) {
    let setup = setup::<3>(2);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream("$32=1\n$110=6000\n$120=500\n");
    light(&mut session);
    session.heard(1);
    test(&mut session);
    session.finish();
}

/// Line 0 burns to X1 and stays there.
fn light(session: &mut Desk<'_>) {
    session.send(0, "M3S800G1F6000X0\nX1\n");
    session.wait_us(SECOND / 2);
    assert_eq!(session.heard(0), ["ok", "ok"]);
    assert!(is_lit(session));
}

fn is_lit(session: &Desk<'_>) -> bool {
    session.sim.board().power() > Power::OFF
}

/// Sends text on a line and waits half a second. Returns the lines heard on that line.
fn say(session: &mut Desk<'_>, line: usize, text: &str) -> Vec<String> {
    session.send(line, text);
    session.wait_us(SECOND / 2);
    session.heard(line)
}

fn let_expire(session: &mut Desk<'_>) {
    session.wait_us(5 * SECOND / 2);
    assert_eq!(session.heard(0), [WHY]);
    assert!(!is_lit(session));
}

#[test]
fn a_laser_lit_at_rest_goes_dark_two_seconds_after_the_last_byte_and_says_so_once() {
    lit_at_rest(|session| {
        session.send(0, "?");
        session.wait_us(1_990_000);
        session.heard(0);
        assert!(is_lit(session));
        session.wait_us(20_000);
        assert!(!is_lit(session));
        assert_eq!(session.heard(0), [WHY]);
        assert_eq!(session.heard(1), [WHY]);
        session.wait_us(3600 * SECOND);
        assert!(!is_lit(session) && session.heard(0).is_empty());
    });
}

#[test]
fn a_sender_that_polls_keeps_its_laser_lit() {
    lit_at_rest(|session| {
        for _ in 0..20 {
            session.wait_us(SECOND);
            say(session, 0, "?");
            assert!(is_lit(session));
        }
    });
}

#[test]
fn another_line_that_polls_keeps_it_from_nothing() {
    lit_at_rest(|session| {
        for _ in 0..5 {
            say(session, 1, "?");
        }
        assert!(!is_lit(session));
        assert_eq!(session.heard(0), [WHY]);
    });
}

#[test]
fn a_dwell_burns_as_long_as_it_says() {
    lit_at_rest(|session| {
        session.send(0, "G4P10\n");
        session.wait_us(9_900_000);
        assert!(is_lit(session));
        session.wait_us(2_000_000);
        assert!(is_lit(session), "1.9 s after the pierce");
        session.wait_us(200_000);
        assert!(!is_lit(session));
    });
}

#[test]
fn the_time_is_a_setting_and_0_means_never() {
    lit_at_rest(|session| {
        say(session, 0, "$707=0.5\n");
        session.wait_us(SECOND / 10);
        assert!(!is_lit(session));
        say(session, 0, "$707=0\n");
        light(session);
        session.wait_us(3600 * SECOND);
        assert!(is_lit(session));
    });
}

/// `$$` would print such a time as 0, and 0 is for ever.
#[test]
fn a_time_that_prints_as_0_is_refused_unless_it_is_0() {
    lit_at_rest(|session| {
        for time in ["0.000000001", "0.0000009", "0.000999"] {
            let said = say(session, 0, &format!("$707={time}\n"));
            assert_eq!(said, ["error:52"], "{time}");
        }
        let_expire(session);
    });
}

#[test]
fn only_a_cut_of_the_same_line_lights_it_up_again() {
    for words in [
        "S500\n",
        "M3\n",
        "G1\n",
        "G0X2\nG1\n",
        "G4P0\n",
        "$J=X3F600\n",
    ] {
        lit_at_rest(|session| {
            let_expire(session);
            say(session, 0, words);
            assert!(!is_lit(session), "{words}");
        });
    }
    for words in ["G1X2\n", "X2\n", "G2X2I.5\n"] {
        lit_at_rest(|session| {
            let_expire(session);
            say(session, 0, words);
            assert!(is_lit(session), "{words}");
        });
    }
}

#[test]
fn a_jog_of_a_silent_sender_is_dark_all_the_way() {
    lit_at_rest(|session| {
        let_expire(session);
        session.send(0, "$J=X9F600\n");
        for _ in 0..10 {
            session.wait_us(SECOND / 10);
            assert!(!is_lit(session));
        }
    });
}

#[test]
fn m5_and_m3_begin_anew() {
    lit_at_rest(|session| {
        let_expire(session);
        say(session, 0, "M5\nM3\n");
        assert!(is_lit(session));
    });
}

#[test]
fn another_line_that_takes_over_finds_the_laser_off() {
    for expired in [false, true] {
        lit_at_rest(|session| {
            if expired {
                let_expire(session);
            }
            say(session, 1, "X2\n");
            assert!(!is_lit(session));
            assert!(say(session, 1, "$G\n")[0].contains(" M5 "));
            say(session, 1, "M3X3\n");
            assert!(is_lit(session));
        });
    }
}

#[test]
fn a_line_that_closes_at_rest_is_m5() {
    lit_at_rest(|session| {
        session.leave(0);
        session.wait_us(10_000);
        assert!(!is_lit(session));
        let modes = say(session, 0, "$G\n");
        assert!(modes[0].contains(" M5 "), "{modes:?}");
    });
}

#[test]
fn a_line_that_closes_in_motion_is_m5_behind_what_it_sent() {
    lit_at_rest(|session| {
        session.send(0, "G1X10F600\nX20\n");
        session.leave(0);
        session.wait_us(SECOND);
        assert!(is_lit(session));
        session.wait_us(SECOND);
        assert!(!is_lit(session));
        assert_eq!(session.sim.machine().position()[0].to_mm(), 20.0);
    });
}

#[test]
fn a_line_that_has_no_job_closes_without_a_word() {
    lit_at_rest(|session| {
        session.leave(1);
        session.wait_us(SECOND);
        assert!(is_lit(session));
    });
}

#[test]
fn what_a_client_had_begun_to_say_is_not_the_next_one_s() {
    lit_at_rest(|session| {
        session.send(0, "G0X5");
        session.leave(0);
        session.wait_us(10_000);
        assert_eq!(say(session, 0, "7\n"), ["error:1"]);
        assert_eq!(session.sim.machine().position()[0].to_mm(), 1.0);
    });
}
