//! 0x18 at any moment: the lines behind it are answered as on a fresh machine, and no line is carried
//! out in part.

use leadscrew_planner::Cartesian;
use leadscrew_sim::Memory;
use leadscrew_tests::{setup, Session};

type Desk<'a> = Session<'a, Cartesian, 3>;

const BANNER: &str = "Grbl 1.1h ['$' for help]";

/// A machine with two lines.
fn desk(test: impl FnOnce(&mut Desk<'_>)) {
    let setup = setup::<3>(2);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream("$110=6000\n$120=500\n");
    session.heard(0);
    test(&mut session);
}

/// The lines heard behind the banner.
fn behind_banner(heard: &[String]) -> &[String] {
    let banner = heard.iter().rposition(|line| line == BANNER);
    &heard[banner.expect("a banner") + 1..]
}

/// The bytes that a sender may have sent before its 0x18, whole lines and parts of one.
const BEFORE: [&str; 12] = [
    "",
    "G1X1F60",
    "G1 (half a com",
    "G91G20F60\nG1X1\n",
    "G1X50F600\nX60\nX70F3",
    "!",
    "G1X50F600\n!",
    "$J=G91X50F600\n",
    "G4P1\nG1X",
    "M0\nG1X1F60\n",
    "G93\nG1X1F60\nG1",
    "$C\nF60\n",
];

/// A sender that does not wait for the banner. Each line needs what the lines before it have set:
/// one that is lost, or a word of it, is an error or another place.
#[test]
fn lines_sent_right_behind_a_reset_are_all_carried_out_whole() {
    for before in BEFORE {
        for wait_us in [0, 90, 1_000, 30_000, 300_000] {
            desk(|session| {
                session.send(0, before);
                session.wait_us(wait_us);
                session.send(
                    0,
                    "\x18$X\nG21G91F600\nG1X1\nX1\nG90G2X-1R9F700\nX1Y1R5\n$G\n",
                );
                session.wait_us(20_000_000);
                let heard = session.heard(0);
                let heard = behind_banner(&heard);
                let oks = heard.iter().filter(|line| *line == "ok").count();
                assert!(
                    !heard.iter().any(|line| line.starts_with("error")),
                    "{heard:?}"
                );
                let modes = "[GC:G2 G54 G17 G21 G90 G94 M5 M9 T0 F700 S0]".to_owned();
                assert!(oks == 7 && heard.contains(&modes), "{before:?} {heard:?}");
            });
        }
    }
}

/// A reset that comes from another line drops what has come of a line, and so the rest of it, too.
#[test]
fn a_line_that_the_reset_of_another_line_tears_is_not_carried_out_from_its_middle() {
    let whole = "(a)G91 G1 X10 F600 ; b";
    for cut in 1..whole.len() {
        for resets in 1..3 {
            desk(|session| {
                session.send(0, &whole[..cut]);
                session.wait_us(2_000);
                (0..resets).for_each(|_| session.send(1, "\x18"));
                session.wait_us(2_000);
                session.send(0, format!("{}\nG90F5\nG0X1\n", &whole[cut..]));
                session.wait_us(3_000_000);
                let heard = session.heard(0);
                assert_eq!(behind_banner(&heard), ["ok", "ok"], "{cut} {heard:?}");
                assert_eq!(session.sim.machine().position()[0].to_mm(), 1.0, "{cut}");
            });
        }
    }
}
