//! Limit switches whose contacts bounce, on a board that filters its inputs for the time of `$706`.
//! Homing finds the same place, and only a switch that closes raises a hard limit.

use leadscrew_planner::Cartesian;
use leadscrew_sim::plant::{Pin, Side, Switch};
use leadscrew_sim::{Contacts, Memory, Setup};
use leadscrew_tests::{setup, Session};

type Desk<'a> = Session<'a, Cartesian, 3>;

const SETTINGS: &str = "$100=80\n$101=80\n$102=80\n$110=3000\n$111=3000\n$112=3000\n\
                        $120=500\n$121=500\n$122=500\n$22=1\n$24=100\n$25=1500\n$26=10\n$27=2\n";

/// The time for which a contact bounces and the time of the filter, µs.
const PAIRS: [(u16, u16); 7] = [
    (0, 0),
    (500, 0),
    (500, 200),
    (500, 1000),
    (3000, 0),
    (3000, 1000),
    (3000, 5000),
];

/// The place at which the switches close, in steps: 5 mm.
const PLACE: i32 = 400;

fn bouncing(bounce_us: u16) -> Setup<3> {
    let mut setup = setup::<3>(1);
    setup.contacts = Contacts {
        bounce_us,
        filtered: true,
    };
    setup
}

/// A machine with a switch at the positive end of each axis.
fn with_switches<'a>(memory: &'a mut Memory<3, 3>, setup: &Setup<3>, filter_us: u16) -> Desk<'a> {
    let mut session = Session::new(memory, setup, Cartesian);
    session.stream(SETTINGS);
    session.stream(&format!("$706={filter_us}\n"));
    for motor in 0..3 {
        session.sim.add_switch(Switch {
            pin: Pin::Limit(motor),
            motor,
            side: Side::AtOrAbove,
            place: PLACE,
            level: false,
        });
    }
    session.until_quiet();
    session
}

fn alarms(heard: &[String]) -> usize {
    heard.iter().filter(|line| *line == "ALARM:1").count()
}

#[test]
fn homing_finds_the_same_place_however_long_a_switch_bounces() {
    for (bounce, filter) in PAIRS {
        let setup = bouncing(bounce);
        let mut memory = Memory::new(&setup);
        let mut session = with_switches(&mut memory, &setup, filter);
        session.stream("$21=1\n");
        let places = [(); 2].map(|()| {
            assert_eq!(session.say("$H\n"), ["ok"], "{bounce} us, $706={filter}");
            session.sim.board().plant.position()
        });
        // The axis has pulled off by $27 from the place at which the switch was found. That is at
        // most one filter time after the first edge, at the speed of $24.
        let late = 1 + i32::from(filter.max(bounce) / 5000);
        for place in &places {
            for axis in place {
                let off = *axis - (PLACE - 160);
                assert!(
                    (0..=late).contains(&off),
                    "{bounce} us, $706={filter}: {off}"
                );
            }
        }
        assert_eq!(places[0], places[1], "{bounce} us, $706={filter}");
    }
}

#[test]
fn a_switch_that_closes_in_motion_is_one_alarm_however_long_it_bounces() {
    for (bounce, filter) in PAIRS {
        let setup = bouncing(bounce);
        let mut memory = Memory::new(&setup);
        let mut session = with_switches(&mut memory, &setup, filter);
        session.stream("$21=1\n");
        let heard = session.say("G1X20F600\n");
        assert_eq!(alarms(&heard), 1, "{bounce} us, $706={filter}: {heard:?}");
        // The axis makes 0.8 steps a millisecond. A filter that reads the old level during a bounce
        // starts again.
        let beyond = session.sim.board().plant.position()[0] - PLACE;
        let within = i32::from((filter + bounce) / 1250) + 1;
        assert!(
            (0..=within).contains(&beyond),
            "{bounce} us, $706={filter}: {beyond}"
        );
    }
}

/// Grbl raises ALARM:1 at either edge. Here a switch that opens raises none, unless it closes again
/// as it bounces.
#[test]
fn a_switch_that_bounces_as_it_opens_is_no_alarm_where_the_filter_is_longer() {
    for (bounce, filter) in PAIRS {
        let setup = bouncing(bounce);
        let mut memory = Memory::new(&setup);
        let mut session = with_switches(&mut memory, &setup, filter);
        assert_eq!(session.say("G1X5.5F600\n"), ["ok"]);
        session.stream("$21=1\n");
        // No program starts while a limit switch is closed.
        let heard = session.say("$J=X0F500\n");
        let expected = usize::from(bounce > filter && filter == 0);
        if filter == 0 || filter >= bounce {
            assert_eq!(
                alarms(&heard),
                expected,
                "{bounce} us, $706={filter}: {heard:?}"
            );
        }
    }
}
