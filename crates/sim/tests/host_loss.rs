//! The loads that heat, turn or burn, in each state of the machine, when its sender falls silent,
//! goes away, or presses the red button.

use leadscrew_machine::board::{ChannelId, CoolantOutput, SpindleOutput};
use leadscrew_sim::powered::Powered;
use leadscrew_sim::profile::Profile;
use leadscrew_sim::PowerUp;
use leadscrew_sim::{Cycle, Host, Rate};
use std::collections::VecDeque;
use std::path::Path;

/// Each load goes off after 5 s of silence, or 20 s without G-code. The bed is slow, so that the
/// wait for it outlasts each test.
const MACHINE: &str = "
[axes.x]
steps_per_mm = 10
rate_mm_min = 6000
acceleration_mm_s2 = 1000
[outputs]
count = 3
boot = 4
stay = 2
[heaters.nozzle]
sensor = \"ad595\"
[heaters.bed]
sensor = \"ad595\"
warms_k_s = 0.1
cools_s = 1500
[fan]
fitted = true
[tool_change]
";

const TIMES: &str = "
[laser]
dead_man_s = 5
[dead_man]
spindle_s = 5
coolant_s = 5
heat_s = 5
outputs_s = 5
laser_unfed_s = 20
spindle_unfed_s = 20
coolant_unfed_s = 20
heat_unfed_s = 20
outputs_unfed_s = 20
";

#[derive(Default)]
struct Wire {
    to_send: VecDeque<u8>,
    leaves: bool,
    incoming: Vec<u8>,
    heard: Vec<String>,
}

/// The other ends of two lines. The job is line 0's; reports are asked for on line 1, which is no
/// part of the job.
#[derive(Default)]
struct Desk([Wire; 2]);

impl Host for Desk {
    fn next_byte(&mut self, channel: ChannelId) -> Option<u8> {
        self.0[usize::from(channel.0)].to_send.pop_front()
    }
    fn closes(&mut self, channel: ChannelId) -> bool {
        let wire = &mut self.0[usize::from(channel.0)];
        wire.to_send.is_empty() && std::mem::take(&mut wire.leaves)
    }
    fn receive(&mut self, channel: ChannelId, byte: u8, _: Cycle) {
        let wire = &mut self.0[usize::from(channel.0)];
        match byte {
            b'\r' => {}
            b'\n' => wire
                .heard
                .push(String::from_utf8(std::mem::take(&mut wire.incoming)).unwrap()),
            other => wire.incoming.push(other),
        }
    }
}

struct Session<'a> {
    machine: &'a mut dyn Powered,
    desk: Desk,
}

impl Session<'_> {
    fn wait_ms(&mut self, millis: u64) {
        let end = self.machine.now() + Cycle::from_micros(millis * 1_000).0;
        self.machine.wait_until(&mut self.desk, end);
    }

    fn send(&mut self, line: usize, bytes: impl AsRef<[u8]>) {
        self.desk.0[line].to_send.extend(bytes.as_ref());
        self.wait_ms(10);
    }

    fn report(&mut self) -> String {
        self.desk.0[1].heard.clear();
        self.send(1, "?");
        let heard = &self.desk.0[1].heard;
        heard
            .iter()
            .find(|line| line.starts_with('<'))
            .unwrap()
            .clone()
    }

    fn field(&mut self, name: &str) -> String {
        let report = self.report();
        let mut fields = report.trim_matches(['<', '>']).split('|');
        let field = fields.find_map(|field| field.strip_prefix(name));
        field
            .unwrap_or_else(|| panic!("no {name} in {report}"))
            .to_owned()
    }

    fn state(&mut self) -> String {
        let report = self.report();
        report[1..report.find('|').unwrap()].to_owned()
    }

    /// The nozzle's temperature and target.
    fn nozzle(&mut self) -> (f32, f32) {
        let field = self.field("Heat:N,");
        let nozzle = field.split(';').next().unwrap();
        let (celsius, target) = nozzle.split_once(',').unwrap();
        (celsius.parse().unwrap(), target.parse().unwrap())
    }

    fn is_on(&mut self, load: Load) -> bool {
        let pins = self.machine.snapshot();
        match load {
            Load::Laser => pins.power > 0.0,
            Load::Spindle => pins.spindle != SpindleOutput::Off && pins.power > 0.0,
            Load::Coolant => pins.coolant != CoolantOutput::default(),
            Load::Heat => self.nozzle().1 > 0.0,
            Load::Output => self.field("Out:").starts_with('1'),
            Load::StayingOutput => self.field("Out:")[1..].starts_with('1'),
        }
    }

    /// The messages that say that a load went off, on line 0.
    fn said(&self, load: Load) -> Vec<&str> {
        let name = format!("[MSG:{} off, ", load.name());
        let heard = self.desk.0[0].heard.iter();
        heard.filter_map(|line| line.strip_prefix(&name)).collect()
    }
}

