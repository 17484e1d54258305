//! Step pulses and directions.
use crate::{
    board::Board,
    edges::{Edges, Pulse, PER_US},
    failure::Failure,
    plan::{plan, Plan, Planned},
    report::Row,
    wires::Signal,
};

/// The time by which edges may be off the schedule, µs: 40 cycles, as `cargo fw-test jitter`
/// allows, and a count of the capture.
const JITTER_US: f64 = 0.25;
/// The most by which a pulse is longer if its end has to wait for a tick, µs. It is longest when
/// the tick begins a line (`crates/board-f407/src/step_port.rs`).
const PROLONGED_US: f64 = 3.2;
/// The time before and after a step for which a driver needs the direction to be stable, µs (TI
/// DRV8825, SLVSA73F: 0.65).
const SETTLED_US: f64 = 0.65;
/// The time before a step at which a direction must be set by the settings (`$709`), µs.
const SETUP_US: f64 = 20.0;
/// Motion begins when nothing has come for 0.5 s. Then the whole job has come, and the board plans
/// it as the simulator does.
const AFTER_ALL: &str = "$701=500\n";

/// X and Y at up to 60 000 steps/s. At corners of 90° X reverses at full speed: its next step comes
/// soon.
const SETTINGS: &str = "$0=3\n$11=2\n$704=1\n$709=20\n$100=250\n$101=250\n$102=250\n\
                        $110=24000\n$111=24000\n$112=24000\n$120=5000\n$121=5000\n$122=5000\n";
const JOB: &str = "G91\nG1X3Y1F24000\nX2Y2\nX-2Y2\nX-1.5Z1\nX1Y1\nX-1Y1\nX1Y-1\nX-0.01\nX0.02\n";
const PULSE_US: f64 = 3.0;

/// From rest to 370 000 steps/s and back in 6500 steps.
const FAST_SETTINGS: &str =
    "$0=1\n$100=250\n$101=250\n$102=250\n$110=96000\n$111=96000\n$112=96000\n\
                             $120=110000\n$121=110000\n$122=110000\n";
const FAST_JOB: &str = "G91\nG1X10Y10Z10F200000\nX12Y12Z12\n";
/// The highest rate, steps a second.
const FASTEST: f64 = 370_000.0;

/// Runs a job while edges are captured.
fn run(
    board: &mut Board<'_>,
    settings: &str,
    job: &str,
    signals: &[Signal],
) -> Result<Vec<Edges>, Failure> {
    board.stream(settings)?;
    board.stream(AFTER_ALL)?;
    board.capture(signals)?;
    board.run(job)?;
    signals.iter().map(|one| board.edges(*one)).collect()
}

/// The schedule of the job in the simulator.
fn planned(settings: &str, job: &str) -> Result<Plan, Failure> {
    plan(&format!("{settings}{AFTER_ALL}"), job)
}

/// Converts counts to µs.
fn us(counts: f64) -> f64 {
    counts / PER_US
}

/// Compares pulses with planned steps: their number, their instants counted from the first, their
/// widths.
fn compare(pulses: &[Pulse], planned: &[Planned], pulse_us: f64) -> Vec<Row> {
    let mut rows = vec![Row::equal("steps", pulses.len(), planned.len())];
    let mut late = pulses
        .iter()
        .zip(planned)
        .map(|(pulse, plan)| pulse.rise as f64 - plan.due as f64);
    let (least, most) = extremes(late.clone());
    let latest = late.position(|one| one == most).unwrap_or(0);
    let jitter = Row::within(
        "instants of steps against the simulator's, latest less earliest",
        us(most - least),
        0.0,
        JITTER_US,
        "us",
    );
    rows.push(jitter.noting(format_args!("latest is step {latest}")));
    let widths = pulses.iter().map(|pulse| (pulse.fall - pulse.rise) as f64);
    let (least, most) = extremes(widths);
    let longest = pulse_us + PROLONGED_US;
    let range = |what: &str, counts| Row::within(what, us(counts), pulse_us, longest, "us");
    rows.push(range("shortest pulse", least));
    rows.push(range("longest pulse", most));
    rows
}

