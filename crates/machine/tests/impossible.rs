//! Settings that are fine alone and impossible together: motion is capped, and a message says so.

use crate::bench::{Memory, Session};
use leadscrew_machine::config::MachineConfig;

#[test]
fn an_acceleration_that_no_motor_follows_is_capped_and_said() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::new());
    session.line("$700=1");
    assert_eq!(session.line("$100=1600"), ["ok"]);
    let cap = "[MSG:Acceleration: $120 can be 312500.000 at most]";
    assert_eq!(session.line("$120=1000000"), [cap, "ok"]);
    let kept = session.line("$$");
    assert!(kept.contains(&"$120=1000000.000".to_owned()), "{kept:?}");
    assert_eq!(session.line("$120=312500"), ["ok"]);
    assert_eq!(session.line("$120=1000000"), [cap, "ok"]);
    let rate = "[MSG:Step rate: $110 can be 3409.080 at most]";
    assert_eq!(session.line("$110=10000"), [rate, "ok"]);
    assert_eq!(session.line("$100=1500").len(), 3, "both caps");
    assert_eq!(session.line("$100=1600"), [rate, cap, "ok"]);
    // The bench counts segments that ran out.
    for line in ["G0X3", "G1X0F3000", "G2X3Y3I3F3000", "$J=G91X-1F9000"] {
        session.send(format!("{line}\n"));
        session.until_quiet();
        assert_eq!(session.lines(), ["ok"], "{line}");
    }
    assert_eq!(session.pins.position[0], 2 * 1600);
}