/// Powers the machine of a file up and lends it to `test`.
fn session(file: &str, test: impl FnOnce(&mut Session<'_>)) {
    let file = Profile::parse(Path::new("machine.toml"), file).unwrap();
    let mut supply = file.supply(Rate::NeverWaits);
    supply.lines = 2;
    let mut test = Some(test);
    file.power_up(supply, &mut (), &mut |machine| {
        let desk = Desk::default();
        let mut session = Session { machine, desk };
        session.wait_ms(100);
        if let Some(test) = test.take() {
            test(&mut session);
        }
    });
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Load {
    Laser,
    Spindle,
    Coolant,
    Heat,
    Output,
    /// An output that stays as it is in a hold.
    StayingOutput,
}

impl Load {
    fn name(self) -> &'static str {
        match self {
            Load::Laser => "Laser",
            Load::Spindle => "Spindle",
            Load::Coolant => "Coolant",
            Load::Heat => "Heaters",
            Load::Output | Load::StayingOutput => "Outputs",
        }
    }

    fn switch_on(self) -> &'static str {
        match self {
            Load::Laser => "$32=1\nM3S500\nG1X1F6000\n",
            Load::Spindle => "M3S500\n",
            Load::Coolant => "M8\n",
            Load::Heat => "M104S100\n",
            Load::Output => "M64P0\n",
            Load::StayingOutput => "M64P1\n",
        }
    }

    /// The settings of its times.
    fn settings(self) -> (&'static str, &'static str) {
        match self {
            Load::Laser => ("$707", "$724"),
            Load::Spindle => ("$720", "$725"),
            Load::Coolant => ("$721", "$726"),
            Load::Heat => ("$722", "$727"),
            Load::Output | Load::StayingOutput => ("$723", "$728"),
        }
    }
}

/// The states, each with the lines that lead into it and the state that reports show.
const STATES: [(&str, &[&[u8]], &str); 11] = [
    ("in motion", &[b"G1X1000F60\n"], "Run"),
    ("in a wait for heat", &[b"M190S100\n"], "Run"),
    ("in a dwell", &[b"G4P1000\n"], "Idle"),
    ("at rest", &[], "Idle"),
    ("held", &[b"G1X1000F600\n", b"!"], "Hold:0"),
    ("at the door", &[b"G1X1000F600\n", b"\x84"], "Door:0"),
    ("in M0", &[b"M0\n"], "Hold:0"),
    ("in M6", &[b"M6T1\n"], "Hold:0"),
    ("in an alarm", &[b"G38.2X1.5F6000\n"], "Alarm"),
    ("in check mode", &[b"$C\n"], "Check"),
    ("asleep", &[b"$SLP\n"], "Sleep"),
];

/// The fate of each load in each of [`STATES`] without its sender: it keeps on (K), goes off
/// after its time (T), or is off already as soon as the state is entered (D).
const LOADS: [(Load, &str); 6] = [
    (Load::Laser, "KKKTDDDDDDD"),
    (Load::Spindle, "KKKTTDTDTTD"),
    (Load::Coolant, "KKKTTDTDTTD"),
    (Load::Heat, "KKTTTTTTDTD"),
    (Load::Output, "KKKTDDDDDTD"),
    (Load::StayingOutput, "KKKTTTTTDTT"),
];

/// The behaviour of the lines after the state is entered.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Event {
    /// Nothing comes.
    Silence,
    /// The job's line asks for reports each second, and sends no G-code.
    Poller,
    /// Another line asks for reports each second.
    Stranger,
    /// The job's line closes, and another line asks for reports each second.
    Gone,
}

