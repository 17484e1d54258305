//! Times the simulation of a whole job, from its bytes to its pins, without writing anything.
//!
//!     python3 bench/workloads/gen.py /tmp
//!     cargo run --profile fast -p leadscrew-sim --example time_a_job -- /tmp/spiral.gcode
//!
//! Settings may stand at the head of the file (`$110=2000`). For comparison, the program also times
//! a loop that only reads the same step events, one after the other.

use leadscrew_machine::config::MachineConfig;
use leadscrew_planner::Cartesian;
use leadscrew_sim::{
    Answers, Cycle, Memory, Observer, Outcome, Rate, Setup, Simulation, StepEvent, Streamer,
    Streaming,
};
use std::hint::black_box;
use std::process::ExitCode;
use std::time::Instant;

/// The number of runs; the fastest one's time is printed.
const RUNS: usize = 3;

/// Keeps all step events.
#[derive(Default)]
struct Events(Vec<StepEvent>);

impl Observer for Events {
    fn step(&mut self, event: &StepEvent) {
        self.0.push(*event);
    }
}

fn simulate<O: Observer>(program: &[u8], observer: O) -> (Outcome<3>, O) {
    let setup = Setup::<3>::new(MachineConfig::new(), Rate::NeverWaits);
    let mut memory = Memory::new(&setup);
    let mut sim: Simulation<'_, _, _, 3, 3, 1024> =
        Simulation::new(&mut memory, &setup, Cartesian, observer);
    let streaming = Streaming {
        window: 1024,
        keep_going: false,
    };
    let mut host = Streamer::new(program, streaming, Answers::default());
    sim.run_until(&mut host, Cycle::NEVER);
    sim.finish()
}

/// The time of the fastest of the runs, in seconds.
fn fastest(mut run: impl FnMut()) -> f64 {
    let times = (0..RUNS).map(|_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

fn main() -> ExitCode {
    let Some(file) = std::env::args().nth(1) else {
        eprintln!("usage: time_a_job FILE");
        return ExitCode::from(2);
    };
    let program = match std::fs::read(&file) {
        Ok(program) => program,
        Err(error) => {
            eprintln!("{file}: {error}");
            return ExitCode::from(2);
        }
    };
    let job = fastest(|| drop(black_box(simulate(&program, ()))));
    let (outcome, Events(events)) = simulate(&program, Events::default());
    let empty = fastest(|| {
        for event in &events {
            black_box(event);
        }
    });
    let steps = outcome.dominant_step_events as f64;
    println!(
        "job                   {:>12.1} s simulated",
        outcome.job_seconds
    );
    println!("dominant step events  {:>12}", outcome.dominant_step_events);
    println!("step events           {:>12}", outcome.step_events);
    println!("smoothing ticks       {:>12}", outcome.smoothing_ticks);
    println!(
        "late, violations      {:>12}, {}",
        outcome.late.count(),
        outcome.violations.count()
    );
    println!("time                  {job:>12.3} s");
    println!(
        "dominant step events  {:>12.2} million a second",
        steps / job / 1e6
    );
    println!("empty loop            {:>12.0} times as fast", job / empty);
    ExitCode::SUCCESS
}
