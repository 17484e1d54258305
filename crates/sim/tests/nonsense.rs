//! Setups that no machine has: the simulation ends, answers what it can, and panics nowhere.

use leadscrew_machine::config::MachineConfig;
use leadscrew_planner::Cartesian;
use leadscrew_sim::cost::Costs;
use leadscrew_sim::{
    Answers, Contacts, Cycle, Memory, Rate, Setup, Simulation, Streamer, Streaming,
};
use std::num::NonZeroU32;

const JOB: &[u8] = b"G1X1F600\nG2X3I1\n$X\n$120=0\nG91G0X-3\n";
/// Two seconds at 168 MHz: the job takes half a second.
const END: Cycle = Cycle(336_000_000);

/// Streams the job; returns the lines answered with `ok`, and the steps made.
fn run(setup: &Setup<3>, window: usize) -> (u64, u64) {
    let mut memory = Memory::<3, 3, 16>::new(setup);
    let mut sim = Simulation::new(&mut memory, setup, Cartesian, ());
    let streaming = Streaming {
        window,
        keep_going: true,
    };
    let mut host = Streamer::new(JOB, streaming, Answers::default());
    sim.run_until(&mut host, END);
    let (outcome, ()) = sim.finish();
    (host.replies().lines, outcome.step_events)
}

fn usual() -> Setup<3> {
    Setup::new(MachineConfig::new(), Rate::NeverWaits)
}

#[test]
fn a_window_of_nothing_or_of_everything_sends_line_after_line() {
    let expected = run(&usual(), 128);
    assert_eq!(expected.0, 5);
    assert!(expected.1 > 0);
    for window in [0, 1, usize::MAX] {
        assert_eq!(run(&usual(), window), expected, "{window}");
    }
}

#[test]
fn a_receive_buffer_of_any_size_and_lines_of_any_number_panic_nowhere() {
    for receive_buffer in [0, 1, 1 << 20, usize::MAX] {
        for lines in 0..12 {
            for rate in [
                Rate::NeverWaits,
                Rate::Baud(NonZeroU32::MIN),
                Rate::Baud(NonZeroU32::MAX),
            ] {
                let setup = Setup {
                    lines: vec![rate; lines],
                    receive_buffer,
                    ..usual()
                };
                run(&setup, 1);
            }
        }
    }
}

#[test]
fn a_cpu_of_no_cost_or_of_endless_cost_and_contacts_that_bounce_for_ever_panic_nowhere() {
    let usual_costs = Costs::F407;
    let most = u32::MAX;
    let slow = [
        Costs {
            step: most,
            ..usual_costs
        },
        Costs {
            step_armed: most,
            step_edge: most,
            ..usual_costs
        },
        Costs {
            load: most,
            load_line: most,
            run_out: most,
            ..usual_costs
        },
        Costs {
            poll: most,
            ..usual_costs
        },
        Costs {
            line: most,
            byte: most,
            byte_in: most,
            byte_out: most,
            ..usual_costs
        },
        Costs {
            segment: most,
            planned_move: most,
            report: most,
            ..usual_costs
        },
        Costs::NONE,
    ];
    for costs in slow {
        for bounce_us in [0, u16::MAX] {
            let contacts = Contacts {
                bounce_us,
                filtered: bounce_us != 0,
            };
            let setup = Setup {
                costs,
                contacts,
                ..usual()
            };
            run(&setup, 128);
        }
    }
}
