//! Streams of random bytes, and streams of real senders that are easy to get wrong.

#[path = "abuse/scripts.rs"]
mod scripts;

use leadscrew_planner::Cartesian;
use leadscrew_sim::{Cycle, Memory, Rate, Setup};
use leadscrew_tests::abuse::endure;
use leadscrew_tests::{setup, Session};
use proptest::prelude::*;
use std::num::NonZeroU32;

type Desk<'a> = Session<'a, Cartesian, 3>;

/// The number of cases: `PROPTEST_CASES`, or 512.
fn cases() -> u32 {
    let told = std::env::var("PROPTEST_CASES").ok();
    told.and_then(|told| told.parse().ok()).unwrap_or(512)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]

    #[test]
    fn any_stream_leaves_a_machine_that_answers(script in scripts::script()) {
        endure(&script);
    }
}

/// Found by the property above: the pulse before a stop was still high when the new settings took
/// effect.
#[test]
fn a_direction_that_changes_with_a_setting_waits_for_the_last_pulse() {
    let script: [&[u8]; 5] = [&[0, 255], b"$3=5\n", &[255], b"G1X5Y2F3000\n", b"M3S500\n"];
    endure(&script.concat());
}

/// Found by the property above: `$G` said M8, and the valve was shut.
#[test]
fn a_coolant_toggled_while_m30_waits_for_motion_is_off_after_it_and_in_the_modes() {
    endure(b"\x04G1X5Y2F3000\nM30\n\xF0\xA0");
}

/// The property above once failed without a fault: the machine had answered, but the `ok` was still
/// on the slow wire.
#[test]
fn an_answer_that_is_on_the_wire_when_a_stream_ends_is_waited_for() {
    for tenths in 7960..8000 {
        let line = format!("G4P0.{tenths}\n");
        endure(&[b"\0\xFF", line.as_bytes()].concat());
    }
}

/// The property above once failed without a fault: the rest of a move that parking has interrupted
/// is a planned line of its own, and burns.
#[test]
fn a_move_burns_on_after_parking() {
    endure(b"\x20$32=1\nG0Z-5.1\n\xF7\xF7M3S500G1X-5Y-2F3000\n\xF5\x84\xF7\xF7\xF7~\xF7\xF7");
    endure(b"$G0Z-8\nG1X-5Y-2F3000S500\n!\xF5\x9EG1X-5Y-2F3000S500\n!\xF5\x9E~\xA0\xF4\xF3\xF5\xF4G1X-5Y-2F3000S500\n\xF5!\xF5\x84\xF5\x18$X\n$32=1\nM3S500G1F3000\nG1X-5Y-2F3000S500\n\xF0\x84G1X-5Y-2F3000S500\n!\xF5\x9E\xF5~");
}

/// Found by the property above: a jog burns under M3 in G0, too, and the laser stayed lit after its
/// end.
#[test]
fn a_laser_is_dark_after_a_jog_in_g0() {
    endure(b"\x01M3S100\n$J=G91X1F3000\n");
    endure(b" $32=1\nM3S500G1F3000\nG0Z-8\nM7\n$J=G91X-5F3000\n");
    endure(b"\0$32=1\nM3S500G1F3000\nG93\nG1X-5Y-2F3000S500\nG0\n$J=G91X-5F3000\n");
    endure(b"\x11M3S100\n$J=G91X-2F3000\n$J=G91Y-2F3000\n$J=G91X1F3000\n");
}

fn baud(baud: u32) -> Rate {
    Rate::Baud(NonZeroU32::new(baud).unwrap())
}

/// A machine with one serial line of that rate.
fn one_line(rate: Rate) -> Setup<3> {
    let mut setup = setup::<3>(1);
    setup.lines = vec![rate];
    setup
}

/// A second and more of motion, in ten lines.
const JOB: &str = "G21G91G1X2F1500\nY2\nX-2\nY-2\nX2\nY2\nG2X2Y2I2\nG1X-2\nY-2\nX7.33\n";

const QUICK: &str = "$110=6000\n$111=6000\n$120=500\n$121=500\n";