/// Returns how much later edges come than planned: the least and the most. The edges and the plan
/// count from different origins.
fn offsets(edges: impl Iterator<Item = u64>, planned: impl Iterator<Item = u64>) -> (f64, f64) {
    let pairs = edges.zip(planned);
    extremes(pairs.map(|(edge, plan)| edge as f64 - plan as f64))
}

/// The least and the most of some figures; 0 and infinity if there are none.
fn extremes(figures: impl Iterator<Item = f64>) -> (f64, f64) {
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    let found = figures.fold(start, |(least, most), one| (least.min(one), most.max(one)));
    match found.0 <= found.1 {
        true => found,
        false => (0.0, f64::INFINITY),
    }
}

/// Checks every step of X, and its direction.
pub(super) fn with_direction(board: &mut Board<'_>) -> Result<Vec<Row>, Failure> {
    let signals = [Signal::StepX, Signal::DirectionX];
    let captured = run(board, SETTINGS, JOB, &signals)?;
    let plan = planned(SETTINGS, JOB)?;
    let (pulses, planned) = (captured[0].pulses(), plan.of(0));
    let mut rows = compare(&pulses, &planned, PULSE_US);
    let direction = captured[1].clone().beside(&captured[0]);
    let steps = pulses.iter().zip(&planned);
    let wrong = steps.filter(|(pulse, plan)| {
        let negative = plan.negative & 1 != 0;
        direction.level_at(pulse.rise) != negative
    });
    rows.push(Row::equal("steps in the other direction", wrong.count(), 0));
    let (turns, planned_turns) = (direction.counts(), plan.turns());
    rows.push(Row::equal(
        "changes of the direction",
        turns.len(),
        planned_turns.len(),
    ));
    let (_, latest_step) = offsets(
        pulses.iter().map(|one| one.rise),
        planned.iter().map(|one| one.due),
    );
    let (_, latest_turn) = offsets(turns.iter().copied(), planned_turns.iter().copied());
    rows.push(Row::within(
        "the latest of them behind the latest step, against the simulator's",
        us(latest_turn - latest_step),
        -JITTER_US,
        PROLONGED_US,
        "us",
    ));
    let (before, after) = settled(&pulses, turns);
    let at_least = |what: &str, counts, least| Row::at_least(what, us(counts), least, "us");
    rows.push(at_least(
        "direction to the next step, shortest",
        before,
        SETUP_US,
    ));
    rows.push(at_least(
        "step to a change of direction, shortest",
        after,
        SETTLED_US,
    ));
    Ok(rows)
}

/// The shortest time from a change of the direction to the next step, and from a step to the next
/// change, counts.
fn settled(pulses: &[Pulse], changes: &[u64]) -> (f64, f64) {
    let (mut before, mut after) = (f64::MAX, f64::MAX);
    for change in changes {
        let next = pulses.partition_point(|pulse| pulse.rise < *change);
        if let Some(pulse) = pulses.get(next) {
            before = before.min((pulse.rise - change) as f64);
        }
        if let Some(pulse) = next.checked_sub(1).and_then(|last| pulses.get(last)) {
            after = after.min((change - pulse.rise) as f64);
        }
    }
    (before, after)
}

/// Checks every step of Y.
pub(super) fn second_motor(board: &mut Board<'_>) -> Result<Vec<Row>, Failure> {
    let captured = run(board, SETTINGS, JOB, &[Signal::StepY])?;
    let planned = planned(SETTINGS, JOB)?.of(1);
    Ok(compare(&captured[0].pulses(), &planned, PULSE_US))
}

/// Checks every step of X at the highest rate of three motors.
pub(super) fn highest_rate(board: &mut Board<'_>) -> Result<Vec<Row>, Failure> {
    let captured = run(board, FAST_SETTINGS, FAST_JOB, &[Signal::StepX])?;
    let pulses = captured[0].pulses();
    let mut rows = compare(&pulses, &planned(FAST_SETTINGS, FAST_JOB)?.of(0), 1.0);
    let spans = pulses.windows(9).map(|eight| eight[8].rise - eight[0].rise);
    let rate = 8e6 / us(spans.min().unwrap_or(u64::MAX) as f64);
    let (least, most) = (0.99 * FASTEST, 1.01 * FASTEST);
    rows.push(Row::within(
        "fastest eight steps",
        rate,
        least,
        most,
        "steps/s",
    ));
    Ok(rows)
}
