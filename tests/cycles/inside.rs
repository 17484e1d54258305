//! Canned cycles together with check mode, limits, overrides, settings and the answers to lines.

use leadscrew_planner::Cartesian;
use leadscrew_sim::Memory;
use leadscrew_tests::{setup, Session};

const SETTINGS: &str = "$0=5\n$110=6000\n$111=6000\n$112=6000\n$120=1000\n$121=1000\n$122=1000\n";

/// A cycle of pecks that takes a minute, half of it in rapids.
const PECKS: &str = "G91G83Z-10R-1Q0.2F40L2\n";

type Desk<'a> = Session<'a, Cartesian, 3>;

fn begin(memory: &mut Memory<3, 3>) -> Desk<'_> {
    let mut session = Session::new(memory, &setup::<3>(1), Cartesian);
    session.stream(SETTINGS);
    session.heard(0);
    session
}

fn with_machine(then: impl FnOnce(&mut Desk<'_>)) {
    let mut memory = Memory::new(&setup::<3>(1));
    let mut session = begin(&mut memory);
    then(&mut session);
    session.finish();
}

/// Waits until the lines under way are done. Returns how long they take, s.
fn seconds(session: &mut Desk<'_>) -> f64 {
    let begun = session.sim.now().seconds();
    session.until_quiet();
    session.sim.now().seconds() - begun
}

#[test]
fn a_line_is_answered_when_its_last_move_is_queued() {
    with_machine(|session| {
        session.say("$710=0.2\n");
        session.send(0, PECKS);
        session.wait_us(1_000_000);
        assert!(session.heard(0).is_empty(), "most of its moves are to come");
        let left = seconds(session);
        assert!(left > 5.0, "{left}");
        assert_eq!(session.heard(0), ["ok"]);
    });
}

#[test]
fn overrides_act_in_mid_cycle() {
    let mut whole = 0.0;
    with_machine(|session| {
        session.send(0, PECKS);
        whole = seconds(session);
    });
    with_machine(|session| {
        session.send(0, PECKS);
        session.wait_us(1_000_000);
        session.send(0, [0x91; 10]); // feed 200 %
        let faster = 1.0 + seconds(session);
        assert!(faster < 0.75 * whole, "{faster} of {whole}");
    });
    with_machine(|session| {
        session.send(0, PECKS);
        session.wait_us(1_000_000);
        session.send(0, [0x97]); // rapids 25 %
        let slower = 1.0 + seconds(session);
        assert!(slower > 1.1 * whole, "{slower} of {whole}");
    });
}

#[test]
fn a_cycle_that_would_leave_the_travel_does_not_begin() {
    for line in [
        "G90G99G81X-1Y-1Z-201R-1F600\n",
        "G90G99G81X-1Y-1Z-10R1F600\n",
        "G91G99G81X-50Z-10R-1L5F600\n",
        "G91G99G81X1Z-10R-1F600\n",
        "G18G90G81X-1Y-201R-1F600\n",
    ] {
        with_machine(|session| {
            session.say("$22=1\n$20=1\n$130=200\n$131=200\n$132=200\n");
            let heard = session.say(line);
            assert_eq!(heard.first().map(String::as_str), Some("ALARM:2"), "{line}");
            assert_eq!(session.sim.counted_position(), [0; 3], "{line}");
        });
    }
}

#[test]
fn check_mode_finds_the_faults_of_a_run() {
    with_machine(|session| {
        session.say("$22=1\n$20=1\n$130=200\n$131=200\n$132=200\n$C\nM3S500\n");
        let heard = session.say("G86X-1Z-10R-1P1F600\nX-2\nG83Z-2\nG98\nX-2L0\n");
        assert_eq!(heard, ["ok", "ok", "error:28", "ok", "error:52"]);
        assert_eq!(
            session.say("G81X-3Z-300R-1\n"),
            ["ALARM:2", "[MSG:Reset to continue]"]
        );
        assert_eq!(session.sim.counted_position(), [0; 3]);
    });
}

#[test]
fn a_reset_forgets_the_cycle() {
    with_machine(|session| {
        session.send(0, PECKS);
        session.wait_us(1_000_000);
        session.send(0, "!");
        session.wait_us(500_000);
        session.send(0, [0x18]);
        session.wait_us(2_000_000);
        let at = session.sim.counted_position();
        session.heard(0);
        assert_eq!(session.say("$X\n").last().unwrap(), "ok");
        assert_eq!(session.sim.counted_position(), at, "nothing is left of it");
        let modes = session.say("$G\n");
        assert!(
            modes[0].starts_with("[GC:G0 G54 G17 G21 G90 G94 M5 M9"),
            "{modes:?}"
        );
        assert_eq!(session.say("G81X1F100\n"), ["error:28"]);
    });
}

#[test]
fn modes_show_the_cycle_and_g99_only() {
    with_machine(|session| {
        session.say("G98G81X1Z-1R1F600\n");
        let modes = session.say("$G\n");
        assert_eq!(modes[0], "[GC:G81 G54 G17 G21 G90 G94 M5 M9 T0 F600 S0]");
        session.say("G99\n");
        let modes = session.say("$G\n");
        assert_eq!(
            modes[0],
            "[GC:G81 G54 G17 G21 G90 G94 G99 M5 M9 T0 F600 S0]"
        );
    });
}

#[test]
fn the_clearance_is_a_setting_that_can_be_read() {
    with_machine(|session| {
        assert_eq!(session.say("$711\n"), ["$711=0.254", "ok"]);
        assert_eq!(session.say("$711=0.1\n"), ["ok"]);
        assert_eq!(session.say("$711\n"), ["$711=0.100", "ok"]);
        let listed = session.say("$ES\n");
        assert!(
            listed.iter().any(|line| line.starts_with("[SETTING:711|")),
            "{listed:?}"
        );
        assert_eq!(session.say("$711=-1\n"), ["error:4"]);
    });
}

#[test]
fn moves_shorter_than_a_step_hold_nothing_up() {
    with_machine(|session| {
        let heard = session.say("G91G83X0Z-0.0001R0Q0.00005L20F100\nG81Z0R0\nG80\n");
        assert_eq!(heard, ["ok", "ok", "ok"]);
    });
    with_machine(|session| {
        let heard = session.say("G91G98G81X1Z-0.0001R0F100\n");
        assert_eq!(heard, ["ok"]);
        assert_eq!(session.sim.counted_position(), [250, 0, 0]);
    });
}

#[test]
fn a_pause_comes_behind_the_cycle() {
    with_machine(|session| {
        session.send(0, "G81X1Z-1R0.5F600M0\n");
        session.until_quiet();
        assert_eq!(session.sim.counted_position(), [250, 0, 125]);
        assert!(session.heard(0).is_empty());
        assert_eq!(session.say("~"), ["ok"]);
    });
}