fn with_session(run: impl FnOnce(&mut Desk<'_>)) -> [i64; 3] {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream(QUICK);
    run(&mut session);
    session.finish().net_steps()
}

#[test]
fn on_the_way_to_sleep_a_spindle_turns_until_it_is_out_of_the_work() {
    endure(b"*$32=0\nM3S500G1F3000\nG0Z-8\nG92X1\n$SLP\n");
    endure(b"*$32=0\nM3S500G1F3000\nG0Z-8\nG92X1\n$SLP\n\xF7\xF7\xF7\xF7\xF7\xF7\xF7\xF7\xF7\xF7");
}

#[test]
fn a_realtime_byte_in_utf_8_acts_once_and_leaves_its_line_untouched() {
    let steps = with_session(|session| {
        assert_eq!(session.say("G1X1\u{91}0F600\n"), ["ok"]);
        assert_eq!(session.sim.machine().overrides().feed, 110);
    });
    assert_eq!(steps, [2500, 0, 0]);
}

#[test]
fn a_jog_right_after_a_cancel_waits_for_the_stop_and_has_one_answer() {
    with_session(|session| {
        session.send(0, "$J=G91X50F3000\n");
        session.wait_us(500_000);
        assert_eq!(session.heard(0), ["ok"]);
        let before = session.sim.counted_position()[0];
        session.send(0, b"\x85$J=G91X1F3000\n");
        session.until_quiet();
        assert_eq!(session.heard(0), ["ok"]);
        let moved = session.sim.counted_position()[0] - before;
        assert!((250..2500).contains(&moved), "{moved}");
    });
}

#[test]
fn a_reset_leaves_ten_lines_unanswered() {
    with_session(|session| {
        session.send(0, "G4P2\n");
        session.wait_us(100_000);
        session.send(0, "G1X5F600\n".repeat(9));
        session.wait_us(10_000);
        session.heard(0);
        session.send(0, b"\x18");
        session.wait_us(10_000);
        session.send(0, "?");
        session.until_quiet();
        let heard = session.heard(0);
        let banner = heard.iter().position(|line| line.starts_with("Grbl"));
        let after = &heard[banner.expect("a banner") + 1..];
        assert!(!after.iter().any(|line| line == "ok"), "{heard:?}");
        let reports = after.iter().filter(|line| line.starts_with('<'));
        assert_eq!(reports.count(), 1, "{heard:?}");
    });
}

#[test]
fn a_query_up_to_30_ms_after_a_reset_is_answered_after_the_banner() {
    for rate in [baud(115_200), baud(3_000_000), Rate::NeverWaits] {
        for (job, millis) in ["", JOB, "$$\n"]
            .into_iter()
            .flat_map(|job| (1..=30).map(move |millis| (job, millis)))
        {
            let setup = one_line(rate);
            let mut memory = Memory::new(&setup);
            let mut session = Session::new(&mut memory, &setup, Cartesian);
            session.stream(QUICK);
            session.send(0, job);
            session.wait_us(20_000);
            session.heard(0);
            session.send(0, b"\x18");
            session.wait_us(millis * 1_000);
            session.send(0, "?");
            session.until_quiet();
            let heard = session.heard(0);
            let of = |begin: &str| heard.iter().position(|line| line.starts_with(begin));
            let banner = of("Grbl 1.1h").expect("a banner");
            let report = of("<").unwrap_or_else(|| panic!("{job:?} {millis}: {heard:?}"));
            assert!(banner < report, "{job:?} {millis}: {heard:?}");
            let oks = heard[banner..].iter().filter(|line| *line == "ok");
            assert_eq!(oks.count(), 0, "{job:?} {millis}: {heard:?}");
        }
    }
}

/// The machine position of a report, as it is written.
fn mpos(report: &str) -> &str {
    let fields = report.split('|');
    fields
        .filter_map(|field| field.strip_prefix("MPos:"))
        .next()
        .expect("MPos")
}

/// The machine position of the simulated carriages, as reports write it.
fn plant_mpos(session: &Desk<'_>) -> String {
    let steps = session.sim.board().plant.position();
    steps
        .map(|steps| format!("{:.3}", f64::from(steps) / 250.0))
        .join(",")
}

fn ask(session: &mut Desk<'_>) -> String {
    session.send(0, "?");
    session.wait_us(30_000);
    let mut heard = session.heard(0).into_iter();
    let report = heard.rfind(|line| line.starts_with('<'));
    report.expect("a report")
}

/// Moments at which an operator may want a job to end, µs.
const MOMENTS: [u64; 6] = [3_000, 20_000, 80_000, 150_000, 333_333, 700_000];

#[test]
fn a_hold_half_a_second_and_a_reset_end_a_job_unlocked_where_it_stands() {
    for rate in [baud(115_200), Rate::NeverWaits] {
        for moment in MOMENTS {
            let setup = one_line(rate);
            let mut memory = Memory::new(&setup);
            let mut session = Session::new(&mut memory, &setup, Cartesian);
            session.stream(QUICK);
            session.send(0, JOB);
            session.wait_us(moment);
            session.send(0, "!");
            session.wait_us(500_000);
            session.heard(0);
            assert!(ask(&mut session).starts_with("<Hold:0|"), "{moment}");
            let stopped = plant_mpos(&session);
            session.send(0, b"\x18");
            session.until_quiet();
            assert_eq!(session.heard(0), ["Grbl 1.1h ['$' for help]"], "{moment}");
            let report = ask(&mut session);
            assert!(report.starts_with("<Idle|"), "{moment}: {report}");
            assert_eq!(mpos(&report), stopped, "{moment}");
            assert_eq!(plant_mpos(&session), stopped, "{moment}: moved");
            assert_eq!(session.say("G91G0X1\n"), ["ok"], "{moment}");
        }
    }
}

#[test]
fn a_hold_a_reset_an_unlock_and_the_old_modes_end_a_job_as_it_was() {
    for moment in MOMENTS {
        with_session(|session| {
            session.stream("G55\nG43.1Z2.5\n");
            session.send(0, JOB);
            session.send(0, "$G\n");
            session.wait_us(moment);
            let heard = session.heard(0);
            let modes = heard.into_iter().find(|line| line.starts_with("[GC:"));
            let modes = modes.expect("modes");
            let words = modes.trim_start_matches("[GC:").trim_end_matches(']');
            session.send(0, "!");
            session.wait_us(1_000_000);
            let stopped = plant_mpos(session);
            session.send(0, b"\x18");
            session.wait_us(1_000_000);
            session.heard(0);
            assert_eq!(session.say("$X\n"), ["ok"], "{moment}");
            assert_eq!(session.say(&format!("{words}\n")), ["ok"], "{words}");
            assert_eq!(session.say("G43.1Z2.5\n"), ["ok"], "{moment}");
            let report = ask(session);
            assert!(report.starts_with("<Idle|"), "{moment}: {report}");
            assert_eq!(mpos(&report), stopped, "{moment}");
            assert_eq!(session.say("$G\n")[0], modes, "{moment}");
        });
    }
}

#[test]
fn a_query_with_a_line_end_is_a_report_and_an_ok() {
    with_session(|session| {
        for query in ["?\n", "?\r"] {
            let heard = session.say(query);
            let [report, ok] = &heard[..] else {
                panic!("{heard:?}");
            };
            assert!(report.starts_with("<Idle|") && ok == "ok", "{heard:?}");
        }
    });
}

#[test]
fn a_report_stands_between_the_rows_of_a_list() {
    // The transmission of a line takes from no time to half a second.
    for (rate, pause) in [
        (Rate::NeverWaits, 20),
        (baud(3_000_000), 50),
        (baud(115_200), 1_100),
        (baud(300), 400_000),
    ] {
        let setup = one_line(rate);
        let mut memory = Memory::new(&setup);
        let mut session = Session::new(&mut memory, &setup, Cartesian);
        session.send(0, "$$\n");
        for _ in 0..40 {
            session.wait_us(pause);
            session.send(0, "?");
        }
        session.until_quiet();
        let heard = session.heard(0);
        let rows = heard.iter().filter(|line| line.starts_with('$'));
        assert_eq!(rows.count(), 34);
        for line in &heard {
            let report = line.starts_with('<') && line.ends_with('>');
            let row = line.starts_with('$') && !line.contains(['<', '>']);
            assert!(report || row || line == "ok", "{line}");
        }
        let ok = heard.iter().position(|line| line == "ok");
        let first = heard.iter().position(|line| line.starts_with('<'));
        assert!(first.is_some() && first < ok, "{rate:?}: {heard:?}");
    }
}

/// The free places of the planner and the free bytes of the receive buffer in a report.
fn free(report: &str) -> (usize, usize) {
    let field = report
        .split('|')
        .find_map(|field| field.strip_prefix("Bf:"));
    let (moves, bytes) = field
        .expect("Bf")
        .trim_end_matches('>')
        .split_once(',')
        .unwrap();
    (moves.parse().unwrap(), bytes.parse().unwrap())
}

#[test]
fn nothing_is_lost_of_128_bytes_counted_with_a_full_planner_and_a_query_every_40_ms() {
    for rate in [baud(115_200), baud(3_000_000), Rate::NeverWaits] {
        stream_by_counting(rate);
    }
}

fn stream_by_counting(rate: Rate) {
    const WINDOW: usize = 128;
    let lines: Vec<_> = (1..400)
        .map(|k| format!("G1X{}.5Y{}F3000\n", k % 7, k % 5))
        .collect();
    let mut setup = setup::<3>(1);
    setup.machine = leadscrew_machine::config::MachineConfig::grbl();
    setup.receive_buffer = WINDOW;
    setup.lines = vec![rate];
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream("$110=6000\n$111=6000\n$120=500\n$121=500\n$10=3\n");
    let (mut sent, mut answered, mut full) = (0, 0, 0);
    let mut query = session.sim.now();
    while answered < lines.len() {
        let waiting = |sent: usize| lines[answered..sent].iter().map(String::len).sum::<usize>();
        while sent < lines.len() && waiting(sent) + lines[sent].len() <= WINDOW {
            session.send(0, &lines[sent]);
            sent += 1;
        }
        let held = waiting(sent);
        if session.sim.now() >= query {
            query = query + Cycle::from_micros(40_000).0;
            session.send(0, "?");
        }
        session.wait_us(1_000);
        for heard in session.heard(0) {
            if heard == "ok" {
                answered += 1;
                continue;
            }
            let (moves, bytes) = free(&heard);
            full += usize::from(moves == 0);
            assert!(bytes <= WINDOW && bytes + held >= WINDOW, "{heard} {held}");
        }
    }
    assert!(full > 100, "{full}");
    session.until_quiet();
    let run = session.finish();
    assert_eq!(run.net_steps(), [125, 1000, 0]);
}