/// A machine with a load on, in a state.
fn in_state(load: Load, state: usize, test: impl FnOnce(&mut Session<'_>)) {
    session(&format!("{MACHINE}{TIMES}"), |session| {
        session.send(0, load.switch_on());
        session.wait_ms(300);
        assert!(session.is_on(load), "{load:?}");
        let (_, lines, shown) = STATES[state];
        for line in lines {
            session.send(0, line);
            session.wait_ms(500);
        }
        assert_eq!(session.state(), shown, "{load:?} {state}");
        test(session);
    });
}

fn walk(event: Event, test: impl Fn(&mut Session<'_>, Load, char)) {
    for (load, row) in LOADS {
        for (state, fate) in row.chars().enumerate() {
            println!("{event:?}: {load:?} {}: {fate}", STATES[state].0);
            in_state(load, state, |session| test(session, load, fate));
        }
    }
}

/// Lets seconds pass, with what the lines send meanwhile.
fn pass(session: &mut Session<'_>, event: Event, seconds: u64) {
    for _ in 0..seconds {
        match event {
            Event::Silence => {}
            Event::Poller => session.send(0, "?"),
            Event::Stranger | Event::Gone => session.send(1, "?"),
        }
        session.wait_ms(990);
    }
}

fn check(session: &mut Session<'_>, event: Event, load: Load, fate: char) {
    if event == Event::Gone {
        session.desk.0[0].leaves = true;
        session.wait_ms(10);
    }
    let (before, after) = if event == Event::Poller {
        (15, 8)
    } else {
        (3, 4)
    };
    pass(session, event, before);
    assert_eq!(session.is_on(load), fate != 'D', "before the time");
    pass(session, event, after);
    assert_eq!(session.is_on(load), fate == 'K', "after the time");
    pass(session, event, 60);
    assert_eq!(session.is_on(load), fate == 'K', "much later");
    let (silence, unfed) = load.settings();
    let why = match (event, load) {
        (Event::Poller, _) => format!("no G-code has come ({unfed})]"),
        (_, Load::Heat | Load::Output | Load::StayingOutput) => {
            format!("their sender is silent ({silence})]")
        }
        _ => format!("its sender is silent ({silence})]"),
    };
    let expected = if fate == 'T' { vec![why] } else { vec![] };
    assert_eq!(session.said(load), expected);
}

#[test]
fn a_silent_sender_s_loads_go_off_in_each_state_in_which_they_are_left_to_themselves() {
    walk(Event::Silence, |session, load, fate| {
        check(session, Event::Silence, load, fate);
    });
}

#[test]
fn reports_that_are_asked_for_keep_no_load_on_for_ever() {
    walk(Event::Poller, |session, load, fate| {
        check(session, Event::Poller, load, fate);
    });
}

#[test]
fn another_line_that_asks_for_reports_keeps_nothing_on() {
    walk(Event::Stranger, |session, load, fate| {
        check(session, Event::Stranger, load, fate);
    });
}

#[test]
fn the_loads_of_a_sender_that_goes_away_are_those_of_a_silent_one_whoever_asks() {
    walk(Event::Gone, |session, load, fate| {
        // A laser at rest is M5 at once.
        let fate = if load == Load::Laser && fate == 'T' {
            'D'
        } else {
            fate
        };
        check(session, Event::Gone, load, fate);
    });
}

#[test]
fn a_reset_switches_every_load_off_in_every_state() {
    for (load, _) in LOADS {
        for (state, (name, ..)) in STATES.iter().enumerate() {
            in_state(load, state, |session| {
                session.send(0, [0x18]);
                session.wait_ms(300);
                assert!(!session.is_on(load), "{load:?} {name}");
                pass(session, Event::Silence, 30);
                assert!(!session.is_on(load), "{load:?} {name}");
                assert_eq!(session.said(load), [""; 0]);
            });
        }
    }
}

#[test]
fn restored_defaults_switch_every_load_off() {
    for (load, _) in LOADS {
        for what in ["$RST=*\n", "$RST=$\n", "$RST=#\n"] {
            in_state(load, 3, |session| {
                session.send(0, what);
                session.wait_ms(500);
                assert!(!session.is_on(load), "{load:?} {what}");
            });
        }
    }
}

#[test]
fn a_heater_that_went_off_gets_cold() {
    in_state(Load::Heat, 3, |session| {
        session.wait_ms(4_000);
        let (warm, _) = session.nozzle();
        session.wait_ms(120_000);
        let (cold, target) = session.nozzle();
        assert_eq!(target, 0.0);
        assert!(cold < 30.0 && warm > 35.0, "{warm} {cold}");
    });
}

#[test]
fn what_a_program_needs_is_back_with_a_resume_and_nothing_is_cut_without_it() {
    for load in [
        Load::Spindle,
        Load::Coolant,
        Load::Output,
        Load::StayingOutput,
    ] {
        for state in [3, 4, 6] {
            in_state(load, state, |session| {
                pass(session, Event::Silence, 10);
                assert!(!session.is_on(load));
                assert_eq!(session.state(), "Hold:0", "{load:?}");
                session.send(0, "G1X1F60\n");
                session.wait_ms(1_000);
                assert_eq!(session.state(), "Hold:0", "{load:?}");
                session.send(0, "~");
                session.wait_ms(1_000);
                assert!(session.is_on(load), "{load:?} {state}");
                // A spindle takes 4 s to speed up ($712), and motion waits for it.
                if load == Load::Spindle {
                    assert_eq!(session.state(), "Hold:0", "{state}");
                    session.wait_ms(4_000);
                }
                assert!(["Run", "Idle"].contains(&session.state().as_str()));
            });
        }
    }
}

#[test]
fn heaters_that_went_off_in_a_hold_are_warm_again_before_the_job_goes_on() {
    for (state, running) in [(4, "Run"), (5, "Run"), (6, "Idle"), (7, "Idle")] {
        in_state(Load::Heat, state, |session| {
            let held = session.state();
            session.send(0, "M105\n");
            pass(session, Event::Silence, 60);
            assert_eq!(session.nozzle().1, 0.0, "{held}");
            session.send(0, "~");
            assert_eq!(session.nozzle().1, 100.0, "{held}");
            assert_eq!(session.state(), held);
            for _ in 0..30 {
                session.wait_ms(1_000);
                session.send(0, "~");
            }
            session.wait_ms(6_000);
            assert!(session.nozzle().0 > 97.0);
            assert_eq!(session.state(), running, "{held}");
        });
    }
}

#[test]
fn a_reset_forgets_heaters_that_went_off_in_a_hold() {
    in_state(Load::Heat, 4, |session| {
        pass(session, Event::Silence, 10);
        session.send(0, [0x18]);
        session.wait_ms(100);
        session.send(0, "$X\n~");
        session.wait_ms(1_000);
        assert_eq!(session.nozzle().1, 0.0);
    });
}

#[test]
fn with_stock_times_heat_ends_after_five_minutes_and_spindle_coolant_and_outputs_do_not() {
    session(MACHINE, |session| {
        session.send(0, "M104S100\nM3S500\nM8\nM64P0\n");
        session.wait_ms(290_000);
        assert!(session.is_on(Load::Heat));
        session.wait_ms(20_000);
        assert!(!session.is_on(Load::Heat));
        session.wait_ms(3_600_000);
        for load in [Load::Spindle, Load::Coolant, Load::Output] {
            assert!(session.is_on(load), "{load:?}");
        }
        assert_eq!(session.state(), "Idle");
    });
}

#[test]
fn with_stock_times_a_poller_keeps_heat_for_half_an_hour_and_a_beam_for_a_minute() {
    session(MACHINE, |session| {
        session.send(0, "M104S100\n");
        pass(session, Event::Poller, 1_790);
        assert!(session.is_on(Load::Heat));
        pass(session, Event::Poller, 20);
        assert!(!session.is_on(Load::Heat));
        session.send(0, Load::Laser.switch_on());
        pass(session, Event::Poller, 55);
        assert!(session.is_on(Load::Laser));
        pass(session, Event::Poller, 10);
        assert!(!session.is_on(Load::Laser));
    });
}

#[test]
fn g_code_keeps_every_load_on() {
    for (load, _) in LOADS {
        in_state(load, 3, |session| {
            for _ in 0..60 {
                session.send(0, "G4P0\n");
                session.wait_ms(1_000);
                assert!(session.is_on(load), "{load:?}");
            }
        });
    }
}

#[test]
fn no_time_is_never() {
    let never = "[laser]\ndead_man_s = 0\n[dead_man]\nheat_s = 0\n";
    session(&format!("{MACHINE}{never}"), |session| {
        session.send(0, "M104S100\n");
        session.send(0, Load::Laser.switch_on());
        session.wait_ms(7_200_000);
        assert!(session.is_on(Load::Heat) && session.is_on(Load::Laser));
    });
}

#[test]
fn a_print_of_hours_keeps_its_heat() {
    session(&format!("{MACHINE}{TIMES}"), |session| {
        session.send(0, "M104S100\nG1X200F2\n");
        session.wait_ms(5_900_000);
        assert_eq!(session.state(), "Run");
        assert!(session.is_on(Load::Heat));
        session.wait_ms(200_000);
        assert!(!session.is_on(Load::Heat));
    });
}

#[test]
fn whoever_sends_g_code_next_feeds_the_loads_of_one_who_has_gone() {
    in_state(Load::Heat, 3, |session| {
        session.desk.0[0].leaves = true;
        session.send(1, "G4P0\n");
        for _ in 0..15 {
            session.wait_ms(1_000);
            assert!(session.is_on(Load::Heat)); // asks for a report on line 1
        }
        session.wait_ms(5_100);
        assert!(!session.is_on(Load::Heat));
    });
}
